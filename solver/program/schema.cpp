// amontons schema: the JSON schema of a scene.

#include "solver/scene/schema.hpp"

#include "solver/program/session.hpp"

#include <CLI/CLI.hpp>

namespace amontons {

void add_schema(CLI::App& program, Session& session)
{
    const auto markdown = std::make_shared<bool>(false);
    CLI::App* command = program.add_subcommand("schema", "Print the JSON schema of a scene");
    command->add_flag("--markdown", *markdown, "A reference page for people instead");
    command->callback(
        [markdown, &session] { session.print(*markdown ? scene_reference() : scene_schema()); });
}

} // namespace amontons
