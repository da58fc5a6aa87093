#pragma once

#include "mesh/base/error.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace amontons {

/// Writes JSON from first to last: keys in the order they are given, doubles in the shortest
/// form that reads back the same, what is not finite as null.
///
///     JsonText j;
///     j.open('{').key("steps").value(3).key("seconds").open('{').close('}').close('}');
///     print(j.text());
class JsonText {
public:
    /// @param indented  one value a line, for readers; else all in one line
    explicit JsonText(bool indented = true) : indented_(indented) {}

    JsonText& open(char bracket); ///< '{' or '['
    /// Ends an object or a list.
    JsonText& close(char bracket);
    /// Starts a member.
    JsonText& key(std::string_view name);
    /// A value: number, text or truth.
    JsonText& value(double number);
    JsonText& value(int number) { return value(static_cast<std::int64_t>(number)); }
    JsonText& value(std::int64_t number);
    JsonText& value(std::uint64_t number);
    JsonText& value(bool truth);
    JsonText& value(std::string_view text);
    JsonText& value(const char* text) { return value(std::string_view(text)); }
    /// A JSON text made elsewhere.
    JsonText& json(std::string_view text);
    /// `name`: value
    template <class T> JsonText& member(std::string_view name, const T& v)
    {
        return key(name).value(v);
    }
    const std::string& text() const { return text_; }

private:
    void separate();
    void line();

    std::string text_;
    std::vector<bool> filled_; ///< of each open bracket: something stands in it already
    bool after_key_ = false;
    bool indented_ = true;
};

/// `name`: a list of issues, each with file, place, found, allowed.
void write_issues(JsonText& json, std::string_view name, const std::vector<Issue>& issues);

} // namespace amontons
