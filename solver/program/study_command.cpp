// amontons study SCENE --sweep PATH=a,b,c --quantity Q: its arguments. The study itself is in a
// program of its own (study.hpp).

#include "solver/program/session.hpp"
#include "solver/program/study.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <memory>

namespace amontons {

void add_study(CLI::App& program, Session& session)
{
    const auto a = std::make_shared<StudyArguments>();
    CLI::App* command = program.add_subcommand(
        "study", "Error against run time and unknowns, over all combinations of some values");
    add_scene_arguments(*command, a->scene);
    command
        ->add_option("--sweep", a->sweeps,
                     "Values of a field, e.g. time.step=0.1,0.05; several fields that change "
                     "together: PATH,PATH=a,b. Given again: all combinations")
        ->type_name("PATH=a,b,c")
        ->allow_extra_args(false);
    command
        ->add_option(
            "--quantity", a->quantity,
            "A number or text of `amontons run --json`: a name of its quantities, or e.g. "
            "energy.error, seconds.total, iterations; of a text the study states how often "
            "which came out")
        ->type_name("Q");
    const CLI::Option* reference =
        command
            ->add_option("--reference", a->reference,
                         "What the error is measured against: a number, a JSON file that has the "
                         "quantity, or the finest row")
            ->type_name("value|file|finest");
    command->add_option("--output,-o", a->output, "Folder of the study (default: out/study-NAME)")
        ->type_name("DIR");
    command->add_option("--jobs", a->jobs, "Runs at a time; they take time from each other")
        ->check(CLI::Range(1, 1024));
    command->add_option("--threads", a->threads, "Threads of each run")->check(CLI::Range(1, 1024));
    command->add_option("--shard", a->shard, "Only every n-th point, from the i-th; see --merge")
        ->type_name("i/n");
    command->add_option("--max-time", a->max_time, "End a run after this wall time [s]")
        ->check(CLI::Validator(
            [](const std::string& text) {
                double seconds = 0;
                const bool number = CLI::detail::lexical_cast(text, seconds);
                return number && seconds > 0 && std::isfinite(seconds)
                           ? std::string()
                           : "found " + quoted_text(text) + ", allowed: seconds > 0";
            },
            "SECONDS"));
    command
        ->add_option("--time", a->time,
                     "Times of table, plot and Pareto front: of the clock, or of the "
                     "processors")
        ->check(CLI::IsMember({"wall", "cpu"}))
        ->capture_default_str();
    command->add_option("--table", a->table, "Also study.tex: a table for a paper")
        ->check(CLI::IsMember({"tex"}));
    command
        ->add_option(
            "--add", a->add,
            "Points of another program for comparison: a CSV with the columns name, seconds, value "
            "or error, and unknowns; again for more")
        ->allow_extra_args(false)
        ->type_name("FILE");
    command
        ->add_option("--run-by", a->run_by,
                     "A program that is called, and answers, as amontons run --json does (its "
                     "cpu_seconds, if it reports them, count)")
        ->type_name("PROGRAM");
    command->add_flag("--restart", a->restart, "Throw away what the folder has");
    command->add_flag("--keep", a->keep, "Keep the files of every run");
    command->add_option("--merge", a->merge, "Join the folders of shards")->type_name("DIR...");
    command->add_flag("--json", session.json, "One JSON object on stdout");
    command->callback([a, reference, &session] {
        a->new_reference = reference->count() > 0;
        if (a->merge.empty()) settle(a->scene);
        carry_out_study(*a, session);
    });
}

} // namespace amontons
