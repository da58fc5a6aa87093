#pragma once

#include "solver/linear/supernodal.hpp"
#include "solver/solid/assembly.hpp"

namespace amontons {

/// Factors the free part of a solid's matrix (stiffness, or that of a time step).
/// @param whole    3 nodes x 3 nodes, as assembled
/// @param options  options.node_order, if given, is one of the mesh's nodes
FactorResult factor_free(const SparseMatrix& whole, const FreeDofs& dofs,
                         const SupernodalOptions& options, SupernodalFactor& factor);

/// Rows of the stored columns: those of the surface's nodes, or of all nodes.
enum class ColumnRows { surface, all };

/// Counts of a SolidCompliance since it was made.
struct ComplianceCounts {
    std::int64_t columns_solved = 0;  ///< nodes, three columns each
    std::int64_t columns_dropped = 0; ///< to make room
    std::int64_t from_factor = 0;     ///< calls answered by the factor, for lack of columns
    std::size_t bytes = 0;            ///< of the columns kept now
};

/// Compliance of a body with a constant matrix A for contact: W = C^T A^-1 C and displacements.
///
/// Columns of A^-1 are solved for nodes that come into contact and kept, three for each node, with
/// the rows of the surface only, or, for small bodies that move, with all rows. From then on W is
/// assembled from them: its cost depends on the contacts, not on the mesh. Columns cost more than
/// one W from the factor's elimination tree, as they hold the whole surface: while some are
/// missing, W is computed by the tree, until that has cost as much as the missing columns would.
/// So columns of a few new nodes are solved at once, those of a new contact area after it has
/// persisted for a while, and the cost never exceeds twice the least possible. The decision uses a
/// count of operations, which is the same in every run.
///
/// The columns used least recently are dropped when the memory is full; with more nodes in contact
/// than it can hold, W is computed from the factor each time.
/// One object serves one thread at a time. Derivation and costs: docs/theory/compliance.md.
class SolidCompliance {
public:
    /// @param factor         of the free part of A
    /// @param dofs           free ones of the mesh; what is pinned counts as prescribed
    /// @param surface_nodes  those that contacts may name, each once
    /// @param memory         most bytes of kept columns; 72 for each pair of a node in contact and
    ///                       a node of the surface (ColumnRows::all: of the mesh)
    SolidCompliance(SupernodalFactor factor, FreeDofs dofs,
                    std::span<const std::int32_t> surface_nodes, std::size_t memory = kColumnMemory,
                    ColumnRows rows = ColumnRows::surface);
    /// Default memory limit of the columns [bytes].
    static constexpr std::size_t kColumnMemory = std::size_t(1) << 30;

    /// A is `scale` (> 0) times the factored matrix: a changed Young's modulus needs no new factor.
    void set_scale(double scale);

    /// W = C^T A^-1 C, symmetric to the last bit [m/N for a stiffness].
    /// Workspace: 72 bytes for each pair of a row and a node in contact.
    /// @param C  free x rows; acts on nodes of the surface only
    /// @param W  resized to rows x rows
    /// @return   whether it came from kept columns, else from the factor
    /// @throws std::logic_error  if C acts on a node that is not of the surface
    bool delassus(const SparseMatrix& C, Eigen::MatrixXd& W);
    /// The same from the factor, even if all columns are stored.
    void delassus_from_factor(const SparseMatrix& C, Eigen::MatrixXd& W);
    /// Announces about so many solves to come: columns are then solved earlier, also for some nodes
    /// that have not been in contact yet.
    /// @param solves  expected number
    void expect(double solves);
    /// Threads that solve for columns; results are bitwise the same for any number.
    void use_threads(int threads) { threads_ = threads; }
    /// Solves the columns of these nodes now, as far as there is room.
    void prepare(std::span<const std::int32_t> nodes);

