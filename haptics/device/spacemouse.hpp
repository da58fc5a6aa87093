#pragma once

#include "haptics/device/device.hpp"

#include <memory>

namespace amontons {

/// A 3D mouse by libspnav and its daemon spacenavd: its deflection is a velocity, which moves and
/// turns the handle. It gives no force. It is read in a thread of its own.
class SpaceMouse : public Device {
public:
    SpaceMouse();
    ~SpaceMouse() override;
    DeviceSpec spec() const override;
    /// @throws InputError  if amontons was built without libspnav or does not find it, or the
    ///                     daemon does not answer
    bool open() override;
    DeviceSample read(double time) noexcept override;
    void write(const Wrench&, double) noexcept override {}
    void close() noexcept override;

private:
    struct Reader;
    std::unique_ptr<Reader> reader_;
};

} // namespace amontons
