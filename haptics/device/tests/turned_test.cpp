#include "haptics/device/turned.hpp"

#include "haptics/pose.hpp"

#include <doctest/doctest.h>

using namespace amontons;

namespace {

struct Stub final : Device {
    DeviceSample sample;
    Wrench written;
    DeviceSpec spec() const override { return {}; }
    DeviceSample read(double) noexcept override { return sample; }
    void write(const Wrench& w, double) noexcept override { written = w; }
};

} // namespace

TEST_CASE("a device that pushes and twists along its x feels what happens along z of the world")
{
    auto owned = std::make_unique<Stub>();
    Stub& stub = *owned;
    stub.sample.valid = true;
    stub.sample.pose = {{0.02, 0, 0}, Eigen::Quaterniond(turn({0.3, 0, 0}))};
    TurnedDevice device(std::move(owned),
                        Eigen::Quaterniond::FromTwoVectors(Vec3::UnitX(), Vec3::UnitZ()));
    const DeviceSample s = device.read(0);
    CHECK(s.valid);
    CHECK((s.pose.position - Vec3(0, 0, 0.02)).norm() < 1e-15);
    CHECK(s.pose.rotation.angularDistance(Eigen::Quaterniond(turn({0, 0, 0.3}))) < 1e-12);

    device.write({{0, 0, -1}, {0, 0, 0.01}}, 0);
    CHECK((stub.written.force - Vec3(-1, 0, 0)).norm() < 1e-15);
    CHECK((stub.written.torque - Vec3(0.01, 0, 0)).norm() < 1e-15);
}
