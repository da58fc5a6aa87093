#pragma once

#include "mesh/base/curve.hpp"
#include "solver/step/branch_log.hpp"
#include "solver/step/coaxial.hpp"
#include "solver/step/live_inputs.hpp"
#include "solver/step/soft_vessel.hpp"
#include "solver/step/wall_force.hpp"
#include "solver/step/wire_group.hpp"
#include "solver/step/wire_overlap.hpp"
#include "solver/step/wire_simulation.hpp"

#include <algorithm>
#include <limits>

// What a run of instruments keeps between its steps: of wire_simulation.cpp and wire_checkpoint.cpp
// alone.

namespace amontons {

/// Plain numbers that a wire's history needs; copied to and from checkpoints as they are.
struct WireHistory {
    double elastic_start = 0; ///< J, of the initial state
    double elastic = 0, kinetic = 0;
    double cap = std::numeric_limits<double>::infinity(); ///< insertion at an opening [m]
    double max_push = 0, max_torque = 0, max_depth = 0, max_cluster = 0;
    int opening = -1, opening_wall = -1;
    BranchLog branch;
    WireOverlapLog overlap;
};

struct WireSimulation::State {
    Scene scene;
    std::vector<Obstacle> obstacles;
    std::vector<SoftVessel> vessels;
    std::vector<WireBody> wires;
    std::vector<std::unique_ptr<Coaxial>> coaxial; ///< wires in one another
    std::vector<WireGroup> groups;                 ///< every wire is in one
    std::vector<std::vector<int>> walls;           ///< obstacles of each wire's walls
    std::vector<WireHistory> history;
    std::vector<WireOverlap> overlap; ///< of each wire at the last accepted state
    std::vector<WallForce> force;     ///< on each obstacle
    std::vector<double> wall_moved;   ///< of each vessel's wall the most that was examined [m]

    bool started = false;
    double time = 0, step_length = 0;
    int step = 0, retries = 0, contact_steps = 0;
    double contacts_sum = 0;
    EnergyRecord energy;
    RunSummary summary;

    double longest() const { return scene.time.step; }
    double smallest() const
    {
        return scene.time.smallest_step > 0 ? scene.time.smallest_step
                                            : kDefaultSmallest * longest();
    }
    /// The length that is tried after h, which was refused. Half a step of smooth motion misses a
    /// quarter of what the whole misses of its balance, relative to what it turns over: what misses
    /// more has jumped, and is quartered.
    double shorter(double h, double missed_by) const
    {
        constexpr double kJumped = 4;
        const double relaxed = kRelaxFailed * longest();
        const double least = h > relaxed ? std::max(relaxed, smallest()) : smallest();
        return std::max((missed_by > kJumped ? 0.25 : 0.5) * h, least);
    }
    double insertion(std::size_t w, double t) const
    {
        // The base counts from the sheath's rigid end; the scene from its very end.
        const double fade = wires[w].wire.sheath->fade;
        return std::min(curve_value(scene.beams[w].insertion, t) + fade, history[w].cap);
    }
    double twist(std::size_t w, double t) const
    {
        const CurvePoints& c = scene.beams[w].twist;
        return c.empty() ? 0 : curve_value(c, t);
    }
    /// Of a held tip at time t [s], from where it began.
    Vec3 tip(std::size_t w, double t) const
    {
        const TipHoldInput& hold = scene.beams[w].hold;
        Vec3 moved = Vec3::Zero();
        const CurvePoints* along[] = {&hold.x, &hold.y, &hold.z};
        for (int k = 0; k < 3; ++k)
            if (!along[k]->empty()) moved[k] = curve_value(*along[k], t);
        return moved;
    }
    /// Where the bases of a group are at a time t [s].
    std::vector<BaseTarget> targets(const WireGroup& g, double t) const
    {
        std::vector<BaseTarget> to;
        for (const WireBody* b : g.wires) {
            const auto w = std::size_t(b - wires.data());
            to.push_back({insertion(w, t), twist(w, t), tip(w, t)});
        }
        return to;
    }
    /// The wire that a group's energy is kept with.
    std::size_t first_of(const WireGroup& g) const
    {
        return std::size_t(g.wires[0] - wires.data());
    }
    LiveInputs inputs; ///< on the curves of `scene`
    double next_knot() const;
    /// What a step that is not accepted leaves as it was.
    struct Kept {
        struct OfWire {
            WireState state;
            WireDynamics dynamics;
        };
        std::vector<OfWire> wires;
        std::vector<std::vector<Reaction>> nested;
    };
    /// Shared: the tries of one step begin from the same.
    std::shared_ptr<const Kept> keep() const;
    void put_back(const Kept& kept);
    /// The same with data that abandoned tries change: where points of contact are and are
    /// searched for, where tangents are taken.
    struct Unmoved {
        struct OfWire {
            int halvings = 0;
            std::vector<Proximity> proximity;
        };
        std::shared_ptr<const Kept> kept;
        std::vector<OfWire> wires;
        std::vector<std::shared_ptr<const Eigen::VectorXd>> tangents; ///< of vessels, or null
        std::vector<WireOverlap> overlap;
        std::vector<WireHistory> history;
        int retries = 0;
    };
    Unmoved unmoved() const;
    void undo(const Unmoved& before);
    StepResult begin(const std::atomic<bool>& stop);
    StepResult record_accepted(StepRecord record);
    bool solve_groups(double h, bool relax, StepReport& sum, std::vector<StepReport>& reports);
    bool advance(double h, StepReport& sum, std::string& refusal, bool relax,
                 std::shared_ptr<const Kept>& kept);
    void measure_start(WireGroup& g, const std::vector<BaseTarget>& to, StepReport& report);
    StepRecord record(const StepReport& r, double h, double seconds);
    void note_forces(const StepRecord& r);
    void note_overlap(std::size_t w, OverlapRecord& worst);
    const std::string& wall_name(int number) const
    {
        const auto o = std::size_t(number);
        return o < obstacles.size() ? obstacles[o].name
                                    : vessels[o - obstacles.size() - wires.size()].name;
    }
    void note_openings(const std::vector<Vec3>& tips_before);
    void note_walls();
    void finish(RunSummary& s) const;
    void report_branches(RunSummary& s) const;
};

} // namespace amontons
