// W r of a rod's contacts: time against nodes and contacts. CSV and plot.
//
//     rod_compliance_bench [DIR]   (default docs/results)
//
// A cantilever of n elements bent to a quarter of a turn, with frictional contacts at some of its
// nodes. Times, the least of many: a Newton iteration (elements, tangent, factor), and the product
// W r = C^T (A^-1 (C r)), one forward and one backward sweep between two sparse products.

#include "validation/families/rods/rods.hpp"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <fmt/format.h>

using namespace amontons;
using namespace amontons::validation;

namespace {

template <class Work> double least_time(int rounds, Work work)
{
    using Clock = std::chrono::steady_clock;
    double least = 1e300;
    for (int i = 0; i < rounds; ++i) {
        const auto start = Clock::now();
        work();
        least = std::min(least, std::chrono::duration<double>(Clock::now() - start).count());
    }
    return least;
}

struct Times {
    double iteration, product; ///< [s]
};

Times measure(int elements, int contacts)
{
    RodInput input = uniform_rod(1, 1, 0.77, 1e5, 0, elements);
    RodLoad l;
    l.set = "end";
    l.moment = Vec3(0, 0, 1.57);
    input.loads.push_back(l);
    RodBody rod(input, nullptr, 0);
    StepInput step;
    step.h = 1;
    rod.begin(step);
    const Eigen::VectorXd none;
    rod.linearise();
    rod.update(rod.free_change(), none, none);
    rod.linearise();
    std::vector<Eigen::Triplet<double>> triplets;
    for (int c = 0; c < contacts; ++c) {
        const int e = int(double(c + 0.5) / contacts * elements);
        const StencilEntry at{e, 0.5};
        const Vec3 x = rod_point(rod.model(), rod.nodes(), e, 0.5);
        for (int k = 0; k < 3; ++k)
            rod.add_column({{&at, 1}, x}, Vec3::Unit(k), 1, 3 * c + k, triplets);
    }
    SparseColumns C(rod.unknowns(), 3 * contacts);
    C.setFromTriplets(triplets.begin(), triplets.end());
    const Eigen::VectorXd r = Eigen::VectorXd::LinSpaced(3 * contacts, -1, 1);
    Eigen::VectorXd u;
    const int rounds = std::max(100, 200'000 / elements);
    Times t{};
    t.iteration = least_time(rounds, [&] { rod.linearise(); });
    t.product = least_time(rounds, [&] { u = C.transpose() * rod.solve(C * r); });
    return t;
}

double exponent(double a, double b, double ratio)
{
    return std::log(b / a) / std::log(ratio);
}

} // namespace

int main(int argc, char** argv)
{
    if (argc > 1 && argv[1][0] == '-') {
        fmt::print(stderr, "rod_compliance_bench [FOLDER]\n");
        return 2;
    }
    const std::string directory = argc > 1 ? argv[1] : "docs/results";
    const std::string path = directory + "/rod_compliance.csv";
    std::FILE* file = std::fopen(path.c_str(), "w");
    if (!file) {
        fmt::print(stderr, "{}: cannot be written\n", path);
        return 2;
    }
    fmt::print(file, "family,nodes,contacts,iteration [us],product W r [us]\n");
    const auto row = [&](const char* family, int elements, int contacts) {
        const Times t = measure(elements, contacts);
        fmt::print(file, "{},{},{},{:.4g},{:.4g}\n", family, elements + 1, contacts,
                   1e6 * t.iteration, 1e6 * t.product);
        return t;
    };
    Times first{}, last{};
    for (const int n : {100, 200, 400, 1000, 2000, 4000, 10'000}) {
        const Times t = row("nodes", n, 50);
        if (n == 100) first = t;
        last = t;
    }
    fmt::print("100 to 10 000 nodes, 50 contacts: iteration n^{:.2f}, W r n^{:.2f}\n",
               exponent(first.iteration, last.iteration, 100),
               exponent(first.product, last.product, 100));
    for (const int n : {100, 200, 400, 1000, 2000, 4000, 10'000}) {
        const Times t = row("both", n, n);
        if (n == 100) first = t;
        last = t;
    }
    fmt::print("100 to 10 000 nodes, a contact at each: W r n^{:.2f}\n",
               exponent(first.product, last.product, 100));
    for (const int c : {10, 100, 1000, 2000})
        row("contacts", 2000, c);
    std::fclose(file);
    std::FILE* plot = popen("gnuplot", "w");
    if (!plot) return 0;
    fmt::print(plot,
               "set terminal svg size 760,520 background 'white'\nset output '{0}.svg'\n"
               "set datafile separator ','\nset logscale xy\nset grid\nset key left top\n"
               "set title 'A rod and its contacts'\nset xlabel 'nodes'\n"
               "set ylabel 'time [us]'\n"
               "plot '< grep ^nodes, {0}.csv' using 2:5 with linespoints lw 2 title "
               "'W r, 50 contacts', '< grep ^both, {0}.csv' using 2:5 with linespoints lw 2 title "
               "'W r, a contact at each node', '< grep ^nodes, {0}.csv' using 2:4 with linespoints "
               "dt 2 title 'Newton iteration: elements, factor'\n",
               path.substr(0, path.size() - 4));
    pclose(plot);
    return 0;
}
