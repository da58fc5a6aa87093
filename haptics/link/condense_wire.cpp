#include "haptics/link/condense_wire.hpp"

#include "mesh/base/dense.hpp"
#include "solver/linear/block_refine.hpp"
#include "solver/step/contact_row.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

// A wire in balance: G(x, b, r) = 0 with x its unknowns, b the base's (insertion and twist of a
// sheath; place and turn of a clamp), r the reactions. With K = dG/dx, geometry under load
// included, B = dG/db and H = du/dx
//
//     dx = K^-1 (H^T dr - B db),
//     u  = g n + W dr + J dd,         W = H K^-1 H^T,   J = -H K^-1 B T,   db = T dd,
//     F  = F0 + J^T dr - S dd,        S = T^T (U_bb - B^T K^-1 B) T,
//
// d being the device's pose, and U_bb the second derivative of the energy by the base. The spring
// between hand and wire is part of the wire: of its sheath, or as its first element.
//
// A wire under compression is not stable without the contacts that hold it, and W of such a body
// is of no use to Gauss-Seidel. Contacts that are closed are therefore given springs, K + sum of
// rho h_n h_n^T: as long as such a contact stays closed its u_n is 0 and nothing has changed; one
// that opens is held back by rho over the way that it opens before the next operator comes. A wire
// that rolls along a wall opens one contact after another, and two stiff springs side by side would
// hold its tangent: so those are stiff that stay closed where the hand is moving, and the others so
// weak that it takes a tenth of the operator's way to bear their force.

namespace amontons {
namespace {

constexpr int kRefinements = 1; // elimination without pivoting
constexpr double kHold = 10; // rho over EI / l^3 of the wire: enough for Gauss-Seidel to converge
// A pull back to where the wire is, of its stiffest element's EI / l^3: the weakest that is enough.
constexpr double kLeastPull = 1e-6, kMostPull = 1e3, kNextPull = 3;
// Of the operator's way: over it the spring of a contact that opens comes to the force that it had.
// Over all of the way the tick's problems are close to singular, over a thirtieth they are off.
constexpr double kCompliance = 0.1;
// A wire that lies loose is moved far by little: a tenth of how far its largest reaction moves it.
constexpr double kLoose = 0.1;
constexpr double kUnseen = 1e-6; // of a shift along the rows of contacts: the least

using Nodes = std::vector<Node6>;

const Candidate* find(const std::vector<Candidate>& all, std::int64_t index)
{
    const auto c = std::ranges::find_if(all, [&](const Candidate& x) { return x.index == index; });
    return c == all.end() ? nullptr : &*c;
}

/// K += s h h^T on the two nodes of a contact.
void add_hold(BlockTridiagonal& K, const Candidate& c, const ContactRow& h, double s)
{
    const int e = c.place.element;
    const Column6 a = h.a.column * splat6(s), b = h.b.column * splat6(s);
    for (int j = 0; j < 6; ++j) {
        const Column6 ha = splat6(h.a.value[j]), hb = splat6(h.b.value[j]);
        K.diagonal(e).column[j] += a * ha;
        K.lower(e).column[j] += b * ha;
        K.upper(e).column[j] += a * hb;
        K.diagonal(e + 1).column[j] += b * hb;
    }
}

BlockTridiagonal copy_of(const BlockTridiagonal& K)
{
    BlockTridiagonal out(K.size());
    out.copy_from(K, K.first());
    return out;
}

/// K^-1 with iterative refinement, as elimination is without pivots.
struct Solver {
    const BlockTridiagonal& K;
    BlockTridiagonal factor;

