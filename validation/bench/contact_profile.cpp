// contact_profile [--problems FOLDER] [--output FOLDER] [--cap SECONDS] [--siconos DRIVER] ...
//
// Every solver on every FCLib file of a folder (without one: on a set that it generates), each in
// a process of its own with a cap on its processor time, its answer judged by certify alone. Writes
// profile.csv, against_siconos.csv (ours by default against the best of theirs), performance
// profiles (Dolan & Moré: share of the problems that a solver brings to the tolerance within tau
// times the quickest one's time), and error against time per problem.

#include "contact/solvers/solve.hpp"
#include "mesh/base/file.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/fclib_file.hpp"
#include "solver/output/plot.hpp"
#include "validation/contact/problem_set.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <sys/mman.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

namespace fs = std::filesystem;
using namespace amontons;

namespace {

constexpr int kHistory = 1000;  // points that are kept of a solve
constexpr double kShort = 0.05; // solves below this are repeated, and the best counts [s]
constexpr int kRepeats = 5;
constexpr double kShortest = 0.3; // no cap is below this [s]
constexpr int kDuels = 2;         // ours and the best of Siconos once more, in turns
const std::string kTheirs = "siconos ";
constexpr double kStricter[] = {1, 0.1, 0.01}; // Siconos' own criterion may hold too early

struct Arguments {
    std::string problems, output = "out/contact_profile", siconos, only;
    std::vector<double> tolerances{1e-4, 1e-8};
    double cap = 5, size = 1;
    double give_up = 0; ///< a solve ends at this many times the quickest of its problem; 0: not
    double freeze = SolverOptions{}.nsgs.freeze;
    unsigned seed = 1;
};

/// One solver on one problem to one tolerance.
struct Outcome {
    std::string problem, solver, status; ///< solved, failed, timeout, crash, skipped
    int contacts = 0;
    double tolerance = 0, seconds = 0, error = std::numeric_limits<double>::infinity();
    double scaled_error = error;
    double given_tolerance = 0; ///< the tolerance that a solver of Siconos was given for it
    int iterations = 0;
    std::vector<ErrorPoint> history;
};

double processor_seconds()
{
    timespec t{};
    ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// Waits for a child, no longer than `seconds`. @return  true if it ended by itself
bool ended(pid_t child, double seconds, int& status)
{
    const Stopwatch watch;
    while (::waitpid(child, &status, WNOHANG) == 0) {
        if (watch.seconds() > seconds) {
            ::kill(child, SIGKILL);
            ::waitpid(child, &status, 0);
            return false;
        }
        ::usleep(1000);
    }
    return true;
}

void judge(Outcome& o, const ContactProblem& problem, const Eigen::VectorXd& r, bool done)
{
    const Certificate c = certify(problem, r, o.tolerance);
    o.error = c.error;
    o.scaled_error = c.scaled_error;
    if (done) o.status = is_solved(c.status) ? "solved" : "failed";
}

/// What a child and its parent share.
struct Shared {
    double seconds;
    int iterations, points, done;
    ErrorPoint history[kHistory];
};

Outcome run_ours(const ContactProblem& problem, ContactSolver solver, double tolerance, double cap,
                 double freeze)
{
    Outcome o;
    o.solver = name(solver);
    o.tolerance = tolerance;
    const auto rows = static_cast<std::size_t>(problem.q.size());
    const std::size_t size = sizeof(Shared) + rows * sizeof(double);
    void* memory = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    auto* shared = new (memory) Shared{};
    auto* r = reinterpret_cast<double*>(shared + 1);
    const pid_t child = ::fork();
    if (child == 0) {
        SolverOptions options;
        options.solver = solver;
        options.tolerance = tolerance;
        options.max_seconds = cap;
        options.max_iterations = 1'000'000'000;
        options.nsgs.freeze = freeze;
        double best = std::numeric_limits<double>::infinity();
        for (int k = 0; k < kRepeats && (k == 0 || best < kShort); ++k) {
            const double start = processor_seconds();
            const ContactSolution s = solve(problem, options);
            const double seconds = processor_seconds() - start;
            if (seconds >= best) continue;
            best = seconds;
            shared->seconds = seconds;
            shared->iterations = s.certificate.iterations;
            shared->points = static_cast<int>(std::min<std::size_t>(s.history.size(), kHistory));
            std::copy_n(s.history.begin(), shared->points, shared->history);
            std::copy(s.reaction.begin(), s.reaction.end(), r);
        }
        shared->done = 1;
        ::_exit(0);
    }
    int status = 0;
    const bool in_time = ended(child, 4 * cap + 5, status);
    o.seconds = shared->seconds;
    o.iterations = shared->iterations;
    o.history.assign(shared->history, shared->history + shared->points);
    o.status = in_time ? "crash" : "timeout";
    judge(o, problem, Eigen::Map<const Eigen::VectorXd>(r, static_cast<Eigen::Index>(rows)),
          shared->done == 1);
    if (o.status == "failed" && o.seconds >= 0.95 * cap) o.status = "timeout";
    ::munmap(memory, size);
    return o;
}

// ---- Siconos, if its driver is there

/// The problem in Siconos' own scale: trace(W) = rows, |q| = 1. @return  what scales r back
double write_for_siconos(const ContactProblem& p, const std::string& path)
{
    const double rho = static_cast<double>(p.W.rows()) / p.W.diagonal().sum();
    const double size = rho * p.q.norm();
    Eigen::SparseMatrix<double> W = p.W.is_dense()
                                        ? Eigen::SparseMatrix<double>(p.W.dense().sparseView(0, 0))
                                        : p.W.as_sparse();
    W *= rho;
    const Eigen::VectorXd q = rho / size * p.q;
    std::ofstream file(path, std::ios::binary);
    const auto put = [&](const auto* data, Eigen::Index count) {
        file.write(reinterpret_cast<const char*>(data),
                   static_cast<std::streamsize>(static_cast<std::size_t>(count) * sizeof *data));
    };
    const std::int32_t sizes[2] = {static_cast<std::int32_t>(W.rows()),
                                   static_cast<std::int32_t>(W.nonZeros())};
    put(sizes, 2);
    put(W.outerIndexPtr(), W.cols() + 1);
    put(W.innerIndexPtr(), W.nonZeros());
    put(W.valuePtr(), W.nonZeros());
    put(q.data(), q.size());
    put(p.mu.data(), p.mu.size());
    return size;
}

int run_program(std::vector<std::string> words, double seconds, const char* output)
{
    const pid_t child = ::fork();
    if (child == 0) {
        if (output && !std::freopen(output, "w", stdout)) ::_exit(127);
        std::vector<char*> arguments;
        for (std::string& w : words)
            arguments.push_back(w.data());
        arguments.push_back(nullptr);
        ::execv(arguments[0], arguments.data());
        ::_exit(127);
    }
    int status = 0;
    if (!ended(child, seconds, status)) return -1;
    if (WIFSIGNALED(status)) return WTERMSIG(status) == SIGPROF ? -1 : -2;
    return WEXITSTATUS(status);
}

Outcome run_siconos(const ContactProblem& problem, double scale, const std::string& solver,
                    double tolerance, double cap, const Arguments& a)
{
    Outcome o;
    o.solver = kTheirs + solver;
    o.tolerance = tolerance;
    const std::string input = a.output + "/siconos.problem", answer = a.output + "/siconos.answer";
    for (const double stricter : kStricter) {
        fs::remove(answer);
        o.given_tolerance = stricter * tolerance;
        const int ended =
            run_program({a.siconos, input, answer, solver, fmt::format("{}", o.given_tolerance),
                         fmt::format("{}", cap)},
                        4 * cap + 5, nullptr);
        std::vector<double> numbers(static_cast<std::size_t>(problem.q.size()) + 2, 0.0);
        std::ifstream file(answer, std::ios::binary);
        const auto bytes = static_cast<std::streamsize>(numbers.size() * sizeof(double));
        file.read(reinterpret_cast<char*>(numbers.data()), bytes);
        if (file.gcount() != bytes) { // no solve was finished, not even the first
            o.status = ended == -1 ? "timeout" : "crash";
            o.seconds = ended == -1 ? cap : 0;
            return o;
        }
        o.seconds = numbers[0];
        o.iterations = static_cast<int>(numbers[1]);
        const Eigen::VectorXd r =
            scale * Eigen::Map<const Eigen::VectorXd>(numbers.data() + 2, problem.q.size());
        judge(o, problem, r, true);
        if (o.status == "solved") break;
    }
    if (o.status == "solved") o.history = {{0, o.seconds, o.error}};
    return o;
}

std::vector<std::string> siconos_solvers(const Arguments& a)
{
    std::vector<std::string> names;
    if (a.siconos.empty()) return names;
    const std::string list = a.output + "/siconos.list";
    if (run_program({a.siconos, "list"}, 30, list.c_str()) != 0)
        throw InputError(
            {{a.siconos, "", "a program that does not list its solvers", "siconos_driver"}});
    std::ifstream file(list);
    for (std::string name; file >> name;)
        names.push_back(name);
    fs::remove(list);
    return names;
}

// ---- what came out

std::string csv(const std::vector<Outcome>& all)
{
    std::string t = "problem,contacts,solver,tolerance,status,processor_seconds,iterations,error,"
                    "error_scaled_by_contact\n";
    for (const Outcome& o : all)
        t += fmt::format("{},{},{},{:g},{},{:.6f},{},{:.3e},{:.3e}\n", o.problem, o.contacts,
                         o.solver, o.tolerance, o.status, o.seconds, o.iterations, o.error,
                         o.scaled_error);
    return t;
}

struct Curve {
    std::string label;
    std::vector<std::array<double, 2>> points;
};

/// Writes NAME.dat and NAME.gp, and NAME.svg where gnuplot is.
void plot(const std::string& folder, const std::string& name, const std::string& settings,
          const std::vector<Curve>& curves, const char* style)
{
    std::string data, lines;
    int index = 0;
    for (const Curve& c : curves) {
        if (c.points.empty()) continue;
        for (const auto& p : c.points)
            data += fmt::format("{:.6g} {:.6g}\n", p[0], p[1]);
        data += "\n\n";
        lines += fmt::format("{}  '{}.dat' index {} with {} lw 2 title \"{}\"",
                             index ? ", \\\n" : "", name, index, style, c.label);
        ++index;
    }
    if (index == 0) return;
    write_file(folder + "/" + name + ".dat", data);
    write_file(folder + "/" + name + ".gp",
               fmt::format("# Draw again: gnuplot {0}.gp, in this folder.\n"
                           "set terminal svg size 760,480 dynamic background 'white'\n"
                           "set output '{0}.svg'\nset grid\nset key outside right noenhanced\n{1}\n"
                           "plot \\\n{2}\n",
                           name, settings, lines));
    draw_plot(folder, name + ".gp");
}

/// A solve to a stricter tolerance counts: Siconos' own criterion can end a looser one too early.
bool reached(const Outcome& o, double tolerance)
{
    return o.tolerance <= tolerance && o.status == "solved";
}

void performance_profile(const std::vector<Outcome>& all, double tolerance,
                         const std::string& folder)
{
    std::map<std::string, double> quickest;                       // per problem
    std::map<std::string, std::map<std::string, double>> seconds; // per solver and problem
    std::vector<std::string> solvers;
    std::set<std::string> problems;
    for (const Outcome& o : all) {
        problems.insert(o.problem);
        if (std::find(solvers.begin(), solvers.end(), o.solver) == solvers.end())
            solvers.push_back(o.solver);
        if (!reached(o, tolerance)) continue;
        for (double* s : {&quickest.emplace(o.problem, o.seconds).first->second,
                          &seconds[o.solver].emplace(o.problem, o.seconds).first->second})
            *s = std::min(*s, o.seconds);
    }
    const auto count = static_cast<double>(problems.size());
    std::vector<Curve> curves;
    for (const std::string& s : solvers) {
        std::vector<double> ratio;
        for (const auto& [problem, time] : seconds[s])
            ratio.push_back(time / std::max(quickest[problem], 1e-9));
        std::sort(ratio.begin(), ratio.end());
        Curve c{s, {}};
        for (std::size_t k = 0; k < ratio.size(); ++k)
            c.points.push_back({ratio[k], static_cast<double>(k + 1) / count});
        if (!c.points.empty()) c.points.push_back({1e4, c.points.back()[1]});
        curves.push_back(std::move(c));
        std::printf("  %-24s %3.0f %% solved, %3.0f %% within twice the quickest\n", s.c_str(),
                    100 * static_cast<double>(ratio.size()) / count,
                    100 *
                        static_cast<double>(std::count_if(ratio.begin(), ratio.end(),
                                                          [](double x) { return x <= 2; })) /
                        count);
    }
    plot(folder, fmt::format("profile_{:g}", tolerance),
         fmt::format("set logscale x\nset xrange [1:1e4]\nset yrange [0:1.02]\n"
                     "set xlabel 'time over the time of the quickest solver'\n"
                     "set ylabel 'share of {} problems, error <= {:g}'",
                     problems.size(), tolerance),
         curves, "steps");
}

void error_against_time(const std::vector<Outcome>& all, const std::string& problem,
                        const std::string& folder)
{
    double strictest = 1;
    for (const Outcome& o : all)
        strictest = std::min(strictest, o.tolerance);
    std::map<std::string, Curve> curves;
    for (const Outcome& o : all) {
        const bool ours = o.solver.rfind(kTheirs, 0) != 0;
        if (o.problem != problem || (ours && o.tolerance != strictest)) continue;
        Curve& c = curves[o.solver];
        c.label = o.solver;
        for (const ErrorPoint& p : o.history)
            if (p.error > 0 && p.error < 1e3)
                c.points.push_back({std::max(p.seconds, 1e-6), p.error});
    }
    std::vector<Curve> list;
    for (auto& [solver, c] : curves)
        list.push_back(std::move(c));
    plot(folder, "history_" + problem,
         "set logscale xy\nset format y '%.0e'\nset xlabel 'seconds'\nset ylabel 'error'", list,
         "linespoints pt 7 ps 0.3");
}

/// Ours by default, and the quickest of Siconos' that solved it; from `first` on.
struct Best {
    std::optional<std::size_t> ours, theirs;
};

Best best_of(const std::vector<Outcome>& all, std::size_t first, double tolerance)
{
    Best best;
    for (std::size_t k = first; k < all.size(); ++k) {
        if (all[k].solver == name(ContactSolver::automatic) && all[k].tolerance == tolerance)
            best.ours = k;
        if (all[k].solver.rfind(kTheirs, 0) == 0 && reached(all[k], tolerance) &&
            (!best.theirs || all[k].seconds < all[*best.theirs].seconds))
            best.theirs = k;
    }
    return best;
}

const char* const kComparisonHead =
    "problem,contacts,tolerance,ours_status,ours_seconds,ours_error,"
    "siconos_best,siconos_seconds,siconos_error,ours_over_siconos\n";

/// The line of one problem and tolerance.
std::string comparison(const std::vector<Outcome>& all, const Best& best, double tolerance)
{
    if (!best.ours) return {};
    const Outcome& o = all[*best.ours];
    std::string line = fmt::format("{},{},{:g},{},{:.6f},{:.3e},", o.problem, o.contacts, tolerance,
                                   o.status, o.seconds, o.error);
    if (!best.theirs) return line + "none,,,\n";
    const Outcome& t = all[*best.theirs];
    line += fmt::format("{},{:.6f},{:.3e},", t.solver.substr(kTheirs.size()), t.seconds, t.error);
    return line + (o.status == "solved" ? fmt::format("{:.3f}\n", o.seconds / t.seconds) : "\n");
}

int run(Arguments a)
{
    std::sort(a.tolerances.begin(), a.tolerances.end(), std::greater<>());
    make_folder(a.output);
    if (a.problems.empty()) {
        a.problems = a.output + "/problems";
        make_folder(a.problems);
        for (const NamedProblem& p : problem_set(a.seed, a.size))
            write_fclib(a.problems + "/" + p.name + ".hdf5", as_file(p));
        std::printf("generated in %s\n", a.problems.c_str());
    }
    // ---- Problems
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(a.problems))
        if (entry.path().extension() == ".hdf5") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    const std::vector<std::string> siconos = siconos_solvers(a);

    // ---- Every solver on every problem, to each tolerance
    std::vector<Outcome> all;
    std::string against = kComparisonHead;
    for (const fs::path& path : files) {
        const FclibProblem file = read_fclib(path.string());
        const ContactProblem problem =
            file.local ? *file.local : CondensedProblem(*file.global).contact();
        const double scale = siconos.empty() || problem.W.is_matrix_free()
                                 ? 0
                                 : write_for_siconos(problem, a.output + "/siconos.problem");
        const auto keep = [&](Outcome o) {
            o.problem = path.stem().string();
            o.contacts = contact_count(problem);
            std::printf("%-28s %4d %-22s %.0e %-8s %9.5f s %8d  %.1e\n", o.problem.c_str(),
                        o.contacts, o.solver.c_str(), o.tolerance, o.status.c_str(), o.seconds,
                        o.iterations, o.error);
            std::fflush(stdout);
            all.push_back(std::move(o));
        };
        const auto selected = [&](const std::string& solver) {
            return a.only.empty() ||
                   ("," + a.only + ",").find("," + solver + ",") != std::string::npos;
        };
        const std::size_t first_of_problem = all.size();
        std::map<std::string, double> too_slow; // to a looser tolerance, within this time
        for (const double tolerance : a.tolerances) {
            const std::size_t first = all.size();
            const auto cap = [&] {
                double quickest = a.cap;
                for (std::size_t k = first; k < all.size(); ++k)
                    if (all[k].status == "solved")
                        quickest =
                            std::min(quickest, std::max(kShortest, a.give_up * all[k].seconds));
                return a.give_up > 0 ? quickest : a.cap;
            };
            const auto enter = [&](const std::string& solver, auto run_one) {
                Outcome o;
                o.solver = solver;
                o.tolerance = tolerance;
                o.status = "skipped";
                const double most = cap();
                const auto slow = too_slow.find(solver);
                if (slow == too_slow.end() || slow->second < most) o = run_one(most);
                if (o.status == "timeout") too_slow[solver] = most;
                keep(std::move(o));
            };
            for (const ContactSolver solver : kContactSolvers)
                if (selected(name(solver)))
                    enter(name(solver), [&](double most) {
                        return run_ours(problem, solver, tolerance, most, a.freeze);
                    });
            if (scale > 0 && problem.kind.empty())
                for (const std::string& solver : siconos)
                    if (selected(solver))
                        enter(kTheirs + solver, [&](double most) {
                            return run_siconos(problem, scale, solver, tolerance, most, a);
                        });
        }
        // ---- The two fastest once more, in turns
        for (const double tolerance : a.tolerances) {
            const Best best = best_of(all, first_of_problem, tolerance);
            for (int k = 0; k < kDuels && best.ours && best.theirs; ++k)
                for (const std::size_t which : {*best.ours, *best.theirs}) {
                    Outcome& o = all[which];
                    if (o.seconds > 1) continue;
                    const Outcome again =
                        which == *best.theirs
                            ? run_siconos(problem, scale, o.solver.substr(kTheirs.size()),
                                          o.given_tolerance, a.cap, a)
                            : run_ours(problem, ContactSolver::automatic, tolerance, a.cap,
                                       a.freeze);
                    if (again.error <= tolerance) o.seconds = std::min(o.seconds, again.seconds);
                }
            against += comparison(all, best, tolerance);
        }
        if (!siconos.empty()) write_file(a.output + "/against_siconos.csv", against);
        error_against_time(all, path.stem().string(), a.output);
        write_file(a.output + "/profile.csv", csv(all)); // what is there, should this be stopped
    }
    // ---- Performance profiles
    for (const double tolerance : a.tolerances) {
        std::printf("to %g:\n", tolerance);
        performance_profile(all, tolerance, a.output);
    }
    for (const char* left : {"/siconos.problem", "/siconos.answer"})
        fs::remove(a.output + left);
    return 0;
}

} // namespace

