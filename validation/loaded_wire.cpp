#include "validation/loaded_wire.hpp"

#include "solver/beam/clamp.hpp"

#include <stdexcept>

namespace amontons::validation {

Wire solve(const LoadedWire& w, Vec3* start)
{
    BeamSegment g;
    g.length = w.length;
    g.radius = 0.01 * w.length;
    g.EI = {w.EI, w.EI};
    g.GJ = {w.GJ, w.GJ};
    g.EA = {w.EA, w.EA};
    g.GA = {w.GA, w.GA};
    g.curvature = w.curvature;
    g.element = w.length / w.elements;
    Wire wire;
    wire.material = make_material({g}, 0);
    start_clamped(wire, Vec3::Zero(), w.frame);
    if (w.planar) wire.plane = w.frame.col(2);
    if (start) *start = wire.state.nodes.back().position();
    const std::size_t nodes = wire.material.node.size();
    wire.dead_force.assign(nodes, Vec3::Zero());
    wire.dead_moment.assign(nodes, Vec3::Zero());

    NewtonWorkspace work(wire, 0);
    NewtonOptions options;
    options.tolerance = 1e-9; // the round-off of EA, some 1e-11 here, decides below
    options.max_iterations = 40;
    options.longest_move = w.length;
    double done = 0, step = 0.1;
    while (done < 1) {
        step = std::min(step, 1 - done);
        const double load = 1 - done - step < 1e-12 ? 1 : done + step;
        const WireState keep = wire.state;
        wire.dead_force.back() = load * w.force;
        wire.dead_moment.back() = load * w.moment;
        const StepStart from = mark_step_start(wire);
        if (solve_equilibrium(wire, {}, from, {}, options, work).converged) {
            done = load;
            step *= 1.5;
        } else {
            wire.state = keep;
            step *= 0.5;
            if (step < 1e-6) throw std::runtime_error("the load was not reached");
        }
    }
    return wire;
}

} // namespace amontons::validation
