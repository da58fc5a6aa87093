#pragma once

#include "contact/global_problem.hpp"

// One step of rigid bodies in velocities: M v = H r + M v_old + h m g, u = H^T v. Impulses r [N s],
// u [m/s]. Every generator gives the same problem for the same numbers and seed.

namespace amontons {

constexpr double kProblemStep = 0.01;    // h [s]
constexpr double kProblemGravity = 9.81; // [m/s^2]

/// Boxes on each other with a contact at every corner: 4 redundant contacts a level.
struct Tower {
    int boxes = 10;
    double top_mass = 1; ///< the top box over the others, heavy on light [-]
    double push = 0;     ///< sideways velocity that the top box has [m/s]
    double mu = 0.5;
    Vec3 size{0.1, 0.1, 0.05}; ///< of a box [m]
};
GlobalProblem tower(const Tower& t);

/// Bricks in running bond: each on the halves of two, 4 contacts a half; one is kicked.
struct BrickWall {
    int rows = 4, columns = 4;
    double mass_ratio = 1; ///< masses are spread over this ratio, by the seed [-]
    double perturb = 1;    ///< of a brick in the middle, out of the wall [m/s]
    double mu = 0.7;
    unsigned seed = 1;
};
GlobalProblem wall(const BrickWall& w);

/// Spheres that fell into a box without a lid: contacts with each other, floor and sides.
struct Spheres {
    int count = 40;
    double radius_ratio = 2; ///< largest over smallest [-]
    double mu = 0.5;
    unsigned seed = 1;
};
GlobalProblem spheres(const Spheres& s);

/// Slender rods that slide on their lower ends and rest on one another: the normal reaction of a
/// sliding end is mostly made by its own friction (Painlevé).
struct Rods {
    int count = 12;
    double angle = 1.0; ///< with the floor [rad]
    double speed = 1;   ///< [m/s]
    double mu = 1.5;
};
GlobalProblem rods(const Rods& r);

} // namespace amontons
