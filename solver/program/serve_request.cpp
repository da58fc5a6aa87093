#include "solver/program/serve_request.hpp"

#include "mesh/base/base64.hpp"
#include "solver/scene/json_input.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <span>

namespace amontons {
namespace {

using What = ServeRequest::What;

struct Command {
    const char* name;
    What what;
    std::vector<std::string> fields; ///< beside id and do; those that end in '?' may be missing
};

const std::vector<Command>& commands()
{
    static const std::vector<Command> all{
        {"step", What::step, {"count?"}},
        {"advance", What::advance, {"until"}},
        {"set", What::set, {"path", "value"}},
        {"save", What::save, {}},
        {"restore", What::restore, {"state"}},
        {"reset", What::reset, {}},
        {"state", What::state, {}},
        {"inputs", What::inputs, {}},
        {"scene", What::scene, {}},
        {"check", What::check, {}},
        {"contacts", What::contacts, {}},
        {"view", What::view, {"whole?"}},
        {"quit", What::quit, {}},
        {"run", What::run, {"speed?"}}, // from here on: kEngineCommands
        {"pause", What::pause, {}},
        {"frame", What::frame, {"after?", "whole?"}},
        {"sets", What::sets, {}},
    };
    return all;
}
constexpr std::size_t kEngineCommands = 4;

/// "one of a, b, c", or the nearest of them.
std::string one_of(const std::string& found, const std::vector<std::string>& names)
{
    const std::string near = nearest_name(found, names);
    if (!near.empty()) return quoted_text(near) + " (nearest name)";
    std::string all;
    for (const std::string& name : names)
        all += (all.empty() ? "one of " : ", ") + name;
    return all;
}

void read_field(ServeRequest& r, const std::string& name, const Json& value)
{
    const auto refuse = [&](std::string allowed) {
        r.issues.push_back({"", name, shown(value), std::move(allowed)});
    };
    if (name == "count") {
        constexpr int kMost = 1'000'000'000;
        if (!value.is_number_integer() || value < 1 || value > kMost)
            refuse(fmt::format("a whole number from 1 to {}", kMost));
        else
            r.count = value.get<int>();
    } else if (name == "until") {
        if (!value.is_number())
            refuse("a finite time [s]");
        else
            r.until = value.get<double>();
    } else if (name == "path") {
        // '=' ends a path where the program's arguments have it.
        if (!value.is_string() || value.get_ref<const std::string&>().empty() ||
            value.get_ref<const std::string&>().find('=') != std::string::npos)
            refuse("the name of an input, or the path of a field such as \"contact.0.friction\"");
        else
            r.path = value.get<std::string>();
    } else if (name == "value") {
        r.value = value.dump();
    } else if (name == "state") {
        const auto bytes =
            value.is_string() ? from_base64(value.get_ref<const std::string&>()) : std::nullopt;
        if (!bytes)
            refuse("the text that save gave");
        else
            r.state = *bytes;
    } else if (name == "speed") {
        constexpr double kSlowest = 1e-9, kFastest = 1e9;
        if (!value.is_number() || value < kSlowest || value > kFastest)
            refuse("simulated seconds a second, from 1e-9 to 1e9");
        else
            r.speed = value.get<double>();
    } else if (name == "after") {
        if (!value.is_number_unsigned())
            refuse("the sequence of a frame");
        else
            r.after = value.get<std::uint64_t>();
    } else if (name == "whole") {
        if (!value.is_boolean())
            refuse("true or false");
        else
            r.whole = value.get<bool>();
    }
}

void read_object(ServeRequest& r, const Json& line, bool engine)
{
    if (const auto id = line.find("id"); id == line.end())
        r.issues.push_back({"", "id", "nothing", "a whole number or a text"});
    else if (id->is_number_integer() || id->is_string())
        r.id = id->dump();
    else
        r.issues.push_back({"", "id", shown(*id), "a whole number or a text"});

    std::vector<std::string> names;
    const std::span known_commands =
        std::span(commands()).first(commands().size() - (engine ? 0 : kEngineCommands));
    for (const Command& c : known_commands)
        names.emplace_back(c.name);
    const auto verb = line.find("do");
    if (verb == line.end() || !verb->is_string()) {
        r.issues.push_back(
            {"", "do", verb == line.end() ? "nothing" : shown(*verb), one_of("", names)});
        return;
    }
    const std::string& name = verb->get_ref<const std::string&>();
    const auto command = std::ranges::find(known_commands, name, &Command::name);
    if (command == known_commands.end()) {
        r.issues.push_back({"", "do", quoted_text(name), one_of(name, names)});
        return;
    }
    r.what = command->what;
    std::vector<std::string> known{"id", "do"};
    for (std::string field : command->fields) {
        const bool optional = field.back() == '?';
        if (optional) field.pop_back();
        known.push_back(field);
        if (const auto value = line.find(field); value != line.end())
            read_field(r, field, *value);
        else if (!optional)
            r.issues.push_back({"", field, "nothing", "what " + name + " needs"});
    }
    for (const auto& item : line.items())
        if (std::ranges::find(known, item.key()) == known.end())
            r.issues.push_back(
                {"", "", "field " + quoted_text(item.key()), one_of(item.key(), known)});
}

} // namespace

ServeRequest read_request(std::string_view line, bool engine)
{
    ServeRequest r;
    if (line.find_first_not_of(" \t\r") == std::string_view::npos) {
        r.issues = {{"", "", "an empty line", "{\"id\": 1, \"do\": \"step\"}"}};
        return r;
    }
    try {
        const Json parsed = parse_json(line, "", r.issues);
        if (!parsed.is_object())
            r.issues.push_back(
                {"", "", shown(parsed), "an object such as {\"id\": 1, \"do\": \"step\"}"});
        else
            read_object(r, parsed, engine);
    } catch (const InputError& error) {
        r.issues = error.issues();
    }
    return r;
}

} // namespace amontons
