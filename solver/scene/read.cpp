#include "solver/scene/read.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"
#include "solver/scene/consistency.hpp"
#include "solver/scene/fields.hpp"
#include "solver/scene/json_text.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <set>

namespace amontons {
namespace {

using Json = nlohmann::ordered_json;

/// A value from the file, short enough for a message.
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

/// Fills a Scene from JSON and collects what is wrong on the way.
class Reader {
public:
    Reader(Scene& scene, std::vector<Issue>& issues) : scene_(scene), issues_(issues) {}

    void object(const Json& json, const ObjectDeclaration& declaration, void* target,
                const std::string& place);

private:
    void field(const Json& json, const FieldDeclaration& f, void* member, const std::string& place);
    void bodies(const Json& json, const ObjectDeclaration& body, const std::string& place);
    void fields(const Json& json, const ObjectDeclaration& declaration,
                const VariantDeclaration* variant, void* target, const std::string& place);
    const VariantDeclaration* variant_of(const Json& json, const ObjectDeclaration& declaration,
                                         const std::string& place);
    bool number(const Json& json, const FieldDeclaration& f, const std::string& place, double& out);
    bool vector(const Json& json, const FieldDeclaration& f, const std::string& place, Vec3& out);
    void curve(const Json& json, const FieldDeclaration& f, const std::string& place,
               CurvePoints& out);
    void wrong(const std::string& place, std::string found, std::string allowed)
    {
        issues_.push_back({scene_.file, place, std::move(found), std::move(allowed)});
    }

