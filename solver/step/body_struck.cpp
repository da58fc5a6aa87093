#include "solver/body/drive.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/step/body_simulation_state.hpp"

#include <algorithm>
#include <cmath>

// Impacts act at velocities: in a step in which a body is struck several times (a light ball
// between a floor and a heavy one) it moves on with the last velocity from where the step started,
// into what it has rebounded from. A step that ends deeper than is accepted is made shorter; what
// is left is undone at the end of the step in the places alone, by the least motion that masses
// allow. Velocities stay, and with them the kinetic energy (as the projection of Acary 2013,
// Comput. Methods Appl. Mech. Engrg. 256, 224-250); the work of weight and loads on the way is
// counted.

namespace amontons {
namespace {

/// The deepest overlap over what is accepted without a warning.
double excess(const std::vector<BodyOverlap>& overlaps)
{
    double most = 0;
    for (const BodyOverlap& o : overlaps)
        most = std::max(most, o.depth / o.silent);
    return most;
}

/// Of rigid bodies alone, beside something that no momentum moves: of bodies that are isolated the
/// angular momentum would change with their places.
bool may_be_parted(const BodySystem& system, const std::vector<Obstacle>& obstacles)
{
    bool stands = !obstacles.empty();
    for (const BodyRef& b : system.refs) {
        if (!b.rigid) return false;
        stands |= b.rigid->driven();
    }
    return stands && system.couplings.empty();
}

} // namespace

/// After a step in motion that is accepted.
/// @return  false if so much is left of overlaps that a shorter step is due
bool BodySimulation::State::part_struck_bodies()
{
    constexpr int kMost = 30;       // steps
    constexpr int kPatience = 5;    // steps without success: what is pushed out of one body may
                                    // come into the next, which is not near enough before
    constexpr double kEnough = 0.5; // of what is accepted
    double left = excess(last.overlaps);
    if (!dynamic() || !(left > 1) || !may_be_parted(*system, obstacles)) return true;
    BodyStepReport deep; // as the impacts left it
    deep.overlaps = last.overlaps;
    struct Start {
        std::pair<Vec3, Eigen::Quaterniond> place;
        std::pair<Vec3, Vec3> load;
    };
    std::vector<Start> from;
    for (const BodyRef& b : system->refs)
        from.push_back({b.rigid->iterate(), b.rigid->loads(time)});
    const std::map<BodySystem::Key, Vec3> warm = system->warm;

    // ---- Places
    BodyStepOptions options = step_options();
    options.undone = 1;
    std::vector<std::vector<double>> best(system->bodies.size());
    const auto keep = [&] {
        for (std::size_t b = 0; b < best.size(); ++b)
            best[b] = system->bodies[b]->state();
    };
    keep();
    int failed = 0;
    for (int i = 0; i < kMost && left > kEnough && failed < kPatience && !*stop; ++i) {
        BodyStepReport part = separation_step(*system, options, time);
        if (!part.accepted) break;
        const double now = excess(part.overlaps);
        ++failed;
        if (!(now < left)) continue;
        failed = 0;
        left = now;
        last.overlaps = std::move(part.overlaps);
        last.overlap = part.overlap;
        keep();
    }
    for (std::size_t b = 0; b < best.size(); ++b)
        system->bodies[b]->set_state(best[b]);

    // ---- What follows the places
    for (std::size_t b = 0; b < from.size(); ++b) {
        RigidBody& rigid = *system->refs[b].rigid;
        if (rigid.driven()) continue;
        const auto& [centre, turn_before] = from[b].place;
        const Eigen::Quaterniond turn = rigid.iterate().second * turn_before.conjugate();
        energy.work += from[b].load.first.dot(rigid.iterate().first - centre) +
                       from[b].load.second.dot(rotation_vector(turn));
        // A spin turns with its body: so its energy stays.
        std::vector<double> velocities;
        rigid.swap_velocities(velocities);
        Eigen::Map<Vec3> spin(velocities.data() + 3);
        spin = turn * Vec3(spin);
        rigid.swap_velocities(velocities);
    }
    system->warm = warm;
    BodyContacts now;
    StepInput at_rest;
    at_rest.dynamic = true;
    system->finder.find(system->refs, at_rest, now);
    std::map<BodySystem::Key, double> gap;
    for (const BodyContact& c : now.contact)
        gap[{c.pair, c.id}] = c.gap;
    last.penetration = 0;
    for (BodyContact& c : last.contacts.contact) {
        const auto at = gap.find({c.pair, c.id});
        c.gap = at != gap.end() ? at->second : std::max(c.gap, 0.0);
        last.penetration = std::max(last.penetration, -c.gap);
    }
    constexpr double kDeep = 0.4; // of what is refused
    if (std::ranges::any_of(last.overlaps,
                            [](const BodyOverlap& o) { return o.depth > kDeep * o.most; }))
        return false;
    overlaps.add(*system, deep, step + 1, summary.warnings, true);
    return true;
}

} // namespace amontons
