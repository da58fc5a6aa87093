#include "contact/solvers/colours.hpp"

#include <algorithm>
#include <map>

namespace amontons {

Colours colours_of(const Columns& columns, int contacts)
{
    std::vector<std::vector<int>> group;
    std::map<std::vector<int>, std::size_t> number; // of each set of bodies
    std::vector<std::vector<int>> bodies;
    for (int i = 0; i < contacts; ++i) {
        std::vector<int> own;
        for (const Columns::Piece* p = columns.pieces_begin(i); p != columns.pieces_end(i); ++p)
            own.push_back(p->part);
        const auto [at, is_new] = number.try_emplace(own, group.size());
        if (is_new) {
            group.emplace_back();
            bodies.push_back(std::move(own));
        }
        group[at->second].push_back(i);
    }
    std::vector<std::vector<char>> taken; // of each body: its colours
    std::vector<std::vector<std::size_t>> colour;
    for (std::size_t g = 0; g < group.size(); ++g) {
        std::size_t c = 0;
        for (bool again = true; again;) {
            again = false;
            for (const int b : bodies[g]) {
                if (static_cast<std::size_t>(b) >= taken.size())
                    taken.resize(static_cast<std::size_t>(b) + 1);
                const std::vector<char>& own = taken[static_cast<std::size_t>(b)];
                for (; c < own.size() && own[c]; ++c)
                    again = true;
            }
        }
        for (const int b : bodies[g]) {
            std::vector<char>& own = taken[static_cast<std::size_t>(b)];
            own.resize(std::max(own.size(), c + 1), 0);
            own[c] = 1;
        }
        if (c >= colour.size()) colour.resize(c + 1);
        colour[c].push_back(g);
    }
    Colours all;
    for (const std::vector<std::size_t>& groups : colour) {
        all.colour.push_back(static_cast<int>(all.group.size()));
        for (const std::size_t g : groups) {
            all.group.push_back(static_cast<int>(all.contact.size()));
            all.contact.insert(all.contact.end(), group[g].begin(), group[g].end());
        }
    }
    all.colour.push_back(static_cast<int>(all.group.size()));
    all.group.push_back(static_cast<int>(all.contact.size()));
    return all;
}

} // namespace amontons
