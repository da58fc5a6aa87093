#pragma once

#include "solver/step/byte_stream.hpp"
#include "solver/step/coaxial.hpp"
#include "solver/step/simulation.hpp"
#include "solver/step/soft_vessel.hpp"
#include "solver/step/wire_step.hpp"

namespace amontons {

/// A wire of a scene with the obstacles and walls of vessels that it can touch.
/// @param near  out: the bodies of its walls, in order: places in `obstacles`, or those of vessels,
///              which come after obstacles and beams
WireBody build_wire(const Scene& scene, const BeamInput& beam,
                    const std::vector<Obstacle>& obstacles, const std::vector<SoftVessel>& vessels,
                    std::vector<int>& near);

/// Adds an issue where the introducer ends in a wall or the wire starts in one.
/// @param walls  names of the wire's walls
void check_start(const Scene& scene, const BeamInput& beam, const WireBody& body,
                 const std::vector<std::string>& walls, const std::vector<Obstacle>& obstacles,
                 std::vector<Issue>& issues);

/// Wires that touch one another are solved together.
/// @param coaxial  out: the instruments in one another, kept by the groups
std::vector<WireGroup> make_groups(const Scene& scene, std::vector<WireBody>& wires,
                                   std::vector<std::unique_ptr<Coaxial>>& coaxial);

/// Saves reactions for a checkpoint.
void save_reactions(const std::vector<Reaction>& reactions, ByteWriter& out);
/// Reads reactions.
std::vector<Reaction> read_reactions(std::size_t size, ByteReader& in);

/// The variable part of a wire, for checkpoints.
struct SavedWire {
    int halvings = 0; ///< of the distance of its contact points
    WireState state;
    WireDynamics dynamics;
    std::vector<Proximity> proximity;
    std::vector<std::shared_ptr<WallState>> walls; ///< as read_walls gives them
};
/// Saves a wire for a checkpoint.
void save_wire(const WireBody& body, ByteWriter& out);
/// @throws InputError  if the bytes do not fit the wire
SavedWire read_wire(const WireBody& body, ByteReader& in);
/// Restores a saved wire.
void restore_wire(WireBody& body, const SavedWire& saved);

} // namespace amontons
