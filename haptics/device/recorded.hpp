#pragma once

#include "haptics/device/device.hpp"

#include <string>
#include <vector>

namespace amontons {

/// A trajectory: pose of a device over time.
struct Trajectory {
    std::vector<double> time;   ///< strictly increasing [s]
    std::vector<HandPose> pose; ///< as many
    /// Time of the last pose [s].
    double end() const { return time.empty() ? 0 : time.back() - time.front(); }
};

/// Reads a trajectory from CSV. The first line names the columns, in any order, others are left
/// out: time, x, y, z and, if the device turned, turn_x, turn_y, turn_z (a rotation vector); a unit
/// in brackets may follow a name. So the trace of `amontons haptic` can be read, except that of a
/// wire pushed along another axis than x: the trace is in world axes, whereas a device pushes along
/// x.
/// @param file  stands in the messages
/// @throws InputError  with every line that is wrong: not numbers, time that does not increase or
///                     lasts for more than an hour
Trajectory parse_trajectory(std::string_view text, const std::string& file);

/// Plays a trajectory, resampled: linear between its points, turns along the shortest way. When it
/// has ended, there is no sample any more. The force is discarded.
class RecordedDevice : public Device {
public:
    /// @throws InputError  as parse_trajectory
    explicit RecordedDevice(Trajectory trajectory) : trajectory_(std::move(trajectory)) {}
    DeviceSpec spec() const override;
    DeviceSample read(double time) noexcept override;
    void write(const Wrench&, double) noexcept override {}

private:
    Trajectory trajectory_;
    std::size_t at_ = 0; // of the last read
};

} // namespace amontons
