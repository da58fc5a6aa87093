#pragma once

#include "haptics/device/device.hpp"

#include <array>
#include <cstdint>
#include <string>

namespace amontons {

// The packet, the same both ways: 64 bytes, little-endian.
//
//   offset  type     in, "AMHP": pose              out, "AMHF": force
//   0       4 bytes  'A' 'M' 'H' 'P'               'A' 'M' 'H' 'F'
//   4       uint32   sequence number, counts up    that of the newest pose received
//   8       int64    when it was measured, by      the loop's clock [ns]
//                    the sender's clock [ns]; 0:
//                    it has none
//   16      double   x, y, z [m]                   force on the hand, x, y, z [N]
//   40      double   rotation vector, 3 [rad]      torque on the hand, 3 [N m]
//
// At least 100 poses a second: the newest is repeated for 10 ms, and 20 ms without a new one is a
// device that is lost. Of speed only what lies between two packets is known: by the sender's clock
// if that runs and agrees with the packets' arrival within 10 ms, else by their arrival, which
// jitters. The force is better with faster senders: 1000 a second or more.
//
// World axes. Packets of another size or another beginning are ignored, and so is a pose with an
// older number than the last. Forces are sent to the address that the newest pose came from: a
// sender of a higher number takes the device over. A number that is not finite ends the force until
// the program is restarted.

using UdpPacket = std::array<unsigned char, 64>;

/// The pose of a UDP packet.
struct UdpPose {
    /// Number of the packet; an older one is ignored.
    std::uint32_t sequence = 0;
    std::int64_t time = 0; ///< [ns]
    Vec3 position{0, 0, 0}, turn{0, 0, 0};
};

/// Packs a pose: the layout is above.
UdpPacket pose_packet(const UdpPose& pose);
/// Packs the force of a tick: the layout is above.
UdpPacket force_packet(std::uint32_t sequence, std::int64_t time, const Wrench& wrench);
/// False if it is no pose packet.
bool parse_pose(const unsigned char* bytes, std::size_t size, UdpPose& pose);
/// False if it is no force packet.
bool parse_force(const unsigned char* bytes, std::size_t size, std::uint32_t& sequence,
                 Wrench& wrench);

/// A device at the other end of UDP: any maker's SDK can sit there. An example of a client:
/// examples/haptic_udp/client.py.
class UdpDevice : public Device {
public:
    /// @param address  "PORT" (of this machine only) or "ADDRESS:PORT" (IPv4, 0.0.0.0: from
    ///                 anywhere)
    /// @throws InputError  if it is neither, or the port cannot be had
    explicit UdpDevice(const std::string& address);
    ~UdpDevice() override;
    UdpDevice(const UdpDevice&) = delete;
    UdpDevice& operator=(const UdpDevice&) = delete;

    DeviceSpec spec() const override;
    /// The newest pose, repeated while it is younger than 10 ms.
    DeviceSample read(double time) noexcept override;
    void write(const Wrench& wrench, double time) noexcept override;
    void close() noexcept override;

    int port() const { return port_; } ///< also if 0 was requested
    long received() const { return received_; }
    long refused() const { return refused_; } ///< other packets, and late ones

private:
    int socket_ = -1, port_ = 0;
    std::array<unsigned char, 16> peer_{}; // sockaddr_in
    bool has_peer_ = false, has_pose_ = false;
    UdpPose pose_;
    double arrived_ = 0, measured_ = -1; // of pose_, by the loop's clock [s]
    long received_ = 0, refused_ = 0;
};

} // namespace amontons
