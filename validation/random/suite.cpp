// A scene and its variants: run, read, judged.

#include "validation/random/suite.hpp"

#include "mesh/base/file.hpp"
#include "validation/random/known.hpp"
#include "validation/random/variants.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <fmt/format.h>
#include <optional>

namespace fs = std::filesystem;

namespace amontons::validation {
namespace {

constexpr int kDoneCode = 0, kBadInputCode = 2, kRefusedCode = 3;
constexpr int kMostSeconds =
    60; ///< of processor time of a run; scenes are made to take less than one

struct Attempt {
    ProgramAnswer answer;
    std::optional<WrittenRun> written; ///< of a run that is done
    std::vector<Finding> findings;
};

/// Files beside a scene, and itself; the path of the scene.
std::string write_scene(const RandomScene& s, const Json& scene, const std::string& folder,
                        const std::string& name)
{
    make_folder(folder);
    for (const auto& [file, text] : s.files)
        write_file(folder + "/" + file, text, Flush::to_system);
    const std::string path = folder + "/" + name + ".json";
    write_file(path, scene.dump(1) + "\n", Flush::to_system);
    return path;
}

/// Words of a name that fit into a file name.
std::string file_word(std::string name)
{
    for (char& c : name)
        if (c == ' ' || c == '.') c = '_';
    return name;
}

class Trial {
public:
    Trial(const RandomScene& scene, std::string folder, const RunProgram& run, SceneResult& result)
        : scene_(scene)
        , folder_(std::move(folder))
        , run_(run)
        , result_(result)
    {
    }

    /// Runs a scene to its end. @param label  stands before what is found, of a variant
    Attempt run(const Json& scene, const std::string& name, int threads, const std::string& label,
                int killed_after = 0)
    {
        Attempt a;
        const std::string path = write_scene(scene_, scene, folder_, name),
                          output = folder_ + "/" + name + "_out";
        std::vector<std::string> words{"run",      path,        "--json",
                                       "--quiet",  "--threads", std::to_string(threads),
                                       "--output", output};
        if (killed_after > 0) {
            run_scene({words, kMostSeconds, output + "/history.csv", killed_after});
            std::error_code error;
            if (fs::exists(output + "/checkpoint", error)) words.push_back("--resume");
        }
        a.answer = run_scene({words, kMostSeconds});
        const std::string law = label.empty() ? "" : label + ": ";
        if (a.answer.out_of_time)
            a.findings.push_back(
                {law + "refused",
                 fmt::format("no answer within {} s of processor time", kMostSeconds)});
        else if (a.answer.signal != 0)
            a.findings.push_back(
                {law + "crash", fmt::format("ended by signal {}", a.answer.signal)});
        else if (a.answer.exit_code == kRefusedCode)
            a.findings.push_back({law + "refused", a.answer.last_words});
        else if (a.answer.exit_code == kBadInputCode)
            a.findings.push_back({law + "bad input", a.answer.last_words});
        else if (a.answer.exit_code != kDoneCode)
            a.findings.push_back({law + "crash", fmt::format("exit code {}: {}", a.answer.exit_code,
                                                             a.answer.last_words)});
        if (!a.findings.empty()) return a;
        try {
            a.written = read_run(output);
            if (a.written->text("status") != "done")
                a.findings.push_back(
                    {law + "files", "exit code 0, status " + a.written->text("status")});
        } catch (const std::exception& error) {
            a.findings.push_back({law + "files", error.what()});
        }
        return a;
    }

    /// What the steps of a run leave, by the same scene in steps twice as long, half and a quarter;
    /// once.
    const StepError& error_of_steps(const WrittenRun& base)
    {
        if (error_of_steps_) return *error_of_steps_;
        std::vector<WrittenRun> others;
        for (const double parts : {0.5, 2.0, 4.0}) {
            Json scene = scene_.scene;
            scene["time"]["step"] = scene.at("time").at("step").get<double>() / parts;
            Attempt a = run(scene, fmt::format("steps_{}", parts), 1, "");
            if (a.written) others.push_back(std::move(*a.written));
        }
        return error_of_steps_.emplace(step_error(base, others));
    }

private:
    ProgramAnswer run_scene(const ProgramJob& job)
    {
        const ProgramAnswer a = run_(job);
        ++result_.runs;
        result_.seconds += a.seconds;
        result_.cpu_seconds += a.cpu_seconds;
        return a;
    }

