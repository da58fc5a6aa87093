#include "solver/output/checkpoint.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"
#include "mesh/tests/temporary_folder.hpp"
#include "solver/output/history.hpp"

#include <cmath>
#include <csignal>
#include <cstdlib>
#include <doctest/doctest.h>
#include <filesystem>
#include <fstream>
#include <sys/resource.h>

using namespace amontons;

namespace {

Checkpoint example_checkpoint()
{
    Checkpoint c;
    c.scene_hash = 0x123456789abcdef0;
    c.step = 17;
    c.time = 0.1;
    c.history_bytes = 1000;
    c.history_hash = 5;
    c.frames = {{0, 0}, {10, 0.1}};
    for (int i = 0; i < 100; ++i)
        c.state.push_back(static_cast<std::byte>(i));
    return c;
}

StepRecord record(int step)
{
    StepRecord r;
    r.step = step;
    r.time = 0.1 * step;
    r.quantities = {{"depth", "m", 0.01 * step}, {"count", "", 1}};
    r.remark = step == 2 ? "a \"snap\"" : "";
    return r;
}

} // namespace

TEST_CASE("a checkpoint reads back as it was written")
{
    const Checkpoint c = example_checkpoint(),
                     d = read_checkpoint(checkpoint_bytes(c), "checkpoint");
    CHECK(d.scene_hash == c.scene_hash);
    CHECK(d.step == c.step);
    CHECK(d.time == c.time);
    CHECK(d.history_bytes == c.history_bytes);
    CHECK(d.history_hash == c.history_hash);
    CHECK(d.state == c.state);
    REQUIRE(d.frames.size() == 2);
    CHECK(d.frames[1].step == 10);
    CHECK(d.frames[1].time == 0.1);
}

TEST_CASE("a checkpoint with any byte changed or cut off is refused")
{
    const std::string good = checkpoint_bytes(example_checkpoint());
    for (std::size_t i = 0; i < good.size(); ++i) {
        std::string bad = good;
        bad[i] = static_cast<char>(bad[i] ^ 0x10);
        CHECK_THROWS_AS(read_checkpoint(bad, "c"), InputError);
        CHECK_THROWS_AS(read_checkpoint(good.substr(0, i), "c"), InputError);
    }
    CHECK_THROWS_AS(read_checkpoint(good + "x", "c"), InputError);
    CHECK_NOTHROW(read_checkpoint(good, "c"));
}

TEST_CASE("a history continues where its checkpoint was to the same bytes")
{
    const TemporaryFolder folder;
    const std::string whole = folder / "whole.csv", parts = folder / "parts.csv";
    History once;
    once.start(whole);
    for (int i = 0; i < 6; ++i)
        once.append(record(i));
    std::uint64_t bytes = 0, hash = 0;
    {
        History first;
        first.start(parts);
        for (int i = 0; i < 5; ++i) {
            if (i == 3) {
                bytes = first.bytes();
                hash = first.hash();
            }
            first.append(record(i)); // 3 and 4 come after the checkpoint
        }
    }
    std::ofstream(parts, std::ios::app) << "5,0.5,half a li"; // and a killed write
    History second;
    second.resume(parts, bytes, hash);
    for (int i = 3; i < 6; ++i)
        second.append(record(i));
    CHECK(read_file(parts) == read_file(whole));
    CHECK(second.hash() == once.hash());
    // Least and largest of each quantity count the lines from before.
    REQUIRE(once.extremes().size() == record(0).quantities.size());
    REQUIRE(second.extremes().size() == once.extremes().size());
    for (std::size_t q = 0; q < once.extremes().size(); ++q) {
        double least = HUGE_VAL, largest = -HUGE_VAL;
        for (int i = 0; i < 6; ++i) {
            least = std::min(least, record(i).quantities[q].value);
            largest = std::max(largest, record(i).quantities[q].value);
        }
        CHECK(once.extremes()[q].name == record(0).quantities[q].name);
        CHECK(second.extremes()[q].name == record(0).quantities[q].name);
        CHECK(once.extremes()[q].least == least);
        CHECK(once.extremes()[q].largest == largest);
        CHECK(second.extremes()[q].least == least);
        CHECK(second.extremes()[q].largest == largest);
    }
    // The last values are those of the last line, whoever has written it.
    History unchanged;
    unchanged.resume(parts, second.bytes(), second.hash());
    for (const History* h : {&once, &second, &unchanged}) {
        REQUIRE(h->last().size() == record(5).quantities.size());
        for (std::size_t q = 0; q < h->last().size(); ++q) {
            CHECK(h->last()[q].name == record(5).quantities[q].name);
            CHECK(h->last()[q].unit == record(5).quantities[q].unit);
            CHECK(h->last()[q].value == record(5).quantities[q].value);
        }
    }
    CHECK(read_file(whole).substr(0, 37) == "step,time [s],depth [m],count,contact");

    History third;
    CHECK_THROWS_AS(third.resume(parts, bytes, hash + 1), InputError);
    CHECK_THROWS_AS(third.resume(parts, bytes + 100000, hash), InputError);
    CHECK_THROWS_AS(third.resume(folder / "none.csv", bytes, hash), InputError);
}

TEST_CASE("a disk that is full leaves whole lines")
{
    const TemporaryFolder folder;
    const std::string file = folder / "history.csv";
    const auto old_action = std::signal(SIGXFSZ, SIG_IGN);
    rlimit old{};
    ::getrlimit(RLIMIT_FSIZE, &old);
    History history;
    history.start(file);
    history.append(record(0));
    history.append(record(1));
    rlimit small = old;
    small.rlim_cur = history.bytes() + 20; // in the middle of a line
    ::setrlimit(RLIMIT_FSIZE, &small);
    CHECK_THROWS_AS(history.append(record(2)), WriteError);
    ::setrlimit(RLIMIT_FSIZE, &old);
    std::signal(SIGXFSZ, old_action);
    const std::string text = read_file(file);
    CHECK(text.size() == history.bytes());
    CHECK(text.back() == '\n');
}
