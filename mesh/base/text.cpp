#include "mesh/base/text.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>

namespace amontons {
namespace {

constexpr std::size_t kMostIssues = 20; // more help no one

bool is_blank(char c)
{
    return static_cast<unsigned char>(c) <= ' ' && c != '\n';
}

char lower(char c)
{
    return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

// from_chars accepts no plus sign; "+-1" is still no number.
std::string_view without_plus(std::string_view word)
{
    return word.size() > 1 && word[0] == '+' && word[1] != '-' ? word.substr(1) : word;
}

} // namespace

void FileIssues::add(std::string place, std::string found, std::string allowed)
{
    issues_.push_back({file_, std::move(place), std::move(found), std::move(allowed)});
    if (issues_.size() < kMostIssues) return;
    issues_.push_back({file_, "", "more of this", "see above"});
    throw_if_any();
}

void FileIssues::fatal(std::string place, std::string found, std::string allowed)
{
    issues_.push_back({file_, std::move(place), std::move(found), std::move(allowed)});
    throw InputError(issues_);
}

void FileIssues::throw_if_any() const
{
    if (!issues_.empty()) throw InputError(issues_);
}

std::string line_place(std::size_t line)
{
    return "line " + std::to_string(line);
}

std::string line_and_column(std::string_view text, std::size_t byte)
{
    const std::string_view before = text.substr(0, byte > 0 ? byte - 1 : 0);
    const auto line = 1 + std::count(before.begin(), before.end(), '\n');
    const std::size_t start = before.rfind('\n') + 1; // npos + 1 is 0
    return line_place(static_cast<std::size_t>(line)) + ", column " +
           std::to_string(before.size() - start + 1);
}

std::string_view WordReader::word()
{
    std::size_t n = 0;
    while (n < rest_.size() && static_cast<unsigned char>(rest_[n]) > ' ')
        ++n;
    const std::string_view word = rest_.substr(0, n);
    rest_.remove_prefix(n);
    return word;
}

std::string_view WordReader::next()
{
    std::size_t n = 0;
    for (; n < rest_.size() && static_cast<unsigned char>(rest_[n]) <= ' '; ++n)
        if (rest_[n] == '\n') ++line_;
    rest_.remove_prefix(n);
    return word();
}

std::string_view WordReader::next_in_line()
{
    while (!rest_.empty() && is_blank(rest_[0]))
        rest_.remove_prefix(1);
    return word();
}

std::string_view WordReader::rest_of_line()
{
    const std::size_t n = std::min(rest_.find('\n'), rest_.size());
    const std::string_view text = rest_.substr(0, n);
    rest_.remove_prefix(std::min(n + 1, rest_.size()));
    ++line_;
    return text;
}

std::optional<double> parse_double(std::string_view word)
{
    word = without_plus(word);
    double value = 0;
    const char* const end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, value);
    if (stop != end || word.empty()) return {};
    // Out of range is also 1e-400, which is 0: strtod distinguishes them.
    if (error == std::errc::result_out_of_range)
        return std::strtod(std::string(word).c_str(), nullptr);
    if (error != std::errc{}) return {};
    return value;
}

std::optional<long long> parse_integer(std::string_view word)
{
    word = without_plus(word);
    long long value = 0;
    const char* const end = word.data() + word.size();
    const auto [stop, error] = std::from_chars(word.data(), end, value);
    if (stop != end || word.empty() || error != std::errc{}) return {};
    return value;
}

std::string_view without_byte_order_mark(std::string_view text)
{
    return text.substr(0, 3) == "\xef\xbb\xbf" ? text.substr(3) : text;
}

bool same_word(std::string_view a, std::string_view b)
{
    return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin(),
                                              [](char x, char y) { return lower(x) == lower(y); });
}

std::string lower_case(std::string_view text)
{
    std::string out(text);
    std::transform(out.begin(), out.end(), out.begin(), lower);
    return out;
}

void append_number(std::string& text, double value)
{
    char digits[32];
    const auto [end, error] = std::to_chars(digits, digits + sizeof digits, value);
    text.append(digits, end);
}

std::string number_text(double value)
{
    std::string text;
    append_number(text, value);
    return text;
}

} // namespace amontons
