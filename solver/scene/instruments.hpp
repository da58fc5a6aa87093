#pragma once

#include "solver/scene/findings.hpp"
#include "solver/scene/scene.hpp"

#include <string>
#include <vector>

// Guidewires, catheters and sheaths by name, as data with their sources, and how a scene's
// "instrument" becomes segments.

namespace amontons {

/// A bend of the unstressed instrument, or a straight piece (curvature 0).
struct TipPiece {
    double length = 0;    ///< [m]
    double curvature = 0; ///< [1/m]; negative bends the other way
};

/// A shaft, a taper and a tip.
struct Instrument {
    std::string name;
    std::string kind;    ///< "guidewire" | "catheter" | "sheath"
    double length = 0;   ///< of all [m]
    double diameter = 0; ///< outer [m]
    double bore = 0;     ///< inner diameter; 0: solid [m]
    double EI = 0;       ///< of the shaft [N m^2]
    double GJ = 0;       ///< of the shaft [N m^2]
    double EI_tip = 0;   ///< at the very tip, reached linearly over `taper` [N m^2]
    double taper = 0;    ///< [m]; tip included
    double element = 0;  ///< of the shaft [m]; half of it in taper and tip
    std::vector<TipPiece> tip;
    std::string source; ///< of its values
};

/// The library. GJ is 0.77 EI (a round section of nu = 0.3) unless its source specifies otherwise;
/// EA is that of the same material.
const std::vector<Instrument>& instruments();

/// Replaces every beam's "instrument" with its segments.
void make_segments(Scene& scene, Findings& findings);

} // namespace amontons
