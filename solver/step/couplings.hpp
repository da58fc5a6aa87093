#pragma once

#include "solver/step/body_contacts.hpp"

namespace amontons {

/// A place that a coupling holds on to: fixed to a rigid body, to nodes of a solid, or to the
/// world.
struct CoupledPlace {
    int body = -1;                   ///< -1: the world
    Vec3 local = Vec3::Zero();       ///< rigid: in its shape's frame; world: in space [m]
    std::vector<StencilEntry> nodes; ///< solid
};

/// One row between two anchors: along an axis that turns with body a, or (a spring) along the line
/// between them.
struct Coupling {
    CoupledPlace a, b;
    Vec3 axis = Vec3::UnitX(); ///< in body a's frame
    bool along_line = false;
    bool slides = false; ///< the anchors may come apart along the axis
    double rest = 0;     ///< value at which the row is at rest [m]
    double softness = 0; ///< 1 / stiffness; 0: rigid [m/N]
    int input = 0;       ///< of the scene's couplings
};

/// Where an anchor is at the iterate.
Vec3 anchor_point(const std::vector<BodyRef>& bodies, const CoupledPlace& anchor);

/// The row's direction at the iterate, unit, and its value: direction . (a - b) - rest [m].
struct CouplingRow {
    Vec3 direction;
    double value = 0;
    Vec3 point_a, point_b;             ///< where its forces act
    std::vector<StencilEntry> nodes_a; ///< instead of the anchor's, where a solid slides
};
CouplingRow coupling_row(const std::vector<BodyRef>& bodies, const Coupling& coupling);

/// What the springs hold at the iterate [J].
double spring_energy(const std::vector<BodyRef>& bodies, const std::vector<Coupling>& couplings);

/// The rows of the scene's couplings, as the bodies stand.
/// @throws InputError  if a solid has no node near the place
std::vector<Coupling> make_couplings(const Scene& scene, const std::vector<BodyRef>& bodies);

/// Couplings whose bodies start at velocities that they do not allow. A rule that damps takes what
/// is too much in the first step, as a plastic blow does; others let it swing.
std::vector<Issue> jolts(const Scene& scene, const std::vector<BodyRef>& bodies,
                         const std::vector<Coupling>& couplings);

} // namespace amontons
