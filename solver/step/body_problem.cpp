#include "solver/step/body_stepper.hpp"

#include "contact/solvers/solve.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/body/solid_body.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <functional>

namespace amontons {
namespace {

// The part of a body's rigid modes in W is this many times its elastic part: the modes are found by
// the method of multipliers, whose error falls by about this factor each time. As many digits of
// the elastic part are lost: where the tolerance requires them it is less.
constexpr double kModeWeight = 1e2, kFineModeWeight = 10, kFine = 1e-10;
constexpr double kStressedModeWeight = 10; // of the stiffness of contacts against the modes
// Newton's method on a stored W gains digits at negligible cost: what linear solids are solved
// beyond the tolerance by, so that uniform pressure comes out uniform.
constexpr double kFiner = 1e-4;
constexpr int kFinerIterations = 12;
constexpr int kFinerRows = 1000; // of a dense W: the cost of a larger factor is not negligible
constexpr int kNewtonSteps = 60; // and sweeps before them
constexpr int kManyRows = 1500;  // of many bodies: factors of their W fill up
constexpr int kMostRescales = 3;
constexpr int kMostGrowths = 3; // of a mode's scale, before it takes that of a body alone
constexpr double kScaleGrows = 30;
constexpr int kMostGrowth = 40;   // of the set of candidates, in one iteration
constexpr double kAstray = 1e3;   // sizes of a body that contact does not move it
constexpr double kUnfelt = 1e-10; // share of a mode's size that is rounding of normals

/// Gives the map these entries and no others; what is in it already stays where it is in memory.
void replace_entries(std::vector<std::pair<BodySystem::Key, Vec3>> entries,
                     std::map<BodySystem::Key, Vec3>& map)
{
    const auto by_key = [](const auto& a, const auto& b) { return a.first < b.first; };
    if (!std::ranges::is_sorted(entries, by_key)) std::ranges::stable_sort(entries, by_key);
    auto at = map.begin();
    for (const auto& [key, value] : entries) {
        while (at != map.end() && at->first < key)
            at = map.erase(at);
        if (at == map.end() || key < at->first) at = map.emplace_hint(at, key, value);
        at->second = value;
        ++at;
    }
    map.erase(at, map.end());
}

} // namespace

Eigen::VectorXd BodyStepper::values(const Rows& rows) const
{
    Eigen::VectorXd u(rows.count);
    for (std::size_t i = 0; i < rows.chosen.size(); ++i) {
        const int end = i + 1 < rows.first.size() ? rows.first[i + 1] : rows.count;
        for (int row = rows.first[i]; row < end; ++row)
            u[row] = value_[std::size_t(rows.chosen[i])][row - rows.first[i]];
    }
    return u;
}

void BodyStepper::add_motion(const Rows& rows, const std::vector<Eigen::VectorXd>& y,
                             Eigen::VectorXd& u) const
{
    for (std::size_t b = 0; b < bodies(); ++b) {
        const SparseColumns& C = rows.columns[b];
        for (std::size_t i = 0; i < rows.row[b].size(); ++i) {
            double moved = 0;
            for (SparseColumns::InnerIterator entry(C, Eigen::Index(i)); entry; ++entry)
                moved += entry.value() * y[b][entry.index()];
            u[rows.row[b][i]] += moved;
        }
    }
}

/// Of all rows, a body's own.
Eigen::VectorXd BodyStepper::own(const Rows& rows, const Eigen::VectorXd& r, std::size_t b) const
{
    Eigen::VectorXd part(Eigen::Index(rows.row[b].size()));
    for (std::size_t i = 0; i < rows.row[b].size(); ++i)
        part[Eigen::Index(i)] = r[rows.row[b][i]];
    return part;
}

std::vector<Eigen::VectorXd> BodyStepper::forces(const Rows& rows, const Eigen::VectorXd& r) const
{
    std::vector<Eigen::VectorXd> f(bodies());
    for (std::size_t b = 0; b < bodies(); ++b) {
        f[b] = Eigen::VectorXd::Zero(body(b).matrix().unknowns());
        const SparseColumns& C = rows.columns[b];
        for (std::size_t i = 0; i < rows.row[b].size(); ++i)
            for (SparseColumns::InnerIterator entry(C, Eigen::Index(i)); entry; ++entry)
                f[b][entry.index()] += entry.value() * r[rows.row[b][i]];
    }
    return f;
}

/// Are the factors of the bodies less than half the size of W? With few rows W is faster.
bool BodyStepper::uses_factored_delassus() const
{
    if (rows_.count <= kManyRows || options_.outside) return false;
    double of_bodies = 0, of_W = 0;
    for (std::size_t b = 0; b < bodies(); ++b) {
        const std::vector<int>& own = rows_.row[b];
        if (own.empty()) continue;
        if (body(b).matrix().modes().cols() > 0) return false;
        // A body's contact with itself has rows twice.
        if (std::ranges::adjacent_find(own, std::ranges::greater_equal()) != own.end())
            return false;
        const auto rows = double(own.size());
        of_bodies += rows * std::min(rows, double(body(b).matrix().unknowns()));
        of_W += rows * rows;
    }
    return of_bodies < 0.5 * of_W;
}

/// Stiffness of a solid below each contact of a rod, independent of the number of contacts.
void BodyStepper::note_support_stiffness(std::size_t b, const Eigen::MatrixXd& W)
{
    if (step_.dynamic || !system_.refs[b].solid || body(b).matrix().modes().cols() > 0) return;
    std::vector<int> local(std::size_t(rows_.count), -1);
    for (std::size_t i = 0; i < rows_.row[b].size(); ++i)
        local[std::size_t(rows_.row[b][i])] = int(i);
    for (std::size_t i = 0; i < rows_.chosen.size(); ++i) {
        const int c = rows_.chosen[i], row = local[std::size_t(rows_.first[i])];
        if (row < 0 || c >= int(list_.contact.size())) continue;
        if (!system_.refs[std::size_t(list_.contact[std::size_t(c)].a)].rod) continue;
        const double row_compliance = W.col(row).cwiseAbs().sum();
        if (row_compliance > 0) support_stiffness_[key(c)] = 1 / row_compliance;
    }
}

/// W, q and mu of the chosen contacts; the modes' share of q is added for each try.
void BodyStepper::assemble()
{
    const Stopwatch watch;
    const Contacts k = contacts();
    choose_rows(all_, rows_);
    const int n_contacts = int(list_.contact.size());
    const std::size_t n = rows_.chosen.size();

    // ---- Laws, q and W of the rows
    problem_.mu.resize(Eigen::Index(n));
    problem_.kind.resize(n);
    problem_.level = step_.dynamic ? ContactLevel::velocity : ContactLevel::position;
    std::vector<std::pair<int, double>> soft;
    for (std::size_t i = 0; i < n; ++i) {
        const int c = rows_.chosen[i];
        const bool joint = c >= n_contacts;
        const double mu = joint ? 0 : friction_of(k.pairs, list_.contact[std::size_t(c)]);
        problem_.mu[Eigen::Index(i)] = mu;
        problem_.kind[i] = joint    ? ContactKind::bilateral
                           : mu > 0 ? ContactKind::frictional
                                    : ContactKind::frictionless;
        if (joint) {
            // A spring yields by its force over its stiffness.
            const double row_compliance = compliance_of_row(std::size_t(c - n_contacts));
            if (row_compliance > 0) soft.emplace_back(rows_.first[i], row_compliance);
        }
    }
    problem_.q = values(rows_);
    add_motion(rows_, free_, problem_.q);

    std::vector<Eigen::MatrixXd> W(bodies());
    B_.assign(bodies(), {});
    for (std::size_t b = 0; b < bodies(); ++b)
        elastic_ |= !rows_.row[b].empty() && (system_.refs[b].solid || system_.refs[b].rod);
    true_tangent_.clear();
    held_.resize(0);
    if (uses_factored_delassus()) {
        for (std::size_t b = 0; b < bodies(); ++b)
            if (!rows_.row[b].empty()) W[b] = compliance_root(body(b).matrix(), rows_.columns[b]);
        problem_.W = delassus_of_bodies(rows_, std::move(W), soft);
        report_.compliance += watch.seconds();
        return;
    }

    // ---- Scales of the modes
    bool modes = false;
    // Elastic give of each row: a stiff body's modes act on rows through the bodies that it rests
    // on.
    Eigen::VectorXd row_compliance = Eigen::VectorXd::Zero(rows_.count);
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (rows_.row[b].empty()) continue;
        body(b).matrix().compliance(rows_.columns[b], W[b]);
        note_support_stiffness(b, W[b]);
        for (std::size_t i = 0; i < rows_.row[b].size(); ++i)
            row_compliance[rows_.row[b][i]] += W[b](Eigen::Index(i), Eigen::Index(i));
    }
    double least = std::numeric_limits<double>::infinity(); // of the bodies that touch [m]
    for (std::size_t b = 0; b < bodies(); ++b)
        if (!rows_.row[b].empty()) least = std::min(least, body(b).size());
    for (std::size_t b = 0; b < bodies(); ++b) {
        const Eigen::MatrixXd& R = body(b).matrix().modes();
        if (rows_.row[b].empty() || R.cols() == 0) continue;
        modes = true;
        B_[b] = rows_.columns[b].transpose() * R;
        double& s = mode_scale_[b];
        double elastic = 0;
        for (const int row : rows_.row[b])
            elastic += row_compliance[row];
        const double rigid = B_[b].squaredNorm();
        if (stressed(b)) {
            double hold = 0;
            for (std::size_t i = 0; i < rows_.row[b].size(); ++i)
                if (const double w = row_compliance[rows_.row[b][i]]; w > 0)
                    hold += B_[b].row(Eigen::Index(i)).squaredNorm() / w;
            s = hold > 0 ? kStressedModeWeight * double(R.cols()) / hold : 1;
        } else if (elastic > 0 && rigid > 0 && feeds_freely_[b] < kMostGrowths) {
            s = mode_weight() * elastic / rigid * std::pow(kScaleGrows, feeds_freely_[b]);
        } else if (!(s > 0)) {
            // Nothing elastic: any scale does. If loads moved a body by its own size, rounding of a
            // large one's motion would be all of the motion of a small one on it.
            const double load = mode_load_[b].norm();
            mode_way_[b] = least;
            s = load > 0 ? least / load : 1;
        }
    }

