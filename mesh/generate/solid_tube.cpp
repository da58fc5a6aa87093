#include "mesh/generate/solid_tube.hpp"

#include "mesh/base/dense.hpp"
#include "mesh/base/error.hpp"
#include "mesh/base/text.hpp"
#include "mesh/generate/solid_box.hpp"
#include "mesh/split_elements.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace amontons {
namespace {

constexpr std::int32_t kParts = 4; // of the frame's way between two sections

void check_bends(const SolidTubeOptions& o, std::vector<Issue>& issues)
{
    for (std::int32_t i = 0; i <= 2 * o.along && issues.empty(); ++i) {
        const double s = o.centreline.length() * i / (2 * o.along);
        const CurvePoint p = o.centreline.at(s);
        const double outer = p.radius + o.thickness;
        if (const double bend = p.curvature.norm(); bend * outer >= 1)
            issues.push_back({"", "/centreline",
                              "a bend of radius " + number_text(1 / bend) + " m at arc length " +
                                  number_text(s) + " m",
                              "more than the outer radius, " + number_text(outer) + " m"});
    }
}

std::vector<Issue> tube_issues(const SolidTubeOptions& o)
{
    std::vector<Issue> issues;
    const auto count = [&](std::int32_t value, std::int32_t least, const char* name) {
        if (value < least || value > 1000000)
            issues.push_back(
                {"", name, std::to_string(value), std::to_string(least) + " to 1000000"});
    };
    if (o.centreline.piece_count() == 0)
        issues.push_back({"", "/centreline", "no pieces", "at least one"});
    if (!(o.thickness > 0) || !std::isfinite(o.thickness))
        issues.push_back({"", "/thickness", number_text(o.thickness), "> 0 and finite [m]"});
    count(o.around, 3, "/around");
    count(o.through, 1, "/through");
    count(o.along, 1, "/along");
    if (const double n = 1. * o.around * o.through * o.along;
        n * 6 > static_cast<double>(kMostElements))
        issues.push_back(
            {"", "", number_text(n) + " cells", "at most " + std::to_string(kMostElements / 6)});
    return issues;
}

} // namespace

namespace {

/// The least turn that takes one tangent into another: none about the line itself.
Vec3 carried(const Vec3& across, const Vec3& from, const Vec3& to)
{
    const Vec3 v = rotation_between(from, to) * across;
    return (v - to * to.dot(v)).normalized();
}

} // namespace

// Between two stations the line stays in one piece, so that least turns from either of them agree:
// exactly along straight lines and arcs.
TubeFrame::TubeFrame(const Centreline& line, std::int32_t parts)
{
    for (std::int32_t i = 0; i <= parts; ++i)
        at_.push_back(line.length() * i / parts);
    for (std::int32_t piece = 1; piece < line.piece_count(); ++piece)
        at_.push_back(line.arc_length({piece, 0, 0}));
    std::sort(at_.begin(), at_.end());
    for (std::size_t i = 0; i < at_.size(); ++i) {
        tangent_.push_back(line.at(at_[i]).tangent);
        across_.push_back(i == 0 ? Vec3(tangent_[0].unitOrthogonal())
                                 : carried(across_[i - 1], tangent_[i - 1], tangent_[i]));
    }
}

Vec3 TubeFrame::across(double s, const Vec3& tangent) const
{
    const auto after = std::upper_bound(at_.begin() + 1, at_.end() - 1, s);
    const auto i = static_cast<std::size_t>(after - at_.begin());
    const double length = at_[i] - at_[i - 1];
    const double t = length > 0 ? std::clamp((s - at_[i - 1]) / length, 0.0, 1.0) : 0;
    return ((1 - t) * carried(across_[i - 1], tangent_[i - 1], tangent) +
            t * carried(across_[i], tangent_[i], tangent))
        .normalized();
}

TubeFrame tube_frame(const SolidTubeOptions& o)
{
    return TubeFrame(o.centreline, 2 * o.along * kParts);
}

std::vector<TubeSection> tube_sections(const SolidTubeOptions& o)
{
    const TubeFrame frame = tube_frame(o);
    std::vector<TubeSection> all;
    for (std::int32_t i = 0; i <= 2 * o.along; ++i) {
        const double s = o.centreline.length() * i / (2 * o.along);
        const CurvePoint p = o.centreline.at(s);
        const Vec3 across = frame.across(s, p.tangent);
        all.push_back({p.position, across, p.tangent.cross(across), p.radius});
    }
    return all;
}

Vec3 tube_point(const SolidTubeOptions& o, const std::vector<TubeSection>& sections,
                std::int32_t half_section, std::int32_t half_layer, std::int32_t half_angle)
{
    const TubeSection& s = sections[static_cast<std::size_t>(half_section)];
    const double r = s.radius + o.thickness * half_layer / (2. * o.through);
    const double phi = std::numbers::pi * half_angle / o.around;
    return s.centre + r * (std::cos(phi) * s.across + std::sin(phi) * s.third);
}

VolumeMesh make_solid_tube(const SolidTubeOptions& o)
{
    std::vector<Issue> issues = tube_issues(o);
    if (!issues.empty()) throw InputError(std::move(issues));
    check_bends(o, issues);
    if (!issues.empty()) throw InputError(std::move(issues));
    const std::vector<TubeSection> sections = tube_sections(o);
    const auto point = [&](std::int32_t half_section, std::int32_t half_layer,
                           std::int32_t half_angle) {
        return tube_point(o, sections, half_section, half_layer, half_angle);
    };
    const std::int32_t ring = o.around, section = ring * (o.through + 1);
    VolumeMesh mesh;
    for (std::int32_t i = 0; i <= o.along; ++i)
        for (std::int32_t j = 0; j <= o.through; ++j)
            for (std::int32_t k = 0; k < ring; ++k)
                mesh.nodes.push_back(point(2 * i, 2 * j, 2 * k));

    ElementBlock block{ElementKind::H8, {}};
    mesh.element_sets = {{"volume", {}}};
    mesh.face_sets = {{"inner", {}}, {"outer", {}}, {"start", {}}, {"end", {}}};
    std::int32_t e = 0;
    for (std::int32_t i = 0; i < o.along; ++i)
        for (std::int32_t j = 0; j < o.through; ++j)
            for (std::int32_t k = 0; k < ring; ++k, ++e) {
                const std::int32_t a = i * section + j * ring + k,
                                   b = i * section + j * ring + (k + 1) % ring;
                for (const std::int32_t level : {0, section})
                    for (const std::int32_t v : {a, a + ring, b + ring, b})
                        block.nodes.push_back(v + level);
                mesh.element_sets[0].members.push_back(e);
                if (j == 0) mesh.face_sets[0].members.push_back({e, 0});             // 0 4 7 3
                if (j == o.through - 1) mesh.face_sets[1].members.push_back({e, 1}); // 1 2 6 5
                if (i == 0) mesh.face_sets[2].members.push_back({e, 4});             // 0 3 2 1
                if (i == o.along - 1) mesh.face_sets[3].members.push_back({e, 5});   // 4 5 6 7
            }
    mesh.blocks.push_back(std::move(block));

    return as_kind(std::move(mesh), o.kind, [&](std::int32_t a, std::int32_t b) {
        const std::int32_t ka = a % ring, kb = b % ring;
        const bool wraps = std::abs(ka - kb) > ring / 2;
        return point(a / section + b / section, a % section / ring + b % section / ring,
                     ka + kb + (wraps ? ring : 0));
    });
}

} // namespace amontons
