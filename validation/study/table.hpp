#pragma once

#include "validation/study/record.hpp"
#include "validation/study/sweep.hpp"

#include <optional>
#include <string>
#include <vector>

// What comes of a study: error against time and unknowns, observed orders, the Pareto front.

namespace amontons::study {

struct Row {
    Point point;
    double value = 0;                ///< of the quantity; NaN if there is none
    std::optional<std::string> text; ///< of a quantity in words: it has no value and no error
    double error = 0; ///< relative to the reference; absolute if that is 0; NaN if there is none
    double seconds = 0, cpu_seconds = 0; ///< [s]
    double unknowns = 0, steps = 0;      ///< NaN if the run did not state
    std::string status, reason;
    bool on_front = false;     ///< no other row is both quicker and more accurate
    bool is_reference = false; ///< the finest: its error gives no information
};

/// Rows that differ in the refined parameter alone.
struct Series {
    std::string name; ///< "bodies.a.mesh.element=T10", "" if there is only one
    std::vector<std::size_t> rows;
    double order = 0; ///< least squares; NaN if fewer than two errors are known, or one rises
    std::vector<double> orders; ///< between neighbours that are done
    bool falls = true;          ///< every error is below that of the coarser neighbour
};

enum class ReferenceKind { value, file, finest };

/// A point of another program, for comparison.
struct AddedRow {
    std::string name;
    double value = 0, error = 0, seconds = 0, unknowns = 0; ///< NaN if not given; error as of Row
};

/// Rows of another program: a heading with name, seconds [s], value or error, and unknowns if
/// known.
/// @param file  for messages
/// @throws InputError
/// @param quantity  a column of this name is the value: the study.csv of another study is read, too
/// @param by_cpu    processor times are taken where there are any
std::vector<AddedRow> read_added(std::string_view text, const std::string& file,
                                 const std::string& quantity = "value", bool by_cpu = false);

struct Table {
    std::vector<Sweep> sweeps;
    std::string quantity;
    ReferenceKind kind = ReferenceKind::finest;
    double reference = 0; ///< NaN if nothing is done yet
    std::vector<Row> rows;
    std::vector<Series> series;
    int refined = -1;    ///< the sweep along which orders are observed; -1: none has numbers
    double order = 0;    ///< of the only series; NaN if there are several
    bool by_cpu = false; ///< times of front and plot are processor times
    std::vector<AddedRow> added;
};

/// A row of what was recorded. A run that is done but lacks the quantity gets the status
/// "no_quantity".
Row make_row(const Point& point, const PointRecord& record, const std::string& quantity);

/// Sets reference (of the finest), errors, front, series and orders from values and times.
///
/// The finest row is the one with the most unknowns; among those the one with the most steps;
/// then the last. The order is the slope of log(error) over log(value of the refined sweep),
/// with the sign that makes it positive where the error falls on refining: refining is what
/// makes unknowns or steps more, and else what makes the value smaller.
void evaluate(Table& table);

/// How often each text of a quantity in words came out, the most frequent first.
std::vector<std::pair<std::string, int>> text_counts(const Table& table);

std::string csv_of(const Table& table);
std::string json_of(const Table& table);
/// A gnuplot script that draws NAME.svg: error against time, error against unknowns, value
/// against the refined parameter. "" if nothing can be drawn.
std::string plot_script(const Table& table, const std::string& name);
/// A table for a paper, with booktabs: parameters, value, error, time, unknowns.
std::string tex_of(const Table& table);
/// For people.
std::string text_of(const Table& table);

} // namespace amontons::study
