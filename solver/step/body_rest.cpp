#include "solver/body/rigid_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_stepper.hpp"

// Steps at rest whose end does not depend on the path: linear solids that are held, and bodies that
// are led, without friction. Contacts at corners and edges appear and disappear as faces turn, and
// rows at deep places are added by what an iterate shows: on the geometry at the end of a step
// there may be several equilibria, and the iteration comes to one or another from the end of the
// step before. Where such contacts act, the step is made again from the bodies without contact,
// whatever the steps before were; where what is prescribed has moved farther than contacts are
// searched for, in equal parts of the time since the start.

namespace amontons {
namespace {

constexpr int kMostParts = 8;  // a longer way is followed by the scene's own steps
constexpr int kFinerParts = 4; // times as many, where fewer find no equilibrium

/// In how many parts of the time contacts are found all the way from the start; 0: too many.
int parts_from_start(BodySystem& system, double end)
{
    for (int parts = 1; parts <= kMostParts; ++parts) {
        double most = 0;
        for (int k = 0; k < parts; ++k)
            most = std::max(most, system.finder.prescribed_over_reach(system.refs, end * k / parts,
                                                                      end * (k + 1) / parts));
        if (most <= 1) return parts;
    }
    return 0;
}

} // namespace

bool is_independent_of_path(const BodySystem& system)
{
    const ContactFinder& finder = system.finder;
    if (finder.has_rest() || finder.all_small() || finder.has_start_overlaps() ||
        !system.couplings.empty())
        return false;
    const auto meshes = [&](const ContactPair& p) {
        return system.refs[std::size_t(p.a)].solid && p.b >= 0 && !p.small;
    };
    if (std::ranges::none_of(finder.pairs(), meshes)) return false;
    for (const ContactPair& p : finder.pairs())
        if (p.friction > 0 || !p.friction_of_segment.empty()) return false;
    return std::ranges::all_of(system.refs, [](const BodyRef& b) {
        return b.rigid ? b.rigid->driven() && !b.rigid->led()
                       : b.solid && b.solid->independent_of_path() && !b.solid->led();
    });
}

/// Some force acts at a corner, an edge or a deep place, or contacts were kept that are not found:
/// which of them there are is known from the iterations alone.
bool BodyStepper::depends_on_path() const
{
    if (frozen_ || rounds_ > 0 || !stays_.empty()) return true;
    return std::ranges::any_of(list_.contact, [&](const BodyContact& c) {
        if (c.area > 0) return false;
        const auto acting = force_.find({c.pair, c.id});
        return acting != force_.end() && !acting->second.isZero(0);
    });
}

BodyStepper::Places BodyStepper::places() const
{
    Places all;
    for (const BodyRef& b : system_.refs)
        all.push_back(b.solid ? b.solid->at_touching() : std::vector<Vec3>());
    return all;
}

void BodyStepper::begin_at_places()
{
    for (std::size_t b = 0; b < bodies(); ++b)
        if (SolidBody* solid = system_.refs[b].solid)
            solid->begin_at(from_->empty() ? std::vector<Vec3>() : (*from_)[b]);
}

namespace {

/// The step in so many parts of the way from the start.
bool step_in_parts(BodySystem& system, const StepInput& step, int parts,
                   const BodyStepOptions& options, BodyStepReport& report)
{
    BodyStepper::Places places;
    BodyStepper::Forces forces;
    for (int k = 1; k <= parts; ++k) {
        StepInput input = step;
        if (k < parts) {
            input.start = step.end() * k / parts;
            input.h = 0;
        }
        BodyStepReport own;
        system.finder.begin_rows(false);
        BodyStepper stepper(system, input, options, own);
        stepper.begin_from(std::move(places), std::move(forces), k < parts);
        own.accepted = stepper.run();
        own.add_cost_of(report);
        report = std::move(own);
        if (!report.accepted) return false;
        places = stepper.places();
        forces = stepper.forces();
    }
    return true;
}

} // namespace

bool step_from_rest(BodySystem& system, const StepInput& step, const BodyStepOptions& options,
                    BodyStepReport& report)
{
    const int parts = parts_from_start(system, step.end());
    for (int finer = 1; parts > 0 && finer <= kFinerParts; finer *= 2)
        if (step_in_parts(system, step, finer * parts, options, report)) return true;
    return false;
}

} // namespace amontons
