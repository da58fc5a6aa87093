#pragma once

#include "solver/program/scene_lines.hpp"
#include "solver/step/recorded_problem.hpp"
#include "solver/step/simulation.hpp"

namespace amontons {

/// A simulation whose scene the user changes while it runs, by lines on stdin: between two steps
/// the state continues in a new one. What makes the bodies others is refused, with the reason.
class ChangedSimulation final : public Simulation {
public:
    /// @param overrides  those that the scene was read with
    ChangedSimulation(const Scene& scene, std::vector<std::string> overrides,
                      std::vector<Obstacle> obstacles, const SimulationOptions& options,
                      const Session& session);

    void prepare() override { now_->prepare(); }
    StepResult step(const std::atomic<bool>& stop,
                    double not_beyond = std::numeric_limits<double>::infinity()) override;
    RunSummary conclude(const StepResult& last) override { return now_->conclude(last); }
    void spent_on_output(double seconds) override { now_->spent_on_output(seconds); }
    const RunSummary& so_far() const override { return now_->so_far(); }
    const std::vector<InputInfo>& inputs() const override { return now_->inputs(); }
    double input(std::size_t number) const override { return now_->input(number); }
    void set_input(std::size_t number, double value) override { now_->set_input(number, value); }
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
    const Session& session_;
    SceneLines lines_;
    bool begun_ = false; ///< the state that the run begins from is there
    std::unique_ptr<Simulation> now_;
};

} // namespace amontons
