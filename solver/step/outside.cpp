#include "solver/step/outside.hpp"

#include "mesh/base/error.hpp"
#include "solver/outside_solver.hpp"
#include "solver/scene/scene.hpp"

#include <filesystem>
#include <fmt/format.h>
#include <map>
#include <mutex>

namespace amontons {
namespace {

/// What the process has registered. Never destroyed: its functions may belong to an interpreter
/// that has ended before.
struct Registered {
    std::mutex mutex;
    std::map<std::string, OutsideFunction> functions;
};

Registered& registered()
{
    static Registered* const all = new Registered;
    return *all;
}

OutsideFunction function_of(const Scene& scene)
{
    const std::string& name = scene.contact_solver.function;
    Registered& all = registered();
    const std::lock_guard lock(all.mutex);
    if (const auto at = all.functions.find(name); at != all.functions.end()) return at->second;
    std::string names;
    for (const auto& [known, function] : all.functions)
        names += (names.empty() ? "one of " : ", ") + quoted_text(known);
    throw InputError({{scene.file, "/contact_solver/function", quoted_text(name),
                       names.empty() ? "a name that the program has registered, which has none "
                                       "(amontons.register_solver of Python)"
                                     : names}});
}

ContactSolution answer_of(const OutsideFunction& function, const ContactProblem& problem,
                          const SolverOptions& options, const Eigen::VectorXd& warm_start)
{
    const FclibForm form = fclib_form(problem);
    Eigen::VectorXd guess;
    if (warm_start.size() == problem.q.size()) {
        guess = Eigen::VectorXd::Zero(form.problem.q.size());
        guess(form.rows) = warm_start;
    }
    const Eigen::VectorXd r = function(form.problem, guess);
    if (r.size() != form.problem.q.size())
        throw NoOutsideAnswer(fmt::format("gave a reaction of {} numbers for {} rows", r.size(),
                                          form.problem.q.size()));
    if (!r.allFinite()) throw NoOutsideAnswer("gave a reaction that is not finite");
    ContactSolution s = judged(problem, r(form.rows), options.tolerance, options.scope);
    s.certificate.iterations = 1;
    return s;
}

} // namespace

std::function<ContactSolution(const ContactProblem&, const SolverOptions&, const Eigen::VectorXd&,
                              std::string& why)>
outside_of(const Scene& scene)
{
    const ContactSolverInput& input = scene.contact_solver;
    if (!input.given()) return {};
    if (!input.function.empty())
        return [name = input.function, function = function_of(scene)](
                   const ContactProblem& problem, const SolverOptions& options,
                   const Eigen::VectorXd& warm_start, std::string& why) -> ContactSolution {
            try {
                return answer_of(function, problem, options, warm_start);
            } catch (const std::exception& error) {
                why = "contact_solver.function, " + quoted_text(name) + ", " + error.what();
                return {};
            }
        };
    OutsideSolver solver{input.command, std::filesystem::path(scene.file).parent_path().string(),
                         input.max_time};
    if (solver.folder.empty()) solver.folder = ".";
    return [solver](const ContactProblem& problem, const SolverOptions& options,
                    const Eigen::VectorXd& warm_start, std::string& why) -> ContactSolution {
        try {
            return solve_outside(solver, problem, options, warm_start);
        } catch (const NoOutsideAnswer& none) {
            why = "contact_solver.command, " + quoted_text(solver.command) + ", " + none.what();
            return {};
        }
    };
}

void register_outside_function(const std::string& name, OutsideFunction function)
{
    Registered& all = registered();
    const std::lock_guard lock(all.mutex);
    if (function)
        all.functions[name] = std::move(function);
    else
        all.functions.erase(name);
}

} // namespace amontons
