// What came of the scenes, as JSON and as tables.

#include "solver/scene/json_text.hpp"
#include "validation/random/known.hpp"
#include "validation/random/suite.hpp"

#include <fmt/format.h>

namespace amontons::validation {
namespace {

struct KindCounts {
    std::string kind;
    int drawn = 0, done = 0, refused = 0, known = 0, wrong = 0;
    double seconds = 0;
};

/// A row for each kind that was drawn, and their sum.
std::vector<KindCounts> counts_of(const std::vector<SceneResult>& results)
{
    std::vector<KindCounts> rows;
    KindCounts all{"all"};
    const auto add = [](KindCounts& row, const SceneResult& r) {
        ++row.drawn;
        row.done += r.outcome == "done";
        row.refused += r.outcome == "refused";
        row.known += r.outcome == "known";
        row.wrong += r.outcome == "wrong";
        row.seconds += r.cpu_seconds;
    };
    for (const SceneSuite& suite : scene_suites())
        for (const SceneKind& kind : suite.kinds) {
            KindCounts row{kind.name};
            for (const SceneResult& r : results)
                if (r.kind == kind.name) {
                    add(row, r);
                    add(all, r);
                }
            if (row.drawn > 0) rows.push_back(row);
        }
    rows.push_back(all);
    return rows;
}

} // namespace

std::string json_of(const SceneResult& r)
{
    JsonText j(false);
    j.open('{')
        .member("case", r.kind)
        .member("suite", r.suite)
        .member("passed", r.outcome != "wrong");
    j.member("scene", r.number).member("drawn", r.drawn);
    j.member("outcome", r.outcome).member("reason", r.reason).member("folder", r.folder);
    j.member("runs", r.runs).member("seconds", r.seconds).member("cpu_seconds", r.cpu_seconds);
    j.key("findings").open('[');
    for (const Finding& f : r.findings)
        j.open('{').member("law", f.law).member("text", f.text).close('}');
    return j.close(']').close('}').text();
}

SceneResult read_scene_result(const std::string& text)
{
    const Json j = Json::parse(text);
    SceneResult r;
    r.suite = j.at("suite");
    r.number = j.at("scene");
    r.kind = j.at("case");
    r.drawn = j.at("drawn");
    r.outcome = j.at("outcome");
    r.reason = j.at("reason");
    r.folder = j.at("folder");
    r.runs = j.at("runs");
    r.seconds = j.at("seconds");
    r.cpu_seconds = j.at("cpu_seconds");
    for (const Json& f : j.at("findings"))
        r.findings.push_back({f.at("law"), f.at("text")});
    return r;
}

std::string table_text(const std::vector<SceneResult>& results)
{
    std::string text = fmt::format("{:<26}{:>7}{:>7}{:>9}{:>7}{:>7}{:>10}\n", "kind", "drawn",
                                   "done", "refused", "known", "wrong", "cpu [s]");
    for (const KindCounts& r : counts_of(results))
        text += fmt::format("{:<26}{:>7}{:>7}{:>9}{:>7}{:>7}{:>10.1f}\n", r.kind, r.drawn, r.done,
                            r.refused, r.known, r.wrong, r.seconds);
    return text;
}

std::string table_markdown(const std::vector<SceneResult>& results)
{
    std::string text =
        "| kind | drawn | done | refused | known | wrong |\n|---|---|---|---|---|---|\n";
    for (const KindCounts& r : counts_of(results))
        text += fmt::format("| `{}` | {} | {} | {} | {} | {} |\n", r.kind, r.drawn, r.done,
                            r.refused, r.known, r.wrong);
    return text;
}

std::string table_csv(const std::vector<SceneResult>& results)
{
    std::string text = "kind,drawn,done,refused,known,wrong,cpu_seconds [s]\n";
    for (const KindCounts& r : counts_of(results))
        text += fmt::format("{},{},{},{},{},{},{:.3f}\n", r.kind, r.drawn, r.done, r.refused,
                            r.known, r.wrong, r.seconds);
    return text;
}

std::string findings_text(const SceneResult& r, std::uint64_t seed)
{
    if (r.outcome == "done") return "";
    std::string text = fmt::format("{}: scene {} ({}: {})\n", r.outcome, r.number, r.kind, r.drawn);
    for (const Finding& f : r.findings)
        text += fmt::format("    {}: {}\n", f.law, f.text);
    if (!r.reason.empty()) text += "    known: " + r.reason + "\n";
    if (!r.folder.empty()) text += "    files: " + r.folder + "\n";
    text += fmt::format("    again: amontons validate --suite {} --seed {} --scene {}\n", r.suite,
                        seed, r.number);
    return text;
}

} // namespace amontons::validation
