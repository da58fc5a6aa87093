#include "mesh/generate/solid_tube.hpp"

#include "mesh/base/error.hpp"
#include "mesh/format/text.hpp"
#include "mesh/generate/solid_box.hpp"
#include "mesh/split_elements.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace amontons {
namespace {

struct Section {
    Vec3 centre, across, third; // third = tangent x across
    double radius = 0;
};

/// 2 along + 1 cross-sections: every second one has middle nodes only. Their frame is carried
/// along without twist.
std::vector<Section> sections_of(const SolidTubeOptions& o, std::vector<Issue>& issues)
{
    std::vector<Section> all;
    const Centreline& line = o.centreline;
    Vec3 across = line.at(0.0).tangent.unitOrthogonal();
    for (std::int32_t i = 0; i <= 2 * o.along; ++i) {
        const double s = line.length() * i / (2 * o.along);
        const CurvePoint p = line.at(s);
        across = (across - p.tangent * p.tangent.dot(across)).normalized();
        all.push_back({p.position, across, p.tangent.cross(across), p.radius});
        const double outer = p.radius + o.thickness;
        if (const double bend = p.curvature.norm(); bend * outer >= 1 && issues.empty())
            issues.push_back({"", "/centreline",
                              "a bend of radius " + number_text(1 / bend) + " m at arc length " +
                                  number_text(s) + " m",
                              "more than the outer radius, " + number_text(outer) + " m"});
    }
    return all;
}

std::vector<Issue> issues_of(const SolidTubeOptions& o)
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

VolumeMesh make_solid_tube(const SolidTubeOptions& o)
{
    std::vector<Issue> issues = issues_of(o);
    if (!issues.empty()) throw InputError(std::move(issues));
    const std::vector<Section> sections = sections_of(o, issues);
    if (!issues.empty()) throw InputError(std::move(issues));

    /// @param half_section, half_layer, half_angle  in halves of an element
    const auto point = [&](std::int32_t half_section, std::int32_t half_layer,
                           std::int32_t half_angle) {
        const Section& s = sections[static_cast<std::size_t>(half_section)];
        const double r = s.radius + o.thickness * half_layer / (2. * o.through);
        const double phi = std::numbers::pi * half_angle / o.around;
        return Vec3{s.centre + r * (std::cos(phi) * s.across + std::sin(phi) * s.third)};
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
