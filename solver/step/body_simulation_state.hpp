#pragma once

#include "solver/body/linear_limit.hpp"
#include "solver/step/body_simulation.hpp"
#include "solver/step/body_step.hpp"
#include "solver/step/energy_balance.hpp"
#include "solver/step/knots.hpp"
#include "solver/step/overlap_log.hpp"
#include "solver/step/start_overlap.hpp"

#include <algorithm>

// What a run of solids, rigid bodies and rods keeps between its steps: of body_simulation.cpp and
// body_checkpoint.cpp alone.

namespace amontons {

/// All that a step changes.
struct BeforeStep {
    double time = 0;
    EnergyRecord energy;
    std::vector<std::vector<double>> bodies;
    std::map<BodySystem::Key, Vec3> warm, warm_friction;
    std::map<BodySystem::Key, bool> warm_sticks;
    std::vector<std::vector<PlaceRow>> rows;
    std::vector<CouplingMemory> couplings;
};

struct BodySimulation::State {
    Scene scene;
    std::vector<Obstacle> obstacles;
    std::vector<Issue> warnings;
    SimulationOptions options;
    std::vector<std::string> messages;
    std::unique_ptr<BodySystem> system;
    std::vector<const CurvePoints*> curves;
    BodyStepReport last;
    StepInput last_input; ///< of the last step

    const std::atomic<bool>* stop = nullptr;
    bool ready = false, started = false;
    double time = 0, step_length = 0;
    double path_length = 0; ///< of the next step along the path [m]
    int step = 0, retries = 0;
    std::vector<LinearLimit>
        limits; ///< of each body; of linear solids, as far as they were looked at
    /// Looks at linear solids as they are now: at frames, and at the end. O(elements), and of a
    /// condensed solid a solve.
    void note_limits();
    int lagging = 0, jumps = 0; ///< steps of this run whose contacts lag behind, whose energy jumps
    double contacts_sum = 0;
    EnergyRecord energy;
    StepRefinement refinement;
    RunSummary summary;
    OverlapLog overlaps;

    double smallest() const
    {
        return scene.time.smallest_step > 0 ? scene.time.smallest_step
                                            : kDefaultSmallest * scene.time.step;
    }
    bool in_medium() const; ///< some rod is
    bool dynamic() const { return scene.time.kind == "dynamic"; }
    double next_stop() const { return next_knot(curves, time, scene.time.end); }
    void make_ready();
    bool advance(double h, bool relaxed = false, double share = 1);
    bool find_first_balance();
    /// Presses bodies that begin inside each other apart.
    bool resolve_start()
    {
        return resolve_start_overlaps(system->finder, dynamic(), *stop,
                                      [&]() -> const BodyStepReport& {
                                          if (dynamic())
                                              last = separation_step(*system, step_options());
                                          else
                                              advance(0);
                                          return last;
                                      });
    }
    BodyStepOptions step_options() const
    {
        BodyStepOptions o;
        o.tolerance = scene.accuracy.contact;
        o.solver = contact_solver(scene.accuracy.solver);
        o.threads = options.threads;
        o.stop = stop;
        return o;
    }
    /// Rods that lose their balance can be followed against a drag, whatever they lie on.
    bool may_snap() const { return !dynamic() && system->has_rods(); }
    bool advance_path();
    EnergyScale energy_scale() const;
    BeforeStep before_step() const;
    void put_back(const BeforeStep& before);
    EnergyVerdict judge_energy(const BeforeStep& before, double h);
    double within_reach(double h) const;
    StepRecord record(double h, double seconds);
    void finish();
    void examine_forces();
};

} // namespace amontons
