// amontons validate [CASE ...]: published cases, stiff and extreme ones; reference beside result.
//
// A case is a function in validation/families, or a folder with a case.json. Several cases run as
// children of the program, some at a time: one that crashes is a row that failed. This file is in
// amontons-validate alone, which has the cases; the command itself is in validate_command.cpp.

#include "solver/program/validate.hpp"
#include "mesh/base/file.hpp"
#include "solver/child.hpp"
#include "solver/module.hpp"
#include "solver/output/manifest.hpp"
#include "solver/output/plot.hpp"
#include "solver/program/interrupt.hpp"
#include "solver/program/scratch_folder.hpp"
#include "solver/program/session.hpp"
#include "solver/program/validate_random.hpp"
#include "solver/scene/json_text.hpp"
#include "validation/folder_case.hpp"
#include "validation/random/kinds.hpp"
#include "validation/report.hpp"

#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <limits>
#include <thread>

namespace fs = std::filesystem;

namespace amontons {
namespace {

using validation::Case;
using validation::CaseResult;
using validation::FolderCase;

/// A case of either kind.
struct Entry {
    std::string name, suite, source;
    const Case* function = nullptr;
    std::string folder;   ///< in validation/cases, or where it was named
    std::string mistake;  ///< what is wrong with its case.json, or ""
    std::string word;     ///< the argument by which a child runs it
    bool by_path = false; ///< a mistake in its case.json is bad input, not a case that failed
    std::string verified = "", about = "";
};

/// Where the folders of cases are, in the build as where it is installed.
std::string folder_of_cases()
{
    std::error_code error;
    const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path();
    return error ? "" : fs::weakly_canonical(program / "../share/amontons/cases").string();
}

Entry entry_of(const std::string& folder)
{
    const FolderCase c = validation::read_folder_case(folder);
    return {c.name, c.suite, c.source, nullptr, c.folder, "", c.folder, false, c.verified, c.about};
}

/// All cases that follow a name: functions first, then folders.
std::vector<Entry> known_cases()
{
    std::vector<Entry> all;
    for (const Case& c : validation::cases()) {
        const std::string name(c.name), folder = folder_of_cases() + "/" + name;
        all.push_back({name, std::string(c.suite), std::string(c.source), &c, folder, "", name,
                       false, std::string(c.verified), validation::about_case(folder)});
    }
    for (const std::string& folder : validation::case_folders(folder_of_cases())) {
        const std::string name = fs::path(folder).filename().string();
        const bool taken =
            std::any_of(all.begin(), all.end(), [&](const Entry& e) { return e.name == name; });
        try {
            all.push_back(entry_of(folder));
            if (taken) throw InputError({{folder, "", "the name of another case", "another name"}});
        } catch (const InputError& error) {
            if (taken) all.pop_back();
            all.push_back({name, "benchmarks", folder, nullptr, folder, error.what(), folder});
        }
    }
    return all;
}

/// The cases that are requested: in their own order, then folders by path as they were named.
std::vector<Entry> chosen(const ValidateArguments& arguments)
{
    const std::vector<Entry> all = known_cases();
    std::vector<Issue> issues;
    std::vector<Entry> by_path, list;
    std::vector<bool> selected(all.size(), arguments.cases.empty());
    for (const std::string& name : arguments.cases) {
        bool known = false;
        for (std::size_t i = 0; i < all.size(); ++i)
            if (all[i].name == name) known = selected[i] = true;
        std::error_code error;
        if (known) continue;
        if (name.find('/') != std::string::npos || fs::exists(name, error)) {
            try {
                by_path.push_back(entry_of(name));
                by_path.back().by_path = true;
            } catch (const InputError& mistake) {
                issues.insert(issues.end(), mistake.issues().begin(), mistake.issues().end());
            }
            continue;
        }
        std::vector<std::string> names;
        std::string text;
        for (const Entry& e : all) {
            names.push_back(e.name);
            text += (text.empty() ? "" : ", ") + e.name;
        }
        const std::string near = nearest_name(name, names);
        issues.push_back({"validate", "CASE", name,
                          (near.empty() ? "" : quoted_text(near) + " (nearest name), ") +
                              std::string("the path of a folder with a case.json, ") + text});
    }
    for (std::size_t i = 0; i < all.size(); ++i)
        if (selected[i]) list.push_back(all[i]);
    for (const Entry& e : by_path)
        if (std::none_of(list.begin(), list.end(),
                         [&](const Entry& k) { return k.folder == e.folder; }))
            list.push_back(e);
    const auto other = [&](const Entry& e) {
        return !arguments.suite.empty() && arguments.suite != e.suite;
    };
    // What is named is run, or reported to be of another suite; it is never passed over.
    if (!arguments.cases.empty())
        for (const Entry& e : list)
            if (other(e))
                issues.push_back({"validate", "CASE", fmt::format("{} ({})", e.name, e.suite),
                                  "cases of --suite " + arguments.suite});
    if (!issues.empty()) throw InputError(issues);
    list.erase(std::remove_if(list.begin(), list.end(), other), list.end());
    return list;
}

// ---- running

/// Why a case cannot be measured here, or "".
std::string lacks(const FolderCase& c, const std::string& data)
{
    std::error_code error;
    if (!c.data.empty() && !fs::is_directory(data, error))
        return fmt::format("no folder {} here (--data)", data);
    const bool problems = std::any_of(c.measures.begin(), c.measures.end(), [](const auto& m) {
        return m.kind == validation::CaseMeasure::Kind::problem;
    });
    if (problems && find_module("fclib").empty()) return "it needs the module fclib";
    return "";
}

CaseResult run_folder(const Entry& e, const std::string& all_data)
{
    const FolderCase c = validation::read_folder_case(e.folder);
    const std::string data =
        c.data.empty() ? "" : fs::absolute(fs::path(all_data) / c.data).lexically_normal().string();
    if (const std::string why = lacks(c, data); !why.empty())
        return {c.name, c.suite, c.source, "", "", {}, why};
    const ScratchFolder scratch;
    const std::atomic<bool> never{false}; // a signal ends this process, and its children with it
    int count = 0;
    const auto run_program = [&](const ChildJob& job) {
        validation::SceneAnswer answer;
        run_children({job}, 1, never, [&](std::size_t, const ChildResult& r) {
            answer.exit_code = r.exit_code;
            answer.json = r.output;
            answer.last_words =
                r.signal != 0 ? fmt::format("ended by signal {}", r.signal) : last_line(r.errors);
        });
        return answer;
    };
    const auto solve = [&](const std::string& file, double tolerance) {
        return run_program({{"solve", file, "--json", "--quiet", "--max-time", "60", "--tolerance",
                             fmt::format("{:g}", tolerance)},
                            0});
    };
    const auto run = [&](const std::string& file, const std::vector<std::string>& set) {
        const std::string folder = fmt::format("{}/{}", scratch.path(), ++count);
        ChildJob job{{"run", file, "--json", "--quiet", "--output", folder}, 0};
        std::vector<std::string> all = set;
        all.insert(all.end(),
                   {"output.picture=false", "output.plots=false", "output.every=1000000"});
        for (const std::string& o : all)
            job.arguments.insert(job.arguments.end(), {"--set", o});
        validation::SceneAnswer answer = run_program(job);
        answer.folder = folder;
        return answer;
    };
    std::vector<Issue> mistakes;
    CaseResult result = validation::run_case(c.name, c.suite, c.source, [&] {
        try {
            return validation::measure(c, run, solve, data);
        } catch (const InputError& error) { // a name that only a run can determine is none
            mistakes = error.issues();
            throw;
        }
    });
    if (e.by_path && !mistakes.empty()) throw InputError(mistakes);
    return result;
}

/// Adds the source and description of the case to its result.
CaseResult described(CaseResult r, const Entry& e)
{
    r.verified = e.verified;
    r.about = e.about;
    return r;
}

CaseResult run_here(const Entry& e, const std::string& data)
{
    if (!e.mistake.empty())
        return validation::run_case(
            e.name, e.suite, e.source,
            [&]() -> std::vector<validation::Measured> { throw std::runtime_error(e.mistake); });
    return described(e.function ? validation::run_case(*e.function) : run_folder(e, data), e);
}

/// What a child states of its one case; a child without an answer is a case that failed.
CaseResult result_of(const Entry& e, const ChildResult& child)
{
    std::string why;
    try {
        if (child.exit_code == kDone || child.exit_code == kCaseFailed) {
            const std::vector<CaseResult> all = validation::read_results(child.output, e.name);
            if (all.size() == 1) return all.front();
        }
        why = child.signal != 0
                  ? fmt::format("ended by signal {}", child.signal)
                  : fmt::format("exit code {}: {}", child.exit_code, last_line(child.errors));
    } catch (const InputError& error) {
        why = error.what();
    }
    CaseResult r =
        validation::run_case(e.name, e.suite, e.source, [&]() -> std::vector<validation::Measured> {
            throw std::runtime_error(why);
        });
    r.seconds = child.seconds;
    return described(std::move(r), e);
}

/// Runs all, and reports each as soon as those before it are reported.
std::vector<CaseResult> run_all(const std::vector<Entry>& list, const std::string& data,
                                int at_once,
                                const std::function<void(const CaseResult&)>& report_result)
{
    std::vector<CaseResult> results;
    if (list.size() == 1) {
        results.push_back(run_here(list[0], data));
        report_result(results[0]);
        return results;
    }
    std::vector<ChildJob> jobs;
    for (const Entry& e : list)
        jobs.push_back({{"validate", e.word, "--json", "--quiet", "--data", data}, 0});
    std::vector<std::optional<CaseResult>> ended(list.size());
    std::size_t reported = 0;
    run_children(jobs, at_once, stop_on_interrupt(), [&](std::size_t k, const ChildResult& child) {
        ended[k] = list[k].mistake.empty() ? result_of(list[k], child) : run_here(list[k], data);
        for (; reported < ended.size() && ended[reported]; ++reported)
            report_result(*ended[reported]);
    });
    for (std::optional<CaseResult>& r : ended)
        if (r) results.push_back(std::move(*r));
    return results;
}

// ---- reporting

void print_list(const std::vector<Entry>& list, const Session& session)
{
    JsonText json;
    std::string text;
    json.open('[');
    for (const Entry& e : list) {
        json.open('{').member("case", e.name).member("suite", e.suite);
        json.member("source", e.source).member("verified", e.verified);
        json.member("about", e.about).member("folder", e.folder);
        json.member("left_out", e.function ? e.function->left_out : "").close('}');
        text += fmt::format("{:<20} {:<11} {}\n", e.name, e.suite, e.source);
        if (e.function && !e.function->left_out.empty())
            text += fmt::format("{:<32} left out: {}\n", "", e.function->left_out);
        if (!e.mistake.empty()) text += fmt::format("{:<32} {}\n", "", e.mistake);
    }
    session.print(session.json ? json.close(']').text() + "\n" : text);
}

void write_report(const std::string& folder, const std::vector<CaseResult>& results,
                  const Session& session)
{
    make_folder(folder + "/plots");
    std::vector<std::string> drawn;
    for (const auto& [name, script] : validation::plots_of(results)) {
        write_file(folder + "/plots/" + name + ".gp", script);
        if (draw_plot(folder + "/plots", name + ".gp")) drawn.push_back(name);
    }
    if (drawn.empty())
        session.print_line(
            "no plots: gnuplot is not installed (gnuplot-nox); their scripts are in " + folder +
            "/plots");
    std::string about = "amontons " + program_version();
    if (!program_describe().empty()) about += " (" + program_describe() + ")";
    about += "; " + machine_text() + "; " + now_utc();
    write_file(folder + "/validation.json", validation::json_of(results));
    write_file(folder + "/validation.csv", validation::csv_of(results));
    write_file(folder + "/validation.md", validation::markdown_of(results));
    write_file(folder + "/index.html", validation::html_of(results, about, drawn));
    session.print_line("report: " + folder + "/index.html");
}

} // namespace

void validate(const ValidateArguments& arguments, Session& session)
{
    if (const validation::SceneSuite* const drawn = validation::find_suite(arguments.suite)) {
        validate_random(*drawn, arguments, session);
        return;
    }
    refuse_random_options(arguments);
    const std::vector<Entry> list = chosen(arguments);
    if (arguments.list) {
        print_list(list, session);
        return;
    }
    if (!arguments.report.empty()) make_folder(arguments.report);
    const int jobs =
        arguments.jobs > 0 ? arguments.jobs : std::max(1, int(std::thread::hardware_concurrency()));
    if (!session.json) session.print(validation::kHeading);
    const std::vector<CaseResult> results =
        run_all(list, arguments.data, jobs, [&](const CaseResult& r) {
            session.detail(fmt::format("{}: {:.2f} s", r.name, r.seconds));
            if (!session.json) session.print(validation::text_of(r));
        });
    const auto failed = std::count_if(results.begin(), results.end(),
                                      [](const CaseResult& r) { return !r.passed(); });
    const auto left_out = std::count_if(results.begin(), results.end(),
                                        [](const CaseResult& r) { return !r.left_out.empty(); });
    if (session.json)
        session.print(validation::json_of(results));
    else
        session.print(fmt::format(
            "{} of {} cases passed; {}\n", results.size() - std::size_t(failed + left_out),
            results.size() - std::size_t(left_out), validation::left_out_text(results)));
    if (!arguments.report.empty()) write_report(arguments.report, results, session);
    if (failed > 0) session.exit_code = kCaseFailed;
    if (was_interrupted()) {
        session.error(fmt::format("interrupted: {} of {} cases ran", results.size(), list.size()));
        session.exit_code = kInterrupted;
    }
}

} // namespace amontons
