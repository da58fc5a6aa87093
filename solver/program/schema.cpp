// amontons schema: the JSON schema of a scene.

#include "solver/scene/schema.hpp"

#include "solver/output/meanings.hpp"
#include "solver/program/session.hpp"

#include <CLI/CLI.hpp>

namespace amontons {

void add_schema(CLI::App& program, Session& session)
{
    const auto markdown = std::make_shared<bool>(false), outputs = std::make_shared<bool>(false);
    CLI::App* command = program.add_subcommand("schema", "Print the JSON schema of a scene");
    command->add_flag("--markdown", *markdown, "A reference page for people instead");
    command->add_flag("--outputs", *outputs,
                      "Instead: what every file, column and key of a run means, for people");
    command->callback([markdown, outputs, &session] {
        session.print(*outputs ? outputs_page() : *markdown ? scene_reference() : scene_schema());
    });
}

} // namespace amontons
