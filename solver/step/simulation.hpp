#pragma once

#include "mesh/base/error.hpp"
#include "mesh/volume_mesh.hpp"
#include "solver/body/solid_sets.hpp"
#include "solver/large/linear_plan.hpp"
#include "solver/obstacle/obstacle.hpp"
#include "solver/record/step_record.hpp"
#include "solver/scene/scene.hpp"

#include <atomic>
#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace amontons {

struct RecordedProblem; // solver/step/recorded_problem.hpp

/// Receives every finished step. One virtual call a step.
class StepObserver {
public:
    virtual ~StepObserver() = default;
    /// Receives a finished step.
    virtual void on_step(const StepRecord& record) = 0;
};

/// One body's line of the plan.
struct BodyPlan {
    std::string name;
    std::string kind;               ///< "obstacle" | "beam" | "solid" | "rigid"
    int unknowns = 0;               ///< at its largest
    std::vector<SetSize> sets = {}; ///< of a solid
};

/// Surface, displacement and stress of a body, for files and pictures.
struct BodyRecord {
    std::string name;
    const VolumeMesh* elements = nullptr; ///< of a solid: its cells; else triangles. Lives as long
                                          ///< as the simulation
    std::vector<Vec3> points;             ///< now [m]
    std::vector<std::array<std::int32_t, 3>> triangles;
    std::vector<Field> point_fields, cell_fields;
    double stress_round_off = 0; ///< of a solid: a smaller stress is rounding [Pa]
};

/// Result of one call of Simulation::step().
struct StepResult {
    /// How a step ended.
    enum class Outcome {
        accepted,    ///< a step was made: see `record`
        done,        ///< the scene's end, or `not_beyond`, is reached already: nothing was done
        failed,      ///< `message` gives the reason; the state is that of the last accepted step
        interrupted, ///< by `stop`; the state is that of the last accepted step
    };
    Outcome outcome = Outcome::done;
    /// Reason, if it was refused.
    std::string message;
    StepRecord record;
};

/// A drive that a caller may set between two steps.
struct InputInfo {
    std::string name; ///< BODY.insertion, BODY.loads.0.over, ...
    std::string unit;
    double lower = -std::numeric_limits<double>::infinity(); ///< least and largest value
    /// Greatest admissible value, in the unit of the input.
    double upper = std::numeric_limits<double>::infinity();
};

/// The smallest step, of the longest, unless the scene specifies it (ratio).
constexpr double kDefaultSmallest = 1.0 / 1024;

/// The only owner of bodies: made once from a scene, then advanced step by step.
class Simulation {
public:
    virtual ~Simulation() = default;

    /// The offline stage, once: all checks that can still refuse the scene, before anything is
    /// written. step() and restore() call it if it was not called.
    /// @throws InputError
    virtual void prepare() {}

    /// One accepted step, retries of a shorter one included. The first of all is step 0, the state
    /// that the run begins from (unless the state was restored). A step that fails or is
    /// interrupted leaves the state of the last accepted one, and can be repeated.
    /// @param stop        examined between steps, and in long ones
    /// @param not_beyond  the step ends there at the latest [s], exactly there if it comes near.
    /// Where
    ///                    this cuts a step, the length of the next one is as if it had not
    /// @throws InputError  `not_beyond` along a path (time.path), where time is an unknown
    virtual StepResult step(const std::atomic<bool>& stop,
                            double not_beyond = std::numeric_limits<double>::infinity()) = 0;

    /// Summary at the end of a run, or between two steps.
    /// @param last  result of the last step()
    virtual RunSummary conclude(const StepResult& last) = 0;

    /// Adds time that was spent on the output of a step, for the sums of the next ones [s].
    virtual void spent_on_output(double seconds) = 0;

    /// Steps to the scene's end, or until `stop` is set. Calls the observer with each step.
    RunSummary run(StepObserver& observer, const std::atomic<bool>& stop);

    /// The summary up to the last accepted step.
    virtual const RunSummary& so_far() const = 0;

    /// Drives that a caller may set; the others follow the curves of the scene.
    virtual const std::vector<InputInfo>& inputs() const;
    /// What an input is now, or will be at the end of the next step. @throws InputError  as
    /// set_input
    virtual double input(std::size_t number) const;
    /// From now on the scene's curve of this drive no longer counts. The value varies linearly from
    /// its present one to this one at the end of the next step (of the length that it is first
    /// tried with), and stays there.
    /// @throws InputError  no such input, or a value out of its range; nothing is changed
    virtual void set_input(std::size_t number, double value);

    /// The walls.
    virtual const std::vector<Obstacle>& obstacles() const = 0;
    /// Bodies as they are used, for `amontons check`.
    virtual std::vector<BodyPlan> plan() const = 0;

    /// How the linear systems of solids are solved, and what each way costs.
    virtual LinearPlan linear_plan() const { return {}; }

    /// Largest contact force seen on each vertex of an obstacle's surface [N]; empty where it is
    /// not examined (scenes without beams).
    virtual std::vector<double> max_contact_force(std::size_t obstacle) const = 0;

    /// The contact problems of the last step. For an observer: they cost as much as some steps,
    /// and hold until the next one.
    virtual std::vector<RecordedProblem> contact_problems() const = 0;

    /// Solids and rigid bodies after the last step. For an observer; stresses cost some time.
    virtual std::vector<BodyRecord> body_records() const = 0;

    /// Warnings about the scene and its files.
    virtual std::vector<Issue> warnings() const { return {}; }
    /// What the offline stage did, a line each; after run().
    virtual std::vector<std::string> messages() const { return {}; }

    /// Everything that the next step depends on, for a bit-identical continuation.
    virtual std::vector<std::byte> save() const = 0;
    /// @throws InputError  if the bytes do not fit this scene; nothing is changed
    virtual void restore(const std::vector<std::byte>& state) = 0;
    /// Continues from the state of a simulation of the same bodies; their materials, holds, loads,
    /// sets and contact laws may differ. A hold that no longer exists releases over the next step,
    /// a new one moves its nodes over that step to their prescribed places.
    /// @throws InputError  if the bodies are not the same; nothing is changed
    virtual void take_over(const Simulation& before) { restore(before.save()); }
};

/// How a scene is solved, beside what it specifies itself.
struct SimulationOptions {
    std::string cache;  ///< folder of factors and of samples of walls; "": none
    int threads = 1;    ///< of the contact solver, and of the sampling of walls
    bool refuse = true; ///< where the memory does not suffice; else linear_plan() reports it
};

/// @throws InputError  if a body cannot be made as the scene specifies (e.g. the wire starts inside
/// a wall)
std::unique_ptr<Simulation> make_simulation(const Scene& scene, std::vector<Obstacle> obstacles,
                                            const SimulationOptions& options = {});

} // namespace amontons
