#pragma once

#include "mesh/base/text.hpp"

#include <charconv>
#include <cstdint>
#include <string_view>

namespace amontons {

/// Numbers between blanks and line ends, read where they stand: for files of millions of them.
/// What is unusual ("+1", 1e-400, nan) passes the slow way, through parse_double.
class NumberScanner {
public:
    explicit NumberScanner(std::string_view text, std::size_t line = 1)
        : at_(text.data())
        , begin_(text.data())
        , end_(text.data() + text.size())
        , line_(line)
    {
    }

    /// The next word as a number. @return  false if it is none; it has then been passed over
    bool integer(std::int64_t& value)
    {
        skip_blanks();
        const auto [stop, error] = std::from_chars(at_, end_, value);
        if (error == std::errc{} && ends_word(stop)) {
            at_ = stop;
            return true;
        }
        const auto slow = parse_integer(word());
        if (slow) value = *slow;
        return slow.has_value();
    }
    /// Reads a number. @returns  false at the end, or if there is none.
    bool number(double& value)
    {
        skip_blanks();
        const auto [stop, error] = std::from_chars(at_, end_, value);
        if (error == std::errc{} && ends_word(stop)) {
            at_ = stop;
            return true;
        }
        const auto slow = parse_double(word());
        if (slow) value = *slow;
        return slow.has_value();
    }
    /// The next word, "" at the end.
    std::string_view word()
    {
        skip_blanks();
        const char* const start = at_;
        while (at_ != end_ && !is_blank(*at_))
            ++at_;
        last_ = {start, static_cast<std::size_t>(at_ - start)};
        return last_;
    }
    /// The word that was no number.
    std::string_view refused() const { return last_; }
    /// The rest of the line, without its end; stands then in the next.
    std::string_view rest_of_line()
    {
        const char* const start = at_;
        while (at_ != end_ && *at_ != '\n')
            ++at_;
        const std::string_view text(start, static_cast<std::size_t>(at_ - start));
        if (at_ != end_) {
            ++at_;
            ++line_;
        }
        return text;
    }
    /// Passes over n bytes.
    void skip(std::size_t n)
    {
        for (; n > 0 && at_ != end_; --n)
            if (*at_++ == '\n') ++line_;
    }
    /// Stands at an offset of the text; lines are not counted on the way.
    void jump(std::size_t offset) { at_ = begin_ + offset; }
    /// True at the end of the text, after blanks.
    bool at_end()
    {
        skip_blanks();
        return at_ == end_;
    }
    std::size_t line() const { return line_; } ///< of the next word once it was examined
    /// Bytes read so far.
    std::size_t offset() const { return static_cast<std::size_t>(at_ - begin_); }
    /// The text that is left.
    std::string_view rest() const { return {at_, static_cast<std::size_t>(end_ - at_)}; }

private:
    static bool is_blank(char c) { return static_cast<unsigned char>(c) <= ' '; }
    bool ends_word(const char* stop) const { return stop == end_ || is_blank(*stop); }
    void skip_blanks()
    {
        for (; at_ != end_ && is_blank(*at_); ++at_)
            if (*at_ == '\n') ++line_;
    }

    const char* at_;
    const char* begin_;
    const char* end_;
    std::size_t line_;
    std::string_view last_;
};

} // namespace amontons
