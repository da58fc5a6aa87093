#include "mesh/base/utf8.hpp"

#include "mesh/base/error.hpp"

#include <doctest/doctest.h>
#include <string>

using namespace amontons;

TEST_CASE("UTF-8 is distinguished from other bytes: overlong, cut, of surrogates, beyond the last "
          "character")
{
    for (const char* good :
         {"", "plain", "\xc3\xa4", "\xe2\x82\xac", "\xf0\x9f\x98\x80", "\xf4\x8f\xbf\xbf"})
        CHECK(is_utf8(good));
    for (const char* bad : {"\xff", "\xc3", "a\xa4", "\xc0\xaf", "\xe0\x80\x80", "\xed\xa0\x80",
                            "\xf4\x90\x80\x80", "\xf5\x80\x80\x80"})
        CHECK(!is_utf8(bad));
}

TEST_CASE("control characters and those that turn the direction of a text are not printable")
{
    CHECK(is_printable("bottom, \"glued\" \xc3\xa4"));
    for (const char* bad : {"a\tb", "a\nb", "\x7f", "\xc2\x85",
                            "\xe2\x80\xae"
                            "x",
                            "\xe2\x80\xa8", "\xef\xbb\xbf", "\xff"})
        CHECK(!is_printable(bad));
}

TEST_CASE("a text that is cut for a message ends with a whole character")
{
    const std::string euros = "\xe2\x82\xac\xe2\x82\xac\xe2\x82\xac";
    for (std::size_t longest = 0; longest < 10; ++longest)
        CHECK(is_utf8(quoted_text(euros, longest)));
    CHECK(quoted_text("\xff") == "\"\\xff\"");
}
