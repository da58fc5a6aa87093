// amontons validate --suite random or mixed: scenes by seed and number, some at a time, each in a
// process of its own. The process of a scene (--scene) runs the scene and its variants one after
// the other, as children in turn: a run that crashes is a finding, and so is a judge that does.

#include "solver/program/validate_random.hpp"

#include "mesh/base/file.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/child.hpp"
#include "solver/output/manifest.hpp"
#include "solver/program/interrupt.hpp"
#include "solver/program/scratch_folder.hpp"
#include "solver/program/session.hpp"
#include "solver/program/validate.hpp"
#include "solver/scene/json_text.hpp"
#include "validation/random/known.hpp"
#include "validation/random/suite.hpp"

#include <algorithm>
#include <csignal>
#include <exception>
#include <fcntl.h>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>

namespace fs = std::filesystem;

namespace amontons {
namespace {

constexpr double kLongest = 20; ///< wall time over processor time, on a busy machine

using validation::ProgramAnswer;
using validation::SceneResult;
using validation::SceneSuite;

constexpr std::uint64_t kSeed = 1;

std::string program_to_try(const ValidateArguments& arguments)
{
    if (arguments.program.empty()) return "";
    std::error_code error;
    const std::string path = fs::absolute(arguments.program, error).string();
    if (fs::is_directory(path, error) || !fs::exists(path, error))
        throw InputError(
            {{"validate", "--program", arguments.program, "the path of a program amontons"}});
    return path;
}

/// Kinds of scenes that were named, or all.
std::vector<std::string> chosen_kinds(const SceneSuite& suite, const ValidateArguments& arguments)
{
    std::vector<std::string> names;
    for (const validation::SceneKind& k : suite.kinds)
        names.emplace_back(k.name);
    std::vector<Issue> issues;
    std::string list;
    for (const std::string& n : names)
        list += (list.empty() ? "" : ", ") + n;
    for (const std::string& c : arguments.cases)
        if (std::find(names.begin(), names.end(), c) == names.end())
            issues.push_back(
                {"validate", "CASE", c, fmt::format("a kind of --suite {}: {}", suite.name, list)});
    if (!issues.empty()) throw InputError(issues);
    return arguments.cases.empty() ? names : arguments.cases;
}

/// Lines of a file that is still written.
int lines_of(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    return static_cast<int>(
        std::count(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>(), '\n'));
}

/// Runs the program until its history has so many steps, and kills it there; a run that ends
/// before that has ended. run_children polls a few times a second only, and scenes take less.
void kill_after_steps(const validation::ProgramJob& job, const std::string& program)
{
    std::vector<std::string> words{"amontons"};
    words.insert(words.end(), job.arguments.begin(), job.arguments.end());
    std::vector<char*> arguments;
    for (std::string& w : words)
        arguments.push_back(w.data());
    arguments.push_back(nullptr);
    const char* const path = program.empty() ? "/proc/self/exe" : program.c_str();
    const int nothing = ::open("/dev/null", O_RDWR | O_CLOEXEC);
    const pid_t child = ::fork();
    if (child == 0) { // only calls that are safe here, until exec
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        for (const int stream : {0, 1, 2})
            ::dup2(nothing, stream);
        ::execv(path, arguments.data());
        ::_exit(127);
    }
    if (nothing >= 0) ::close(nothing);
    if (child < 0) throw std::runtime_error("no process can be started");
    const Stopwatch watch;
    int status = 0;
    while (::waitpid(child, &status, WNOHANG) == 0) {
        if (lines_of(job.history) > job.steps + 1 ||
            watch.seconds() > kLongest * job.most_cpu_seconds) {
            ::kill(child, SIGKILL);
            ::waitpid(child, &status, 0);
            return;
        }
        ::usleep(200);
    }
}

/// The scene and its variants, here.
SceneResult try_here(const SceneSuite& suite, std::uint64_t seed, int number,
                     const std::string& folder, const std::string& program)
{
    const std::atomic<bool> never{false}; // a signal ends this process, and its children with it
    const auto run = [&](const validation::ProgramJob& job) {
        ProgramAnswer answer;
        if (job.steps > 0) {
            kill_after_steps(job, program);
            return answer;
        }
        run_children(
            {{job.arguments, kLongest * job.most_cpu_seconds, program, job.most_cpu_seconds}}, 1,
            never, [&](std::size_t, const ChildResult& r) {
                answer = {r.exit_code, r.signal,      r.out_of_time,
                          r.seconds,   r.cpu_seconds, last_line(r.errors)};
            });
        return answer;
    };
    SceneResult result = validation::try_scene(suite, seed, number, folder, run);
    std::error_code ignored;
    if (result.outcome == "done" || result.outcome == "known")
        fs::remove_all(folder, ignored);
    else
        result.folder = folder;
    return result;
}

/// What the process of a scene specifies; one without an answer is a finding.
SceneResult result_of(const SceneSuite& suite, std::uint64_t seed, int number,
                      const ChildResult& child)
{
    std::string why;
    try {
        if (child.exit_code == kDone || child.exit_code == kCaseFailed)
            return validation::read_scene_result(child.output);
        why = child.signal != 0
                  ? fmt::format("ended by signal {}", child.signal)
                  : fmt::format("exit code {}: {}", child.exit_code, last_line(child.errors));
    } catch (const std::exception& error) {
        why = error.what();
    }
    SceneResult r;
    r.suite = suite.name;
    r.number = number;
    r.kind = validation::kind_of_scene(suite, seed, number).name;
    r.outcome = "wrong";
    r.findings.push_back({"judge", "its process gave no answer: " + why});
    r.seconds = child.seconds;
    r.cpu_seconds = child.cpu_seconds;
    return r;
}

void print_kinds(const SceneSuite& suite, const Session& session)
{
    JsonText json;
    std::string text;
    json.open('[');
    for (const validation::SceneKind& k : suite.kinds) {
        json.open('{')
            .member("case", k.name)
            .member("suite", suite.name)
            .member("about", k.about)
            .close('}');
        text += fmt::format("{:<26} {:<11} {}\n", k.name, suite.name, k.about);
    }
    for (const validation::KnownMistake& k : validation::known_mistakes())
        if (std::ranges::any_of(suite.kinds,
                                [&](const auto& kind) { return kind.name == std::string(k.kind); }))
            text += fmt::format("known of {}: {}: {}\n", k.kind, k.law, k.reason);
    session.print(session.json ? json.close(']').text() + "\n" : text);
}

/// The page of a report.
std::string page_of(const SceneSuite& suite, const std::vector<SceneResult>& results,
                    std::uint64_t seed, const std::string& program)
{
    std::string page = fmt::format(
        "# Random scenes, seed {}\n\n{}: `amontons validate --suite "
        "{} --seed {} --count {}`{}\n\n{}\n",
        seed, "amontons " + program_version(), suite.name, seed, results.size(),
        program.empty() ? "" : " with the program " + program, validation::table_markdown(results));
    for (const SceneResult& r : results)
        page += validation::findings_text(r, seed);
    return page;
}

void print_results(const std::vector<SceneResult>& results, std::uint64_t seed,
                   const Session& session)
{
    for (const SceneResult& r : results)
        session.print(validation::findings_text(r, seed));
    session.print(validation::table_text(results));
    const auto count = [&](const char* outcome) {
        return std::count_if(results.begin(), results.end(),
                             [&](const SceneResult& r) { return r.outcome == outcome; });
    };
    session.print(fmt::format("{} scenes of seed {}: {} done, {} refused, {} known, {} wrong\n",
                              results.size(), seed, count("done"), count("refused"), count("known"),
                              count("wrong")));
}

std::string json_of(const std::vector<SceneResult>& results)
{
    JsonText json;
    json.open('[');
    for (const SceneResult& r : results)
        json.json(validation::json_of(r));
    return json.close(']').text() + "\n";
}

bool is_wrong(const SceneResult& r)
{
    return r.outcome == "wrong";
}

} // namespace

void refuse_random_options(const ValidateArguments& arguments)
{
    std::vector<Issue> issues;
    const auto check = [&](bool given, const char* option) {
        if (given)
            issues.push_back({"validate", option, "it", "with --suite random or mixed only"});
    };
    check(arguments.seed.has_value(), "--seed");
    check(arguments.count.has_value(), "--count");
    check(arguments.scene.has_value(), "--scene");
    check(!arguments.program.empty(), "--program");
    if (!issues.empty()) throw InputError(issues);
}

void validate_random(const SceneSuite& suite, const ValidateArguments& arguments, Session& session)
{
    const std::vector<std::string> kinds = chosen_kinds(suite, arguments);
    if (arguments.list) return print_kinds(suite, session);
    const std::uint64_t seed = arguments.seed.value_or(kSeed);
    const std::string program = program_to_try(arguments);
    if (!arguments.report.empty()) make_folder(arguments.report);
    std::optional<ScratchFolder> scratch;
    if (arguments.report.empty()) scratch.emplace();
    const std::string folder =
        fs::absolute(scratch ? scratch->path() : arguments.report).lexically_normal().string();
    const auto folder_of = [&](int number) { return fmt::format("{}/scene_{}", folder, number); };

    if (arguments.scene) {
        const SceneResult r =
            try_here(suite, seed, *arguments.scene, folder_of(*arguments.scene), program);
        if (session.json)
            session.print(validation::json_of(r) + "\n");
        else
            print_results({r}, seed, session);
        if (scratch && !r.folder.empty()) scratch->keep();
        if (is_wrong(r)) session.exit_code = kCaseFailed;
        return;
    }

    std::vector<int> numbers;
    std::vector<ChildJob> jobs;
    for (int i = 0; i < arguments.count.value_or(suite.count); ++i) {
        const std::string kind = validation::kind_of_scene(suite, seed, i).name;
        if (std::find(kinds.begin(), kinds.end(), kind) == kinds.end()) continue;
        numbers.push_back(i);
        jobs.push_back({{"validate", "--suite", suite.name, "--seed", std::to_string(seed),
                         "--scene", std::to_string(i), "--json", "--quiet", "--report", folder}});
        if (!program.empty())
            jobs.back().arguments.insert(jobs.back().arguments.end(), {"--program", program});
    }
    const int at_once =
        arguments.jobs > 0 ? arguments.jobs : std::max(1, int(std::thread::hardware_concurrency()));
    std::vector<std::optional<SceneResult>> ended(jobs.size());
    std::size_t done = 0;
    run_children(jobs, at_once, stop_on_interrupt(), [&](std::size_t k, const ChildResult& child) {
        ended[k] = result_of(suite, seed, numbers[k], child);
        session.detail(fmt::format("{} of {}: scene {} ({}): {}, {:.2f} s", ++done, jobs.size(),
                                   numbers[k], ended[k]->kind, ended[k]->outcome,
                                   ended[k]->seconds));
    });
    std::vector<SceneResult> results;
    for (std::optional<SceneResult>& r : ended)
        if (r) results.push_back(std::move(*r));
    if (session.json)
        session.print(json_of(results));
    else
        print_results(results, seed, session);
    if (!arguments.report.empty()) {
        write_file(folder + "/random.json", json_of(results));
        write_file(folder + "/random.csv", validation::table_csv(results));
        write_file(folder + "/random.md", page_of(suite, results, seed, program));
        session.print_line("report: " + folder + "/random.md");
    }
    std::error_code error;
    if (scratch && !fs::is_empty(folder, error)) scratch->keep();
    if (std::any_of(results.begin(), results.end(), is_wrong)) session.exit_code = kCaseFailed;
    if (was_interrupted()) {
        session.error(fmt::format("interrupted: {} of {} scenes ran", results.size(), jobs.size()));
        session.exit_code = kInterrupted;
    }
}

} // namespace amontons
