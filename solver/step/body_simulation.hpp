#pragma once

#include "solver/step/simulation.hpp"

namespace amontons {

/// Solids and rigid bodies among obstacles.
class BodySimulation final : public Simulation {
public:
    /// @throws InputError  as make_simulation
    BodySimulation(const Scene& scene, std::vector<Obstacle> obstacles,
                   const SimulationOptions& options = {});
    ~BodySimulation() override;

    StepResult step(const std::atomic<bool>& stop,
                    double not_beyond = std::numeric_limits<double>::infinity()) override;
    RunSummary conclude(const StepResult& last) override;
    void spent_on_output(double seconds) override;
    const RunSummary& so_far() const override;
    const std::vector<InputInfo>& inputs() const override;
    double input(std::size_t number) const override;
    void set_input(std::size_t number, double value) override;
    const std::vector<Obstacle>& obstacles() const override;
    std::vector<BodyPlan> plan() const override;
    LinearPlan linear_plan() const override;
    std::vector<double> max_contact_force(std::size_t obstacle) const override;
    std::vector<RecordedProblem> contact_problems() const override;
    std::vector<BodyRecord> body_records() const override;
    std::vector<Issue> warnings() const override;
    std::vector<std::string> messages() const override;
    void prepare() override;
    std::vector<std::byte> save() const override;
    void restore(const std::vector<std::byte>& state) override;
    void take_over(const Simulation& before) override;

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace amontons
