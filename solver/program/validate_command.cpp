// amontons validate [CASE ...]: its arguments. The cases are in a program of their own
// (validate.hpp).

#include "solver/program/session.hpp"
#include "solver/program/validate.hpp"

#include <CLI/CLI.hpp>
#include <memory>

namespace amontons {

void add_validate(CLI::App& program, Session& session)
{
    const auto arguments = std::make_shared<ValidateArguments>();
    CLI::App* command = program.add_subcommand("validate", "Compare with published results");
    command->add_option("CASE", arguments->cases,
                        "Cases by name, or folders with a case.json; all without");
    command
        ->add_option("--suite", arguments->suite,
                     "benchmarks, stability, or random scenes under laws: random, and mixed "
                     "(all kinds of bodies together)")
        ->check(CLI::IsMember({"benchmarks", "stability", "random", "mixed"}));
    command
        ->add_option("--seed", arguments->seed,
                     "Of the random scenes, the same on every machine (default: 1)")
        ->check(
            [](const std::string& text) { // "-1" would be read as the largest number
                const bool digits = text.find_first_not_of("0123456789") == std::string::npos;
                return digits && text.size() < 20
                           ? std::string()
                           : text + " is no whole number from 0 to 10^19 - 1";
            },
            "UINT");
    command->add_option("--count", arguments->count, "Random scenes (default: 300, mixed 200)")
        ->check(CLI::Range(1, 1000000));
    command
        ->add_option("--scene", arguments->scene, "One of the random scenes alone, by its number")
        ->check(CLI::Range(0, 999999));
    command
        ->add_option("--program", arguments->program,
                     "Another amontons that runs the random scenes")
        ->type_name("FILE");
    command->add_flag("--list", arguments->list, "Only list the cases");
    command
        ->add_option("--report", arguments->report,
                     "Write a report into this folder: HTML, CSV, SVG plots")
        ->type_name("DIR");
    command
        ->add_option("--data", arguments->data,
                     "Problems and meshes that some cases are measured on, where they are there")
        ->type_name("DIR")
        ->capture_default_str();
    command->add_option("--jobs", arguments->jobs, "Cases at a time (default: one a core)")
        ->check(CLI::Range(1, 1024));
    command->add_flag("--json", session.json, "One JSON list on stdout");
    command->callback([arguments, &session] { validate(*arguments, session); });
}

} // namespace amontons
