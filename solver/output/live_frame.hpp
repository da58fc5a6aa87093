#pragma once

#include "solver/output/vtk/view_frame.hpp"

#include <cstdint>
#include <string>

namespace amontons {

/// What a live frame reports beside its shapes.
struct LiveFrameHead {
    std::uint64_t sequence = 0; ///< grows from frame to frame
    std::uint64_t before = 0; ///< sequence of the frame that shapes are left out against; 0: whole
    std::int64_t step = -1;   ///< -1 before step 0
    double time = 0;          ///< reached [s]
    bool done = false;        ///< the scene's end is reached
};

/// A frame as the page of `amontons studio` reads it (docs/studio.md): "AMF1", the length of a
/// header as 4 bytes, the header in JSON padded by spaces to a multiple of 8, then arrays, each at
/// a multiple of 8. Little-endian. Points of shapes with more than 20000 of them are 16-bit numbers
/// of their box, wrong by 8e-6 of its largest side at most; all else are 32-bit ones.
std::string live_frame_bytes(const ViewFrame& frame, const LiveFrameHead& head);

} // namespace amontons
