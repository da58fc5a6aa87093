#include "haptics/device/spacemouse.hpp"

#include "haptics/triple_buffer.hpp"
#include "mesh/base/error.hpp"

#include <atomic>
#include <cmath>
#include <string>
#include <thread>
#include <type_traits>

#if AMONTONS_SPNAV
#include <dlfcn.h>
#include <poll.h>
#include <spnav.h>
#include <unistd.h>
#endif

namespace amontons {
namespace {

#if AMONTONS_SPNAV
constexpr double kFull = 350;     // counts of a full deflection
constexpr double kSpeed = 0.05;   // at full deflection [m/s]
constexpr double kTurnSpeed = 1;  // [rad/s]
constexpr unsigned kPause = 2000; // between two reads of the daemon [us]
constexpr double kCentred = 0.2;  // without an event the cap has sprung back [s]

/// libspnav, opened with the first mouse: linked, it and X11 behind it would cost every start of
/// the program 1 ms.
struct Spnav {
    decltype(&::spnav_open) open;
    decltype(&::spnav_close) close;
    decltype(&::spnav_fd) fd;
    decltype(&::spnav_poll_event) poll_event;
};

Spnav opened_spnav()
{
    const auto refuse = [](const std::string& found) {
        const char* reason = ::dlerror();
        throw InputError(
            {{"(--device)", "spacemouse", reason ? reason : found, AMONTONS_SPNAV_FILE}});
    };
    void* const library = ::dlopen(AMONTONS_SPNAV_FILE, RTLD_LAZY | RTLD_LOCAL);
    if (!library) refuse("a library that cannot be loaded");
    Spnav l{};
    const auto find = [&](const char* name, auto& function) {
        function = reinterpret_cast<std::decay_t<decltype(function)>>(::dlsym(library, name));
        if (!function) refuse(std::string("a library without ") + name);
    };
    find("spnav_open", l.open);
    find("spnav_close", l.close);
    find("spnav_fd", l.fd);
    find("spnav_poll_event", l.poll_event);
    return l;
}

/// @throws InputError  if it is not there
const Spnav& spnav()
{
    static const Spnav library = opened_spnav();
    return library;
}

/// A mouse at rest is silent, and so is a daemon that has ended: the socket distinguishes them.
bool daemon_has_ended()
{
    pollfd connection{spnav().fd(), POLLIN, 0};
    return connection.fd < 0 ||
           (::poll(&connection, 1, 0) > 0 && (connection.revents & (POLLHUP | POLLERR)) != 0);
}
#endif

} // namespace

/// Deflection in full parts, and when it was seen; the loop makes a pose of it.
struct SpaceMouse::Reader {
    struct Deflection {
        Vec3 shift{0, 0, 0}, turned{0, 0, 0};
        unsigned buttons = 0;
        long events = 0;
        bool lost = false; // unplugged, or the daemon has ended
    };
    TripleBuffer<Deflection> newest;
    std::atomic<bool> stop{false};
    std::thread thread;
    // Of the loop:
    HandPose pose;
    unsigned buttons = 0;
    double last = -1, last_event = -1;
};

SpaceMouse::SpaceMouse() = default;

SpaceMouse::~SpaceMouse()
{
    close();
}

DeviceSpec SpaceMouse::spec() const
{
    DeviceSpec spec;
    spec.name = "3D mouse";
    spec.free.fill(true);
    return spec;
}

#if AMONTONS_SPNAV

bool SpaceMouse::open()
{
    if (spnav().open() != 0)
        throw InputError({{"(--device)", "spacemouse", "no answer from spacenavd",
                           "the daemon running, with a 3D mouse plugged in"}});
    reader_ = std::make_unique<Reader>();
    Reader& r = *reader_;
    r.thread = std::thread([&r] {
        Reader::Deflection now;
        while (!r.stop) {
            spnav_event event;
            while (spnav().poll_event(&event) != 0) {
                if (event.type == SPNAV_EVENT_MOTION) {
                    // The daemon's y is up and its z towards the user; those of the scene are z and
                    // -y.
                    const auto& m = event.motion;
                    now.shift = Vec3(m.x, -m.z, m.y) / kFull;
                    now.turned = Vec3(m.rx, -m.rz, m.ry) / kFull;
                } else if (event.type == SPNAV_EVENT_BUTTON && event.button.bnum < 32) {
                    const unsigned bit = 1u << static_cast<unsigned>(event.button.bnum);
                    now.buttons = event.button.press ? now.buttons | bit : now.buttons & ~bit;
                } else if (event.type == SPNAV_EVENT_DEV) {
                    now.lost = event.dev.op == SPNAV_DEV_RM;
                }
                ++now.events;
            }
            now.lost = now.lost || daemon_has_ended();
            r.newest.back() = now;
            r.newest.publish();
            ::usleep(kPause);
        }
    });
    return true;
}

DeviceSample SpaceMouse::read(double time) noexcept
{
    DeviceSample sample;
    sample.time = time;
    if (!reader_) return sample;
    Reader& r = *reader_;
    const long before = r.newest.front().events;
    if (r.newest.fetch() && r.newest.front().events != before) r.last_event = time;
    const Reader::Deflection& d = r.newest.front();
    const double elapsed = r.last < 0 ? 0 : std::min(time - r.last, 0.01);
    r.last = time;
    if (r.last_event >= 0 && time - r.last_event < kCentred) {
        r.pose.position += elapsed * kSpeed * d.shift;
        r.pose.rotation = (turn(elapsed * kTurnSpeed * d.turned) * r.pose.rotation).normalized();
    }
    sample.valid = !d.lost;
    sample.pose = r.pose;
    sample.buttons = d.buttons;
    return sample;
}

void SpaceMouse::close() noexcept
{
    if (!reader_) return;
    reader_->stop = true;
    reader_->thread.join();
    spnav().close();
    reader_.reset();
}

#else

bool SpaceMouse::open()
{
    throw InputError({{"(--device)", "spacemouse", "amontons was built without libspnav",
                       "libspnav-dev (./setup.sh packages), then build again"}});
}

DeviceSample SpaceMouse::read(double) noexcept
{
    return {};
}

void SpaceMouse::close() noexcept {}

#endif

} // namespace amontons