    // ---- Sum over bodies
    const auto sum = [&](double share) {
        for (std::size_t b = 0; b < bodies(); ++b)
            if (B_[b].size() > 0)
                W[b].noalias() += B_[b] * (share * mode_gain(b)) * B_[b].transpose();
        return sum_of_bodies(rows_, W, soft);
    };
    if (!hanging_.empty()) couple_modes();
    if (modes && modes_coupled_ && !add_coupled_modes(row_compliance, W, soft)) {
        modes_coupled_ = false;
        modes_apart_ = true;
    }
    if (!modes_coupled_) hanging_ = {};
    // Bodies that roll are hardly held: gaps would be none beside their compliance.
    if (rolls_ && modes_coupled_) measured_W_ = sum(1 / mode_weight());
    if (!modes || !modes_coupled_) {
        if (modes) measured_W_ = sum(1 / mode_weight());
        problem_.W = sum(modes ? 1 - 1 / mode_weight() : 0);
    }
    if (!stabilised_only_ && use_true_tangent(W, soft)) {
        std::vector<Eigen::VectorXd> free(bodies());
        for (std::size_t b = 0; b < bodies(); ++b)
            free[b] = unstabilised(b, free_[b]);
        problem_.q = values(rows_);
        add_motion(rows_, free, problem_.q);
    }
    report_.compliance += watch.seconds();
}

