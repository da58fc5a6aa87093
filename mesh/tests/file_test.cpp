#include "mesh/base/file.hpp"

#include "mesh/base/error.hpp"
#include "mesh/tests/temporary_folder.hpp"
#include "mesh/tests/test_program.hpp"

#include <csignal>
#include <cstdio>
#include <doctest/doctest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <thread>
#include <unistd.h>

using namespace amontons;
namespace fs = std::filesystem;

namespace {

Issue refused_file(const std::string& path)
{
    try {
        read_file(path);
    } catch (const InputError& e) {
        return e.issues().at(0);
    }
    return {};
}

/// This process may write files of no more than `bytes`, as on a full disk.
class FileSizeLimit {
public:
    explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN))
    {
        ::getrlimit(RLIMIT_FSIZE, &before_);
        const struct rlimit limit = {bytes, before_.rlim_max};
        ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    ~FileSizeLimit()
    {
        ::setrlimit(RLIMIT_FSIZE, &before_);
        std::signal(SIGXFSZ, handler_);
    }

private:
    void (*handler_)(int);
    struct rlimit before_ {};
};

} // namespace

TEST_CASE("what was written is read with bytes of any kind")
{
    const TemporaryFolder folder;
    std::string bytes;
    for (int i = 0; i < 100000; ++i)
        bytes += static_cast<char>(i * 31);
    for (const Flush flush : {Flush::to_disk, Flush::to_system}) {
        write_file(folder / "a", bytes, flush);
        CHECK(read_file(folder / "a") == bytes);
        write_file(folder / "a", "", flush);
        CHECK(read_file(folder / "a").empty());
    }
    CHECK(folder.count() == 1);
}

TEST_CASE("a file that cannot be read gives the reason")
{
    const TemporaryFolder folder;
    write_file(folder / "vessel.stl", "x");
    const Issue missing = refused_file(folder / "vesel.stl");
    CHECK(missing.file == folder / "vesel.stl");
    CHECK(missing.found == "no such file");
    CHECK(missing.allowed.find("\"vessel.stl\"") != std::string::npos);
    CHECK(refused_file(folder / "nowhere/a").found == "no such file");
    CHECK(refused_file(folder.path().string()).found == "a folder");
    CHECK(refused_file("/dev/null").found == "a device");
    CHECK(refused_file(folder / "vessel.stl/a").found == "Not a directory");
}

TEST_CASE("a file without permission to read is reported")
{
    if (::geteuid() == 0) {
        skip_test("this runs as root, who may read every file");
        return;
    }
    const TemporaryFolder folder;
    write_file(folder / "vessel.stl", "x");
    ::chmod((folder / "vessel.stl").c_str(), 0);
    CHECK(refused_file(folder / "vessel.stl").found == "Permission denied");
}

TEST_CASE("a pipe is read to its end")
{
    const TemporaryFolder folder;
    const std::string pipe = folder / "pipe";
    REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
    const std::string bytes(300000, 'p');
    std::thread writer([&] { write_file(pipe, bytes); });
    CHECK(read_file(pipe) == bytes);
    writer.join();
}

TEST_CASE("a write that fails leaves the old file and nothing else")
{
    const TemporaryFolder folder;
    write_file(folder / "history.csv", "old");
    {
        const FileSizeLimit full(1000);
        CHECK_THROWS_WITH_AS(write_file(folder / "history.csv", std::string(5000, 'n')),
                             doctest::Contains("File too large"), WriteError);
    }
    CHECK(read_file(folder / "history.csv") == "old");
    CHECK(folder.count() == 1);
    write_file(folder / "history.csv", "new");
    CHECK(read_file(folder / "history.csv") == "new");
}

TEST_CASE("a file that cannot be written gives the reason")
{
    const TemporaryFolder folder;
    CHECK_THROWS_WITH_AS(write_file(folder / "nowhere/a", "x"),
                         doctest::Contains("No such file or directory"), WriteError);
    CHECK_THROWS_WITH_AS(write_file(folder.path().string(), "x"), doctest::Contains("a folder"),
                         WriteError);
    CHECK_THROWS_WITH_AS(write_file("/dev/full", "x"), doctest::Contains("No space left on device"),
                         WriteError);
    CHECK(fs::is_character_file("/dev/full")); // not replaced
    write_file(folder / "file", "x");
    CHECK_THROWS_AS(make_folder(folder / "file"), WriteError);
    CHECK_THROWS_AS(make_folder(folder / "file/sub"), WriteError);
    make_folder(folder / "a/b/c");
    make_folder(folder / "a/b/c");
    CHECK(fs::is_directory(folder / "a/b/c"));
}

TEST_CASE("a link stays a link and permissions stay")
{
    const TemporaryFolder folder;
    write_file(folder / "real", "old");
    ::chmod((folder / "real").c_str(), 0640);
    fs::create_symlink("real", folder / "link");
    write_file(folder / "link", "new");
    CHECK(fs::is_symlink(folder / "link"));
    CHECK(read_file(folder / "real") == "new");
    CHECK(fs::status(folder / "real").permissions() == fs::perms(0640));
}

TEST_CASE("a link can be replaced by the file that is written, and what it names stays")
{
    const TemporaryFolder folder;
    write_file(folder / "real", "old");
    fs::create_symlink("real", folder / "link");
    write_file(folder / "link", "new", Flush::to_system, Links::replace);
    CHECK(!fs::is_symlink(folder / "link"));
    CHECK(read_file(folder / "link") == "new");
    CHECK(read_file(folder / "real") == "old");
    fs::create_symlink("real", folder / "other");
    drop_link(folder / "other");
    drop_link(folder / "real");
    CHECK(!fs::exists(folder / "other"));
    CHECK(read_file(folder / "real") == "old");
}

TEST_CASE("a reader never sees half a file")
{
    const TemporaryFolder folder;
    const std::string a(20000, 'a'), b(30000, 'b');
    write_file(folder / "f", a);
    std::thread writer([&] {
        for (int i = 0; i < 100; ++i)
            write_file(folder / "f", i % 2 ? a : b, Flush::to_system);
    });
    int torn = 0;
    for (int i = 0; i < 200; ++i) {
        const std::string seen = read_file(folder / "f");
        if (seen != a && seen != b) ++torn;
    }
    writer.join();
    CHECK(torn == 0);
}

TEST_CASE("the fingerprint is XXH3's and every byte counts")
{
    CHECK(hash_bytes("") == 0x2d06800538d394c2ULL); // published: XXH3_64bits, seed 0, no input
    // Published: XXH3_128bits.
    CHECK(hash128_bytes("") == Hash128{0x99aa06d3014798d8ULL, 0x6001c324468d497fULL});
    std::string bytes(1000, 'x');
    const std::uint64_t before = hash_bytes(bytes);
    const Hash128 wide = hash128_bytes(bytes);
    for (std::size_t i = 0; i < bytes.size(); i += 37) {
        std::string other = bytes;
        other[i] ^= 1;
        CHECK(hash_bytes(other) != before);
        CHECK(hash128_bytes(other) != wide);
    }
}

TEST_CASE("a file in parts is that of the parts together")
{
    const TemporaryFolder folder;
    const std::string large(1 << 20, 'a');
    const std::string_view parts[] = {"begin", "", large, "end"};
    write_file(folder / "a", parts);
    CHECK(read_file(folder / "a") == "begin" + large + "end");
    write_file(folder / "a", std::span<const std::string_view>());
    CHECK(read_file(folder / "a").empty());
    CHECK(folder.count() == 1);
}
