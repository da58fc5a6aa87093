#include "solver/body/rigid_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_stepper.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <vector>

// Steps at rest whose end does not depend on the path: linear solids that are held, and bodies that
// are led, without friction. Contacts at corners and edges appear and disappear as faces turn, and
// rows at deep places are added by what an iterate shows: on the geometry at the end of a step
// there may be several equilibria, and the iteration comes to one or another from the end of the
// step before. Where such contacts act, the step is made again from the bodies without contact,
// whatever the steps before were; where what is prescribed has moved farther than contacts are
// searched for, in equal parts of the time since the start. Where it ends with a force at a contact
// that is not found at its end (body_lag.cpp), that contact stays as an iterate was: then it is
// made in finer parts, too, until it ends without such a contact. If it never does, the first is
// accepted, and how much the forces of the others differ from it is reported.

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

/// Some force acts at a contact that is not found at the iterate.
bool BodyStepper::keeps_lost() const
{
    return std::ranges::any_of(stays_, [&](const auto& held) {
        const auto acting = force_.find(held.first);
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

using PairForces = std::map<int, Vec3>;

/// The sum of the forces of each pair.
PairForces pair_forces(const BodyStepper::Forces& forces)
{
    PairForces sum;
    for (const auto& [key, force] : forces)
        sum.try_emplace(key.pair, Vec3::Zero()).first->second += force;
    return sum;
}

/// How much two differ, of the largest of the first.
double differing(const PairForces& a, const PairForces& b)
{
    double largest = 0, difference = 0;
    for (const auto& [pair, force] : a) {
        const auto other = b.find(pair);
        largest = std::max(largest, force.norm());
        difference =
            std::max(difference, other == b.end() ? force.norm() : (force - other->second).norm());
    }
    return largest > 0 ? difference / largest : 0;
}

/// The step in so many parts of the way from the start.
/// @param kept  out: the forces of a balance with contacts that are not found at its end, of which
///              nothing is accepted; null: it may have such contacts
bool step_in_parts(BodySystem& system, const StepInput& step, int parts,
                   const BodyStepOptions& options, BodyStepReport& report,
                   std::optional<PairForces>* kept)
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
        if (kept) stepper.refuse_kept();
        own.accepted = stepper.run();
        own.add_cost_of(report);
        report = std::move(own);
        if (kept && stepper.converged()) *kept = pair_forces(stepper.forces());
        if (!report.accepted) return false;
        places = stepper.places();
        forces = stepper.forces();
    }
    return true;
}

} // namespace

bool step_from_rest(BodySystem& system, const StepInput& step, const BodyStepOptions& options,
                    BodyStepReport& report, const BodyStepper& from_before)
{
    const int parts = parts_from_start(system, step.end());
    int first = 0; // number of parts that ends with contacts that are not found there,
    std::vector<PairForces> balances;
    for (int finer = 1; parts > 0 && finer <= kFinerParts; finer *= 2) {
        std::optional<PairForces> kept;
        if (step_in_parts(system, step, finer * parts, options, report, &kept)) return true;
        if (!kept) continue;
        if (first == 0) first = finer * parts;
        balances.push_back(std::move(*kept));
    }
    if (first == 0) return false;
    if (from_before.converged()) balances.push_back(pair_forces(from_before.forces()));
    if (!step_in_parts(system, step, first, options, report, nullptr)) return false;
    for (const PairForces& other : balances)
        report.spread = std::max(report.spread, differing(balances.front(), other));
    return true;
}

} // namespace amontons
