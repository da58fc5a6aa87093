#include "solver/step/soft_balance.hpp"

#include "mesh/base/dense.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/beam/soft_tube.hpp"
#include "solver/step/wire_group.hpp"

#include <algorithm>
#include <cmath>

// With contact forces f on a wall, u = a + K^-1 f, and g(u) the residual of loads, forces and the
// material, the offset a is right where g = 0. a + K^-1 g is the next guess; Anderson's rule mixes
// the last ones so that K^-1 g, measured in energy, is least. f is that of wire and contacts in
// balance with each a, to a share of the error that is left.

namespace amontons {
namespace {

constexpr int kMostBalanceRounds = 60;
constexpr std::size_t kMemory = 8;       // of Anderson's rule
constexpr double kFirstTolerance = 1e-3; // of wire and contacts while the walls are far off
constexpr double kShare = 0.03;          // ... and of the walls' last error
constexpr int kPatience = 12;            // evaluations with a tangent before another is made
constexpr int kMostTangents = 3;         // made in one solve
constexpr int kMostHalvings = 5;
constexpr double kDependent = 1e-10; // differences that add nothing new

struct Past {
    Eigen::VectorXd offset, off, answer; ///< changes from one evaluation to the next [m], [N], [m]
};

struct Search {
    std::size_t wall = 0;
    SoftTube* tube = nullptr;
    WallState state;
    Eigen::VectorXd off, answer; ///< imbalance of the last sample, and the tangent's answer to it
    Eigen::VectorXd offset;      ///< of that evaluation
    std::vector<Past> past;
    double largest = 0; ///< imbalance of a node [N]

