#include "haptics/device/spacemouse.hpp"

#include "mesh/base/error.hpp"
#include "mesh/tests/test_program.hpp"

#include <array>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <doctest/doctest.h>
#include <string>
#include <sys/socket.h>
#include <sys/un.h>
#include <thread>
#include <unistd.h>

using namespace amontons;

namespace {

/// What spacenavd sends on its socket (protocol 1): packets of eight numbers, the first one the
/// kind.
class Daemon {
public:
    Daemon()
    {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
        REQUIRE(::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) ==
                0);
        REQUIRE(::listen(listener_, 1) == 0);
        ::setenv("SPNAV_SOCKET", path.c_str(), 1);
        greeter_ = std::thread([this] {
            client_ = ::accept(listener_, nullptr, nullptr);
            std::int32_t request = 0; // which protocol? its answer is the same number
            if (::read(client_, &request, sizeof request) == sizeof request)
                (void)!::write(client_, &request, sizeof request);
        });
    }
    ~Daemon()
    {
        ::shutdown(listener_, SHUT_RDWR);
        greeter_.join();
        end();
        ::close(listener_);
        ::unlink(path.c_str());
        ::unsetenv("SPNAV_SOCKET");
    }
    void send(const std::array<std::int32_t, 8>& packet) const
    {
        REQUIRE(::write(client_, packet.data(), sizeof packet) == sizeof packet);
    }
    void end()
    {
        if (client_ >= 0) ::close(client_);
        client_ = -1;
    }

    std::string path = "/tmp/amontons_spnav_" + std::to_string(::getpid());

private:
    int listener_ = ::socket(AF_UNIX, SOCK_STREAM, 0), client_ = -1;
    std::thread greeter_;
};

/// Reads once a millisecond, a second at most, until the samples are `there`.
bool becomes(SpaceMouse& mouse, double& time, bool there)
{
    for (int k = 0; k < 1000; ++k) {
        time += 1e-3;
        if (mouse.read(time).valid == there) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

/// The test is skipped where there is no library for it.
bool open_or_skip(SpaceMouse& mouse)
{
    try {
        REQUIRE(mouse.open());
        return true;
    } catch (const InputError& e) {
        REQUIRE(std::string(e.what()).find("built without libspnav") != std::string::npos);
        skip_test(e.what());
        return false;
    }
}

} // namespace

TEST_CASE("3D mouse: a deflection moves the handle and one that is unplugged is lost")
{
    Daemon daemon;
    SpaceMouse mouse;
    if (!open_or_skip(mouse)) return;
    double time = 0;
    REQUIRE(becomes(mouse, time, true));

    daemon.send({0, 350, 0, 0, 0, 0, 0, 8}); // full deflection along x
    HandPose pose;
    for (int k = 0; k < 1000 && !(pose.position[0] > 0); ++k) {
        pose = mouse.read(time += 1e-3).pose;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    CHECK(pose.position[0] > 0);
    CHECK(pose.position.tail<2>().isZero(0));

    daemon.send({3, 1, 0, 0, 0, 0, 0, 0}); // device removed
    CHECK(becomes(mouse, time, false));
    daemon.send({3, 0, 0, 0, 0, 0, 0, 0}); // and plugged in again
    CHECK(becomes(mouse, time, true));
}

TEST_CASE("3D mouse: a daemon that has ended is a device lost")
{
    Daemon daemon;
    SpaceMouse mouse;
    if (!open_or_skip(mouse)) return;
    double time = 0;
    REQUIRE(becomes(mouse, time, true));
    daemon.end();
    CHECK(becomes(mouse, time, false));
}
