#include "solver/scene/json_text.hpp"

#include "mesh/base/utf8.hpp"

#include <cmath>
#include <fmt/format.h>

namespace amontons {

void JsonText::line()
{
    if (!indented_) return;
    text_ += '\n';
    text_.append(2 * filled_.size(), ' ');
}

void JsonText::separate()
{
    if (after_key_) {
        after_key_ = false;
        return;
    }
    if (filled_.empty()) return;
    if (filled_.back()) text_ += ',';
    filled_.back() = true;
    line();
}

JsonText& JsonText::open(char bracket)
{
    separate();
    text_ += bracket;
    filled_.push_back(false);
    return *this;
}

JsonText& JsonText::close(char bracket)
{
    const bool filled = filled_.back();
    filled_.pop_back();
    if (filled) line();
    text_ += bracket;
    return *this;
}

JsonText& JsonText::key(std::string_view name)
{
    value(name);
    text_ += indented_ ? ": " : ":";
    after_key_ = true;
    return *this;
}

JsonText& JsonText::value(double number)
{
    separate();
    if (number == 0 && std::signbit(number))
        text_ += "-0.0"; // "-0" reads as the whole number 0
    else if (std::isfinite(number))
        text_ += fmt::format("{}", number);
    else
        text_ += "null";
    return *this;
}

JsonText& JsonText::value(std::int64_t number)
{
    separate();
    text_ += fmt::format("{}", number);
    return *this;
}

JsonText& JsonText::value(std::uint64_t number)
{
    separate();
    text_ += fmt::format("{}", number);
    return *this;
}

JsonText& JsonText::value(bool truth)
{
    separate();
    text_ += truth ? "true" : "false";
    return *this;
}

JsonText& JsonText::value(std::string_view text)
{
    separate();
    text_ += '"';
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (static_cast<unsigned char>(c) >= 0x80) { // names of files may be any bytes, JSON not
            const std::size_t n = utf8_character(text.substr(i));
            text_ += n > 0 ? text.substr(i, n) : std::string_view("\ufffd");
            i += n > 0 ? n - 1 : 0;
        } else if (c == '"' || c == '\\') {
            text_ += '\\';
            text_ += c;
        } else if (c == '\n') {
            text_ += "\\n";
        } else if (static_cast<unsigned char>(c) < 0x20) {
            text_ += fmt::format("\\u{:04x}", static_cast<unsigned char>(c));
        } else {
            text_ += c;
        }
    }
    text_ += '"';
    return *this;
}

JsonText& JsonText::json(std::string_view text)
{
    separate();
    for (const char c : text) {
        text_ += c;
        if (c == '\n') text_.append(indented_ ? 2 * filled_.size() : 0, ' ');
    }
    return *this;
}

void write_issues(JsonText& json, std::string_view name, const std::vector<Issue>& issues)
{
    json.key(name).open('[');
    for (const Issue& i : issues) {
        json.open('{').member("file", i.file).member("place", i.place);
        json.member("found", i.found).member("allowed", i.allowed).close('}');
    }
    json.close(']');
}

} // namespace amontons
