#include "solver/step/coaxial.hpp"

#include "mesh/base/phase_timer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace amontons {
namespace {

// An iteration moves less than the one before: contacts farther away than this many of its motions
// cannot close. If it moves more, they are contacts of the next one.
constexpr double kMovesAway = 4;

/// Numbers the nodes of all that is out by their length past the introducer.
void order_nodes(Coaxial& c)
{
    struct Node {
        double s;
        int wire, node;
    };
    std::vector<Node> order;
    c.slot.resize(c.wires.size());
    for (std::size_t w = 0; w < c.wires.size(); ++w) {
        const Wire& wire = c.wires[w]->wire;
        c.slot[w].assign(wire.material.node.size(), -1);
        if (!wire.outside()) continue;
        const double end = wire.material.length - wire.state.base_insertion;
        for (int i = wire.state.first; i <= wire.last(); ++i)
            order.push_back({i == wire.state.first ? -double(c.wires.size() - w)
                                                   : wire.material.node[std::size_t(i)] - end,
                             int(w), i});
    }
    std::stable_sort(order.begin(), order.end(),
                     [](const Node& a, const Node& b) { return a.s < b.s; });
    for (std::size_t k = 0; k < order.size(); ++k)
        c.slot[std::size_t(order[k].wire)][std::size_t(order[k].node)] = int(k);
    c.top.resize(order.size());
    for (std::size_t k = 0; k < order.size(); ++k)
        c.top[k] = int(k);
    for (std::size_t w = 0; w < c.wires.size(); ++w) {
        const Wire& wire = c.wires[w]->wire;
        for (int i = wire.state.first; i < wire.last(); ++i) {
            const int a = c.slot[w][std::size_t(i)], b = c.slot[w][std::size_t(i) + 1];
            c.top[std::size_t(b)] = std::min(c.top[std::size_t(b)], a);
        }
    }
    c.base = BlockSkyline{};
    c.system = BlockSkyline{};
    for (auto* v : {&c.gradient, &c.right, &c.increment}) {
        v->resize(order.size());
        for (Node6& n : *v)
            n.column = Column6{};
    }
}

/// At an element's end the other end's rows are zero: they are added where they widen no row of the
/// matrix.
void leave_out_untouched(CoaxialContact& k, const Wire& w, const WirePlace& p, std::size_t at)
{
    if (p.element == w.state.first) return; // there the length that is out is an unknown too
    if (p.xi == 0) k.slot[at + 1] = k.slot[at];
    if (p.xi == 1) k.slot[at] = k.slot[at + 1];
}

/// The list of all contacts, with their slots; the matrix's pattern has room for them.
void list_contacts(Coaxial& c)
{
    c.all.clear();
    const auto complete = [&](CoaxialContact& k) {
        const auto begin = k.slot.begin(), end = begin + k.nodes;
        k.lowest = *std::min_element(begin, end);
        k.highest = *std::max_element(begin, end);
        const CoaxialContact* before = c.all.empty() ? nullptr : &c.all.back();
        k.follows = before && before->wire == k.wire && before->nesting == k.nesting &&
                    before->contact->index + 1 == k.contact->index;
        c.all.push_back(k);
    };
    for (std::size_t w = 0; w < c.wires.size(); ++w) {
        WireBody& b = *c.wires[w];
        if (!b.wire.outside()) continue;
        for (const Candidate& contact : b.work->candidates) {
            CoaxialContact k;
            k.contact = &contact;
            k.wire = int(w);
            k.reaction = &b.wire.state.reaction[std::size_t(contact.index)];
            k.nodes = 2;
            const std::size_t e = std::size_t(contact.place.element);
            k.slot = {c.slot[w][e], c.slot[w][e + 1], 0, 0};
            complete(k);
        }
    }
    bool grown = false;
    for (std::size_t n = 0; n < c.nestings.size(); ++n) {
        const auto [inner, outer] = c.pairs[n];
        for (const NestedContact& contact : c.contacts[n]) {
            CoaxialContact k;
            k.contact = &contact.on_inner;
            k.nested = &contact;
            k.nesting = int(n);
            k.wire = inner;
            k.reaction = &c.nestings[n].reaction[std::size_t(contact.on_inner.index)];
            k.nodes = 4;
            const std::size_t e = std::size_t(contact.on_inner.place.element),
                              f = std::size_t(contact.outer.element);
            const auto &si = c.slot[std::size_t(inner)], &so = c.slot[std::size_t(outer)];
            k.slot = {si[e], si[e + 1], so[f], so[f + 1]};
            leave_out_untouched(k, c.wires[std::size_t(inner)]->wire, contact.on_inner.place, 0);
            leave_out_untouched(k, c.wires[std::size_t(outer)]->wire, contact.outer, 2);
            complete(k);
            for (int s : k.slot)
                if (c.top[std::size_t(s)] > c.all.back().lowest) {
                    c.top[std::size_t(s)] = c.all.back().lowest;
                    grown = true;
                }
        }
    }
    if (grown || c.base.size() == 0) {
        c.base.set_pattern(c.top);
        c.system.set_pattern(c.top);
    }
}

void scatter(const NestedTangent& K, const CoaxialContact& k, BlockSkyline& base)
{
    for (int a = 0; a < 4; ++a)
        for (int b = 0; b < 4; ++b) {
            Block6& block = base.block(k.slot[std::size_t(a)], k.slot[std::size_t(b)]);
            for (int j = 0; j < 6; ++j)
                for (int i = 0; i < 6; ++i)
                    block(i, j) += K(6 * a + i, 6 * b + j);
        }
}

/// Everything of one iterate.
Residual assemble_coaxial(Coaxial& c, const std::vector<StepStart>& start,
                          const CoaxialStart& nested, const std::vector<ViscousPull>& anchors,
                          const NewtonOptions& options, NewtonReport& report)
{
    // ---- Wires on their own, bores
    for (std::size_t w = 0; w < c.wires.size(); ++w) {
        WireBody& b = *c.wires[w];
        if (b.wire.outside())
            assemble_iterate(b.wire, b.walls, start[w], anchors[w], options, *b.work, report);
    }
    const Stopwatch watch;
    Residual res;
    double reactions = 0;
    for (std::size_t n = 0; n < c.nestings.size(); ++n) {
        find_nested(c.nestings[n], nested.nestings[n], options.reach, c.contacts[n]);
        const auto [inner, outer] = c.pairs[n];
        std::vector<Node6>&gradient_inner = c.wires[std::size_t(inner)]->work->gradient,
        &gradient_outer = c.wires[std::size_t(outer)]->work->gradient;
        for (const NestedContact& k : c.contacts[n]) {
            const Candidate& a = k.on_inner;
            reactions = std::max(reactions, a.normal);
            res.penetration = std::max(res.penetration, a.bilateral ? std::abs(a.gap) : -a.gap);
            if (!(a.normal > 0)) continue;
            const std::size_t e = std::size_t(a.place.element), f = std::size_t(k.outer.element);
            const auto subtract = [](std::vector<Node6>& g, std::size_t at, const ContactRow& h,
                                     double s) {
                g[at].column -= splat6(s) * h.a.column;
                g[at + 1].column -= splat6(s) * h.b.column;
            };
            subtract(gradient_inner, e, a.hn, a.normal);
            subtract(gradient_outer, f, k.hn, a.normal);
            for (int i = 0; i < 2; ++i) {
                subtract(gradient_inner, e, a.ht[i], a.tangential[i]);
                subtract(gradient_outer, f, k.ht[i], a.tangential[i]);
            }
        }
    }

    // ---- Contacts and residual
    list_contacts(c);

    double floor = 0;
    for (std::size_t w = 0; w < c.wires.size(); ++w) {
        WireBody& b = *c.wires[w];
        if (!b.wire.outside()) continue;
        const Residual own = residual_of_iterate(b.wire, *b.work);
        res.equilibrium = std::max(res.equilibrium, own.equilibrium);
        res.contact = std::max(res.contact, own.contact);
        res.penetration = std::max(res.penetration, own.penetration);
        res.cone = std::max(res.cone, own.cone);
        reactions = std::max(reactions, own.scale);
        floor = std::max(floor, own.floor * own.scale);
        if (!std::isfinite(own.equilibrium)) res.equilibrium = own.equilibrium;
    }
    for (const auto& list : c.contacts)
        for (const NestedContact& k : list) {
            const Candidate& a = k.on_inner;
            res.contact = std::max(res.contact, contact_error(a, res.cone));
        }
    res.scale = reactions;
    res.floor = floor / res.scale;

    // ---- One matrix and one gradient
    // One matrix and one gradient of all.
    c.base.set_zero();
    for (std::size_t w = 0; w < c.wires.size(); ++w) {
        const WireBody& b = *c.wires[w];
        if (!b.wire.outside()) continue;
        const BlockTridiagonal& K = b.work->base;
        for (int i = b.wire.state.first; i <= b.wire.last(); ++i) {
            const int s = c.slot[w][std::size_t(i)];
            c.base.block(s, s) = K.diagonal(i);
            c.gradient[std::size_t(s)] = b.work->gradient[std::size_t(i)];
            if (i == b.wire.last()) continue;
            const int t = c.slot[w][std::size_t(i) + 1];
            c.base.block(s, t) = K.upper(i);
            c.base.block(t, s) = K.lower(i);
        }
    }
    for (const CoaxialContact& k : c.all)
        if (k.nested && k.contact->normal > 0) {
            const Nesting& n = c.nestings[std::size_t(k.nesting)];
            scatter(nested_tangent(n, *k.nested), k, c.base);
        }
    report.seconds_detection += watch.seconds();
    return res;
}

/// The reaction of two contacts at a place where the inner instrument fills the bore: its normal
/// turns to where both together point. @param across  the second of them
void take_trials_of_full_bore(const Candidate& c, NewtonWorkspace::Trial t, const Candidate& across,
                              const NewtonWorkspace::Trial& u, double factor, Reaction& r)
{
    const Vec3 n = t.normal * c.n + u.normal * across.n;
    const double size = n.norm();
    // Friction of a reaction that has reversed had the wrong sign.
    if (t.normal < 0 && t.status == 2) t.t1 = -t.t1, t.t2 = -t.t2;
    t.normal = size;
    const Vec3 push = c.normal * c.n + factor * (n - c.normal * c.n);
    take_trial(c, t, factor, r);
    r.normal = push.norm();
    r.touch.n = r.normal > 0 ? Vec3(push / r.normal) : c.n;
}

/// Distributes the common increment to the wires.
void gather(const Coaxial& c, const std::vector<Node6>& common, std::size_t w,
            std::vector<Node6>& own)
{
    const Wire& wire = c.wires[w]->wire;
    for (int i = wire.state.first; i <= wire.last(); ++i)
        own[std::size_t(i)] = common[std::size_t(c.slot[w][std::size_t(i)])];
}

/// The largest motion of any point of a wire in an increment, or a bound of it [m].
double largest_motion(const Wire& wire, const std::vector<Node6>& increment)
{
    double largest = 0;
    for (int i = wire.state.first; i <= wire.last(); ++i) {
        const double* d = increment[std::size_t(i)].value;
        const double h = wire.material.law[std::size_t(std::min(i, wire.last() - 1))].length;
        largest = std::max(largest, std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]) +
                                        h * std::sqrt(d[3] * d[3] + d[4] * d[4] + d[5] * d[5]));
    }
    return largest;
}

