#include "contact/surface/bulge_contacts.hpp"

#include "contact/surface/faceted_surface.hpp"
#include "contact/surface/facets.hpp"
#include "contact/surface/overlap.hpp"
#include "mesh/base/dense.hpp"
#include "mesh/closest_point.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace amontons {
namespace {

constexpr double kAtNode = 0.99; // its weight
/// A ball as large as the cells is common: round-off must not decide which of the two is larger.
constexpr double kSmaller = 0.9;
constexpr double kSameBulge = 1e-6; // of a face's length: one place on two faces

/// A place on a face. On its border it is the surface's nearest one only where the face beside it
/// has it too.
struct Candidate {
    SurfaceContact contact;
    PerNode values;
    double length = 0;
    bool confirmed = false; ///< inside the face, or by two
};

bool is_inside(int nodes, const Vec2& xi)
{
    constexpr double kBorder = 1e-9;
    if (nodes == 4) return xi.cwiseAbs().maxCoeff() < 1 - kBorder;
    return xi.minCoeff() > kBorder && xi.sum() < 1 - kBorder;
}

/// Where the face is nearest to x, on its flat triangles.
Vec2 nearest(const FaceInPlane& face, const Vec3& x)
{
    Vec2 best = Vec2::Zero();
    double least = std::numeric_limits<double>::infinity();
    const FlatParts parts = flat_parts(std::size_t(face.nodes));
    for (const std::array<int, 3>& t : parts.triangles) {
        const auto node = [&](int k) -> const Vec3& {
            return face.node[std::size_t(t[std::size_t(k)])];
        };
        const TrianglePoint p = closest_on_triangle(x, node(0), node(1), node(2));
        if (const double d = (p.point - x).squaredNorm(); d < least) {
            least = d;
            best.setZero();
            for (int k = 0; k < 3; ++k) {
                const auto local = std::size_t(t[std::size_t(k)]);
                best += p.weights[k] * parts.xi[local];
            }
        }
    }
    return best;
}

/// The same on the face itself: flat triangles that fold towards x have two places that are as
/// near. Places on its border stay.
Vec2 nearest_on_curved(const FaceInPlane& face, const Vec3& x)
{
    const Vec2 start = nearest(face, x);
    if (face.nodes == 3) return start;
    const Vec2 xi = nearest_xi(face, x, start);
    return is_inside(face.nodes, xi) ? xi : start;
}

} // namespace

SurfaceContacts bulge_contacts(const ExternalSurface& slave, std::span<const Vec3> places,
                               std::span<const Vec3> at_rest,
                               const std::function<WallSample(const Vec3&)>& wall, double reach)
{
    SurfaceContacts out;
    std::vector<Candidate> found;
    for (std::size_t f = 0; f < slave.faces.size(); ++f) {
        const std::span<const std::int32_t> nodes = slave.face(f);
        const FaceInPlane face(nodes, places);
        const auto corners = std::size_t(slave.corners[f]);
        Vec3 middle = Vec3::Zero();
        for (std::size_t k = 0; k < corners; ++k)
            middle += face.node[k] / double(corners);
        const double longest = longest_edge(slave, f, places),
                     rest = longest_edge(slave, f, at_rest);
        const double apart = face.nodes == 6 ? 0.5 * rest : rest; // of its multipliers
        const WallSample at_middle = wall(middle);
        if (!(std::abs(at_middle.distance) <= reach + longest)) continue;
        const double curvature = symmetric_eigenvalues(at_middle.hessian)[2];
        if (!(curvature > 0)) continue;
        const double from_centre = 1 / curvature;
        if (!(kSmaller * (from_centre - at_middle.distance) < apart)) continue;
        const Vec2 xi = nearest_on_curved(face, middle - from_centre * at_middle.normal);
        const FaceSpot spot = amontons::spot(face, xi);
        if (spot.values.maxCoeff() > kAtNode) continue;
        const WallSample sample = wall(spot.place);
        if (!(std::abs(sample.distance) <= reach)) continue;
        const auto same = std::ranges::find_if(found, [&](const Candidate& c) {
            return (c.contact.point - spot.place).norm() <=
                   kSameBulge * std::max(longest, c.length);
        });
        if (same != found.end()) {
            same->confirmed = true;
            continue;
        }
        SurfaceContact c;
        c.id = std::int64_t(f);
        c.point = spot.place;
        c.normal = sample.normal;
        c.gap = sample.distance;
        set_tangents(c);
        found.push_back({c, spot.values, longest, is_inside(face.nodes, xi)});
    }
    for (Candidate& candidate : found) {
        if (!candidate.confirmed) continue;
        SurfaceContact& c = candidate.contact;
        const std::span<const std::int32_t> nodes = slave.face(std::size_t(c.id));
        c.slave_begin = std::int32_t(out.stencil.size());
        for (std::size_t k = 0; k < nodes.size(); ++k)
            out.stencil.push_back({nodes[k], candidate.values[Eigen::Index(k)]});
        std::sort(out.stencil.begin() + c.slave_begin, out.stencil.end(),
                  [](const StencilEntry& a, const StencilEntry& b) { return a.node < b.node; });
        c.slave_end = c.master_begin = c.master_end = std::int32_t(out.stencil.size());
        out.contact.push_back(c);
    }
    return out;
}

} // namespace amontons