    /// x = A^-1 f, 0 where prescribed: one solve with the factor.
    /// @param f  3 nodes [N]
    Eigen::VectorXd displacement(const Eigen::VectorXd& f) const;
    /// x = A^-1 f on the surface only, of forces there: from kept columns, or one solve if some are
    /// missing.
    /// @param f  3 surface nodes in the order given [N]
    Eigen::VectorXd surface_displacement(const Eigen::VectorXd& f);
    /// The same of many such forces at once, the columns of F: from kept columns, or by the factor
    /// where there is no room for all that it takes.
    /// @param Y  3 surface nodes x columns
    /// @return   false, and nothing done, if some that there is room for are missing
    bool surface_displacements(const SparseMatrix& F, Eigen::MatrixXd& Y) const;
    /// x = A^-1 f of the free degrees of freedom, for forces on the surface: from columns with all
    /// rows, or one solve.
    Eigen::VectorXd solved(const Eigen::VectorXd& f);

    /// Which columns are stored, and the counts that decide on further ones: kept_size() numbers,
    /// from which keep() of another object continues with bitwise the same results.
    std::vector<double> kept() const;
    void keep(std::span<const double> kept); ///< restores kept(); solves those columns again
    /// Numbers of kept() for so many nodes of the surface.
    static std::size_t kept_size(std::size_t surface_nodes) { return 3 + 2 * surface_nodes; }

    const SupernodalFactor& factor() const { return factor_; }
    /// Moves the factor out, to be used for other values of the same pattern; this object must not
    /// be used afterwards.
    SupernodalFactor release() { return std::move(factor_); }
    const FreeDofs& dofs() const { return dofs_; }
    const ComplianceCounts& counts() const { return counts_; }
    std::size_t most_columns() const { return most_columns_; } ///< nodes that there is room for

private:
    struct Column {
        std::int32_t node = -1;     // of the surface
        std::int64_t last_used = 0; // number of the call
        std::vector<double> value;  // for a force along each axis, 3 of each node that has rows
    };
    using Three = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3>>;
    Three column(std::int32_t surface_node) const
    {
        return Three(columns_[std::size_t(column_of_[std::size_t(surface_node)])].value.data(),
                     row_nodes_ * 3, 3);
    }
    /// Where the rows of a surface node begin in a column.
    Eigen::Index row_of(std::int32_t surface_node) const
    {
        return 3 *
               Eigen::Index(all_rows_ ? surface_node_[std::size_t(surface_node)] : surface_node);
    }
    void find_nodes(const SparseMatrix& C);
    void drop_nodes();
    void order_nodes();
    void use_columns();
    bool has_columns();
    bool columns_pay(double without); ///< operations of this call without them
    double solve_flops() const;
    void solve_columns(std::span<const std::int32_t> missing);
    void add_expected(std::vector<std::int32_t>& missing);
    std::int32_t free_column();
    void solve_on_surface(const SparseMatrix& F, Eigen::MatrixXd& Y) const;
    Eigen::VectorXd moved_by(std::span<const Vec3> force) const;
    Eigen::VectorXd on_surface(const Eigen::VectorXd& x) const;

    SupernodalFactor factor_;
    FreeDofs dofs_;
    std::vector<std::int32_t> surface_node_, surface_number_; // and the way back, or -1
    bool all_rows_ = false;
    Eigen::Index row_nodes_ = 0; // nodes that columns have rows of
    std::vector<std::int32_t> row_dofs_,
        place_of_row_;                    // free rows of these: numbers, 3 node + axis
    std::vector<std::int32_t> column_of_; // of each surface node, or -1
    std::vector<Column> columns_;
    std::size_t most_columns_ = 0;
    std::int64_t calls_ = 0;
    double scale_ = 1;
    double column_cost_ = 0; // operations for one node
    double spent_ = 0;       // on W by the tree, since columns are missing
    double expected_ = 0;    // to be spent
    int threads_ = 1;
    ComplianceCounts counts_;
    std::vector<std::int32_t> in_contact_; // surface nodes of the present call, ascending
    std::vector<std::int32_t> part_nodes_; // in_contact_ when part_ was gathered
    Eigen::MatrixXd part_;
    std::vector<std::int32_t> place_; // of each surface node in in_contact_
};

} // namespace amontons
