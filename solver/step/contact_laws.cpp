#include "solver/step/body_build.hpp"

#include <algorithm>
#include <unordered_map>
#include <unordered_set>

// Contact laws with "*" written out: of thousands of bodies there are millions of pairs, and the
// work for each of them must not depend on their number.

namespace amontons {
namespace {

/// What the pairs of a body depend on.
struct Member {
    bool still = false, rod = false, free_rigid = false;
};

std::vector<Member> members(const Scene& scene,
                            const std::unordered_map<std::string, std::size_t>& number)
{
    std::vector<Member> out(scene.order.size());
    const auto at = [&](const std::string& name) -> Member& { return out[number.at(name)]; };
    for (const ObstacleInput& o : scene.obstacles)
        at(o.name).still = true;
    for (const RigidInput& r : scene.rigids)
        (r.drive.given ? at(r.name).still : at(r.name).free_rigid) = true;
    for (const RodInput& r : scene.rods)
        at(r.name).rod = true;
    return out;
}

} // namespace

std::vector<ContactLaw> written_out(const Scene& scene, const ContactLaw** rest)
{
    const std::size_t n = scene.order.size();
    std::unordered_map<std::string, std::size_t> number;
    for (std::size_t i = 0; i < n; ++i)
        number.emplace(scene.order[i], i);
    const std::vector<Member> body = members(scene, number);
    std::vector<ContactLaw> laws;
    std::unordered_set<std::size_t> named; // lower number * n + higher
    const auto is_first = [&](std::size_t i, std::size_t j) {
        return named.insert(std::min(i, j) * n + std::max(i, j)).second;
    };
    const auto is_star = [](const std::string& name) { return name == "*"; };
    for (const ContactLaw& law : scene.contact)
        if (std::ranges::none_of(law.between, is_star)) {
            laws.push_back(law);
            is_first(number.at(law.between[0]), number.at(law.between[1]));
        }
    for (const ContactLaw& law : scene.contact) {
        const auto stars = std::ranges::count_if(law.between, is_star);
        if (stars == 0) continue;
        const std::string& other = law.between[is_star(law.between[0]) ? 1 : 0];
        const auto add = [&](std::size_t i, std::size_t j) {
            const Member &a = body[i], &b = body[j];
            if (i == j && !a.rod) return; // solids touch themselves only where named
            if (a.still && b.still) return;
            if (rest && *rest && a.free_rigid && b.free_rigid) return;
            if (!is_first(i, j)) return;
            laws.push_back(law);
            laws.back().between = {scene.order[i], scene.order[j]};
        };
        if (stars == 1) {
            const std::size_t k = number.at(other);
            for (std::size_t i = 0; i < n; ++i)
                add(std::min(i, k), std::max(i, k));
            continue;
        }
        if (rest && !*rest) *rest = &law;
        const auto left_out = [&](std::size_t i) { return rest && body[i].free_rigid; };
        std::vector<std::size_t> others; // other bodies of the pairs left out here
        for (std::size_t i = 0; i < n; ++i)
            if (!left_out(i)) others.push_back(i);
        for (std::size_t i = 0; i < n; ++i)
            if (left_out(i)) {
                for (auto j = std::ranges::upper_bound(others, i); j != others.end(); ++j)
                    add(i, *j);
            } else {
                for (std::size_t j = i; j < n; ++j)
                    add(i, j);
            }
    }
    return laws;
}

} // namespace amontons
