#include "haptics/device/udp.hpp"

#include "mesh/base/error.hpp"

#include <algorithm>
#include <arpa/inet.h>
#include <bit>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace amontons {
namespace {

constexpr double kRepeated = 0.01; // how long a pose is repeated [s]
constexpr double kNewSender = 1;   // after this silence numbers may begin anew [s]
constexpr int kMostAtOnce = 64;    // packets in one read
static_assert(sizeof(sockaddr_in) == 16);

template <class T> void put(unsigned char* at, T value)
{
    std::uint64_t bits = 0;
    if constexpr (sizeof(T) == 8)
        bits = std::bit_cast<std::uint64_t>(value);
    else
        bits = value;
    for (std::size_t i = 0; i < sizeof(T); ++i)
        at[i] = static_cast<unsigned char>(bits >> (8 * i));
}

template <class T> T get(const unsigned char* at)
{
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i)
        bits |= static_cast<std::uint64_t>(at[i]) << (8 * i);
    if constexpr (sizeof(T) == 8)
        return std::bit_cast<T>(bits);
    else
        return static_cast<T>(bits);
}

UdpPacket packet(char kind, std::uint32_t sequence, std::int64_t time, const Vec3& a, const Vec3& b)
{
    UdpPacket p{};
    const char name[] = {'A', 'M', 'H', kind};
    std::memcpy(p.data(), name, 4);
    put(p.data() + 4, sequence);
    put(p.data() + 8, time);
    for (int i = 0; i < 3; ++i) {
        put(p.data() + 16 + 8 * i, a[i]);
        put(p.data() + 40 + 8 * i, b[i]);
    }
    return p;
}

bool is_packet(const unsigned char* bytes, std::size_t size, char kind)
{
    const char name[] = {'A', 'M', 'H', kind};
    return size == std::tuple_size_v<UdpPacket> && std::memcmp(bytes, name, 4) == 0;
}

bool read_port(std::string_view text, int& port)
{
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
    return error == std::errc() && end == text.data() + text.size() && port >= 0 && port <= 65535;
}

} // namespace

UdpPacket pose_packet(const UdpPose& pose)
{
    return packet('P', pose.sequence, pose.time, pose.position, pose.turn);
}

UdpPacket force_packet(std::uint32_t sequence, std::int64_t time, const Wrench& wrench)
{
    return packet('F', sequence, time, wrench.force, wrench.torque);
}

bool parse_pose(const unsigned char* bytes, std::size_t size, UdpPose& pose)
{
    if (!is_packet(bytes, size, 'P')) return false;
    pose.sequence = get<std::uint32_t>(bytes + 4);
    pose.time = get<std::int64_t>(bytes + 8);
    for (int i = 0; i < 3; ++i) {
        pose.position[i] = get<double>(bytes + 16 + 8 * i);
        pose.turn[i] = get<double>(bytes + 40 + 8 * i);
    }
    return true;
}

bool parse_force(const unsigned char* bytes, std::size_t size, std::uint32_t& sequence,
                 Wrench& wrench)
{
    if (!is_packet(bytes, size, 'F')) return false;
    sequence = get<std::uint32_t>(bytes + 4);
    for (int i = 0; i < 3; ++i) {
        wrench.force[i] = get<double>(bytes + 16 + 8 * i);
        wrench.torque[i] = get<double>(bytes + 40 + 8 * i);
    }
    return true;
}

UdpDevice::UdpDevice(const std::string& address)
{
    const std::size_t colon = address.rfind(':');
    const std::string host = colon == std::string::npos ? "127.0.0.1" : address.substr(0, colon);
    const std::string port = colon == std::string::npos ? address : address.substr(colon + 1);
    sockaddr_in at{};
    at.sin_family = AF_INET;
    if (!read_port(port, port_) || inet_pton(AF_INET, host.c_str(), &at.sin_addr) != 1)
        throw InputError({{"(--device)", "udp", quoted_text(address),
                           "PORT or ADDRESS:PORT, 0 to 65535, e.g. udp:5005"}});
    at.sin_port = htons(static_cast<std::uint16_t>(port_));
    socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    socklen_t size = sizeof at;
    if (socket_ < 0 || ::bind(socket_, reinterpret_cast<const sockaddr*>(&at), size) != 0) {
        const std::string why = std::strerror(errno);
        close();
        throw InputError({{"(--device)", "udp", quoted_text(address) + ": " + why,
                           "a port that is free and allowed"}});
    }
    ::getsockname(socket_, reinterpret_cast<sockaddr*>(&at), &size);
    port_ = ntohs(at.sin_port);
}

UdpDevice::~UdpDevice()
{
    close();
}

void UdpDevice::close() noexcept
{
    if (socket_ >= 0) ::close(socket_);
    socket_ = -1;
}

DeviceSpec UdpDevice::spec() const
{
    DeviceSpec spec;
    spec.name = "udp";
    spec.free.fill(true);
    return spec;
}

DeviceSample UdpDevice::read(double time) noexcept
{
    std::array<unsigned char, 128> bytes; // longer than a packet: what is longer is none
    for (int i = 0; i < kMostAtOnce && socket_ >= 0; ++i) {
        sockaddr_in from{};
        socklen_t size = sizeof from;
        const ssize_t n = ::recvfrom(socket_, bytes.data(), bytes.size(), MSG_DONTWAIT,
                                     reinterpret_cast<sockaddr*>(&from), &size);
        if (n < 0) break;
        UdpPose pose;
        if (!parse_pose(bytes.data(), static_cast<std::size_t>(n), pose)) {
            ++refused_;
            continue;
        }
        const auto ahead = static_cast<std::int32_t>(pose.sequence - pose_.sequence);
        if (has_pose_ && ahead <= 0 && time - arrived_ < kNewSender) {
            ++refused_;
            continue;
        }
        // As far after the last as by the sender's clock, and within 10 ms before its arrival:
        // a clock that stands still or runs away leaves the times of arrival.
        const double after =
            1e-9 * (static_cast<double>(pose.time) - static_cast<double>(pose_.time));
        measured_ = std::clamp(measured_ + std::max(after, 0.0), time - kRepeated, time);
        pose_ = pose;
        arrived_ = time;
        has_pose_ = has_peer_ = true;
        ++received_;
        std::memcpy(peer_.data(), &from, sizeof from);
    }
    DeviceSample sample;
    sample.time = has_pose_ ? measured_ : time;
    sample.valid = has_pose_ && time - arrived_ < kRepeated;
    sample.pose = {pose_.position, turn(pose_.turn)};
    return sample;
}

void UdpDevice::write(const Wrench& wrench, double time) noexcept
{
    if (socket_ < 0 || !has_peer_) return;
    const UdpPacket p = force_packet(pose_.sequence, static_cast<std::int64_t>(1e9 * time), wrench);
    sockaddr_in to;
    std::memcpy(&to, peer_.data(), sizeof to);
    ::sendto(socket_, p.data(), p.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
             reinterpret_cast<const sockaddr*>(&to), sizeof to);
}

} // namespace amontons
