// Any bytes as a trajectory, and as a packet: refused or read, never worse.

#include "haptics/device/recorded.hpp"
#include "haptics/device/udp.hpp"
#include "mesh/base/error.hpp"

#include <cstdlib>

using namespace amontons;

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size)
{
    UdpPose pose;
    parse_pose(data, size, pose);
    try {
        Trajectory path = parse_trajectory({reinterpret_cast<const char*>(data), size}, "fuzz.csv");
        for (std::size_t i = 1; i < path.time.size(); ++i)
            if (!(path.time[i] > path.time[i - 1])) std::abort();
        const double end = path.end();
        RecordedDevice device(std::move(path));
        for (const double share : {0.0, 0.3, 1.0, 0.5, 2.0})
            device.read(share * end);
    } catch (const InputError&) {
    }
    return 0;
}
