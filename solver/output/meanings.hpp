#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

// What every column, field and key that a run writes means: docs/outputs.md, and what
// `amontons check SCENE --quantities` states, are made of this table and of nothing else.

namespace amontons {

/// One name, or many of a form: words in capitals stand for names of the scene (NAME, A and B of
/// bodies, SET of sets and places, PROBE of
/// probes, N for numbers).
struct Meaning {
    /// Shown as NAME_x, NAME_y, NAME_z; and with "NAME_" before it if several wires are there.
    enum Form { plain, vector, of_wire, vector_of_wire };
    std::string_view name;
    std::string_view unit; ///< SI; "" of counts, ratios and words
    std::string_view text; ///< sign and meaning, a sentence
    Form form = plain;
};

/// A table of the page: a file, or a part of one.
struct MeaningTable {
    /// Heading of the table.
    std::string_view title;
    /// What the table is of.
    std::string_view about;
    /// One for each column, field or key.
    std::vector<Meaning> rows;
};

/// All tables. Built at the first call.
std::span<const MeaningTable> meanings();

/// What a quantity of `amontons run --json`, or a column of history.csv without its unit, means;
/// null if nothing is known of such a name. The first row that fits.
const Meaning* meaning_of(std::string_view quantity);

/// docs/outputs.md.
std::string outputs_page();

} // namespace amontons
