#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace amontons {

/// Everything a run needs to continue where it was: the simulation's state and the writers'.
struct Checkpoint {
    /// A frame that is already written.
    struct Frame {
        /// Step of the frame.
        std::int64_t step = 0;
        double time = 0; ///< [s]
    };
    std::uint64_t scene_hash = 0;    ///< of the scene and its surfaces
    std::int64_t step = 0;           ///< the last finished one
    double time = 0;                 ///< reached [s]
    std::uint64_t history_bytes = 0; ///< length of history.csv up to this step
    std::uint64_t history_hash = 0;  ///< of these bytes
    std::vector<Frame> frames;
    std::vector<std::byte> state; ///< Simulation::save()
};

/// Little-endian, with a version at the start and a hash at the end.
std::string checkpoint_bytes(const Checkpoint& checkpoint);

/// @param file  for messages
/// @throws InputError  if the bytes are not a whole checkpoint of this version
Checkpoint read_checkpoint(std::string_view bytes, const std::string& file);

} // namespace amontons
