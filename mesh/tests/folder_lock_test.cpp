#include "mesh/base/folder_lock.hpp"

#include "mesh/base/error.hpp"

#include <cstdlib>
#include <doctest/doctest.h>
#include <filesystem>
#include <fstream>
#include <sys/wait.h>
#include <unistd.h>

using namespace amontons;
namespace fs = std::filesystem;

namespace {

struct Folder {
    std::string path;
    Folder()
    {
        char name[] = "/tmp/amontons_lock_XXXXXX";
        path = ::mkdtemp(name);
    }
    ~Folder() { fs::remove_all(path); }
};

/// Message to another process that requests the folder; "" if it gets it.
std::string refusal_of_another(const std::string& folder)
{
    int ends[2];
    REQUIRE(::pipe(ends) == 0);
    const pid_t child = ::fork();
    if (child == 0) {
        std::string words;
        try {
            const FolderLock lock(folder, "another");
        } catch (const InputError& error) {
            words = error.what();
        }
        ::_exit(::write(ends[1], words.data(), words.size()) < 0);
    }
    ::close(ends[1]);
    char text[1000];
    const ssize_t n = ::read(ends[0], text, sizeof text);
    ::close(ends[0]);
    ::waitpid(child, nullptr, 0);
    return {text, std::size_t(n > 0 ? n : 0)};
}

} // namespace

TEST_CASE("a folder belongs to one process: the next is refused with its name, and gets the folder "
          "when that ends")
{
    const Folder folder;
    {
        const FolderLock lock(folder.path, "amontons run a\nb.json");
        const std::string words = refusal_of_another(folder.path);
        CHECK(words.find("process " + std::to_string(::getpid()) + " (amontons run a?b.json)") !=
              std::string::npos);
    }
    CHECK(!fs::exists(folder.path + "/.lock"));
    CHECK(refusal_of_another(folder.path) == "");
}

TEST_CASE(
    "a lock that a process left behind is taken over, and a link in its place is not followed")
{
    const Folder folder;
    const std::string precious = folder.path + "/precious";
    std::ofstream(precious) << "words";
    std::ofstream(folder.path + "/.lock") << "process 1 (another)\n";
    {
        const FolderLock lock(folder.path, "one");
    }
    fs::create_symlink(precious, folder.path + "/.lock");
    {
        const FolderLock lock(folder.path, "one");
        CHECK(refusal_of_another(folder.path) != "");
    }
    CHECK(fs::file_size(precious) == 5);
}
