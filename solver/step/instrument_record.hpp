#pragma once

#include "solver/step/branch_log.hpp"

namespace amontons {

/// Adds the quantities of an instrument that is solved as a rod fed from a sheath, under the names
/// of those of wires: NAME_depth, NAME_normal_force_sum, ... Its contacts get their clustered
/// forces.
/// @param beam     its record in `out`
/// @param body     its number in the contacts
/// @param depth    length that is out of the sheath [m]
/// @param cluster  normal forces within this length of the instrument are summed [m]
void record_instrument(const BeamRecord& beam, int body, double depth, double cluster,
                       StepRecord& out);

/// Quantities of such an instrument at the end of a run. Plain numbers, copied to checkpoints byte
/// by byte.
struct InstrumentLog {
    /// Part of the vessel in which the tip is.
    BranchLog branch;
    /// The opening that its tip has passed, and its obstacle; -1: none.
    int opening = -1, opening_wall = -1;
    double tip[3] = {0, 0, 0}, depth = -1; ///< when it was noted last; depth < 0: never [m]
    /// Largest values of the run [m], [N], [N m], [N].
    double max_depth = 0, max_push = 0, max_torque = 0, max_clustered = 0;

    /// @param walls  obstacles that it can touch
    void note(const StepRecord& record, const BeamRecord& beam,
              const std::vector<Obstacle>& obstacles, std::span<const int> walls);
    /// Name of the opening that the tip has passed, else of the branch where it was deepest, or "".
    std::string place(const std::vector<Obstacle>& obstacles) const;
    /// Appends its quantities to a record.
    void add_quantities(const std::string& name, std::vector<Quantity>& out) const;

private:
    const Opening& passed(const std::vector<Obstacle>& obstacles) const
    {
        return obstacles[std::size_t(opening_wall)].model.openings[std::size_t(opening)];
    }
};

} // namespace amontons
