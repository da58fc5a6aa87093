#pragma once

#include "mesh/base/phase_timer.hpp"
#include "solver/program/session.hpp"
#include "solver/record/step_record.hpp"

namespace amontons {

/// How far a run is: a bar with the time left on a terminal, a line now and then in a log.
class Progress {
public:
    /// @param end  time at which the run is done [s]
    Progress(const Session& session, double end);
    void step(const StepRecord& record);
    void end(); ///< takes the bar away

private:
    const Session& session_;
    double end_ = 0, first_ = -1; ///< simulated [s]
    double last_seconds_ = 0, last_fraction_ = 0;
    bool bar_ = false;
    Stopwatch watch_;
};

} // namespace amontons
