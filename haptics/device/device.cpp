#include "haptics/device/device.hpp"

#include "mesh/base/error.hpp"

#include <string>
#include <vector>

namespace amontons {
namespace {

constexpr std::array<bool, 6> kPoint{true, true, true, false, false, false};
constexpr std::array<bool, 6> kPushTwist{true, false, false, true, false, false};

// Force and stiffness as CHAI3D lists them, where not specified otherwise. Zero: not known.
constexpr DeviceSpec kProfiles[] = {
    {"touch", kPoint, 3.3, 0, 400, 5, 0.055e-3, 0.045, 0.26, 0.08,
     "CHAI3D; resolution, mass and friction: the maker's data sheet"},
    {"phantom-desktop", kPoint, 7.9, 0, 1000, 5, 0, 0, 0, 0,
     "CHAI3D; 6.4 N in the literature of 2003"},
    {"falcon", kPoint, 8, 0, 3000, 20, 0, 0, 0, 0, "CHAI3D"},
    {"omega.3", kPoint, 12, 0, 5000, 30, 0.01e-3, 0.2, 0.02, 0.075,
     "CHAI3D; mass and friction are assumed"},
    {"catheter-2dof", kPushTwist, 5, 0.02, 0, 0, 0, 0, 0, 0.1,
     "push and twist between rollers, endless; typical, no single maker"},
};

} // namespace

std::span<const DeviceSpec> device_profiles()
{
    return kProfiles;
}

const DeviceSpec& device_profile(std::string_view name)
{
    std::vector<std::string> names;
    std::string all;
    for (const DeviceSpec& spec : kProfiles) {
        if (spec.name == name) return spec;
        names.emplace_back(spec.name);
        all += (all.empty() ? "" : ", ") + names.back();
    }
    const std::string near = nearest_name(name, names);
    throw InputError({{"", "device", quoted_text(name),
                       near.empty() ? "one of " + all : "\"" + near + "\" (nearest name)"}});
}

} // namespace amontons
