#include "solver/output/view_maker.hpp"

#include "mesh/extract_surface.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <set>

namespace amontons {
namespace {

constexpr std::size_t kMostPairs = 4; // that a caption names

void add_point(std::vector<float>& out, const Vec3& x)
{
    for (int i = 0; i < 3; ++i)
        out.push_back(static_cast<float>(x[i]));
}

void add_triangles(std::vector<std::int32_t>& out,
                   const std::vector<std::array<std::int32_t, 3>>& triangles)
{
    for (const auto& t : triangles)
        out.insert(out.end(), t.begin(), t.end());
}

} // namespace

const ViewMaker::Outside& ViewMaker::outside_of(const BodyRecord& solid)
{
    const auto [at, is_new] = outside_.try_emplace(solid.name);
    if (is_new) {
        const ExternalSurface surface = extract_surface(*solid.elements);
        at->second.nodes = surface.used_nodes;
        TriangulatedSurface flat = triangulate(surface, *solid.elements);
        add_triangles(at->second.triangles, flat.mesh.triangles);
        at->second.faces = std::move(flat.faces);
    }
    return at->second;
}

ViewFrame ViewMaker::frame(double time, const std::vector<BeamRecord>& beams,
                           const std::vector<BodyRecord>& bodies,
                           const std::vector<ContactRecord>& contacts)
{
    ViewFrame f;
    if (!begun_)
        for (const Obstacle& o : obstacles_) {
            ViewShape& s = f.shapes.emplace_back(ViewShape{o.name, ViewShape::wall, {}, {}, {}});
            for (const Vec3& x : o.model.surface->points)
                add_point(s.points, x);
            add_triangles(s.triangles, o.model.surface->triangles);
        }
    for (const BeamRecord& b : beams) {
        ViewShape& s = f.shapes.emplace_back(ViewShape{b.name, ViewShape::wire, {}, {}, {}});
        for (const Vec3& x : b.points)
            add_point(s.points, x);
        if (const Field* radius = find_field(b.fields, "radius"))
            for (const double r : radius->values)
                s.values.push_back(static_cast<float>(r));
    }
    for (const BodyRecord& b : bodies) {
        ViewShape& s = f.shapes.emplace_back(ViewShape{b.name, ViewShape::rigid, {}, {}, {}});
        if (!b.elements) {
            for (const Vec3& x : b.points)
                add_point(s.points, x);
            if (!begun_) add_triangles(s.triangles, b.triangles);
            continue;
        }
        s.kind = ViewShape::solid;
        const Outside& outside = outside_of(b);
        const Field* stress = find_field(b.point_fields, "von_mises_averaged");
        // Without stress a body is plain.
        if (stress &&
            std::ranges::all_of(stress->values, [&](double v) { return v <= b.stress_round_off; }))
            stress = nullptr;
        for (const std::int32_t node : outside.nodes) {
            add_point(s.points, b.points[static_cast<std::size_t>(node)]);
            if (stress)
                s.values.push_back(
                    static_cast<float>(stress->values[static_cast<std::size_t>(node)]));
        }
        if (begun_) continue;
        s.triangles = outside.triangles;
        s.faces = outside.faces;
    }
    double largest = 0;
    std::set<std::string> pairs;
    f.names = bodies_.names;
    for (const ContactRecord& c : contacts) {
        // On the wall of a vessel, as the picture shows it; else on the first body. The caption
        // states which by the names of history.csv: A_on_B is what A exerts on B.
        const auto a = static_cast<std::size_t>(c.body_a), b = static_cast<std::size_t>(c.body_b);
        const bool known = std::max(a, b) < bodies_.names.size();
        const bool on_b = known && bodies_.kinds[a] == "beam" && bodies_.kinds[b] != "beam";
        add_point(f.contacts, c.point);
        add_point(f.contacts, on_b ? Vec3(-c.force) : c.force);
        const Vec3 normal = c.force.dot(c.normal) * c.normal;
        add_point(f.normal_forces, on_b ? Vec3(-normal) : normal);
        f.pairs.insert(f.pairs.end(), {on_b ? c.body_b : c.body_a, on_b ? c.body_a : c.body_b});
        largest = std::max(largest, c.force.norm());
        if (known && pairs.size() <= kMostPairs)
            pairs.insert(bodies_.names[on_b ? a : b] + "_on_" + bodies_.names[on_b ? b : a]);
    }
    f.caption = fmt::format("t = {:.4g} s   {} contacts, largest force {:.3g} N", time,
                            contacts.size(), largest);
    if (!pairs.empty()) f.caption += "\nforce";
    for (const std::string& pair : pairs)
        if (&pair == &*pairs.begin() || pairs.size() <= kMostPairs) f.caption += " " + pair;
    if (pairs.size() > kMostPairs) f.caption += " and others";
    begun_ = true;
    return f;
}

} // namespace amontons