    void drop()
    {
        past.clear();
        off.resize(0);
    }
};

double largest_force(const Eigen::VectorXd& f)
{
    double largest = 0;
    for (Eigen::Index i = 0; i + 2 < f.size(); i += 3)
        largest = std::max(largest, f.segment<3>(i).norm());
    return largest;
}

/// Whether nothing touches the wall, and nothing has.
bool at_rest(const Search& s)
{
    const WallState& rest = *s.tube->at_rest();
    return s.tube->forces().empty() && rest.tangent_at == s.tube->tangent_at() &&
           s.state.offset == rest.offset;
}

/// The next offset.
void improve(Search& s, Eigen::VectorXd off)
{
    Eigen::VectorXd answer = s.tube->answer(off);
    if (s.off.size() > 0) {
        if (s.past.size() == kMemory) s.past.erase(s.past.begin());
        s.past.push_back({s.state.offset - s.offset, off - s.off, answer - s.answer});
    }
    s.off = std::move(off);
    s.answer = std::move(answer);
    s.offset = s.state.offset;
    Eigen::VectorXd next = s.offset + s.answer;
    const auto m = Eigen::Index(s.past.size());
    if (m > 0) {
        Eigen::MatrixXd M(m, m);
        Eigen::VectorXd right(m), size(m);
        for (Eigen::Index i = 0; i < m; ++i) {
            const Past& p = s.past[std::size_t(i)];
            right[i] = p.off.dot(s.answer);
            for (Eigen::Index j = 0; j < m; ++j)
                M(i, j) = p.off.dot(s.past[std::size_t(j)].answer);
        }
        size = M.diagonal().cwiseMax(0).cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
        const Eigen::VectorXd share =
            size.asDiagonal() * shortest_least_squares(size.asDiagonal() * M * size.asDiagonal(),
                                                       size.asDiagonal() * right, kDependent);
        for (Eigen::Index i = 0; i < m; ++i)
            next -= share[i] * (s.past[std::size_t(i)].offset + s.past[std::size_t(i)].answer);
    }
    s.state.offset = std::move(next);
}

void apply_offset(Wire& wire, const Search& s)
{
    wire.state.wall[s.wall] = std::make_shared<const WallState>(s.state);
}

} // namespace

void rest_walls(Wire& wire, const std::vector<WireWall>& walls)
{
    std::vector<WallStatePointer> rest;
    bool any = false;
    for (const WireWall& w : walls) {
        rest.push_back(w.soft && w.soft->hyperelastic() ? w.soft->at_rest() : nullptr);
        any = any || rest.back();
    }
    wire.state.wall = any ? std::move(rest) : std::vector<WallStatePointer>{};
}

NewtonReport balance_walls(Wire& wire, const std::vector<WireWall>& walls,
                           const NewtonOptions& options,
                           const std::function<NewtonReport(const NewtonOptions&)>& solve)
{
    if (wire.state.wall.empty()) return solve(options);
    if (!wire.outside()) {
        rest_walls(wire, walls);
        return solve(options);
    }
    std::vector<Search> searches;
    for (std::size_t w = 0; w < walls.size(); ++w)
        if (wire.state.wall[w]) {
            Search& s = searches.emplace_back();
            s.wall = w;
            s.tube = walls[w].soft;
            s.tube->take(wire.state.wall[w]);
            s.state = s.tube->state();
            apply_offset(wire, s);
        }

    // ---- Rounds: wire and contacts, then the offset of the walls
    NewtonReport sum;
    double error = kFirstTolerance / kShare;
    int with_tangent = 0, halvings = 0, tangents = 0;
    for (int round = 0; round < kMostBalanceRounds; ++round) {
        NewtonOptions inner = options;
        inner.tolerance = std::max(options.tolerance, std::min(kFirstTolerance, kShare * error));
        const NewtonReport r = solve(inner);
        add(sum, r);
        if (!r.converged) return sum;
        // Residual g(u) = loads + f - f_int(u) of each wall at u = offset + K^-1 f.
        const Stopwatch watch;
        error = 0;
        std::string fault;
        std::vector<Eigen::VectorXd> off;
        for (Search& s : searches) {
            WallState trial = s.state;
            if (at_rest(s)) {
                trial = *s.tube->at_rest();
            } else {
                fault = s.tube->evaluate_material(trial);
                ++sum.wall_evaluations;
            }
            if (!fault.empty()) break;
            s.state = std::move(trial);
            off.push_back(s.tube->imbalance(s.state));
            s.largest = largest_force(off.back());
            error = std::max(error, s.largest / sum.residual.scale);
        }
        if (!fault.empty() || !std::isfinite(error)) {
            sum.converged = false;
            sum.residual.contact = std::numeric_limits<double>::infinity();
            // Half of the way from an offset at which the material could be evaluated.
            if (++halvings > kMostHalvings || searches[0].off.size() == 0) return sum;
            for (Search& s : searches) {
                s.state.offset = 0.5 * (s.state.offset + s.offset);
                apply_offset(wire, s);
            }
            error = kFirstTolerance / kShare;
            continue;
        }
        sum.residual.contact = std::max(sum.residual.contact, error * sum.residual.scale);
        const double allowed = std::max(options.tolerance, sum.residual.floor);
        if (error <= allowed && sum.residual.error() <= allowed) {
            for (const Search& s : searches) {
                apply_offset(wire, s);
                wire.state.wall_energy += s.state.energy - s.tube->at_rest()->energy;
            }
            sum.seconds_rest += watch.seconds();
            return sum;
        }
        sum.converged = false;
        // A new tangent after kPatience rounds (later steps gain by it too), else offset += K^-1 g
        // with Anderson's rule (improve).
        const bool slow = ++with_tangent >= kPatience && tangents < kMostTangents;
        for (std::size_t k = 0; k < searches.size(); ++k) {
            Search& s = searches[k];
            if (error <= allowed) break; // wire and contacts are to be solved again
            const bool moved =
                slow && s.tube->relinearise(std::make_shared<const Eigen::VectorXd>(s.state.u));
            if (moved) {
                ++sum.wall_tangents;
                s.drop();
                s.state.tangent_at = s.tube->tangent_at();
                // u = offset + K^-1 f with the new K, and then the first guess from there.
                s.state.offset = s.state.u + s.tube->answer(s.state.off);
            } else {
                improve(s, std::move(off[k]));
            }
            apply_offset(wire, s);
        }
        if (slow) {
            ++tangents;
            with_tangent = 0;
        }
        sum.seconds_rest += watch.seconds();
    }
    return sum;
}

} // namespace amontons
