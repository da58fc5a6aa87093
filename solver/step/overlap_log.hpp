#pragma once

#include "solver/step/contact_size.hpp"

#include <array>
#include <map>
#include <string>

namespace amontons {

class ByteReader;
class ByteWriter;

/// What the steps of a run leave of overlaps, and contacts that are smaller than a face: a sentence
/// each for the run's warnings.
struct OverlapLog {
    std::map<int, ContactSize> largest;            ///< of each pair, when its force was largest
    std::map<std::array<int, 3>, double> reported; ///< by bodies and obstacle, at its worst [m]

    /// Takes an accepted step. Appends a sentence where a pair's overlap is 1.5 times as deep as
    /// the last that was reported.
    /// @param parted  impacts within the step left the overlaps, which are removed now
    void add(const BodySystem& system, const BodyStepReport& report, int step,
             std::vector<std::string>& warnings, bool parted = false);
    /// Of pairs whose contact was narrower than a face when its force was largest.
    std::vector<std::string> small_contacts(const BodySystem& system) const;

    /// Saves the log for a checkpoint.
    void save(ByteWriter& out) const;
    /// @throws InputError  if it is of other pairs
    static OverlapLog read(ByteReader& in, std::size_t pairs);
};

} // namespace amontons
