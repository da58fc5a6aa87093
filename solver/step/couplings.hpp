#pragma once

#include "solver/solid/patch.hpp"
#include "solver/step/body_contacts.hpp"

#include <memory>

namespace amontons {

/// An anchor of a coupling: fixed to a rigid body, to a patch of a solid, to a cross-section of a
/// rod, or to the world.
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

/// State of a row, stored from step to step.
struct CouplingMemory {
    double value = 0;    ///< at the state [m]; of turns: the accumulated angle [rad]
    double filtered = 0; ///< filtered value of the generalised-alpha rule [m or rad]
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

    /// The end on body a, as a place. It refers to the row, which must not move meanwhile.
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
/// Frames of a joint's anchors at the iterate: the same for all of its rows.
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
/// @param row     out; new, or one of the same coupling
void find_row(const std::vector<BodyRef>& bodies, const Coupling& coupling, double known,
              JointFrames& frames, CouplingRow& row);
/// The same, of a single row.
/// @param known  as above [rad]
CouplingRow coupling_row(const std::vector<BodyRef>& bodies, const Coupling& coupling,
                         double known = 0);

/// The row by which forces act in a step, a discrete gradient between its start and its end:
/// direction and places whose product with the motion of the bodies is exactly the change of the
/// row's value (of turns to second order). Its value is that of the end.
/// @param row  that of the end; becomes the one between
void row_between(const Coupling& coupling, const CouplingRow& start, CouplingRow& row);

/// A spring with damping as a row of a step of length h with this rule. Its force is the mean
///   F = -(k (end e' + past) + c (e' - e) / h),  e and e' its values before and after the step:
/// `value` + `compliance` h F = 0, with value = e' + known terms. Without damping and in implicit
/// Euler value = e'.
struct SpringRow {
    double value = 0;      ///< [m]
    double compliance = 0; ///< of impulses [m/(N s)]
};
/// The row of a spring: docs/theory/motion.md.
/// @param h  length of the step [s]; `value` as that of coupling_row
SpringRow spring_row(const Coupling& spring, const TimeRule& rule, double h,
                     const CouplingMemory& before, double value);

/// Elastic energy of the springs, from the stored values of their rows [J].
double spring_energy(const std::vector<Coupling>& couplings,
                     const std::vector<CouplingMemory>& memory);

/// The state of the rows at the bodies' present places, at the beginning of a run.
std::vector<CouplingMemory> begin_memory(const std::vector<BodyRef>& bodies,
                                         const std::vector<Coupling>& couplings);

/// The rows of the scene's couplings, at the bodies' present places. Their nodes are added to those
/// that may be in contact.
/// @param patches  gets the patches that the rows refer to
/// @throws InputError  if a patch does not exist, or is far from its joint
std::vector<Coupling> make_couplings(const Scene& scene, const std::vector<BodyRef>& bodies,
                                     std::vector<std::unique_ptr<Patch>>& patches);

/// One Issue for each coupling whose bodies start at velocities that it does not allow. A
/// dissipative rule removes the excess in the first step, like a plastic impact; with others it
/// oscillates.
std::vector<Issue> jolts(const Scene& scene, const std::vector<BodyRef>& bodies,
                         const std::vector<Coupling>& couplings);

} // namespace amontons
