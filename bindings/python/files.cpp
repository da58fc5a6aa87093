#include "bindings/python/stepper.hpp"

#include "mesh/base/memory.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/module.hpp"
#include "solver/output/manifest.hpp"
#include "solver/output/output_folder.hpp"
#include "solver/output/plot.hpp"
#include "solver/output/problem_recorder.hpp"
#include "solver/output/run_writer.hpp"
#include "solver/scene/json_text.hpp"

#include <filesystem>
#include <limits>
#include <optional>

// A run to the end, with the files of `amontons run` or without.

namespace amontons::python {

using Outcome = StepResult::Outcome;

py::dict summary_dict(const RunSummary& summary)
{
    py::dict d;
    d["status"] = summary.status;
    d["message"] = summary.message;
    d["steps"] = summary.steps;
    d["time"] = summary.time;
    d["quantities"] = values_of(summary.quantities);
    d["units"] = units_of(summary.quantities);
    py::dict texts;
    for (const NamedText& t : summary.texts)
        texts[py::str(t.name)] = t.value;
    d["texts"] = texts;
    d["warnings"] = summary.warnings;
    d["not_measured"] = summary.not_measured;
    d["contacts_max"] = summary.contacts_max;
    d["worst_error"] = summary.worst_error;
    d["worst_penetration"] = summary.worst_penetration;
    d["worst_overlap"] = summary.worst_overlap.depth;
    d["uncertified_steps"] = summary.uncertified_steps;
    d["energy"] = summary.energy;
    py::list snaps;
    for (const SnapRecord& s : summary.snaps) {
        py::dict one;
        one["step"] = s.step;
        one["time"] = s.time;
        one["depth"] = s.depth;
        one["released"] = s.released;
        snaps.append(one);
    }
    d["snaps"] = snaps;
    py::dict seconds;
    const PhaseSeconds& p = summary.seconds;
    seconds["offline"] = p.offline;
    seconds["free_motion"] = p.free_motion;
    seconds["detection"] = p.detection;
    seconds["compliance"] = p.compliance;
    seconds["contact_solve"] = p.contact_solve;
    seconds["correction"] = p.correction;
    seconds["output"] = p.output;
    d["seconds"] = seconds;
    return d;
}

namespace {

/// The files of a run.
class RunFiles {
public:
    RunFiles(Stepper& s, const std::string& folder, bool resume, bool record,
             std::vector<std::string> command)
    {
        if (record) check_recorder();
        if (record) check_recordable(s.scene()->scene);
        check_output_folder(folder, s.scene()->scene);
        RunWriterOptions options;
        options.name = run_name(s.scene()->file);
        options.directory = folder;
        options.command = std::move(command);
        for (const Issue& w : s.warnings())
            options.warnings.push_back(InputError({w}).what());
        options.threads = s.options().threads;
        options.resume = resume && !has_no_checkpoint_yet(folder);
        writer_ = std::make_unique<RunWriter>(s.scene()->scene, s.simulation(), options, full_);
        if (record)
            recorder_.emplace(s.simulation(), s.scene()->scene, folder + "/record", options.resume);
    }
    /// @return  false where nothing more can be written: finish() gives the reason
    bool write(const StepRecord& record)
    {
        writer_->on_step(record);
        if (recorder_) recorder_->write(record);
        return !full_;
    }
    void finish(Stepper& s, RunSummary& summary)
    {
        for (const Obstacle& o : s.simulation().obstacles())
            o.model.wall.keep();
        summary.seconds.total = watch_.seconds();
        summary.memory.steps = peak_memory_so_far();
        writer_->finish(summary);
        summary_ = summary;
    }
    void add(const std::vector<std::string>& files) { writer_->add_files(files, summary_); }

private:
    std::atomic<bool> full_{false};
    std::unique_ptr<RunWriter> writer_;
    std::optional<ProblemRecorder> recorder_;
    RunSummary summary_;
    Stopwatch watch_;
};

/// As `amontons run --json` shows it.
std::string answer_of(const Stepper& s, const RunSummary& summary, int iterations)
{
    std::vector<std::string> warnings;
    for (const Issue& w : s.warnings())
        warnings.push_back(InputError({w}).what());
    JsonText json;
    json.open('{');
    write_summary(json, summary, mapped_modules(), warnings);
    std::int64_t unknowns = 0;
    for (const BodyPlan& b : s.simulation().plan())
        unknowns += b.unknowns;
    json.member("unknowns", unknowns).member("iterations", iterations).close('}');
    return json.text();
}

/// A run: of run() and of the thread that steps and writes.
struct Run {
    std::shared_ptr<Stepper> s;
    std::shared_ptr<RunFiles> files; ///< or null
    int iterations = 0;
    bool full = false;
    std::string message; ///< why it was interrupted; "": as the engine reports it
    RunSummary summary;
    std::string answer;

