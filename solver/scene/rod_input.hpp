#pragma once

#include "solver/scene/scene.hpp"

// Rods as they are asked for. Scenes do not hold them yet: rods are made from C++.

namespace amontons {

/// A point of a polyline.
struct RodPoint {
    Vec3 at = Vec3::Zero(); ///< [m]
};

/// Where a rod begins: along a curve, a polyline with rigid corners, or (neither) from a start on,
/// bent as its segments are when free of load.
struct RodShape {
    Vec3 start = Vec3::Zero();
    Vec3 direction = Vec3::UnitX();
    std::optional<Vec3> normal;   ///< section axis 2, curvature of angle 0 bends this way; chosen
    std::vector<RodPoint> points; ///< corners are rigid
    bool has_curve = false;
    CentrelineInput curve;
    bool closed = false;     ///< the end is joined to the start
    bool stress_free = true; ///< in the given shape; else its segments say how it is free of load
};

/// A place or motion that is prescribed to a cross-section of a rod.
struct RodHold {
    std::string set;             ///< "start" | "end" | "all" | "": `at`
    std::optional<double> at;    ///< arc length [m]
    std::string places = "held"; ///< "held" | "free"
    CurvePoints x, y, z;         ///< displacement over time [m]; without any: all three are 0
    std::string turns = "held";  ///< "held" | "free" | "about": only about `axis`
    Vec3 axis = Vec3::UnitZ();   ///< fixed in space
    CurvePoints angle;           ///< turn about the axis over time, of turns that are held [rad]
};

/// What acts on a rod. Vectors are multiplied by `over`.
struct RodLoad {
    std::string set;            ///< "start" | "end" | "all" | "": `at`
    std::optional<double> at;   ///< arc length [m]
    std::optional<Vec3> force;  ///< [N]
    std::optional<Vec3> moment; ///< [N m]
    std::optional<Vec3> line;   ///< force per length, of "all" [N/m]
    bool follows = false;       ///< force and moment turn with the cross-section
    CurvePoints over;           ///< factor over time; empty: 1
};

/// A beam that no introducer feeds: it lies where its shape says, is held and loaded anywhere.
struct RodInput {
    std::string name;
    std::vector<BeamSegment> segments;
    RodShape shape;
    std::string elements = "exact"; ///< "exact" | "corotational"
    std::optional<Vec3> plane;      ///< normal of a plane that the rod is kept in
    std::vector<RodHold> hold;
    std::vector<RodLoad> loads;
    Vec3 velocity = Vec3::Zero(); ///< when the run begins [m/s]
    Vec3 spin = Vec3::Zero();     ///< about the centre of mass [rad/s]
    double contact_spacing = 0;   ///< [m]; 0: half the shortest element
};

} // namespace amontons