    explicit Solver(const BlockTridiagonal& matrix) : K(matrix), factor(copy_of(matrix))
    {
        factor.factor(K.first());
    }
    Nodes operator()(const Nodes& right) const
    {
        Nodes x = right;
        factor.solve(x);
        for (int k = 0; k < kRefinements; ++k) {
            Nodes r = residual(K, right, x);
            factor.solve(r);
            for (auto i = static_cast<std::size_t>(K.first()); i < x.size(); ++i)
                x[i].column += r[i].column;
        }
        return x;
    }
};

/// Across the direction of friction, of a contact that slips.
ContactRow across_row(const Candidate& c)
{
    const double t = std::hypot(c.tangential[0], c.tangential[1]);
    const double c1 = t > 0 ? c.tangential[0] / t : 1, c2 = t > 0 ? c.tangential[1] / t : 0;
    ContactRow r;
    r.a.column = splat6(-c2) * c.ht[0].a.column + splat6(c1) * c.ht[1].a.column;
    r.b.column = splat6(-c2) * c.ht[0].b.column + splat6(c1) * c.ht[1].b.column;
    return r;
}

/// The base's part in the balance.
struct BasePart {
    std::vector<Nodes> B;                       // columns, of b
    Eigen::MatrixXd own;                        // U_bb
    Eigen::Matrix<double, Eigen::Dynamic, 6> T; // db = T dd
};

BasePart base_part(const Wire& wire)
{
    BasePart out;
    const auto f = static_cast<std::size_t>(wire.state.first);
    if (wire.sheath) {
        const Vec3 axis = wire.sheath->frame.col(0);
        const BaseStiffness k = base_stiffness(wire);
        out.own = k.own;
        for (int j = 0; j < 2; ++j) {
            Nodes& column = out.B.emplace_back(zero_nodes(wire.state.nodes.size()));
            column[f].value[0] = k.mixed(0, j);
            column[f].value[3] = k.mixed(1, j);
        }
        out.T.setZero(2, 6);
        out.T.row(0).head<3>() = axis.transpose();
        out.T.row(1).tail<3>() = axis.transpose();
        return out;
    }
    // The first element alone: its rows and columns are not those of a held node.
    BlockTridiagonal K(2);
    K.set_zero();
    Nodes gradient = zero_nodes(2);
    add_elements(0, 1, {wire.state.nodes[f], wire.state.nodes[f + 1]}, {wire.material.law[f]}, K,
                 gradient);
    out.own.resize(6, 6);
    for (int j = 0; j < 6; ++j) {
        Nodes& column = out.B.emplace_back(zero_nodes(wire.state.nodes.size()));
        column[f + 1].column = K.lower(0).column[j];
        for (int i = 0; i < 6; ++i)
            out.own(i, j) = K.diagonal(0)(i, j);
    }
    out.T.setZero(6, 6);
    out.T.topLeftCorner<3, 3>().setIdentity();
    out.T.bottomRightCorner<3, 3>() = rotation_matrix(wire.state.nodes[f].q).transpose();
    return out;
}

/// Stiffness of the base's unknowns, contacts left as they are: U_bb - B^T K^-1 B.
Eigen::MatrixXd condensed_stiffness(const BasePart& base, const std::vector<Nodes>& solved)
{
    Eigen::MatrixXd S = base.own;
    for (Eigen::Index j = 0; j < S.cols(); ++j)
        for (Eigen::Index i = 0; i < S.rows(); ++i) {
            const Nodes &B = base.B[static_cast<std::size_t>(i)],
                        &x = solved[static_cast<std::size_t>(j)];
            for (std::size_t k = 0; k < x.size(); ++k)
                for (int a = 0; a < 6; ++a)
                    S(i, j) -= B[k].value[a] * x[k].value[a];
        }
    return S;
}

/// The negative stiffness of the base, by which the wire pushes the hand on [N/m]; 0 if there is
/// none.
double pushes_on(const BlockTridiagonal& K, const BasePart& base)
{
    const Solver solve(K);
    std::vector<Nodes> solved;
    for (const Nodes& column : base.B)
        solved.push_back(solve(column));
    const Eigen::MatrixXd S = base.T.transpose() * condensed_stiffness(base, solved) * base.T;
    const Mat3 even = 0.5 * (S + S.transpose()).topLeftCorner<3, 3>();
    return std::max(0.0, -symmetric_eigenvalues(even)[0]);
}

/// Springs at closed contacts, so that the wire is stable without them: along the normals; if that
/// is not enough, across the way that it slips (friction's direction holds it there, on a ridge,
/// state). What falls all the same is pulled back as a whole, as if it were slowed down: stiffer
/// springs at contacts that are about to open would hold a wire that has released.
/// @param ahead  where the hand is moving, as far as that is known
/// @param way  that the operator is for [m]
/// @param most  [N/m] that it may push the hand on by
/// @return  false if it is not stable, or pushes more
bool hold(BlockTridiagonal& K, const Wire& wire, const std::vector<const Candidate*>& chosen,
          const std::vector<LookaheadSample>& ahead, double way, const BasePart& base, double most)
{
    for (const Candidate* c : chosen) {
        if (!(c->normal > 0)) continue;
        const bool stays =
            !ahead.empty() && std::ranges::all_of(ahead, [&](const LookaheadSample& a) {
                const Candidate* there = find(a.contact, c->index);
                return there && there->normal > 0;
            });
        const double hard = kHold * c->stiffness;
        add_hold(K, *c, c->hn, stays ? hard : std::min(c->normal / (kCompliance * way), hard));
    }
    const auto stable = [&] {
        BlockTridiagonal even = copy_of(K);
        symmetrise(even);
        if (even.factor(even.first()) != 0) return false;
        return std::isinf(most) || pushes_on(K, base) <= most;
    };
    if (stable()) return true;
    const BlockTridiagonal along_normals = copy_of(K);
    double before = 0;
    for (const double side : {1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0}) {
        for (const Candidate* c : chosen)
            if (c->normal > 0 && !c->sticks)
                add_hold(K, *c, across_row(*c), (side - before) * c->stiffness);
        before = side;
        if (stable()) return true;
    }
    K = copy_of(along_normals);
    const WireMaterial& m = wire.material;
    const double stiffest = *std::ranges::max_element(m.stiffness);
    const double shortest = std::ranges::min_element(m.law, {}, &ElementLaw::length)->length;
    const ViscousPull unit = make_viscous_pull(wire, stiffest / shortest);
    before = 0;
    for (double pull = kLeastPull; pull < kMostPull; pull *= kNextPull) {
        for (std::size_t i = 0; i < unit.linear.size(); ++i)
            for (int k = 0; k < 3; ++k) {
                Block6& own = K.diagonal(static_cast<int>(i));
                own(k, k) += (pull - before) * unit.linear[i];
                own(k + 3, k + 3) += (pull - before) * unit.angular[i][k];
            }
        before = pull;
        if (stable()) return true;
    }
    return false;
}

/// Those that count most first: with force, near.
std::vector<const Candidate*> choose(const std::vector<Candidate>& all, double reach,
                                     const std::vector<LookaheadPath>& ways,
                                     const ReductionOptions& options, Condensed& out)
{
    const auto closes = [](const std::vector<LookaheadSample>& ahead, std::int64_t index) {
        return std::ranges::any_of(ahead, [&](const LookaheadSample& a) {
            const Candidate* there = find(a.contact, index);
            return there && there->normal > 0;
        });
    };
    std::vector<const Candidate*> chosen;
    for (const Candidate& c : all) {
        const bool will = std::ranges::any_of(
            ways, [&](const LookaheadPath& w) { return closes(w.ahead, c.index); });
        if (c.normal > 0 || c.gap <= reach || will) chosen.push_back(&c);
    }
    const auto most = static_cast<std::size_t>(std::max(options.most_contacts, 0));
    if (chosen.size() <= most) return chosen;
    const auto rank = [](const Candidate* c) {
        return std::tuple(!(c->normal > 0), -c->normal, c->gap, c->index);
    };
    std::sort(chosen.begin(), chosen.end(),
              [&](const Candidate* a, const Candidate* b) { return rank(a) < rank(b); });
    out.left_out = static_cast<int>(chosen.size() - most);
    chosen.resize(most);
    std::sort(chosen.begin(), chosen.end(),
              [](const Candidate* a, const Candidate* b) { return a->index < b->index; });
    return chosen;
}

/// What q(d) and rest are beyond first order where `ahead` is.
/// @param way  displacement of the device to there
CondensedSample find_bend(const Condensed& condensed, const LookaheadSample& ahead, const Vec6& way)
{
    const std::size_t n = condensed.contact.size();
    Eigen::VectorXd r = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(3 * n));
    std::vector<const Candidate*> there(n, nullptr);
    for (std::size_t i = 0; i < n; ++i) {
        const Candidate* same = there[i] = find(ahead.contact, condensed.contact[i].id);
        if (!same) continue;
        r.segment<3>(static_cast<Eigen::Index>(3 * i)) << same->normal, same->tangential[0],
            same->tangential[1];
    }
    const Eigen::VectorXd given = condensed.W * r;
    CondensedSample sample;
    sample.at = ahead.share;
    sample.bend.assign(n, Vec3::Zero());
    Vec6 force = condensed.stiffness * way;
    const double most_force = n > 0 ? r.lpNorm<Eigen::Infinity>() : 0;
    double most = 0, moved = way.head<3>().norm();
    for (std::size_t i = 0; i < n; ++i) {
        const CandidateContact& c = condensed.contact[i];
        const auto row = static_cast<Eigen::Index>(3 * i);
        force -= c.J.transpose() * r.segment<3>(row);
        moved = std::max(moved, (c.J * way).norm());
        if (!there[i]) continue;
        const Vec3 u(there[i]->gap, there[i]->slip[0], there[i]->slip[1]);
        sample.bend[i] = u - given.segment<3>(row) - c.q - c.J * way;
        const Vec3 loose = kLoose * most_force * condensed.W.diagonal().segment<3>(row).cwiseAbs();
        most = std::max(most, (sample.bend[i].cwiseAbs() - loose).cwiseMax(0).norm());
    }
    sample.jump = moved > 0 ? most / moved : 0;
    sample.rest.force = ahead.force.force - condensed.rest.force + force.head<3>();
    sample.rest.torque = ahead.force.torque - condensed.rest.torque + force.tail<3>();
    return sample;
}

/// The differences of the samples to first order. A displacement is decomposed into parts along the
/// paths in the norm of the contacts' motion, which has one unit for translations and rotations.
void add_ways(Condensed& condensed, const std::vector<LookaheadPath>& ways)
{
    Mat6 motion = Mat6::Zero();
    for (const CandidateContact& c : condensed.contact)
        motion += c.J.transpose() * c.J;
    motion.topLeftCorner<3, 3>() +=
        kUnseen * (motion.topLeftCorner<3, 3>().trace() + 1) * Mat3::Identity();
    Eigen::Matrix<double, 6, Eigen::Dynamic> along(6, 0); // of two opposite ways the first
    const auto opposite = [&](const Vec6& way) {
        for (Eigen::Index j = 0; j < along.cols(); ++j)
            if (way == -along.col(j)) return j;
        return Eigen::Index{-1};
    };
    for (const LookaheadPath& w : ways) {
        if (opposite(w.way) >= 0) continue;
        along.conservativeResize(6, along.cols() + 1);
        along.rightCols<1>() = w.way;
    }
    const Eigen::MatrixXd parts =
        LdltFactor(along.transpose() * motion * along).solve_all(along.transpose() * motion);
    Eigen::Index next = 0;
    for (const LookaheadPath& w : ways) {
        const Eigen::Index other = opposite(w.way);
        CondensedPath& out = condensed.way.emplace_back();
        if (other < 0)
            out.ahead = parts.row(next++);
        else
            out.ahead = -parts.row(other);
        for (const LookaheadSample& there : w.ahead)
            out.samples.push_back(find_bend(condensed, there, there.share * w.way));
    }
    if (condensed.way.size() == 1) condensed.way[0].backwards = true;
}

} // namespace