    Scene& scene_;
    std::vector<Issue>& issues_;
};

bool Reader::number(const Json& json, const FieldDeclaration& f, const std::string& place,
                    double& out)
{
    const Allowed& a = f.allowed;
    if (!json.is_number()) {
        wrong(place, shown(json), allowed_in_words(f));
        return false;
    }
    const double v = json.get<double>();
    const bool inside = std::isfinite(v) && (a.above ? v > a.lower : v >= a.lower) && v <= a.upper;
    if (!inside) {
        wrong(place, shown(json), allowed_in_words(f));
        return false;
    }
    out = v;
    return true;
}

bool Reader::vector(const Json& json, const FieldDeclaration& f, const std::string& place,
                    Vec3& out)
{
    Vec3 v = Vec3::Zero();
    bool good = json.is_array() && json.size() == 3;
    for (std::size_t i = 0; good && i < 3; ++i) {
        good = json[i].is_number() && std::isfinite(json[i].get<double>());
        if (good) v[static_cast<Eigen::Index>(i)] = json[i].get<double>();
    }
    if (good && f.allowed.nonzero) {
        const double n = v.norm();
        good = n > 0 && std::isfinite(n) && std::isfinite(1 / n);
    }
    if (!good) {
        wrong(place, shown(json), allowed_in_words(f));
        return false;
    }
    out = v;
    return true;
}

void Reader::curve(const Json& json, const FieldDeclaration& f, const std::string& place,
                   CurvePoints& out)
{
    if (!json.is_array() || json.empty()) return wrong(place, shown(json), allowed_in_words(f));
    CurvePoints points;
    for (std::size_t i = 0; i < json.size(); ++i) {
        const Json& p = json[i];
        const std::string here = fmt::format("{}/{}", place, i);
        if (!p.is_array() || p.size() != 2 || !p[0].is_number() || !p[1].is_number()) {
            wrong(here, shown(p), "[time, value]");
            continue;
        }
        const double t = p[0].get<double>();
        if (!points.empty() && !(t > points.back()[0]))
            wrong(here, fmt::format("time {}", t),
                  fmt::format("> {} [s], the time before it", points.back()[0]));
        double v = 0;
        FieldDeclaration value = f;
        value.type = FieldType::number;
        number(p[1], value, here, v);
        points.push_back({t, v});
    }
    out = std::move(points);
}

void Reader::field(const Json& json, const FieldDeclaration& f, void* member,
                   const std::string& place)
{
    const auto refuse = [&] { wrong(place, shown(json), allowed_in_words(f)); };
    switch (f.type) {
    case FieldType::boolean:
        if (!json.is_boolean()) return refuse();
        *static_cast<bool*>(member) = json.get<bool>();
        return;
    case FieldType::integer: {
        double v = 0;
        if (!json.is_number()) return refuse();
        v = json.get<double>();
        if (!(v == std::floor(v)) || !(v >= f.allowed.lower) || !(v <= f.allowed.upper) ||
            std::abs(v) > std::numeric_limits<int>::max())
            return refuse();
        *static_cast<int*>(member) = static_cast<int>(v);
        return;
    }
    case FieldType::number: {
        double v = 0;
        if (!number(json, f, place, v)) return;
        if (f.optional)
            *static_cast<std::optional<double>*>(member) = v;
        else
            *static_cast<double*>(member) = v;
        return;
    }
    case FieldType::pair: {
        auto& pair = *static_cast<std::array<double, 2>*>(member);
        if (!json.is_array()) {
            double v = 0;
            if (number(json, f, place, v)) pair = {v, v};
            return;
        }
        if (json.size() != 2) return refuse();
        number(json[0], f, place + "/0", pair[0]);
        number(json[1], f, place + "/1", pair[1]);
        return;
    }
    case FieldType::text: {
        if (!json.is_string()) return refuse();
        const std::string& text = json.get_ref<const std::string&>();
        if (!f.choices.empty() &&
            std::find(f.choices.begin(), f.choices.end(), text) == f.choices.end()) {
            const std::string near = nearest_name(text, f.choices);
            return wrong(place, shown(json),
                         allowed_in_words(f) +
                             (near.empty() ? "" : " (nearest: " + quoted_text(near) + ")"));
        }
        if (f.required && text.empty()) return wrong(place, "\"\"", "a text that is not empty");
        *static_cast<std::string*>(member) = text;
        return;
    }
    case FieldType::two_names: {
        if (!json.is_array() || json.size() != 2 || !json[0].is_string() || !json[1].is_string())
            return refuse();
        *static_cast<std::array<std::string, 2>*>(member) = {json[0].get<std::string>(),
                                                             json[1].get<std::string>()};
        return;
    }
    case FieldType::vector: {
        Vec3 v = Vec3::Zero();
        if (!vector(json, f, place, v)) return;
        if (f.optional)
            *static_cast<std::optional<Vec3>*>(member) = v;
        else
            *static_cast<Vec3*>(member) = v;
        return;
    }
    case FieldType::curve:
        return curve(json, f, place, *static_cast<CurvePoints*>(member));
    case FieldType::object:
        return object(json, *f.object, member, place);
    case FieldType::list:
        if (!json.is_array()) return refuse();
        if (f.required && json.empty()) return wrong(place, "an empty list", "at least one");
        for (std::size_t i = 0; i < json.size(); ++i)
            object(json[i], *f.object, f.append(member), fmt::format("{}/{}", place, i));
        return;
    case FieldType::named:
        return bodies(json, *f.object, place);
    }
}

void Reader::fields(const Json& json, const ObjectDeclaration& declaration,
                    const VariantDeclaration* variant, void* target, const std::string& place)
{
    std::vector<const FieldDeclaration*> known;
    std::vector<std::string> names;
    for (const FieldDeclaration& f : declaration.fields)
        known.push_back(&f);
    if (variant)
        for (const FieldDeclaration& f : variant->fields)
            known.push_back(&f);
    for (const FieldDeclaration* f : known)
        names.push_back(f->name);
    if (!declaration.discriminator.empty()) names.push_back(declaration.discriminator);

    for (const auto& item : json.items()) {
        const std::string& name = item.key();
        const Json& value = item.value();
        if (name == declaration.discriminator || name == "$schema") continue;
        const auto f = std::find_if(known.begin(), known.end(),
                                    [&](const FieldDeclaration* k) { return k->name == name; });
        if (f != known.end()) {
            field(value, **f, (*f)->member(target), place + "/" + name);
            continue;
        }
        const std::string near = nearest_name(name, names);
        std::string allowed;
        if (!near.empty())
            allowed = quoted_text(near) + " (nearest name)";
        else
            for (const std::string& n : names)
                allowed += (allowed.empty() ? "one of " : ", ") + quoted_text(n);
        wrong(place, "field " + quoted_text(name), allowed);
    }
    for (const FieldDeclaration* f : known)
        if (f->required && !json.contains(f->name))
            wrong(place + "/" + f->name, "nothing", allowed_in_words(*f));

    if (declaration.complete)
        declaration.complete(target, [&](const char* name) { return json.contains(name); });
}

const VariantDeclaration* Reader::variant_of(const Json& json, const ObjectDeclaration& declaration,
                                             const std::string& place)
{
    const auto given = json.find(declaration.discriminator);
    std::vector<std::string> values;
    std::string list;
    for (const VariantDeclaration& v : declaration.variants) {
        if (v.value.empty()) {
            if (given == json.end()) return &v;
            continue;
        }
        values.push_back(v.value);
        list += (list.empty() ? "one of " : ", ") + quoted_text(v.value);
        if (given != json.end() && given->is_string() && *given == v.value) return &v;
    }
    const std::string here = place + "/" + declaration.discriminator;
    if (given == json.end()) {
        wrong(here, "nothing", list);
    } else {
        const std::string near =
            given->is_string() ? nearest_name(given->get<std::string>(), values) : "";
        wrong(here, shown(*given),
              list + (near.empty() ? "" : " (nearest: " + quoted_text(near) + ")"));
    }
    return nullptr;
}

void Reader::object(const Json& json, const ObjectDeclaration& declaration, void* target,
                    const std::string& place)
{
    if (!json.is_object()) return wrong(place, shown(json), "an object {...}");
    const VariantDeclaration* variant = nullptr;
    if (!declaration.discriminator.empty()) {
        variant = variant_of(json, declaration, place);
        if (!variant) return;
        if (declaration.chosen) declaration.chosen(target) = variant->value;
    }
    fields(json, declaration, variant, target, place);
}

void Reader::bodies(const Json& json, const ObjectDeclaration& body, const std::string& place)
{
    if (!json.is_object() || json.empty())
        return wrong(place, json.is_object() ? "no body" : shown(json), "at least one named body");
    for (const auto& [name, value] : json.items()) {
        const std::string here = place + "/" + name;
        const bool plain = !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
            return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-';
        });
        if (!plain) { // names become parts of paths and of files
            wrong(here, "body " + quoted_text(name), "a name of letters, digits, _ and -");
            continue;
        }
        if (name == "contacts") { // the contact points are written under this name
            wrong(here, "body \"contacts\"", "another name");
            continue;
        }
        if (!value.is_object()) {
            wrong(here, shown(value), "an object {...}");
            continue;
        }
        const VariantDeclaration* variant = variant_of(value, body, here);
        if (!variant) {
            scene_.order.push_back(name); // known by name, so that its pairs are no second error
            continue;
        }
        fields(value, body, variant, variant->append(scene_, name), here);
    }
}

