#pragma once

#include "mesh/volume_mesh.hpp"
#include "solver/solid/assembly.hpp"

#include <span>
#include <stdexcept>
#include <string>
#include <vector>

// The matrix of a solid too large to be factored: solves by Krylov's methods with algebraic
// multigrid, in the module petsc, on one machine or on all ranks of mpirun. No PETSc here.

namespace amontons {

/// Whether this process was started by mpirun (or srun) as one of several.
bool started_by_mpirun();
/// Its rank, from the environment of mpirun: the module need not be there.
int mpirun_rank();

/// Why large solids cannot be solved by iterations: the module petsc is not installed, or what it
/// needs is not; "" if they can. Loads PETSc and MPI, and starts neither.
std::string parallel_fault();

/// MPI over the life of a command. Rank 0 runs the program; other ranks wait for its orders.
class ParallelRun {
public:
    /// Does nothing unless started_by_mpirun().
    /// @throws InputError  if the module is missing or MPI does not start
    ParallelRun();
    ~ParallelRun();
    ParallelRun(const ParallelRun&) = delete;
    ParallelRun& operator=(const ParallelRun&) = delete;
    /// On ranks above 0: works for rank 0 until it has finished, and returns true.
    bool served();
};

/// How many ranks work on large solids; 1 without mpirun.
int parallel_ranks();

/// Memory of all ranks at their peaks [bytes]; 0 where the module is not open.
double parallel_peak_memory();

/// A linear system that iterations do not solve: the step is refused with these words.
struct LinearFault : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// A = of_mass M + of_stiffness K of a linear solid, and blocks of contacts added to it. All
/// vectors are of all degrees of freedom, 3 node + axis; held ones have their diagonal alone.
class LargeMatrix {
public:
    /// A block of three rows and columns.
    struct Block {
        std::int32_t row = 0, column = 0; ///< nodes of one element
        Mat3 value = Mat3::Zero();        ///< [N/m]
    };
    struct Result {
        /// Iterations of the linear solver.
        int iterations = 0;
        double reached = 0; ///< residual over right-hand side (ratio)
        std::string fault;  ///< "" if that is the tolerance; else how the solve ended, in words
    };

    /// Opens the module if it is not open yet; distributes and assembles A.
    /// @param on_all_ranks  of mpirun; else on this one alone
    /// @throws InputError  if the module is missing; std::runtime_error if PETSc fails
    /// @param of_mass, of_stiffness  factors of M and K in A
    LargeMatrix(const VolumeMesh& mesh, const SolidPattern& pattern, const SolidMaterial& material,
                double of_mass, double of_stiffness, std::span<const std::int32_t> held,
                bool on_all_ranks);
    ~LargeMatrix();
    LargeMatrix(const LargeMatrix&) = delete;
    LargeMatrix& operator=(const LargeMatrix&) = delete;

    /// A + the blocks is what is solved with from now on.
    /// @param symmetric  and positive semidefinite
    /// @param renew      the preconditioner is made anew: worth it where blocks are others
    void set_blocks(const std::vector<Block>& blocks, bool symmetric, bool renew);
    /// f <- (A + blocks)^-1 f, 0 where held.
    /// @param tolerance  of the residual, relative to f
    /// @throws LinearFault  if a number of f is not finite; std::runtime_error if PETSc fails
    Result solve(Eigen::VectorXd& f, double tolerance, int most_iterations = 500);

    std::int64_t iterations() const { return iterations_; } ///< of all solves

private:
    std::vector<std::int32_t> held_;
    int id_ = -1;
    bool plain_ = false; ///< no blocks, and a preconditioner for that
    std::int64_t iterations_ = 0;
};

} // namespace amontons
