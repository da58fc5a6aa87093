// The bird's nest of examples/nest in full: one wire fed into a ball. A line for every 20th step.
//
//     rod_nest_bench [PATH=VALUE ...]   (as --set of `amontons run`)
//
// Every step is examined from the nodes' places alone: least distance of the middle line from
// itself, also on the way from step to step, and how far the wire is out of the ball.

#include "validation/families/rods/nest.hpp"
#include "validation/scene_run.hpp"

#include <exception>
#include <fmt/format.h>

int main(int count, char** arguments)
{
    using namespace amontons::validation;
    try {
        const Nest n = fill_nest(scene("nest", {arguments + 1, arguments + count}), stdout);
        fmt::print("{} contacts at most, {} of the wire with itself; {} steps, {} of them without "
                   "certificate, worst {:.1e}\nleast distance {:.4f} diameters, between steps "
                   "{:.4f}; out of the ball by {:.4f} diameters; energy to {:.1e} of the work; "
                   "{:.0f} s\n",
                   n.contacts, n.own, n.steps, n.uncertified, n.error, n.least, n.least_between,
                   n.beyond, n.energy_error, n.seconds);
        return n.uncertified == 0 ? 0 : 1;
    } catch (const std::exception& e) {
        fmt::print(stderr, "error: {}\n", e.what());
        return 2;
    }
}