// --- The text and the overrides ---

std::string line_and_column(std::string_view text, std::size_t byte)
{
    const std::string_view before = text.substr(0, std::min(byte, text.size()));
    const auto line = std::count(before.begin(), before.end(), '\n') + 1;
    const std::size_t start = before.rfind('\n') + 1; // npos + 1 is 0
    return fmt::format("line {}, column {}", line, before.size() - start + 1);
}

/// Parses the text. Fields that stand twice are Issues: which of them counts is nowhere said.
Json parse(std::string_view text, const std::string& file, std::vector<Issue>& issues)
{
    const auto blank = [](char c) { return c == ' ' || c == '\n' || c == '\t' || c == '\r'; };
    if (std::all_of(text.begin(), text.end(), blank))
        throw InputError(
            {{file, "", "an empty file", "a scene: {\"schema\": 1, \"bodies\": ...}"}});
    std::vector<std::set<std::string>> open;
    std::vector<std::string> at;
    const auto watch = [&](int, Json::parse_event_t event, Json& parsed) {
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
        const std::size_t byte = error.byte > 0 ? error.byte - 1 : 0;
        throw InputError(
            {{file, line_and_column(text, byte), what, "JSON (// comments are allowed)"}});
    } catch (const nlohmann::json::out_of_range& error) {
        // A number like 1e999: the message quotes it, and says nothing of its place.
        const std::string what = error.what();
        const std::size_t first = what.find('\''), last = what.rfind('\'');
        const std::string number = last > first ? what.substr(first + 1, last - first - 1) : "";
        throw InputError({{file, line_and_column(text, text.find(number)), "number " + number,
                           "a number that a double holds"}});
    }
}