/// Newton's method on all that are out.
NewtonReport solve_together(Coaxial& c, const std::vector<StepStart>& start,
                            const CoaxialStart& nested, const std::vector<ViscousPull>& anchors,
                            const NewtonOptions& options)
{
    NewtonReport report;
    NewtonOptions near = options; // with the reach of the next iteration
    order_nodes(c);
    double shift = c.shift = 0;
    for (report.iterations = 0; report.iterations <= options.max_iterations; ++report.iterations) {
        if (stopped(options)) return report;
        report.residual = assemble_coaxial(c, start, nested, anchors, near, report);
        const Residual& res = report.residual;
        if (!std::isfinite(res.equilibrium)) return report;
        if (report.iterations > 0 && res.error() <= std::max(options.tolerance, res.floor)) {
            report.converged = true;
            report.stable = shift == 0;
            return report;
        }
        if (report.iterations == options.max_iterations) return report;

        const Stopwatch solving;
        shift = 0;
        solve_linearised(c, res, options, shift, report);
        if (report.iterations >= kIterationsBeforeClosing)
            close_active_rows(c, least_violation(res, options));
        if (shift > 0) ++report.shifted;
        report.seconds_contact += solving.seconds();
        const Stopwatch moving;

        double factor = 1, motion = 0;
        for (std::size_t w = 0; w < c.wires.size(); ++w) {
            WireBody& b = *c.wires[w];
            if (!b.wire.outside()) continue;
            gather(c, c.increment, w, b.work->increment);
            motion = std::max(motion, largest_motion(b.wire, b.work->increment));
            factor = std::min(factor, step_factor(b.wire, b.work->increment, options.longest_move));
        }
        if (!(factor > 0)) {
            report.residual.equilibrium = std::numeric_limits<double>::infinity();
            return report;
        }
        near.reach = std::min(options.reach, kMovesAway * motion);
        for (std::size_t k = 0; k < c.all.size(); ++k) {
            const Candidate& contact = *c.all[k].contact;
            if (!contact.bilateral) {
                take_trial(contact, c.trial[k], factor, *c.all[k].reaction);
                continue;
            }
            take_trials_of_full_bore(contact, c.trial[k], *c.all[k + 1].contact, c.trial[k + 1],
                                     factor, *c.all[k].reaction);
            ++k;
        }
        for (WireBody* b : c.wires)
            if (b->wire.outside()) {
                predict_strains(b->wire, b->work->increment, factor, b->work->predicted);
                move_wire(b->wire, b->work->increment, factor);
            }
        report.seconds_rest += moving.seconds();
    }
    return report;
}

} // namespace

