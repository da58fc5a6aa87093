#include "haptics/device/recorded.hpp"

#include "mesh/base/error.hpp"

#include <doctest/doctest.h>

using namespace amontons;

namespace {

std::string refusal(std::string_view text)
{
    try {
        parse_trajectory(text, "path.csv");
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

} // namespace

TEST_CASE("a recorded trajectory is resampled on straight lines and ends")
{
    RecordedDevice device(parse_trajectory("time [s],x [m],y,z,other,turn_x,turn_y,turn_z\n"
                                           "2,0,0,0,7,0,0,0\n"
                                           "2.5,1,2,3,7,0,0,1\n"
                                           "3,1,2,3,7,0,0,2\n",
                                           "path.csv"));
    CHECK(device.read(0).valid);
    CHECK(device.read(0).pose.position.norm() == 0);
    const DeviceSample half = device.read(0.25);
    CHECK((half.pose.position - Vec3(0.5, 1, 1.5)).norm() < 1e-14);
    CHECK(turn_vector(half.pose.rotation).z() == doctest::Approx(0.5));
    CHECK(turn_vector(device.read(0.75).pose.rotation).z() == doctest::Approx(1.5));
    CHECK(device.read(1).valid);
    CHECK_FALSE(device.read(1.001).valid); // it has ended
    CHECK(device.read(0.25).pose.position == half.pose.position);
}

TEST_CASE("a trajectory that is none is refused line by line")
{
    CHECK(refusal("").find("an empty file") != std::string::npos);
    CHECK(refusal("\n").find("no column time") != std::string::npos);
    CHECK(refusal("0,0,0,0\n").find("no column time") != std::string::npos);
    CHECK(refusal("time,x,y\n1,2,3\n").find("no column z") != std::string::npos);
    CHECK(refusal("time,x,y,z\n").find("no points") != std::string::npos);
    const std::string two = refusal("time,x,y,z\n0,0,0,0\n0.1,nan,0,0\n0.2,0,0\n");
    CHECK(two.find("line 3") != std::string::npos);
    CHECK(two.find("nan") != std::string::npos);
    CHECK(two.find("line 4") != std::string::npos);
    const std::string back = refusal("time,x,y,z\n0,0,0,0\n0.1,0,0,0\n0.05,0,0,0\n");
    CHECK(back.find("line 4") != std::string::npos);
    CHECK(back.find("increases") != std::string::npos);
    CHECK(refusal("time,x,y,z\n0,0,0,0\n0,0,0,0\n") != "");
    CHECK(refusal("time,x,y,z\n0,1e999,0,0\n") != "");
    const std::string two_turns = refusal("time,x,y,z,turn_x,turn_y\n0,0,0,0,0,0\n");
    CHECK(two_turns.find("turn_y without the others") != std::string::npos);
    const std::string far = refusal("time,x,y,z\n-1.7e308,0,0,0\n1.7e308,0,0,0\n");
    CHECK(far.find("line 3") != std::string::npos);
    CHECK(far.find("3600 s") != std::string::npos);
    CHECK(refusal("time,x,y,z\n0,0,0,0\n1e9,0,0,0\n").find("1e+09") != std::string::npos);
    // Millimetres taken for metres would throw the handle through the room.
    const std::string millimetres = refusal("time [ms],x [mm],y [m],z\n0,0,0,0\n");
    CHECK(millimetres.find("time [ms]") != std::string::npos);
    CHECK(millimetres.find("x [m]") != std::string::npos);
    CHECK(millimetres.find("y [m]") == std::string::npos);
    CHECK(refusal("time,x,x,y,z\n0,0,0,0,0\n").find("x twice") != std::string::npos);
    const std::string commas = refusal("time,x,y,z\n0,0,0,0\n0,01,0,0,0\n");
    CHECK(commas.find("line 3: found 5 values") != std::string::npos);
    CHECK(refusal("time [s],x [m], y [m] ,z[m],other [mm]\n0,0,0,0,7\n") == "");
    CHECK(refusal("time,x,y,z,\r\n0,0,0,0,\r\n") == "");
    CHECK(refusal("\xef\xbb\xbftime,x,y,z\n0,0,0,0\n") == ""); // a mark of UTF-8
    CHECK(refusal("time,x,y,z\n0,0,0,0\n") == "");             // one point is a handle at rest
}
