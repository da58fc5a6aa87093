#pragma once

#include "solver/solid/patch.hpp"
#include "solver/step/body_contacts.hpp"

#include <memory>

namespace amontons {

/// A place that a coupling holds on to: fixed to a rigid body, to a patch of a solid, to a
/// cross-section of a rod, or to the world.
struct CoupledPlace {
    int body = -1;             ///< -1: the world
    Vec3 local = Vec3::Zero(); ///< rigid: in its shape's frame; world: in space; from the patch, or
                               ///< the rod's node, in its section's axes [m]
    const Patch* patch = nullptr; ///< solid
    int node = -1;                ///< rod
    StencilEntry on_rod;          ///< the same as a place of the rod
    /// Nodes and weights of the place.
    std::span<const StencilEntry> stencil() const
    {
        return node < 0 ? std::span<const StencilEntry>() : std::span(&on_rod, 1);
    }
};

/// One row between two anchors: along an axis that turns with body a, along the line between them
/// (a spring, a distance), or of the turn of b against a about the axis (a turn spring).
struct Coupling {
    /// The two ends.
    CoupledPlace a, b;
    Vec3 axis = Vec3::UnitX(); ///< in body a's frame
    bool along_line = false;
    bool slides = false; ///< the anchors may come apart along the axis
    bool turns = false;  ///< moments act, not forces
    /// Turns: two axes, one of each body, stay at right angles. Of joints with rods, whose sections
    /// have no points far from a node.
    bool square = false;
    Vec3 axis_b = Vec3::UnitX(); ///< square: in body b's frame
    double arm = 1;              ///< square: the cosine of the axes times this is the value [m]
    double rest = 0;             ///< value at which the row is at rest [m]; of turns [rad]
    double softness = 0;         ///< 1 / stiffness; 0: rigid [m/N]; of turns [rad/(N m)]
    double damping = 0;          ///< of a spring [N s/m]; of turns [N m s/rad]
    Eigen::Quaterniond turn = Eigen::Quaterniond::Identity(); ///< turns: of b against a at rest
    int input = 0;                                            ///< of the scene's couplings
};

/// What a row carries from step to step.
struct CouplingMemory {
    double value = 0;    ///< at the state [m]; of turns: all that it has turned [rad]
    double filtered = 0; ///< of the generalised-alpha rule
};

/// The row's direction at the iterate, unit (of square rows: of the length of the arm), and its
/// value: direction . (a - b) - rest [m].
struct CouplingRow {
    /// Unit direction of the row.
    Vec3 direction;
    /// Value of the row at the iterate [m or rad].
    double value = 0;
    double length = 0; ///< along the line: of it [m]
    bool turns = false;
    Vec3 axis_a = Vec3::Zero(), axis_b = Vec3::Zero(); ///< of square rows, in space
    Vec3 point_a, point_b;                             ///< where its forces act
    std::vector<PatchPose> poses;                      ///< of patches: a's first, b's last
    Vec3 arm_a = Vec3::Zero(), arm_b = Vec3::Zero();   ///< of the points, from patches' centres [m]

    /// As the bodies know it; the row stays where it is meanwhile.
    BodyPlace place_a(const Coupling& c) const
    {
        return {c.a.stencil(), point_a,      turns, c.a.patch ? &poses.front() : nullptr,
                arm_a,         c.a.node >= 0};
    }
    /// The end on body b, as a place.
    BodyPlace place_b(const Coupling& c) const
    {
        return {c.b.stencil(), point_b,      turns, c.b.patch ? &poses.back() : nullptr,
                arm_b,         c.b.node >= 0};
    }
};
/// Where what a joint holds on to is at the iterate: the same for all of its rows.
struct JointFrames {
    int input = -1; ///< of the scene's couplings
    struct Frame {
        Eigen::Quaterniond turn = Eigen::Quaterniond::Identity(); ///< from local to world axes
        Mat3 R = Mat3::Identity();                                ///< the same
        Vec3 shift = Vec3::Zero();                                ///< of local (0, 0, 0) [m]
    } a, b;
    std::vector<PatchPose> poses; ///< of patches: a's first, b's last
};

/// @param known   a turn is the one that is nearest to this [rad]
/// @param frames  of the row before, for rows in order: those of one joint are found once
CouplingRow coupling_row(const std::vector<BodyRef>& bodies, const Coupling& coupling, double known,
                         JointFrames& frames);
CouplingRow coupling_row(const std::vector<BodyRef>& bodies, const Coupling& coupling,
                         double known = 0);

/// Where the forces of a step act that leads from one row to another: the direction and places
/// whose product with the motion of the bodies is the change of the row's value, exactly (but of
/// turns, whose is of second order). Its value is that of the end.
CouplingRow row_between(const Coupling& coupling, const CouplingRow& start, CouplingRow end);

/// How a spring with damping answers in a step of h with this rule, its force the mean
///   F = -(k (end e' + past) + c (e' - e) / h),  e and e' its values before and after:
/// `value` + `give` h F = 0, value = e' + what is known. Without damping in implicit Euler: e'
/// alone.
struct SpringRow {
    double value = 0;      ///< [m]
    double compliance = 0; ///< of impulses [m/(N s)]
};
/// The row of a spring: docs/theory/motion.md.
SpringRow spring_row(const Coupling& spring, const TimeRule& rule, double h,
                     const CouplingMemory& before, double value);

/// What the springs hold, by the values of their rows [J].
double spring_energy(const std::vector<Coupling>& couplings,
                     const std::vector<CouplingMemory>& memory);

/// Of the rows as the bodies stand, nothing filtered yet.
std::vector<CouplingMemory> begin_memory(const std::vector<BodyRef>& bodies,
                                         const std::vector<Coupling>& couplings);

/// The rows of the scene's couplings, as the bodies stand. Their nodes are noted as ones that may
/// touch.
/// @param patches  gets those that they point to
/// @throws InputError  patches that there are not, or that are far from where the joint is
std::vector<Coupling> make_couplings(const Scene& scene, const std::vector<BodyRef>& bodies,
                                     std::vector<std::unique_ptr<Patch>>& patches);

/// Couplings whose bodies start at velocities that they do not allow. A rule that damps takes what
/// is too much in the first step, as a plastic blow does; others let it swing.
std::vector<Issue> jolts(const Scene& scene, const std::vector<BodyRef>& bodies,
                         const std::vector<Coupling>& couplings);

} // namespace amontons
