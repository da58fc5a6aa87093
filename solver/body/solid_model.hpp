#pragma once

#include "mesh/base/late.hpp"
#include "mesh/volume_mesh.hpp"
#include "solver/body/body.hpp"
#include "solver/body/live_curve.hpp"
#include "solver/body/solid_conditions.hpp"
#include "solver/scene/scene.hpp"
#include "solver/solid/assembly.hpp"
#include "solver/solid/hyperelastic.hpp"
#include "solver/solid/rigid_modes.hpp"

#include <optional>
#include <span>
#include <string>
#include <vector>

// What a solid is, its unknowns and its motion. Vectors of all degrees of freedom are 3n long, node
// by node.

namespace amontons {

/// What stays of a solid from step to step, except for the values of its scene's curves.
struct SolidModel {
    /// @param mesh   checked; its sets are those of the input's holds and loads
    /// @param small  all of its contacts are of small sliding
    /// @throws InputError  names of sets that the mesh has not
    SolidModel(const SolidInput& input, VolumeMesh mesh, bool small, const std::string& file);
    SolidModel(const SolidModel&) = delete; // conditions, and what is made late, point into it
    SolidModel& operator=(const SolidModel&) = delete;

    /// Its forces are a nonlinear function of places.
    bool nonlinear() const { return corotational || hyperelastic; }

    SolidInput input;
    std::string file; ///< the scene's
    VolumeMesh mesh;
    SolidMaterial material;
    bool small = false;
    bool corotational = false, hyperelastic = false;
    Hyperelastic law;           ///< of a hyperelastic solid
    Vec3 middle = Vec3::Zero(); ///< mean of the reference places [m]
    double size = 0;            ///< largest distance of a node from it [m]
    SolidConditions conditions; ///< points into input and mesh

    // What only steps need is computed then: a scene can be checked without.
    Late<SolidPattern> pattern;               ///< of its matrices
    Late<std::vector<SparseMatrix>> supports; ///< stiffness of each [N/m]
    Late<SparseMatrix> support;               ///< their sum, of the pattern; 0 x 0: none
    Late<SparseMatrix> mass;       ///< between nodes, of each axis [kg]; 0 x 0: no density
    Late<Eigen::VectorXd> weights; ///< of each node in the weight [kg]
    Late<Eigen::VectorXd> lumped;  ///< 3n [kg]
};

/// Which degrees of freedom of a solid are unknowns, and the motions that they leave it.
struct SolidUnknowns {
    std::vector<std::int32_t> touching; ///< nodes that may come into contact, ascending
    Late<RigidModes> rigid;
    FreeDofs dofs; ///< empty until the first step is prepared
    /// Degree of freedom of each unknown, and the number of each or -1: the free ones, then the
    /// pins of quasi-static steps, which move with the rigid modes.
    std::vector<std::int32_t> dof, number;
    Eigen::MatrixXd modes; ///< rigid modes, rows of unknowns; dynamic: none
};

/// Places and velocities of a solid's nodes.
struct SolidMotion {
    /// The frame that carries the reference shape: x = frame (X + u).
    Placement frame;
    Eigen::VectorXd u;        ///< in the frame, 3n [m]
    Eigen::VectorXd v;        ///< in space, 3n [m/s]; dynamic only
    std::vector<Vec3> x;      ///< in space [m]
    std::int64_t version = 0; ///< another one wherever x is
};

/// What moves a solid's frame; floating: it carries the rigid motion that nothing prescribes.
enum class SolidFrame { fixed, driven, floating };

/// What moves the frame of this solid.
SolidFrame frame_kind(const SolidModel& model, const SolidUnknowns& unknowns);
/// Frame of a solid that nothing has moved but its drive. @param t  [s]
Placement frame_at(const SolidModel& model, double t);
/// Sets the nodes that may be in contact (a flag for each), and chooses pins elsewhere.
void set_touching(const SolidModel& model, std::span<const char> touching, SolidUnknowns& unknowns);
/// Curves that a caller may set between steps: of the drive, holds and loads.
std::vector<LiveCurve> live_curves_of(SolidInput& input);

/// Sets the prescribed displacements at a time. @param u  of all degrees of freedom [m]
void apply_holds(const SolidModel& model, double t, Eigen::VectorXd& u);
/// What the moment of each hold is taken about, in the frame [m]: its `about`, or the mean place of
/// its nodes. @param u  displacements; empty: at rest
std::vector<Vec3> centres_of_holds(const SolidModel& model, const Eigen::VectorXd& u);

/// Places of the nodes from frame and u; their version is the caller's to set.
void place_nodes(const SolidModel& model, SolidMotion& m);
/// u from the places in the present frame.
void into_frame_displacements(const SolidModel& model, SolidMotion& m);
/// Frame and u from the places: the frame that is nearest to them.
void float_frame(const SolidModel& model, SolidMotion& m);
/// Moves the frame by amplitudes of the rigid modes.
void move_frame(const SolidModel& model, const SolidUnknowns& unknowns, SolidMotion& m,
                const Eigen::VectorXd& mode);
/// Centre of mass at places x [m].
Vec3 centre_of_mass(const SolidModel& model, const std::vector<Vec3>& x);
/// Forces or velocities of all nodes in space, along the axes of the frame.
Eigen::VectorXd into_frame(const SolidMotion& of, const Eigen::VectorXd& f);
/// Forces or velocities of all nodes along the axes of the frame, in space.
Eigen::VectorXd into_space(const SolidMotion& of, const Eigen::VectorXd& f);
/// The turn of the whole that has the velocities' angular momentum, by lumped masses [rad/s].
Vec3 mean_spin(const SolidModel& model, const SolidMotion& m);

/// Amplitudes of the rigid modes nearest to u, of all nodes [m].
Eigen::VectorXd mean_motion(const SolidUnknowns& unknowns, const Eigen::VectorXd& u);
/// The turned rigid modes of the shape as it is: true forces balance on these.
void turn_modes(const SolidModel& model, const SolidMotion& m, SolidUnknowns& unknowns);
/// Name of a combination of rigid modes, e.g. "shift along (0, 0, 1)".
std::string mode_name_of(const SolidModel& model, const SolidUnknowns& unknowns,
                         const Eigen::VectorXd& a);
/// Of all degrees of freedom, those of the free ones.
Eigen::VectorXd free_part(const SolidUnknowns& unknowns, const Eigen::VectorXd& all);
/// Of all degrees of freedom, those of the unknowns.
Eigen::VectorXd unknown_part(const SolidUnknowns& unknowns, const Eigen::VectorXd& all);
/// A vector of the unknowns from that of the free ones: 0 at the pins.
Eigen::VectorXd with_pins(const SolidUnknowns& unknowns, const Eigen::VectorXd& y);

/// M v.
Eigen::VectorXd mass_times(const SolidModel& model, const Eigen::VectorXd& v);
/// Adds what supports need of a displacement [N]; their energy [J].
double add_support_forces(const SolidModel& model, int threads, const Eigen::VectorXd& u,
                          Eigen::VectorXd& f);

} // namespace amontons
