#pragma once

#include "mesh/base/error.hpp"

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

// What the readers of text formats share: words, lines, numbers, and a list of what is wrong.

namespace amontons {

/// Collects what is wrong with one file; stops a reader that would only add more of the same.
class FileIssues {
public:
    explicit FileIssues(std::string file) : file_(std::move(file)) {}
    /// Adds an Issue. @throws InputError  with all of them, when there are enough to show
    void add(std::string place, std::string found, std::string allowed);
    /// Adds an Issue after which the rest of the file cannot be understood. @throws InputError with
    /// all of them
    [[noreturn]] void fatal(std::string place, std::string found, std::string allowed);
    /// True if nothing is wrong.
    bool empty() const { return issues_.empty(); }
    /// @throws InputError  if there is any
    void throw_if_any() const;

private:
    std::string file_;
    std::vector<Issue> issues_;
};

/// "line 12"
std::string line_place(std::size_t line);

/// "line 12, column 3" of the byte that stands at `byte`, counted from 1.
std::string line_and_column(std::string_view text, std::size_t byte);

/// Reads a text word by word, and counts lines. Words are separated by line ends and blanks (every
/// control character is one).
class WordReader {
public:
    explicit WordReader(std::string_view text) : rest_(text) {}
    /// The next word, "" at the end of the text.
    std::string_view next();
    /// The next word of this line, "" at its end (which it does not pass).
    std::string_view next_in_line();
    /// The rest of this line; the reader then stands in the next one.
    std::string_view rest_of_line();
    /// Passes over n bytes of this line.
    void skip(std::size_t n) { rest_.remove_prefix(n); }
    /// True at the end of the text.
    bool at_end() const { return rest_.empty(); }
    /// Of the word that was read last, from 1.
    std::size_t line() const { return line_; }
    /// What has not been read yet.
    std::string_view rest() const { return rest_; }

private:
    std::string_view word();
    std::string_view rest_;
    std::size_t line_ = 1;
};

/// The number that a whole word stands for; nothing if it is none. Finite or not: "nan", "inf"
/// and 1e999 are numbers. "1,5" is none.
std::optional<double> parse_double(std::string_view word);

/// The whole number that a whole word stands for; nothing if it is none or does not fit.
std::optional<long long> parse_integer(std::string_view word);

/// The text behind a UTF-8 byte order mark, which some editors put in front.
std::string_view without_byte_order_mark(std::string_view text);

/// True if a and b are the same word but for upper and lower case.
bool same_word(std::string_view a, std::string_view b);

/// The text with ASCII letters in lower case.
std::string lower_case(std::string_view text);

/// Appends the shortest text that reads back as the same double.
/// @param value  any number
void append_number(std::string& text, double value);

/// The shortest text that reads back as the same double, any number.
std::string number_text(double value);

} // namespace amontons
