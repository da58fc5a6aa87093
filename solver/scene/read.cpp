#include "solver/scene/read.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"
#include "mesh/base/utf8.hpp"
#include "solver/scene/consistency.hpp"
#include "solver/scene/fields.hpp"
#include "solver/scene/instruments.hpp"
#include "solver/scene/json_input.hpp"
#include "solver/scene/limits.hpp"
#include "solver/scene/tapers.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace amontons {
namespace {

bool inside(double v, const Allowed& a)
{
    return std::isfinite(v) && (a.above ? v > a.lower : v >= a.lower) && v <= a.upper &&
           (v == 0 || v >= a.least || a.least == 0);
}

/// Of texts that become parts of messages, columns and paths.
bool is_name(const std::string& text, std::size_t longest)
{
    return text.size() <= longest && is_printable(text);
}

/// Of names that become parts of paths and of files.
bool is_plain(const std::string& name)
{
    constexpr std::size_t kLongest = 100; // with what files add, file systems take it
    return !name.empty() && name.size() <= kLongest &&
           std::all_of(name.begin(), name.end(), [](char c) {
               return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-';
           });
}
constexpr const char* kPlainName = "a name of letters, digits, _ and -, of at most 100";

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
    if (!json.is_number()) {
        wrong(place, shown(json), allowed_in_words(f));
        return false;
    }
    const double v = json.get<double>();
    if (!inside(v, f.allowed)) {
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
        good = json[i].is_number() && inside(json[i].get<double>(), f.allowed);
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
    const bool over_time = f.over == "time";
    if (json.is_number() && over_time) { // the same at all times
        FieldDeclaration value = f;
        value.type = FieldType::number;
        double v = 0;
        if (number(json, value, place, v)) out = {{0, v}};
        return;
    }
    if (!json.is_array() || json.empty()) return wrong(place, shown(json), allowed_in_words(f));
    if (f.places) {
        CurvePoints corners;
        for (std::size_t i = 0; i < json.size(); ++i) {
            const Json& p = json[i];
            if (!p.is_array() || p.size() != 2 || !p[0].is_number() || !p[1].is_number() ||
                !inside(p[0].get<double>(), f.allowed) || !inside(p[1].get<double>(), f.allowed))
                wrong(fmt::format("{}/{}", place, i), shown(p), "[x, y] [m]");
            else
                corners.push_back({p[0].get<double>(), p[1].get<double>()});
        }
        out = std::move(corners);
        return;
    }
    CurvePoints points;
    for (std::size_t i = 0; i < json.size(); ++i) {
        const Json& p = json[i];
        const std::string here = fmt::format("{}/{}", place, i);
        if (!p.is_array() || p.size() != 2 || !p[0].is_number() || !p[1].is_number()) {
            wrong(here, shown(p), fmt::format("[{}, value]", f.over));
            continue;
        }
        const double t = p[0].get<double>();
        const UnitLimits times = limits_of(f.over_unit);
        const std::string unit = f.over_unit.empty() ? "" : " [" + f.over_unit + "]";
        if (!(std::abs(t) <= times.most))
            wrong(here, fmt::format("{} {}", f.over, t),
                  fmt::format("a {} >= {} and <= {}{}", f.over, -times.most, times.most, unit));
        else if (!points.empty() && t > points.back()[0] && t - points.back()[0] < times.least)
            wrong(here, fmt::format("{} {}", f.over, t),
                  fmt::format(">= {}{} after the {} before it", times.least, unit, f.over));
        else if (!points.empty() && !(t > points.back()[0]))
            wrong(here, fmt::format("{} {}", f.over, t),
                  fmt::format("> {}{}, the {} before it", points.back()[0], unit, f.over));
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
        if (!is_name(text, f.longest)) return refuse();
        *static_cast<std::string*>(member) = text;
        return;
    }
    case FieldType::two_names: {
        if (!json.is_array() || json.size() != 2 || !json[0].is_string() || !json[1].is_string())
            return refuse();
        for (const Json& name : json)
            if (!is_name(name.get_ref<const std::string&>(), f.longest)) return refuse();
        *static_cast<std::array<std::string, 2>*>(member) = {json[0].get<std::string>(),
                                                             json[1].get<std::string>()};
        return;
    }
    case FieldType::vector: {
        Vec3 v = Vec3::Zero();
        if (f.uniform && json.is_number()) {
            double all = 0;
            if (!number(json, f, place, all)) return;
            *static_cast<Vec3*>(member) = Vec3::Constant(all);
            return;
        }
        if (!vector(json, f, place, v)) return;
        if (f.optional)
            *static_cast<std::optional<Vec3>*>(member) = v;
        else
            *static_cast<Vec3*>(member) = v;
        return;
    }
    case FieldType::matrix: {
        if (!json.is_array() || json.size() != 3) return refuse();
        Mat3 m;
        for (std::size_t i = 0; i < 3; ++i) {
            Vec3 row;
            if (!vector(json[i], f, fmt::format("{}/{}", place, i), row)) return;
            m.row(Eigen::Index(i)) = row.transpose();
        }
        *static_cast<std::optional<Mat3>*>(member) = m;
        return;
    }
    case FieldType::curve:
        return curve(json, f, place, *static_cast<CurvePoints*>(member));
    case FieldType::object:
        return object(json, *f.object, member, place);
    case FieldType::list:
        if (!json.is_array()) return refuse();
        if (json.size() < f.least)
            return wrong(place,
                         json.empty() ? "an empty list" : fmt::format("{} of them", json.size()),
                         f.least == 1 ? "at least one" : fmt::format("at least {}", f.least));
        for (std::size_t i = 0; i < json.size(); ++i)
            object(json[i], *f.object, f.append(member), fmt::format("{}/{}", place, i));
        return;
    case FieldType::numbers: {
        if (!json.is_array() || json.empty()) return refuse();
        std::vector<int> all;
        for (const Json& item : json) {
            const double v = item.is_number() ? item.get<double>() : 0.5;
            if (v != std::floor(v) || !inside(v, f.allowed)) return refuse();
            all.push_back(static_cast<int>(v));
        }
        *static_cast<std::vector<int>*>(member) = std::move(all);
        return;
    }
    case FieldType::by_name:
        if (!json.is_object() || json.empty())
            return wrong(place, json.is_object() ? "{}" : shown(json), allowed_in_words(f));
        for (const auto& [name, value] : json.items()) {
            const std::string here = place + "/" + name;
            if (!is_plain(name)) {
                wrong(here, quoted_text(name), kPlainName);
                continue;
            }
            void* const item = f.append(member);
            f.name_of(item) = name;
            object(value, *f.object, item, here);
        }
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
        if ((name == declaration.discriminator && !name.empty()) || name == "$schema") continue;
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
        if (f->required && !json.contains(f->name) &&
            std::none_of(f->unless.begin(), f->unless.end(),
                         [&](const std::string& other) { return json.contains(other); }))
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

/// An object with the names of its first fields, and what may stand for it.
std::string object_in_words(const ObjectDeclaration& declaration)
{
    constexpr std::size_t kMostNames = 8;
    std::vector<std::string> names;
    if (!declaration.discriminator.empty()) names.push_back(declaration.discriminator);
    for (const FieldDeclaration& f : declaration.fields)
        names.push_back(f.name);
    for (const VariantDeclaration& v : declaration.variants)
        for (const FieldDeclaration& f : v.fields)
            if (std::ranges::find(names, f.name) == names.end()) names.push_back(f.name);
    std::string text = "an object {";
    for (std::size_t i = 0; i < std::min(names.size(), kMostNames); ++i)
        text += (i > 0 ? ", " : "") + quoted_text(names[i]) + ": ...";
    text += names.size() > kMostNames ? ", ...}" : "}";
    return declaration.shorthand.empty() ? text
                                         : text + ", or a text: its " + declaration.shorthand;
}

void Reader::object(const Json& json, const ObjectDeclaration& declaration, void* target,
                    const std::string& place)
{
    if (json.is_string() && !declaration.shorthand.empty())
        return object(Json{{declaration.shorthand, json}}, declaration, target, place);
    if (!json.is_object()) return wrong(place, shown(json), object_in_words(declaration));
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
        if (!is_plain(name)) {
            wrong(here, "body " + quoted_text(name), kPlainName);
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

/// Every text of a JSON document.
void collect_texts(const std::string& json, std::vector<std::string>& texts)
{
    for (std::size_t i = 0; i < json.size(); ++i) {
        if (json[i] != '"') continue;
        std::string text;
        for (++i; i < json.size() && json[i] != '"'; ++i) {
            if (json[i] == '\\' && i + 1 < json.size()) ++i;
            text += json[i];
        }
        texts.push_back(text);
    }
}

} // namespace

Scene parse_scene(std::string_view text, const std::string& file,
                  const std::vector<std::string>& overrides)
{
    std::vector<Issue> issues;
    Json json = parse_json(text, file, issues);
    Scene scene;
    scene.file = file;
    if (!json.is_object())
        throw InputError({{file, "", shown(json), "a scene: {\"schema\": 1, \"bodies\": ...}"}});

    std::vector<std::string> overridden;
    for (const std::string& o : overrides)
        apply_override(json, o, overridden, issues);
    Reader(scene, issues).object(json, scene_declaration(), &scene, "");
    {
        Findings findings(file, issues);
        make_segments(scene, findings);
    }
    check_consistency(scene, issues);
    for (Issue& issue : issues)
        for (const std::string& place : overridden)
            if (issue.place == place ||
                (!issue.place.empty() && place.rfind(issue.place + "/", 0) == 0 &&
                 issue.found == "field " + quoted_text(place.substr(issue.place.size() + 1))))
                issue.place += " (--set)";
    if (!issues.empty()) throw InputError(std::move(issues));
    for (BeamInput& b : scene.beams)
        b.segments = without_tapers(b.segments);
    for (RodInput& r : scene.rods)
        r.segments = without_tapers(r.segments);
    return scene;
}

Scene read_scene(const std::string& file, const std::vector<std::string>& overrides)
{
    return parse_scene(read_file(file), file, overrides);
}

std::vector<NamedFile> named_files(const Scene& scene)
{
    std::vector<std::string> texts;
    std::vector<NamedFile> files;
    collect_texts(resolved_scene(scene), texts);
    for (const std::string& t : texts) {
        const std::string path = beside(scene, t);
        std::error_code error;
        if (!t.empty() && std::filesystem::is_regular_file(path, error) &&
            std::none_of(files.begin(), files.end(),
                         [&](const NamedFile& f) { return f.name == t; }))
            files.push_back({t, path});
    }
    return files;
}

std::string beside(const Scene& scene, const std::string& file)
{
    return (std::filesystem::path(scene.file).parent_path() / file).string();
}

} // namespace amontons
