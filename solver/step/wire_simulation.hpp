#pragma once

#include "solver/step/simulation.hpp"

namespace amontons {

/// Beams in obstacles.
class WireSimulation final : public Simulation {
public:
    /// @throws InputError  as make_simulation
    WireSimulation(const Scene& scene, std::vector<Obstacle> obstacles);
    ~WireSimulation() override;

    RunSummary run(StepObserver& observer, const std::atomic<bool>& stop) override;
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
