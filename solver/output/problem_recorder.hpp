#pragma once

#include "solver/step/simulation.hpp"

#include <string>

namespace amontons {

/// Writes the contact problems that arise in a run, one FCLib file a step and wire, with the step's
/// own solution.
class ProblemRecorder {
public:
    /// @param resume  keep the files that are there
    /// @throws WriteError  if its folder cannot be made
    ProblemRecorder(const Simulation& simulation, const Scene& scene, std::string folder,
                    bool resume);

    /// Of the simulation's last step. @throws WriteError
    void write(const StepRecord& record) const;

private:
    const Simulation& simulation_;
    const Scene& scene_;
    std::string folder_;
};

/// Before anything is written. @throws InputError  if the module that writes them is missing
void check_recorder();
/// @throws InputError  of instruments in one another no contact problem is recorded: their step has
///                     one for all
void check_recordable(const Scene& scene);

} // namespace amontons