/// Lets one override replace its value. Objects on the way are made, items of lists are not.
void apply_override(Json& scene, const std::string& text, std::vector<std::string>& places,
                    std::vector<Issue>& issues)
{
    const std::size_t equals = text.find('=');
    const std::string path = text.substr(0, equals);
    const auto refuse = [&](std::string found, std::string allowed) {
        issues.push_back({"--set " + text, "", std::move(found), std::move(allowed)});
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
            // A body that is not there is a slip of the keyboard, not the wish for another body.
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
    Json parsed = Json::parse(value, nullptr, false);
    *at = parsed.is_discarded() ? Json(value) : std::move(parsed);
    places.push_back(place);
}

// --- The way back ---

void write_object(JsonText& out, const std::vector<const FieldDeclaration*>& fields, void* object,
                  Scene& scene);

void write_number(JsonText& out, double v)
{
    if (v == std::floor(v) && std::abs(v) < 1e15)
        out.value(static_cast<std::int64_t>(v));
    else
        out.value(v);
}

void write_vector(JsonText& out, const Vec3& v)
{
    out.open('[').value(v.x()).value(v.y()).value(v.z()).close(']');
}

std::vector<const FieldDeclaration*> all_fields(const ObjectDeclaration& declaration,
                                                const VariantDeclaration* variant)
{
    std::vector<const FieldDeclaration*> all;
    for (const FieldDeclaration& f : declaration.fields)
        all.push_back(&f);
    if (variant)
        for (const FieldDeclaration& f : variant->fields)
            all.push_back(&f);
    return all;
}

const VariantDeclaration* chosen_variant(const ObjectDeclaration& declaration, void* object)
{
    for (const VariantDeclaration& v : declaration.variants)
        if (declaration.chosen && v.value == declaration.chosen(object)) return &v;
    return nullptr;
}

/// False where the value says "not given" (an empty option, text or list, or the default of a
/// field whose default is chosen later): the reader comes to the same without it.
bool is_given(const FieldDeclaration& f, void* member)
{
    switch (f.type) {
    case FieldType::number:
        if (f.optional) return static_cast<std::optional<double>*>(member)->has_value();
        return f.fallback.empty() || *static_cast<double*>(member) != 0;
    case FieldType::vector:
        return !f.optional || static_cast<std::optional<Vec3>*>(member)->has_value();
    case FieldType::text:
        return !static_cast<std::string*>(member)->empty();
    case FieldType::curve:
        return !static_cast<CurvePoints*>(member)->empty();
    case FieldType::list:
        return f.size(member) > 0;
    case FieldType::object: // one whose required text is missing was never given
        for (const FieldDeclaration& inner : f.object->fields)
            if (inner.required && inner.type == FieldType::text &&
                !is_given(inner, inner.member(member)))
                return false;
        return true;
    default:
        return true;
    }
}

void write_value(JsonText& out, const FieldDeclaration& f, void* member, Scene& scene)
{
    switch (f.type) {
    case FieldType::boolean:
        out.value(*static_cast<bool*>(member));
        return;
    case FieldType::integer:
        out.value(*static_cast<int*>(member));
        return;
    case FieldType::number:
        write_number(out, f.optional ? **static_cast<std::optional<double>*>(member)
                                     : *static_cast<double*>(member));
        return;
    case FieldType::pair: {
        const auto& p = *static_cast<std::array<double, 2>*>(member);
        out.open('[').value(p[0]).value(p[1]).close(']');
        return;
    }
    case FieldType::text:
        out.value(*static_cast<std::string*>(member));
        return;
    case FieldType::two_names: {
        const auto& names = *static_cast<std::array<std::string, 2>*>(member);
        out.open('[').value(names[0]).value(names[1]).close(']');
        return;
    }
    case FieldType::vector:
        write_vector(out, f.optional ? **static_cast<std::optional<Vec3>*>(member)
                                     : *static_cast<Vec3*>(member));
        return;
    case FieldType::curve:
        out.open('[');
        for (const auto& p : *static_cast<CurvePoints*>(member))
            out.open('[').value(p[0]).value(p[1]).close(']');
        out.close(']');
        return;
    case FieldType::object: {
        const VariantDeclaration* variant = chosen_variant(*f.object, member);
        out.open('{');
        if (variant && !variant->value.empty()) out.member(f.object->discriminator, variant->value);
        write_object(out, all_fields(*f.object, variant), member, scene);
        out.close('}');
        return;
    }
    case FieldType::list:
        out.open('[');
        for (std::size_t i = 0; i < f.size(member); ++i) {
            out.open('{');
            write_object(out, all_fields(*f.object, nullptr), f.item(member, i), scene);
            out.close('}');
        }
        out.close(']');
        return;
    case FieldType::named:
        out.open('{');
        for (const std::string& name : scene.order)
            for (const VariantDeclaration& v : f.object->variants)
                if (void* body = v.find(scene, name)) {
                    out.key(name).open('{').member(f.object->discriminator, v.value);
                    write_object(out, all_fields(*f.object, &v), body, scene);
                    out.close('}');
                }
        out.close('}');
        return;
    }
}

void write_object(JsonText& out, const std::vector<const FieldDeclaration*>& fields, void* object,
                  Scene& scene)
{
    for (const FieldDeclaration* f : fields) {
        void* member = f->member(object);
        if (!f->required && !is_given(*f, member)) continue;
        out.key(f->name);
        write_value(out, *f, member, scene);
    }
}

} // namespace

