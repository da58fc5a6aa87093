#include "solver/step/rod_stability.hpp"

#include "solver/body/drive.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/step/body_step.hpp"
#include "solver/step/rod_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace amontons {
namespace {

constexpr double kPush = 1e-3;       // of the least radius
constexpr double kSideways = 1e-6;   // of a motion's size: where it has a side
constexpr double kSticks = 1 - 1e-6; // of the cone: less friction sticks

/// Of the rods: with each other, and with what counts as standing still.
std::vector<RodContactState> acting_contacts(const BodySystem& system, const BodyStepReport& report)
{
    const bool alone = system.rods_alone();
    std::vector<RodContactState> states;
    for (std::size_t c = 0; c < report.contacts.contact.size(); ++c) {
        const BodyContact& k = report.contacts.contact[c];
        if (!system.refs[std::size_t(k.a)].rod) continue;
        RodContactState s;
        s.contact = &k;
        s.a = report.contacts.place_a(k);
        s.b = report.contacts.place_b(k);
        s.force = k.frame.transpose() * report.force[c];
        if (!(s.force[0] > 0)) continue;
        s.friction = friction_of(system.finder.pairs(), k);
        const auto stuck = system.warm_sticks.find({k.pair, k.id});
        s.sticks = alone ? stuck != system.warm_sticks.end() && stuck->second
                         : s.force.tail<2>().norm() < kSticks * s.friction * s.force[0];
        s.sticks = s.sticks && s.friction > 0;
        states.push_back(s);
    }
    return states;
}

/// The sign of the mode: along the motion of the rods since their first shape; if that has no part
/// along it, such that the largest component in its section's axes is positive.
double side(const BodySystem& system, const NegativeMotion& m)
{
    double along = 0, moved = 0, size = 0, largest = 0, sign = 1;
    for (std::size_t b = 0; b < system.refs.size(); ++b) {
        const RodBody* rod = system.refs[b].rod;
        if (!rod) continue;
        for (std::size_t i = 0; i < rod->nodes().size(); ++i) {
            const Vec3 own = m.motion[b].segment<3>(6 * Eigen::Index(i));
            const Vec3 way = rod->nodes()[i].position() - rod->first_nodes()[i].position();
            along += own.dot(way);
            moved += way.squaredNorm();
            size += own.squaredNorm();
            if (own.norm() > (1 + kSideways) * largest) {
                largest = own.norm();
                const Vec3 in_section = rotation_matrix(rod->nodes()[i].q).transpose() * own;
                Eigen::Index k = 0;
                in_section.cwiseAbs().maxCoeff(&k);
                sign = in_section[k] < 0 ? -1 : 1;
            }
        }
    }
    return std::abs(along) > kSideways * std::sqrt(moved * size) ? std::copysign(1, along) : sign;
}

} // namespace

std::optional<UnstableBalance> unstable_rods(BodySystem& system, const StepInput& step,
                                             const BodyStepReport& report)
{
    if (step.dynamic) return {};
    const auto of_rods = [&](auto&& judge) {
        return std::ranges::any_of(system.refs,
                                   [&](const BodyRef& b) { return b.rod && judge(*b.rod); });
    };
    if (of_rods([](const RodBody& r) { return r.has_drag(); }) ||
        !of_rods([](const RodBody& r) { return r.negative() > 0; }))
        return {};
    StepInput here = step;
    here.start = step.end();
    here.h = 0;
    RodProblem problem;
    std::vector<int> negative;
    double radius = std::numeric_limits<double>::infinity();
    for (const BodyRef& b : system.refs) {
        problem.rods.push_back(b.rod);
        negative.push_back(b.rod ? b.rod->negative() : 0);
        if (!b.rod) continue;
        radius = std::min(radius, b.rod->least_radius());
        b.rod->begin(here);
        b.rod->linearise();
    }
    std::vector<CouplingRow> rows;
    for (std::size_t c = 0; c < system.couplings.size(); ++c)
        rows.push_back(
            coupling_row(system.refs, system.couplings[c], system.coupling_memory[c].value));
    std::vector<double> forces;
    for (std::size_t c = 0; c < rows.size(); ++c) {
        const auto known = system.warm.find({-1, int(c)});
        forces.push_back(known == system.warm.end() ? 0 : known->second.x());
    }
    problem.joints = rod_joints(system.refs, system.couplings, rows, forces);
    const auto found = negative_motion(problem, acting_contacts(system, report));
    for (std::size_t b = 0; b < negative.size(); ++b)
        if (RodBody* rod = system.refs[b].rod)
            rod->note_negative(found || !system.rods_alone() ? negative[b] : 0);
    if (!found) return {};
    UnstableBalance out;
    out.stiffness = found->stiffness;
    out.modes = std::accumulate(negative.begin(), negative.end(), 0);
    const double way = side(system, *found) * kPush * radius;
    double most = -1;
    for (std::size_t b = 0; b < system.refs.size(); ++b) {
        out.push.push_back(way * found->motion[b]);
        const double own = found->motion[b].size() > 0 ? found->motion[b].norm() : -1;
        if (own <= most) continue;
        most = own;
        out.body = system.refs[b].name;
    }
    return out;
}

namespace {

/// The mean shift of the nodes, and the turn about their middle: of places, or, of a straight rod
/// that turns about itself, of its sections.
std::string rigid_part(const RodBody& rod, const Eigen::VectorXd& motion)
{
    const std::vector<BeamNode>& nodes = rod.nodes();
    const double n = double(nodes.size());
    Vec3 middle = Vec3::Zero(), shift = Vec3::Zero(), turn = Vec3::Zero();
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const Eigen::Index at = 6 * Eigen::Index(i);
        middle += nodes[i].position() / n;
        shift += motion.segment<3>(at) / n;
        turn += rotation_matrix(nodes[i].q) * motion.segment<3>(at + 3) / n;
    }
    double size = 0;
    for (const BeamNode& node : nodes)
        size = std::max(size, (node.position() - middle).norm());
    return name_of_motion(shift, size * turn);
}

} // namespace

std::string unheld_rods(BodySystem& system, const StepInput& step, const BodyStepReport& report)
{
    if (step.dynamic || !system.rods_alone() ||
        std::ranges::none_of(system.refs,
                             [](const BodyRef& b) { return b.rod && b.rod->is_stabilised(); }))
        return "";
    StepInput here = step;
    here.start = step.end();
    here.h = 0;
    RodProblem problem;
    for (const BodyRef& b : system.refs) {

        problem.rods.push_back(b.rod);
        if (!b.rod) continue;
        const int negative = b.rod->negative();
        b.rod->begin(here);
        b.rod->linearise();
        b.rod->note_negative(negative);
    }
    std::vector<RodContactState> acting = acting_contacts(system, report);
    for (RodContactState& s : acting)
        s.sticks = s.friction > 0;
    const auto motion = unheld_motion(problem, acting);
    if (!motion) return "";
    std::size_t most = 0;
    for (std::size_t b = 1; b < motion->size(); ++b)
        if ((*motion)[b].size() > 0 &&
            ((*motion)[most].size() == 0 || (*motion)[b].norm() > (*motion)[most].norm()))
            most = b;
    const BodyRef& body = system.refs[most];
    return body.name + ": " + rigid_part(*body.rod, (*motion)[most]);
}

} // namespace amontons
