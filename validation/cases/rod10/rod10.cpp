// D01, D02, D03: the rod of WSCG 2003; see README.md.

#include "validation/cases/rod10/turning.hpp"
#include "validation/cases/rods/rods.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <fmt/format.h>
#include <map>

namespace amontons::validation {
namespace {

/// Rows: axes of a rod that points along x turned into d.
Mat3 pointing(const Vec3& d)
{
    return Eigen::Quaterniond::FromTwoVectors(Vec3::UnitX(), d).toRotationMatrix().transpose();
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
                    worst = std::max(worst, std::abs(own(d, x).y() / exact - 1));
                }
            }
            rows.push_back(at_most("compliance between any two nodes" + of, worst, kTolerance));
        }
    return rows;
}

std::vector<Measured> rod10_sizes()
{
    std::vector<Measured> rows;
    rows.push_back(absolute("stored numbers, band, 10 nodes", 855, double(stored_band(10)), 0));
    rows.push_back(absolute("stored numbers, full, 10 nodes", 2025, double(stored_full(10)), 0));
    // Operations of the two decompositions, counted as their loops make them.
    const auto band = [](double n, double m) {
        double count = 0;
        for (double k = 0; k < n; ++k) {
            const double rows_below = std::min(n - 1 - k, m);
            count += rows_below * (1 + 2 * rows_below);
        }
        return count;
    };
    const auto full = [](double n) {
        double count = 0;
        for (double k = 0; k < n; ++k)
            count += (n - 1 - k) * (1 + 2 * (n - 1 - k));
        return count;
    };
    rows.push_back(relative("operations of the full decomposition over 2 n^3/3, n = 45", 1,
                            full(45) / 60750, 0.02));
    rows.push_back(relative("operations of the band's over 2 n m^2, 1280 nodes", 1,
                            band(5 * 1279, 9) / (2.0 * 5 * 1279 * 81), 0.06));
    const double slope = std::log2(band(5 * 1279, 9) / band(5 * 639, 9));
    rows.push_back(absolute("slope of the band's operations, 640 to 1280 nodes", 1, slope, 0.01));
    rows.push_back(absolute("slope of the full one's, 640 to 1280 nodes", 3,
                            std::log2(full(5 * 1279) / full(5 * 639)), 0.01));
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
