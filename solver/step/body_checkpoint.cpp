#include "solver/step/body_simulation_state.hpp"
#include "solver/step/byte_stream.hpp"
#include "solver/step/run_summary.hpp"

// States of a run: between its steps, to take one back, and in bytes, to continue from.

namespace amontons {

BeforeStep BodySimulation::State::before_step() const
{
    BeforeStep b;
    b.time = time;
    b.energy = energy;
    for (const auto& body : system->bodies)
        b.bodies.push_back(body->state());
    b.rows = system->finder.rows();
    b.couplings = system->coupling_memory;
    b.unstable_kept = unstable_kept;
    if (dynamic()) return b; // steps in motion are not taken back once they are accepted
    b.warm = system->warm;
    b.warm_friction = system->warm_friction;
    b.warm_sticks = system->warm_sticks;
    return b;
}

void BodySimulation::State::put_back(const BeforeStep& b)
{
    time = b.time;
    energy = b.energy;
    for (std::size_t i = 0; i < b.bodies.size(); ++i)
        system->bodies[i]->set_state(b.bodies[i]);
    system->finder.set_rows(b.rows);
    system->coupling_memory = b.couplings;
    unstable_kept = b.unstable_kept;
    if (dynamic()) return;
    system->warm = b.warm;
    system->warm_friction = b.warm_friction;
    system->warm_sticks = b.warm_sticks;
}

std::vector<std::byte> BodySimulation::save() const
{
    return state_->bytes_for(*state_);
}

void BodySimulation::take_over(const Simulation& before)
{
    const auto* bodies = dynamic_cast<const BodySimulation*>(&before);
    if (!bodies) ByteReader::refuse("bodies of another kind");
    state_->make_ready();
    restore(bodies->state_->bytes_for(*state_));
}

/// @param next  what they are for: itself, or the same bodies with other conditions
std::vector<std::byte> BodySimulation::State::bytes_for(const State& next) const
{
    const State& s = *this;
    ByteWriter out;
    out.value(s.started);
    out.value(s.time);
    out.value(s.step_length);
    out.value(s.path_length);
    out.value(s.step);
    out.value(s.contacts_sum);
    out.value(s.energy);
    out.value(s.refinement);
    out.value(s.lagging);
    out.value(s.jumps);
    out.value(s.unstable);
    out.value(s.unstable_kept);
    const auto& bodies = s.system->bodies;
    if (next.system->bodies.size() != bodies.size()) ByteReader::refuse("another number of bodies");
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (next.system->refs[b].name != s.system->refs[b].name)
            ByteReader::refuse("bodies of other names");
        out.vector(&next == this ? bodies[b]->state()
                                 : next.system->bodies[b]->state_from(*bodies[b]));
    }
    std::vector<double> couplings;
    for (const CouplingMemory& c : s.system->coupling_memory)
        couplings.insert(couplings.end(), {c.value, c.filtered});
    out.vector(couplings);
    for (const auto* of : {&s.system->warm, &s.system->warm_friction}) {
        std::vector<std::int64_t> keys;
        std::vector<double> forces;
        for (const auto& [key, f] : *of) {
            keys.insert(keys.end(), {key.pair, key.id});
            forces.insert(forces.end(), f.data(), f.data() + 3);
        }
        out.vector(keys);
        out.vector(forces);
    }
    std::vector<std::int64_t> sticks;
    for (const auto& [key, sticking] : s.system->warm_sticks)
        if (sticking) sticks.insert(sticks.end(), {key.pair, key.id});
    out.vector(sticks);
    out.vector(s.system->finder.known_pairs());
    s.system->finder.save_rows(out);
    s.overlaps.save(out);
    out.vector(s.limits);
    out.vector(s.instruments);
    s.inputs.save(out, next.inputs);
    save_summary(s.summary, out);
    return out.take();
}

void BodySimulation::restore(const std::vector<std::byte>& state)
{
    // Read into copies first: a damaged state changes nothing.
    State& s = *state_;
    s.make_ready(); // a solid's state is of what its offline stage finds
    ByteReader in(state);
    const auto started = in.value<bool>();
    const auto time = in.value<double>();
    const auto step_length = in.value<double>();
    const auto path_length = in.value<double>();
    const auto step = in.value<int>();
    const auto contacts_sum = in.value<double>();
    const auto energy = in.value<EnergyRecord>();
    const auto refinement = in.value<StepRefinement>();
    const auto lagging = in.value<int>();
    const auto jumps = in.value<int>();
    const auto unstable = in.value<int>();
    const auto unstable_kept = in.value<bool>();
    std::vector<std::vector<double>> bodies;
    for (const auto& b : s.system->bodies)
        bodies.push_back(in.exactly<double>(b->state().size()));
    const auto couplings = in.exactly<double>(2 * s.system->coupling_memory.size());
    std::map<BodySystem::Key, Vec3> warm[2];
    for (auto& of : warm) {
        const auto keys = in.vector<std::int64_t>(1u << 28);
        const auto forces = in.vector<double>(1u << 28);
        if (2 * forces.size() != 3 * keys.size()) ByteReader::refuse("an impossible size");
        for (std::size_t i = 0; 2 * i < keys.size(); ++i)
            of[{int(keys[2 * i]), keys[2 * i + 1]}] =
                Vec3(forces[3 * i], forces[3 * i + 1], forces[3 * i + 2]);
    }
    const auto sticks = in.vector<std::int64_t>(1u << 28);
    const auto pairs_found = in.vector<std::int64_t>(1u << 28);
    auto rows = s.system->finder.read_rows(in);
    OverlapLog overlaps = OverlapLog::read(in, s.system->finder.pairs().size());
    auto limits = in.vector<LinearLimit>(s.system->refs.size());
    auto instruments = in.vector<InstrumentLog>(s.scene.rods.size());
    const std::vector<LiveInputs::Saved> inputs = s.inputs.read(in);
    RunSummary sum = read_summary(in);
    in.end();
    if (!s.system->finder.restore_pairs(pairs_found, s.system->refs))
        ByteReader::refuse("pairs of other bodies");
    s.system->finder.set_rows(std::move(rows));
    s.overlaps = std::move(overlaps);
    s.limits = std::move(limits);
    s.instruments = std::move(instruments);
    s.inputs.restore(inputs);

    s.started = started;
    s.time = time;
    s.step_length = step_length;
    s.path_length = path_length;
    s.step = step;
    s.contacts_sum = contacts_sum;
    s.energy = energy;
    s.refinement = refinement;
    s.lagging = lagging;
    s.jumps = jumps;
    s.unstable = unstable;
    s.unstable_kept = unstable_kept;
    for (std::size_t b = 0; b < bodies.size(); ++b)
        s.system->bodies[b]->set_state(bodies[b]);
    for (std::size_t c = 0; c < s.system->coupling_memory.size(); ++c)
        s.system->coupling_memory[c] = {couplings[2 * c], couplings[2 * c + 1]};
    s.system->warm_sticks.clear();
    for (std::size_t i = 0; i + 1 < sticks.size(); i += 2)
        s.system->warm_sticks[{int(sticks[i]), sticks[i + 1]}] = true;
    s.system->warm = std::move(warm[0]);
    s.system->warm_friction = std::move(warm[1]);
    s.summary = std::move(sum);
    s.finish();
}

} // namespace amontons
