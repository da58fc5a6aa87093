#pragma once

#include "mesh/volume_mesh.hpp"

#include <algorithm>
#include <map>

namespace amontons {

/// The members of sets, sorted by the sets that they are in: for formats where a cell belongs to
/// one thing only.
template <class Member> struct SetCombinations {
    std::vector<std::vector<std::size_t>> sets; ///< of each combination, ascending; never empty
    std::vector<std::vector<Member>> members;   ///< of each combination, ascending
};

/// Sets of the same members are listed once: sets of a name, and combinations of them.
template <class Member>
SetCombinations<Member> combinations_of(const std::vector<NamedSet<Member>>& sets)
{
    std::vector<std::pair<Member, std::size_t>> all;
    for (std::size_t s = 0; s < sets.size(); ++s)
        for (const Member& m : sets[s].members)
            all.emplace_back(m, s);
    std::sort(all.begin(), all.end());
    SetCombinations<Member> out;
    std::map<std::vector<std::size_t>, std::size_t> numbers;
    for (std::size_t i = 0, j = 0; i < all.size(); i = j) {
        std::vector<std::size_t> of;
        for (; j < all.size() && all[j].first == all[i].first; ++j)
            if (of.empty() || of.back() != all[j].second) of.push_back(all[j].second);
        const auto [at, fresh] = numbers.try_emplace(of, out.sets.size());
        if (fresh) {
            out.sets.push_back(std::move(of));
            out.members.emplace_back();
        }
        out.members[at->second].push_back(all[i].first);
    }
    return out;
}

} // namespace amontons
