// amontons COMMAND ...: reads the arguments, runs one command, turns errors into exit codes.

#include "mesh/base/file.hpp"
#include "mesh/base/utf8.hpp"
#include "solver/large/large_matrix.hpp"
#include "solver/output/manifest.hpp"
#include "solver/program/interrupt.hpp"
#include "solver/program/session.hpp"
#include "solver/program/viewer.hpp"

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <fcntl.h>
#include <limits>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

using namespace amontons;

namespace {

/// Help and version are no errors; a wrong argument is bad input, with the nearest name.
int report_arguments(const CLI::App& program, const CLI::ParseError& error, Session& session)
{
    if (mpirun_rank() > 0)
        return error.get_exit_code() == 0 ? kDone : kBadInput; // rank 0 prints it
    const CLI::App* command = &program;
    std::string path; // "mesh info "
    std::size_t depth = 0;
    while (!command->get_subcommands().empty()) {
        command = command->get_subcommands().back();
        path += command->get_name() + " ";
        ++depth;
    }
    if (dynamic_cast<const CLI::CallForHelp*>(&error) ||
        dynamic_cast<const CLI::CallForAllHelp*>(&error)) {
        session.print(program.help());
        return kDone;
    }
    if (dynamic_cast<const CLI::CallForVersion*>(&error)) {
        session.print(std::string(error.what()) + "\n");
        return kDone;
    }
    std::vector<std::string> names;
    for (const CLI::Option* option : command->get_options())
        for (const std::string& name : option->get_lnames())
            names.push_back("--" + name);
    for (const CLI::App* app : {&program, command})
        for (const CLI::App* sub : app->get_subcommands([](const CLI::App*) { return true; }))
            names.push_back(sub->get_name());
    std::string message = error.what();
    if (!command->get_subcommands([](const CLI::App*) { return true; }).empty()) {
        std::size_t words = 0; // that are no options: the first `depth` are commands
        for (std::size_t i = 1; i < session.arguments.size(); ++i)
            if (session.arguments[i].rfind('-', 0) != 0 && words++ == depth) {
                message = "no command \"" + session.arguments[i] + "\"";
                break;
            }
    }
    for (const std::string& argument : session.arguments) {
        const std::string name = argument.substr(0, argument.find('='));
        if (message.find(name) == std::string::npos) continue;
        const std::string near = nearest_name(name, names);
        if (!near.empty() && near != name) message += " (nearest: " + near + ")";
    }
    message += "; see amontons " + path + "--help";
    session.error(message);
    if (session.json) session.print(refusal_json({{"(command line)", "", message, "see --help"}}));
    return kBadInput;
}

/// Descriptors 0 to 2 that are closed would be those of the first files that are opened: reports
/// and warnings would be written into results. Reading from them and writing to them fails, as it
/// does where they are closed.
void hold_standard_streams()
{
    for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
        if (::fcntl(stream, F_GETFD) < 0) // the lowest that is free: this one
            (void)::open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
}

/// A run makes and drops the same large blocks in every step: the system would fill each with zeros
/// anew, which took a third of the time of large piles. What it fills for the first time comes in
/// pages of two megabytes where the system gives them on request: a tenth of the time of solids of
/// 2000 to 7000 nodes. Small scenes stay below the first of them.
void keep_memory()
{
#ifdef __GLIBC__
    mallopt(M_MMAP_MAX, 0);
    mallopt(M_TRIM_THRESHOLD, std::numeric_limits<int>::max());
    constexpr std::uintptr_t kPage = std::uintptr_t(2) << 20;
    constexpr int kReserved = 1 << 29, kUsual = 128 << 10; // of addresses [bytes]
    const auto end = [] { return reinterpret_cast<std::uintptr_t>(::sbrk(0)); };
    for (const auto bound : {RLIMIT_AS, RLIMIT_DATA}) // there, addresses count as memory
        if (rlimit most; ::getrlimit(bound, &most) != 0 || most.rlim_cur != RLIM_INFINITY) return;
    const std::uintptr_t start = end();
    mallopt(M_TOP_PAD, kReserved);             // the heap's end moves by that once, if it may
    void* volatile moves = std::malloc(kPage); // volatile: compilers leave out unused memory
    std::free(moves);
    mallopt(M_TOP_PAD, kUsual);
    const std::uintptr_t first = (start / kPage + 1) * kPage;
    if (end() > first) ::madvise(reinterpret_cast<void*>(first), end() - first, MADV_HUGEPAGE);
#endif
}

/// The server of studio hands on frames of megabytes by many threads and computes nothing: what it
/// frees is given back to the system.
void return_memory()
{
#ifdef __GLIBC__
    mallopt(M_ARENA_MAX, 2);
    mallopt(M_MMAP_THRESHOLD, 128 << 10); // it would grow with the frames
#endif
}

/// OpenBLAS, when it is loaded, starts a thread for each processor, and idle ones spin for a while:
/// a tenth of a second of processor time in a run that uses one. BlasThreads starts those that are
/// requested.
void no_idle_blas_threads()
{
    ::setenv("OPENBLAS_NUM_THREADS", "1", 0); // what the user has set stays
}

} // namespace

