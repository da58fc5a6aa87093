#pragma once

#include "solver/step/simulation.hpp"

#include <atomic>
#include <doctest/doctest.h>
#include <string>
#include <vector>

namespace amontons {

/// Keeps what a run states of its steps; stops it after one.
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

/// A quantity of a step, by its name.
inline double value(const StepRecord& r, const std::string& name)
{
    for (const Quantity& q : r.quantities)
        if (q.name == name) return q.value;
    FAIL("no quantity " << name);
    return 0;
}

} // namespace amontons
