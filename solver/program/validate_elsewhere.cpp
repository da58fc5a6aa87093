// The program amontons has neither studies nor the cases of `validate`: it becomes
// amontons-validate, which stands beside it.

#include "solver/program/session.hpp"
#include "solver/program/study.hpp"
#include "solver/program/validate.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <unistd.h>

namespace fs = std::filesystem;

namespace amontons {
namespace {

/// @param what  is not here: "studies are"
void become_validate(const std::string& what, Session& session)
{
    std::error_code error;
    const fs::path here = fs::read_symlink("/proc/self/exe", error).parent_path();
    const std::string program = (here / "amontons-validate").string();
    session.exit_code = kBadInput; // nothing has run
    if (!fs::exists(program, error)) {
        session.error(what +
                      " in a program of their own, amontons-validate, which is not beside "
                      "this one (" +
                      program + "); \"./setup.sh all\" builds it");
        return;
    }
    std::vector<char*> words;
    for (std::string& w : session.arguments)
        words.push_back(w.data());
    words.push_back(nullptr);
    ::execv(program.c_str(), words.data());
    session.error(program + " cannot be started: " + std::strerror(errno));
}

} // namespace

void validate(const ValidateArguments&, Session& session)
{
    become_validate("the cases of validate are", session);
}

void carry_out_study(const StudyArguments&, Session& session)
{
    become_validate("studies are", session);
}

} // namespace amontons
