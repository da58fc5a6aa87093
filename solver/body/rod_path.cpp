#include "solver/body/rod_body.hpp"

#include <algorithm>
#include <cmath>

// Steps along the path of balances. With the time t, which loads and holds follow, as one more
// unknown, and D the motion of the step so far, an iteration is
//
//   y = y_r + dt y_t,   K y_r = -residual,   K y_t = d(loads)/dt,   <D, y> = (s^2 - <D, D>)/2:
//
// the length of the step is s once it has converged, and K may be singular in t's place.
// Source: Crisfield 1981, with his quadratic linearised as by Ramm 1981; derived anew.

namespace amontons {
namespace {

double dot_of_places(const Eigen::VectorXd& a, const Eigen::VectorXd& b)
{
    double sum = 0;
    for (Eigen::Index i = 0; i < a.size(); i += 6)
        sum += a.segment<3>(i).dot(b.segment<3>(i));
    return sum / (double(a.size()) / 6);
}

} // namespace

int RodBody::path_step(double length, double first, double end, double tolerance,
                       const Vec3& gravity, double& t)
{
    constexpr int kMost = 25;
    constexpr double kLongest = 1.5; // of the length, of the step to the end: else another balance
    const double begin = t, small = 1e-3 * first;
    StepInput step;
    step.start = begin;
    step.gravity = gravity;
    RodBody::begin(step);
    K_.set_zero();
    Eigen::VectorXd done = Eigen::VectorXd::Zero(unknowns());
    double target = length;
    bool last = false; // to the end: the time is no unknown

    // ---- Newton's method with the length of the step as a condition
    const Eigen::VectorXd none;
    for (int i = 0; i <= kMost; ++i) {
        // Residual and its rate by the time, by central differences of the loads.
        step_.h = t - begin;
        forces(now_, t, inner_, load_);
        Eigen::VectorXd rest(unknowns()), rate(unknowns());
        std::vector<Node6> after(now_.nodes.size(), Node6{}), before = after;
        const double sooner = t - small, later = std::min(t + small, end); // no load beyond the end
        add_loads(now_, later, after, nullptr);
        add_loads(now_, sooner, before, nullptr);
        for (std::size_t k = 0; k < now_.nodes.size(); ++k)
            for (int j = 0; j < 6; ++j) {
                rest[Eigen::Index(6 * k) + j] = load_[k].value[j] - inner_[k].value[j];
                rate[Eigen::Index(6 * k) + j] =
                    (after[k].value[j] - before[k].value[j]) / (later - sooner);
            }
        residual_ = rest;
        held_ = held_at(now_, t);
        const std::vector<Held> held_later = held_at(now_, later),
                                held_sooner = held_at(now_, sooner);
        // What is prescribed moves with the free motion, as in linearise().
        const auto lead = [&](Eigen::VectorXd& load, Eigen::VectorXd& move) {
            std::vector<Node6> d(now_.nodes.size(), Node6{}), Kd;
            for (std::size_t k = 0; k < d.size(); ++k)
                Map6(d[k].value) = move.segment<6>(Eigen::Index(6 * k));
            K_.multiply(d, Kd);
            for (std::size_t k = 0; k < d.size(); ++k)
                load.segment<6>(Eigen::Index(6 * k)) -= Map6(Kd[k].value);
        };
        Eigen::VectorXd move = Eigen::VectorXd::Zero(unknowns()), move_rate = move;
        for (std::size_t k = 0; k < held_.size(); ++k) {
            move.segment<6>(6 * held_[k].node) = held_[k].move;
            move_rate.segment<6>(6 * held_[k].node) =
                (held_later[k].move - held_sooner[k].move) / (later - sooner);
        }
        lead(rest, move);
        lead(rate, move_rate);
        hold_matrix(K_, 0);
        negative_ = K_.factor();
        // y = y_r + dt y_t with K y_r = rest, K y_t = rate (Crisfield), and dt by the linearised
        // length condition |done + y|^2 = target^2: done . y = (target^2 - |done|^2) / 2 (Ramm);
        // the first dt by the length alone, in the direction of the step before.
        const Eigen::VectorXd y_t = solve(rate) + move_rate;
        double dt = 0;
        Eigen::VectorXd y;
        if (last) {
            dt = end - t;
            y = solve(rest) + move + dt * y_t;
        } else if (i == 0) {
            const double speed = std::sqrt(dot_of_places(y_t, y_t));
            if (!(speed > 0) || !std::isfinite(speed)) return 0;
            dt = length / speed;
            if (path_.size() == 0) {
                dt = std::min(dt, first);
                target = dt * speed;
            } else if (dot_of_places(path_, y_t) < 0) {
                dt = -dt;
            }
            y = solve(rest) + move + dt * y_t;
        } else {
            const Eigen::VectorXd y_r = solve(rest) + move;
            const double along = dot_of_places(done, y_t);
            dt = (0.5 * (target * target - dot_of_places(done, done)) - dot_of_places(done, y_r)) /
                 along;
            y = y_r + dt * y_t;
        }
        if (!std::isfinite(dt) || !y.allFinite()) break;
        if (!last && t + dt >= end) {
            last = true;
            t = begin;
            done.setZero();
            RodBody::begin(step);
            continue;
        }
        if (safe_share(now_, y) < 1) break; // a shorter step
        // ---- The new iterate, and whether the step ends with it
        t += dt;
        step_.h = t - begin;
        done += y;
        RodBody::update(y, none, none);
        const double error = imbalance(none);
        const double share = std::sqrt(dot_of_places(done, done)) / target;
        const bool length_right = last ? share <= kLongest : std::abs(share - 1) <= 1e-6;
        if (error <= tolerance && length_right && i > 0) {
            path_ = done;
            if (last) t = end;
            return i + 1;
        }
    }
    now_ = state_;
    t = begin;
    return 0;
}

} // namespace amontons
