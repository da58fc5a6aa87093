#include "solver/outside_solver.hpp"

#include "mesh/base/file.hpp"
#include "solver/child.hpp"
#include "solver/fclib_file.hpp"

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <unistd.h>

namespace amontons {
namespace {

namespace fs = std::filesystem;

/// A folder that no longer exists with it.
class ScratchFolder {
public:
    ScratchFolder() : path_((fs::temp_directory_path() / "amontons_solve_XXXXXX").string())
    {
        if (!::mkdtemp(path_.data()))
            throw InputError(
                {{path_, "", std::strerror(errno), "a folder for what the solver writes"}});
    }
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    ~ScratchFolder()
    {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    std::string file(const char* name) const { return path_ + "/" + name; }

private:
    std::string path_;
};

std::string lines(const std::string& output, const std::string& errors)
{
    std::string all = output;
    if (!all.empty() && all.back() != '\n' && !errors.empty()) all += '\n';
    all += errors;
    if (!all.empty() && all.back() == '\n') all.pop_back();
    return all;
}

} // namespace

OutsideAnswer run_outside_solver(const OutsideSolver& solver, const std::string& problem,
                                 double tolerance, const std::atomic<bool>* stop,
                                 std::string_view instead)
{
    const ScratchFolder scratch;
    std::string given = fs::absolute(problem).string();
    if (!instead.empty()) write_file(given = scratch.file("problem.hdf5"), instead);
    const std::string solved = scratch.file("solved.hdf5");
    ChildJob job;
    job.program = "/bin/sh";
    job.arguments = {"-c",
                     "export AMONTONS_TOLERANCE=\"$3\"\ncd \"$2\" || exit 126\n" + solver.command +
                         " \"$0\" \"$1\"",
                     given,
                     solved,
                     solver.folder,
                     fmt::format("{:.6g}", tolerance)};
    job.most_seconds = std::isfinite(solver.max_seconds) ? solver.max_seconds : 0;
    const std::atomic<bool> never{false};
    std::optional<ChildResult> result;
    run_children({job}, 1, stop ? *stop : never,
                 [&](std::size_t, const ChildResult& r) { result = r; });
    if (!result) throw NoOutsideAnswer("was interrupted");
    OutsideAnswer answer;
    answer.seconds = result->seconds;
    answer.printed = lines(result->output, result->errors);
    const auto refuse = [&](std::string what) {
        if (const std::string last = last_line(answer.printed); !last.empty()) what += ": " + last;
        throw NoOutsideAnswer(what);
    };
    if (result->out_of_time) refuse(fmt::format("did not end within {:.3g} s", job.most_seconds));
    if (result->signal != 0) refuse(fmt::format("ended by signal {}", result->signal));
    if (result->exit_code != 0) refuse(fmt::format("ended with exit code {}", result->exit_code));
    std::error_code ignored;
    if (!fs::exists(solved, ignored)) refuse("wrote no file");
    try {
        const FclibProblem file = read_fclib(solved);
        if (!file.solution || file.solution->r.size() == 0)
            throw NoOutsideAnswer("wrote a file without a reaction (/solution/r)");
        answer.solution = *file.solution;
    } catch (const InputError& error) {
        const Issue& first = error.issues().front();
        throw NoOutsideAnswer("wrote a file that cannot be read: " + first.place +
                              (first.place.empty() ? "" : ": ") + first.found);
    }
    return answer;
}

ContactSolution judged(const ContactProblem& problem, const Eigen::VectorXd& r, double tolerance,
                       ErrorScope scope)
{
    ContactSolution s;
    s.reaction = r;
    s.certificate = certify(problem, s.reaction, tolerance, scope);
    s.u = problem.W * s.reaction + problem.q;
    return s;
}

ContactSolution solve_outside(const OutsideSolver& solver, const ContactProblem& problem,
                              const SolverOptions& options, const Eigen::VectorXd& warm_start)
{
    FclibForm form = fclib_form(problem);
    FclibProblem file;
    if (warm_start.size() == problem.q.size() && !warm_start.isZero(0)) {
        FclibSolution guess;
        guess.r = Eigen::VectorXd::Zero(form.problem.q.size());
        guess.r(form.rows) = warm_start;
        guess.u = form.problem.W * guess.r + form.problem.q;
        file.guesses.push_back(std::move(guess));
    }
    file.title = "a contact problem of a step";
    file.local = std::move(form.problem);
    const ScratchFolder scratch;
    const std::string path = scratch.file("problem.hdf5");
    write_fclib(path, file);
    const OutsideAnswer answer = run_outside_solver(solver, path, options.tolerance, options.stop);
    const Eigen::Index rows = file.local->q.size();
    if (answer.solution.r.size() != rows)
        throw NoOutsideAnswer(fmt::format("wrote a reaction of {} numbers for {} rows",
                                          answer.solution.r.size(), rows));
    ContactSolution s =
        judged(problem, answer.solution.r(form.rows), options.tolerance, options.scope);
    s.certificate.seconds = answer.seconds;
    s.certificate.iterations = 1;
    return s;
}

} // namespace amontons