/// r of the chosen contacts from forces in space, by identity.
Eigen::VectorXd BodyStepper::warm_start() const
{
    Eigen::VectorXd r = Eigen::VectorXd::Zero(rows_.count);
    for (std::size_t i = 0; i < rows_.chosen.size(); ++i) {
        const auto at = force_.find(key(rows_.chosen[i]));
        if (at == force_.end()) continue;
        const Vec3 own =
            problem_.kind[i] == ContactKind::bilateral
                ? at->second
                : Vec3(list_.contact[std::size_t(rows_.chosen[i])].frame.transpose() * at->second);
        const int size = amontons::rows_of(problem_.kind[i]);
        r.segment(rows_.first[i], size) = own.head(size);
    }
    return r;
}

double BodyStepper::mode_weight() const
{
    return options_.tolerance < kFine ? kFineModeWeight : kModeWeight;
}

double BodyStepper::compliance_of_row(std::size_t coupling) const
{
    const Coupling& c = system_.couplings[coupling];
    if (!step_.dynamic || !(c.softness > 0)) return c.softness;
    return spring_row(c, step_.rule, step_.h, {}, 0).compliance / (step_.h * step_.rule.end);
}

std::string BodyStepper::who(int c) const
{
    const int n_contacts = int(list_.contact.size());
    if (c >= n_contacts)
        return fmt::format("coupling {}", system_.couplings[std::size_t(c - n_contacts)].input);
    const BodyContact& k = list_.contact[std::size_t(c)];
    return fmt::format("{} on {} at ({:.4g}, {:.4g}, {:.4g})", system_.refs[std::size_t(k.a)].name,
                       k.b < 0 ? "an obstacle" : system_.refs[std::size_t(k.b)].name, k.point.x(),
                       k.point.y(), k.point.z());
}

