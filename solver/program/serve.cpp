// amontons serve SCENE: a scene stepped by requests, one JSON document a line
// (docs/serve.md).

#include "mesh/base/base64.hpp"
#include "mesh/base/file.hpp"
#include "mesh/base/phase_timer.hpp"
#include "mesh/extract_surface.hpp"
#include "solver/large/large_matrix.hpp"
#include "solver/output/manifest.hpp"
#include "solver/output/view_maker.hpp"
#include "solver/program/interrupt.hpp"
#include "solver/program/line_reader.hpp"
#include "solver/program/live_frames.hpp"
#include "solver/program/live_results.hpp"
#include "solver/program/scene_arguments.hpp"
#include "solver/program/serve_request.hpp"
#include "solver/program/session.hpp"
#include "solver/scene/read.hpp"
#include "solver/step/stepped_scene.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <fmt/format.h>
#include <limits>
#include <map>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

namespace amontons {
namespace {

using Outcome = StepResult::Outcome;
using Request = ServeRequest::What;

constexpr std::size_t kLongestLine = std::size_t(1) << 28; // a state of a million unknowns fits

std::string refusal_line(const std::string& id, const char* status,
                         const std::vector<Issue>& issues)
{
    JsonText json(false);
    json.open('{').key("id").json(id).member("ok", false).member("status", status);
    write_issues(json, "issues", issues);
    return json.close('}').text() + "\n";
}

/// A text of JSON in one line.
std::string in_one_line(const std::string& json)
{
    return nlohmann::ordered_json::parse(json).dump();
}

/// Numbers as they lie in the memory of x86 and ARM: little-endian, four bytes each.
template <class T> std::string packed(const std::vector<T>& numbers)
{
    static_assert(sizeof(T) == 4);
    return to_base64({reinterpret_cast<const char*>(numbers.data()), 4 * numbers.size()});
}

class Server {
public:
    Server(SharedScene scene, const SimulationOptions& options, const std::atomic<bool>& stop)
        : scene_(std::move(scene), options)
        , stop_(stop)
    {
    }
    const std::vector<Issue>& warnings() const { return scene_.warnings(); }
    /// The engine of amontons studio: answers report the units of quantities, too.
    /// @param results  of LiveResults; "": none are written
    /// @param resume   folder of results that no longer exists on with; "": none
    /// @throws InputError  that folder is not of this scene
    void become_engine(const std::string& results, const std::string& resume)
    {
        units_ = true;
        changed(); // the page has nothing yet
        if (!results.empty()) results_.emplace(results);
        if (resume.empty()) return;
        if (!results_) results_.emplace(resume);
        results_->resume(scene_, resume);
    }
    /// What there is to report beside answers, a line each; reported once.
    std::string take_news()
    {
        std::string lines;
        if (!results_) return lines;
        const auto emit = [&](const char* event, const char* name, const std::string& text) {
            JsonText json(false);
            json.open('{').member("event", event).member(name, text);
            lines += json.close('}').text() + "\n";
        };
        if (const std::string now = results_->folder(); now != folder_reported_) {
            emit("results", "folder", now);
            folder_reported_ = now;
        }
        if (const std::string& why = results_->failure(); why != failure_reported_) {
            emit("log", "text", "results are not written any more: " + why);
            failure_reported_ = why;
        }
        return lines;
    }
    bool running() const { return running_; }
    /// How long the next step of a run has to wait for the clock [s].
    double early() const
    {
        if (speed_ == 0) return 0;
        return std::max(0.0, (scene_.time() - begun_at_) / speed_ - watch_.seconds());
    }

    /// A step of a run in the background. @return  its line of output
    std::string step_of_run()
    {
        JsonText json(false);
        try {
            const StepResult last = scene_.step(stop_);
            if (last.outcome == Outcome::accepted) {
                accepted();
                json.open('{').member("event", "step");
                report(json);
                return json.close('}').text() + "\n";
            }
            running_ = false;
            const bool failed = last.outcome == Outcome::failed;
            json.open('{').member("event", "paused");
            json.member("status", failed                                 ? "failed"
                                  : last.outcome == Outcome::interrupted ? "interrupted"
                                                                         : "done");
            if (failed)
                write_issues(json, "issues",
                             {{scene_.scene()->file, "", last.message,
                               "the state is that of the last accepted step: set "
                               "something, restore another state or reset"}});
        } catch (const std::exception& error) {
            running_ = false;
            json = JsonText(false);
            json.open('{').member("event", "paused").member("status", "failed");
            write_issues(json, "issues",
                         {{scene_.scene()->file, "", error.what(),
                           "this is a mistake in amontons, please report it"}});
        }
        report(json);
        return json.close('}').text() + "\n";
    }

