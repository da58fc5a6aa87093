#include "bindings/python/records.hpp"
#include "haptics/link/handle_link.hpp"
#include "haptics/session/hand_run.hpp"
#include "solver/record/contact_bodies.hpp"

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>

// A hand that feels a scene: on threads of C++, which Python never enters.

namespace amontons::python {
namespace {

/// What the simulation's last step came to.
struct HandState {
    double time = 0; // [s]
    int steps = 0;
    HandPose device;
    Wrench force;
    Record record; // contacts and beams alone
};
using SharedHandState = std::shared_ptr<const HandState>;

class Session {
public:
    /// Without the GIL. @throws InputError
    Session(std::shared_ptr<SceneText> text, const HandRunOptions& options)
        : text_(std::move(text))
        , run_(text_->scene, options,
               [text = text_](const std::vector<std::string>& more) {
                   Scene scene = change_scene(*text, more)->scene;
                   place_introducers(scene);
                   return scene;
               })
        , names_(
              std::make_shared<const std::vector<std::string>>(contact_bodies(run_.scene()).names))
    {
        // Values that are set may be those of a wall: each scene has its own then.
        run_.prepare([text = text_, first = true](const Scene& scene) mutable {
            std::vector<Issue> warnings;
            FileHashes files;
            const bool shared = std::exchange(first, false);
            return shared ? text->walls->of(scene, warnings, files) : build_obstacles(scene);
        });
        for (const std::string& w : run_.warnings())
            messages_.push_back("warning: " + w);
    }
    ~Session() { end(); }
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    void start()
    {
        const std::lock_guard lock(mutex_);
        if (started_) throw_runtime("this session has been started before: make another one");
        started_ = true;
        thread_ = std::thread([this] { work(); });
    }
    /// Without the GIL.
    void end()
    {
        stop_ = true;
        const std::lock_guard one(joining_);
        if (thread_.joinable()) thread_.join();
    }
    /// @return  whether it has ended. Without the GIL.
    bool wait(double seconds)
    {
        std::unique_lock lock(mutex_);
        return ended_at_.wait_for(lock, std::chrono::duration<double>(seconds),
                                  [this] { return ended_ || !started_; });
    }
    bool started() const { return locked(started_); }
    bool running() const
    {
        const std::lock_guard lock(mutex_);
        return started_ && !ended_;
    }
    SharedHandState latest() const { return locked(latest_); }
    std::vector<std::string> messages() const { return locked(messages_); }
    void request(std::string line)
    {
        const std::lock_guard lock(mutex_);
        if (ended_) throw_runtime("the session has ended");
        requests_.push_back(std::move(line));
    }
    /// Of a session that has ended.
    std::string json() const
    {
        check_ended();
        return run_.json(outcome_);
    }
    std::string trace() const
    {
        check_ended();
        return trace_csv(outcome_.records);
    }
    std::string message() const
    {
        check_ended();
        return outcome_.message;
    }

private:
    template <class T> T locked(const T& value) const
    {
        const std::lock_guard lock(mutex_);
        return value;
    }
    void check_ended() const
    {
        const std::lock_guard lock(mutex_);
        if (!started_) throw_runtime("this session has not been started");
        if (!ended_) throw_runtime("this session has not ended: stop() or wait()");
        if (failure_) std::rethrow_exception(failure_);
    }
    void work()
    {
        HandRunHooks hooks;
        hooks.print_line = [this](const std::string& text) {
            const std::lock_guard lock(mutex_);
            messages_.push_back(text);
        };
        hooks.changes = [this] {
            const std::lock_guard lock(mutex_);
            return std::exchange(requests_, {});
        };
        hooks.after_step = [this](const HandleLink& link, const std::vector<Obstacle>&, bool) {
            auto reported = std::make_shared<ReportedStep>();
            reported->bodies = names_;
            reported->step.time = link.time();
            reported->step.step = link.steps();
            reported->step.contacts = link.contact_records();
            reported->step.beams = link.beam_records();
            auto now = std::make_shared<HandState>(HandState{
                link.time(), link.steps(), link.device(), link.force(), std::move(reported)});
            const std::lock_guard lock(mutex_);
            latest_ = std::move(now);
        };
        HapticOutcome outcome;
        std::exception_ptr failure;
        try {
            outcome = run_.run(hooks, stop_);
        } catch (...) {
            failure = std::current_exception();
        }
        const std::lock_guard lock(mutex_);
        outcome_ = std::move(outcome);
        failure_ = failure;
        ended_ = true;
        ended_at_.notify_all();
    }

