#pragma once

#include "solver/record/step_record.hpp"
#include "solver/step/byte_stream.hpp"
#include "solver/step/simulation.hpp"

// Sums and extremes over the steps of a run, and their storage in checkpoints.

namespace amontons {

/// Adds a step to the quantities of the run.
void add_step(RunSummary& summary, const StepRecord& step);

/// Name of a step's outcome in a summary: "done" | "failed" | "interrupted" | "running".
const char* status_of(StepResult::Outcome outcome);

/// A refused step and its message.
inline StepResult failed_step(std::string message)
{
    return {StepResult::Outcome::failed, std::move(message), {}};
}
/// A step that was interrupted.
inline StepResult interrupted_step()
{
    return {StepResult::Outcome::interrupted, "interrupted by the user", {}};
}
/// An accepted step.
inline StepResult accepted_step(StepRecord record)
{
    return {StepResult::Outcome::accepted, "", std::move(record)};
}

/// Saves the quantities for a checkpoint.
void save_summary(const RunSummary& summary, ByteWriter& out);
/// @throws InputError  as ByteReader
RunSummary read_summary(ByteReader& in);

} // namespace amontons
