#pragma once

#include "bindings/python/common.hpp"

namespace amontons::python {

/// amontons.StepRecord
struct StepView {
    Record record;
    py::object quantities = py::object(); ///< made at first use
    const StepRecord& step() const { return record->step; }
};
/// amontons.Contacts
struct ContactsView {
    Record record;
};
/// amontons.Beam
struct BeamView {
    Record record;
    std::size_t number = 0;
    const BeamRecord& beam() const { return record->step.beams[number]; }
};

} // namespace amontons::python
