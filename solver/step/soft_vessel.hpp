#pragma once

#include "solver/beam/soft_tube.hpp"
#include "solver/beam/wire_contact.hpp"
#include "solver/step/byte_stream.hpp"
#include "solver/step/simulation.hpp"

#include <memory>
#include <vector>

namespace amontons {

/// The wall of a vessel as an elastic solid, in a scene of beams.
struct SoftVessel {
    std::string name;
    std::unique_ptr<SoftTube> tube;
};

/// How far a linear wall has moved; 0 of a hyperelastic one, whose displacements may be large [m].
double wall_motion(const SoftVessel& vessel);
/// Warning about a linear wall that moved by a tenth of the lumen's radius or more; else "".
/// @param moved  as wall_motion [m]
std::string wall_warning(const SoftVessel& vessel, double moved);

/// The solids of a scene of beams.
/// @throws InputError
std::vector<SoftVessel> build_soft_vessels(const Scene& scene);

/// Where a hyperelastic wall's tangent is taken; nothing of a linear one.
void save_tangent(const SoftTube& tube, ByteWriter& out);
/// Reads the displacement at which a wall's tangent is taken.
Eigen::VectorXd read_tangent(const SoftTube& tube, ByteReader& in);
/// @throws InputError  if there is no tangent
void restore_tangent(SoftTube& tube, const Eigen::VectorXd& at);

/// How the hyperelastic walls of a wire are displaced; nothing of others.
void save_walls(const WireState& state, const std::vector<WireWall>& walls, ByteWriter& out);
/// Their tangents are null where they are those of the walls.
std::vector<std::shared_ptr<WallState>> read_walls(const std::vector<WireWall>& walls,
                                                   ByteReader& in);

/// Its mesh with displacement, contact forces and stress, for files. Costs a solve.
BodyRecord record_vessel(const SoftVessel& vessel);

} // namespace amontons
