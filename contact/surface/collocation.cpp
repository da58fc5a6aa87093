#include "contact/surface/collocation.hpp"

#include "contact/surface/facets.hpp"
#include "contact/surface/multipliers.hpp"
#include "contact/surface/nearest_face.hpp"
#include "contact/surface/smooth_normals.hpp"
#include "mesh/base/index.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace amontons {
namespace {

/// What one face adds to a node's multiplier.
struct Patch {
    Vec3 normal = Vec3::Zero(); ///< of the face in the middle, unit
    double area = 0;            ///< int psi [m^2]
};

/// The nodes of a surface that carry multipliers.
struct Carriers {
    std::vector<std::int32_t> node;
    std::vector<std::size_t> begin; ///< of each in `patch`, and the end
    std::vector<Patch> patch;

    std::span<const Patch> of(std::size_t i) const
    {
        return std::span(patch).subspan(begin[i], begin[i + 1] - begin[i]);
    }
};

/// @param requested  of each of the surface's used nodes: whether its patches are requested; empty:
/// all
Carriers carriers_of(const ExternalSurface& surface, std::span<const Vec3> places,
                     std::span<const char> requested = {})
{
    const auto is_requested = [&](std::int32_t number) {
        return requested.empty() || requested[at(number)] != 0;
    };
    struct Part {
        std::int32_t node;
        Patch patch;
    };
    std::vector<Part> parts;
    std::vector<std::size_t> count(surface.used_nodes.size() + 1, 0);
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const std::span<const std::int32_t> nodes = surface.face(f);
        if (std::none_of(nodes.begin(), nodes.end(), [&](std::int32_t node) {
                return is_requested(surface.surface_nodes[at(node)]);
            }))
            continue;
        const FaceInPlane face(nodes, places);
        const FaceMultipliers m = face_multipliers(face);
        const FaceSpot middle = spot(face, face.nodes == 4 ? Vec2(0, 0) : Vec2(1. / 3, 1. / 3));
        const Vec3 normal = middle.along[0].cross(middle.along[1]).normalized();
        for (int i = 0; i < m.count; ++i) {
            const auto k = static_cast<std::size_t>(i);
            const std::int32_t number =
                surface.surface_nodes[at(nodes[static_cast<std::size_t>(m.node[k])])];
            if (!is_requested(number)) continue;
            parts.push_back({number, {normal, m.full[k]}});
            ++count[at(number) + 1];
        }
    }
    std::partial_sum(count.begin(), count.end(), count.begin());
    Carriers out;
    out.patch.resize(parts.size());
    std::vector<std::size_t> next(count.begin(), count.end() - 1);
    for (const Part& p : parts)
        out.patch[next[at(p.node)]++] = p.patch;
    for (std::size_t k = 0; k < surface.used_nodes.size(); ++k)
        if (count[k + 1] > count[k]) {
            out.node.push_back(surface.used_nodes[k]);
            out.begin.push_back(count[k]);
        }
    out.begin.push_back(parts.size());
    return out;
}

/// The sum of the patches that are directed at a normal.
struct FacingSum {
    double area = 0;            ///< [m^2]
    Vec3 normal = Vec3::Zero(); ///< sum of area times normal [m^2]
};

FacingSum facing(std::span<const Patch> patches, const Vec3& normal)
{
    FacingSum sum;
    for (const Patch& p : patches)
        if (p.normal.dot(normal) < -kFacing) {
            sum.area += p.area;
            sum.normal += p.area * p.normal;
        }
    return sum;
}

/// Unit, or zero where the patches enclose the node.
Vec3 mean_normal(std::span<const Patch> patches)
{
    Vec3 sum = Vec3::Zero();
    for (const Patch& p : patches)
        sum += p.area * p.normal;
    return sum.normalized();
}

void append(SurfaceContacts& out, SurfaceContact c, std::span<const StencilEntry> master)
{
    set_tangents(c);
    c.slave_begin = static_cast<std::int32_t>(out.stencil.size());
    out.stencil.push_back({std::int32_t(c.id), 1});
    c.slave_end = c.master_begin = static_cast<std::int32_t>(out.stencil.size());
    out.stencil.insert(out.stencil.end(), master.begin(), master.end());
    c.master_end = static_cast<std::int32_t>(out.stencil.size());
    out.contact.push_back(c);
}

} // namespace

