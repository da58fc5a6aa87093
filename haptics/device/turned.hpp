#pragma once

#include "haptics/device/device.hpp"

#include <memory>

namespace amontons {

/// A device whose own axes are turned in the world: one that pushes along its x and twists about
/// it, held to an instrument that points elsewhere.
class TurnedDevice final : public Device {
public:
    /// @param to_world  the device's axes
    TurnedDevice(std::unique_ptr<Device> device, const Eigen::Quaterniond& to_world)
        : device_(std::move(device))
        , to_world_(to_world)
    {
    }
    DeviceSpec spec() const override { return device_->spec(); }
    bool open() override { return device_->open(); }
    DeviceSample read(double time) noexcept override
    {
        DeviceSample s = device_->read(time);
        s.pose.position = to_world_ * s.pose.position;
        s.pose.rotation = to_world_ * s.pose.rotation * to_world_.conjugate();
        return s;
    }
    void write(const Wrench& w, double time) noexcept override
    {
        const Eigen::Quaterniond back = to_world_.conjugate();
        device_->write({back * w.force, back * w.torque}, time);
    }
    void close() noexcept override { device_->close(); }

private:
    std::unique_ptr<Device> device_;
    Eigen::Quaterniond to_world_;
};

} // namespace amontons
