#pragma once

#include "solver/step/simulation.hpp"

namespace amontons {

/// Beams in obstacles.
class WireSimulation final : public Simulation {
public:
    /// @throws InputError  as make_simulation
    WireSimulation(const Scene& scene, std::vector<Obstacle> obstacles);
    ~WireSimulation() override;

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
    std::vector<double> max_contact_force(std::size_t obstacle) const override;
    std::vector<RecordedProblem> contact_problems() const override;
    std::vector<BodyRecord> body_records() const override;
    std::vector<std::byte> save() const override;
    void restore(const std::vector<std::byte>& state) override;

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace amontons
