#pragma once

#include <cstdint>

// What libamontons-petsc.so offers: the matrix of one large solid, on one rank or spread over all
// ranks of mpirun, and solves with it. Plain C types: the module is opened by dlopen
// (solver/module.hpp), and its callers depend neither on PETSc nor on MPI.
//
// Rank 0 runs the program; the others serve: they wait in amontons_petsc_serve for what rank 0
// orders of all. Numbers of nodes are those of the caller's mesh throughout. A function that returns
// an int gives 0, or 1 and the reason in `message`. An error on a rank while others work with it
// ends all of them: MPI cannot continue without one.

struct AmontonsElements {
    int kind; ///< an ElementKind
    std::int64_t count;
    const std::int32_t* nodes; ///< element by element
};

/// A = of_mass M + of_stiffness K of a linear elastic solid; rows and columns that are held have
/// nothing but their diagonal.
struct AmontonsLargeMesh {
    std::int64_t nodes;
    const double* places; ///< 3 of each [m]
    int blocks;
    const AmontonsElements* block;
    double youngs_modulus, poisson_ratio, density;
    double of_mass, of_stiffness;
    int ranks; ///< that get a part of it
    std::int64_t held_count;
    const std::int32_t* held; ///< degrees of freedom, 3 node + axis
    /// Which nodes share an element: nodes + 1 starts, and neighbours (a node may be its own).
    const std::int32_t* graph_start;
    const std::int32_t* graph;
};

/// Blocks that are added to A until the next call: those of contacts.
struct AmontonsLargeBlocks {
    std::int64_t count;
    const std::int32_t* node; ///< 2 of each: row, column; they share an element
    const double* value;      ///< 9 of each, by rows [N/m]
    int symmetric;            ///< and positive semidefinite: CG; else GMRES
    int renew;                ///< the preconditioner is made for this matrix
};

/// How a solve ended.
enum AmontonsLargeEnding {
    kLargeReached,     ///< the tolerance
    kLargeIterations,  ///< most_iterations, before the tolerance
    kLargeNoMultigrid, ///< the preconditioner cannot be made
    kLargeBrokeDown    ///< Krylov's method cannot continue
};

struct AmontonsLargeSolve {
    double tolerance; ///< of the residual, relative to the right-hand side
    int most_iterations;
    int iterations; ///< out
    double reached; ///< out: residual, relative; infinite where y is none, and 0 then
    int ending;     ///< out: an AmontonsLargeEnding
};

extern "C" {
using AmontonsPetscStart = int(char* message, int size);
using AmontonsPetscNumber = int();
using AmontonsPetscCall = void();
using AmontonsPetscMake = int(const AmontonsLargeMesh*, int* id, char* message, int size);
using AmontonsPetscBlocks = int(int id, const AmontonsLargeBlocks*, char* message, int size);
using AmontonsPetscSolve = int(int id, double* f_then_y, AmontonsLargeSolve*, char* message,
                               int size);
using AmontonsPetscDrop = void(int id);
using AmontonsPetscPeak = double();
}

// amontons_petsc_start   MPI and PETSc begin, once
// amontons_petsc_ranks   how many there are
// amontons_petsc_serve   ranks above 0: until rank 0 finishes
// amontons_petsc_finish  rank 0: the others leave amontons_petsc_serve; MPI ends on each
// amontons_petsc_make, amontons_petsc_blocks, amontons_petsc_solve, amontons_petsc_drop   rank 0
// amontons_petsc_peak    rank 0: the sum of all ranks' peak memory [bytes]
