#include "mesh/base/error.hpp"

#include <doctest/doctest.h>
#include <string>

using namespace amontons;

TEST_CASE("what stands in no file is named by its place alone")
{
    CHECK(std::string(InputError({{"", "--size", "-1", "> 0"}}).what()) ==
          "--size: found -1, allowed: > 0");
    CHECK(std::string(InputError({{"a.obj", "", "no triangle", "a surface"}}).what()) ==
          "a.obj: found no triangle, allowed: a surface");
}

TEST_CASE("a slip of the keyboard finds the name that was meant")
{
    const std::vector<std::string> names = {"friction", "between", "title", "step"};
    CHECK(nearest_name("frction", names) == "friction");   // left out
    CHECK(nearest_name("fricttion", names) == "friction"); // doubled
    CHECK(nearest_name("Friction", names) == "friction");  // case
    CHECK(nearest_name("tilte", names) == "title");        // swapped
    CHECK(nearest_name("stop", names) == "step");          // replaced
    CHECK(nearest_name("title", names) == "title");
}

TEST_CASE("a word that resembles no name gets no suggestion")
{
    CHECK(nearest_name("colour", {"friction", "between"}) == "");
    CHECK(nearest_name("", {"friction"}) == "");
    CHECK(nearest_name("x", {}) == "");
    CHECK(nearest_name(std::string(100000, 'a'), {"aa"}) == "");
}

TEST_CASE("an input error states the file and place and what was found and allowed of every issue")
{
    const InputError e({{"a.json", "/mu", "-1", ">= 0"}, {"b.stl", "", "a folder", "a file"}});
    CHECK(std::string(e.what()) == "a.json: /mu: found -1, allowed: >= 0\n"
                                   "b.stl: found a folder, allowed: a file");
    CHECK(e.issues().size() == 2);
}

TEST_CASE("bytes of no character are written as escapes and not sent to the terminal")
{
    CHECK(quoted_text("vertex") == "\"vertex\"");
    CHECK(quoted_text("a\x1b[2J\n") == "\"a\\x1b[2J\\x0a\"");
    CHECK(quoted_text("0123456789", 4) == "\"0123...\"");
}

TEST_CASE("a broken invariant names its condition and its line")
{
    CHECK_NOTHROW(AMONTONS_ASSERT(1 + 1 == 2));
    CHECK_THROWS_WITH_AS(AMONTONS_ASSERT(1 + 1 == 3), doctest::Contains("1 + 1 == 3"),
                         std::logic_error);
}
