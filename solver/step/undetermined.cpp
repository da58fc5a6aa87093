#include "solver/step/undetermined.hpp"

#include "contact/reaction_range.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_rows.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numeric>

// Which reactions would the step have been accepted with as well? Those r = found + d of the
// contacts that are closed, r_n >= 0 and within Coulomb's cone, that leave
//
//     at rest, the balance of each rigid body:   |B^T r + load| <= eps (the forces that pass
//     through it), and where something is elastic, closed what is closed:   |u + W d + B a| <= eps
//     |W found|, in motion:                                 |u + W d| <= eps |W found|,
//
// with u the gaps and slips that the step has left, W of elastic bodies and springs, in motion of
// masses, too, and a the rigid motions that run along. Groups of bodies that touch each other are
// examined one by one: fixed and driven bodies separate them. Most pairs are found to be
// determined by these bounds alone; for others linear programs find the ends.

namespace amontons {
namespace {

constexpr double kWide = 0.01;           // of a pair's force: narrower intervals are not listed
constexpr double kAccuracies = 100;      // nor those of so many accuracies of the forces on a body
constexpr double kLeastAccuracy = 1e-12; // what places and forces are known to
constexpr double kRound = 1e-14;         // of the size of a body: places
constexpr double kLeastForce = 1e-6;     // of the largest in a group, that a body's is judged by
constexpr double kNoBound = 1e6;         // of the largest: beyond, there is no bound
constexpr double kOnCone = 1 - 1e-6;
constexpr Eigen::Index kMostJudged = 1000, kMostReactions = 6000; // of a group
constexpr std::int64_t kMostWork = 500'000'000;                   // multiplications, of a scene

/// Contacts and couplings with the bodies that they join, no others.
struct TouchingGroup {
    std::vector<int> items;
    std::vector<std::size_t> bodies;
};

class ForceExaminer {
public:
    ForceExaminer(const BodySystem& system, const BodyStepReport& step, const StepInput& input,
                  double tolerance)
        : system_(system)
        , step_(step)
        , input_(input)
        , accuracy_(std::max(tolerance, kLeastAccuracy))
        , count_(int(step.contacts.contact.size()))
    {
        for (const Coupling& c : system.couplings)
            joints_.push_back(coupling_row(system.refs, c));
    }
    UndeterminedForces examine();

private:
    Contacts contacts() const
    {
        return {system_.refs, system_.finder.pairs(), step_.contacts, joints_, system_.couplings};
    }
    Body& body(std::size_t b) const { return *system_.refs[b].body; }
    const BodyContact& contact(int c) const { return step_.contacts.contact[std::size_t(c)]; }
    const ContactPair& pair_of(int c) const
    {
        return system_.finder.pairs()[std::size_t(contact(c).pair)];
    }
    double friction(int c) const { return friction_of(system_.finder.pairs(), contact(c)); }
    std::vector<std::size_t> free_bodies(int item) const;
    Vec3 force(int item) const;
    bool takes_part(int item) const;
    double reach_of_slip(int c) const;
    std::vector<TouchingGroup> groups() const;
    bool is_elastic(const TouchingGroup& group) const;
    std::string names(const TouchingGroup& group) const;
    std::string name_of_pair(const ContactPair& pair, bool second) const;
    void examine(const TouchingGroup& group, UndeterminedForces& out);
    ReactionSet reactions_of(const TouchingGroup& group, const Rows& rows,
                             const Eigen::VectorXd& scale) const;
    Eigen::VectorXd found_of(const TouchingGroup& group, const Rows& rows) const;
    struct Balance {
        Eigen::MatrixXd B;    ///< reactions x motions
        double passes = 0;    ///< what the balance is relative to
        Eigen::VectorXd left; ///< of it by the reactions found
    };
    std::vector<Balance> balances_of(const TouchingGroup& group, const Rows& rows,
                                     const Eigen::VectorXd& r) const;
    Eigen::MatrixXd compliance_of(const TouchingGroup& group, const Rows& rows) const;
    Eigen::VectorXd values_of(const TouchingGroup& group, const Rows& rows) const;

