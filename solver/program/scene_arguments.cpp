#include "solver/program/scene_arguments.hpp"

#include "mesh/base/error.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>

namespace amontons {

void add_scene_arguments(CLI::App& command, SceneArguments& arguments)
{
    command.add_option("SCENE", arguments.scene, "Scene file (JSON)");
    command
        .add_option("--set", arguments.overrides,
                    "Replace a value of the scene, e.g. contact.0.friction=0.1")
        ->type_name("PATH=VALUE");
}

void settle(SceneArguments& arguments)
{
    auto& o = arguments.overrides;
    const auto plain = std::find_if(o.begin(), o.end(), [](const std::string& text) {
        return text.find('=') == std::string::npos;
    });
    if (arguments.scene.empty() && plain != o.end()) {
        arguments.scene = *plain;
        o.erase(plain);
    }
    if (arguments.scene.empty())
        throw InputError({{"amontons", "", "no scene", "SCENE, a JSON file"}});
}

} // namespace amontons
