#include "haptics/triple_buffer.hpp"

#include <atomic>
#include <doctest/doctest.h>
#include <thread>
#include <vector>

using namespace amontons;

TEST_CASE("nothing is fetched twice and the newest counts")
{
    TripleBuffer<int> buffer{7};
    CHECK_FALSE(buffer.fetch());
    CHECK(buffer.front() == 7);
    buffer.back() = 1;
    CHECK_FALSE(buffer.fetch()); // not yet published
    buffer.publish();
    buffer.back() = 2;
    buffer.publish();
    CHECK(buffer.fetch());
    CHECK(buffer.front() == 2);
    CHECK_FALSE(buffer.fetch());
    CHECK(buffer.front() == 2);
}

// Run by the tsan preset, too: there any unordered access is a failure of its own.
TEST_CASE("between two threads no value is torn and none appears twice")
{
    struct Record {
        std::vector<int> number = std::vector<int>(256, 0);
    };
    constexpr int kLast = 20'000;
    TripleBuffer<Record> buffer;
    std::thread producer([&] {
        for (int k = 1; k <= kLast; ++k) {
            for (int& x : buffer.back().number)
                x = k;
            buffer.publish();
            if (k % 64 == 0) std::this_thread::yield();
        }
    });
    int torn = 0, back = 0, last = 0, fetched = 0;
    while (last < kLast) {
        if (!buffer.fetch()) {
            std::this_thread::yield();
            continue;
        }
        const std::vector<int>& numbers = buffer.front().number;
        for (const int x : numbers)
            torn += x != numbers[0];
        back += numbers[0] <= last;
        last = numbers[0];
        ++fetched;
    }
    producer.join();
    CHECK(torn == 0);
    CHECK(back == 0);
    CHECK(fetched > 0);
}