WallSample exit_from(const std::function<WallSample(const Vec3&)>& shape, const Vec3& x,
                     const Vec3& way, double longest)
{
    constexpr int kMost = 60;
    constexpr double kOut = 1e-12; // of the depth
    const WallSample nearest = shape(x);
    if (!(nearest.distance < 0) || way.isZero(0)) return nearest;
    double t = 0;
    WallSample s = nearest;
    // No step of the depth is too long.
    for (int i = 0; i < kMost && t <= longest && s.distance < kOut * nearest.distance; ++i) {
        const double along = s.normal.dot(way);
        // On a flat side the first step along its normal is the whole way.
        const double whole = along > kFacing ? -s.distance / along : 0;
        if (whole > 0 && shape(x + (t + whole) * way).distance <= -kOut * nearest.distance)
            t += whole;
        else
            t -= s.distance;
        s = shape(x + t * way);
    }
    if (t > longest || s.normal.dot(way) < kFacing) return nearest;
    s.distance -= t * s.normal.dot(way);
    return s;
}

SurfaceContacts wall_contacts(const ExternalSurface& slave, std::span<const Vec3> places,
                              const std::function<WallSample(const Vec3&)>& wall, double reach)
{
    // Only of nodes that are near it: there are few.
    std::vector<WallSample> samples(slave.used_nodes.size());
    std::vector<char> near(slave.used_nodes.size(), 0);
    bool any = false;
    for (std::size_t k = 0; k < samples.size(); ++k) {
        samples[k] = wall(places[at(slave.used_nodes[k])]);
        near[k] = std::abs(samples[k].distance) <= reach;
        any |= near[k] != 0;
    }
    SurfaceContacts out;
    if (!any) return out;
    const Carriers carriers = carriers_of(slave, places, near);
    for (std::size_t i = 0; i < carriers.node.size(); ++i) {
        SurfaceContact c;
        c.id = carriers.node[i];
        c.point = places[at(carriers.node[i])];
        WallSample sample = samples[at(slave.surface_nodes[at(carriers.node[i])])];
        // Pressed in beside an edge of the shape: not out through the side behind it.
        if (sample.distance < 0 && !(facing(carriers.of(i), sample.normal).area > 0))
            sample = exit_from(wall, c.point, -mean_normal(carriers.of(i)), reach);
        c.gap = sample.distance;
        c.normal = sample.normal;
        // No node may enter an obstacle, in whatever direction its faces are oriented (the tip of a
        // needle).
        c.area = facing(carriers.of(i), c.normal).area;
        if (!(c.area > 0))
            for (const Patch& p : carriers.of(i))
                c.area += p.area;
        if (c.area > 0) append(out, c, {});
    }
    return out;
}

SurfaceContacts nodal_contacts(const ExternalSurface& slave, std::span<const Vec3> slave_places,
                               const ExternalSurface& master, std::span<const Vec3> master_places,
                               double reach, bool smooth_normals)
{
    const Carriers carriers = carriers_of(slave, slave_places);
    std::optional<SmoothNormals> smooth;
    if (smooth_normals) smooth.emplace(master, master_places);
    const FacetTree faces(facets_of(master, master_places));
    const NearestFace near(faces);
    SurfaceContacts out;
    std::vector<StencilEntry> stencil;
    for (std::size_t i = 0; i < carriers.node.size(); ++i) {
        SurfaceContact c;
        c.id = carriers.node[i];
        c.point = slave_places[at(carriers.node[i])];
        const NearestFace::Found hit = near.find(c.point, reach, [&](const Facet& facet) {
            return facing(carriers.of(i), facet.normal).area > 0;
        });
        if (!hit.facet) continue;

        const std::span<const std::int32_t> nodes = master.face(at(hit.facet->face));
        const FaceInPlane face(nodes, master_places);
        const FaceSpot foot = spot(face, nearest_xi(face, c.point, hit.point.xi));
        const Vec3 normal = smooth && smooth->has(hit.facet->face)
                                ? smooth->normal(hit.facet->face, foot.values)
                                : Vec3(foot.along[0].cross(foot.along[1]).normalized());
        const FacingSum own = facing(carriers.of(i), normal);
        if (!(own.area > 0)) continue;
        c.area = own.area;
        c.normal = (normal - own.normal.normalized()).normalized();
        const Vec3 apart = c.point - foot.place;
        c.gap = c.normal.dot(apart);
        if (std::abs(c.gap) > reach || !NearestFace::is_over(apart, c.normal, *hit.facet)) continue;
        if (!hit.on_this_side) continue;
        stencil.clear();
        for (std::size_t l = 0; l < nodes.size(); ++l)
            stencil.push_back({nodes[l], foot.values[static_cast<Eigen::Index>(l)]});
        std::sort(stencil.begin(), stencil.end(),
                  [](const StencilEntry& a, const StencilEntry& b) { return a.node < b.node; });
        append(out, c, stencil);
    }
    return out;
}

} // namespace amontons
