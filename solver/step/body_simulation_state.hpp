#pragma once

#include "solver/body/linear_limit.hpp"
#include "solver/step/body_simulation.hpp"
#include "solver/step/body_step.hpp"
#include "solver/step/energy_balance.hpp"
#include "solver/step/instrument_record.hpp"
#include "solver/step/knots.hpp"
#include "solver/step/live_inputs.hpp"
#include "solver/step/outside.hpp"
#include "solver/step/overlap_log.hpp"
#include "solver/step/start_overlap.hpp"

#include <algorithm>
#include <optional>

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
    bool unstable_kept = false;
};

struct BodySimulation::State {
    Scene scene;
    std::vector<Obstacle> obstacles;
    std::vector<Issue> warnings;
    SimulationOptions options;
    std::vector<std::string> messages;
    std::unique_ptr<BodySystem> system;
    std::vector<const CurvePoints*> curves; ///< whose knots no step passes
    LiveInputs inputs;                      ///< on the curves of driven rigid bodies
    void add_inputs();
    BodyStepReport last;
    StepInput last_input; ///< of the last step

    const std::atomic<bool>* stop = nullptr;
    bool ready = false, started = false;
    double time = 0, step_length = 0;
    double path_length = 0; ///< of the next step along the path [m]
    int step = 0, retries = 0;
    std::vector<LinearLimit>
        limits; ///< of each body; of linear solids, as far as they were examined
    /// Examines linear solids as they are now: at frames, and at the end. O(elements), and of a
    /// condensed solid a solve.
    void note_limits();
    int lagging = 0, jumps = 0; ///< steps whose contacts lag or jump, whose energy jumps
    int unstable = 0;           ///< steps whose balance does not stand
    bool unstable_kept = false; ///< the last step's does not, and was not left
    std::string why_kept;
    bool unheld_reported = false; ///< what nothing holds of rods that rest on contacts
    double contacts_sum = 0;
    EnergyRecord energy;
    StepRefinement refinement;
    RunSummary summary;
    OverlapLog overlaps;
    std::vector<InstrumentLog> instruments; ///< of each rod that was given as a beam, in order
    /// @param each  called with (rod's number of all rods, body's number)
    template <class Each> void for_instruments(Each&& each) const
    {
        int rod = 0;
        for (std::size_t b = 0; b < system->refs.size(); ++b) {
            if (!system->refs[b].rod) continue;
            if (scene.rods[std::size_t(rod)].instrument) each(rod, int(b));
            ++rod;
        }
    }
    void note_instruments(const StepRecord& r);

    double smallest() const
    {
        return scene.time.smallest_step > 0 ? scene.time.smallest_step
                                            : kDefaultSmallest * scene.time.step;
    }
    bool has_drag() const; ///< some rod is
    bool dynamic() const { return scene.time.kind == "dynamic"; }
    double next_stop() const { return next_knot(curves, time, scene.time.end); }
    void make_ready();
    bool advance(double h, bool relaxed = false, double share = 1);
    bool leave_unstable(bool may_cut);
    void add_seconds(); ///< of the last step
    void add_energy();
    double work_against_left(const BeforeStep& before) const;
    std::vector<std::string> unstable_bodies() const;
    void note_unstable();
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
        o.outside = outside_of(scene);
        return o;
    }
    /// Rods that lose their balance can be followed against a drag, whatever they lie on.
    bool may_snap() const { return !dynamic() && system->has_rods(); }
    bool advance_path();
    EnergyScale energy_scale() const;
    BeforeStep before_step() const;
    void put_back(const BeforeStep& before);
    std::vector<std::byte> bytes_for(const State& next) const;
    EnergyVerdict judge_energy(const BeforeStep& before, double h);
    double within_reach(double h) const;
    StepRecord record(double h, double seconds);
    StepResult record_accepted(StepRecord record);
    StepResult begin();
    StepResult step_path();
    std::optional<StepResult> step_on(double not_beyond);
    void finish();
    void examine_forces();
};

} // namespace amontons
