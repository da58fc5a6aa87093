#pragma once

#include "mesh/base/curve.hpp"

#include <vector>

// A section's law by table: its moment over its curvature, its force over its strain. Elastic:
// unloading follows the loading curve.

namespace amontons {

/// Straight between the table's points and beyond the last; corners are rounded by parabolas over a
/// twentieth of the shorter side, so that the stiffness is continuous (except at 0, where it may
/// differ between tension and compression).
struct TableLaw {
    /// From `start` on: force + stiffness d + bend d^2 / 2.
    struct Piece {
        /// Strain where the piece starts; energy, force and stiffness there; bend: change of
        /// stiffness [per unit of strain].
        double start = 0, energy = 0, force = 0, stiffness = 0, bend = 0;
    };
    std::vector<Piece> pieces;
    double at_rest = 0; ///< stiffness at 0 [N per unit of strain]

    /// Energy, force and stiffness at a strain.
    struct Value {
        /// Energy per length [J/m], its first and second derivative by the strain.
        double energy = 0, force = 0, stiffness = 0;
    };
    /// Of the whole table, with its stiffness at rest. @param strain  [-] or [1/m]
    Value at(double strain) const;
    /// The part beyond the linear law of the stiffness at rest. @param strain  [-] or [1/m]
    Value beyond(double strain) const;
};

/// @param table  (strain, force): both increasing, (0, 0) among them
TableLaw make_table_law(const CurvePoints& table);

/// The law of another strain: of `scale` times it.
TableLaw scaled(TableLaw law, double scale);

} // namespace amontons
