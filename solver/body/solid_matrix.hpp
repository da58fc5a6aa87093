#pragma once

#include "solver/body/solid_model.hpp"
#include "solver/large/large_matrix.hpp"
#include "solver/linear/supernodal.hpp"
#include "solver/solid/compliance.hpp"

#include <memory>
#include <optional>
#include <utility>

namespace amontons {

/// The matrices of a solid in its frame, the factor of that of a step, and stored columns of its
/// inverse. Equal linear bodies share them.
struct SolidMatrix {
    SparseMatrix K, M, S;                    ///< stiffness at rest, mass, of a step
    Elimination parts;                       ///< of S
    SupernodalFactor factor;                 ///< of a matrix that changes
    std::optional<SolidCompliance> constant; ///< of one that does not
    std::unique_ptr<LargeMatrix> large;      ///< of a solid that is solved by iterations instead
    double scale = 1;                        ///< S over the matrix that is factored (factor)
    double h = -1, theta = -1; ///< length of the step that S is for [s], and theta of its rule
    int made = 0;              ///< number of times that S was made
    double stiffest = 0;       ///< largest entry of K, of nonlinear solids [N/m]
};

/// By what a solid's equations are solved.
struct SolidSolving {
    bool iterative = false; ///< no factor: by Krylov's methods with multigrid
    bool on_all_ranks = false;
    int threads = 1;
    std::string cache;         ///< folder of factors; "": none
    double expected_steps = 1; ///< number to come, by which is decided which columns are stored
};

/// The border of the matrix of a hyperelastic solid that contacts alone hold (solid_free.cpp).
struct ContactBorder {
    std::vector<std::int32_t> springs; ///< nodes
    SparseColumns held_up;             ///< N, of the free unknowns
    Eigen::MatrixXd turning;           ///< K R, of all nodes
    Eigen::MatrixXd mode_stiffness;    ///< S
    Eigen::MatrixXd X, T_inverse;      ///< empty: no border
    int negative = 0;                  ///< eigenvalues of K among motions without a mean
};

/// W of the columns that came last.
struct KeptCompliance {
    SparseColumns columns;
    Eigen::MatrixXd W;         ///< of them
    int made = 0;              ///< the matrix of that W: SolidMatrix::made
    bool from_factor = false;  ///< that W
    double restored = -1;      ///< a number of the columns before the state was restored; or -1
    mutable double print = -1; ///< such a number of columns; or -1
};

/// Of mass and stiffness in the matrix of a step.
std::pair<double, double> shares(const SolidModel& model, const StepInput& step);
/// K u of the stiffness at rest.
Eigen::VectorXd stiffness_times(const SolidModel& model, const SolidMatrix& matrix, int threads,
                                const Eigen::VectorXd& u);
/// Frees the memory of the matrix of a step, of which a factor is kept.
void drop_step_matrix(SolidMatrix& matrix);
/// A^-1 f of the free unknowns, with the border.
/// @throws LinearFault  if iterations do not get there
Eigen::VectorXd solved(const SolidModel& model, const SolidUnknowns& unknowns,
                       const SolidMatrix& matrix, const ContactBorder& border,
                       const Eigen::VectorXd& f);
/// The same of every column.
void solve_all(const SolidModel& model, const SolidUnknowns& unknowns, const SolidMatrix& matrix,
               const ContactBorder& border, Eigen::MatrixXd& F);

/// Adds springs to the matrix of a body that contacts alone hold, each as stiff as its node at
/// rest. @param stabilised  N of what was added to it at contacts
void support_body(const SolidModel& model, const SolidUnknowns& unknowns, const SolidMatrix& matrix,
                  const SparseColumns& stabilised, ContactBorder& border, SparseMatrix& S);
/// X and T of the factor as it is.
void find_border(const SolidModel& model, const SolidUnknowns& unknowns, const SolidMatrix& matrix,
                 ContactBorder& border);
/// R' = R - P K R, and S = (K R)^T R'.
void bend_modes(const SolidModel& model, const SolidMatrix& matrix, SolidUnknowns& unknowns,
                ContactBorder& border);

/// W of the columns that came last. @return  whether these are they
bool kept_W(const SolidMatrix& matrix, const KeptCompliance& kept, const SparseColumns& C,
            Eigen::MatrixXd& W);
/// Keeps W of these columns.
void keep_W(const SolidMatrix& matrix, KeptCompliance& kept, const SparseColumns& C,
            const Eigen::MatrixXd& W);
/// W by the matrix that stays. @param whole  C among all free unknowns
/// @return  whether they are the columns that came last before the state was restored: then W is
///          made as it was made there
bool make_W(SolidMatrix& matrix, KeptCompliance& kept, const SparseColumns& C,
            const SparseColumns& whole, Eigen::MatrixXd& W);
/// What a state keeps of the columns.
std::vector<double> kept_columns(const SolidMatrix& matrix, const KeptCompliance& kept,
                                 const SolidUnknowns& unknowns);
/// Restores kept_columns().
void keep_columns(SolidMatrix& matrix, KeptCompliance& kept, std::span<const double> columns);

} // namespace amontons
