#include "mesh/box_tree.hpp"

#include <algorithm>
#include <doctest/doctest.h>
#include <random>

using namespace amontons;

TEST_CASE("a box tree finds each box that touches once and no other")
{
    std::mt19937 rng{5};
    std::uniform_real_distribution<double> uniform(0, 1);
    const auto random = [&](double size) {
        BoundingBox box;
        const Vec3 x{uniform(rng), uniform(rng), uniform(rng)};
        box.add(x);
        box.add(x + size * Vec3{uniform(rng), uniform(rng), uniform(rng)});
        return box;
    };
    for (const std::size_t n : {0, 1, 4, 5, 300}) {
        std::vector<BoundingBox> boxes;
        for (std::size_t i = 0; i < n; ++i)
            boxes.push_back(random(0.1));
        for (std::size_t i = 1; i < n; i += 3) // many at one place
            boxes[i] = boxes[0];
        const BoxTree tree(boxes);
        std::size_t touched = 0;
        for (int k = 0; k < 100; ++k) {
            const BoundingBox box = random(0.3);
            std::vector<std::int32_t> expected, found;
            for (std::size_t i = 0; i < n; ++i)
                if (boxes[i].touches(box)) expected.push_back(static_cast<std::int32_t>(i));
            tree.visit(box, [&](std::int32_t i) { found.push_back(i); });
            std::sort(found.begin(), found.end());
            CHECK(found == expected);
            touched += found.size();
        }
        if (n == 300) CHECK(touched > 100);
    }
}

TEST_CASE("boxes touch at a corner and an empty box touches nothing")
{
    BoundingBox a, b;
    a.add({0, 0, 0});
    a.add({1, 1, 1});
    CHECK(!a.touches(b));
    b.add({1, 1, 1});
    CHECK(a.touches(b));
    b = {};
    b.add({1, 1, std::nextafter(1.0, 2.0)});
    CHECK(!a.touches(b));
}