CoaxialStart mark_coaxial_start(const Coaxial& c)
{
    CoaxialStart start;
    std::vector<NestedContact> contacts;
    for (const Nesting& n : c.nestings) {
        start.nestings.push_back({n.inner->state, n.outer->state});
        start.touched.emplace_back();
        if (!(n.friction > 0) && !c.wires[0]->motion.dynamic) continue;
        find_nested(n, start.nestings.back(), -std::numeric_limits<double>::infinity(), contacts);
        for (const NestedContact& k : contacts) {
            if (k.across) continue;
            const Reaction& r = n.reaction[std::size_t(k.on_inner.index)];
            start.touched.back().push_back(
                {k.on_inner.index, k.on_inner.n, r.normal, n.friction * r.normal, r.tangential});
        }
    }
    return start;
}

void shift_coaxial_reactions(Coaxial& c, const std::vector<double>& shift)
{
    for (std::size_t w = 0; w < c.wires.size(); ++w)
        c.wires[w]->work->covered = 0;
    for (std::size_t n = 0; n < c.nestings.size(); ++n) {
        const auto [inner, outer] = c.pairs[n];
        shift_nested_reactions(c.nestings[n], shift[std::size_t(outer)]);
        WireBody& b = *c.wires[std::size_t(inner)];
        const WireMaterial& m = b.wire.material;
        const double covered = m.length - b.wire.state.inserted + nested_length(c.nestings[n]);
        b.work->covered = std::max(b.work->covered, covered);
        for (std::size_t p = 0; p < m.point.size(); ++p)
            if (m.point[p].s < covered)
                for (std::size_t k = 0; k < b.walls.size(); ++k)
                    b.wire.state.reaction[p * b.walls.size() + k] = {};
    }
}

