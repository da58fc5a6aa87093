#include "mesh/base/threads.hpp"

#include <doctest/doctest.h>
#include <stdexcept>
#include <string>
#include <vector>

using namespace amontons;

TEST_CASE("every index is visited once by any number of threads")
{
    for (const int threads : {0, 1, 2, 3, 7, 64})
        for (const std::size_t count : {0u, 1u, 2u, 5u, 1000u}) {
            std::vector<int> visits(count, 0);
            share_out(threads, count, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i)
                    ++visits[i];
            });
            CHECK(visits == std::vector<int>(count, 1));
        }
}

TEST_CASE("of several failures the lowest index's comes out by any number of threads")
{
    for (const int threads : {1, 2, 3, 7}) {
        CAPTURE(threads);
        for (const std::size_t lowest : {0u, 1u, 37u, 98u}) {
            std::string what;
            try {
                share_out(threads, 100, [&](std::size_t begin, std::size_t end) {
                    for (std::size_t i = begin; i < end; ++i)
                        if (i >= lowest) throw std::runtime_error(std::to_string(i));
                });
            } catch (const std::runtime_error& error) {
                what = error.what();
            }
            CHECK(what == std::to_string(lowest));
        }
    }
}