    const BodySystem& system_;
    const BodyStepReport& step_;
    const StepInput& input_;
    double accuracy_;
    int count_; ///< of contacts; couplings follow
    std::vector<CouplingRow> joints_;
    std::vector<double> passing_; ///< sizes of the forces on each body, summed up [N]
    std::int64_t work_ = kMostWork;
};

/// Of an item's bodies those that forces move.
std::vector<std::size_t> ForceExaminer::free_bodies(int item) const
{
    std::vector<std::size_t> free;
    for (const Side& s : sides_of(contacts(), item))
        if (s.body >= 0 && body(std::size_t(s.body)).matrix().unknowns() > 0)
            free.push_back(std::size_t(s.body));
    return free;
}

/// On body a; of a coupling along its row [N].
Vec3 ForceExaminer::force(int item) const
{
    if (item < count_) return step_.force[std::size_t(item)];
    const auto k = std::size_t(item - count_);
    return k < step_.coupling_force.size() ? step_.coupling_force[k] : Vec3(Vec3::Zero());
}

/// May it have a force? A contact that is closed may; one that an impact has opened may not. In
/// motion a spring's force is that of its length.
bool ForceExaminer::takes_part(int item) const
{
    if (item >= count_)
        return !input_.dynamic || system_.couplings[std::size_t(item - count_)].softness == 0;
    if (!force(item).isZero(0)) return true;
    if (pair_of(item).restitution > 0) return false;
    double size = std::numeric_limits<double>::infinity();
    for (const std::size_t b : free_bodies(item))
        size = std::min(size, body(b).size());
    return contact(item).gap <= accuracy_ * size;
}

/// Slips below this may be none [m].
double ForceExaminer::reach_of_slip(int c) const
{
    double size = 0, speed = 0;
    for (const std::size_t b : free_bodies(c)) {
        size = std::max(size, body(b).size());
        speed = std::max(speed, body(b).speed());
    }
    return input_.dynamic ? accuracy_ * input_.h * speed + kRound * size : accuracy_ * size;
}

std::vector<TouchingGroup> ForceExaminer::groups() const
{
    std::vector<std::size_t> parent(system_.refs.size());
    std::iota(parent.begin(), parent.end(), std::size_t(0));
    const auto root = [&](std::size_t b) {
        while (parent[b] != b)
            b = parent[b] = parent[parent[b]];
        return b;
    };
    std::vector<std::pair<int, std::size_t>> items; // with one of their bodies
    for (int c = 0; c < count_ + int(system_.couplings.size()); ++c) {
        const std::vector<std::size_t> free = free_bodies(c);
        if (free.empty() || !takes_part(c)) continue;
        items.emplace_back(c, free.front());
        parent[root(free.back())] = root(free.front());
    }
    std::vector<TouchingGroup> all;
    std::vector<int> number(parent.size(), -1);
    for (const auto& [item, b] : items) {
        int& of_root = number[root(b)];
        if (of_root < 0) {
            of_root = int(all.size());
            all.emplace_back();
        }
        all[std::size_t(of_root)].items.push_back(item);
    }
    for (std::size_t b = 0; b < parent.size(); ++b)
        if (const int k = number[root(b)]; k >= 0) all[std::size_t(k)].bodies.push_back(b);
    return all;
}

bool ForceExaminer::is_elastic(const TouchingGroup& group) const
{
    return std::ranges::any_of(group.bodies,
                               [&](std::size_t b) { return !system_.refs[b].rigid; }) ||
           std::ranges::any_of(group.items, [&](int c) {
               return c >= count_ && system_.couplings[std::size_t(c - count_)].softness > 0;
           });
}

std::string ForceExaminer::names(const TouchingGroup& group) const
{
    constexpr std::size_t kMostNames = 3;
    std::string text;
    for (std::size_t i = 0; i < std::min(kMostNames, group.bodies.size()); ++i)
        text += (i == 0 ? "" : ", ") + system_.refs[group.bodies[i]].name;
    if (group.bodies.size() > kMostNames)
        text += fmt::format(" and {} more", group.bodies.size() - kMostNames);
    return text;
}

std::string ForceExaminer::name_of_pair(const ContactPair& pair, bool second) const
{
    if (!second) return system_.refs[std::size_t(pair.a)].name;
    return pair.b >= 0 ? system_.refs[std::size_t(pair.b)].name
                       : system_.obstacles[std::size_t(pair.obstacle)];
}

/// Reactions of the step, by rows [N].
Eigen::VectorXd ForceExaminer::found_of(const TouchingGroup& group, const Rows& rows) const
{
    Eigen::VectorXd r(rows.count);
    for (std::size_t i = 0; i < group.items.size(); ++i) {
        const int c = group.items[i];
        if (c >= count_) {
            const Vec3& along = joints_[std::size_t(c - count_)].direction;
            const double size = along.squaredNorm();
            r[rows.first[i]] =
                size > 0 ? step_.coupling_force[std::size_t(c - count_)].dot(along) / size : 0;
            continue;
        }
        const Vec3 own = contact(c).frame.transpose() * force(c);
        const int n = rows_of(system_.finder.pairs(), contact(c));
        r.segment(rows.first[i], n) = own.head(n);
    }
    return r;
}

/// @param scale  of each reaction [N]: the program's are r / scale
ReactionSet ForceExaminer::reactions_of(const TouchingGroup& group, const Rows& rows,
                                        const Eigen::VectorXd& scale) const
{
    const Eigen::Index n = rows.count;
    const Eigen::VectorXd r = found_of(group, rows);
    ReactionSet set;
    set.found = r.cwiseQuotient(scale);
    std::vector<char> judged(std::size_t(n), 1); // rows whose value is known

    // ---- Balances
    for (std::size_t i = 0; i < group.items.size(); ++i) {
        const int c = group.items[i], first = rows.first[i];
        ReactionSet::Contact k;
        k.first = first;
        if (c >= count_) {
            k.kind = ContactKind::bilateral;
            set.contact.push_back(k);
            continue;
        }
        k.mu = friction(c);
        k.kind = k.mu > 0 ? ContactKind::frictional : ContactKind::frictionless;
        if (k.mu > 0) {
            const Vec3 slip = contact(c).frame.transpose() * step_.slip[std::size_t(c)];
            const bool moves = slip.tail<2>().norm() > reach_of_slip(c);
            const double normal = r[first], tangential = r.segment<2>(first + 1).norm();
            k.slides = moves && tangential >= kOnCone * k.mu * normal;
            if (k.slides) {
                const Eigen::Vector2d along =
                    normal > 0 ? Eigen::Vector2d(r.segment<2>(first + 1) / normal)
                               : Eigen::Vector2d(-k.mu * slip.tail<2>().normalized());
                k.direction[0] = along[0];
                k.direction[1] = along[1];
                judged[std::size_t(first + 1)] = judged[std::size_t(first + 2)] = 0;
            }
        }
        set.contact.push_back(k);
    }

    const bool moves = is_elastic(group) && !input_.dynamic; // motions follow other reactions
    const std::vector<Balance> balances = balances_of(group, rows, r);
    Eigen::Index motions = 0;
    double largest = 0;
    for (const Balance& b : balances) {
        motions += b.B.cols();
        largest = std::max(largest, b.passes);
    }
    const bool all = input_.dynamic || moves;
    const auto closed = all ? std::accumulate(judged.begin(), judged.end(), Eigen::Index(0)) : 0;
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(motions + closed, n + (moves ? motions : 0));
    set.lower = set.upper = Eigen::VectorXd::Zero(motions + closed);
    Eigen::Index at = 0;

    // ---- Rows and bounds of the set
    const auto bounds = [&](double tolerance, double is) {
        // A state that was accepted is within the tolerance; where not, it is of another measure.
        if (!(std::abs(is) <= 2 * tolerance)) is = 0;
        set.lower[at] = std::min(0.0, -tolerance - is);
        set.upper[at] = std::max(0.0, tolerance - is);
    };
    for (const Balance& b : balances) {
        const double size = std::max(b.passes, kLeastForce * largest);
        K.block(at, 0, b.B.cols(), n) = b.B.transpose() * scale.asDiagonal() / size;
        for (Eigen::Index i = 0; i < b.B.cols(); ++i, ++at)
            bounds(accuracy_, b.left[i] / size);
    }
    if (!all) {
        set.K = K.sparseView(1, 0);
        return set;
    }

    // ---- Gaps and slips, with elastic bodies or in motion
    const Eigen::MatrixXd W = compliance_of(group, rows);
    double size = 0;
    for (const std::size_t b : group.bodies)
        size = std::max(size, body(b).size());
    const double lever = input_.dynamic ? input_.h * input_.rule.end : 1;
    const double rounding = kRound * size / lever;
    const double moved = std::max((W * r).cwiseAbs().maxCoeff(), rounding);
    const Eigen::VectorXd values = values_of(group, rows) / (lever * moved);
    for (Eigen::Index row = 0; row < n; ++row) {
        if (!judged[std::size_t(row)]) continue;
        K.row(at).head(n) = W.row(row).cwiseProduct(scale.transpose()) / moved;
        Eigen::Index mode = n;
        for (const Balance& b : balances) {
            if (moves) K.block(at, mode, 1, b.B.cols()) = b.B.row(row);
            mode += b.B.cols();
        }
        bounds(std::max(accuracy_, rounding / moved), values[row]);
        ++at;
    }
    set.K = K.sparseView(1, 0);
    return set;
}

/// Of rigid bodies and free solids at rest.
std::vector<ForceExaminer::Balance> ForceExaminer::balances_of(const TouchingGroup& group,
                                                               const Rows& rows,
                                                               const Eigen::VectorXd& r) const
{
    std::vector<Balance> all;
    for (const std::size_t b : group.bodies) {
        const Eigen::MatrixXd& modes = body(b).matrix().modes();
        if (modes.cols() == 0) continue;
        const Eigen::MatrixXd seen = rows.columns[b].transpose() * modes;
        Balance balance{Eigen::MatrixXd::Zero(rows.count, modes.cols())};
        for (std::size_t i = 0; i < rows.row[b].size(); ++i)
            balance.B.row(rows.row[b][i]) += seen.row(Eigen::Index(i));
        balance.passes = (balance.B.cwiseAbs().transpose() * r.cwiseAbs()).norm();
        balance.left = Eigen::VectorXd::Zero(modes.cols());
        if (system_.refs[b].rigid)
            balance.left = body(b).matrix().mode_load() + balance.B.transpose() * r;
        all.push_back(std::move(balance));
    }
    return all;
}

/// W of places by forces, in motion of velocities by forces over the step.
Eigen::MatrixXd ForceExaminer::compliance_of(const TouchingGroup& group, const Rows& rows) const
{
    Eigen::MatrixXd W = Eigen::MatrixXd::Zero(rows.count, rows.count);
    for (const std::size_t b : group.bodies) {
        if (rows.row[b].empty() || (system_.refs[b].rigid && !input_.dynamic)) continue;
        Eigen::MatrixXd own;
        body(b).matrix().compliance(rows.columns[b], own);
        for (Eigen::Index j = 0; j < own.cols(); ++j)
            for (Eigen::Index i = 0; i < own.rows(); ++i)
                W(rows.row[b][std::size_t(i)], rows.row[b][std::size_t(j)]) += own(i, j);
    }
    if (input_.dynamic) W *= input_.h;
    for (std::size_t i = 0; i < group.items.size(); ++i)
        if (const int c = group.items[i]; c >= count_)
            W(rows.first[i], rows.first[i]) += system_.couplings[std::size_t(c - count_)].softness;
    return W;
}

/// Gaps where the step ended, and slips, of contacts that carry a force; else 0 [m].
Eigen::VectorXd ForceExaminer::values_of(const TouchingGroup& group, const Rows& rows) const
{
    Eigen::VectorXd u = Eigen::VectorXd::Zero(rows.count);
    for (std::size_t i = 0; i < group.items.size(); ++i) {
        const int c = group.items[i];
        if (c >= count_ || force(c).isZero(0) || pair_of(c).restitution > 0) continue;
        const Vec3 slip = contact(c).frame.transpose() * step_.slip[std::size_t(c)];
        const Vec3 own(contact(c).gap, slip.y(), slip.z());
        const int n = rows_of(system_.finder.pairs(), contact(c));
        u.segment(rows.first[i], n) = own.head(n);
    }
    return u;
}

void ForceExaminer::examine(const TouchingGroup& group, UndeterminedForces& out)
{
    // ---- Scale and size of the group
    double largest = 0;
    for (const std::size_t b : group.bodies) {
        largest = std::max(largest, passing_[b]);
        const BodyRef& ref = system_.refs[b];
        const char* why = ref.rod                               ? "rods"
                          : ref.solid && ref.solid->iterative() ? "solids without a factor"
                                                                : nullptr;
        if (!why) continue;
        out.not_examined.push_back(names(group) + ": " + why);
        return;
    }
    if (largest == 0) return;
    Rows rows;
    rows.chosen = group.items;
    make_rows(contacts(), rows);
    Eigen::Index judged = input_.dynamic || is_elastic(group) ? rows.count : 0;
    for (const std::size_t b : group.bodies)
        judged += body(b).matrix().modes().cols();
    if (judged > kMostJudged || rows.count > kMostReactions) {
        out.not_examined.push_back(fmt::format(
            "{}: {} balances and closed contacts with {} reactions; up to {} and {} are "
            "examined",
            names(group), judged, rows.count, kMostJudged, kMostReactions));
        return;
    }

    // ---- The set of reactions
    Eigen::VectorXd scale(rows.count);
    std::map<int, std::vector<std::size_t>> of_pair; // items
    for (std::size_t i = 0; i < group.items.size(); ++i) {
        double least = std::numeric_limits<double>::infinity();
        for (const std::size_t b : free_bodies(group.items[i]))
            least = std::min(least, passing_[b]);
        const int end = i + 1 < rows.first.size() ? rows.first[i + 1] : rows.count;
        scale.segment(rows.first[i], end - rows.first[i])
            .setConstant(std::max(least, kLeastForce * largest));
        if (const int c = group.items[i]; c < count_) of_pair[contact(c).pair].push_back(i);
    }
    const ReactionSet set = reactions_of(group, rows, scale);
    ReactionRange range(set, kNoBound * largest);
    int missed = 0;

    // ---- Interval of each pair
    for (const auto& [pair, items] : of_pair) {
        const ContactPair& p = system_.finder.pairs()[std::size_t(pair)];
        Eigen::VectorXd normal = Eigen::VectorXd::Zero(rows.count);
        Vec3 mean = Vec3::Zero();
        double passing = std::numeric_limits<double>::infinity();
        for (const std::size_t i : items) {
            const int c = group.items[i];
            normal[rows.first[i]] = scale[rows.first[i]];
            mean += contact(c).frame.col(0);
            for (const std::size_t b : free_bodies(c))
                passing = std::min(passing, passing_[b]);
        }
        const double found = normal.dot(set.found);
        const double wide = std::max(kWide * found, kAccuracies * accuracy_ * passing);
        if (!(wide > 0)) continue;
        UndeterminedForce u{
            name_of_pair(p, false), name_of_pair(p, true), false, false, found, found};
        bool certain = true;
        if (!(range.widest(normal) <= wide)) {
            const ReactionInterval i = range.interval(normal, work_);
            u.normal = i.max - i.min > wide;
            u.min = std::max(0.0, i.min);
            u.max = i.max;
            certain = i.certain;
        }
        if (p.friction > 0) { // of the sum of the tangential forces, along two axes
            const Mat3 axes =
                contact_frame(mean.isZero(0) ? Vec3(Vec3::UnitZ()) : mean.normalized());
            for (int axis = 1; axis < 3 && !u.tangential; ++axis) {
                Eigen::VectorXd tangential = Eigen::VectorXd::Zero(rows.count);
                for (const std::size_t i : items)
                    for (int k = 1; k < 3; ++k)
                        tangential[rows.first[i] + k] =
                            scale[rows.first[i] + k] *
                            contact(group.items[i]).frame.col(k).dot(axes.col(axis));
                if (range.widest(tangential) <= wide) continue;
                const ReactionInterval i = range.interval(tangential, work_, wide);
                u.tangential = i.max - i.min > wide;
                certain = certain && (i.certain || u.tangential);
            }
        }
        missed += !certain;
        if (u.normal || u.tangential) out.pairs.push_back(std::move(u));
    }
    if (missed > 0)
        out.not_examined.push_back(fmt::format(
            "{}: the work allowed did not suffice for {} of {} pairs, whose intervals may be wider",
            names(group), missed, of_pair.size()));
}

UndeterminedForces ForceExaminer::examine()
{
    passing_.assign(system_.refs.size(), 0);
    for (int c = 0; c < count_ + int(system_.couplings.size()); ++c)
        for (const std::size_t b : free_bodies(c))
            passing_[b] += force(c).norm();
    UndeterminedForces out;
    for (const TouchingGroup& g : groups())
        examine(g, out);
    return out;
}

} // namespace

UndeterminedForces undetermined_forces(const BodySystem& system, const BodyStepReport& step,
                                       const StepInput& input, double tolerance)
{
    return ForceExaminer(system, step, input, tolerance).examine();
}

} // namespace amontons