    const RandomScene& scene_;
    std::string folder_;
    const RunProgram& run_;
    SceneResult& result_;
    std::optional<StepError> error_of_steps_;
};

/// The end of a run that is right as it is, without examining what it wrote.
bool right_without_answer(Answer expected, int exit_code)
{
    if (exit_code == kRefusedCode) return expected == Answer::done_or_refused;
    if (exit_code == kBadInputCode)
        return expected == Answer::bad_input || expected == Answer::done_or_bad_input;
    return false;
}

bool is_refusal(const Finding& f)
{
    const std::string word = "refused";
    return f.law.size() >= word.size() &&
           f.law.compare(f.law.size() - word.size(), word.size(), word) == 0;
}

/// The outcome of what was found: wrong before refused, known if all of it is known.
void conclude(SceneResult& r)
{
    if (r.findings.empty()) {
        r.outcome = "done";
        return;
    }
    bool known = true, refused = true;
    for (const Finding& f : r.findings) {
        const std::string reason = known_reason(r.kind, r.drawn, f.law, f.text);
        known = known && !reason.empty();
        if (!reason.empty()) r.reason = reason;
        refused = refused && is_refusal(f);
    }
    r.outcome = known ? "known" : refused ? "refused" : "wrong";
}

} // namespace

SceneResult try_scene(const SceneSuite& suite, std::uint64_t seed, int number,
                      const std::string& folder, const RunProgram& run)
{
    SceneResult r;
    r.suite = suite.name;
    r.number = number;
    r.kind = kind_of_scene(suite, seed, number).name;
    const RandomScene s = draw_scene(suite, seed, number);
    r.drawn = s.drawn;
    Trial trial(s, folder, run, r);
    const Attempt base = trial.run(s.scene, "scene", 1, "");
    if (right_without_answer(s.answer, base.answer.exit_code)) {
        conclude(r);
        return r;
    }
    r.findings = base.findings;
    if (!base.written) {
        conclude(r);
        return r;
    }
    if (s.answer == Answer::bad_input)
        r.findings.push_back({"start", "done, though a body starts in another"});
    const std::vector<Finding> laws = check_laws(*base.written);
    r.findings.insert(r.findings.end(), laws.begin(), laws.end());
    if (s.right) try {
            if (const std::string wrong = s.right(*base.written); !wrong.empty())
                r.findings.push_back({"reference", wrong});
        } catch (const std::exception& error) {
            r.findings.push_back({"files", error.what()});
        }
    for (const Variant& v : variants_of(s, seed, number)) {
        const auto steps = static_cast<double>(base.written->history.rows.size() - 1);
        const int killed = v.killed_after > 0 ? std::max(1, int(v.killed_after * steps)) : 0;
        const Attempt other = trial.run(
            v.scene,
            v.killed_after > 0 || v.threads > 1 ? "scene_" + file_word(v.name) : file_word(v.name),
            v.threads, v.name, killed);
        r.findings.insert(r.findings.end(), other.findings.begin(), other.findings.end());
        if (!other.written) continue;
        try {
            std::vector<Finding> differs = compare_runs(*base.written, *other.written, v);
            // A step that one of them had to halve: they may differ by what steps leave.
            if (!differs.empty() && v.tolerance > 0 && v.name != "steps" &&
                took_other_steps(*base.written, *other.written, v.time))
                differs = compare_runs(*base.written, *other.written, v,
                                       trial.error_of_steps(*base.written));
            r.findings.insert(r.findings.end(), differs.begin(), differs.end());
        } catch (const std::exception& error) {
            r.findings.push_back({v.name, error.what()});
        }
    }
    conclude(r);
    return r;
}

} // namespace amontons::validation
