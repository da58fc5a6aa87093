#include "solver/studio/guard.hpp"

#include <cstdlib>
#include <doctest/doctest.h>
#include <filesystem>
#include <fstream>
#include <set>

using namespace amontons::studio;
namespace fs = std::filesystem;

TEST_CASE("tokens have 128 bits and never repeat")
{
    std::set<std::string> seen;
    for (int i = 0; i < 100; ++i) {
        const std::string token = random_token();
        CHECK(token.size() == 32);
        CHECK(token.find_first_not_of("0123456789abcdef") == std::string::npos);
        CHECK(seen.insert(token).second);
    }
}

TEST_CASE("nothing but Bearer and the whole token is authorised")
{
    const std::string token = "0123456789abcdef0123456789abcdef";
    CHECK(is_authorised("Bearer " + token, token));
    for (const std::string& wrong :
         {std::string(), token, "bearer " + token, std::string("Bearer"), std::string("Bearer "),
          "Bearer " + token + "0", "Bearer " + token.substr(1),
          "Bearer " + token + std::string(1, '\0'), "Bearer 1" + token.substr(1),
          "Bearer  " + token})
        CHECK_FALSE(is_authorised(wrong, token));
}

TEST_CASE("hosts and origins are this machine with the own port")
{
    CHECK(is_own_host("127.0.0.1:81", 81));
    CHECK(is_own_host("localhost:81", 81));
    CHECK(is_own_host("[::1]:81", 81));
    for (const char* wrong : {"", "127.0.0.1", "127.0.0.1:8", "127.0.0.1:811", "evil.example:81",
                              "127.0.0.1:81.evil.example", "localhost:81@evil", "0.0.0.0:81",
                              "[::2]:81", "[::]:81", "::1:81"})
        CHECK_FALSE(is_own_host(wrong, 81));
    CHECK(is_own_origin("", 81));
    CHECK(is_own_origin("http://localhost:81", 81));
    for (const char* wrong : {"null", "https://localhost:81", "http://localhost",
                              "http://evil.example", "http://localhost:81/", "file://"})
        CHECK_FALSE(is_own_origin(wrong, 81));
}

TEST_CASE("paths stay inside, through links and dots")
{
    char name[] = "/tmp/amontons_guard_XXXXXX";
    REQUIRE(::mkdtemp(name));
    const fs::path top = fs::canonical(name), root = top / "root";
    fs::create_directories(root / "a");
    std::ofstream(top / "secret.json") << "{}";
    std::ofstream(root / "a/in.json") << "{}";
    fs::create_symlink(top / "secret.json", root / "link.json");
    fs::create_symlink(top, root / "up");
    fs::create_symlink(root / "a/in.json", root / "own.json");
    CHECK(inside(root, "a/in.json") == root / "a/in.json");
    CHECK(inside(root, "a/../a/./in.json") == root / "a/in.json");
    CHECK(inside(root, "own.json") == root / "a/in.json");
    CHECK(inside(root, "a/new.json") == root / "a/new.json");
    for (const std::string& out :
         {std::string("../secret.json"), std::string("link.json"), std::string("up/secret.json"),
          (top / "secret.json").string(), std::string("a/../../secret.json"),
          std::string("a/in.json\0.csv", 14), std::string("/etc/passwd")})
        CHECK_FALSE(inside(root, out));
    fs::create_directories(top / "rootless");
    std::ofstream(top / "rootless/x.json") << "{}";
    CHECK_FALSE(inside(root, "../rootless/x.json"));
    fs::remove_all(top);
}