    std::shared_ptr<SceneText> text_;
    HandRun run_;
    std::shared_ptr<const std::vector<std::string>> names_;
    std::atomic<bool> stop_{false};
    mutable std::mutex mutex_; // of what follows
    std::condition_variable ended_at_;
    bool started_ = false, ended_ = false;
    SharedHandState latest_;
    std::vector<std::string> messages_, requests_;
    HapticOutcome outcome_;
    std::exception_ptr failure_;
    std::mutex joining_;
    std::thread thread_;
};

py::array hand_vector(const SharedHandState& s, const double* first, py::ssize_t n)
{
    return view<double>(s, first, {{n}, {sizeof(double)}});
}

} // namespace

void add_haptic(py::module_& module)
{
    py::class_<HandState, std::shared_ptr<HandState>>(
        module, "HandState", py::module_local(),
        "What the simulation's last step came to. Arrays are read-only and keep it alive.")
        .def_readonly("time", &HandState::time, "[s]")
        .def_readonly("steps", &HandState::steps, "taken so far")
        .def_property_readonly(
            "place",
            [](const std::shared_ptr<HandState>& s) {
                return hand_vector(s, s->device.position.data(), 3);
            },
            "(3,) of the device, that the step used [m]")
        .def_property_readonly(
            "turn",
            [](const std::shared_ptr<HandState>& s) {
                const Eigen::Quaterniond& q = s->device.rotation;
                return py::make_tuple(q.w(), q.x(), q.y(), q.z());
            },
            "of the device, a unit quaternion (w, x, y, z)")
        .def_property_readonly(
            "force",
            [](const std::shared_ptr<HandState>& s) {
                return hand_vector(s, s->force.force.data(), 3);
            },
            "(3,) of the simulation on the hand [N]; what it feels is recomputed a thousand times "
            "a second, see trace()")
        .def_property_readonly(
            "torque",
            [](const std::shared_ptr<HandState>& s) {
                return hand_vector(s, s->force.torque.data(), 3);
            },
            "(3,) [N m]")
        .def_property_readonly(
            "contacts", [](const std::shared_ptr<HandState>& s) { return ContactsView{s->record}; },
            "those that are closed")
        .def_property_readonly(
            "beams",
            [](const std::shared_ptr<HandState>& s) -> py::object {
                const py::object view = py::cast(StepView{s->record});
                return view.attr("beams");
            },
            "name to Beam")
        .def("__repr__", [](const HandState& s) {
            return "<HandState: t = " + std::to_string(s.time) + " s, " +
                   std::to_string(s.record->step.contacts.size()) + " contacts>";
        });

    const auto release = [](Session* s) {
        const py::gil_scoped_release free;
        delete s;
    };
    using Owner = std::shared_ptr<Session>;
    py::class_<Session, Owner>(module, "HandSession", py::module_local())
        .def(py::init([release](const std::shared_ptr<SceneText>& scene, std::string device,
                                double duration, bool virtual_time, double late, int latency,
                                bool control, int threads, std::string cache) {
            HandRunOptions o;
            o.device = std::move(device);
            o.duration = duration;
            o.virtual_time = virtual_time;
            o.late = late;
            o.latency = latency;
            o.control = control;
            o.threads = threads;
            o.cache = std::move(cache);
            o.own_process = false;
            const py::gil_scoped_release free;
            return Owner(new Session(scene, o), release);
        }))
        .def("start", &Session::start)
        .def("end",
             [](const Owner& s) {
                 const py::gil_scoped_release free;
                 s->end();
             })
        .def("wait",
             [](const Owner& s, double seconds) {
                 const py::gil_scoped_release free;
                 return s->wait(seconds);
             })
        .def_property_readonly("started", &Session::started)
        .def_property_readonly("running", &Session::running)
        .def("latest",
             [](const Owner& s) { return std::const_pointer_cast<HandState>(s->latest()); })
        .def("messages", &Session::messages)
        .def("request", &Session::request)
        .def("summary", [](const Owner& s) { return from_json(s->json()); })
        .def("message", &Session::message)
        .def("trace", &Session::trace);
}

} // namespace amontons::python