NewtonReport solve_coaxial(Coaxial& c, const std::vector<StepStart>& start,
                           const CoaxialStart& nested, const std::vector<ViscousPull>& anchors,
                           const NewtonOptions& options)
{
    const auto out = [](const WireBody* b) { return b->wire.outside(); };
    for (auto& list : c.contacts)
        list.clear();
    const auto count = std::count_if(c.wires.begin(), c.wires.end(), out);
    if (count <= 1) { // what one wire needs is less
        std::size_t w = 0;
        while (w + 1 < c.wires.size() && !out(c.wires[w]))
            ++w;
        WireBody& b = *c.wires[w];
        const NewtonReport report =
            solve_equilibrium(b.wire, b.walls, start[w], anchors[w], options, *b.work);
        // Its factor is where the weakest mode is searched for.
        c.base = c.system = BlockSkyline{};
        return report;
    }
    const NewtonReport report = solve_together(c, start, nested, anchors, options);
    for (WireBody* b : c.wires)
        b->work->predicted.clear();
    return report;
}

void solve_last_system(const Coaxial& c, std::vector<std::vector<Node6>>& x)
{
    if (c.system.size() == 0) {
        for (std::size_t w = 0; w < c.wires.size(); ++w)
            if (c.wires[w]->wire.outside()) c.wires[w]->work->system.solve(x[w]);
        return;
    }
    std::vector<Node6> common(c.right.size());
    for (std::size_t w = 0; w < c.wires.size(); ++w)
        for (std::size_t i = 0; i < x[w].size(); ++i)
            if (c.slot[w][i] >= 0) common[std::size_t(c.slot[w][i])] = x[w][i];
    c.system.solve(common);
    for (std::size_t w = 0; w < c.wires.size(); ++w)
        if (c.wires[w]->wire.outside()) gather(c, common, w, x[w]);
}

