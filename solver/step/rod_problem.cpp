#include "solver/step/rod_problem.hpp"

#include "solver/step/pivot_method.hpp"

#include <Eigen/LU>
#include <algorithm>

namespace amontons {
namespace {

using Vec24 = Eigen::Matrix<double, 24, 1>;
using Mat24 = Eigen::Matrix<double, 24, 24>;

// Of a node's stiffness along a contact's row (of EA / l along the rod): with kRhoNormal 100 times
// that. Multipliers that are renewed in one iterate bring the rest.
constexpr double kHeld = 0.01;
constexpr int kMultipliers = 5;
constexpr double kHardly = 1e-2; // of the freer tangent of a contact, squared

/// Rods and their contacts for pivoting::solve.
struct RodSystem : FourNodeRows<RodContact> {
    RodProblem& p;

    explicit RodSystem(RodProblem& problem) : p(problem) {}

    static void add_product(NodeMatrix& K, Place at, const Row& f, const Row& h, double s, int)
    {
        for (int a = 0; a < at.nodes; ++a)
            for (int b = 0; b < at.nodes; ++b)
                K.add(at.slot[std::size_t(a)], at.slot[std::size_t(b)], f.node[a].column, h.node[b],
                      s);
        for (int a = 0; a < at.nodes; ++a)
            for (int i = 0; i < 6; ++i)
                if (f.node[a].value[i] != h.node[a].value[i]) return K.set_unsymmetric();
    }

