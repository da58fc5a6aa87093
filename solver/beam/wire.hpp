#pragma once

#include "solver/beam/material.hpp"
#include "solver/beam/rotation.hpp"

#include <memory>
#include <optional>
#include <vector>

// A wire as a chain of beam elements whose base is held: by a sheath out of which it is pushed
// (a moving material boundary: the first element grows and shrinks), or clamped.

namespace amontons {

/// The straight frictionless sheath. The wire inside it is not meshed: it carries axial,
/// torsional and bending energy, and its two degrees of freedom are the length that is out of the
/// sheath and the rotation at the sheath's end.
struct Sheath {
    Vec3 end = Vec3::Zero();       ///< end of its rigid part [m]
    Mat3 frame = Mat3::Identity(); ///< columns: direction, material axes 2 and 3 at no twist
    double fade = 0; ///< length beyond `end` over which the lateral stiffness ends [m]
    double grip = 0; ///< lateral stiffness per length at `end` [N/m^2]
    /// Springs between the drive and the base of the wire, as of a hand. 0: rigid.
    double compliance = 0;      ///< along the wire [m/N]
    double turn_compliance = 0; ///< about it [rad/(N m)]
};

struct WallState; // solver/beam/wall_material.hpp

/// Place of a contact on a compliant wall at its last evaluation.
struct WallTouch {
    /// True after the first evaluation.
    bool known = false;
    double along = 0, around = 0; ///< as TubePlace's [m, rad]
    Vec3 n = Vec3::Zero();        ///< of the wall as it is displaced
};

/// Reaction at a contact of point and wall.
struct Reaction {
    double normal = 0;              ///< [N], >= 0
    Vec3 tangential = Vec3::Zero(); ///< in space [N]
    bool sticks = false;
    WallTouch touch;
};

/// State of a wire.
struct WireState {
    int first = 0;       ///< material node at the held end (in a sheath: the moving one)
    double inserted = 0; ///< length of wire past the sheath's rigid end [m]
    /// Low-order part of `inserted`, which the strain of a short first element needs [m].
    double inserted_rest = 0;
    double rotation = 0;            ///< of the section there about the axis [rad]
    double base_insertion = 0;      ///< given [m]
    double base_twist = 0;          ///< given [rad]
    std::vector<BeamNode> nodes;    ///< those before `first` are undefined
    std::vector<Reaction> reaction; ///< [point * walls + wall]
    Vec3 tip_moved = Vec3::Zero();  ///< displacement of a held tip since the hold began [m]
    Vec3 tip_force = Vec3::Zero(), tip_moment = Vec3::Zero(); ///< of its hold [N], [N m]
    double wall_energy = 0; ///< elastic, of walls that yield under the reactions [J]
    /// Displaced state of each wall, null where it is not hyperelastic; empty where none is.
    std::vector<std::shared_ptr<const WallState>> wall;
};

/// The tip is held in its place.
struct TipHold {
    bool turns = false;        ///< its cross-section does not turn either
    Vec3 place = Vec3::Zero(); ///< of the tip when the hold began [m]
    Quaternion section;        ///< rotation of its section then
};

/// Constant data of a wire, and its state.
struct Wire {
    WireMaterial material;
    std::optional<Sheath> sheath;  ///< or a clamp at node 0
    std::optional<Vec3> plane;     ///< normal of the plane that the wire is held in
    std::optional<TipHold> tip;    ///< while any of the wire is out
    std::vector<Vec3> dead_force;  ///< on each node, fixed in space [N]; may be empty
    std::vector<Vec3> dead_moment; ///< [N m]
    bool cable = false;            ///< no bending or torsional stiffness: see add_cable
    WireState state;

    int last() const { return int(material.node.size()) - 1; } ///< tip node
    bool outside() const { return state.first < last(); }      ///< any of it past the sheath
};

/// Starts a wire in a sheath at a given insertion: straight out of it, unstressed.
/// @param insertion, twist  [m], [rad]
void start_in_sheath(Wire& wire, double insertion, double twist);

/// The first material node for an insertion, so that the growing element has between a half
/// and one and a half of its full length; last() if nothing is out. Depends on nothing else:
/// withdrawal passes through the meshes of insertion.
/// @param insertion  [m], >= 0
int first_node(const WireMaterial& material, double insertion);

/// Law of the element at the held end, for the length that is out.
ElementLaw held_element_law(const Wire& wire, const WireState& state);

/// Place of a point of the held part, on the axis of the sheath [m].
Vec3 held_point(const Wire& wire, const WireState& state, double s);
/// Rotation of a section of the held part.
/// @param s  arc length from the base [m]
Quaternion held_rotation(const Wire& wire, const WireState& state, double s);

/// Predictor: translates the wire along its centreline by the base increment. Reactions move along.
/// Adds and removes nodes.
/// @param insertion, twist  the new ones [m], [rad]
void drive_base(Wire& wire, double insertion, double twist);

/// Whether the element at the sheath's end has become much shorter or longer than a whole one, for
/// instance when a jump draws wire into the sheath. drive_base() to the present base then remeshes.
bool first_element_lags(const Wire& wire);

/// Forces at the base of a sheath.
struct BaseLoad {
    double push = 0;   ///< [N], positive in compression
    double torque = 0; ///< about the axis [N m]
};
/// Push and torque at the base [N, N m].
BaseLoad base_load(const Wire& wire);

/// Stiffness of the base of a wire that is out of its sheath: derivatives of the energy.
struct BaseStiffness {
    Eigen::Matrix2d own;   ///< by (insertion, twist) twice [N/m], [N m/rad]
    Eigen::Matrix2d mixed; ///< rows 0 and 3 of node `first` in the gradient, by (insertion, twist)
};
/// Stiffness of the wire in its sheath against push and twist.
BaseStiffness base_stiffness(const Wire& wire);

/// Elastic energy, of the held part and the base's springs too [J].
double elastic_energy(const Wire& wire);

/// Adds the gradient and Hessian of all energies of the wire (not of contact) to a zeroed
/// system. Rows of node `first`: with a sheath (inserted, 0, 0, rotation, 0, 0).
/// Held unknowns get a unit row.
/// @param predicted  as add_elements'; empty: none
void assemble_wire(const Wire& wire, std::vector<ElementLaw>& laws, BlockTridiagonal& tangent,
                   std::vector<Node6>& gradient,
                   const std::vector<std::array<double, 6>>& predicted = {});

/// Strains of the elements after an increment of the unknowns times `factor`, to first order.
/// @param out  per element
void predict_strains(const Wire& wire, const std::vector<Node6>& increment, double factor,
                     std::vector<std::array<double, 6>>& out);

/// Moves the wire by an increment of its unknowns, times `factor`.
void move_wire(Wire& wire, const std::vector<Node6>& increment, double factor);

/// Hermite weights: position = h0 x1 + h1 x2 + h2 t1 + h3 t2.
struct Hermite {
    /// Weights of the ends and of their slopes (the slopes times the length).
    double h0, h1, h2, h3;
};
/// Cubic Hermite weights at xi of 0 to 1.
inline Hermite hermite(double xi, double length)
{
    const double h0 = 1 - xi * xi * (3 - 2 * xi);
    return {h0, 1 - h0, length * xi * (1 - xi) * (1 - xi), -length * xi * xi * (1 - xi)};
}

} // namespace amontons