double coaxial_friction_work(const Coaxial& c, const CoaxialStart& start)
{
    double sum = 0;
    for (std::size_t i = 0; i < c.nestings.size(); ++i) {
        const Nesting& n = c.nestings[i];
        if (!(n.friction > 0)) continue;
        auto b = start.touched[i].begin();
        const auto end = start.touched[i].end();
        const auto leave = [&] {
            sum -= 0.5 * b->tangential.dot(nested_slip(n, start.nestings[i], b->index, b->n));
            ++b;
        };
        for (const NestedContact& k : c.contacts[i]) {
            const Candidate& a = k.on_inner;
            if (!(a.normal > 0)) continue;
            while (b != end && b->index < a.index)
                leave();
            const double rate = -(a.tangential[0] * a.slip[0] + a.tangential[1] * a.slip[1]);
            const double force = std::hypot(a.tangential[0], a.tangential[1]);
            if (b != end && b->index == a.index) {
                const bool slips = force > 0 && force > (1 - 1e-6) * a.mu * a.normal;
                sum += 0.5 * rate * (slips ? b->bound / force : 1);
                ++b;
            }
            sum += 0.5 * rate;
        }
        while (b != end)
            leave();
    }
    return sum;
}

double coaxial_normal_work(const Coaxial& c, const CoaxialStart& start)
{
    double sum = 0;
    for (std::size_t i = 0; i < c.nestings.size(); ++i) {
        const Nesting& n = c.nestings[i];
        const auto half = [&](int index, double normal, const Vec3& along) {
            return 0.5 * normal * along.dot(nested_motion(n, start.nestings[i], index, along));
        };
        for (const NestedBefore& b : start.touched[i])
            sum += half(b.index, b.normal, b.n);
        for (const NestedContact& k : c.contacts[i])
            if (k.on_inner.normal > 0 && !k.across)
                sum += half(k.on_inner.index, k.on_inner.normal, k.on_inner.n);
    }
    return sum;
}

} // namespace amontons