    /// The frame that is waited for, once there is something new; else "".
    std::string take_frame()
    {
        if (!frames_.due()) return "";
        const bool whole = frames_.next_is_whole() || !view_;
        const Record& record = scene_.record();
        return frames_.take(next_view(whole), whole, record ? record->step.step : -1, scene_.time(),
                            scene_.done());
    }

    /// Executes the request of a line. @return  the answer, one line
    std::string answer(const ServeRequest& r)
    {
        if (!r.issues.empty()) return refusal_line(r.id, "bad_input", r.issues);
        try {
            JsonText json(false);
            json.open('{').key("id").json(r.id);
            carry_out(r, json);
            return json.close('}').text() + "\n";
        } catch (const InputError& error) {
            return refusal_line(r.id, "bad_input", error.issues());
        } catch (const std::bad_alloc&) {
            return refusal_line(
                r.id, "failed",
                {{scene_.scene()->file, "", "not enough memory", "a smaller scene"}});
        } catch (const std::exception& error) {
            return refusal_line(r.id, "failed",
                                {{scene_.scene()->file, "", error.what(),
                                  "this is a mistake in amontons, please report it"}});
        }
    }

private:
    void carry_out(const ServeRequest& r, JsonText& json)
    {
        switch (r.what) {
        case Request::run:
            running_ = true;
            speed_ = r.speed;
            begun_at_ = scene_.time();
            watch_ = {};
            json.member("ok", true);
            return;
        case Request::pause:
            running_ = false;
            break;
        case Request::frame:
            frames_.request_frame(r.after, r.whole);
            json.member("ok", true);
            return;
        case Request::step:
            return steps(json, r.count, std::numeric_limits<double>::infinity());
        case Request::advance:
            scene_.check_until(r.until);
            return steps(json, std::numeric_limits<int>::max(), r.until);
        case Request::set:
            set(r.path, r.value);
            changed();
            break;
        case Request::restore:
            if (results_) results_->end("another state was restored");
            scene_.restore(r.state);
            changed();
            break;
        case Request::reset:
            if (results_) results_->end("the scene was taken back to its beginning");
            scene_.reset();
            view_.reset();
            changed();
            break;
        case Request::state:
            break;
        case Request::save:
            json.member("ok", true).member("state", to_base64(scene_.save()));
            return;
        case Request::inputs:
            return report_inputs(json.member("ok", true));
        case Request::scene:
            json.member("ok", true);
            json.key("scene").json(in_one_line(resolved_scene(scene_.scene()->scene)));
            return;
        case Request::check:
            json.member("ok", true);
            json.key("check").json(in_one_line(check_scene(*scene_.scene())));
            return;
        case Request::contacts:
            return send_contacts(json.member("ok", true));
        case Request::sets:
            return report_sets(json.member("ok", true));
        case Request::view:
            return send_view(json.member("ok", true), r.whole);
        case Request::quit:
            json.member("ok", true);
            return;
        }
        json.member("ok", true);
        report(json);
    }

    void steps(JsonText& json, int count, double not_beyond)
    {
        int taken = 0;
        StepResult last;
        while (taken < count) {
            last = scene_.step(stop_, not_beyond);
            if (last.outcome != Outcome::accepted) break;
            ++taken;
            accepted();
        }
        const bool failed = last.outcome == Outcome::failed,
                   interrupted = last.outcome == Outcome::interrupted;
        json.member("ok", !failed && !interrupted);
        if (failed) {
            json.member("status", "failed");
            write_issues(json, "issues",
                         {{scene_.scene()->file, "", last.message,
                           "the state is that of the last accepted step: set something, "
                           "restore another state or reset"}});
        } else if (interrupted) {
            json.member("status", "interrupted");
            write_issues(json, "issues",
                         {{scene_.scene()->file, "", "a signal that ends the program", "none"}});
        }
        json.member("taken", taken);
        report(json);
    }

    /// Where the run is: names as in `run --json`, and of the last step.
    void report(JsonText& json) const
    {
        const RunSummary& run = scene_.simulation().so_far();
        const StepRecord* step = scene_.record() ? &scene_.record()->step : nullptr;
        json.member("time", scene_.time()).member("done", scene_.done());
        json.key("step");
        if (!step) {
            json.json("null");
        } else {
            json.open('{').member("number", step->step).member("length", step->step_length);
            json.member("iterations", step->iterations).member("retries", step->retries);
            json.member("remark", step->remark).member("seconds", step->seconds).close('}');
        }
        json.key("quantities").open('{');
        if (step)
            for (const Quantity& q : step->quantities)
                json.member(q.name, q.value);
        for (const Quantity& q : run.quantities)
            if (!step || std::ranges::find(step->quantities, q.name, &Quantity::name) ==
                             step->quantities.end())
                json.member(q.name, q.value);
        for (const NamedText& t : run.texts)
            json.member(t.name, t.value);
        json.close('}');
        if (units_) {
            json.key("units").open('{');
            for (const Quantity& q : step ? step->quantities : run.quantities)
                json.member(q.name, q.unit);
            json.close('}');
        }
        json.key("certificate").open('{');
        if (step) {
            json.member("error", step->certificate.error);
            json.member("tolerance", step->certificate.tolerance);
        }
        write_certificate(json, run);
        json.close('}').key("energy").open('{');
        write_energy(json, step ? step->energy : run.energy);
        json.close('}').key("contacts").open('{');
        json.member("now", std::int64_t(step ? step->contacts.size() : 0));
        json.member("max", run.contacts_max).close('}');
        json.key("warnings").open('[');
        for (const Issue& w : scene_.warnings())
            json.value(InputError({w}).what());
        for (const std::string& w : run.warnings)
            json.value(w);
        json.close(']');
    }