Scene parse_scene(std::string_view text, const std::string& file,
                  const std::vector<std::string>& overrides)
{
    std::vector<Issue> issues;
    Json json = parse(text, file, issues);
    Scene scene;
    scene.file = file;
    if (!json.is_object())
        throw InputError({{file, "", shown(json), "a scene: {\"schema\": 1, \"bodies\": ...}"}});

    std::vector<std::string> overridden;
    for (const std::string& o : overrides)
        apply_override(json, o, overridden, issues);
    Reader(scene, issues).object(json, scene_declaration(), &scene, "");
    check_consistency(scene, issues);
    for (Issue& issue : issues)
        for (const std::string& place : overridden)
            if (issue.place == place ||
                (!issue.place.empty() && place.rfind(issue.place + "/", 0) == 0 &&
                 issue.found == "field " + quoted_text(place.substr(issue.place.size() + 1))))
                issue.place += " (--set)";
    if (!issues.empty()) throw InputError(std::move(issues));
    return scene;
}

Scene read_scene(const std::string& file, const std::vector<std::string>& overrides)
{
    return parse_scene(read_file(file), file, overrides);
}

std::string resolved_scene(const Scene& scene)
{
    Scene copy = scene; // the declarations find members of a scene that may change
    JsonText out;
    out.open('{');
    write_object(out, all_fields(scene_declaration(), nullptr), &copy, copy);
    out.close('}');
    return out.text();
}

std::string beside(const Scene& scene, const std::string& file)
{
    return (std::filesystem::path(scene.file).parent_path() / file).string();
}

} // namespace amontons
