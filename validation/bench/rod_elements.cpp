// Kinds of beam elements side by side: error, observed order and time. CSV on stdout.
//
// Three cantilevers: a small deflection (P L^2/EI = 1e-3), the elastica of alpha 10, and the
// 45-degree bend under 600 N. Time: of one Newton iteration (elements, factor, solve), the least of
// many.

#include "solver/rod10/rod10.hpp"
#include "validation/families/rods/rods.hpp"

#include <chrono>
#include <cmath>
#include <fmt/format.h>

using namespace amontons;
using namespace amontons::validation;

namespace {

constexpr double kPi = 3.14159265358979323846;

struct Result {
    double error = 0, seconds = 0; ///< of the end's displacement; of an iteration
    int iterations = 0;
};

template <class Work> double least_time(Work work)
{
    using Clock = std::chrono::steady_clock;
    double least = 1e300;
    for (int i = 0; i < 50; ++i) {
        const auto start = Clock::now();
        work();
        least = std::min(least, std::chrono::duration<double>(Clock::now() - start).count());
    }
    return least;
}

Result measure(const RodInput& input, const Centreline* curve, double load, int steps,
               const Vec3& exact)
{
    RodBody rod(input, curve, 0);
    double t = 0;
    bring_to(rod, t, load, steps);
    const Vec3 first = rod.first_nodes().back().position();
    Result r;
    r.error = (rod.nodes().back().position() - exact).norm() / (exact - first).norm();
    r.seconds = least_time([&] { rod.linearise(); });
    return r;
}

Result bench(const std::string& kind, const std::string& problem, int n)
{
    if (kind == "wscg2003") {
        Rod10 rod;
        rod.length = 1;
        rod.diameter = 0.004;
        rod.nodes = n + 1;
        Result r;
        const double P = 1e-3 * rod.bending();
        std::vector<Rod10Node> loads(std::size_t(rod.nodes));
        loads.back().along = Vec3(0, P, 0);
        Rod10Solver solver(rod);
        std::vector<Rod10Node> d;
        r.seconds = least_time([&] {
            solver.orient(Mat3::Identity());
            d = solver.deflections(loads);
        });
        r.error = std::abs(d.back().along.y() / (1e-3 / 3) - 1);
        return r;
    }
    RodInput rod;
    if (problem == "bend") {
        rod = uniform_rod(100 * kPi / 4, 1e7 / 12, 5e6 / 6, 1e7, 5e6, n);
        rod.elements = kind;
        rod.loads.push_back(end_load({0, 0, 1}));
        Centreline curve(Vec3::Zero(), Vec3::UnitY(), Vec3::UnitX(), 1e-6);
        curve.append_arc(100, kPi / 4, 0, 1e-6);
        return measure(rod, &curve, 600, 20, {15.6848, 47.15044, 53.47486});
    }
    rod = uniform_rod(1, 1, 0.77, 1e8, 0, n);
    rod.elements = kind;
    rod.loads.push_back(end_load({0, 1, 0}));
    if (problem == "elastica") {
        const Elastica exact = elastica_of(10);
        return measure(rod, nullptr, 10, 20, {1 - exact.u, exact.w, 0});
    }
    // The first two terms of the elastica's series; the next are 1e-12 of them.
    const double a = 1e-3;
    return measure(rod, nullptr, a, 1, {1 - a * a / 15, a / 3 * (1 - 4.0 / 35 * a * a), 0});
}

} // namespace

int main()
{
    fmt::print("elements,problem,n,error,order,seconds_an_iteration\n");
    for (const std::string kind : {"exact", "corotational", "wscg2003"})
        for (const std::string problem : {"small", "elastica", "bend"}) {
            if (kind == "wscg2003" && problem != "small") continue;
            double before = 0;
            for (const int n : {5, 10, 20, 40, 80}) {
                const Result r = bench(kind, problem, n);
                const std::string order = before > 0 && r.error > 0
                                              ? fmt::format("{:.2f}", std::log2(before / r.error))
                                              : "";
                fmt::print("{},{},{},{:.3g},{},{:.3g}\n", kind, problem, n, r.error, order,
                           r.seconds);
                before = r.error;
            }
        }
    return 0;
}