    /// A step was taken.
    void accepted()
    {
        changed();
        if (results_) results_->add(scene_);
    }

    void set(const std::string& path, const std::string& value)
    {
        const std::vector<InputInfo>& inputs = scene_.simulation().inputs();
        const auto input = std::ranges::find(inputs, path, &InputInfo::name);
        if (input == inputs.end()) return change(path, value);
        double number = 0;
        const auto [end, error] =
            std::from_chars(value.data(), value.data() + value.size(), number);
        if (error != std::errc() || end != value.data() + value.size())
            throw InputError({{"", path, value, "a number [" + input->unit + "]"}});
        scene_.simulation().set_input(std::size_t(input - inputs.begin()), number);
    }

    void change(const std::string& path, const std::string& value)
    {
        try {
            scene_.change({path + "=" + value});
            view_.reset();
        } catch (const InputError& error) {
            std::vector<Issue> issues = error.issues();
            std::vector<std::string> names;
            for (const InputInfo& i : scene_.simulation().inputs())
                names.push_back(i.name);
            if (const std::string near = nearest_name(path, names); !near.empty())
                issues.push_back({"", "path", quoted_text(path), "the input " + quoted_text(near)});
            throw InputError(std::move(issues));
        }
    }

    void report_inputs(JsonText& json) const
    {
        const Simulation& s = scene_.simulation();
        json.key("inputs").open('[');
        for (std::size_t i = 0; i < s.inputs().size(); ++i) {
            const InputInfo& info = s.inputs()[i];
            json.open('{').member("name", info.name).member("unit", info.unit);
            json.member("least", info.lower).member("largest", info.upper);
            json.member("value", s.input(i)).close('}');
        }
        json.close(']');
    }

    void send_contacts(JsonText& json) const
    {
        const Record& record = scene_.record();
        const std::vector<std::string>& names = *scene_.body_names();
        const auto vector = [&](const char* name, const Vec3& x) {
            json.key(name).open('[').value(x.x()).value(x.y()).value(x.z()).close(']');
        };
        json.key("contacts").open('[');
        for (const ContactRecord& c :
             record ? record->step.contacts : std::vector<ContactRecord>{}) {
            json.open('{').member("a", names[std::size_t(c.body_a)]);
            json.member("b", names[std::size_t(c.body_b)]);
            vector("point", c.point);
            vector("force", c.force);
            vector("normal", c.normal);
            vector("slip", c.slip);
            json.member("gap", c.gap).member("normal_force", c.normal_force);
            json.member("status", c.status == ContactStatus::stick  ? "stick"
                                  : c.status == ContactStatus::slip ? "slip"
                                                                    : "open");
            json.close('}');
        }
        json.close(']');
    }

    ViewFrame next_view(bool whole)
    {
        const Simulation& s = scene_.simulation();
        if (whole || !view_) view_.emplace(s.obstacles(), contact_bodies(scene_.scene()->scene));
        const Record& record = scene_.record();
        return view_->frame(scene_.time(), record ? record->step.beams : std::vector<BeamRecord>{},
                            s.body_records(),
                            record ? record->step.contacts : std::vector<ContactRecord>{});
    }

    void changed() { frames_.changed(); }

    /// Sets of solids: of faces by the numbers of the outside's, of nodes by those of its points.
    void report_sets(JsonText& json) const
    {
        json.key("sets").open('[');
        for (const BodyRecord& b : scene_.simulation().body_records()) {
            if (!b.elements) continue;
            const ExternalSurface outside = extract_surface(*b.elements);
            std::map<FaceRef, std::int64_t> face_number;
            for (const FaceRef& f : outside.faces)
                face_number.emplace(f, std::int64_t(face_number.size()));
            std::map<std::int32_t, std::int64_t> point_number;
            for (const std::int32_t node : outside.used_nodes)
                point_number.emplace(node, std::int64_t(point_number.size()));
            const auto emit = [&](const std::string& name, const char* kind, const auto& members,
                                  const auto& numbers) {
                json.open('{').member("body", b.name).member("name", name).key(kind).open('[');
                for (const auto& m : members)
                    if (const auto at = numbers.find(m); at != numbers.end())
                        json.value(at->second);
                json.close(']').close('}');
            };
            for (const FaceSet& set : b.elements->face_sets)
                emit(set.name, "faces", set.members, face_number);
            for (const NodeSet& set : b.elements->node_sets)
                emit(set.name, "points", set.members, point_number);
        }
        json.close(']');
    }

