#pragma once

#include <string>
#include <vector>

namespace amontons {

/// Draws a run's history by gnuplot, as SVG: forces, energy, error and time per step. The
/// gnuplot script stands beside each plot, to change and draw again.
/// @param directory  of the run, with its history.csv
/// @param message    why a plot is missing, "" if none is
/// @return  the files written, relative to the folder
std::vector<std::string> plot_history(const std::string& directory, std::string& message);

} // namespace amontons
