#include "validation/folder_case.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"
#include "mesh/base/limits.hpp"
#include "mesh/format/columns.hpp"
#include "solver/scene/json_input.hpp"
#include "validation/study/record.hpp"
#include "validation/study/table.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <map>
#include <nlohmann/json.hpp>

namespace fs = std::filesystem;

namespace amontons::validation {
namespace {

/// Reads the fields of one object, and in the end reports unknown ones.
class Fields {
public:
    Fields(const Json& json, std::string file, std::string place, std::vector<Issue>& issues)
        : json_(json)
        , file_(std::move(file))
        , place_(std::move(place))
        , issues_(issues)
    {
        if (!json_.is_object()) issue("", shown(json_), "an object {...}");
    }

    bool has(const char* name) const { return json_.is_object() && json_.contains(name); }
    bool is_text(const char* name) const { return has(name) && json_.at(name).is_string(); }

    const Json* get(const char* name, bool required, const char* allowed)
    {
        known_.emplace_back(name);
        if (has(name)) return &json_.at(name);
        if (required && json_.is_object()) issue(name, "nothing", allowed);
        return nullptr;
    }
    std::string text(const char* name, bool required = false)
    {
        const Json* v = get(name, required, "a text");
        if (!v) return "";
        if (!v->is_string() || (required && v->get<std::string>().empty())) {
            issue(name, shown(*v), "a text");
            return "";
        }
        return v->get<std::string>();
    }
    std::string one_of(const char* name, const std::vector<std::string>& allowed,
                       const std::string& fallback)
    {
        const bool required = fallback.empty();
        std::string list;
        for (const std::string& a : allowed)
            list += (list.empty() ? "one of " : ", ") + quoted_text(a);
        const Json* v = get(name, required, list.c_str());
        if (!v) return fallback;
        if (v->is_string() &&
            std::find(allowed.begin(), allowed.end(), v->get<std::string>()) != allowed.end())
            return v->get<std::string>();
        issue(name, shown(*v), list);
        return fallback;
    }
    double number(const char* name, bool required, double fallback, double least)
    {
        const std::string allowed =
            std::isfinite(least) ? fmt::format("a number >= {:g}", least) : "a number";
        const Json* v = get(name, required, allowed.c_str());
        if (!v) return fallback;
        if (v->is_number() && std::isfinite(v->get<double>()) && !(v->get<double>() < least))
            return v->get<double>();
        issue(name, shown(*v), allowed);
        return fallback;
    }
    std::vector<std::string> texts(const char* name)
    {
        std::vector<std::string> out;
        const Json* v = get(name, false, "");
        if (!v) return out;
        if (!v->is_array() ||
            !std::all_of(v->begin(), v->end(), [](const Json& t) { return t.is_string(); })) {
            issue(name, shown(*v), "a list of texts");
            return out;
        }
        for (const Json& t : *v)
            out.push_back(t.get<std::string>());
        return out;
    }
    void issue(const std::string& name, std::string found, std::string allowed)
    {
        const std::string place = place_ + (name.empty() || place_.empty() ? "" : ".") + name;
        issues_.push_back({file_, place, std::move(found), std::move(allowed)});
    }
    void done()
    {
        if (!json_.is_object()) return;
        for (const auto& item : json_.items()) {
            if (std::find(known_.begin(), known_.end(), item.key()) != known_.end()) continue;
            const std::string near = nearest_name(item.key(), known_);
            std::string all;
            for (const std::string& k : known_)
                all += (all.empty() ? "one of " : ", ") + k;
            issue("", "field " + quoted_text(item.key()),
                  near.empty() ? all : quoted_text(near) + " (nearest name)");
        }
    }

private:
    const Json& json_;
    std::string file_, place_;
    std::vector<Issue>& issues_;
    std::vector<std::string> known_;
};

CaseMeasure read_measure(const Json& json, const std::string& file, const std::string& place,
                         const std::vector<CaseScene>& scenes,
                         const std::function<bool(const std::string&)>& exists,
                         std::vector<Issue>& issues)
{
    CaseMeasure m;
    Fields f(json, file, place, issues);
    const bool left_out = f.has("left_out"), no_scene = left_out || f.has("problem");
    m.scene = f.text("scene", scenes.size() > 1 && !no_scene);
    if (!scenes.empty() &&
        std::none_of(scenes.begin(), scenes.end(),
                     [&](const CaseScene& s) { return s.name == m.scene; }) &&
        !(scenes.size() > 1 && m.scene.empty()) && !(no_scene && m.scene.empty())) {
        std::string names;
        for (const CaseScene& s : scenes)
            names += (names.empty() ? "one of " : ", ") + quoted_text(s.name);
        f.issue("scene", quoted_text(m.scene), names);
    }
    // ---- Kind of the measure
    m.what = f.text("what");
    m.note = f.text("note");
    const bool order = f.has("order");
    const int kinds = (f.has("quantity") || order) + f.has("curve") + f.has("refused") +
                      f.has("problem") + left_out;
    if (kinds != 1 && json.is_object())
        f.issue("", fmt::format("{} of quantity, curve, refused, problem and left_out", kinds),
                "one of them");
    // ---- Fields of each kind
    if (order) {
        m.kind = CaseMeasure::Kind::order;
        m.quantity = f.text("quantity", true);
        const Json* const of = f.get("order", true, "an object {\"path\", \"values\"}");
        Fields g(*of, file, place + ".order", issues);
        m.path = g.text("path", true);
        const Json* const values = g.get("values", true, "a list of three values or more");
        if (values && (!values->is_array() || values->size() < 3))
            g.issue("values", shown(*values), "a list of three values or more");
        else if (values)
            for (const Json& v : *values)
                m.values.push_back(v.is_string() ? v.get<std::string>() : v.dump());
        g.done();
        m.finest = f.is_text("reference");
        if (m.finest)
            f.one_of("reference", {"finest"}, "");
        else
            m.reference = f.number("reference", true, 0, -HUGE_VAL);
        m.at_least = f.number("at_least", true, 0, 0);
        if (m.what.empty()) m.what = "order of " + m.quantity + " over " + m.path;
    } else if (f.has("quantity") && f.is_text("reference")) {
        m.kind = CaseMeasure::Kind::text;
        m.quantity = f.text("quantity", true);
        m.expected = f.text("reference");
        if (m.what.empty()) m.what = m.quantity;
    } else if (f.has("quantity")) {
        m.quantity = f.text("quantity", true);
        m.reference = f.number("reference", true, 0, -HUGE_VAL);
        m.scale = f.number("scale", false, 1, -HUGE_VAL);
        m.absolute = f.one_of("error", {"relative", "absolute"},
                              m.reference == 0 ? "absolute" : "relative") == "absolute";
        if (!m.absolute && m.reference == 0) f.issue("error", "\"relative\" to 0", "\"absolute\"");
        m.tolerance = f.number("tolerance", true, 0, 0);
        if (m.what.empty()) m.what = m.quantity;
    } else if (f.has("curve")) {
        m.kind = CaseMeasure::Kind::curve;
        m.file = f.text("curve", true);
        if (!m.file.empty() && !exists(m.file))
            f.issue("curve", quoted_text(m.file), "a file beside case.json");
        m.x = f.text("x", true);
        m.y = f.text("y", true);
        m.scale = f.number("scale", false, 1, -HUGE_VAL);
        m.tolerance = f.number("tolerance", true, 0, 0);
        if (m.what.empty()) m.what = m.y + " over " + m.x;
    } else if (f.has("refused")) {
        m.kind = CaseMeasure::Kind::refusal;
        m.expected = f.text("refused", true);
        if (m.what.empty()) m.what = "refused: " + m.expected;
    } else if (f.has("problem")) {
        m.kind = CaseMeasure::Kind::problem;
        m.file = f.text("problem", true);
        if (!m.file.empty() && !exists(m.file))
            f.issue("problem", quoted_text(m.file), "a file beside case.json");
        m.expected = f.one_of("status", {"converged", "infeasible"}, "converged");
        m.tolerance = f.number("tolerance", true, 0, 0);
        if (m.what.empty()) m.what = fs::path(m.file).stem().string();
    } else if (left_out) {
        m.kind = CaseMeasure::Kind::left_out;
        m.expected = f.text("left_out", true);
        if (m.what.empty()) f.issue("what", "nothing", "what is left out, in words");
    }
    f.done();
    return m;
}

/// The first lines of a text that are no heading, up to an empty one.
std::string first_paragraph(const std::string& text)
{
    std::string out;
    for (std::size_t start = 0; start < text.size();) {
        const std::size_t end = std::min(text.find('\n', start), text.size());
        const std::string line = text.substr(start, end - start);
        start = end + 1;
        const bool blank = line.find_first_not_of(" \t\r") == std::string::npos;
        if (blank && !out.empty()) break;
        if (!blank && line[0] != '#') out += (out.empty() ? "" : " ") + line;
    }
    return out;
}

/// The result of `amontons solve` for a problem: its error, or whether it is infeasible as it must
/// be.
Measured solved(const CaseMeasure& m, const std::string& what, const SceneAnswer& answer)
{
    if (answer.json.empty()) {
        Measured row = at_most(what, kNaN, m.tolerance);
        row.note = answer.last_words;
        return row;
    }
    std::vector<Issue> issues;
    const Json json = parse_json(answer.json, "the solver's answer", issues);
    if (!issues.empty()) throw InputError(issues);
    const std::string status = json.value("status", "");
    const bool right =
        status == m.expected || (m.expected == "converged" && status == "at_round_off");
    Measured row = at_most(what + ": " + m.expected, right ? 0 : 1, 0);
    if (m.expected == "converged")
        row = at_most(what + ": error", right ? json.value("error", kNaN) : kNaN, m.tolerance);
    row.note = fmt::format("{} contacts, {}", json.value("contacts", 0), status);
    return row;
}

/// Largest distance of two curves, of the largest |y| of the reference.
Measured compare(const CaseMeasure& m, const FolderCase& c, const SceneAnswer& answer)
{
    const std::string file = (fs::path(c.folder) / m.file).string();
    const Columns reference = parse_columns(read_file(file), file);
    const std::string history = answer.folder + "/history.csv";
    const Columns run = parse_columns(read_file(history), "history.csv");
    std::vector<Issue> issues;
    for (const auto& [table, name] :
         {std::pair{&reference, file}, {&run, std::string("history.csv")}})
        for (const std::string& column : {m.x, m.y})
            if (!table->find(column)) {
                std::string names;
                for (const std::string& n : table->names)
                    names += (names.empty() ? "" : ", ") + n;
                issues.push_back({name, "", "no column " + quoted_text(column), names});
            }
    if (!issues.empty()) throw InputError(issues);
    Measured row = at_most(m.what + ", of its largest", 0, m.tolerance);
    row.curve.x_label = m.x;
    row.curve.y_label = m.y;
    row.curve.x = *reference.find(m.x);
    row.curve.reference = *reference.find(m.y);
    double size = 0, worst = 0;
    for (const double y : row.curve.reference)
        size = std::max(size, std::abs(y));
    for (std::size_t i = 0; i < row.curve.x.size(); ++i) {
        const double here = m.scale * value_at(*run.find(m.x), *run.find(m.y), row.curve.x[i]);
        row.curve.value.push_back(here);
        const double miss = std::abs(here - row.curve.reference[i]) / size;
        if (!(miss <= worst)) worst = miss; // NaN stays
        if (std::isnan(miss)) break;
    }
    row.curve.value.resize(row.curve.x.size(), kNaN);
    row.value = row.error = worst;
    return row;
}

/// The order at which a quantity's error falls over runs of a scene.
Measured order_of(const CaseMeasure& m, const std::string& what, const FolderCase& c,
                  const std::string& file, const std::vector<std::string>& set, const RunScene& run)
{
    study::Table table;
    study::Sweep sweep;
    sweep.text = sweep.paths.emplace_back(m.path);
    sweep.values = m.values;
    table.sweeps = {sweep};
    table.quantity = m.quantity;
    table.kind = m.finest ? study::ReferenceKind::finest : study::ReferenceKind::value;
    table.reference = m.reference;
    Measured row{what, m.at_least, kNaN, kNaN, 0, "", {}, ""};
    for (const std::string& value : m.values) {
        std::vector<std::string> all = set;
        all.push_back(m.path + "=" + value);
        const SceneAnswer answer = run(file, all);
        const std::string here = m.path + " = " + value;
        if (answer.exit_code != 0) {
            row.note = here + ": " + answer.last_words;
            return row;
        }
        study::PointRecord record;
        record.status = "done";
        record.numbers = study::numbers_of(answer.json, "the run's answer");
        record.texts = study::texts_of(answer.json, "the run's answer");
        if (!study::find(record.numbers, m.quantity))
            throw InputError({{c.folder + "/case.json", "measure", quoted_text(m.quantity),
                               study::allowed_names(record.numbers, record.texts, m.quantity)}});
        study::Point point;
        point.index = int(table.rows.size());
        point.values = {value};
        table.rows.push_back(study::make_row(point, record, m.quantity));
        if (table.rows.back().status != "done") {
            row.note = here + ": " + table.rows.back().status;
            return row;
        }
    }
    study::evaluate(table);
    row.value = table.order;
    row.error = std::isnan(row.value) ? kNaN : std::max(0.0, m.at_least - row.value);
    std::string errors;
    for (const study::Row& r : table.rows)
        if (!r.is_reference) errors += fmt::format("{}{:.2e}", errors.empty() ? "" : ", ", r.error);
    row.note =
        std::isnan(row.value) ? "no order: errors do not fall, " + errors : "errors " + errors;
    return row;
}

} // namespace

FolderCase parse_folder_case(std::string_view text, const std::string& file,
                             const std::function<bool(const std::string&)>& exists)
{
    std::vector<Issue> issues;
    const Json json = parse_json(text, file, issues);
    FolderCase c;
    Fields f(json, file, "", issues);
    c.suite = f.one_of("suite", {"benchmarks", "stability"}, "");
    c.source = f.text("source", true);
    c.verified = f.text("verified", true);
    c.data = f.text("data");
    const auto scene = [&](const Json& v, const std::string& name, const std::string& place) {
        CaseScene s{name, "", {}};
        if (v.is_string()) {
            s.file = v.get<std::string>();
        } else {
            Fields g(v, file, place, issues);
            s.file = g.text("file", true);
            s.set = g.texts("set");
            g.done();
        }
        if (!s.file.empty() && !exists(s.file))
            issues.push_back({file, place, quoted_text(s.file), "a scene beside case.json"});
        c.scenes.push_back(std::move(s));
    };
    const Json* const list = f.get("measure", true, "a list [...] of measures");
    const bool runs =
        !list || !list->is_array() || std::any_of(list->begin(), list->end(), [](const Json& m) {
            return !m.contains("problem") && !m.contains("left_out");
        });
    if (const Json* one = f.get("scene", runs && !f.has("scenes"), "a scene beside case.json"))
        scene(*one, "", "scene");
    // What lies in the folder of data is searched for when the case runs.
    const auto is_there = [&](const std::string& name) { return !c.data.empty() || exists(name); };
    if (const Json* all = f.get("scenes", false, "")) {
        if (f.has("scene")) f.issue("scenes", "scene and scenes", "one of them");
        if (!all->is_object() || all->empty())
            f.issue("scenes", shown(*all), "an object {name: scene, ...}");
        else
            for (const auto& item : all->items())
                scene(item.value(), item.key(), "scenes." + item.key());
    }
    if (list) {
        if (!list->is_array() || list->empty())
            f.issue("measure", shown(*list), "a list [...] of measures");
        else
            for (std::size_t i = 0; i < list->size(); ++i)
                c.measures.push_back(read_measure((*list)[i], file, fmt::format("measure.{}", i),
                                                  c.scenes, is_there, issues));
    }
    f.done();
    if (!exists("README.md"))
        issues.push_back({file, "", "no README.md beside it", "a paragraph on what the case is"});
    if (!issues.empty()) throw InputError(issues);
    return c;
}

std::string about_case(const std::string& folder)
{
    const fs::path file = fs::path(folder) / "README.md";
    std::error_code error;
    return fs::is_regular_file(file, error) ? first_paragraph(read_file(file.string())) : "";
}

FolderCase read_folder_case(const std::string& folder)
{
    const fs::path path = fs::weakly_canonical(folder);
    const std::string file = (fs::path(folder) / "case.json").string();
    FolderCase c = parse_folder_case(read_file(file), file, [&](const std::string& name) {
        std::error_code error;
        return fs::is_regular_file(path / name, error);
    });
    c.folder = path.string();
    c.name = path.filename().string();
    c.about = about_case(c.folder);
    return c;
}

std::vector<std::string> case_folders(const std::string& folder)
{
    std::vector<std::string> list;
    std::error_code error;
    for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
        std::error_code ignored;
        if (fs::is_regular_file(at->path() / "case.json", ignored))
            list.push_back(at->path().string());
    }
    std::sort(list.begin(), list.end());
    return list;
}

