#pragma once

#include "solver/solid/element.hpp"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

// The choice of the method for the linear systems of a scene's solids, and the predicted cost of
// each. The model and the constants measured for it: docs/theory/large.md.

namespace amontons {

/// The properties of a solid on which the cost depends.
struct SolidSize {
    std::string name;
    const VolumeMesh* mesh = nullptr;
    double rows = 0;         ///< of contacts that may act at once, about: number
    bool friction = false;   ///< some of them
    bool columns = false;    ///< contact without W does not serve it: a solve per column instead
    std::string only_direct; ///< why its systems cannot be iterated on; "": they can
    SolidMaterial material;
    double of_mass = 0, of_stiffness = 1;            ///< in the matrix of a step: factors
    std::function<std::vector<std::int32_t>()> held; ///< degrees of freedom; called by a trial
};

/// One method: memory, time, and the reason if it is impossible.
struct LinearPath {
    std::string name; ///< "direct" | "iterative" | "distributed"
    bool possible = true;
    std::string why;        ///< the reason if it is not possible, else a description
    double memory = 0;      ///< predicted peak of all ranks together [bytes]
    double memory_here = 0; ///< of those on this machine [bytes]
    double seconds = 0;     ///< predicted, of the whole run [s]
};

/// Predictions and the choice of a linear solver.
struct LinearPlan {
    /// The method that the scene requests; the method chosen; the reason.
    std::string requested = "auto", taken, why;
    std::string refusal;       ///< "" unless the path taken does not fit, or is not possible
    double available = 0;      ///< memory that this process may still take [bytes]
    int tried_iterations = 0;  ///< of one solve by multigrid; 0: none was tried
    bool tried_enough = false; ///< it took more, but a factor is quicker from there on
    std::vector<LinearPath> paths;
    /// The method of a name; nullptr: none.
    const LinearPath* path(const std::string& name) const;
};

/// What may still be allocated: the least of free memory, the group's limit and the process's own.
/// [bytes]
double available_memory();

/// @param requested  "auto" or a path's name
/// @param steps   about how many
/// @param ranks   of mpirun
/// Where a factor and iterations both fit, "auto" tries one solve, which starts MPI and PETSc.
/// @param analyse  also factors of large meshes that are not requested: some seconds
LinearPlan plan_linear(const std::vector<SolidSize>& solids, const std::string& requested,
                       bool dynamic, double steps, int ranks, bool analyse);

/// Entries of L and operations of one factor of a solid, nodes in METIS's order; from the mesh
/// alone.
struct FactorCost {
    /// Entries of L and operations of the factor.
    double entries = 0, flops = 0;
    double couplings = 0; ///< pairs of nodes that share an element, each with itself too
};
/// @param analyse  else of a cube with as many nodes; so it is for small meshes
FactorCost factor_cost(const VolumeMesh& mesh, bool analyse);

/// Memory of a mesh of so many nodes and elements while bodies are made of it [bytes].
double mesh_memory(double nodes, double elements);

} // namespace amontons
