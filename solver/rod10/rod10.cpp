#include "solver/rod10/rod10.hpp"

#include "mesh/base/error.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace amontons {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kReach = 9; // two nodes of five, less one

/// Calls add(i, j, value) for every entry of every element that is not the clamped node's.
template <class Add> void concatenate(const Rod10& rod, const Mat3& to_rod, Add add)
{
    const Mat10 T = element_transformation(to_rod);
    const Mat10 K = T.transpose() * element_stiffness(rod) * T;
    for (int e = 0; e + 1 < rod.nodes; ++e)
        for (int i = 0; i < 10; ++i)
            for (int j = 0; j < 10; ++j) {
                const int row = 5 * (e - 1) + i, column = 5 * (e - 1) + j;
                if (row >= 0 && column >= 0) add(row, column, K(i, j));
            }
}

std::vector<double> as_numbers(std::span<const Rod10Node> nodes)
{
    std::vector<double> x;
    for (std::size_t i = 1; i < nodes.size(); ++i) {
        x.insert(x.end(), nodes[i].along.data(), nodes[i].along.data() + 3);
        x.insert(x.end(), nodes[i].turn.begin(), nodes[i].turn.end());
    }
    return x;
}

} // namespace

double Rod10::area() const
{
    return kPi * diameter * diameter / 4;
}

double Rod10::inertia() const
{
    return kPi * std::pow(diameter, 4) / 64;
}

void check(const Rod10& rod)
{
    std::vector<Issue> issues;
    const auto positive = [&](const char* name, double value, const char* unit) {
        if (!(value > 0) || !std::isfinite(value))
            issues.push_back(
                {"", name, std::to_string(value), std::string("a number > 0 ") + unit});
    };
    positive("length", rod.length, "[m]");
    positive("diameter", rod.diameter, "[m]");
    positive("youngs_modulus", rod.youngs_modulus, "[Pa]");
    if (rod.nodes < 2) issues.push_back({"", "nodes", std::to_string(rod.nodes), "at least 2"});
    if (!issues.empty()) throw InputError(std::move(issues));
}

Mat10 element_stiffness(const Rod10& rod)
{
    const double L = rod.element(), EI = rod.bending();
    const double a = rod.youngs_modulus * rod.area() / L;
    const double b = 12 * EI / (L * L * L), c = 6 * EI / (L * L), d = 4 * EI / L, e = 2 * EI / L;
    Mat10 k;
    k << a, 0, 0, 0, 0, -a, 0, 0, 0, 0,  //
        0, b, 0, 0, c, 0, -b, 0, 0, c,   //
        0, 0, b, -c, 0, 0, 0, -b, -c, 0, //
        0, 0, -c, d, 0, 0, 0, c, e, 0,   //
        0, c, 0, 0, d, 0, -c, 0, 0, e,   //
        -a, 0, 0, 0, 0, a, 0, 0, 0, 0,   //
        0, -b, 0, 0, -c, 0, b, 0, 0, -c, //
        0, 0, -b, c, 0, 0, 0, b, c, 0,   //
        0, 0, -c, e, 0, 0, 0, c, d, 0,   //
        0, c, 0, 0, e, 0, -c, 0, 0, d;
    return k;
}

Mat3 rotation_of_angles(const Vec3& angles)
{
    const double cx = std::cos(angles[0]), sx = std::sin(angles[0]), cy = std::cos(angles[1]),
                 sy = std::sin(angles[1]), cz = std::cos(angles[2]), sz = std::sin(angles[2]);
    Mat3 m;
    m << cz * cy, sz * cy, -sy,                                  //
        cz * sy * sx - cx * sz, sy * sx * sz + cx * cz, sx * cy, //
        cx * sy * cz + sx * sz, cx * sy * sz - sx * cz, cx * cy;
    return m;
}

Mat10 element_transformation(const Mat3& to_rod)
{
    Mat10 T = Mat10::Identity();
    T.block<3, 3>(0, 0) = to_rod;
    T.block<3, 3>(5, 5) = to_rod;
    return T;
}

std::size_t stored_full(int nodes)
{
    const auto n = std::size_t(5 * (nodes - 1));
    return n * n;
}

std::size_t stored_band(int nodes)
{
    return std::size_t(4 * 5 - 1) * std::size_t(5 * (nodes - 1));
}

BandMatrix assemble_band(const Rod10& rod, const Mat3& to_rod)
{
    BandMatrix K(rod.unknowns(), kReach);
    concatenate(rod, to_rod, [&](int i, int j, double v) { K(i, j) += v; });
    return K;
}

FullMatrix assemble_full(const Rod10& rod, const Mat3& to_rod)
{
    FullMatrix K(rod.unknowns());
    concatenate(rod, to_rod, [&](int i, int j, double v) { K(i, j) += v; });
    return K;
}

Rod10Solver::Rod10Solver(const Rod10& rod, int every)
    : rod_((check(rod), rod))
    , every_(every)
    , matrix_(rod.unknowns(), kReach)
    , factor_(rod.unknowns(), kReach)
{
    if (every < 1) throw InputError({{"", "every", std::to_string(every), "at least 1 frame"}});
}

void Rod10Solver::orient(const Mat3& to_rod)
{
    now_ = to_rod;
    if (frame_++ % every_ != 0) return;
    factored_ = to_rod;
    matrix_ = assemble_band(rod_, to_rod);
    factor_ = matrix_;
    factor_band(factor_);
}

std::vector<Rod10Node> Rod10Solver::deflections(std::span<const Rod10Node> loads) const
{
    std::vector<double> x = as_numbers(loads);
    solve_band(factor_, x);
    std::vector<Rod10Node> d(loads.size());
    for (std::size_t i = 1; i < d.size(); ++i) {
        const double* v = &x[5 * (i - 1)];
        d[i].along = Vec3(v[0], v[1], v[2]);
        d[i].turn = {v[3], v[4]};
    }
    return d;
}

Rod10Node Rod10Solver::moment(const Vec3& in_space) const
{
    constexpr double kRounding = 1e-12;
    const Vec3 own = now_ * in_space;
    if (std::abs(own.x()) > kRounding * own.norm())
        throw InputError({{"", "moment", std::to_string(own.x()) + " N m about the rod's axis",
                           "none: this rod has no torsion"}});
    Rod10Node n;
    n.turn = {own.y(), own.z()};
    return n;
}

double Rod10Solver::relative_residual(std::span<const Rod10Node> loads,
                                      std::span<const Rod10Node> deflections) const
{
    const std::vector<double> f = as_numbers(loads), x = as_numbers(deflections);
    double missing = 0, size = 0;
    for (int i = 0; i < matrix_.size(); ++i) {
        double sum = -f[std::size_t(i)];
        for (int j = std::max(0, i - kReach); j <= std::min(matrix_.size() - 1, i + kReach); ++j)
            sum += matrix_(i, j) * x[std::size_t(j)];
        missing += sum * sum;
        size += f[std::size_t(i)] * f[std::size_t(i)];
    }
    return size > 0 ? std::sqrt(missing / size) : 0;
}

} // namespace amontons
