#pragma once

#include "mesh/wall.hpp"
#include "solver/output/step_record.hpp"
#include "solver/scene/scene.hpp"

#include <atomic>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

namespace amontons {

struct RecordedProblem; // solver/step/wire_problem.hpp

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
    std::string kind; ///< "obstacle" | "beam"
    int unknowns = 0; ///< at its largest
};

/// The only owner of bodies: made once from a scene, then advanced step by step.
class Simulation {
public:
    /// @throws InputError  if a body cannot be made as the scene says (e.g. the wire starts inside
    /// a wall)
    Simulation(const Scene& scene, std::vector<Obstacle> obstacles);
    Simulation(Simulation&&) noexcept;
    ~Simulation();

    /// Runs to the scene's end, or until `stop` is set (looked at between steps). Calls the
    /// observer with step 0 first (unless the state was restored), then with each step.
    RunSummary run(StepObserver& observer, const std::atomic<bool>& stop);

    const std::vector<Obstacle>& obstacles() const;
    std::vector<BodyPlan> plan() const;

    /// Largest contact force seen on each vertex of an obstacle's surface [N].
    std::vector<double> max_contact_force(std::size_t obstacle) const;

    /// The contact problem of the last step, of each wire. For an observer: it costs as much as
    /// some steps, and holds until the next one.
    std::vector<RecordedProblem> contact_problems() const;

    /// Everything that the next step depends on, for a bit-identical continuation.
    std::vector<std::byte> save() const;
    /// @throws InputError  if the bytes do not fit this scene; nothing is changed
    void restore(const std::vector<std::byte>& state);

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace amontons
