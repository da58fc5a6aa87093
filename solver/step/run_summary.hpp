#pragma once

#include "solver/output/step_record.hpp"
#include "solver/step/byte_stream.hpp"

// What every simulation sums up over its steps, and how a checkpoint keeps it.

namespace amontons {

void add_step(RunSummary& summary, const StepRecord& step);

/// A sentence if a run in motion has gained more than 1 % of its input (kinetic energy at the start and
/// the work of loads and drives); "" if not.
std::string energy_gain(const EnergyRecord& energy, double kinetic_start);

void save_summary(const RunSummary& summary, ByteWriter& out);
/// @throws InputError  as ByteReader
RunSummary read_summary(ByteReader& in);

} // namespace amontons