/// Contacts of elastic bodies are mostly decided by some steps of Newton's method, those of many
/// bodies by extrapolated sweeps: a factor of their W takes longer than a thousand of them. Where
/// that does not converge, `auto` has further methods.
ContactSolution BodyStepper::solve_contact(const SolverOptions& options, std::string& why) const
{
    if (options_.outside) return options_.outside(problem_, options, r_, why);
    if (options.solver != ContactSolver::automatic || !elastic_ || problem_.W.is_of_bodies())
        return amontons::solve(problem_, options, r_);
    const bool many = problem_.W.is_sparse() && problem_.q.size() > kManyRows;
    SolverOptions quick = options;
    quick.solver = many ? ContactSolver::anderson : ContactSolver::newton;
    if (!many) quick.max_iterations = kNewtonSteps;
    const ContactSolution first = amontons::solve(problem_, quick, r_);
    const Certificate& found = first.certificate;
    if (found.status == SolveStatus::infeasible || (many && found.error <= options.acceptable))
        return first;
    if (!is_solved(found.status)) return amontons::solve(problem_, options, first.reaction);
    if (!linear_ || problem_.W.is_sparse() || problem_.W.rows() > kFinerRows) return first;
    quick.tolerance = kFiner * options.tolerance;
    quick.max_iterations = kFinerIterations;
    ContactSolution finer = amontons::solve(problem_, quick, first.reaction);
    if (!(finer.certificate.error < found.error)) return first;
    finer.certificate.status = SolveStatus::converged;
    finer.certificate.iterations += found.iterations;
    return finer;
}

/// Rows on nodes that are nearly all prescribed have a compliance of round-off: they would give
/// unbounded motions.
bool BodyStepper::exceeds_motion_bound()
{
    if (step_.dynamic || rows_.count == 0) return false;
    for (std::size_t b = 0; b < bodies(); ++b) {
        const double way = y_[b].size() > 0 ? in_lengths(b, y_[b]).lpNorm<Eigen::Infinity>() : 0;
        if (way <= kAstray * body(b).size()) continue;
        int strongest = rows_.chosen.front();
        double most = 0;
        for (std::size_t i = 0; i < rows_.chosen.size(); ++i)
            if (std::abs(r_[rows_.first[i]]) >= most) {
                most = std::abs(r_[rows_.first[i]]);
                strongest = rows_.chosen[i];
            }
        report_.refusal = fmt::format("{} would have to move by {:.1e} m to avoid the penetration "
                                      "of {}",
                                      system_.refs[b].name, way, who(strongest));
        return true;
    }
    return false;
}

