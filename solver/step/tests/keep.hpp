#pragma once

#include "solver/step/simulation.hpp"

#include <atomic>
#include <vector>

namespace amontons {

/// Keeps what a run says of its steps; stops it after one.
struct Keep : StepObserver {
    std::vector<StepRecord> records;
    std::atomic<bool>* stop = nullptr;
    int stop_at = -1;
    void on_step(const StepRecord& r) override
    {
        records.push_back(r);
        if (stop && r.step == stop_at) *stop = true;
    }
};

} // namespace amontons
