#pragma once

#include "mesh/generate/solid_tube.hpp"
#include "mesh/wall.hpp"
#include "solver/beam/wall_material.hpp"
#include "solver/solid/compliance.hpp"

#include <array>
#include <memory>
#include <optional>

// A vessel whose wall is an elastic solid, for instruments that touch its inner surface. Theory:
// docs/theory/soft_vessels.md.

namespace amontons {

/// A place on the inner surface, by its numbers in the undeformed tube, and the weights there of
/// the nodes around it: bicubic B-splines, twice differentiable, sum 1.
struct TubePlace {
    double along = 0;                    ///< arc length on the centreline [m]
    double around = 0;                   ///< angle from the section's `across` [rad]
    std::array<std::int32_t, 16> node{}; ///< of the grid of inner nodes
    std::array<double, 16> weight{}, by_along{}, by_around{}; ///< [-], [1/m], [1/rad]
    /// Second derivatives: along twice, along and around, around twice.
    std::array<std::array<double, 16>, 3> second{};
};

/// A force on the wall.
struct TubeForce {
    TubePlace place;
    Vec3 force = Vec3::Zero(); ///< [N]
};

/// The point y of the undeformed tube that is displaced to x = y + u(y), where the displacement of
/// the inner surface is continued straight along its normal.
struct PulledBack {
    Vec3 y = Vec3::Zero(), u = Vec3::Zero(); ///< [m]
    Mat3 gradient = Mat3::Identity();        ///< dx / dy
    TubePlace place;
    Vec3 by_along = Vec3::Zero(), by_around = Vec3::Zero(); ///< derivatives of u [-], [m/rad]
    Vec3 along = Vec3::Zero(), around = Vec3::Zero(); ///< gradients of the place's numbers in y
    Mat3 along_bend = Mat3::Zero(), around_bend = Mat3::Zero(); ///< their second derivatives
};

/// How a tube is held and loaded beside its contacts.
struct SoftTubeSupport {
    std::vector<std::int32_t> fixed; ///< degrees of freedom that do not move
    Eigen::VectorXd load;            ///< constant, 3 nodes [N]; empty: none
};
using WallStatePointer = std::shared_ptr<const WallState>;

/// The nodes of a tube's inner surface, ring by ring.
struct TubeGrid {
    std::int32_t rings = 0, ring = 0; ///< rings, nodes in one
    double ring_distance = 0;         ///< along the centreline [m]
    std::vector<std::int32_t> node;   ///< of the mesh, of each of the grid
};
/// The grid of a mesh that make_solid_tube made with these options.
TubeGrid tube_grid(const SolidTubeOptions& options, const VolumeMesh& mesh);
/// A place of the inner surface by arc length and angle [m, rad].
TubePlace place_on(const TubeGrid& grid, double along, double around);

/// Columns of K^-1 at the nodes of a grid: those that were needed, and of them what is in use.
struct TubeColumns {
    /// 3x3 blocks of a node's columns, one in each column here.
    using Piece = Eigen::Matrix<double, 9, Eigen::Dynamic>;
    std::vector<std::int32_t> rows, row_place; ///< free dofs of the nodes; 3 grid node + axis
    std::vector<std::unique_ptr<Eigen::MatrixXd>> column; ///< of each grid node: 3 inner x 3
    std::vector<std::int32_t> used, number; ///< grid nodes used in this round; and back, or -1
    std::vector<Piece> pieces;              ///< of each grid node: at those of `used`; or empty
    std::vector<std::int32_t> with_piece;
    int solved = 0, kept = 0; ///< nodes, three columns each
};
/// No column yet.
TubeColumns tube_columns(const TubeGrid& grid, const FreeDofs& dofs);
/// Solves the columns of these nodes that are not there.
void solve_columns(const TubeGrid& grid, const FreeDofs& dofs, const SupernodalFactor& K,
                   std::span<const std::int32_t> grid_nodes, TubeColumns& columns);
/// Blocks at the nodes in use of a node's columns, gathered at first use.
const TubeColumns::Piece& piece_of(TubeColumns& columns, std::int32_t grid_node);
/// Begins another round: no node is in use.
void release_used(TubeColumns& columns);
/// Drops all columns, as of another K.
void drop_columns(TubeColumns& columns);

/// A tube of elastic material under a constant load and forces on its inner surface.
///
/// Linear material: displacements are those of the load and K^-1 times the forces. Hyperelastic:
/// K is the tangent at some state, and the displacement by the load is part of an offset that
/// solver/step/soft_balance finds, so that the sum is in equilibrium by the material's own law.
///
/// Forces are distributed to the 16 nodes around their place by the weights that interpolate
/// displacements, so that their work is exact; columns of K^-1 are solved for nodes when a force or
/// a query first comes near, and stored (72 bytes for each of those times each inner node).
/// Everything else is a product of columns, whose cost depends on the mesh only by the length of a
/// column.
/// One object serves one thread at a time.
class SoftTube {
public:
    /// @param mesh  of make_solid_tube with these options, H8 or T10
    /// @throws InputError  if the supports leave a rigid motion free
    SoftTube(SolidTubeOptions options, VolumeMesh mesh, const SolidMaterial& material,
             const SoftTubeSupport& support);
    /// Of hyperelastic material, in balance with its load.
    /// @throws InputError  also if there is no stable balance
    SoftTube(SolidTubeOptions options, VolumeMesh mesh, WallMaterial material,
             const SoftTubeSupport& support);

    const SolidTubeOptions& options() const { return options_; }
    const VolumeMesh& mesh() const { return mesh_; }
    const SolidMaterial& material() const { return material_; }
    const Wall& undeformed() const { return wall_; } ///< the inner surface without any load
    const std::vector<std::int32_t>& inner_nodes() const { return grid_.node; } ///< by rings

