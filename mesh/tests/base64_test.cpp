#include "mesh/base/base64.hpp"

#include <doctest/doctest.h>
#include <random>

using namespace amontons;

TEST_CASE("base64 writes the texts of RFC 4648 and reads them")
{
    const std::pair<const char*, const char*> pairs[] = {{"", ""},
                                                         {"f", "Zg=="},
                                                         {"fo", "Zm8="},
                                                         {"foo", "Zm9v"},
                                                         {"foob", "Zm9vYg=="},
                                                         {"fooba", "Zm9vYmE="},
                                                         {"foobar", "Zm9vYmFy"}};
    for (const auto& [bytes, text] : pairs) {
        CAPTURE(text);
        CHECK(to_base64(bytes) == text);
        CHECK(from_base64(text) == bytes);
    }
}

TEST_CASE("base64 of any bytes reads back the same")
{
    std::mt19937 random(1);
    for (std::size_t size = 0; size < 300; ++size) {
        std::string bytes(size, '\0');
        for (char& c : bytes)
            c = static_cast<char>(random());
        CHECK(from_base64(to_base64(bytes)) == bytes);
    }
}

TEST_CASE("a text that base64 does not write is refused")
{
    for (const char* text : {"Z", "Zg", "Zg=", "Zg===", "=", "====", "Z===", "Zh==", "Zm9=",
                             "Zg==Zg==", "Zm 9", "Zm9v\n", "Zm-v", "\x80\x80\x80\x80"}) {
        CAPTURE(text);
        CHECK_FALSE(from_base64(text).has_value());
    }
}