/// The contact problem at the iterate. Contacts that were left out and would penetrate are added.
bool BodyStepper::solve()
{
    const int n_contacts = int(list_.contact.size());
    const int n = int(value_.size());
    mode_.assign(bodies(), {});
    mode_scale_.resize(bodies(), 0);
    feeds_freely_.resize(bodies(), 0);
    for (std::size_t b = mode_way_.size(); b < bodies(); ++b)
        mode_way_.push_back(body(b).size());

    // ---- Gaps and slips of the free motion
    for (std::size_t b = 0; b < bodies(); ++b)
        mode_[b] = Eigen::VectorXd::Zero(mode_load_[b].size());
    all_.chosen.resize(std::size_t(n));
    for (int c = 0; c < n; ++c)
        all_.chosen[std::size_t(c)] = c;
    make_rows(contacts(), all_);
    if (uses_matrix_free()) {
        hanging_ = {};
        return solve_without_W();
    }
    for (std::size_t b = 0; b < bodies(); ++b)
        if (SolidBody* solid = system_.refs[b].solid; solid && solid->iterative()) {
            solid->find_free_change();
            free_[b] = solid->free_change();
        }
    Eigen::VectorXd u = values(all_);
    add_motion(all_, free_, u);
    double size = 0;
    for (std::size_t b = 0; b < bodies(); ++b)
        size = std::max(size, body(b).size());
    if (step_.dynamic) size /= step_.h;
    const double slack = 1e-13 * size;

    // ---- Contacts that act from the start
    std::vector<char> in(std::size_t(n), 0);
    // Where modes are free any contact may constrain them.
    bool modes = false;
    for (const Eigen::VectorXd& g : mode_load_)
        modes |= g.size() > 0;
    double deepest = 0;
    for (int c = 0; c < n_contacts; ++c)
        deepest = std::min(deepest, u[all_.first[std::size_t(c)]]);
    for (int c = 0; c < n; ++c)
        in[std::size_t(c)] = c >= n_contacts || force_.count(key(c)) > 0 ||
                             u[all_.first[std::size_t(c)]] <= slack || (modes && deepest == 0);
    int rescales = 0;
    released_.assign(std::size_t(n_contacts), 0);
    stabilised_only_ = stabilised_in_step_;
    tipping_.clear();
    std::string some_stressed;
    for (std::size_t b = 0; b < bodies() && some_stressed.empty(); ++b)
        if (stressed(b)) some_stressed = system_.refs[b].name;

    // ---- Solve; contacts that penetrate are added until there are none
    for (int growth = 0; growth < kMostGrowth; ++growth) {
        rows_.chosen.clear();
        for (int c = 0; c < n; ++c)
            if (in[std::size_t(c)]) rows_.chosen.push_back(c);
        assemble();
        if (!problem_.q.allFinite()) {
            report_.refusal = "the contact-free motion is not finite";
            return false;
        }
        if (rows_.count > 0 && !problem_.W.diagonal().allFinite()) {
            report_.refusal = "the compliance of the contacts and joints is not finite";
            return false;
        }
        r_ = warm_start();
        const bool solved = solve_with_modes();
        if (rescales < kMostRescales && rescale_modes()) {
            ++rescales;
            for (Eigen::VectorXd& m : mode_)
                m.setZero();
            report_.refusal.clear();
            continue;
        }
        if (!solved && (feed_freely() || couple_modes() || roll())) {
            for (Eigen::VectorXd& m : mode_)
                m.setZero();
            report_.refusal.clear();
            continue;
        }
        if (!solved && !stabilised_only_ && (!true_tangent_.empty() || !some_stressed.empty())) {
            stabilised_only_ = true;
            tipping_ = some_stressed;
            for (Eigen::VectorXd& m : mode_)
                m.setZero();
            report_.refusal.clear();
            continue;
        }
        if (!solved) {
            // With pins the motion of the modes is not known: a contact that was left out may
            // constrain the body.
            if (!modes || int(rows_.chosen.size()) == n) {
                if (tipping_.empty()) tipping_ = some_stressed; // it was stabilised from the start
                return false;
            }
            std::fill(in.begin(), in.end(), 1);
            for (Eigen::VectorXd& m : mode_)
                m.setZero();
            report_.refusal.clear();
            continue;
        }
        if (release_stabilised_rows()) {
            for (Eigen::VectorXd& m : mode_)
                m.setZero();
            continue;
        }
        const Stopwatch watch;
        body_force_ = forces(rows_, r_);
        y_.resize(bodies());
        std::vector<Eigen::VectorXd> motion(bodies());
        for (std::size_t b = 0; b < bodies(); ++b) {
            y_[b] = free_[b];
            if (!rows_.row[b].empty() && body(b).matrix().unknowns() > 0)
                y_[b] += body(b).matrix().solve(rows_.columns[b], own(rows_, r_, b));
            y_[b] = unstabilised(b, y_[b]);
            motion[b] = y_[b];
            if (mode_[b].size() > 0) motion[b] += body(b).matrix().modes() * mode_[b];
        }
        u = values(all_);
        add_motion(all_, motion, u);
        report_.correction += watch.seconds();
        double scale = slack;
        for (const int c : rows_.chosen)
            if (c < n_contacts)
                scale = std::max(scale, options_.tolerance * std::abs(value_[std::size_t(c)][0]));
        int added = 0;
        for (int c = 0; c < n_contacts; ++c)
            if (!in[std::size_t(c)] && u[all_.first[std::size_t(c)]] < -scale) {
                in[std::size_t(c)] = 1;
                ++added;
            }
        if (added == 0) break;
        for (std::size_t i = 0; i < rows_.chosen.size(); ++i) { // what is known so far
            const int c = rows_.chosen[i];
            Vec3 own = Vec3::Zero();
            const int rows = amontons::rows_of(problem_.kind[i]);
            own.head(rows) = r_.segment(rows_.first[i], rows);
            force_[key(c)] =
                c >= n_contacts ? own : Vec3(list_.contact[std::size_t(c)].frame * own);
        }
    }

    take_answer(u);
    return finish_iteration();
}