    /// A place of the inner surface by arc length and angle [m, rad].
    TubePlace place(double along, double around) const { return place_on(grid_, along, around); }

    /// Forces that act now, and those to which displacements of `since` refer.
    void set_forces(std::vector<TubeForce> forces) { set_(now_, std::move(forces)); }
    /// Forces to which displacements of `since` refer.
    void set_start(std::vector<TubeForce> forces) { set_(start_, std::move(forces)); }
    /// Forces that act now.
    const std::vector<TubeForce>& forces() const { return now_.forces; }

    /// Of the inner surface under load and forces [m].
    Vec3 displacement(const TubePlace& at);
    /// Displacement of the wall there relative to that by the forces of set_start() [m].
    Vec3 since_start(const TubePlace& at);
    /// @param hint  of undeformed()
    PulledBack pull_back(const Vec3& x, WallHint& hint);

    /// The hyperelastic material; null for a linear wall.
    const WallMaterial* hyperelastic() const { return hyperelastic_ ? &*hyperelastic_ : nullptr; }
    /// Of a hyperelastic wall: in balance without contacts; energies count from here.
    const WallStatePointer& at_rest() const { return at_rest_; }
    /// Sets the offset of displacements from a state; of a state with an older tangent, the offset
    /// that gives the same displacement with the present one.
    void take(const WallStatePointer& state);
    /// Displacements of `since` refer to the displacement of a state.
    void set_start(const WallState& state);
    /// Evaluates the material at the present displacement, with the present forces among the loads.
    /// @param state  in: offset, and elements to start from; out: all
    /// @returns  "", or the reason if the material cannot be evaluated there
    std::string evaluate_material(WallState& state) const;
    /// Unbalanced nodal forces of a state that evaluate_material() has evaluated, 0 at held degrees
    /// of freedom: 3 nodes [N].
    Eigen::VectorXd imbalance(const WallState& evaluated) const;
    /// Displacements K^-1 f by forces f on nodes, 3 nodes [m].
    Eigen::VectorXd answer(const Eigen::VectorXd& forces) const;
    /// Sets K to the tangent at a displacement, and drops all columns.
    /// @returns  false, without a change, where the tangent is not positive definite
    bool relinearise(std::shared_ptr<const Eigen::VectorXd> at);
    const std::shared_ptr<const Eigen::VectorXd>& tangent_at() const { return tangent_at_; }
    /// That was taken last, with the offset for this tangent.
    const WallState& state() const { return *state_; }

    /// Derivatives of since_start by the place's numbers, held forces.
    std::array<Vec3, 2> since_start_slopes(const TubePlace& at);
    /// Second derivative of m . u(y), m held [1/m].
    Mat3 bend(const PulledBack& at, const Vec3& m);

    /// Of a linear wall under the forces, the load's share left out: half of each force times what
    /// all of them move its place [J].
    double contact_energy();

    /// C: displacements at places for forces at places, 3n x 3n, symmetric [m/N].
    Eigen::MatrixXd compliance(std::span<const TubePlace> places);
    /// The same of displacements and their derivatives along and around, in this order, for forces
    /// and their dipoles: 9n x 9n, symmetric.
    Eigen::MatrixXd compliance_with_slopes(std::span<const TubePlace> places);

    /// Radius of the lumen at the start of the tube [m].
    double radius_scale() const { return options_.centreline.at(0.0).radius; }
    /// Largest displacement of an inner node by the load alone [m].
    double loaded_displacement() const { return loaded_; }
    /// Of all nodes, under load and forces: one solve [m].
    Eigen::VectorXd whole_displacement() const;
    /// Forces on all nodes by set_forces [N].
    Eigen::VectorXd nodal_forces() const;
    int columns_solved() const { return columns_.solved; } ///< nodes, three columns each
    std::size_t kept_bytes() const;                        ///< of columns

private:
    struct Field {
        std::vector<TubeForce> forces;
        Eigen::VectorXd u; ///< of the nodes in use, by the forces alone [m]
        bool current = false;
        Eigen::VectorXd offset; ///< by the load, and what a material adds: 3 inner nodes [m]
    };
    static Issue loose_wall();
    bool factor_(const SparseMatrix& K);
    std::string find_rest_();
    void set_offset_(Field& field, const Eigen::VectorXd& whole);
    void set_(Field& field, std::vector<TubeForce> forces);
    void use_(const TubePlace& place);
    void bring_up_(Field& field);
    template <int kinds> Eigen::MatrixXd compliance_(std::span<const TubePlace> places);
    Vec3 at_(const Field& field, const std::array<double, 16>& weight, const TubePlace& p) const;
    Vec3 offset_at_(const Field& field, const std::array<double, 16>& weight,
                    const TubePlace& p) const;
    Vec3 moved_(const std::array<double, 16>& weight, const TubePlace& p) const;

    SolidTubeOptions options_;
    VolumeMesh mesh_;
    SolidMaterial material_;
    Wall wall_;
    TubeFrame frame_; ///< that angles count from
    TubeGrid grid_;
    FreeDofs dofs_;
    SupernodalFactor K_;
    Eigen::VectorXd load_; ///< 3 nodes [N]
    double loaded_ = 0;

    TubeColumns columns_;
    Field now_, start_;

    std::optional<WallMaterial> hyperelastic_;
    SolidPattern pattern_;
    WallStatePointer at_rest_, taken_, state_; ///< taken_ with this tangent
    std::shared_ptr<const Eigen::VectorXd> tangent_at_;
};

} // namespace amontons