std::vector<Measured> measure(const FolderCase& c, const RunScene& run, const SolveProblem& solve,
                              const std::string& data)
{
    std::map<std::string, SceneAnswer> answers;
    std::map<std::string, std::pair<std::string, std::vector<std::string>>> scene_runs;
    for (const CaseScene& s : c.scenes) {
        std::vector<std::string> set = s.set;
        for (std::string& text : set)
            if (const std::size_t at = text.find("{data}"); at != std::string::npos)
                text.replace(at, 6, data);
        const std::string file = (fs::path(c.folder) / s.file).string();
        scene_runs[s.name] = {file, set};
        // What only orders examine runs with their values.
        if (std::ranges::all_of(c.measures, [&](const CaseMeasure& m) {
                return m.scene != s.name || m.kind == CaseMeasure::Kind::order;
            }))
            continue;
        answers[s.name] = run(file, set);
    }
    // ---- A row for each measure
    std::vector<Measured> rows;
    for (std::size_t i = 0; i < c.measures.size(); ++i) {
        const CaseMeasure& m = c.measures[i];
        const std::string what = m.scene.empty() ? m.what : m.what + ", " + m.scene;
        if (m.kind == CaseMeasure::Kind::left_out) {
            rows.push_back(left_out(what, m.expected));
            continue;
        }
        if (m.kind == CaseMeasure::Kind::problem) {
            const fs::path folder = data.empty() ? c.folder : data;
            rows.push_back(solved(m, what, solve((folder / m.file).string(), m.tolerance)));
            continue;
        }
        if (m.kind == CaseMeasure::Kind::order) {
            const auto& [file, set] = scene_runs.at(m.scene);
            rows.push_back(order_of(m, what, c, file, set, run));
            if (!m.note.empty())
                rows.back().note =
                    m.note + (rows.back().note.empty() ? "" : "; ") + rows.back().note;
            continue;
        }
        const SceneAnswer& answer = answers.at(m.scene);
        if (m.kind == CaseMeasure::Kind::refusal) {
            const bool refused = answer.exit_code == 2 || answer.exit_code == 3
                                     ? answer.last_words.find(m.expected) != std::string::npos
                                     : false;
            rows.push_back(at_most(what, refused ? 0 : 1, 0));
            rows.back().note = answer.exit_code == 0 ? "the run was done" : answer.last_words;
            continue;
        }
        if (answer.exit_code != 0) {
            rows.push_back({what, m.reference, kNaN, kNaN, m.tolerance, answer.last_words, {}, ""});
            continue;
        }
        const study::Numbers numbers = study::numbers_of(answer.json, "the run's answer");
        const study::Texts texts = study::texts_of(answer.json, "the run's answer");
        const double without = study::find(numbers, "certificate.uncertified_steps").value_or(0);
        std::string found_else;
        if (m.kind == CaseMeasure::Kind::curve) {
            rows.push_back(compare(m, c, answer));
            rows.back().quantity = what + ", of its largest";
        } else if (m.kind == CaseMeasure::Kind::text) {
            const std::optional<std::string> found = study::find(texts, m.quantity);
            if (!found)
                throw InputError(
                    {{c.folder + "/case.json", fmt::format("measure.{}.quantity", i),
                      quoted_text(m.quantity), study::allowed_names(numbers, texts, m.quantity)}});
            rows.push_back(at_most(fmt::format("{} is {}", what, quoted_text(m.expected)),
                                   *found == m.expected ? 0 : 1, 0));
            if (*found != m.expected) found_else = "it is " + quoted_text(*found);
        } else {
            const std::optional<double> found = study::find(numbers, m.quantity);
            if (!found)
                throw InputError(
                    {{c.folder + "/case.json", fmt::format("measure.{}.quantity", i),
                      quoted_text(m.quantity), study::allowed_names(numbers, texts, m.quantity)}});
            const double value = m.scale * *found;
            rows.push_back(m.absolute ? absolute(what, m.reference, value, m.tolerance)
                                      : relative(what, m.reference, value, m.tolerance));
        }
        rows.back().note = m.note + (m.note.empty() || found_else.empty() ? "" : "; ") + found_else;
        if (without > 0) {
            rows.back().note += fmt::format("{}{:g} steps without certificate",
                                            m.note.empty() ? "" : "; ", without);
            rows.back().error = kNaN; // an answer that is not certified is none
        }
    }
    return rows;
}

} // namespace amontons::validation
