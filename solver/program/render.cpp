// amontons render DIR --output PICTURE.png: a picture of a result, by the VTK module.

#include "solver/program/render.hpp"

#include "solver/module.hpp"
#include "solver/output/vtk/vtk_module.hpp"
#include "solver/program/session.hpp"

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <filesystem>
#include <spawn.h>
#include <stdexcept>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace amontons {
namespace {

struct RenderArguments {
    std::string directory, picture;
};

void render(const RenderArguments& arguments, Session& session)
{
    if (!std::filesystem::is_directory(arguments.directory))
        throw InputError({{arguments.directory, "", "no such folder", "the folder of a run"}});
    char message[1000] = "";
    try {
        const Module vtk("vtk");
        const auto draw = vtk.function<decltype(amontons_vtk_render)>("amontons_vtk_render");
        if (draw(arguments.directory.c_str(), arguments.picture.c_str(), message, sizeof message) ==
            0) {
            session.print_line("written: " + arguments.picture);
            return;
        }
    } catch (const std::runtime_error& error) {
        throw InputError({{arguments.directory, "", error.what(), "an installed VTK module"}});
    }
    session.error(message);
    session.exit_code = kSolveFailed;
}

std::string read_all(int stream)
{
    std::string text;
    char buffer[1024];
    for (ssize_t n = 0;
         (n = ::read(stream, buffer, sizeof buffer)) > 0 || (n < 0 && errno == EINTR);)
        if (n > 0) text.append(buffer, static_cast<std::size_t>(n));
    return text;
}

} // namespace

std::string render_in_child(const std::string& directory, const std::string& png)
{
    if (find_module("vtk").empty())
        return "the VTK module is not installed (./setup.sh packages, then build again)";
    int pipe[2];
    if (::pipe2(pipe, O_CLOEXEC) != 0) return "no pipe";
    std::string words[] = {"amontons", "render", directory, "--output", png, "--quiet"};
    char* arguments[std::size(words) + 1] = {};
    for (std::size_t i = 0; i < std::size(words); ++i)
        arguments[i] = words[i].data();
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
    ::posix_spawn_file_actions_adddup2(&actions, pipe[1], 2);
    pid_t child = 0;
    const std::string program = program_path();
    const int failed =
        ::posix_spawn(&child, program.c_str(), &actions, nullptr, arguments, environ);
    ::posix_spawn_file_actions_destroy(&actions);
    ::close(pipe[1]);
    const std::string words_of_child = failed == 0 ? read_all(pipe[0]) : "";
    ::close(pipe[0]);
    if (failed != 0) return "its process could not be started";
    int status = 0;
    ::waitpid(child, &status, 0);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return "";
    const std::size_t last = words_of_child.find_last_not_of("\n");
    return last == std::string::npos ? "its process ended without a message"
                                     : words_of_child.substr(0, last + 1);
}

void add_render(CLI::App& program, Session& session)
{
    const auto arguments = std::make_shared<RenderArguments>();
    CLI::App* command = program.add_subcommand("render", "Draw a picture of a result");
    command->add_option("DIR", arguments->directory, "Folder of a run")->required();
    command->add_option("--output,-o", arguments->picture, "The picture to write")
        ->type_name("PICTURE.png")
        ->required();
    command->callback([arguments, &session] { render(*arguments, session); });
}

} // namespace amontons
