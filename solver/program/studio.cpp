// amontons studio [SCENE | RESULTS]: a page in a browser to see, edit and lead a scene.

#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"
#include "solver/module.hpp"
#include "solver/output/manifest.hpp"
#include "solver/program/interrupt.hpp"
#include "solver/program/session.hpp"
#include "solver/scene/schema.hpp"
#include "solver/studio/studio_module.hpp"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>
#include <fmt/format.h>
#include <memory>
#include <unistd.h>

namespace fs = std::filesystem;

namespace amontons {
namespace {

struct StudioArguments {
    std::string open;
    int port = 0;
    double idle = 30; // [min]
    bool no_browser = false, no_results = false;
    std::string results = "out/studio"; // below the folder that scenes lie in
};

const Session* the_session = nullptr; // of the one call of the module

/// Where the page is: beside the module in a build tree and below a prefix.
std::string page_folder(const std::string& module)
{
    std::error_code error;
    for (fs::path at = fs::path(module).parent_path(); at.has_relative_path();
         at = at.parent_path())
        if (fs::exists(at / "share/amontons/studio/index.html", error))
            return (at / "share/amontons/studio").string();
    return "";
}

/// An argument can be read by everyone on this machine: the address follows a file that
/// only its owner can.
class Opener {
public:
    ~Opener()
    {
        std::error_code error;
        if (!folder_.empty()) fs::remove_all(folder_, error);
    }
    std::string file(const std::string& address)
    {
        std::error_code error;
        std::string name = (fs::temp_directory_path(error) / "amontons_studio_XXXXXX").string();
        if (!::mkdtemp(name.data())) return "";
        folder_ = name;
        const std::string path = name + "/open.html";
        write_file(path, "<!doctype html><meta http-equiv=\"refresh\" content=\"0;url=" + address +
                             "\"><title>amontons studio</title>\n");
        return path;
    }

private:
    std::string folder_;
};

Opener* the_opener = nullptr; // null: no browser is opened

void open_browser(const std::string& path)
{
    if (path.empty()) return;
    const char* address = path.c_str();
    const pid_t child = ::fork();
    if (child != 0) return; // the end of another one is not waited for
    ::setpgid(0, 0);
    ::dup2(STDERR_FILENO, STDOUT_FILENO);
    ::execlp("xdg-open", "xdg-open", address, static_cast<char*>(nullptr));
    ::_exit(127);
}

void announce_ready(const char* address, int port)
{
    the_session->print(std::string(address) + "\n");
    the_session->print_line(
        fmt::format("Open this address in a browser of this machine. From another one first:\n"
                    "  ssh -L {}:127.0.0.1:{} {}\nCtrl-C ends the server.",
                    port, port, std::getenv("USER") ? "USER@HOST" : "HOST"));
    if (the_opener) open_browser(the_opener->file(address));
}

int end_requested()
{
    return stop_on_interrupt() ? 1 : 0;
}

void studio(const StudioArguments& arguments, Session& session)
{
    const std::string module_file = find_module("studio");
    if (module_file.empty())
        throw InputError({{"(studio)", "", "no module studio",
                           "./setup.sh packages, then build again; \"amontons run --view\" needs "
                           "no browser"}});
    const std::string pages = page_folder(module_file);
    if (pages.empty())
        throw InputError({{"(studio)", "", "no share/amontons/studio beside " + module_file,
                           "a build with node and npm"}});
    std::error_code error;
    fs::path root = fs::current_path(), open;
    if (!arguments.open.empty()) {
        const fs::path path = fs::weakly_canonical(arguments.open, error);
        const bool folder = fs::is_directory(path, error);
        if (folder ? !fs::exists(path / "manifest.json", error)
                   : path.extension() != ".json" || !fs::is_regular_file(path, error))
            throw InputError(
                {{arguments.open, "", folder ? "a folder without manifest.json" : "no scene",
                  "a scene (.json) or a folder that amontons run has written"}});
        root = fs::canonical(root);
        open = path.lexically_relative(root);
        if (open.empty() || *open.begin() == "..") { // then what lies beside it is all there is
            root = path.parent_path();
            open = path.filename();
        }
    }
    const Module module("studio");
    const auto serve = module.function<const char*(const AmontonsStudio*)>("amontons_studio_serve");
    the_session = &session;
    Opener opener;
    the_opener = !arguments.no_browser && std::getenv("DISPLAY") ? &opener : nullptr;
    const std::string program = program_path() == "/proc/self/exe"
                                    ? fs::read_symlink("/proc/self/exe", error).string()
                                    : program_path();
    const std::string schema = scene_schema(), root_text = root.string(),
                      open_text = open.generic_string(), version = program_version(),
                      results = arguments.no_results ? "" : (root / arguments.results).string();
    (void)stop_on_interrupt();
    const AmontonsStudio how{program.c_str(),   pages.c_str(),   root_text.c_str(),
                             open_text.c_str(), results.c_str(), schema.c_str(),
                             version.c_str(),   arguments.port,  60 * arguments.idle,
                             announce_ready,    end_requested};
    const std::string problem = serve(&how);
    if (!problem.empty())
        throw InputError({{"(studio)", "", problem, "another port, or a whole build"}});
}

} // namespace

void add_studio(CLI::App& program, Session& session)
{
    const auto arguments = std::make_shared<StudioArguments>(); // lives as long as the callback
    CLI::App* command = program.add_subcommand(
        "studio", "See, edit and lead a scene, or examine results, in a browser");
    command->add_option("scene", arguments->open, "A scene, or a folder of results")
        ->type_name("SCENE|DIR");
    command->add_option("--port", arguments->port, "Of 127.0.0.1; 0: any that is free")
        ->check(CLI::Range(0, 65535));
    command
        ->add_option("--idle", arguments->idle, "Ends without a page for so long [min]; 0: never")
        ->check(CLI::Range(0.0, 1e6));
    command->add_flag("--no-browser", arguments->no_browser, "Only print the address");
    command
        ->add_option("--results", arguments->results,
                     "Where runs are written, below the folder of the scenes")
        ->type_name("DIR")
        ->capture_default_str();
    command->add_flag("--no-results", arguments->no_results, "Runs are not written");
    command->callback([arguments, &session] { studio(*arguments, session); });
}

} // namespace amontons