    /// Of an accepted step. @return  false where nothing more can be written
    bool write()
    {
        iterations += s->record()->step.iterations;
        if (!files) return true;
        const Stopwatch watch;
        full = !files->write(s->record()->step);
        s->simulation().spent_on_output(watch.seconds());
        return !full;
    }
    void finish()
    {
        summary = s->conclude();
        if (!message.empty() && summary.status == "interrupted") summary.message = message;
        if (files) files->finish(*s, summary);
        answer = answer_of(*s, summary, iterations);
    }
};

/// Runs that were interrupted in a long step, and write the end of their files when they can. With
/// the GIL.
std::vector<std::shared_ptr<Aside>>& runs_left()
{
    static auto* all = new std::vector<std::shared_ptr<Aside>>; // never ends
    return *all;
}

/// Their folders are whole. With the GIL. @throws  as Aside::wait
void wait_for_runs_left()
{
    while (!runs_left().empty()) {
        const std::shared_ptr<Aside> call = runs_left().back();
        {
            const py::gil_scoped_release free;
            call->wait();
        }
        std::erase(runs_left(), call);
    }
}

/// Steps to the end with files and callback. With the GIL.
/// @return  what is reported at the end, as a dict and as JSON
py::tuple run(const std::shared_ptr<Stepper>& s, const std::shared_ptr<RunFiles>& files,
              const py::object& on_step, int every)
{
    struct Running {
        Stepper& s;
        explicit Running(Stepper& of) : s(of)
        {
            const Stepper::Use use(s, Stepper::Purpose::change);
            s.set_running(true);
        }
        ~Running() { s.set_running(false); }
    } running(*s);

    const auto state = std::make_shared<Run>();
    state->s = s;
    state->files = files;
    std::exception_ptr raised; // by a signal or a callback: reported when the files are whole
    bool stopped = false;
    long count = on_step.is_none() ? std::numeric_limits<long>::max() : 1;
    while (!stopped && !raised) {
        try {
            {
                const Stepper::Use use(*s, Stepper::Purpose::run);
                const py::gil_scoped_release free;
                const StepResult last =
                    s->steps(count, std::numeric_limits<double>::infinity(),
                             [state] { return state->write(); });
                if (state->full || last.outcome != Outcome::accepted) break;
            }
            count = every;
            const py::object answer = on_step(py::cast(StepView{s->record()}));
            const int truth = PyObject_IsTrue(answer.ptr());
            if (truth < 0) throw py::error_already_set();
            stopped = truth == 1;
        } catch (py::error_already_set&) {
            raised = std::current_exception();
        }
    }
    if (stopped) state->message = "stopped by on_step";
    if (raised) state->message = "interrupted by the user";
    const auto finish = [state] { state->finish(); };
    if (const std::shared_ptr<Aside> call = s->left(); call && raised && call->then(finish)) {
        if (files) runs_left().push_back(call);
        std::rethrow_exception(raised);
    }
    const Stepper::Use use(*s, Stepper::Purpose::run);
    {
        const py::gil_scoped_release free;
        const std::shared_ptr<Aside> call = Aside::start(finish, s->stop());
        try {
            wait_for(call, {&s, 1});
        } catch (py::error_already_set&) {
            if (!raised) raised = std::current_exception();
            if (files && !call->is_over()) {
                const py::gil_scoped_acquire hold;
                runs_left().push_back(call);
            }
        }
    }
    if (raised) std::rethrow_exception(raised);
    return py::make_tuple(summary_dict(state->summary), state->answer);
}

} // namespace

void add_files(py::module_& module)
{
    py::class_<RunFiles, std::shared_ptr<RunFiles>>(module, "RunFiles", py::module_local())
        .def(py::init([](const std::shared_ptr<Stepper>& s, const std::string& folder, bool resume,
                         bool record, std::vector<std::string> command) {
            const Stepper::Use use(*s, Stepper::Purpose::change);
            wait_for_runs_left();
            const auto files = std::make_shared<std::shared_ptr<RunFiles>>();
            const py::gil_scoped_release free;
            const auto make = [=] {
                *files = std::make_shared<RunFiles>(*s, folder, resume, record, command);
            };
            wait_for(Aside::start(make, s->stop()), {&s, 1});
            return *files;
        }))
        .def("add", &RunFiles::add);
    module.def("run", run, py::arg("stepper"), py::arg("files").none(true), py::arg("on_step"),
               py::arg("every"));
    module.def("conclude", [](const std::shared_ptr<Stepper>& s) {
        const Stepper::Use use(*s, Stepper::Purpose::read);
        RunSummary summary;
        {
            const py::gil_scoped_release free;
            summary = s->conclude();
        }
        return summary_dict(summary);
    });
    module.def("plot_history", [](const std::string& folder) {
        const py::gil_scoped_release free;
        return done_aside([folder] {
            std::string message;
            std::vector<std::string> files = plot_history(folder, message);
            return std::pair(std::move(files), std::move(message));
        });
    });
}

} // namespace amontons::python
