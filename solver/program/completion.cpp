// amontons completion: a bash completion script, from the same tree of commands as the help.
// Use it by:  source <(amontons completion)

#include "solver/program/session.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <memory>
#include <string>

namespace amontons {
namespace {

std::string option_words(const CLI::App& app)
{
    std::string words;
    for (const CLI::Option* option : app.get_options())
        for (const std::string& name : option->get_lnames())
            words += (words.empty() ? "--" : " --") + name;
    for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; }))
        if (app.get_parent()) words += " " + sub->get_name() + " " + option_words(*sub);
    return words;
}

std::string completion(const CLI::App& program)
{
    std::string commands, cases;
    for (const CLI::App* sub : program.get_subcommands([](const CLI::App*) { return true; })) {
        commands += (commands.empty() ? "" : " ") + sub->get_name();
        cases += fmt::format("        {}) words=\"{} {}\" ;;\n", sub->get_name(),
                             option_words(*sub), option_words(program));
    }
    return fmt::format(R"(# bash completion of amontons; source it, or put it into
# /usr/share/bash-completion/completions/amontons
_amontons()
{{
    local word="${{COMP_WORDS[COMP_CWORD]}}" command="" words="" i
    for ((i = 1; i < COMP_CWORD; i++)); do
        case "${{COMP_WORDS[i]}}" in
        -*) ;;
        *) command="${{COMP_WORDS[i]}}"; break ;;
        esac
    done
    case "$command" in
        "") words="{} {}" ;;
{}    esac
    COMPREPLY=($(compgen -W "$words" -- "$word"))
    [[ "$word" != -* && -n "$command" ]] && COMPREPLY+=($(compgen -f -- "$word"))
    return 0
}}
complete -o filenames -F _amontons amontons
)",
                       commands, option_words(program), cases);
}

} // namespace

void add_completion(CLI::App& program, Session& session)
{
    const auto shell = std::make_shared<std::string>("bash");
    CLI::App* command = program.add_subcommand("completion", "Print a bash completion script");
    command->add_option("SHELL", *shell, "The shell: bash")->check(CLI::IsMember({"bash"}));
    command->callback([&program, &session, shell] { session.print(completion(program)); });
}

} // namespace amontons
