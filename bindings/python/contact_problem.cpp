#include "bindings/python/stepper.hpp"

#include "contact/solvers/solve.hpp"
#include "solver/fclib_file.hpp"
#include "solver/step/outside.hpp"
#include "solver/step/recorded_problem.hpp"

#include <algorithm>

// Contact problems of their own: W, q, mu in, reactions and certificates out.

namespace amontons::python {
namespace {

using Numbers = py::array_t<double, py::array::f_style | py::array::forcecast>;
using Indices = py::array_t<std::int32_t, py::array::c_style | py::array::forcecast>;

/// A problem of so many rows is solved or certified in some milliseconds: not worth a thread.
constexpr Eigen::Index kFewRows = 300;

/// A problem with the Python function that its W may be.
struct Problem {
    ContactProblem problem;
    SharedObject apply; ///< of a matrix-free W, else null
};
using SharedProblem = std::shared_ptr<Problem>;

Eigen::VectorXd vector_of(const Numbers& a)
{
    return Eigen::Map<const Eigen::VectorXd>(a.data(), a.size());
}

std::vector<ContactKind> kinds_of(const std::vector<std::string>& names)
{
    std::vector<ContactKind> all;
    for (const std::string& n : names) {
        if (n == "frictional")
            all.push_back(ContactKind::frictional);
        else if (n == "frictionless")
            all.push_back(ContactKind::frictionless);
        else if (n == "bilateral")
            all.push_back(ContactKind::bilateral);
        else
            throw InputError({{"contact problem", "kinds", quoted_text(n),
                               "\"frictional\", \"frictionless\" or \"bilateral\""}});
    }
    return all;
}

const char* name_of(ContactKind kind)
{
    return kind == ContactKind::frictional     ? "frictional"
           : kind == ContactKind::frictionless ? "frictionless"
                                               : "bilateral";
}

Delassus::Sparse sparse_of(const Numbers& data, const Indices& rows, const Indices& starts,
                           Eigen::Index n)
{
    using Map = Eigen::Map<const Delassus::Sparse>;
    return Map(n, starts.size() - 1, data.size(), starts.data(), rows.data(), data.data());
}

/// @param W  ("dense", array) | ("sparse", data, rows, starts, number of rows) | ("function",
/// apply) with the own blocks as ("sparse", ...) behind it
SharedProblem make(const py::tuple& W, const Numbers& q, const Numbers& mu,
                   const std::vector<std::string>& kinds, const std::string& level)
{
    auto p = std::make_shared<Problem>();
    p->problem.q = vector_of(q);
    p->problem.mu = vector_of(mu);
    p->problem.kind = kinds_of(kinds);
    if (level != "position" && level != "velocity")
        throw InputError(
            {{"contact problem", "level", quoted_text(level), "\"position\" or \"velocity\""}});
    p->problem.level = level == "position" ? ContactLevel::position : ContactLevel::velocity;
    const auto sparse = [&](std::size_t from) {
        return sparse_of(W[from].cast<Numbers>(), W[from + 1].cast<Indices>(),
                         W[from + 2].cast<Indices>(), W[from + 3].cast<Eigen::Index>());
    };
    const auto form = W[0].cast<std::string>();
    if (form == "dense") {
        const auto a = W[1].cast<Numbers>();
        p->problem.W =
            Eigen::MatrixXd(Eigen::Map<const Eigen::MatrixXd>(a.data(), a.shape(0), a.shape(1)));
    } else if (form == "sparse") {
        p->problem.W = sparse(1);
    } else {
        p->apply = shared_object(W[1]);
        MatrixFreeDelassus free;
        free.rows = q.size();
        free.blocks = sparse(2);
        // The problem outlives its operator, and holds the function.
        free.apply = [problem = p.get()](const Eigen::VectorXd& r, Eigen::VectorXd& out) {
            const InPython hold;
            Numbers in(r.size());
            std::copy(r.data(), r.data() + r.size(), in.mutable_data());
            const auto answer = (*problem->apply)(in).cast<Numbers>();
            if (answer.ndim() != 1 || answer.size() != r.size())
                throw InputError(
                    {{"contact problem", "W",
                      "a function that gives " + std::to_string(answer.size()) + " numbers",
                      std::to_string(r.size()) + ", the rows of q"}});
            out = vector_of(answer);
        };
        p->problem.W = std::move(free);
    }
    if (const std::vector<Issue> wrong = issues(p->problem); !wrong.empty())
        throw InputError(wrong);
    return p;
}

py::object W_of(const SharedProblem& p)
{
    const Delassus& W = p->problem.W;
    if (W.is_matrix_free()) return *p->apply;
    if (W.is_dense()) {
        const Eigen::MatrixXd& m = W.dense();
        return view<double>(p, m.data(), {{m.rows(), m.cols()}, {8, 8 * m.rows()}});
    }
    const Delassus::Sparse m = W.as_sparse();
    const auto copy = [](const auto* first, Eigen::Index n) {
        return py::array(py::dtype::of<std::decay_t<decltype(*first)>>(), {py::ssize_t(n)}, first);
    };
    const py::object data = copy(m.valuePtr(), m.nonZeros()),
                     rows = copy(m.innerIndexPtr(), m.nonZeros()),
                     starts = copy(m.outerIndexPtr(), m.cols() + 1);
    return from_package("contact", "_sparse")(data, rows, starts, m.rows());
}

py::object solution_of(const ContactSolution& s)
{
    auto kept = std::make_shared<ContactSolution>(s);
    return py::cast(kept);
}

py::object solve_problem(const SharedProblem& p, SolverOptions options, const Numbers& warm)
{
    const auto stop = std::make_shared<std::atomic<bool>>(false);
    options.stop = stop.get();
    const Eigen::VectorXd start = vector_of(warm);
    const auto work = [p, options, start, stop] { return solve(p->problem, options, start); };
    ContactSolution solution;
    {
        const py::gil_scoped_release free;
        solution = p->problem.q.size() <= kFewRows ? work() : done_aside(work, stop);
    }
    return solution_of(solution);
}

/// The problem in a file, or of a global one what its bodies leave of it.
py::tuple problem_in_file(const std::string& path)
{
    FclibProblem file;
    auto p = std::make_shared<Problem>();
    {
        const py::gil_scoped_release free;
        file = done_aside([path] {
            FclibProblem read = read_fclib(path);
            if (!read.local) read.local = CondensedProblem(*read.global).contact();
            return read;
        });
        p->problem = std::move(*file.local);
    }
    const auto array = [](const Eigen::VectorXd& v) {
        return py::array_t<double>(v.size(), v.data());
    };
    py::object r = py::none(), u = py::none();
    if (file.solution) {
        if (file.solution->r.size() > 0) r = array(file.solution->r);
        if (file.solution->u.size() > 0) u = array(file.solution->u);
    }
    return py::make_tuple(py::cast(p), r, u, file.title, file.description, file.math_info);
}

void problem_to_file(const std::string& path, const SharedProblem& p, const py::object& r,
                     const py::object& u, const std::string& title)
{
    FclibProblem file;
    file.local = p->problem;
    file.title = title;
    if (!r.is_none()) {
        FclibSolution s;
        s.r = vector_of(r.cast<Numbers>());
        s.u = u.is_none() ? Eigen::VectorXd(p->problem.W * s.r + p->problem.q)
                          : vector_of(u.cast<Numbers>());
        file.solution = std::move(s);
    }
    const py::gil_scoped_release free;
    write_fclib(path, file);
}

/// Reactions by a function of Python: of (W, q, mu), and of the kinds where joints are among them.
OutsideFunction solver_of(const py::function& function)
{
    const SharedObject held = shared_object(function);
    return [held](const ContactProblem& p, const Eigen::VectorXd& warm) {
        const InPython gil;
        const auto array = [](const Eigen::VectorXd& v) {
            return py::array_t<double>(v.size(), v.data());
        };
        const Eigen::MatrixXd W = p.W.is_dense() ? p.W.dense() : Eigen::MatrixXd(p.W.as_sparse());
        const Numbers matrix({W.rows(), W.cols()}, W.data());
        py::dict more;
        py::list kinds;
        bool joints = false;
        for (int i = 0; i < contact_count(p); ++i) {
            kinds.append(name_of(kind_of(p, i)));
            joints |= kind_of(p, i) == ContactKind::bilateral;
        }
        if (joints) more["kinds"] = py::tuple(kinds);
        try {
            const py::object r = (*held)(matrix, array(p.q), array(p.mu), **more);
            return vector_of(r.cast<Numbers>());
        } catch (py::error_already_set& error) { // in one line, without the way to it
            std::string why = "raised " + std::string(py::str(error.type().attr("__name__"))) +
                              ": " + std::string(py::str(error.value()));
            std::ranges::replace(why, '\n', ' ');
            throw std::runtime_error(why);
        } catch (const py::cast_error&) {
            throw std::runtime_error("gave what is no array of numbers");
        }
    };
}

} // namespace

void add_contact_problem(py::module_& module)
{
    module.def("register_solver", [](const std::string& name, const py::object& function) {
        if (name.empty()) throw InputError({{"register_solver", "name", "nothing", "a name"}});
        if (!function.is_none() && !py::isinstance<py::function>(function) &&
            !PyCallable_Check(function.ptr()))
            throw InputError({{"register_solver", "function", "what cannot be called",
                               "a function of (W, q, mu), or None"}});
        register_outside_function(name, function.is_none()
                                            ? OutsideFunction{}
                                            : solver_of(function.cast<py::function>()));
    });
    py::class_<Problem, SharedProblem>(module, "Problem", py::module_local())
        .def(py::init(&make))
        .def_property_readonly("W", W_of)
        .def_property_readonly(
            "q",
            [](const SharedProblem& p) {
                return view<double>(p, p->problem.q.data(), {{p->problem.q.size()}, {8}});
            })
        .def_property_readonly(
            "mu",
            [](const SharedProblem& p) {
                return view<double>(p, p->problem.mu.data(), {{p->problem.mu.size()}, {8}});
            })
        .def_property_readonly("kinds",
                               [](const SharedProblem& p) {
                                   py::list all;
                                   for (int i = 0; i < contact_count(p->problem); ++i)
                                       all.append(name_of(kind_of(p->problem, i)));
                                   return py::tuple(all);
                               })
        .def_property_readonly("level", [](const SharedProblem& p) {
            return p->problem.level == ContactLevel::position ? "position" : "velocity";
        });

    module.def("solve", [](const SharedProblem& p, const std::string& solver, double tolerance,
                           std::optional<int> max_iterations, std::optional<double> max_seconds,
                           const Numbers& warm, int threads, bool analyse, bool least_norm) {
        SolverOptions o;
        o.solver = contact_solver(solver);
        o.tolerance = tolerance;
        if (max_iterations) o.max_iterations = *max_iterations;
        if (max_seconds) o.max_seconds = *max_seconds;
        o.threads = threads;
        o.analyse = analyse;
        o.least_norm = least_norm;
        return solve_problem(p, o, warm);
    });
    module.def("certify", [](const SharedProblem& p, const Numbers& r, double tolerance) {
        if (r.ndim() != 1 || r.size() != p->problem.q.size())
            throw InputError({{"contact problem", "r", std::to_string(r.size()) + " numbers",
                               std::to_string(p->problem.q.size()) + ", the rows of q"}});
        if (!(tolerance >= 0 && tolerance < 1))
            throw InputError(
                {{"contact problem", "tolerance", std::to_string(tolerance), "in [0, 1)"}});
        const Eigen::VectorXd reaction = vector_of(r);
        const auto work = [p, reaction, tolerance] {
            return certify(p->problem, reaction, tolerance);
        };
        const py::gil_scoped_release free;
        return reaction.size() <= kFewRows ? work() : done_aside(work);
    });
    module.def("read_fclib", problem_in_file);
    module.def("write_fclib", problem_to_file);
    module.def("contact_problems", [](const std::shared_ptr<Stepper>& s) {
        const Stepper::Use use(*s, Stepper::Purpose::read);
        const auto all = std::make_shared<std::vector<RecordedProblem>>();
        {
            const py::gil_scoped_release free;
            wait_for(
                Aside::start([s, all] { *all = s->simulation().contact_problems(); }, s->stop()),
                {&s, 1});
        }
        py::list problems;
        for (RecordedProblem& r : *all) {
            if (r.contact.empty()) continue;
            auto p = std::make_shared<Problem>();
            p->problem = std::move(r.problem);
                    problems.append(py::make_tuple(
                py::cast(p), py::array_t<double>(r.reaction.size(), r.reaction.data()),
                py::array_t<std::int32_t>(py::ssize_t(r.contact.size()), r.contact.data())));
        }
        return problems;
    });
}

} // namespace amontons::python
