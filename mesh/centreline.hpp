#pragma once

#include "mesh/base/types.hpp"

#include <vector>

// A centreline is a smooth curve with a radius along it: straight pieces and circular arcs
// (both exact), or a C2 cubic spline through points. Neighbouring pieces share position and
// tangent; the curvature may jump between a straight piece and an arc.

namespace amontons {

/// A point of a centreline and what a moving frame needs there.
struct CurvePoint {
    Vec3 position = Vec3::Zero();  ///< [m]
    Vec3 tangent = Vec3::UnitX();  ///< unit
    Vec3 curvature = Vec3::Zero(); ///< d tangent / ds, towards the centre of the bend [1/m]
    double radius = 0;             ///< [m]
    double slope = 0;              ///< d radius / ds [-]
};

/// The point of a centreline that is nearest to a point of space.
struct CurveLocation {
    /// Number of the piece; -1: none.
    std::int32_t piece = -1;
    double parameter = 0; ///< of the piece, in [0, Centreline::parameter_range(piece)] [m]
    double distance = 0;  ///< [m]
};

/// Value and derivatives of one piece with respect to its own parameter.
struct CurveDerivatives {
    /// Place [m] and derivatives by the parameter.
    Vec3 value, first, second, third;
    /// Radius [m] and derivatives by the parameter.
    double radius, radius_first, radius_second;
};

/// A C1 curve with a radius. Built piece by piece, or by `make_spline`.
class Centreline {
public:
    /// An empty centreline that will begin at `start`.
    /// @param direction  tangent at the start, any length > 0
    /// @param normal     the way an arc with `turn` 0 bends; made orthogonal to `direction`
    /// @param radius     at the start [m], > 0
    /// @throws InputError  if a number is not finite, or a direction is zero or parallel
    Centreline(const Vec3& start, const Vec3& direction, const Vec3& normal, double radius);

    /// Continues straight.
    /// @param length      [m], > 0
    /// @param end_radius  [m], > 0; linear from the radius reached so far
    /// @throws InputError  a number out of its range
    void append_line(double length, double end_radius);

    /// Continues along a circular arc without a kink.
    /// @param bend_radius  of the centreline [m], larger than the tube's own radius
    /// @param angle        [rad], in (0, 2 pi]
    /// @param turn         plane of the arc: the normal turned by this angle about the tangent
    ///                     [rad]; the normal is carried along the curve without twist, so after
    ///                     an arc with turn 0 an arc with turn pi bends back
    /// @param end_radius   [m], > 0; linear from the radius reached so far
    /// @throws InputError  a number out of its range
    void append_arc(double bend_radius, double angle, double turn, double end_radius);

    /// Number of pieces.
    std::int32_t piece_count() const { return static_cast<std::int32_t>(pieces_.size()); }
    double length() const { return length_; } ///< of the whole curve [m]
    double end_radius() const;                ///< where the curve ends [m]
    /// Parameter at the end of a piece (0 at its start).
    double parameter_range(std::int32_t piece) const { return pieces_[at_(piece)].range; }

    /// The point at arc length s [m], clamped to [0, length()].
    CurvePoint at(double s) const;

    /// The same at a location that `nearest` found.
    CurvePoint at(const CurveLocation& location) const;

    /// Arc length [m] of a location.
    double arc_length(const CurveLocation& location) const;

    /// The nearest point of the whole curve. The hint makes it fast and changes no bit of it.
    /// @param hint  a piece that is probably the nearest, or -1
    /// Cost: about 50 ns for a few pieces, logarithmic-like in their number.
    CurveLocation nearest(const Vec3& x, std::int32_t hint) const;

    /// An upper bound of the distance from the curve, from one piece alone and without
    /// trigonometric functions [m]; infinity where there is none: x lies beyond the ends of the
    /// piece, or it is a cubic.
    /// Cost: about 5 ns.
    double distance_bound(const Vec3& x, std::int32_t piece) const;

    /// The radius if it is the same all along, else 0 [m].
    double constant_radius() const;

    /// Place [m] and derivatives with respect to the parameter of a piece.
    CurveDerivatives derivatives(std::int32_t piece, double parameter) const;

    friend Centreline make_spline(const std::vector<Vec3>& points,
                                  const std::vector<double>& radii);

private:
    /// c(u) = a0 + a1 u + a2 u^2 + a3 u^3, or on an arc a0 + rho (sin(u/rho) a1 - cos(u/rho) a2)
    /// with a0 the centre, a1 the first tangent, a2 from the start to the centre, a3 across both.
    struct Piece {
        enum class Kind { line, arc, cubic } kind = Kind::line;
        Vec3 a0 = Vec3::Zero(), a1 = a0, a2 = a0, a3 = a0;
        double bend_radius = 0;
        double r0 = 0, r1 = 0, r2 = 0, r3 = 0; // radius, cubic in u
        double range = 0;                      // of u
        double length = 0, start = 0;          // arc length of the piece and before it
        Vec3 ball_centre = Vec3::Zero();       // of a ball around the piece
        double ball_radius = 0;
    };
    struct Group { // of neighbouring pieces, to skip them together
        Vec3 centre = Vec3::Zero();
        double radius = 0;
    };

    Centreline() = default;
    static std::size_t at_(std::int32_t i) { return static_cast<std::size_t>(i); }
    void add_(Piece piece);
    static CurveDerivatives derivatives_(const Piece& piece, double u);
    static double nearest_(const Piece& piece, const Vec3& x, double beyond, double& u);
    static double length_to_(const Piece& piece, double u);

    std::vector<Piece> pieces_;
    std::vector<Group> groups_;
    double length_ = 0;
    Vec3 end_ = Vec3::Zero(), tangent_ = Vec3::UnitX(), normal_ = Vec3::UnitY();
    double radius_ = 0;
};

/// A C2 cubic spline through points with natural ends, parametrised by chord length; the
/// radius is a C2 spline of the same parameter.
/// @param points  n >= 2, neighbours distinct [m]
/// @param radii   n [m], > 0
/// @throws InputError  with every bad point
Centreline make_spline(const std::vector<Vec3>& points, const std::vector<double>& radii);

} // namespace amontons
