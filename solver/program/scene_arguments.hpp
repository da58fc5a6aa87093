#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace amontons {

/// SCENE and --set, as run, check and later commands take them.
struct SceneArguments {
    std::string scene;
    std::vector<std::string> overrides;
};

/// Adds the arguments to a command; `arguments` must outlive the parsing.
void add_scene_arguments(CLI::App& command, SceneArguments& arguments);

/// Settles what the greedy --set took: a word without "=" is the scene. Call it first in the
/// command's callback.
/// @throws InputError  if there is no scene
void settle(SceneArguments& arguments);

} // namespace amontons
