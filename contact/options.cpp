#include "contact/options.hpp"

#include <sstream>

namespace amontons {

std::vector<Issue> issues(const SolverOptions& options)
{
    std::vector<Issue> found;
    const auto need = [&](bool holds, const char* place, double value, const char* allowed) {
        if (holds) return;
        std::ostringstream text;
        text << value;
        found.push_back({"solver options", place, text.str(), allowed});
    };
    need(options.tolerance >= 0 && options.tolerance < 1, "tolerance", options.tolerance,
         "0 <= tolerance < 1");
    need(options.max_iterations >= 0, "max_iterations", options.max_iterations, ">= 0");
    need(options.max_seconds >= 0, "max_seconds", options.max_seconds, ">= 0 [s]");
    need(options.threads >= 1, "threads", options.threads, ">= 1");
    need(options.patience >= 1, "patience", options.patience, ">= 1");
    need(options.nsgs.freeze >= 0 && options.nsgs.freeze < 1, "nsgs.freeze", options.nsgs.freeze,
         "0 <= freeze < 1");
    need(options.uzawa.factor > 0 && options.uzawa.factor < 2, "uzawa.factor", options.uzawa.factor,
         "0 < factor < 2");
    return found;
}

ContactSolver contact_solver(const std::string& requested)
{
    std::string names;
    for (ContactSolver s : kContactSolvers) {
        if (requested == name(s)) return s;
        names += std::string(names.empty() ? "" : ", ") + name(s);
    }
    throw InputError({{"solver options", "solver", requested, names}});
}

} // namespace amontons