    std::size_t contacts() const { return p.contact.size(); }
    const Candidate& contact(std::size_t k) const { return p.contact[k].law; }
    Place place(std::size_t k) const { return p.contact[k]; }
    const Row& normal(std::size_t k) const { return p.contact[k].normal; }
    const Row& tangent(std::size_t k, int i) const { return p.contact[k].tangent[i]; }
    int lowest(std::size_t) const { return 0; }
    int highest(std::size_t) const { return last(); }
    bool follows(std::size_t k) const { return p.contact[k].follows; }
    // Of neighbours that all let go one does in a trial: as many trials as the longest line needs.
    int most_trials() const
    {
        return pivoting::kTrials + pivoting::Patience::kApart + (p.hasty ? 0 : p.most_on_one);
    }
    int shift_levels() const { return p.hasty ? 1 : pivoting::kShiftLevels; }
    std::size_t bodies() const { return p.rods.size(); }
    std::array<int, 2> bodies_of(std::size_t k) const { return p.contact[k].on; }
    int first() const { return 0; }
    int last() const { return p.base.size() - 1; }
    std::vector<Node6>& gradient() { return p.gradient; }
    std::vector<Node6>& right() { return p.right; }
    std::vector<Node6>& increment() { return p.increment; }
    std::vector<Trial>& trial() { return p.trial; }
    NodeMatrix& matrix() { return p.system; }
    double& kept_shift() { return p.shift; }
    double softest() const { return p.softest; }
    void start_matrix(double shift, int)
    {
        p.system.copy_values(p.base);
        if (!(shift > 0)) return;
        for (int i = 0; i <= last(); ++i) {
            const double h = p.length[std::size_t(i)];
            Block6& d = p.system.block(i, i);
            for (int k = 0; k < 3; ++k) {
                d(k, k) += shift;
                d(k + 3, k + 3) += shift * h * h;
            }
        }
    }
};

/// Of a contact's geometry: -r Hess(gap) and -(dJ/dy)^T t, on the nodes of a and then of b. Places
/// where the distance is least move along their curves as these move.
Mat24 geometry(const RodBody& a, const RodBody* b, const RodContactState& s, const Vec3& force)
{
    const BodyContact& c = *s.contact;
    const Vec3 n = c.frame.col(0);
    const double r = n.dot(force);
    const RodBody::Line p = a.line(s.a);
    RodBody::Line q;
    Mat3 S = c.curvature;
    Eigen::Matrix<double, 3, 24> J = Eigen::Matrix<double, 3, 24>::Zero();
    J.leftCols<12>() = p.J;
    Mat24 k = Mat24::Zero();
    k.topLeftCorner<12, 12>() += a.force_stiffness(s.a, force);
    if (b) {
        q = b->line(s.b);
        J.rightCols<12>() = -q.J;
        S = (Mat3::Identity() - n * n.transpose()) / (p.x - q.x).norm();
        k.bottomRightCorner<12, 12>() += b->force_stiffness(s.b, -force);
    }
    k -= r * (J.transpose() * S * J);
    const int slides = (c.slides_a ? 1 : 0) + (c.slides_b ? 1 : 0);
    if (slides == 0) return k;
    Eigen::Matrix<double, 24, 2> mixed = Eigen::Matrix<double, 24, 2>::Zero();
    Eigen::Matrix2d own = Eigen::Matrix2d::Identity();
    if (c.slides_a) {
        mixed.col(0) = J.transpose() * (S * p.slope);
        mixed.col(0).head<12>() += p.J_slope.transpose() * n;
        own(0, 0) = p.slope.dot(S * p.slope) + n.dot(p.bend);
    }
    if (c.slides_b) {
        mixed.col(1) = -J.transpose() * (S * q.slope);
        mixed.col(1).tail<12>() -= q.J_slope.transpose() * n;
        own(1, 1) = q.slope.dot(S * q.slope) - n.dot(q.bend);
    }
    if (slides == 2) own(0, 1) = own(1, 0) = -p.slope.dot(S * q.slope);
    if (own(0, 0) > 0 && own.determinant() > 1e-6 * own(0, 0) * own(1, 1))
        k += r * (mixed * own.inverse() * mixed.transpose());
    return k;
}

/// Whose nodes a contact's rows stand on, and their projectors.
void place_contact(const RodProblem& w, const RodContactState& s, RodContact& c)
{
    c.nodes = 0;
    const auto add = [&](int body, const BodyPlace& at) {
        if (body < 0 || !w.rods[std::size_t(body)]) return;
        const RodBody::Line line = w.rods[std::size_t(body)]->line(at);
        for (const int node : line.node)
            c.slot[std::size_t(c.nodes++)] = w.first[std::size_t(body)] + node;
        c.on[body == s.contact->a ? 0 : 1] = body;
    };
    add(s.contact->a, s.a);
    add(s.contact->b, s.b);
}

struct Projectors {
    std::vector<Mat6> free;     // of each slot
    Eigen::VectorXd prescribed; // of all slots
};

FourNodeRow row_of(const RodProblem& w, const RodContactState& s, const RodContact& c, int axis,
                   const Projectors& held, double& moved)
{
    FourNodeRow row{};
    const Vec3 direction = s.contact->frame.col(axis);
    int k = 0;
    const auto add = [&](int body, const BodyPlace& at, double sign) {
        if (body < 0 || !w.rods[std::size_t(body)]) return;
        const Vec12 v = sign * w.rods[std::size_t(body)]->row(at, direction);
        for (int i = 0; i < 2; ++i, ++k) {
            const int slot = c.slot[std::size_t(k)];
            const Vec6 own = v.segment<6>(6 * i);
            moved += own.dot(held.prescribed.segment<6>(6 * slot));
            Eigen::Map<Vec6>(row.node[k].value) = held.free[std::size_t(slot)] * own;
        }
    };
    add(s.contact->a, s.a, 1);
    add(s.contact->b, s.b, -1);
    return row;
}

/// How far a unit motion of the nodes moves a row, squared.
double size_of(const RodContact& c, const FourNodeRow& row)
{
    double size = 0;
    for (int a = 0; a < c.nodes; ++a)
        size += Eigen::Map<const Vec3>(row.node[a].value).squaredNorm();
    return size;
}

/// Of the nodes alone in a row's direction [N/m].
double stiffness_along(const RodProblem& w, const RodContact& c, const FourNodeRow& row)
{
    double energy = 0;
    const double size = size_of(c, row);
    for (int a = 0; a < c.nodes; ++a) {
        const int slot = c.slot[std::size_t(a)];
        const Vec3 v = Eigen::Map<const Vec3>(row.node[a].value);
        Mat3 own;
        for (int j = 0; j < 3; ++j)
            for (int i = 0; i < 3; ++i)
                own(i, j) = w.base.block(slot, slot)(i, j);
        energy += v.dot(own * v);
    }
    constexpr double kNone = 1e-6; // of a row on nodes that are held
    return size > kNone ? std::max(energy, 0.0) / (size * size) : 0;
}

void add_geometry(RodProblem& w, const RodContactState& s, const RodContact& c,
                  const Projectors& held)
{
    if (s.force.isZero(0)) return;
    const RodBody& a = *w.rods[std::size_t(s.contact->a)];
    const RodBody* b = s.contact->b < 0 ? nullptr : w.rods[std::size_t(s.contact->b)];
    const Mat24 k = geometry(a, b, s, s.contact->frame * s.force);
    for (int i = 0; i < c.nodes; ++i)
        for (int j = 0; j < c.nodes; ++j) {
            const int row = c.slot[std::size_t(i)], col = c.slot[std::size_t(j)];
            add_to_block(w.base.block(row, col), held.free[std::size_t(row)] *
                                                     k.block<6, 6>(6 * i, 6 * j) *
                                                     held.free[std::size_t(col)]);
        }
}

/// The rods' own matrices and right sides.
void take_rods(RodProblem& w, const std::vector<RodContact>& contact, Projectors& held)
{
    int nodes = 0;
    std::vector<std::array<int, 2>> coupled;
    for (std::size_t b = 0; b < w.rods.size(); ++b) {
        if (!w.rods[b]) continue;
        const int n = w.rods[b]->unknowns() / 6;
        for (int i = 0; i + 1 < n; ++i)
            coupled.push_back({nodes + i, nodes + i + 1});
        if (w.rods[b]->model().closed) coupled.push_back({nodes, nodes + n - 1});
        nodes += n;
    }
    for (const RodContact& c : contact)
        for (int i = 0; i < c.nodes; ++i)
            for (int j = 0; j < i; ++j)
                coupled.push_back({c.slot[std::size_t(i)], c.slot[std::size_t(j)]});
    w.base.set_pattern(nodes, coupled);
    w.system.set_pattern(nodes, std::move(coupled));
    for (auto* v : {&w.gradient, &w.right, &w.increment})
        v->assign(std::size_t(nodes), Node6{});
    held.free.clear();
    held.prescribed.resize(6 * nodes);
    w.stiffness.assign(std::size_t(nodes), 0);
    w.length.assign(std::size_t(nodes), 0);
    w.softest = std::numeric_limits<double>::infinity();
    int first = 0;
    for (const RodBody* rod : w.rods) {
        if (!rod) continue;
        const RodMatrix& K = rod->matrix();
        const int n = rod->unknowns() / 6;
        for (int i = 0; i < n; ++i) {
            w.base.block(first + i, first + i) = K.chain.diagonal(i);
            if (i + 1 < n) {
                w.base.block(first + i, first + i + 1) = K.chain.upper(i);
                w.base.block(first + i + 1, first + i) = K.chain.lower(i);
            }
            const int e = std::min(i, rod->model().element_count() - 1);
            w.length[std::size_t(first + i)] = rod->element_length(e);
            w.stiffness[std::size_t(first + i)] = rod->element_stiffness(e);
            w.softest = std::min(w.softest, rod->element_stiffness(e));
            Eigen::Map<Vec6>(w.gradient[std::size_t(first + i)].value) =
                -rod->right().segment<6>(6 * i);
        }
        if (rod->model().closed) {
            add_to_block(w.base.block(first, first + n - 1), dense(K.first_with_last));
            add_to_block(w.base.block(first + n - 1, first), dense(K.last_with_first));
        }
        held.prescribed.segment(6 * first, 6 * n) = rod->prescribed();
        const std::vector<Mat6> free = rod->free_of_nodes();
        held.free.insert(held.free.end(), free.begin(), free.end());
        first += n;
    }
}

/// What is left of gaps and slips that ought to be closed [m].
double left_open(const RodProblem& w)
{
    double most = 0;
    for (std::size_t k = 0; k < w.contact.size(); ++k) {
        const Trial& t = w.trial[k];
        if (t.status != 0) most = std::max(most, std::abs(t.gap));
        if (t.status == 1 && w.contact[k].law.mu > 0) most = std::max(most, std::hypot(t.v1, t.v2));
    }
    return most;
}

double length_scale(const RodProblem& w)
{
    double least = std::numeric_limits<double>::infinity();
    for (const RodBody* rod : w.rods)
        for (int e = 0; rod && e < rod->model().element_count(); ++e)
            least = std::min(least, rod->element_radius(e));
    return least;
}

/// The forces of the last trials as those that are known.
void renew_multipliers(RodProblem& w)
{
    for (std::size_t k = 0; k < w.contact.size(); ++k) {
        RodContact& c = w.contact[k];
        const Trial& t = w.trial[k];
        Candidate& law = c.law;
        const double r[3] = {t.normal, law.mu > 0 ? t.t1 : 0, law.mu > 0 ? t.t2 : 0};
        if (law.normal > 0) {
            RodSystem::add_force(w.gradient, c, c.normal, law.normal);
            for (int i = 0; i < 2; ++i)
                RodSystem::add_force(w.gradient, c, c.tangent[i], law.tangential[i]);
        }
        law.normal = std::max(r[0], 0.0);
        for (int i = 0; i < 2; ++i)
            law.tangential[i] = r[0] > 0 ? r[i + 1] : 0;
        law.sticks = t.status == 1;
        if (law.normal > 0) {
            RodSystem::add_force(w.gradient, c, c.normal, -law.normal);
            for (int i = 0; i < 2; ++i)
                RodSystem::add_force(w.gradient, c, c.tangent[i], -law.tangential[i]);
        }
    }
}

} // namespace

RodAnswer solve_rod_contacts(RodProblem& w, const std::vector<RodContactState>& contacts,
                             double tolerance)
{
    w.contact.assign(contacts.size(), RodContact());
    w.first.assign(w.rods.size(), 0);
    for (std::size_t b = 1; b < w.rods.size(); ++b)
        w.first[b] = w.first[b - 1] + (w.rods[b - 1] ? w.rods[b - 1]->unknowns() / 6 : 0);
    for (std::size_t k = 0; k < contacts.size(); ++k)
        place_contact(w, contacts[k], w.contact[k]);
    std::vector<int> on_rod(w.rods.size(), 0);
    for (const RodContact& c : w.contact)
        for (const int rod : c.on)
            if (rod >= 0) ++on_rod[std::size_t(rod)];
    w.most_on_one = on_rod.empty() ? 0 : *std::ranges::max_element(on_rod);
    Projectors held;
    take_rods(w, w.contact, held);

    Residual scale;
    for (const RodBody* rod : w.rods)
        if (rod) scale.scale = std::max(scale.scale, rod->force_scale());
    for (std::size_t k = 0; k < contacts.size(); ++k) {
        const RodContactState& s = contacts[k];
        RodContact& c = w.contact[k];
        Vec3 moved = Vec3::Zero();
        c.normal = row_of(w, s, c, 0, held, moved[0]);
        for (int i = 0; i < 2 && s.friction > 0; ++i)
            c.tangent[i] = row_of(w, s, c, i + 1, held, moved[i + 1]);
        Candidate& law = c.law;
        law.gap = s.value[0] + moved[0];
        for (int i = 0; i < 2; ++i)
            law.slip[i] = s.friction > 0 ? s.value[i + 1] + moved[i + 1] : 0;
        law.mu = s.friction;
        law.normal = std::max(s.force[0], 0.0);
        for (int i = 0; i < 2; ++i)
            law.tangential[i] = s.friction > 0 ? s.force[i + 1] : 0;
        law.sticks = s.sticks;
        law.stiffness = std::numeric_limits<double>::infinity();
        for (int i = 0; i < c.nodes; ++i)
            law.stiffness =
                std::min(law.stiffness, w.stiffness[std::size_t(c.slot[std::size_t(i)])]);
        law.held[0] = kHeld * stiffness_along(w, c, c.normal);
        // A tangent along which hardly anything can move (rods held in planes that are nearly one)
        // is held by the other's weight: its own would be that over the square of next to nothing.
        const double freest =
            s.friction > 0 ? std::max(size_of(c, c.tangent[0]), size_of(c, c.tangent[1])) : 0;
        for (int i = 0; i < 2 && s.friction > 0; ++i)
            if (size_of(c, c.tangent[i]) > kHardly * freest)
                law.held[1] = std::max(law.held[1], kHeld * stiffness_along(w, c, c.tangent[i]));
        scale.scale = std::max(scale.scale, law.normal);
        if (k > 0) {
            const RodContact& before = w.contact[k - 1];
            const int way = c.slot[0] - before.slot[0];
            c.follows = contacts[k - 1].contact->pair == s.contact->pair && (way == 0 || way == 1);
        }
        add_geometry(w, s, c, held);
        if (law.normal > 0) { // present forces are in the gradient: see set_right_side
            RodSystem::add_force(w.gradient, c, c.normal, -law.normal);
            for (int i = 0; i < 2 && s.friction > 0; ++i)
                RodSystem::add_force(w.gradient, c, c.tangent[i], -law.tangential[i]);
        }
    }

    w.system.guarded = w.guarded;
    NewtonOptions options;
    options.tolerance = tolerance;
    NewtonReport report;
    RodSystem system(w);
    double shift = 0;
    RodAnswer out;
    for (int k = 0; k < kMultipliers; ++k) {
        out.fits = pivoting::solve(system, scale, options, shift, report);
        if (shift > 0 || k + 1 == kMultipliers) break;
        if (left_open(w) <= tolerance * length_scale(w)) break;
        renew_multipliers(w);
    }

    out.factorisations = report.factorisations;
    out.shifted = shift > 0;
    out.motion.resize(w.rods.size());
    for (std::size_t b = 0; b < w.rods.size(); ++b) {
        if (!w.rods[b]) {
            out.motion[b] = Eigen::VectorXd();
            continue;
        }
        const int n = w.rods[b]->unknowns() / 6;
        Eigen::VectorXd& y = out.motion[b];
        y = w.rods[b]->prescribed();
        for (int i = 0; i < n; ++i) {
            const std::size_t slot = std::size_t(w.first[b] + i);
            y.segment<6>(6 * i) +=
                held.free[slot] * Eigen::Map<const Vec6>(w.increment[slot].value);
        }
    }
    for (std::size_t k = 0; k < contacts.size(); ++k) {
        const Trial& t = w.trial[k];
        const double normal = std::max(t.normal, 0.0), bound = contacts[k].friction * normal,
                     size = std::hypot(t.t1, t.t2);
        const double share = size > bound ? bound / size : 1;
        out.force.push_back({normal, share * t.t1, share * t.t2});
        out.value.push_back({t.gap, t.v1, t.v2});
        out.sticks.push_back(t.status == 1);
    }
    return out;
}

} // namespace amontons
