#include "haptics/device/udp.hpp"

#include "mesh/base/error.hpp"

#include <arpa/inet.h>
#include <cmath>
#include <doctest/doctest.h>
#include <limits>
#include <sys/socket.h>
#include <unistd.h>

using namespace amontons;

namespace {

/// The other end.
struct Client {
    int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
    sockaddr_in to{};

    explicit Client(int port)
    {
        to.sin_family = AF_INET;
        to.sin_port = htons(static_cast<std::uint16_t>(port));
        inet_pton(AF_INET, "127.0.0.1", &to.sin_addr);
        const timeval second{1, 0};
        ::setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &second, sizeof second);
    }
    ~Client() { ::close(socket); }
    void send(const void* bytes, std::size_t size) const
    {
        REQUIRE(::sendto(socket, bytes, size, 0, reinterpret_cast<const sockaddr*>(&to),
                         sizeof to) == static_cast<ssize_t>(size));
    }
    void send(std::uint32_t sequence, const Vec3& x, double time = 0) const
    {
        const UdpPacket p =
            pose_packet({sequence, static_cast<std::int64_t>(1e9 * time), x, {0, 0, 0}});
        send(p.data(), p.size());
    }
};

} // namespace

TEST_CASE("a packet means what it specifies byte by byte")
{
    const UdpPacket p = pose_packet({0x01020304, -2, {1, 0, -0.5}, {0, 0, 2}});
    CHECK(std::string(p.begin(), p.begin() + 4) == "AMHP");
    CHECK(p[4] == 4); // little-endian
    CHECK(p[7] == 1);
    CHECK(p[8] == 0xfe);
    CHECK(p[16 + 7] == 0x3f); // of 1.0
    CHECK(p[16 + 6] == 0xf0);
    UdpPose pose;
    REQUIRE(parse_pose(p.data(), p.size(), pose));
    CHECK(pose.sequence == 0x01020304);
    CHECK(pose.time == -2);
    CHECK(pose.position == Vec3(1, 0, -0.5));
    CHECK(pose.turn == Vec3(0, 0, 2));
    CHECK_FALSE(parse_pose(p.data(), 63, pose));
    const UdpPacket f = force_packet(7, 5, {{1, 2, 3}, {4, 5, 6}});
    CHECK_FALSE(parse_pose(f.data(), f.size(), pose));
    std::uint32_t sequence = 0;
    Wrench w;
    REQUIRE(parse_force(f.data(), f.size(), sequence, w));
    CHECK(sequence == 7);
    CHECK(w.torque == Vec3(4, 5, 6));
}

TEST_CASE("poses are received and forces sent, old or foreign packets are ignored and silence is "
          "reported")
{
    UdpDevice device("0");
    REQUIRE(device.port() > 0);
    Client client(device.port());
    CHECK_FALSE(device.read(0).valid); // no sender
    device.write({}, 0);               // to no receiver

    client.send(1, {1, 2, 3});
    DeviceSample s = device.read(0.001);
    CHECK(s.valid);
    CHECK(s.pose.position == Vec3(1, 2, 3));
    device.write({{0, 0, 5}, {0, 0, 0}}, 0.001);
    unsigned char bytes[128];
    const ssize_t n = ::recv(client.socket, bytes, sizeof bytes, 0);
    std::uint32_t sequence = 0;
    Wrench w;
    REQUIRE(n > 0);
    REQUIRE(parse_force(bytes, static_cast<std::size_t>(n), sequence, w));
    CHECK(sequence == 1);
    CHECK(w.force == Vec3(0, 0, 5));

    client.send(3, {3, 0, 0});
    client.send(2, {2, 0, 0}); // late
    client.send("hello", 5);
    s = device.read(0.002);
    CHECK(s.pose.position == Vec3(3, 0, 0));
    CHECK(device.refused() == 2);
    CHECK(device.read(0.011).valid);      // repeated for a while
    CHECK_FALSE(device.read(0.02).valid); // silence
    client.send(0xffffffff, {9, 0, 0});   // an older number, soon after
    CHECK_FALSE(device.read(0.03).valid);
    client.send(1, {4, 0, 0}); // much later: begun anew
    CHECK(device.read(2).pose.position == Vec3(4, 0, 0));
}

TEST_CASE("a pose was measured when the sender's clock states and where that is none when it came")
{
    // Every 4 ms, held up by 0 to 3 ms.
    const double held_up[] = {0, 3, 1, 0, 2, 0, 3, 0, 0, 1, 0, 0};
    struct Clock {
        double begin, speed;
    };
    for (const Clock clock : {Clock{700, 1}, Clock{0, 0}, Clock{5, 1e-3}, Clock{5, 1e3}}) {
        CAPTURE(clock.speed);
        UdpDevice device("0");
        Client client(device.port());
        double last = 0, arrived = 0;
        bool settled = false; // the longest delay was seen
        for (int n = 0; n < 12; ++n) {
            const double sent = 4e-3 * n, now = 0.1 + sent + 1e-3 * held_up[n];
            client.send(std::uint32_t(n + 1), {0, 0, 0}, clock.begin + clock.speed * sent);
            const DeviceSample s = device.read(now);
            CHECK(s.time <= now + 1e-12);
            CHECK(s.time >= now - 0.0101);
            CHECK(device.read(now + 1e-3).time == s.time); // the same pose again
            if (clock.speed == 1 && settled)
                CHECK(s.time - last == doctest::Approx(4e-3));
            else if (n > 1 && clock.speed != 1)
                CHECK(s.time - last == doctest::Approx(now - arrived).epsilon(0.01));
            settled = settled || held_up[n] == 3;
            last = s.time;
            arrived = now;
        }
    }
}

TEST_CASE("what is no number is passed on to the loop, which must check it")
{
    UdpDevice device("0");
    Client client(device.port());
    client.send(1, {std::numeric_limits<double>::quiet_NaN(), 0, 0});
    const DeviceSample s = device.read(0);
    CHECK(s.valid);
    CHECK(is_broken(s.pose));
}

TEST_CASE("an address that is none and a port that is taken are bad input")
{
    CHECK_THROWS_AS(UdpDevice("port"), InputError);
    CHECK_THROWS_AS(UdpDevice("70000"), InputError);
    CHECK_THROWS_AS(UdpDevice("nowhere:5000"), InputError);
    UdpDevice first("0");
    CHECK_THROWS_AS(UdpDevice(std::to_string(first.port())), InputError);
}
