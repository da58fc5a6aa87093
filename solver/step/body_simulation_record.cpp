#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_record.hpp"
#include "solver/step/body_simulation_state.hpp"
#include "solver/step/instrument_record.hpp"
#include "solver/step/recorded_problem.hpp"
#include "solver/step/undetermined.hpp"

#include <algorithm>

// What a simulation of bodies reports of its steps and at its end.

namespace amontons {

StepRecord BodySimulation::State::record(double h, double seconds)
{
    StepRecord out;
    out.step = step;
    out.time = time;
    out.step_length = h;
    out.seconds = seconds;
    out.iterations = last.iterations;
    out.factorisations = last.factorisations;
    out.errors = last.errors;
    out.retries = retries;
    out.energy = energy;
    for (const std::string& r : last.remarks)
        out.remark += (out.remark.empty() ? "" : "; ") + r;
    out.certificate.error = last.error;
    out.certificate.tolerance = std::max(last.threshold, scene.accuracy.contact);
    out.certificate.worst_penetration = last.penetration;
    if (dynamic()) { // the laws of its steps are of velocities: where gaps ended, instead
        out.certificate.worst_penetration = 0;
        for (const BodyContact& k : last.contacts.contact)
            out.certificate.worst_penetration = std::max(out.certificate.worst_penetration, -k.gap);
    }
    out.certificate.worst_cone_violation = last.cone;
    if (const BodyOverlap& o = last.overlap; o.depth > 0) {
        OverlapRecord& worst = out.certificate.worst_overlap;
        worst.depth = o.depth;
        worst.a = system->refs[std::size_t(o.a)].name;
        worst.b = o.b >= 0          ? system->refs[std::size_t(o.b)].name
                  : o.obstacle >= 0 ? obstacles[std::size_t(o.obstacle)].name
                                    : "";
        worst.point = o.point;
        worst.step = step;
    }
    out.certificate.certified = out.certificate.error <= out.certificate.tolerance;
    out.contacts = contact_records_of(*system, last, int(obstacles.size()));
    for (const BodyRef& b : system->refs)
        if (b.rod) out.beams.push_back(record_rod(*b.rod, b.name));
    out.quantities = body_quantities(scene, obstacles, *system, last);
    for_instruments([&](int rod, int b) {
        const double depth = system->refs[std::size_t(b)].rod->length_out_of_sheath();
        record_instrument(out.beams[std::size_t(rod)], int(obstacles.size()) + b, depth,
                          scene.output.cluster, out);
    });
    return out;
}

void BodySimulation::State::note_limits()
{
    limits.resize(system->refs.size());
    for (std::size_t b = 0; b < limits.size(); ++b) {
        SolidBody* solid = system->refs[b].solid;
        if (!solid || solid->nonlinear()) continue;
        solid->complete();
        limits[b].note(solid->mesh(), solid->places(), solid->frame().turn.toRotationMatrix(),
                       time);
    }
}

void BodySimulation::State::note_instruments(const StepRecord& r)
{
    std::size_t k = 0;
    for_instruments([&](int rod, int b) {
        std::vector<int> walls;
        for (const ContactPair& p : system->finder.pairs())
            if (p.a == b && p.b < 0) walls.push_back(p.obstacle);
        if (instruments.size() <= k) instruments.emplace_back();
        const BeamRecord& beam = r.beams[std::size_t(rod)];
        instruments[k].note(r, beam, obstacles, walls);
        RodBody& body = *system->refs[std::size_t(b)].rod;
        const bool outside = instruments[k].opening >= 0;
        if (outside && !body.feed_is_stopped()) body.stop_feed();
        if (!outside && body.feed_is_stopped()) body.release_feed();
        instruments[k].add_quantities(beam.name, summary.quantities);
        ++k;
    });
}

void BodySimulation::State::finish()
{
    summary.texts.clear();
    for_instruments([&](int rod, int) {
        const std::size_t k = summary.texts.size();
        if (k < instruments.size())
            summary.texts.push_back({scene.rods[std::size_t(rod)].name + "_branch",
                                     instruments[k].place(obstacles)});
    });
    summary.steps = step;
    summary.time = time;
    summary.energy = energy;
    summary.contacts_mean = step > 0 ? contacts_sum / step : 0;
    summary.not_measured = system->finder.not_measured(system->refs);
}

/// Of the last step: which forces could be others. Of a run that continues it is reported at its
/// own end.
void BodySimulation::State::examine_forces()
{
    // Bodies hold the matrices of the step that was tried last.
    if (summary.status == "interrupted" || summary.status == "failed") {
        summary.undetermined.clear();
        summary.undetermined_not_examined = {summary.status == "failed"
                                                 ? "all: the last step was refused"
                                                 : "all: the run was interrupted"};
        return;
    }
    if (scene.time.path > 0) summary.undetermined_not_examined = {"all: balances along a path"};
    if (!last.accepted) return; // no step since the run was resumed: what was reported then stands
    UndeterminedForces found =
        undetermined_forces(*system, last, last_input, scene.accuracy.contact);
    summary.undetermined = std::move(found.pairs);
    summary.undetermined_not_examined = std::move(found.not_examined);
}

std::vector<RecordedProblem> BodySimulation::contact_problems() const
{
    const BodyStepReport& r = state_->last;
    if (r.recorded.mu.size() == 0 || r.recorded.W.is_matrix_free()) return {};
    RecordedProblem p;
    if (r.recorded.W.rows() > 0) {
        p.problem = r.recorded;
        p.reaction = r.recorded_reaction;
        p.contact = r.recorded_identity;
    } else {
        p.problem = rods_problem(*state_->system, r, p.reaction);
        for (std::size_t c = 0; c < r.contacts.contact.size(); ++c)
            p.contact.push_back(int(c));
    }
    return {p};
}

std::vector<BodyRecord> BodySimulation::body_records() const
{
    State& s = *state_;
    s.note_limits();
    std::vector<BodyRecord> all;
    for (std::size_t b = 0; b < s.system->refs.size(); ++b)
        if (!s.system->refs[b].rod) {
            all.push_back(record_body(*s.system, b, s.last));
            if (const SolidBody* solid = s.system->refs[b].solid; solid && s.dynamic())
                all.back().point_fields.push_back({"velocity", "m/s", 3, solid->velocities()});
        }
    return all;
}

} // namespace amontons
