#include "solver/program/live_frames.hpp"

#include "solver/output/live_frame.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <unistd.h>

namespace amontons {

void LiveFrames::request_frame(std::uint64_t after, bool whole)
{
    request_ = FrameRequest{after, whole};
}

void LiveFrames::changed()
{
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    state_ = std::max<std::uint64_t>(
        state_ + 1,
        std::uint64_t(std::chrono::duration_cast<std::chrono::microseconds>(now).count()));
}

bool LiveFrames::due() const
{
    return request_ && (request_->whole || state_ > request_->after);
}

std::string LiveFrames::take(ViewFrame frame, bool whole, std::int64_t step, double time, bool done)
{
    request_.reset();
    if (whole) shown_.clear();
    std::erase_if(frame.shapes, [&](const ViewShape& s) {
        auto [at, is_new] = shown_.try_emplace(s.name, s.points, s.values);
        if (is_new) return false;
        if (at->second == std::pair(s.points, s.values)) return true;
        at->second = {s.points, s.values};
        return false;
    });
    const std::string bytes =
        live_frame_bytes(frame, {state_, whole ? 0 : sent_, step, time, done});
    sent_ = state_;
    return bytes;
}

bool send_frame(int stream, const std::string& frame)
{
    const std::uint64_t length = frame.size();
    std::string bytes(reinterpret_cast<const char*>(&length), sizeof length);
    bytes += frame;
    for (std::size_t sent = 0; sent < bytes.size();) {
        const ssize_t n = ::write(stream, bytes.data() + sent, bytes.size() - sent);
        if (n < 0 && errno != EINTR) return false;
        if (n > 0) sent += static_cast<std::size_t>(n);
    }
    return true;
}

} // namespace amontons
