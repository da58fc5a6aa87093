#include "mesh/base/late.hpp"

#include <atomic>
#include <chrono>
#include <doctest/doctest.h>
#include <stdexcept>
#include <thread>
#include <vector>

using namespace amontons;

TEST_CASE("a late value is made when it is first used, once for all threads and copies")
{
    std::atomic<int> made{0};
    const Late<std::vector<int>> late{[&] {
        ++made;
        std::this_thread::sleep_for(std::chrono::milliseconds(20)); // all come meanwhile
        return std::vector<int>{1, 2, 3};
    }};
    const Late<std::vector<int>> copy = late;
    CHECK(made == 0);
    std::vector<const int*> seen(4);
    std::vector<std::thread> threads;
    for (const int*& data : seen)
        threads.emplace_back([&] { data = copy->data(); });
    for (std::thread& t : threads)
        t.join();
    CHECK(made == 1);
    for (const int* data : seen)
        CHECK(data == late->data());
    CHECK(*late == std::vector<int>{1, 2, 3});
}

TEST_CASE("a late value that could not be made is made when it is used again")
{
    int calls = 0;
    const Late<int> late{[&] {
        if (++calls == 1) throw std::runtime_error("not yet");
        return 7;
    }};
    CHECK_THROWS_AS(*late, std::runtime_error);
    CHECK(*late == 7);
    CHECK(*late == 7);
    CHECK(calls == 2);
}

TEST_CASE("a late value may be there from the start")
{
    const Late<double> given = 2.5;
    CHECK(*given == 2.5);
    CHECK(*Late<double>() == 0);
}
