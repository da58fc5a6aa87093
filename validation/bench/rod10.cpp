// Table 3 of WSCG 2003 again: time of the whole procedure (steps 1 to 8) with the band's
// decomposition (A) and with the full one (B), against nodes. CSV on stdout.
// usage: rod10_bench [most nodes of the full one, default 320; 1280 takes a minute]
//        rod10_bench turning   time of a frame of a rod that turns by a degree each, against the
//                              error of its deflection, with steps 2 to 7 in every k-th frame only

#include "validation/families/rod10/turning.hpp"

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <fmt/format.h>
#include <string_view>

using namespace amontons;

namespace {

/// Processor time of this thread [s].
double now()
{
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

/// The least of some times of work [s].
template <class Work> double least_time(Work work)
{
    double least = 1e300, sum = 0;
    for (int i = 0; i < 200 && (sum < 0.2 || i < 3); ++i) {
        const double start = now();
        work();
        const double t = now() - start;
        least = std::min(least, t);
        sum += t;
    }
    return least;
}

void print_turning()
{
    fmt::print("nodes,every,frame_s,error\n");
    for (const int nodes : {10, 40, 160})
        for (const int every : {1, 2, 3, 5, 10, 20, 45}) {
            Rod10 rod;
            rod.nodes = nodes;
            std::vector<Mat3> pose;
            std::vector<std::vector<Rod10Node>> load;
            for (int frame = 0; frame < validation::kTurnFrames; ++frame) {
                pose.push_back(validation::turned_to(frame));
                load.push_back(validation::loaded(rod, pose.back(), nodes - 1, {0, 1e-5, 0}));
            }
            const double turn = least_time([&] {
                Rod10Solver solver(rod, every);
                for (std::size_t frame = 0; frame < pose.size(); ++frame) {
                    solver.orient(pose[frame]);
                    solver.deflections(load[frame]);
                }
            });
            fmt::print("{},{},{:.4g},{:.3g}\n", nodes, every, turn / validation::kTurnFrames,
                       validation::turning_errors(rod, every).deflection);
        }
}

} // namespace

int main(int argc, char** argv)
{
    if (argc > 1 && std::string_view(argv[1]) == "turning") {
        print_turning();
        return 0;
    }
    const int most = argc > 1 ? std::atoi(argv[1]) : 320;
    fmt::print("nodes,stored_band,stored_full,band_s,full_s,ratio,back_substitution_s,"
               "paper_band_s,paper_full_s\n");
    struct Paper {
        double band, full;
    };
    // 10 nodes stand over the fourth column; the others are two nodes apart
    constexpr Paper kPaper[] = {{0.15e-3, 0.22e-3}, {0.23e-3, 0.47e-3}, {0.31e-3, 0.92e-3},
                                {0.37e-3, 1.62e-3}, {0.45e-3, 2.61e-3}, {0.53e-3, 3.92e-3},
                                {0.59e-3, 5.62e-3}, {0.67e-3, 7.78e-3}};
    int row = 0;
    for (const int nodes : {4, 6, 8, 10, 12, 14, 16, 18, 20, 40, 80, 160, 320, 640, 1280}) {
        Rod10 rod;
        rod.nodes = nodes;
        const Mat3 to_rod = rotation_of_angles({0.3, 0.2, 0.1});
        std::vector<double> load(std::size_t(rod.unknowns()), 1e-6), x = load;
        BandMatrix kept = assemble_band(rod, to_rod);
        factor_band(kept);
        const double band = least_time([&] {
            BandMatrix K = assemble_band(rod, to_rod);
            factor_band(K);
            x = load;
            solve_band(K, x);
        });
        const double again = least_time([&] {
            x = load;
            solve_band(kept, x);
        });
        double full = 0;
        if (nodes <= most)
            full = least_time([&] {
                FullMatrix K = assemble_full(rod, to_rod);
                factor_full(K);
                x = load;
                solve_full(K, x);
            });
        const bool known = row < 8;
        fmt::print("{},{},{},{:.4g},{},{},{:.4g},{},{}\n", nodes, stored_band(nodes),
                   stored_full(nodes), band, full > 0 ? fmt::format("{:.4g}", full) : "",
                   full > 0 ? fmt::format("{:.3g}", full / band) : "", again,
                   known ? fmt::format("{:.4g}", kPaper[row].band) : "",
                   known ? fmt::format("{:.4g}", kPaper[row].full) : "");
        ++row;
    }
    return 0;
}
