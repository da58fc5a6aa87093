// amontons study SCENE --sweep PATH=a,b,c --quantity Q: error against run time.
//
// The folder of a study has study.json (what it is about), points/KEY.json (one for each point that
// was run: it continues from these), and what is made of them: study.csv, study.svg and its script.

#include "solver/program/study.hpp"
#include "mesh/base/file.hpp"
#include "mesh/base/folder_lock.hpp"
#include "solver/child.hpp"
#include "solver/output/manifest.hpp"
#include "solver/output/output_folder.hpp"
#include "solver/output/plot.hpp"
#include "solver/output/run_writer.hpp"
#include "solver/program/interrupt.hpp"
#include "solver/program/session.hpp"
#include "solver/scene/fingerprint.hpp"
#include "solver/scene/read.hpp"
#include "validation/study/table.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <map>

namespace fs = std::filesystem;

namespace amontons {
namespace {

using namespace study;

// ---- the scene of a point

/// Fingerprint of what decides a run's results: all but the scene's title and output.
/// @param files  those that were seen before
std::string hash_of(Scene scene, FileHashes& files)
{
    scene.title.clear();
    scene.output = {};
    return fmt::format("{:016x}", fingerprint(scene, files));
}

// ---- the folder

/// Name of a point's file: its overrides decide it, whatever else the study sweeps.
std::string key_of(const std::vector<std::string>& overrides)
{
    std::string all;
    for (const std::string& o : overrides)
        all += o + "\n";
    return fmt::format("{:016x}", hash_bytes(all));
}

std::string point_file(const std::string& folder, const std::vector<std::string>& overrides)
{
    return folder + "/points/" + key_of(overrides) + ".json";
}

/// A table without rows, of what a folder is about.
Table empty_table(const Definition& d)
{
    Table t;
    for (const std::string& s : d.sweeps)
        t.sweeps.push_back(parse_sweep(s));
    t.quantity = d.quantity;
    if (d.reference == "finest") return t;
    const char *from = d.reference.data(), *end = from + d.reference.size();
    const auto number = std::from_chars(from, end, t.reference);
    if (number.ec == std::errc() && number.ptr == end && std::isfinite(t.reference)) {
        t.kind = ReferenceKind::value;
        return t;
    }
    t.kind = ReferenceKind::file;
    std::error_code error;
    if (!fs::exists(d.reference, error))
        throw InputError({{"--reference", "", quoted_text(d.reference),
                           "a number, \"finest\", or the JSON file of a run or a reference"}});
    const Numbers numbers = numbers_of(read_file(d.reference), d.reference);
    const std::optional<double> value = study::find(numbers, d.quantity);
    if (!value || !std::isfinite(*value))
        throw InputError({{d.reference, "", "no number " + quoted_text(d.quantity),
                           allowed_names(numbers, {}, d.quantity)}});
    t.reference = *value;
    return t;
}

/// study.csv, study.gp and study.svg, and the answer on stdout.
void write_results(Table& table, const StudyArguments& a, const std::string& folder,
                   Session& session)
{
    table.by_cpu = a.time == "cpu";
    for (const std::string& file : a.add) {
        const auto rows = read_added(read_file(file), file, table.quantity, table.by_cpu);
        table.added.insert(table.added.end(), rows.begin(), rows.end());
    }
    evaluate(table);
    if (a.table == "tex") write_file(folder + "/study.tex", tex_of(table));
    write_file(folder + "/study.csv", csv_of(table));
    const std::string script = plot_script(table, "study");
    if (script.empty()) {
        session.print_line(text_counts(table).empty() ? "no plot: nothing is done"
                                                      : "no plot: words have none");
    } else {
        write_file(folder + "/study.gp", script);
        if (!draw_plot(folder, "study.gp"))
            session.print_line(
                "no plot: gnuplot is not installed (gnuplot-nox), or failed; its script "
                "is " +
                folder + "/study.gp");
    }
    if (session.json)
        session.print(json_of(table));
    else
        session.print(text_of(table) + fmt::format("  {0}/study.csv", folder) +
                      (a.table == "tex" ? fmt::format(", {0}/study.tex", folder) : "") +
                      (script.empty() ? "\n" : fmt::format(", {0}/study.svg\n", folder)));
    if (std::none_of(table.rows.begin(), table.rows.end(),
                     [](const Row& r) { return r.status == "done"; }))
        session.exit_code = kSolveFailed;
}

// ---- running

bool has_quantity(const PointRecord& r, const std::string& quantity)
{
    return quantity == "cpu_seconds" || study::find(r.numbers, quantity) ||
           study::find(r.texts, quantity);
}

/// What a child's end means for its point.
PointRecord record_of(const ChildResult& r, const std::string& hash,
                      const std::vector<std::string>& overrides)
{
    PointRecord p;
    p.hash = hash;
    p.overrides = overrides;
    p.program = program_version() + " " + program_describe();
    p.seconds = r.seconds;
    p.cpu_seconds = r.cpu_seconds;
    try {
        if (r.exit_code == kDone || r.exit_code == kSolveFailed)
            p.numbers = numbers_of(r.output, "the run's answer");
        p.texts = texts_of(r.output, "the run's answer");
    } catch (const InputError&) { // it ended before its answer
    }
    if (const auto total = study::find(p.numbers, "seconds.total")) p.seconds = *total;
    if (const auto own = study::find(p.numbers, "cpu_seconds")) p.cpu_seconds = *own; // --run-by
    if (r.out_of_time) {
        p.status = "out_of_time";
        p.reason = fmt::format("ended after {:.3g} s (--max-time)", r.seconds);
    } else if (r.exit_code == kDone && !p.numbers.empty()) {
        p.status = "done";
        const double without = study::find(p.numbers, "certificate.uncertified_steps").value_or(0);
        if (without > 0) p.reason = fmt::format("{:g} steps without certificate", without);
    } else if (r.exit_code == kBadInput) {
        p.status = "bad_input";
    } else if (r.exit_code == kSolveFailed) {
        p.status = "failed";
    } else {
        p.status = "crashed";
        p.reason = r.signal != 0 ? fmt::format("signal {} ({})", r.signal, ::strsignal(r.signal))
                                 : fmt::format("exit code {}", r.exit_code);
    }
    if (p.status != "done" && p.reason.empty()) {
        p.reason = last_line(r.errors);
        if (p.reason.rfind(p.status + ": ", 0) == 0) p.reason.erase(0, p.status.size() + 2);
    }
    return p;
}

struct Work {
    Point point;
    std::vector<std::string> overrides; ///< of the sweeps
    std::string hash;
    std::optional<PointRecord> record;
};

/// Whether a point without a result may have one now: its time limit is longer, or it ended by
/// something temporary, such as memory taken by another program. A refusal would be repeated.
bool is_worth_another_run(const PointRecord& r, double max_time)
{
    if (r.status == "out_of_time") return max_time == 0 || max_time > r.seconds;
    return r.status == "crashed";
}

/// Points of the folder that fit are taken over.
/// @throws InputError  if the scene is another one now
/// @param max_time  of a run [s]; 0: none
void take_over(std::vector<Work>& work, const Definition& now, const std::string& folder,
               bool restart, double max_time, Session& session)
{
    const std::string about = folder + "/study.json";
    if (!fs::exists(about)) return;
    if (restart) {
        fs::remove_all(folder + "/points");
        return;
    }
    const Definition before = read_definition(read_file(about), about);
    std::vector<Issue> issues;
    const std::string allowed = "the same as before, another --output, or --restart, which "
                                "throws the folder's rows away";
    if (before.hash != now.hash || before.set != now.set)
        issues.push_back({now.scene, "", "another scene than the one of " + folder, allowed});
    std::string program;
    std::size_t kept = 0;
    for (Work& w : work) {
        const std::string file = point_file(folder, w.overrides);
        if (!fs::exists(file)) continue;
        try {
            PointRecord r = read_record(read_file(file), file);
            if (r.hash != w.hash && issues.empty())
                issues.push_back(
                    {now.scene, "", "files that have changed since " + file + " was run", allowed});
            if (is_worth_another_run(r, max_time)) {
                session.print_line("run again: " + file + ", " + r.status);
                continue;
            }
            if (r.program != program_version() + " " + program_describe()) program = r.program;
            w.record = std::move(r);
            ++kept;
        } catch (const InputError& error) {
            session.print_line(std::string("run again: ") + error.what());
        }
    }
    if (!issues.empty()) throw InputError(issues);
    if (kept > 0)
        session.print_line(fmt::format("{} of {} points are there already", kept, work.size()));
    if (!program.empty())
        session.print_line("warning: some of them were made by amontons " + program);
}

void run_study(const StudyArguments& a, Session& session)
{
    std::vector<Issue> issues;
    if (a.sweeps.empty())
        issues.push_back({"amontons study", "", "no --sweep", "e.g. --sweep time.step=0.1,0.05"});
    if (a.quantity.empty())
        issues.push_back({"amontons study", "", "no --quantity",
                          "a number of `amontons run --json`, e.g. energy.error"});
    Definition about{a.scene.scene, "",     a.scene.overrides, a.sweeps, a.quantity,
                     a.reference,   a.shard};
    std::vector<Sweep> sweeps;

    // ---- Checks, all together
    const auto collect = [&](auto&& make) {
        try {
            make();
        } catch (const InputError& error) {
            for (const Issue& i : error.issues())
                if (std::none_of(issues.begin(), issues.end(), [&](const Issue& k) {
                        return k.file == i.file && k.place == i.place && k.found == i.found;
                    }))
                    issues.push_back(i);
        }
    };
    for (const std::string& s : a.sweeps)
        collect([&] { sweeps.push_back(parse_sweep(s)); });
    Shard shard;
    collect([&] { shard = parse_shard(a.shard); });
    if (!issues.empty()) throw InputError(issues);
    const std::vector<Point> points = all_points(sweeps);

    // Everything that can be reported beforehand is reported before the first run.
    std::vector<Work> work;
    FileHashes files;
    collect([&] { about.hash = hash_of(read_scene(a.scene.scene, a.scene.overrides), files); });
    if (issues.empty())
        for (const Point& p : points) {
            if (!shard.has(p)) continue;
            collect([&] {
                Work w{p, overrides(sweeps, p), "", {}};
                std::vector<std::string> all = a.scene.overrides;
                all.insert(all.end(), w.overrides.begin(), w.overrides.end());
                w.hash = hash_of(read_scene(a.scene.scene, all), files);
                work.push_back(std::move(w));
            });
        }

    // ---- Table and folder
    Table table;
    collect([&] { table = empty_table(about); });
    if (!issues.empty()) throw InputError(issues);

    const std::string folder = a.output.empty() ? "out/study-" + run_name(a.scene.scene) : a.output;
    check_output_folder(folder, read_scene(a.scene.scene, a.scene.overrides));
    make_folder(folder);
    const FolderLock lock(folder, "amontons study " + a.scene.scene);
    take_over(work, about, folder, a.restart, a.max_time, session);
    make_folder(folder + "/points");
    write_file(folder + "/study.json", definition_text(about));

    std::vector<ChildJob> jobs;
    std::vector<Work*> of_job;
    for (Work& w : work) {
        if (w.record) continue;
        const std::string results = folder + "/points/" + key_of(w.overrides) + ".run";
        ChildJob job{{"run", a.scene.scene, "--json", "--quiet", "--output", results, "--threads",
                      std::to_string(a.threads)},
                     a.max_time};
        job.program = a.run_by;
        const auto add = [&](const std::string& o) {
            job.arguments.push_back("--set");
            job.arguments.push_back(o);
        };
        for (const std::string& o : a.scene.overrides)
            add(o);
        for (const std::string& o : w.overrides)
            add(o);
        add("output.picture=false");
        if (!a.keep) {
            add("output.plots=false");
            add("output.every=1000000");
        }
        jobs.push_back(std::move(job));
        of_job.push_back(&w);
    }

    // ---- The runs, side by side
    const std::atomic<bool>& stop = stop_on_interrupt();
    const auto check_quantity = [&](const PointRecord& r) {
        if (r.status != "done" || has_quantity(r, a.quantity)) return;
        throw InputError({{"--quantity", "", quoted_text(a.quantity),
                           allowed_names(r.numbers, r.texts, a.quantity)}});
    };
    bool seen = false; // a run with the names of its quantities
    for (const Work& w : work)
        if (w.record && w.record->status == "done" && !seen) {
            seen = true;
            check_quantity(*w.record);
        }
    std::size_t ended = work.size() - jobs.size();
    run_children(jobs, a.jobs, stop, [&](std::size_t k, const ChildResult& result) {
        Work& w = *of_job[k];
        w.record = record_of(result, w.hash, w.overrides);
        write_file(point_file(folder, w.overrides), record_text(*w.record));
        if (!a.keep) {
            std::error_code ignored;
            fs::remove_all(folder + "/points/" + key_of(w.overrides) + ".run", ignored);
        }
        std::string values;
        for (const std::string& o : w.overrides)
            values += (values.empty() ? "" : " ") + o;
        session.print_line(
            fmt::format("[{}/{}] {}: {}{}", ++ended, work.size(), values, w.record->status,
                        w.record->reason.empty() ? fmt::format(", {:.3g} s", w.record->seconds)
                                                 : ": " + w.record->reason));
        if (!seen && w.record->status == "done") {
            seen = true;
            check_quantity(*w.record);
        }
    });

    // ---- What is left to do
    for (const Work& w : work)
        if (w.record) table.rows.push_back(make_row(w.point, *w.record, a.quantity));
    write_results(table, a, folder, session);
    if (work.empty()) { // nothing to do is no failure: what waits for all shards continues
        session.print_line(
            fmt::format("no point is in shard {}: the study has {}", a.shard, points.size()));
        session.exit_code = kDone;
    }
    if (was_interrupted()) {
        session.error(
            fmt::format("interrupted: {} of {} points are done; the same command continues",
                        table.rows.size(), work.size()));
        session.exit_code = kInterrupted;
    }
}

// ---- joining shards

void merge(const StudyArguments& a, Session& session)
{
    std::vector<Issue> issues;
    std::vector<Definition> all;
    for (const std::string& folder : a.merge) {
        const std::string file = folder + "/study.json";
        try {
            all.push_back(read_definition(read_file(file), file));
        } catch (const InputError& error) {
            issues.insert(issues.end(), error.issues().begin(), error.issues().end());
        }
    }
    if (!issues.empty()) throw InputError(issues);
    Definition about = all.front();
    for (std::size_t i = 1; i < all.size(); ++i) {
        const auto must_agree = [&](const char* what, const auto& mine, const auto& first) {
            if (mine != first)
                issues.push_back({a.merge[i] + "/study.json", what,
                                  "another one than in " + a.merge[0], "shards of one study"});
        };
        must_agree("hash", all[i].hash, about.hash);
        must_agree("set", all[i].set, about.set);
        must_agree("sweeps", all[i].sweeps, about.sweeps);
        if (a.quantity.empty()) must_agree("quantity", all[i].quantity, about.quantity);
        if (!a.new_reference) must_agree("reference", all[i].reference, about.reference);
    }
    if (!issues.empty()) throw InputError(issues);
    if (!a.quantity.empty()) about.quantity = a.quantity;
    if (a.new_reference) about.reference = a.reference;
    about.shard = "1/1";
    Table table = empty_table(about);

    std::string missing;
    std::size_t count = 0;
    const std::string folder = a.output.empty() ? "out/study-" + run_name(about.scene) : a.output;
    make_folder(folder);
    const FolderLock lock(folder, "amontons study --merge");
    make_folder(folder + "/points");
    const PointRecord* done = nullptr;
    std::vector<PointRecord> records;
    std::vector<Point> points;
    for (const Point& p : all_points(table.sweeps)) {
        const std::vector<std::string> values = overrides(table.sweeps, p);
        std::optional<PointRecord> found;
        for (const std::string& shard : a.merge) {
            const std::string file = point_file(shard, values);
            if (!fs::exists(file)) continue;
            PointRecord r = read_record(read_file(file), file);
            if (found && found->hash != r.hash)
                issues.push_back({file, "hash", "the point of another scene",
                                  "shards of one study, run on the same files"});
            if (!found || (found->status != "done" && r.status == "done")) found = std::move(r);
        }
        if (!found) {
            ++count;
            missing += (missing.empty() ? "" : ", ") + std::to_string(p.index);
            continue;
        }
        records.push_back(std::move(*found));
        points.push_back(p);
    }
    if (!issues.empty()) throw InputError(issues);
    for (const PointRecord& r : records)
        if (r.status == "done" && !done) done = &r;
    if (done && !has_quantity(*done, about.quantity))
        throw InputError({{"--quantity", "", quoted_text(about.quantity),
                           allowed_names(done->numbers, done->texts, about.quantity)}});
    for (std::size_t i = 0; i < points.size(); ++i) {
        write_file(point_file(folder, overrides(table.sweeps, points[i])), record_text(records[i]));
        table.rows.push_back(make_row(points[i], records[i], about.quantity));
    }
    write_file(folder + "/study.json", definition_text(about));
    if (count > 0)
        session.print_line(
            fmt::format("warning: {} points are in none of the folders: {}", count, missing));
    write_results(table, a, folder, session);
}

} // namespace

void carry_out_study(const StudyArguments& a, Session& session)
{
    if (a.merge.empty())
        run_study(a, session);
    else
        merge(a, session);
}

} // namespace amontons
