#pragma once

#include "mesh/base/error.hpp"
#include "solver/scene/read.hpp"

#include <doctest/doctest.h>
#include <string>
#include <vector>

namespace amontons {

/// The issues of a text, one a line; "" if it is a scene.
inline std::string issues_of(const std::string& text,
                             const std::vector<std::string>& overrides = {})
{
    try {
        parse_scene(text, "s.json", overrides);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

/// A text with one piece of it replaced by another.
inline std::string replaced(std::string text, const std::string& old, const std::string& now)
{
    const std::size_t at = text.find(old);
    REQUIRE(at != std::string::npos);
    return text.replace(at, old.size(), now);
}

inline bool has(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}

} // namespace amontons
