// amontons validate [CASE ...]: the published cases, reference beside result.

#include "solver/program/session.hpp"

#include <CLI/CLI.hpp>

namespace amontons {
namespace {

struct ValidateArguments {
    std::vector<std::string> cases;
    std::string suite, report;
    bool list = false;
};

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
    command->callback([arguments, &session] {
        session.error("no cases are built into this program yet");
        session.exit_code = kBadInput;
    });
}

} // namespace amontons
