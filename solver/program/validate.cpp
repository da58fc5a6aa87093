// amontons validate [CASE ...]: the published cases, reference beside result.

#include "mesh/base/file.hpp"
#include "solver/program/session.hpp"
#include "solver/scene/json_text.hpp"
#include "validation/measure.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {
namespace {

using validation::Case;
using validation::CaseResult;
using validation::Measured;

struct ValidateArguments {
    std::vector<std::string> cases;
    std::string suite, report;
    bool list = false;
};

/// The cases that are asked for, in their own order.
std::vector<const Case*> chosen(const ValidateArguments& arguments)
{
    std::vector<Issue> issues;
    for (const std::string& name : arguments.cases)
        if (std::none_of(validation::cases().begin(), validation::cases().end(),
                         [&](const Case& c) { return c.name == name; })) {
            std::string names;
            for (const Case& c : validation::cases())
                names += (names.empty() ? "" : ", ") + std::string(c.name);
            issues.push_back({"validate", "CASE", name, names});
        }
    if (!issues.empty()) throw InputError(issues);
    std::vector<const Case*> list;
    for (const Case& c : validation::cases()) {
        const bool named = arguments.cases.empty() ||
                           std::find(arguments.cases.begin(), arguments.cases.end(), c.name) !=
                               arguments.cases.end();
        if (named && (arguments.suite.empty() || arguments.suite == c.suite)) list.push_back(&c);
    }
    return list;
}

void add_rows(JsonText& out, const CaseResult& r)
{
    const auto head = [&] {
        out.open('{').member("case", r.which->name).member("suite", r.which->suite);
        out.member("source", r.which->source);
    };
    if (!r.left_out.empty()) {
        head();
        out.member("quantity", "").key("reference").json("null").key("value").json("null");
        out.key("error").json("null").key("tolerance").json("null");
        out.member("passed", true).member("left_out", r.left_out);
        out.member("seconds", r.seconds).member("note", "").close('}');
        return;
    }
    for (const Measured& m : r.rows) {
        head();
        out.member("quantity", m.quantity).member("reference", m.reference);
        out.member("value", m.value).member("error", m.error).member("tolerance", m.tolerance);
        out.member("passed", m.passed()).member("left_out", "").member("seconds", r.seconds);
        out.member("note", m.note).close('}');
    }
}

std::string json_of(const std::vector<CaseResult>& results)
{
    JsonText out;
    out.open('[');
    for (const CaseResult& r : results)
        add_rows(out, r);
    out.close(']');
    return out.text() + "\n";
}

std::string table_of(const CaseResult& r)
{
    std::string t = fmt::format("{} ({}; {:.2f} s): {}\n", r.which->name, r.which->suite, r.seconds,
                                r.which->source);
    if (!r.left_out.empty()) return t + "  left out: " + r.left_out + "\n";
    for (const Measured& m : r.rows) {
        t += fmt::format("  {:<6} {:<58} {:>13.9g} {:>13.9g} {:>9.2e} {:>8.1e}\n",
                         m.passed() ? "ok" : "FAILED", m.quantity, m.reference, m.value, m.error,
                         m.tolerance);
        if (!m.note.empty()) t += fmt::format("         {}\n", m.note);
    }
    return t;
}

const char* const kHeading = "         quantity                                                   "
                             "    reference        result     error tolerance\n";

std::string report_of(const std::vector<CaseResult>& results)
{
    std::string t = "# Published cases\n\n`amontons validate`\n\n"
                    "| case | quantity | reference | result | error | tolerance | |\n"
                    "|---|---|---|---|---|---|---|\n";
    for (const CaseResult& r : results) {
        if (!r.left_out.empty())
            t += fmt::format("| {} | left out: {} | | | | | |\n", r.which->name, r.left_out);
        for (const Measured& m : r.rows)
            t += fmt::format("| {} | {} | {:.9g} | {:.9g} | {:.2e} | {:.1e} | {} |\n",
                             r.which->name, m.quantity, m.reference, m.value, m.error, m.tolerance,
                             m.passed() ? "" : "**failed**");
    }
    t += "\n| case | source | seconds |\n|---|---|---|\n";
    for (const CaseResult& r : results)
        t += fmt::format("| {} | {} | {:.2f} |\n", r.which->name, r.which->source, r.seconds);
    return t;
}

void validate(const ValidateArguments& arguments, Session& session)
{
    const std::vector<const Case*> list = chosen(arguments);
    if (arguments.list) {
        JsonText json;
        std::string text;
        json.open('[');
        for (const Case* c : list) {
            json.open('{').member("case", c->name).member("suite", c->suite);
            json.member("source", c->source).close('}');
            text += fmt::format("{:<20} {:<11} {}\n", c->name, c->suite, c->source);
        }
        session.print(session.json ? json.close(']').text() + "\n" : text);
        return;
    }
    if (!arguments.report.empty()) make_folder(arguments.report);

    std::vector<CaseResult> results;
    if (!session.json) session.print(kHeading);
    for (const Case* c : list) {
        session.detail(fmt::format("{} ...", c->name));
        results.push_back(validation::run_case(*c));
        if (!session.json) session.print(table_of(results.back()));
    }
    const auto failed = std::count_if(results.begin(), results.end(),
                                      [](const CaseResult& r) { return !r.passed(); });
    if (session.json)
        session.print(json_of(results));
    else
        session.print(fmt::format("{} of {} cases passed\n", results.size() - std::size_t(failed),
                                  results.size()));
    if (!arguments.report.empty()) {
        write_file(arguments.report + "/validation.json", json_of(results));
        write_file(arguments.report + "/validation.md", report_of(results));
    }
    if (failed > 0) session.exit_code = kCaseFailed;
}

} // namespace

void add_validate(CLI::App& program, Session& session)
{
    const auto arguments = std::make_shared<ValidateArguments>();
    CLI::App* command = program.add_subcommand("validate", "Compare with published results");
    command->add_option("CASE", arguments->cases, "Cases; all without");
    command->add_option("--suite", arguments->suite, "benchmarks or stability")
        ->check(CLI::IsMember({"benchmarks", "stability"}));
    command->add_flag("--list", arguments->list, "Only list the cases");
    command->add_option("--report", arguments->report, "Write a report into this folder")
        ->type_name("DIR");
    command->add_flag("--json", session.json, "One JSON list on stdout");
    command->callback([arguments, &session] { validate(*arguments, session); });
}

} // namespace amontons
