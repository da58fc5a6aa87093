#pragma once

#include "solver/body/solid_body.hpp"

#include <optional>

namespace amontons {

/// A linear solid in quasi-static steps, condensed on the nodes that may touch something.
///
/// Its displacement is a sum: that of each load and each prescribed set at size one, found once,
/// times its present size, and that by the contact forces. So the work of a step depends on the
/// contacts alone, not on the mesh; energies and reactions follow from products of the parts, by
/// reciprocity (Betti). Displacements of inner nodes are computed on demand: complete().
class CondensedSolid final : public SolidBody {
public:
    using SolidBody::SolidBody;

    int unknowns() const override { return int(free_touching_.size()); }
    void make_ready(const StepInput& step, const std::string& cache,
                    std::vector<std::string>& messages) override;
    void begin(const StepInput& step) override;
    void linearise() override;
    void add_column(const BodyPlace& at, const Vec3& direction, double scale, int column,
                    std::vector<Eigen::Triplet<double>>& out) const override;
    void compliance(const SparseColumns& C, Eigen::MatrixXd& W) override;
    Eigen::VectorXd solve(const Eigen::VectorXd& force) override;
    Eigen::VectorXd solve(const SparseColumns& C, const Eigen::VectorXd& r) override;
    void update(const Eigen::VectorXd& y, const Eigen::VectorXd& mode,
                const Eigen::VectorXd& force) override;
    double imbalance(const Eigen::VectorXd&) override { return 0; }
    void add_reaction(const BodyPlace& at, const Vec3& force) override;
    BodyEnergy accept(const Eigen::VectorXd& force) override;
    std::vector<Vec3> reactions() const override;
    std::vector<Vec3> moments() const override;
    void complete() override;
    bool condensed() const override { return true; }
    bool independent_of_path() const override { return unknowns_.rigid->R.cols() == 0; }
    void begin_at(std::span<const Vec3> touching) override;
    std::vector<double> state() const override;
    void set_state(std::span<const double> state) override;
    std::vector<double> state_from(const Body& before) const override;

private:
    /// One load or prescribed set at size one.
    struct Part {
        bool prescribed = false;
        std::size_t input = 0; ///< of the scene's loads or holds; loads' number: the weight
        int axis = -1;         ///< of the frame; -1: a pressure
        Eigen::VectorXd force; ///< 3n [N per unit]; prescribed: none
        std::vector<std::int32_t> dofs; ///< prescribed: where u is one
        Eigen::VectorXd at_touching;    ///< what it does there, 3 touching
        Eigen::VectorXd on_modes;       ///< its load on the rigid modes
        Eigen::VectorXd mean_motion;    ///< of what it does, of all nodes
    };
    void make_parts();
    Eigen::VectorXd amounts(double t) const; ///< of each part
    Eigen::VectorXd full_force(const Eigen::VectorXd& on_touching) const;
    /// Sum of the parts at the touching nodes, 3 touching.
    Eigen::VectorXd parts_at_touching(const Eigen::VectorXd& amounts) const;
    void place_touching(Motion& m);
    /// Motion as a whole that u has with its pins held, under the loads and forces at contacts.
    Eigen::VectorXd mean_with_pins(const Eigen::VectorXd& amounts,
                                   const Eigen::VectorXd& on_touching) const;
    void move_as_a_whole(const Eigen::VectorXd& mode);
    Eigen::VectorXd load_on_modes(const Eigen::VectorXd& amounts) const;
    void place_in_frame(Motion& m) override { place_touching(m); }

    void make_motions(const SparseColumns& C);

    std::vector<Part> parts_of_u_;
    /// Of the holds, about the axes at their middles: of amounts of one, and of forces on touching
    /// nodes (a column for each).
    Eigen::MatrixXd moment_of_part_, moment_of_contact_;
    Eigen::MatrixXd between_; ///< load i times what part j does, or the reaction of hold i to it
    std::vector<std::int32_t> free_touching_;   ///< of each unknown: 3 touching + axis
    std::vector<std::int32_t> unknown_of_;      ///< of 3 touching, or -1
    std::vector<std::int32_t> touching_number_; ///< of each node, or -1
    Eigen::MatrixXd modes_at_touching_;         ///< 3 touching x m

    Eigen::VectorXd amount_, amount_now_; ///< of the state and the iterate
    Eigen::VectorXd on_touching_,
        on_touching_now_;             ///< contact forces, 3 touching, in the frame [N]
    Eigen::VectorXd mode_, mode_now_; ///< amplitudes in u; floating: they leave it no mean motion
    Eigen::MatrixXd mean_of_force_;   ///< 3 touching x m: mean motion by forces there
    Eigen::VectorXd mean_now_;        ///< of all that pins hold in u, at the iterate
    Eigen::VectorXd loaded_;          ///< force of loads times displacement, of the state
    Eigen::VectorXd held_force_;      ///< of prescribed parts, of the state [N]
    double rigid_work_ = 0;           ///< of loads on the frame's motion in this step [J]
    bool complete_ = true;            ///< the state's u holds for all nodes
    // A^-1 C of columns that stay: few contacts may act on many nodes.
    int same_columns_ = 0;                   ///< calls in a row with the columns that came last
    std::optional<Eigen::MatrixXd> motions_; ///< unknowns x columns; empty: slower than solves
};

} // namespace amontons
