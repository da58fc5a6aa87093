#pragma once

#include "solver/step/byte_stream.hpp"
#include "solver/step/simulation.hpp"
#include "solver/step/wire_step.hpp"

namespace amontons {

/// A wire of a scene with the obstacles that it can touch.
/// @param near  out: places in `obstacles` of its walls, in order
WireBody build_wire(const Scene& scene, const BeamInput& beam,
                    const std::vector<Obstacle>& obstacles, std::vector<int>& near);

/// Adds an issue where the introducer ends in a wall or the wire starts in one.
void check_start(const Scene& scene, const BeamInput& beam, const WireBody& body,
                 const std::vector<Obstacle>& obstacles, const std::vector<int>& near,
                 std::vector<Issue>& issues);

/// What changes of a wire.
struct SavedWire {
    WireState state;
    WireDynamics dynamics;
    std::vector<Proximity> proximity;
};
void save_wire(const WireBody& body, ByteWriter& out);
/// @throws InputError  if the bytes do not fit the wire
SavedWire read_wire(const WireBody& body, ByteReader& in);
void restore_wire(WireBody& body, const SavedWire& saved);

} // namespace amontons
