#pragma once

#include "solver/output/step_record.hpp"
#include "solver/step/byte_stream.hpp"

// What every simulation sums up over its steps, and how a checkpoint keeps it.

namespace amontons {

void add_step(RunSummary& summary, const StepRecord& step);

void save_summary(const RunSummary& summary, ByteWriter& out);
/// @throws InputError  as ByteReader
RunSummary read_summary(ByteReader& in);

} // namespace amontons