Wrench force_on_hand(const Wire& wire)
{
    if (wire.sheath) {
        const BaseLoad load = base_load(wire);
        const Vec3 axis = wire.sheath->frame.col(0);
        return {-load.push * axis, -load.torque * axis};
    }
    const ElementLaw& law = wire.material.law[0];
    const BeamNode &a = wire.state.nodes[0], &b = wire.state.nodes[1];
    const std::array<double, 12> g =
        element_force(a, b, law.length, element_stress(law, element_strain(a, b, law.length)));
    return {-Vec3(g[0], g[1], g[2]), -rotation_matrix(a.q) * Vec3(g[3], g[4], g[5])};
}

Condensed condense_wire(WireBody& body, const ReductionOptions& options, const ViscousPull& anchor,
                        const std::vector<LookaheadPath>& ways)
{
    Condensed out;
    const Wire& wire = body.wire;
    out.reach = options.reach();
    out.W.resize(0, 0);
    out.rest = force_on_hand(wire);
    if (!wire.outside()) return out;

    // Slip counts from here.
    NewtonOptions newton;
    newton.reach = options.farthest();
    residual_of(wire, body.walls, mark_step_start(wire), anchor, newton, *body.work);
    const std::vector<const Candidate*> chosen =
        choose(body.work->candidates, out.reach, ways, options, out);
    // What is just stable is as good as singular: near a snap, once a contact opens, the hand would
    // be pushed on by more on the way that the operator is for than any contact holds.
    double pressed = 0;
    for (const Candidate* c : chosen)
        pressed = std::max(pressed, c->normal);
    const double most = pressed > 0 ? pressed / out.reach : std::numeric_limits<double>::infinity();
    const double way = out.reach * options.periods_ahead() / (options.latency + 1);
    const BasePart base = base_part(wire);
    BlockTridiagonal K = copy_of(body.work->base);
    const std::vector<LookaheadSample> nowhere;
    out.solvable = hold(K, wire, chosen, ways.empty() ? nowhere : ways[0].ahead, way, base, most);
    const Solver solve(K);

    const auto n = static_cast<Eigen::Index>(chosen.size());
    const auto row = [&](Eigen::Index k) -> const ContactRow& {
        const Candidate& c = *chosen[static_cast<std::size_t>(k / 3)];
        return k % 3 == 0 ? c.hn : c.ht[k % 3 - 1];
    };
    const auto rows_of = [&](const Nodes& x) {
        Eigen::VectorXd u(3 * n);
        for (Eigen::Index i = 0; i < 3 * n; ++i)
            u[i] = along(x, *chosen[static_cast<std::size_t>(i / 3)], row(i));
        return u;
    };
    out.W.resize(3 * n, 3 * n);
    for (Eigen::Index j = 0; j < 3 * n; ++j) {
        Nodes right = zero_nodes(wire.state.nodes.size());
        add_row(right, *chosen[static_cast<std::size_t>(j / 3)], row(j));
        out.W.col(j) = rows_of(solve(right));
    }
    Eigen::MatrixXd by_base(3 * n, base.own.cols());
    std::vector<Nodes> solved;
    for (const Nodes& column : base.B) {
        solved.push_back(solve(column));
        by_base.col(static_cast<Eigen::Index>(solved.size()) - 1) = -rows_of(solved.back());
    }
    out.stiffness = base.T.transpose() * condensed_stiffness(base, solved) * base.T;
    const Eigen::MatrixXd J = by_base * base.T;

    Eigen::VectorXd r0(3 * n), u0 = Eigen::VectorXd::Zero(3 * n);
    out.contact.resize(chosen.size());
    for (Eigen::Index i = 0; i < n; ++i) {
        const Candidate& k = *chosen[static_cast<std::size_t>(i)];
        CandidateContact& c = out.contact[static_cast<std::size_t>(i)];
        c = {};
        c.id = k.index;
        c.frame << k.n, k.t1, k.t2;
        c.mu = k.mu;
        c.r = {k.normal, k.tangential[0], k.tangential[1]};
        c.J = J.middleRows<3>(3 * i);
        r0.segment<3>(3 * i) = c.r;
        u0[3 * i] = k.gap;
    }
    const Eigen::VectorXd q = u0 - out.W * r0;
    const Vec6 pull = J.transpose() * r0;
    for (Eigen::Index i = 0; i < n; ++i)
        out.contact[static_cast<std::size_t>(i)].q = q.segment<3>(3 * i);
    out.rest.force -= pull.head<3>();
    out.rest.torque -= pull.tail<3>();
    if (!ways.empty()) add_ways(out, ways);
    return out;
}

LookaheadSample sample_ahead(WireBody& body, const StepStart& start, double reach)
{
    LookaheadSample out;
    out.force = force_on_hand(body.wire);
    NewtonOptions newton;
    newton.reach = reach;
    residual_of(body.wire, body.walls, start, ViscousPull{}, newton, *body.work);
    out.contact = body.work->candidates;
    out.state = body.wire.state;
    return out;
}

} // namespace amontons
