#pragma once

#include "validation/measure.hpp"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

// Results of the cases as text, JSON and web page.

namespace amontons::validation {

/// `amontons validate --json`.
std::string json_of(const std::vector<CaseResult>& results);
/// Reads the text of json_of(). @throws InputError
std::vector<CaseResult> read_results(std::string_view json, const std::string& file);

/// A case as lines of text, below kHeading.
std::string text_of(const CaseResult& result);
extern const char* const kHeading;

std::string csv_of(const std::vector<CaseResult>& results);
/// How much is left out or misses the tolerance of its source, in a sentence.
std::string left_out_text(const std::vector<CaseResult>& results);
std::string markdown_of(const std::vector<CaseResult>& results);

/// A plot of the report: its name (NAME.svg) and the gnuplot script that draws it.
using PlotScript = std::pair<std::string, std::string>;

/// Errors over tolerances of all rows ("errors"), and a plot for each curve ("CASE-1", ...).
std::vector<PlotScript> plots_of(const std::vector<CaseResult>& results);

/// One page with tables and plots/NAME.svg. The same results give the same bytes but for the
/// seconds and the line about program, machine and date.
/// @param about  what stands in that line
/// @param drawn  names of the plots that are there
std::string html_of(const std::vector<CaseResult>& results, const std::string& about,
                    const std::vector<std::string>& drawn);

} // namespace amontons::validation
