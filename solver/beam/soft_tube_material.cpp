#include "solver/beam/soft_tube.hpp"

#include "mesh/swept_tube.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

// What a hyperelastic wall has beyond a linear one.

namespace amontons {
namespace {

constexpr int kMostNewton = 25;           // of the balance under the load alone
constexpr double kRestBalance = 1e-9;     // of the load's largest force on a node
constexpr double kLeastShare = 1.0 / 256; // of the load that is added at once

double largest_free(const Eigen::VectorXd& f, const FreeDofs& dofs)
{
    double largest = 0;
    for (const std::int32_t d : dofs.free)
        largest = std::max(largest, std::abs(f[d]));
    return largest;
}

} // namespace

SoftTube::SoftTube(SolidTubeOptions options, VolumeMesh mesh, WallMaterial material,
                   const SoftTubeSupport& support)
    : options_(std::move(options))
    , mesh_(std::move(mesh))
    , material_{youngs_modulus(material.law), poissons_ratio(material.law), 0}
    , wall_(make_wall(SweptTube(options_.centreline)))
    , frame_(tube_frame(options_))
    , grid_(tube_grid(options_, mesh_))
    , load_(support.load.size() > 0 ? support.load
                                    : Eigen::VectorXd::Zero(3 * Eigen::Index(mesh_.nodes.size())))
    , hyperelastic_(std::move(material))
{
    pattern_ = make_pattern(mesh_);
    dofs_ = make_free_dofs(pattern_, support.fixed);
    columns_ = tube_columns(grid_, dofs_);
    if (const std::string fault = find_rest_(); !fault.empty())
        throw InputError({{"", "/loads", "a wall whose loads " + fault,
                           "loads that it holds in a stable balance"}});
}

/// From no load on, by as much of it at once as Newton's method finds a balance for.
std::string SoftTube::find_rest_()
{
    const WallMaterial whole = *hyperelastic_;
    const Eigen::VectorXd dead = load_;
    double done = 0, share = 1;
    WallState rest;
    rest.u = Eigen::VectorXd::Zero(load_.size());
    SparseMatrix K = zero_matrix(pattern_);
    if (const std::string fault = find_balance(mesh_, whole, dead, rest); !fault.empty())
        return fault;
    double scale = largest_free(rest.off, dofs_); // at rest it is all that is off
    if (whole.pressures.empty() && dead.isZero(0)) scale = std::numeric_limits<double>::infinity();
    const auto load = [&](double factor) {
        load_ = factor * dead;
        for (std::size_t k = 0; k < whole.pressures.size(); ++k)
            hyperelastic_->pressures[k].pressure = factor * whole.pressures[k].pressure;
    };
    const auto newton = [&](WallState& s) -> std::string {
        std::string fault = find_balance(mesh_, *hyperelastic_, load_, s);
        for (int i = 0; i < kMostNewton && fault.empty(); ++i) {
            // Also at rest: a factor exists only if the balance is stable.
            assemble_wall_tangent(mesh_, pattern_, *hyperelastic_, s, K);
            if (!factor_(K)) return "leave it no stable balance";
            if (largest_free(s.off, dofs_) <= kRestBalance * scale) return "";
            s.u += answer(s.off);
            fault = find_balance(mesh_, *hyperelastic_, load_, s);
        }
        return fault.empty() ? "leave it no balance that Newton's method finds" : fault;
    };
    // At rest there is a balance; that of a wall that nothing holds is not stable.
    load(0);
    assemble_wall_tangent(mesh_, pattern_, *hyperelastic_, rest, K);
    if (!factor_(K)) throw InputError({loose_wall()});
    while (done < 1) {
        share = std::min(share, 1 - done);
        load(done + share);
        WallState trial = rest;
        if (const std::string fault = newton(trial); fault.empty()) {
            rest = std::move(trial);
            done += share;
        } else {
            share *= 0.5;
            if (share < kLeastShare) return fault;
        }
    }
    rest.offset = rest.u;
    rest.tangent_at = tangent_at_ = std::make_shared<const Eigen::VectorXd>(rest.u);
    at_rest_ = std::make_shared<const WallState>(std::move(rest));
    take(at_rest_);
    set_start(*at_rest_);
    return "";
}

void SoftTube::take(const WallStatePointer& state)
{
    if (state == taken_) return;
    taken_ = state;
    if (state->tangent_at != tangent_at_) {
        auto moved = std::make_shared<WallState>(*state);
        // In balance with contact forces f its loads are off by -f: K^-1 f = -K^-1 off.
        moved->offset = state->u + answer(state->off);
        moved->tangent_at = tangent_at_;
        set_offset_(now_, moved->offset);
        state_ = std::move(moved);
        return;
    }
    state_ = state;
    set_offset_(now_, state->offset);
}

void SoftTube::set_start(const WallState& state)
{
    set_(start_, {});
    set_offset_(start_, state.u);
}

std::string SoftTube::evaluate_material(WallState& s) const
{
    s.u = s.offset + answer(nodal_forces());
    s.tangent_at = tangent_at_;
    return find_balance(mesh_, *hyperelastic_, load_, s);
}

Eigen::VectorXd SoftTube::imbalance(const WallState& s) const
{
    Eigen::VectorXd f = s.off + nodal_forces();
    for (const std::int32_t d : dofs_.fixed)
        f[d] = 0;
    return f;
}

bool SoftTube::relinearise(std::shared_ptr<const Eigen::VectorXd> at)
{
    WallState s; // with elements from rest: the tangent is a function of `at` alone
    s.u = *at;
    if (!find_balance(mesh_, *hyperelastic_, load_, s).empty()) return false;
    SparseMatrix K = zero_matrix(pattern_);
    assemble_wall_tangent(mesh_, pattern_, *hyperelastic_, s, K);
    if (!factor_(K)) return false;
    tangent_at_ = std::move(at);
    drop_columns(columns_);
    now_.current = start_.current = false;
    taken_.reset();
    return true;
}

} // namespace amontons
