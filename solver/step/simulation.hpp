#pragma once

#include "mesh/base/error.hpp"
#include "mesh/volume_mesh.hpp"
#include "mesh/wall.hpp"
#include "solver/body/solid_sets.hpp"
#include "solver/large/linear_plan.hpp"
#include "solver/output/step_record.hpp"
#include "solver/scene/scene.hpp"

#include <atomic>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace amontons {

struct RecordedProblem; // solver/step/recorded_problem.hpp

/// Told of every finished step. One virtual call a step.
class StepObserver {
public:
    virtual ~StepObserver() = default;
    virtual void on_step(const StepRecord& record) = 0;
};

/// An obstacle, ready for contact.
struct Obstacle {
    std::string name;
    WallModel model;
};

/// One body's line of the plan.
struct BodyPlan {
    std::string name;
    std::string kind; ///< "obstacle" | "beam" | "solid" | "rigid"
    int unknowns = 0; ///< at its largest
    std::vector<SetSize> sets = {}; ///< of a solid
};

/// What a body looks like and how it fares, for files and pictures.
struct BodyRecord {
    std::string name;
    const VolumeMesh* elements = nullptr; ///< of a solid: its cells; else triangles. Lives as long
                                          ///< as the simulation
    std::vector<Vec3> points;             ///< now [m]
    std::vector<std::array<std::int32_t, 3>> triangles;
    std::vector<Field> point_fields, cell_fields;
};

/// The smallest step, of the longest, where the scene does not say.
constexpr double kDefaultSmallest = 1.0 / 1024;

/// The only owner of bodies: made once from a scene, then advanced step by step.
class Simulation {
public:
    virtual ~Simulation() = default;

    /// The offline stage, once: all that can still refuse the scene, before anything is written.
    /// run() and restore() do it where nobody has.
    /// @throws InputError
    virtual void prepare() {}

    /// Runs to the scene's end, or until `stop` is set (looked at between steps). Calls the
    /// observer with step 0 first (unless the state was restored), then with each step.
    virtual RunSummary run(StepObserver& observer, const std::atomic<bool>& stop) = 0;

    virtual const std::vector<Obstacle>& obstacles() const = 0;
    virtual std::vector<BodyPlan> plan() const = 0;

    /// How the linear systems of solids are solved, and what each way costs.
    virtual LinearPlan linear_plan() const { return {}; }

    /// Largest contact force seen on each vertex of an obstacle's surface [N].
    virtual std::vector<double> max_contact_force(std::size_t obstacle) const = 0;

    /// The contact problems of the last step. For an observer: they cost as much as some steps,
    /// and hold until the next one.
    virtual std::vector<RecordedProblem> contact_problems() const = 0;

    /// Solids and rigid bodies after the last step. For an observer; stresses cost some time.
    virtual std::vector<BodyRecord> body_records() const = 0;

    /// What may be meant otherwise in the scene's files.
    virtual std::vector<Issue> warnings() const { return {}; }
    /// What the offline stage did, a line each; after run().
    virtual std::vector<std::string> messages() const { return {}; }

    /// Everything that the next step depends on, for a bit-identical continuation.
    virtual std::vector<std::byte> save() const = 0;
    /// @throws InputError  if the bytes do not fit this scene; nothing is changed
    virtual void restore(const std::vector<std::byte>& state) = 0;
};

/// How a scene is solved, beside what it says itself.
struct SimulationOptions {
    std::string cache;  ///< folder of factors; "": none
    int threads = 1;    ///< of the contact solver
    bool refuse = true; ///< where the memory does not suffice; else linear_plan() says so
};

/// @throws InputError  if a body cannot be made as the scene says (e.g. the wire starts inside a
/// wall)
std::unique_ptr<Simulation> make_simulation(const Scene& scene, std::vector<Obstacle> obstacles,
                                            const SimulationOptions& options = {});

} // namespace amontons
