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

/// Runs gnuplot on a script in its folder. @return  false if it is missing or fails
bool draw_plot(const std::string& directory, const std::string& script);

} // namespace amontons
