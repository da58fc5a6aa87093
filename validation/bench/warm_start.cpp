// warm_start FOLDER... [--output FILE.csv] [--solvers nsgs,anderson,auto] [--cap SECONDS]
//
// The contact problems that runs recorded (amontons run --record), each from r = 0 and from the
// solution in the file before it, matched by the contacts' identity. Sums over the problems that
// were solved both ways, those with an indefinite W left out: they need not have a solution.

#include "contact/warm_start.hpp"
#include "contact/analysis.hpp"
#include "contact/solvers/solve.hpp"
#include "mesh/base/file.hpp"
#include "solver/fclib_file.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fmt/format.h>

namespace fs = std::filesystem;
using namespace amontons;

namespace {

struct Arguments {
    std::vector<std::string> folders, solvers{"nsgs", "anderson", "auto"};
    std::string output;
    double cap = 1, tolerance = 1e-8;
};

double processor_seconds()
{
    timespec t{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Of one way to start.
struct Effort {
    double iterations = 0, seconds = 0;
    bool solved = false;
};

Effort effort(const ContactProblem& problem, const SolverOptions& options,
              const Eigen::VectorXd& warm_start)
{
    const double start = processor_seconds();
    const Certificate c = solve(problem, options, warm_start).certificate;
    return {static_cast<double>(c.iterations), processor_seconds() - start, is_solved(c.status)};
}

struct Sums {
    int solved_cold = 0, solved_warm = 0, both = 0, at_once = 0;
    Effort cold, warm;
    std::vector<double> ratios; ///< of the problems that needed an iteration from r = 0
};

/// Errors of the two starts, one a problem.
struct Starts {
    std::vector<double> cold, warm;
};

void add(Sums& sums, const Effort& cold, const Effort& warm)
{
    sums.solved_cold += cold.solved;
    sums.solved_warm += warm.solved;
    if (!cold.solved || !warm.solved) return;
    ++sums.both;
    sums.at_once += warm.iterations == 0;
    sums.cold.iterations += cold.iterations;
    sums.cold.seconds += cold.seconds;
    sums.warm.iterations += warm.iterations;
    sums.warm.seconds += warm.seconds;
    if (cold.iterations > 0)
        sums.ratios.push_back(cold.iterations / std::max(warm.iterations, 1.0));
}

double median(std::vector<double> values)
{
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

void run_folder(const Arguments& a, const std::string& folder, std::string& csv)
{
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.path().extension() == ".hdf5") files.push_back(entry.path());
    std::sort(files.begin(), files.end());

    std::vector<Sums> sums(a.solvers.size());
    Starts starts;
    int problems = 0, indefinite = 0;
    FclibProblem before;
    for (const fs::path& path : files) {
        FclibProblem file = read_fclib(path.string());
        if (!file.local || !file.solution || file.identity.empty())
            throw InputError({{path.string(), "", "not all of these",
                               "a local problem with /solution and /amontons/contact"}});
        const ContactProblem& problem = *file.local;
        if (!before.local) {
            before = std::move(file);
            continue;
        }
        if (analyse(problem).indefinite) {
            ++indefinite;
            before = std::move(file);
            continue;
        }
        ++problems;
        const Eigen::VectorXd warm_start = matched_warm_start(
            *before.local, before.identity, before.solution->r, problem, file.identity);
        const Eigen::VectorXd nothing = Eigen::VectorXd::Zero(problem.q.size());
        starts.cold.push_back(certify(problem, nothing, a.tolerance).error);
        starts.warm.push_back(certify(problem, warm_start, a.tolerance).error);
        for (std::size_t k = 0; k < a.solvers.size(); ++k) {
            SolverOptions options;
            options.solver = contact_solver(a.solvers[k]);
            options.tolerance = a.tolerance;
            options.max_seconds = a.cap;
            options.max_iterations = 1'000'000'000;
            add(sums[k], effort(problem, options, {}), effort(problem, options, warm_start));
        }
        before = std::move(file);
    }
    const double cold_error = median(starts.cold), warm_error = median(starts.warm);
    std::printf("%s: %d problems, %d with an indefinite W left out; median error of r = 0 %.1e, of "
                "the warm start %.1e\n",
                folder.c_str(), problems, indefinite, cold_error, warm_error);
    for (std::size_t k = 0; k < a.solvers.size(); ++k) {
        const Sums& s = sums[k];
        const double sweeps = s.cold.iterations / std::max(s.warm.iterations, 1.0);
        const double seconds = s.cold.seconds / std::max(s.warm.seconds, 1e-9);
        std::printf("  %-9s solved cold %d, warm %d; iterations %.0f -> %.0f, ratio %.2f, median "
                    "%.2f, at once %d; seconds %.3f -> %.3f, ratio %.2f\n",
                    a.solvers[k].c_str(), s.solved_cold, s.solved_warm, s.cold.iterations,
                    s.warm.iterations, sweeps, median(s.ratios), s.at_once, s.cold.seconds,
                    s.warm.seconds, seconds);
        csv += fmt::format(
            "{},{},{:g},{},{},{:.3e},{:.3e},{},{},{},{:.0f},{:.0f},{:.3f},{:.3f},{},{:.4f},{:.4f},"
            "{:.3f}\n",
            folder, a.solvers[k], a.tolerance, problems, indefinite, cold_error, warm_error,
            s.solved_cold, s.solved_warm, s.both, s.cold.iterations, s.warm.iterations, sweeps,
            median(s.ratios), s.at_once, s.cold.seconds, s.warm.seconds, seconds);
    }
}

} // namespace

int main(int argc, char** argv)
{
    Arguments a;
    CLI::App program("What a warm start saves over the steps of recorded runs.", "warm_start");
    program.add_option("FOLDER", a.folders, "Folders of recorded problems")->required();
    program.add_option("--output", a.output, "Table (CSV)");
    program.add_option("--solvers", a.solvers, "Solvers")->delimiter(',');
    program.add_option("--tolerance", a.tolerance, "Error to reach")->capture_default_str();
    program.add_option("--cap", a.cap, "Time of a solve [s]")->capture_default_str();
    CLI11_PARSE(program, argc, argv);
    try {
        std::string csv = "sequence,solver,tolerance,problems,indefinite_left_out,error_of_zero,"
                          "error_of_warm,solved_cold,solved_warm,"
                          "solved_both,iterations_cold,iterations_warm,iterations_ratio,"
                          "median_ratio,warm_solved_at_once,seconds_cold,seconds_warm,"
                          "seconds_ratio\n";
        for (const std::string& folder : a.folders)
            run_folder(a, folder, csv);
        if (!a.output.empty()) write_file(a.output, csv);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "warm_start: %s\n", error.what());
        return 2;
    }
    return 0;
}
