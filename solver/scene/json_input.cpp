#include "solver/scene/json_input.hpp"

#include "mesh/base/text.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <set>

namespace amontons {
namespace {

/// No field lies deeper, and what copies or prints values recurses.
constexpr int kDeepestJson = 64;

} // namespace

std::string shown(const Json& value)
{
    if (value.is_object()) return value.empty() ? "{}" : "an object {...}";
    if (value.is_array()) {
        const bool plain =
            value.size() <= 4 && std::none_of(value.begin(), value.end(), [](const Json& v) {
                return v.is_structured() || v.is_string();
            });
        return plain ? value.dump() : fmt::format("a list of {}", value.size());
    }
    if (value.is_string()) return quoted_text(value.get_ref<const std::string&>());
    return value.dump();
}

Json parse_json(std::string_view text, const std::string& file, std::vector<Issue>& issues)
{
    const auto blank = [](char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; };
    if (std::all_of(text.begin(), text.end(), blank))
        throw InputError(
            {{file, "", "an empty file", "a scene: {\"schema\": 1, \"bodies\": ...}"}});
    std::vector<std::set<std::string>> open;
    std::vector<std::string> at;
    const auto watch = [&](int depth, Json::parse_event_t event, Json& parsed) {
        if (depth > kDeepestJson)
            throw InputError(
                {{file, "", fmt::format("values nested more than {} deep", kDeepestJson),
                  fmt::format("at most {}", kDeepestJson)}});
        if (event == Json::parse_event_t::object_start) open.emplace_back();
        if (event == Json::parse_event_t::object_end) open.pop_back();
        if (event == Json::parse_event_t::key) {
            const std::string name = parsed.get<std::string>();
            if (!open.back().insert(name).second)
                issues.push_back({file, "", "field " + quoted_text(name) + " twice in one object",
                                  "each field once"});
        }
        return true;
    };
    try {
        return Json::parse(text.begin(), text.end(), watch, true, true);
    } catch (const nlohmann::json::parse_error& error) {
        std::string what = error.what();
        if (const std::size_t colon = what.find(": "); colon != std::string::npos)
            what = what.substr(colon + 2);
        throw InputError(
            {{file, line_and_column(text, error.byte), what, "JSON (// comments are allowed)"}});
    } catch (const nlohmann::json::out_of_range& error) {
        // A number like 1e999: the message quotes it, but not its place.
        const std::string what = error.what();
        const std::size_t first = what.find('\''), last = what.rfind('\'');
        const std::string number = last > first ? what.substr(first + 1, last - first - 1) : "";
        throw InputError({{file, line_and_column(text, text.find(number) + 1), "number " + number,
                           "a number that a double holds"}});
    }
}

void apply_override(Json& scene, const std::string& text, std::vector<std::string>& places,
                    std::vector<Issue>& issues)
{
    const std::size_t equals = text.find('=');
    const std::string path = text.substr(0, equals);
    const auto refuse = [&](std::string found, std::string allowed) {
        constexpr std::size_t kLongest = 120;
        issues.push_back(
            {"--set " + (text.size() > kLongest ? text.substr(0, kLongest) + "..." : text), "",
             std::move(found), std::move(allowed)});
    };
    if (equals == std::string::npos || path.empty())
        return refuse("no PATH=VALUE", "e.g. contact.0.friction=0.1");
    const std::string value = text.substr(equals + 1);

    const char separator = path.find('/') != std::string::npos ? '/' : '.';
    std::vector<std::string> names;
    for (std::size_t start = path[0] == separator ? 1 : 0; start <= path.size();) {
        const std::size_t end = std::min(path.find(separator, start), path.size());
        names.push_back(path.substr(start, end - start));
        start = end + 1;
    }
    constexpr std::size_t kDeepest = 32;
    if (names.size() > kDeepest) return refuse("a path this deep", "the path of a field");

    Json* at = &scene;
    std::string place;
    for (std::size_t i = 0; i < names.size(); ++i) {
        const std::string& name = names[i];
        if (at->is_array()) {
            const bool digits =
                !name.empty() && name.size() < 9 &&
                std::all_of(name.begin(), name.end(), [](char c) { return c >= '0' && c <= '9'; });
            const std::size_t index = digits ? std::stoul(name) : at->size();
            if (index >= at->size())
                return refuse(quoted_text(name) + " in " + place,
                              at->empty() ? "nothing, the list is empty"
                                          : fmt::format("0 to {}", at->size() - 1));
            at = &(*at)[index];
        } else if (at->is_object() || at->is_null()) {
            // A body that is not there is a typing error, not a request for another body.
            if (i == 1 && names[0] == "bodies" && names.size() > 2 && !at->contains(name)) {
                std::vector<std::string> bodies;
                for (const auto& item : at->items())
                    bodies.push_back(item.key());
                const std::string near = nearest_name(name, bodies);
                std::string allowed = near.empty() ? "" : quoted_text(near) + " (nearest name)";
                if (near.empty())
                    for (const std::string& b : bodies)
                        allowed += (allowed.empty() ? "one of " : ", ") + quoted_text(b);
                return refuse("body " + quoted_text(name),
                              allowed.empty() ? "a body of the scene, which has none" : allowed);
            }
            at = &(*at)[name];
        } else {
            return refuse(place + " = " + shown(*at) + ", which has no " + quoted_text(name),
                          "the path of a field");
        }
        place += "/" + name;
    }
    bool deep = false;
    const auto shallow = [&](int depth, Json::parse_event_t, Json&) {
        deep |= depth > kDeepestJson;
        return !deep;
    };
    Json parsed = Json::parse(value, shallow, false);
    if (deep)
        return refuse(fmt::format("values nested more than {} deep", kDeepestJson),
                      fmt::format("at most {}", kDeepestJson));
    *at = parsed.is_discarded() ? Json(value) : std::move(parsed);
    places.push_back(place);
}

} // namespace amontons
