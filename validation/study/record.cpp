#include "validation/study/record.hpp"

#include "mesh/base/error.hpp"
#include "solver/scene/json_input.hpp"
#include "solver/scene/json_text.hpp"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

namespace amontons::study {
namespace {

constexpr int kDeepest = 16;
constexpr std::size_t kMostNames = 40; // in a message

Json object(std::string_view text, const std::string& file)
{
    std::vector<Issue> issues;
    Json json = parse_json(text, file, issues);
    if (!json.is_object()) issues.push_back({file, "", shown(json), "an object {...}"});
    if (!issues.empty()) throw InputError(issues);
    return json;
}

void collect(const Json& json, const std::string& path, int depth, Numbers& out)
{
    if (json.is_number()) out.emplace_back(path, json.get<double>());
    if (json.is_null()) // what is not finite is written as null
        out.emplace_back(path, std::numeric_limits<double>::quiet_NaN());
    if (!json.is_object() || depth > kDeepest) return;
    for (const auto& item : json.items())
        collect(item.value(), path.empty() ? item.key() : path + "." + item.key(), depth + 1, out);
}

void collect(const Json& json, const std::string& path, int depth, Texts& out)
{
    if (json.is_string()) out.emplace_back(path, json.get<std::string>());
    if (!json.is_object() || depth > kDeepest) return;
    for (const auto& item : json.items())
        collect(item.value(), path.empty() ? item.key() : path + "." + item.key(), depth + 1, out);
}

template <class Value>
std::optional<Value> find_in(const std::vector<std::pair<std::string, Value>>& values,
                             const std::string& name)
{
    for (const std::string& path : {name, "quantities." + name})
        for (const auto& [at, value] : values)
            if (at == path) return value;
    return std::nullopt;
}

/// A member that must be there, of one type.
class Members {
public:
    Members(const Json& json, std::string file) : json_(json), file_(std::move(file)) {}

    std::string text(const char* name)
    {
        const Json* v = member(name);
        if (v && v->is_string()) return v->get<std::string>();
        refuse(name, v, "a text");
        return "";
    }
    double number(const char* name)
    {
        const Json* v = member(name);
        if (v && v->is_number()) return v->get<double>();
        refuse(name, v, "a number");
        return 0;
    }
    std::vector<std::string> texts(const char* name)
    {
        const Json* v = member(name);
        std::vector<std::string> out;
        if (v && v->is_array() &&
            std::all_of(v->begin(), v->end(), [](const Json& t) { return t.is_string(); }))
            for (const Json& t : *v)
                out.push_back(t.get<std::string>());
        else
            refuse(name, v, "a list of texts");
        return out;
    }
    const Json* member(const char* name) const
    {
        const auto at = json_.find(name);
        return at == json_.end() ? nullptr : &*at;
    }
    void refuse(const char* name, const Json* v, const char* allowed)
    {
        issues_.push_back({file_, name, v ? shown(*v) : "nothing", allowed});
    }
    void done() const
    {
        if (!issues_.empty()) throw InputError(issues_);
    }

private:
    const Json& json_;
    std::string file_;
    std::vector<Issue> issues_;
};

void write_texts(JsonText& out, const char* name, const std::vector<std::string>& texts)
{
    out.key(name).open('[');
    for (const std::string& t : texts)
        out.value(t);
    out.close(']');
}

} // namespace

Numbers numbers_of(std::string_view json, const std::string& file)
{
    Numbers out;
    collect(object(json, file), "", 0, out);
    return out;
}

std::optional<double> find(const Numbers& numbers, const std::string& name)
{
    return find_in(numbers, name);
}

Texts texts_of(std::string_view json, const std::string& file)
{
    Texts out;
    collect(object(json, file), "", 0, out);
    return out;
}

std::optional<std::string> find(const Texts& texts, const std::string& name)
{
    return find_in(texts, name);
}

std::string allowed_names(const Numbers& numbers, const Texts& texts, const std::string& name)
{
    const std::string prefix = "quantities.";
    std::vector<std::string> names;
    const auto add = [&](const auto& values, bool own) {
        for (const auto& [path, value] : values)
            if ((path.rfind(prefix, 0) == 0) == own)
                names.push_back(own ? path.substr(prefix.size()) : path);
    };
    for (const bool own : {true, false}) { // the scene's own first
        add(numbers, own);
        add(texts, own);
    }
    std::string text = nearest_name(name, names);
    if (!text.empty()) text = quoted_text(text) + " (nearest name); ";
    text += "one of ";
    for (std::size_t i = 0; i < std::min(names.size(), kMostNames); ++i)
        text += (i ? ", " : "") + names[i];
    return text + (names.size() > kMostNames ? ", ..." : "");
}

std::string record_text(const PointRecord& r)
{
    JsonText out;
    out.open('{').member("hash", r.hash).member("program", r.program);
    write_texts(out, "overrides", r.overrides);
    out.member("status", r.status).member("reason", r.reason);
    out.member("seconds", r.seconds).member("cpu_seconds", r.cpu_seconds);
    out.key("numbers").open('{');
    for (const auto& [path, value] : r.numbers)
        out.member(path, value);
    out.close('}').key("texts").open('{');
    for (const auto& [path, value] : r.texts)
        out.member(path, value);
    return out.close('}').close('}').text() + "\n";
}

PointRecord read_record(std::string_view text, const std::string& file)
{
    const Json json = object(text, file);
    Members m(json, file);
    PointRecord r;
    r.hash = m.text("hash");
    r.program = m.text("program");
    r.overrides = m.texts("overrides");
    r.status = m.text("status");
    r.reason = m.text("reason");
    r.seconds = m.number("seconds");
    r.cpu_seconds = m.number("cpu_seconds");
    const Json* numbers = m.member("numbers");
    if (!numbers || !numbers->is_object())
        m.refuse("numbers", numbers, "an object {...}");
    else
        for (const auto& item : numbers->items()) {
            if (!item.value().is_number() && !item.value().is_null())
                m.refuse("numbers", &item.value(), "numbers");
            else
                r.numbers.emplace_back(item.key(), item.value().is_null()
                                                       ? std::numeric_limits<double>::quiet_NaN()
                                                       : item.value().get<double>());
        }
    const Json* texts = m.member("texts");
    if (!texts) r.hash.clear(); // of a program that kept none: the point is run again
    if (texts && !texts->is_object()) m.refuse("texts", texts, "an object {...}");
    if (texts && texts->is_object())
        for (const auto& item : texts->items()) {
            if (item.value().is_string())
                r.texts.emplace_back(item.key(), item.value().get<std::string>());
            else
                m.refuse("texts", &item.value(), "texts");
        }
    m.done();
    return r;
}

std::string definition_text(const Definition& d)
{
    JsonText out;
    out.open('{').member("scene", d.scene).member("hash", d.hash);
    write_texts(out, "set", d.set);
    write_texts(out, "sweeps", d.sweeps);
    out.member("quantity", d.quantity).member("reference", d.reference);
    return out.member("shard", d.shard).close('}').text() + "\n";
}

Definition read_definition(std::string_view text, const std::string& file)
{
    const Json json = object(text, file);
    Members m(json, file);
    Definition d;
    d.scene = m.text("scene");
    d.hash = m.text("hash");
    d.set = m.texts("set");
    d.sweeps = m.texts("sweeps");
    d.quantity = m.text("quantity");
    d.reference = m.text("reference");
    d.shard = m.text("shard");
    m.done();
    return d;
}

} // namespace amontons::study
