#pragma once

#include "solver/body/solid_elements.hpp"
#include "solver/body/solid_memory.hpp"

#include "mesh/base/dense.hpp"

#include <limits>

// The tangent of a hyperelastic solid, made positive where it is not, and the loads whose pressure
// is found.

namespace amontons {

/// How the matrix of a hyperelastic solid differs from its true tangent.
struct SolidTangent {
    Eigen::SparseMatrix<double> skew;      ///< what the matrix lacks of the true tangent
    Eigen::SparseMatrix<double> unshifted; ///< the matrix without its shift; empty: it has none
    SparseColumns stabilised;              ///< N, of the free unknowns
    LuFactor open;                         ///< 1 - N^T L^-1 N
    double shift = 0, last_shift = 0;      ///< numbers of next_shift()
    bool indefinite = false;               ///< seen in this step
    bool kept = false;                     ///< the last linearise() has kept the earlier matrix
};

/// The way of an iterate to its balance.
struct BalanceSearch {
    Eigen::VectorXd start_residual; ///< of free unknowns, where the last matrix was made
    Eigen::VectorXd pending;        ///< of u: what is prescribed and not yet moved
    double last_error =
        std::numeric_limits<double>::infinity(); ///< relative; infinity: none yet in this step
    int stalled = 0;            ///< iterations in a row that did not halve the error
    double accepted_length = 1; ///< of the last change (ratio)
    double round_off = 0;       ///< the part of the imbalance that may be round-off (relative)
};

/// Loads that prescribe a volume, by a pressure that is found: a border of the matrix.
struct VolumeLoads {
    /// One of them.
    struct Load {
        std::size_t load = 0;                    ///< number of it among the conditions' loads
        double pressure = 0, state_pressure = 0; ///< of the iterate and the state [Pa]
    };
    std::vector<Load> loads;
    Eigen::MatrixXd force, compliance; ///< of 1 Pa on free unknowns, and A^-1 of it
    Eigen::MatrixXd matrix;            ///< inverse of give per force
    Eigen::VectorXd change;            ///< of the pressures, by the free change [Pa]
};

/// Loads of the scene whose volume is prescribed.
VolumeLoads volume_loads(const SolidModel& model);
/// Of all loads at a motion and time, along the frame [N].
Eigen::VectorXd load_forces(const SolidModel& model, const StepInput& step,
                            const VolumeLoads& volumes, const SolidMotion& m, double t);
/// How far the volumes are from what is prescribed, relative to it [-].
double volumes_missing(const SolidModel& model, const StepInput& step, const VolumeLoads& volumes,
                       const SolidMotion& m);

/// Sets S to the elements' tangents and the symmetric part of that of pressures.
/// @return  the rest, of the free unknowns
Eigen::SparseMatrix<double>
assemble_hyperelastic(const SolidModel& model, const SolidUnknowns& unknowns, const StepInput& step,
                      const HyperelasticPart& hyper, const VolumeLoads& volumes, SparseMatrix& S);
/// The next way to make the matrix positive: a line of a table, from 1, negative; then shares of
/// the stiffness at rest. @return  0 if none is left
double next_shift(const StepInput& step, const SolidContactForces& contact, SolidTangent& tangent);
/// Adds N N^T to the matrix by the shift of next_shift().
void stabilise(const SolidModel& model, const SolidUnknowns& unknowns, const SolidMatrix& matrix,
               const StepInput& step, const SolidContactForces& contact, SolidTangent& tangent,
               SparseMatrix& S);

} // namespace amontons