    void send_view(JsonText& json, bool whole)
    {
        const ViewFrame frame = next_view(whole);
        json.member("time", scene_.time()).member("caption", frame.caption);
        json.key("shapes").open('[');
        constexpr const char* kKinds[] = {"wall", "wire", "solid", "rigid"};
        for (const ViewShape& shape : frame.shapes) {
            json.open('{').member("name", shape.name).member("kind", kKinds[shape.kind]);
            json.member("points", packed(shape.points));
            if (!shape.triangles.empty()) json.member("triangles", packed(shape.triangles));
            if (!shape.values.empty()) json.member("values", packed(shape.values));
            json.close('}');
        }
        json.close(']').member("contacts", packed(frame.contacts));
    }

    SteppedScene scene_;
    const std::atomic<bool>& stop_;
    std::optional<ViewMaker> view_;

    // of the engine of amontons studio
    bool running_ = false, units_ = false;
    double speed_ = 0, begun_at_ = 0;
    Stopwatch watch_;
    LiveFrames frames_;
    std::optional<LiveResults> results_;
    std::string folder_reported_, failure_reported_;
};

struct ServeArguments {
    SceneArguments scene;
    SimulationOptions how;
    // of the engine of amontons studio
    int frames = -1; ///< where frames are written
    std::string results, resume;
};

void serve(ServeArguments& arguments, Session& session)
{
    ParallelRun parallel; // outlives the simulation
    if (parallel.served()) {
        session.quiet = true;
        return;
    }
    std::atomic<bool>& stop = stop_on_interrupt();
    std::optional<Server> server;
    try {
        settle(arguments.scene);
        const std::string& file = arguments.scene.scene;
        server.emplace(read_scene_text(read_file(file), file, arguments.scene.overrides),
                       arguments.how, stop);
        if (arguments.frames >= 0) server->become_engine(arguments.results, arguments.resume);
    } catch (const InputError& error) { // for a client that waits for the first answer
        session.refuse(error.issues());
        session.print(refusal_line("null", "bad_input", error.issues()));
        return;
    }
    session.warn(server->warnings());
    LineReader lines(stop, kLongestLine);
    std::string line;
    bool engine = arguments.frames >= 0;
    if (engine) session.print("{\"event\":\"ready\"}\n");
    while (!stop) {
        if (const std::string news = server->take_news(); !news.empty()) session.print(news);
        if (engine)
            if (const std::string frame = server->take_frame(); !frame.empty())
                engine = send_frame(arguments.frames, frame);
        const LineReader::Got got = lines.next(line, server->running() ? server->early() : -1);
        if (got == LineReader::Got::nothing) {
            session.print(server->step_of_run());
            continue;
        }
        if (got == LineReader::Got::stopped) break;
        if (got == LineReader::Got::end) return;
        if (got == LineReader::Got::broken)
            throw InputError({{"(standard input)", "", "nothing that can be read", "requests"}});
        if (got == LineReader::Got::too_long) {
            session.print(refusal_line("null", "bad_input",
                                       {{"", "", "a line that is too long",
                                         fmt::format("at most {} bytes", kLongestLine)}}));
            continue;
        }
        const ServeRequest request = read_request(line, engine);
        session.print(server->answer(request));
        if (request.issues.empty() && request.what == Request::quit) return;
    }
    session.exit_code = kInterrupted;
}

} // namespace

void add_serve(CLI::App& program, Session& session)
{
    const auto arguments = std::make_shared<ServeArguments>(); // lives as long as the callback
    CLI::App* command = program.add_subcommand(
        "serve", "Step a scene by requests on stdin, one JSON document a line");
    add_scene_arguments(*command, arguments->scene);
    command
        ->add_option("--threads", arguments->how.threads,
                     "Threads; the result is the same for any number")
        ->check(CLI::Range(1, 1024));
    command
        ->add_option(
            "--cache", arguments->how.cache,
            "Folder where factors of solids and samples of walls are kept for the next run")
        ->type_name("DIR");
    // of amontons studio
    command->add_option("--frames", arguments->frames)->group("");
    command->add_option("--results", arguments->results)->group("");
    command->add_option("--resume", arguments->resume)->group("");
    command->callback([arguments, &session] { serve(*arguments, session); });
}

} // namespace amontons
