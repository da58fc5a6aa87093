#pragma once

#include "solver/output/vtk/view_frame.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace amontons {

/// Frames for the page of `amontons studio`: made one at a time, when the last one was fetched, and
/// without the shapes that did not move since.
class LiveFrames {
public:
    /// A frame is requested.
    /// @param after  sequence of the frame that the page has
    void request_frame(std::uint64_t after, bool whole);
    /// The state is another one: numbered in real time, so that numbers grow from engine to engine.
    void changed();
    /// A frame is waited for and there is something new.
    bool due() const;
    /// The next one has all shapes.
    bool next_is_whole() const { return request_ && (request_->whole || sent_ == 0); }
    /// @param frame  with all shapes if `whole`, else at least those that move
    /// @return  its bytes
    std::string take(ViewFrame frame, bool whole, std::int64_t step, double time, bool done);

private:
    struct FrameRequest {
        std::uint64_t after = 0;
        bool whole = false;
    };
    std::uint64_t state_ = 0, sent_ = 0;
    std::optional<FrameRequest> request_;
    std::map<std::string, std::pair<std::vector<float>, std::vector<float>>> shown_;
};

/// A frame with its length before it. @return  false if the reader has closed it
bool send_frame(int stream, const std::string& frame);

} // namespace amontons
