#pragma once

#include "mesh/centreline.hpp"
#include "mesh/wall.hpp"

namespace amontons {

/// How a tube ends: it continues straight, or a half ball closes it.
enum class TubeEnd { straight, ball };

/// The free space inside a tube around a centreline, in closed form.
///
/// With g(x) = R(u) - |x - c(u)|, c(u) the nearest point of the centreline, the distance is
/// g / |grad g| and the normal grad g / |grad g|: exact for a constant radius and for a cone,
/// to first order in g elsewhere. Beyond its two ends the tube continues straight, its radius
/// levelling off within one radius (its ends are open), or a ball closes it. A tube must not come
/// nearer to itself than its own radius. Derivation: in swept_tube.cpp.
class SweptTube {
public:
    explicit SweptTube(Centreline centreline, TubeEnd start = TubeEnd::straight,
                       TubeEnd end = TubeEnd::straight)
        : centreline_{std::move(centreline)}
        , start_{start}
        , end_{end}
        , radius_{centreline_.constant_radius()}
    {
    }

    /// Signed distance, normal and Hessian at x [m].
    WallSample sample(const Vec3& x, WallHint& hint) const;
    /// Signed distance at x [m].
    double distance(const Vec3& x, WallHint& hint) const;
    /// A lower bound of `distance` [m], if the radius is constant and the hint is the piece next to
    /// x; else -infinity.
    double clearance(const Vec3& x, const WallHint& hint) const;
    const Centreline& centreline() const { return centreline_; }

private:
    CurveDerivatives foot_(const Vec3& x, WallHint& hint) const;

    Centreline centreline_;
    TubeEnd start_, end_;
    double radius_ = 0; ///< if it is the same all along, else 0
};

} // namespace amontons
