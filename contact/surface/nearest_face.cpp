#include "contact/surface/nearest_face.hpp"

#include "mesh/closest_point.hpp"

#include <cmath>

namespace amontons {
namespace {

/// Off the normal by this part of the distance.
constexpr double kOblique = 0.6;

} // namespace

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

bool NearestFace::is_over(const Vec3& apart, const Vec3& normal, const Facet& facet)
{
    const double gap = normal.dot(apart);
    const double beside = (apart - gap * normal).norm();
    return beside <= kOblique * std::abs(gap) + kFootRoundOff * facet.size;
}

} // namespace amontons
