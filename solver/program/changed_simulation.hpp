#pragma once

#include "solver/program/scene_lines.hpp"
#include "solver/step/recorded_problem.hpp"
#include "solver/step/simulation.hpp"

namespace amontons {

/// A simulation whose scene the user changes while it runs, by lines on stdin: between two steps
/// the state goes on in a new one. What makes the bodies others is refused, with the reason.
class ChangedSimulation final : public Simulation {
public:
    /// @param overrides  those that the scene was read with
    /// @param stop       the flag that run() is given
    ChangedSimulation(const Scene& scene, std::vector<std::string> overrides,
                      std::vector<Obstacle> obstacles, const SimulationOptions& options,
                      std::atomic<bool>& stop, const Session& session);

    void prepare() override { now_->prepare(); }
    RunSummary run(StepObserver& observer, const std::atomic<bool>& stop) override;
    const std::vector<Obstacle>& obstacles() const override { return now_->obstacles(); }
    std::vector<BodyPlan> plan() const override { return now_->plan(); }
    std::vector<double> max_contact_force(std::size_t obstacle) const override
    {
        return now_->max_contact_force(obstacle);
    }
    std::vector<RecordedProblem> contact_problems() const override
    {
        return now_->contact_problems();
    }
    std::vector<BodyRecord> body_records() const override { return now_->body_records(); }
    std::vector<Issue> warnings() const override { return now_->warnings(); }
    std::vector<std::string> messages() const override { return now_->messages(); }
    std::vector<std::byte> save() const override { return now_->save(); }
    void restore(const std::vector<std::byte>& state) override { now_->restore(state); }

private:
    void change(const std::string& line);

    std::string file_;
    std::vector<std::string> overrides_;
    SimulationOptions options_;
    std::atomic<bool>& stop_;
    const Session& session_;
    SceneLines lines_;
    std::unique_ptr<Simulation> now_;
};

} // namespace amontons
