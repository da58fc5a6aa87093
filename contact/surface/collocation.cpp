#include "contact/surface/collocation.hpp"

#include "contact/surface/multipliers.hpp"
#include "contact/surface/smooth_normals.hpp"
#include "mesh/closest_point.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace amontons {
namespace {

/// A nearest point belongs to a node if it is off the common normal by no more than this part of
/// their distance: on convex facets it may be, by half the angle between two of them. What is
/// farther off lies on the border of the master, beside the node.
constexpr double kOblique = 0.6;
/// And by this part of a facet's size, for round-off.
constexpr double kRoundOff = 1e-9;

std::size_t at(std::int32_t i)
{
    return static_cast<std::size_t>(i);
}

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

Carriers carriers_of(const ExternalSurface& surface, std::span<const Vec3> places)
{
    struct Part {
        std::int32_t node;
        Patch patch;
    };
    std::vector<Part> parts;
    std::vector<std::size_t> count(surface.used_nodes.size() + 1, 0);
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const std::span<const std::int32_t> nodes = surface.face(f);
        const FaceInPlane face(nodes, places);
        const FaceMultipliers m = face_multipliers(face);
        const FaceSpot middle = spot(face, face.nodes == 4 ? Vec2(0, 0) : Vec2(1. / 3, 1. / 3));
        const Vec3 normal = middle.along[0].cross(middle.along[1]).normalized();
        for (int i = 0; i < m.count; ++i) {
            const auto k = static_cast<std::size_t>(i);
            const std::int32_t number =
                surface.surface_nodes[at(nodes[static_cast<std::size_t>(m.node[k])])];
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

/// The sum of the patches that look at a normal.
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

void append(SurfaceContacts& out, SurfaceContact c, std::span<const StencilEntry> master)
{
    set_tangents(c);
    c.slave_begin = static_cast<std::int32_t>(out.stencil.size());
    out.stencil.push_back({c.id, 1});
    c.slave_end = c.master_begin = static_cast<std::int32_t>(out.stencil.size());
    out.stencil.insert(out.stencil.end(), master.begin(), master.end());
    c.master_end = static_cast<std::int32_t>(out.stencil.size());
    out.contact.push_back(c);
}

/// The point of a facet nearest to x, and where it is on the reference face.
struct FacetPoint {
    Vec3 place;
    Vec2 xi;
};

FacetPoint nearest_on(const Facet& facet, const Vec3& x)
{
    FacetPoint best{Vec3::Constant(std::numeric_limits<double>::infinity()), Vec2::Zero()};
    for (std::size_t k = 1; k + 1 < static_cast<std::size_t>(facet.corners); ++k) {
        const TrianglePoint p =
            closest_on_triangle(x, facet.corner[0], facet.corner[k], facet.corner[k + 1]);
        if ((p.point - x).squaredNorm() < (best.place - x).squaredNorm())
            best = {p.point, p.weights[0] * facet.xi[0] + p.weights[1] * facet.xi[k] +
                                 p.weights[2] * facet.xi[k + 1]};
    }
    return best;
}

} // namespace

SurfaceContacts wall_contacts(const ExternalSurface& slave, std::span<const Vec3> places,
                              const std::function<WallSample(const Vec3&)>& wall, double reach)
{
    const Carriers carriers = carriers_of(slave, places);
    SurfaceContacts out;
    for (std::size_t i = 0; i < carriers.node.size(); ++i) {
        SurfaceContact c;
        c.id = carriers.node[i];
        c.point = places[at(c.id)];
        const WallSample sample = wall(c.point);
        if (!(std::abs(sample.distance) <= reach)) continue;
        c.gap = sample.distance;
        c.normal = sample.normal;
        // No node may enter an obstacle, whichever way its faces look (the tip of a needle).
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
    const std::vector<Facet> facets = facets_of(master, master_places);
    const BoxTree tree(boxes_of(facets));
    SurfaceContacts out;
    std::vector<StencilEntry> stencil;
    for (std::size_t i = 0; i < carriers.node.size(); ++i) {
        SurfaceContact c;
        c.id = carriers.node[i];
        c.point = slave_places[at(c.id)];
        BoundingBox near;
        near.add(c.point + Vec3::Constant(reach));
        near.add(c.point - Vec3::Constant(reach));
        // The nearest facet that the node looks at; and of all, to tell which side it is on.
        const Facet* met = nullptr;
        FacetPoint point;
        double least = std::numeric_limits<double>::infinity(), least_of_all = least;
        bool inside = false;
        tree.visit(near, [&](std::int32_t number) {
            const Facet& facet = facets[at(number)];
            const FacetPoint p = nearest_on(facet, c.point);
            const double distance = (c.point - p.place).squaredNorm();
            if (distance < least_of_all) {
                least_of_all = distance;
                inside = facet.normal.dot(c.point - p.place) < 0;
            }
            // Equally near ones: the first, so that the tree's order does not matter.
            if (distance > least || (distance == least && &facet > met)) return;
            if (!(facing(carriers.of(i), facet.normal).area > 0)) return;
            least = distance;
            met = &facet;
            point = p;
        });
        if (!met) continue;

        const std::span<const std::int32_t> nodes = master.face(at(met->face));
        const FaceInPlane face(nodes, master_places);
        const FaceSpot foot = spot(face, nearest_xi(face, c.point, point.xi));
        const Vec3 normal = smooth && smooth->has(met->face)
                                ? smooth->normal(met->face, foot.values)
                                : Vec3(foot.along[0].cross(foot.along[1]).normalized());
        const FacingSum own = facing(carriers.of(i), normal);
        if (!(own.area > 0)) continue;
        c.area = own.area;
        c.normal = (normal - own.normal.normalized()).normalized();
        const Vec3 apart = c.point - foot.place;
        c.gap = c.normal.dot(apart);
        const double beside = (apart - c.gap * c.normal).norm();
        if (std::abs(c.gap) > reach) continue;
        if (beside > kOblique * std::abs(c.gap) + kRoundOff * met->size) continue;
        // Behind the skin that the node is next to: another overlap, through a whole body.
        if (least > least_of_all && (c.gap < 0) != inside) continue;
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