int main(int argc, char** argv)
{
    hold_standard_streams();
    const auto is_named = [&](std::string_view command) {
        return std::any_of(argv, argv + argc, [&](const char* a) { return command == a; });
    };
    // A run leaves a folder that --resume understands, however early it is interrupted.
    if (is_named("run") || is_named("serve") || is_named("studio")) stop_on_interrupt();
    if (is_named("studio"))
        return_memory();
    else
        keep_memory();
    no_idle_blas_threads();
    std::signal(SIGXFSZ, SIG_IGN); // a full quota is an error of write(2), not an end
    std::signal(SIGPIPE, SIG_IGN);

    Session session;
    session.arguments.assign(argv, argv + argc);
    // Where an option before it is wrong, it is not read.
    const bool json_requested = std::find(session.arguments.begin(), session.arguments.end(),
                                          "--json") != session.arguments.end();
    CLI::App program("Certified solver for many-body contact with Coulomb friction.", "amontons");
    program.require_subcommand(1);
    program.fallthrough();
    std::string version = "amontons " + program_version();
    if (!program_describe().empty()) version += " (" + program_describe() + ")";
    program.set_version_flag("--version", version);
    program.add_flag("--quiet,-q", session.quiet, "Only errors on stderr");
    program.add_flag("--verbose,-v", session.verbose, "More on stderr");
    program.footer(
        "Exit codes: 0 done, 1 a validation case failed, 2 bad input, 3 the solve failed, "
        "130 interrupted.");
    add_run(program, session);
    add_serve(program, session);
    add_studio(program, session);
    add_check(program, session);
    add_haptic(program, session);
    add_solve(program, session);
    add_schema(program, session);
    add_mesh(program, session);
    add_study(program, session);
    add_validate(program, session);
    add_render(program, session);
    add_view(program, session);
    add_completion(program, session);

    try {
        for (const std::string& argument : session.arguments)
            if (!is_utf8(argument))
                throw InputError({{"(command line)", "", quoted_text(argument), "UTF-8"}});
        program.parse(argc, argv);
        return session.exit_code;
    } catch (const CLI::ParseError& error) {
        session.json |= json_requested;
        return report_arguments(program, error, session);
    } catch (const InputError& error) {
        session.json |= json_requested;
        session.refuse(error.issues());
        return kBadInput;
    } catch (const WriteError& error) {
        session.error(error.what());
        return kSolveFailed;
    } catch (const std::bad_alloc&) {
        session.error("not enough memory");
        return kSolveFailed;
    } catch (const std::exception& error) {
        session.error(std::string("a mistake in amontons, please report it: ") + error.what());
        return kSolveFailed;
    }
}
