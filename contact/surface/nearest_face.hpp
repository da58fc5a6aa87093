#pragma once

#include "contact/surface/facets.hpp"

#include <cmath>
#include <limits>

namespace amontons {

/// The point of a facet nearest to x, and where it is on the reference face.
struct FacetPoint {
    /// The nearest point [m].
    Vec3 place = Vec3::Zero();
    /// Its coordinates in the face.
    Vec2 xi = Vec2::Zero();
};
/// The nearest place of a facet to x.
FacetPoint nearest_on(const Facet& facet, const Vec3& x);

/// Finds the faces of a surface that are near to points.
class NearestFace {
public:
    /// @param faces  all facets of the surface, outlive this
    explicit NearestFace(const FacetTree& faces) : faces_(faces) {}

    /// The nearest face and the place on it.
    struct Found {
        const Facet* facet = nullptr; ///< null: none
        FacetPoint point;
        /// False where another part of the surface is nearer, and the point lies on the other side
        /// of that: the body itself is then between the point and the place found.
        bool on_this_side = true;
    };
    /// The nearest facet within reach of x that is accepted. Of equally near ones the first.
    /// @param reach  largest distance [m]
    template <class Accept> Found find(const Vec3& x, double reach, Accept accept) const
    {
        BoundingBox near;
        near.add(x + Vec3::Constant(reach));
        near.add(x - Vec3::Constant(reach));
        Found found;
        double least = std::numeric_limits<double>::infinity(), least_of_all = least;
        bool inside = false;
        faces_.tree.visit(near, [&](std::int32_t number) {
            const Facet& facet = faces_.facets[static_cast<std::size_t>(number)];
            const FacetPoint p = nearest_on(facet, x);
            const double distance = (x - p.place).squaredNorm();
            // A skin that the point lies in, as flush bodies do in each other's sides, shows no
            // side.
            const double off = facet.normal.dot(x - p.place);
            if (distance < least_of_all && std::abs(off) > kFootRoundOff * facet.size) {
                least_of_all = distance;
                inside = off < 0;
            }
            if (distance > least || (distance == least && &facet > found.facet)) return;
            if (!accept(facet)) return;
            least = distance;
            found.facet = &facet;
            found.point = p;
        });
        if (found.facet && least > least_of_all)
            found.on_this_side = (found.facet->normal.dot(x - found.point.place) < 0) == inside;
        return found;
    }

    /// Whether a place on a surface is the foot of the point: the vector between them deviates from
    /// the normal by no more than a part of its length. On convex facets it may deviate by half the
    /// angle between two of them; with more the place lies on the surface's border, beside the
    /// point.
    /// @param apart   from the place to the point [m]
    static bool is_over(const Vec3& apart, const Vec3& normal, const Facet& facet);

private:
    static constexpr double kFootRoundOff = 1e-9; // of a facet's size

    const FacetTree& faces_;
};

} // namespace amontons
