// D01, D02, D03: the rod of WSCG 2003.

#include "mesh/base/dense.hpp"
#include "validation/families/rod10/turning.hpp"
#include "validation/families/rods/rods.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <fmt/format.h>
#include <map>

namespace amontons::validation {
namespace {

/// Rows: axes of a rod that points along x turned into d.
Mat3 pointing(const Vec3& d)
{
    return rotation_between(Vec3::UnitX(), d).toRotationMatrix().transpose();
}

} // namespace

std::vector<Measured> rod10_statics()
{
    std::vector<Measured> rows;
    constexpr double kTolerance = 1e-10;
    const double P = 1e-5;
    struct Pose {
        const char* name;
        Mat3 to_rod;
    };
    const Pose poses[] = {{"along x", Mat3::Identity()},
                          {"along (1, 2, 3)", pointing(Vec3(1, 2, 3))},
                          {"along -z", pointing(-Vec3::UnitZ())}};
    for (const int nodes : {10, 2})
        for (const Pose& pose : poses) {
            Rod10 rod;
            rod.nodes = nodes;
            const int last = nodes - 1;
            const std::size_t loaded_nodes = std::size_t(nodes);
            const double L = rod.length, EI = rod.bending();
            const std::string of = fmt::format(", {} elements, {}", nodes - 1, pose.name);
            Rod10Solver solver(rod);
            solver.orient(pose.to_rod);
            const auto own = [&](const std::vector<Rod10Node>& d, int node) {
                return Vec3(pose.to_rod * d[std::size_t(node)].along);
            };
            const auto tip = solver.deflections(loaded(rod, pose.to_rod, last, Vec3(0, 0, P)));
            rows.push_back(relative("deflection under an end force [m]" + of,
                                    P * L * L * L / (3 * EI), own(tip, last).z(), kTolerance));
            rows.push_back(relative("slope there [rad]" + of, -P * L * L / (2 * EI),
                                    tip[std::size_t(last)].turn[0], kTolerance));
            const auto pull = solver.deflections(loaded(rod, pose.to_rod, last, Vec3(1, 0, 0)));
            rows.push_back(relative("stretch under 1 N [m]" + of,
                                    L / (rod.youngs_modulus * rod.area()), own(pull, last).x(),
                                    kTolerance));
            std::vector<Rod10Node> moment(loaded_nodes);
            moment.back() = solver.moment(pose.to_rod.transpose() * Vec3(0, 0, 1e-5));
            rows.push_back(relative("deflection under an end moment [m]" + of,
                                    1e-5 * L * L / (2 * EI),
                                    own(solver.deflections(moment), last).y(), kTolerance));
            // Consistent loads of q: q l/2 and q l^2/12 at the ends of each element.
            const double l = rod.element(), q = 1e-5;
            std::vector<Rod10Node> line(loaded_nodes);
            for (int e = 0; e < last; ++e)
                for (int end = 0; end < 2; ++end) {
                    Rod10Node& n = line[std::size_t(e + end)];
                    n.along += pose.to_rod.transpose() * Vec3(0, q * l / 2, 0);
                    n.turn[1] += (end == 0 ? 1 : -1) * q * l * l / 12;
                }
            rows.push_back(relative("deflection under a line load [m]" + of,
                                    q * std::pow(L, 4) / (8 * EI),
                                    own(solver.deflections(line), last).y(), kTolerance));
            if (nodes == 2) continue;
            // Compliance between all nodes.
            double worst = 0;
            for (int s = 1; s < nodes; ++s) {
                const auto d = solver.deflections(loaded(rod, pose.to_rod, s, Vec3(0, 1, 0)));
                for (int x = 1; x < nodes; ++x) {
                    const double near = std::min(s, x) * l, far = std::max(s, x) * l;
                    const double exact = near * near * (3 * far - near) / (6 * EI);
                    raise_to(worst, std::abs(own(d, x).y() / exact - 1));
                }
            }
            rows.push_back(at_most("compliance between any two nodes" + of, worst, kTolerance));
        }
    return rows;
}

std::vector<Measured> rod10_sizes()
{
    std::vector<Measured> rows;
    // Of the matrices that are factored.
    const Rod10 rod;
    const Mat3 to_rod = pointing(Vec3(1, 2, 3));
    BandMatrix band = assemble_band(rod, to_rod);
    FullMatrix full = assemble_full(rod, to_rod);
    rows.push_back(absolute("stored numbers, band, 10 nodes", 855, double(band.stored()), 0));
    rows.push_back(absolute("stored numbers, full, 10 nodes", 2025, double(full.values.size()), 0));
    double largest = 0, outside = 0;
    for (int i = 0; i < full.size; ++i)
        for (int j = 0; j < full.size; ++j) {
            raise_to(largest, std::abs(full(i, j)));
            if (std::abs(i - j) > band.reach()) raise_to(outside, std::abs(full(i, j)));
        }
    rows.push_back(at_most("largest number beyond the band, of the largest", outside / largest, 0));
    // Both decompositions against the closed form: an end force, and its moment's turn.
    const double P = 1e-5, w = P * std::pow(rod.length, 3) / (3 * rod.bending());
    const Vec3 side = to_rod.transpose() * Vec3::UnitZ();
    std::vector<double> by_band(std::size_t(rod.unknowns()), 0.0);
    for (int k = 0; k < 3; ++k)
        by_band[by_band.size() - 5 + std::size_t(k)] = P * side[k];
    std::vector<double> by_full = by_band;
    factor_band(band);
    solve_band(band, by_band);
    factor_full(full);
    solve_full(full, by_full);
    for (const auto& [name, x] : {std::pair{"band", &by_band}, {"full", &by_full}}) {
        const double* end = x->data() + x->size() - 5;
        rows.push_back(relative(fmt::format("deflection under an end force [m], {}", name), w,
                                side.dot(Vec3(end[0], end[1], end[2])), 1e-10));
    }
    rows.push_back(left_out("D02: times of the two decompositions and their slopes, 1 and 3",
                            "a time is no reference for another machine; rod10_bench measures them "
                            "to 1280 nodes"));
    return rows;
}

std::vector<Measured> rod10_turning()
{
    std::vector<Measured> rows;
    const Rod10 rod;
    std::map<int, double> worst;
    for (const int every : {1, 2, 5, 10}) {
        const TurningErrors e = turning_errors(rod, every);
        worst[every] = e.deflection;
        if (every == 1) {
            rows.push_back(
                at_most("deflection in the turned frame, every frame", e.deflection, 1e-8));
            rows.push_back(at_most("change of the length, every frame", e.length, 1e-8));
        }
    }
    // Left out for k frames: in error by the turn since then, to first order.
    for (const int every : {2, 5, 10})
        rows.push_back(relative(
            fmt::format("error of the deflection, steps 2 to 7 each {} frames, over the turn",
                        every),
            1, worst[every] / (kTurnOfFrame * (every - 1)), 0.03));
    return rows;
}

} // namespace amontons::validation