/// Forces, motions and certificate of the contacts in rows_. @param u  of all_, reached
void BodyStepper::take_answer(const Eigen::VectorXd& u)
{
    const int n_contacts = int(list_.contact.size());
    std::vector<std::pair<BodySystem::Key, Vec3>> force, motion;
    force.reserve(rows_.chosen.size());
    motion.reserve(rows_.chosen.size());
    for (std::size_t i = 0; i < rows_.chosen.size(); ++i) {
        const int c = rows_.chosen[i];
        const int rows = amontons::rows_of(problem_.kind[i]);
        Vec3 own = Vec3::Zero(), moved = Vec3::Zero();
        own.head(rows) = r_.segment(rows_.first[i], rows);
        const int first = all_.first[std::size_t(c)];
        moved.head(rows) = u.segment(first, rows);
        const BodySystem::Key name = key(c);
        if (!own.isZero(0))
            force.emplace_back(
                name, c >= n_contacts ? own : Vec3(list_.contact[std::size_t(c)].frame * own));
        motion.emplace_back(name, moved);
    }
    replace_entries(std::move(force), force_);
    replace_entries(std::move(motion), motion_);
    // The error of the solution, on the motion that follows from it, not on the problem's own u.
    Eigen::VectorXd reached(rows_.count);
    for (std::size_t i = 0; i < rows_.chosen.size(); ++i) {
        const int rows = amontons::rows_of(problem_.kind[i]);
        reached.segment(rows_.first[i], rows) =
            u.segment(all_.first[std::size_t(rows_.chosen[i])], rows);
    }
    for (std::size_t i = 0; i < rows_.chosen.size(); ++i)
        if (problem_.kind[i] == ContactKind::bilateral) { // a spring's own give
            const int c = rows_.chosen[i] - n_contacts;
            reached[rows_.first[i]] += compliance_of_row(std::size_t(c)) * r_[rows_.first[i]];
        }
    certify_rows(reached);
}

/// Updates the iterate by the solution.
bool BodyStepper::finish_iteration()
{
    if (exceeds_motion_bound()) return false;
    relax();
    for (std::size_t b = 0; b < bodies(); ++b) {
        if (mode_load_[b].size() > 0)
            body(b).set_unconstrained_modes(unconstrained_modes(b, kUnfelt));
        body(b).update(y_[b], mode_[b], body_force_[b]);
        if (body(b).outcome().accepted_length < 1) {
            motion_before_.resize(0); // the motions used for extrapolation must be full ones
            changes_.resize(0, 0);
            made_.resize(0, 0);
        }
    }
    refine();
    return true;
}

} // namespace amontons
