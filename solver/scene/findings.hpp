#pragma once

#include "mesh/base/error.hpp"

#include <string>
#include <vector>

namespace amontons {

/// Relative difference below which two lengths of a scene count as equal.
constexpr double kInputRoundOff = 1e-9;

/// Adds Issues, except those about a field for which there already was one.
class Findings {
public:
    Findings(const std::string& file, std::vector<Issue>& issues)
        : file_(file)
        , issues_(issues)
        , known_(issues.size())
    {
    }

    /// @param places  the fields it rests on; the first is the one named in the message
    void add(const std::vector<std::string>& places, std::string found, std::string allowed)
    {
        for (const std::string& p : places)
            for (std::size_t i = 0; i < known_; ++i)
                if (related(p, issues_[i].place)) return;
        issues_.push_back({file_, places.front(), std::move(found), std::move(allowed)});
    }

private:
    static bool starts(const std::string& text, const std::string& with)
    {
        return text.rfind(with, 0) == 0 && (text.size() == with.size() || text[with.size()] == '/');
    }
    static bool related(const std::string& a, const std::string& b)
    {
        return !b.empty() && (starts(a, b) || starts(b, a));
    }

    const std::string& file_;
    std::vector<Issue>& issues_;
    std::size_t known_;
};

} // namespace amontons
