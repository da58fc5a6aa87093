// What a checkpoint keeps of a run of instruments.

#include "solver/step/byte_stream.hpp"
#include "solver/step/run_summary.hpp"
#include "solver/step/wire_build.hpp"
#include "solver/step/wire_simulation_state.hpp"

namespace amontons {

std::vector<std::byte> WireSimulation::save() const
{
    const State& s = *state_;
    ByteWriter out;
    out.value(s.started);
    out.value(s.time);
    out.value(s.step_length);
    out.value(s.step);
    out.value(s.contact_steps);
    out.value(s.contacts_sum);
    out.value(s.energy);
    for (const SoftVessel& v : s.vessels)
        save_tangent(*v.tube, out);
    for (std::size_t w = 0; w < s.wires.size(); ++w) {
        save_wire(s.wires[w], out);
        out.value(s.history[w]);
    }
    for (const auto& c : s.coaxial)
        for (const Nesting& n : c->nestings)
            save_reactions(n.reaction, out);
    for (const WallForce& f : s.force) {
        out.vector(f.pending);
        out.value(!f.largest.empty());
        if (!f.largest.empty()) out.vector(f.largest);
    }
    out.vector(s.wall_moved);
    s.inputs.save(out, s.inputs);
    save_summary(s.summary, out);
    return out.take();
}

void WireSimulation::restore(const std::vector<std::byte>& state)
{
    // Read into copies first: a damaged state changes nothing.
    State& s = *state_;
    ByteReader in(state);
    const auto started = in.value<bool>();
    const auto time = in.value<double>();
    const auto step_length = in.value<double>();
    const auto step = in.value<int>();
    const auto contact_steps = in.value<int>();
    const auto contacts_sum = in.value<double>();
    const auto energy = in.value<EnergyRecord>();
    std::vector<Eigen::VectorXd> tangents;
    for (const SoftVessel& v : s.vessels)
        tangents.push_back(read_tangent(*v.tube, in));
    std::vector<SavedWire> wires;
    std::vector<WireHistory> history;
    for (const WireBody& b : s.wires) {
        wires.push_back(read_wire(b, in));
        history.push_back(in.value<WireHistory>());
    }
    std::vector<std::vector<Reaction>> nested;
    for (const auto& c : s.coaxial)
        for (const Nesting& n : c->nestings)
            nested.push_back(read_reactions(n.reaction.size(), in));
    std::vector<WallForce> force;
    for (const Obstacle& o : s.obstacles) {
        WallForce& f = force.emplace_back();
        f.pending = in.vector<WallForce::Touch>(std::size_t(-1));
        if (in.value<bool>()) f.largest = in.exactly<double>(o.model.surface->points.size());
    }
    auto wall_moved = in.vector<double>(s.vessels.size());
    const std::vector<LiveInputs::Saved> inputs = s.inputs.read(in);
    RunSummary sum = read_summary(in);
    in.end();

    s.wall_moved = std::move(wall_moved);
    for (std::size_t v = 0; v < s.vessels.size(); ++v)
        restore_tangent(*s.vessels[v].tube, tangents[v]);
    s.started = started;
    s.time = time;
    s.step_length = step_length;
    s.step = step;
    s.contact_steps = contact_steps;
    s.contacts_sum = contacts_sum;
    s.energy = energy;
    for (std::size_t w = 0; w < wires.size(); ++w)
        restore_wire(s.wires[w], wires[w]);
    auto next = nested.begin();
    for (const auto& c : s.coaxial)
        for (Nesting& n : c->nestings)
            n.reaction = std::move(*next++);
    s.inputs.restore(inputs);
    s.history = std::move(history);
    for (std::size_t o = 0; o < force.size(); ++o) {
        s.force[o].largest = std::move(force[o].largest);
        s.force[o].pending = std::move(force[o].pending);
    }
    s.summary = std::move(sum);
    s.summary.steps = s.step;
    s.summary.time = s.time;
    s.report_branches(s.summary);
}

} // namespace amontons