int main(int argc, char** argv)
{
    Arguments a;
    CLI::App program("Performance profiles of the contact solvers.", "contact_profile");
    program.add_option("--problems", a.problems, "Folder of FCLib files (default: generated)");
    program.add_option("--output", a.output, "Folder for tables and plots")->capture_default_str();
    program.add_option("--cap", a.cap, "Processor time of a solve [s]")->capture_default_str();
    program.add_option("--tolerances", a.tolerances, "Errors to reach")->delimiter(',');
    program.add_option("--solvers", a.only, "Only these, separated by commas");
    program.add_option("--siconos", a.siconos, "The program siconos_driver");
    program.add_option("--give-up", a.give_up,
                       "Ends a solve at this many times the quickest so far; 0: only at the cap");
    program.add_option("--freeze", a.freeze, "SolverOptions::Nsgs::freeze")->capture_default_str();
    program.add_option("--seed", a.seed, "Of the generated problems")->capture_default_str();
    program.add_option("--size", a.size, "Of the generated problems")->capture_default_str();
    CLI11_PARSE(program, argc, argv);
    try {
        // The libraries read these before main. With threads in the parent a fork would hang, and
        // the clock of one thread would not see the others.
        const char* threads = std::getenv("OMP_NUM_THREADS");
        if (!threads || std::strcmp(threads, "1") != 0) {
            ::setenv("OMP_NUM_THREADS", "1", 1);
            ::setenv("OPENBLAS_NUM_THREADS", "1", 1);
            ::execv("/proc/self/exe", argv);
        }
        return run(a);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "contact_profile: %s\n", error.what());
        return 2;
    }
}
