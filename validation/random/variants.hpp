#pragma once

#include "validation/random/kinds.hpp"
#include "validation/random/laws.hpp"

#include <map>
#include <string>
#include <vector>

namespace amontons::validation {

/// How a variant of a scene is run and compared with the scene itself.
struct Variant {
    std::string name; ///< "turned", "axes" (turned by whole axes), "renamed", "reordered", "units",
                      ///< "threads", "steps", "resumed", a twin's name
    Json scene;
    int threads = 1;
    double killed_after =
        0; ///< share of the scene's own steps after which it is killed, then resumed; 0: not
    double tolerance = 0; ///< relative to the largest value of a unit; 0: the same bits
    bool forces_only = false;
    Mat3 turn = Mat3::Identity();
    Vec3 shift = Vec3::Zero();
    double length = 1, force = 1, time = 1;                      ///< units
    std::vector<std::pair<std::string, std::string>> names = {}; ///< of bodies, before and after
};

/// All variants of a scene; they depend on seed and number alone.
std::vector<Variant> variants_of(const RandomScene& scene, std::uint64_t seed, int number);

/// Whether two runs are cut into other steps. @param units  of time, of the other
bool took_other_steps(const WrittenRun& run, const WrittenRun& other, double units);

/// What the lengths of its steps leave of a run: by column, or by the stem of a vector's columns.
using StepError = std::map<std::string, double>;

/// Twice what runs of the same scene in other steps differ by at the end, the largest of them.
StepError step_error(const WrittenRun& run, const std::vector<WrittenRun>& others);

/// What differs between a run and that of a variant by more than it may. At most one finding: the
/// worst.
/// @param left  of runs that took other steps; what it has no column of: nothing
std::vector<Finding> compare_runs(const WrittenRun& run, const WrittenRun& other,
                                  const Variant& variant, const StepError& left = {});

} // namespace amontons::validation
