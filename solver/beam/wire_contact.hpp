#pragma once

#include "mesh/wall.hpp"
#include "solver/beam/wire_place.hpp"

#include <array>
#include <vector>

namespace amontons {

class SoftTube;

/// A row of derivatives with respect to the unknowns of an element's two nodes.
struct ContactRow {
    /// Row by the unknowns of the element's two nodes.
    Node6 a, b;
};

/// Of the twelve unknowns in their order.
inline ContactRow contact_row(const Vec12& v)
{
    ContactRow r;
    r.a.column = Column6{v[0], v[1], v[2], v[3], v[4], v[5], 0, 0};
    r.b.column = Column6{v[6], v[7], v[8], v[9], v[10], v[11], 0, 0};
    return r;
}

/// A wall that the wire can touch.
struct WireWall {
    const Wall* wall = nullptr; ///< undeformed
    SoftTube* soft = nullptr;   ///< elastic solid of the wall; null: rigid
    double foundation = 0; ///< stiffness of springs along the normal, per length [N/m^2]; 0: none
    std::vector<double> friction;            ///< at each contact point of the wire [-]
    std::vector<double> friction_of_segment; ///< the same of each segment [-]
};

/// Last evaluation of a wall at a contact point: the wall is not evaluated again before the point
/// can have come near.
struct Proximity {
    WallHint hint;
    /// The place of the last evaluation [m].
    Vec3 at = Vec3::Zero();
    double distance = -1; ///< there [m]; < 0: unknown
};

/// Contact points at the start of the step, from which slip is measured.
struct StepStart {
    std::vector<Vec3> point;         ///< on the centreline [m]
    std::vector<Quaternion> section; ///< rotation of the section
};
/// The contact points at the present state.
StepStart mark_step_start(const Wire& wire);

/// A contact point near a wall: geometry in the current state, frame (n, t1 along the wire, t2).
struct Candidate {
    /// Numbers of the contact point and of the wall.
    int point = 0, wall = 0;
    int index = 0; ///< into WireState::reaction
    WirePlace place;
    Vec3 x; ///< on the centreline [m]
    Vec3 n, t1, t2;
    Mat3 hessian;            ///< of the distance to the wall [1/m]
    double gap = 0;          ///< [m]
    double slip[2] = {0, 0}; ///< over the step, of the wire's surface [m]
    double mu = 0;
    double radius = 0;
    double stiffness = 0;    ///< the wire's own scale, EI / l^3 [N/m]
    double held[2] = {0, 0}; ///< along the normal and across it, where that is stiffer [N/m]
    double normal = 0;       ///< reaction [N]
    double tangential[2] = {0, 0};
    bool sticks = false;
    bool bilateral = false;       ///< the gap is closed, whatever the sign of the reaction
    ContactRow hn, ht[2];         ///< derivatives of gap and slips
    double along = 0, around = 0; ///< on a soft wall: as TubePlace's [m, rad]
    double compliance = 0;        ///< on a foundation: 1 / stiffness along n [m/N]
};

/// All points whose gap is below `reach` [m] or that carry a reaction. Compliant walls are
/// displaced by the reactions at their present places.
/// @param covered  points nearer the base than this are left out: they lie in another instrument
///                 [m]
/// @return  remaining difference between the forces on soft walls and those of their shapes [N]
double find_candidates(const Wire& wire, const std::vector<WireWall>& walls, const StepStart& start,
                       double reach, std::vector<Proximity>& proximity,
                       std::vector<Candidate>& candidates, double covered = 0);

/// Sets the start of soft walls (SoftTube::set_start) to the forces of the present reactions: slip
/// is measured from there.
void mark_soft_walls(const Wire& wire, const std::vector<WireWall>& walls);

/// Whether any of them is an elastic solid.
bool any_soft(const std::vector<WireWall>& walls);

/// The place in the undeformed wall of a point of space; itself in a rigid one.
Vec3 pulled_back(const WireWall& wall, const Vec3& x, WallHint& hint);

/// Smallest gap of any contact point [m], and that point; +infinity if there is none.
double smallest_gap(const Wire& wire, const std::vector<WireWall>& walls,
                    std::vector<Proximity>& proximity, int* worst = nullptr);

/// Rows of the motion of a contact's point along t1 and t2, without the section's spin.
std::array<ContactRow, 2> point_rows(const Wire& wire, const Candidate& c);

/// Subtracts the reactions from the gradient, and their derivative with the geometry (not with
/// the reactions) from the tangent.
/// @param follow_walls  false: without what turns with the walls' curvature
void assemble_reactions(const Wire& wire, const std::vector<Candidate>& candidates,
                        BlockTridiagonal& tangent, std::vector<Node6>& gradient,
                        bool follow_walls = true);

} // namespace amontons
