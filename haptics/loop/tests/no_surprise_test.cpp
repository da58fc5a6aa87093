#include "haptics/loop/proxy_loop.hpp"
#include "haptics/tests/count_allocations.hpp"
#include "haptics/tests/scenes.hpp"
#include "haptics/triple_buffer.hpp"
#include "mesh/tests/test_program.hpp"

#include <doctest/doctest.h>

#if defined(__linux__)
#include <Eigen/Core>
#include <linux/seccomp.h>
#include <mutex>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>
#endif

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define AMONTONS_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define AMONTONS_SANITIZED 1
#endif
#endif

#if defined(__linux__) && !defined(AMONTONS_SANITIZED)
#include "haptics/tests/count_locks.hpp"
#include "mesh/tests/test_program.hpp"
#endif

using namespace amontons;
using namespace amontons::test;

// What must not happen between device and force: memory taken from the heap, locks, and calls to
// the system. The first two are counted in malloc and the locks of this whole test program; the
// last is forbidden by the kernel itself, which kills the process that tries.

namespace {

struct Run {
    Bed bed;
    TripleBuffer<ReducedOperator<float>> buffer{ReducedOperator<float>(60)};
    ReducedOperator<float> first{60}, second{60};
    ProxyLoop<float> loop{60};

    Run()
    {
        bed.points = grid(60, 5e-3);
        bed.shear = 2e4;
        publish(first, bed, {{0, 0, -0.001}, Eigen::Quaterniond::Identity()}, 0, 1);
        bed.points.resize(50);
        publish(second, bed, {{0.001, 0, -0.001}, turn({0, 0.01, 0})}, 0.02, 2);
        // A fall that is predicted, within the operator's ticks, and samples on the path to it.
        const ReducedOperator<float> fallen = first;
        for (ReducedOperator<float>* op : {&first, &second}) { // the same memory: copies take none
            op->after.push_back(fallen);
            op->way.emplace_back().bend.assign(60 * kMostPathSamples, Vec3(1e-5, 0, 0));
        }
        second.ways = 1;
        second.way[0].ahead << 1e3, 0, 0, 0, 0, 0;
        second.way[0].samples = 1;
        second.way[0].at[0] = 1;
        second.jump_at = 2;
        for (int slot = 0; slot < 3; ++slot) {
            buffer.back() = second;
            buffer.publish();
            buffer.fetch();
        }
    }

    /// 100 ticks, an operator handed over every 10. @returns the sum of normal forces [N]
    double ticks()
    {
        double sum = 0;
        for (int k = 0; k < 100; ++k) {
            if (k % 10 == 0) { // what a publisher does, too, once it has its operator
                buffer.back() = k % 20 ? second : first;
                buffer.publish();
            }
            if (buffer.fetch()) loop.take(buffer.front(), 1e-3 * k);
            sum += loop.tick({{1e-4 * k, 0, -0.002}, turn({0, 1e-3 * k, 0})}, 1e-3 * k)
                       .wrench.force[2];
        }
        return sum;
    }
};

} // namespace

TEST_CASE("ticks and hand-overs allocate nothing")
{
    Run run;
    const long before = allocations;
    const double sum = run.ticks();
    const long after = allocations;
    CHECK(after == before);
    CHECK(sum > 1);
    const ReducedOperator<float> copy = run.first; // the counter works
    const long copied = allocations;
    CHECK(copied > after);
}

TEST_CASE("the counter of allocations counts those of Eigen, which calls malloc")
{
#if defined(__GLIBC__) && !defined(AMONTONS_SANITIZED)
    const long before = allocations;
    const Eigen::VectorXd some = Eigen::VectorXd::Ones(100);
    const long after = allocations;
    CHECK(some.sum() == 100);
    CHECK(after > before);
#else
    skip_test("no malloc to count in: a sanitizer or another library than glibc has its own");
#endif
}

TEST_CASE("ticks and hand-overs take no lock at all even if it is free")
{
#if defined(__linux__) && !defined(AMONTONS_SANITIZED)
    Run run;
    const long before = locks;
    const double sum = run.ticks();
    const long after = locks;
    CHECK(after == before);
    CHECK(sum > 1);
    std::mutex free;
    {
        const std::lock_guard held(free); // the counter works
    }
    const long held = locks;
    CHECK(held > after);
#else
    skip_test("no locks to count: a sanitizer or another system than Linux has its own");
#endif
}

TEST_CASE("ticks and hand-overs make no system call")
{
#if defined(__linux__) && !defined(AMONTONS_SANITIZED)
    // In a child where the kernel allows read, write and exit, and kills for anything else.
    const auto child = [](bool misbehave) {
        Run run;
        const pid_t pid = fork();
        if (pid == 0) {
            if (prctl(PR_SET_SECCOMP, SECCOMP_MODE_STRICT) != 0) _exit(kSkipped);
            const double sum = run.ticks();
            if (misbehave) syscall(SYS_getppid);
            syscall(SYS_exit, sum > 1 ? 0 : 1);
        }
        int status = 0;
        waitpid(pid, &status, 0);
        return status;
    };
    const int status = child(false);
    if (WIFEXITED(status) && WEXITSTATUS(status) == kSkipped) {
        skip_test("no seccomp: the kernel, or the container, does not allow a process to forbid "
                  "itself calls");
        return;
    }
    REQUIRE(WIFEXITED(status));
    CHECK(WEXITSTATUS(status) == 0);
    CHECK(WIFSIGNALED(child(true))); // the guard works
#else
    skip_test("no seccomp: a sanitizer makes calls of its own, other systems than Linux have none");
#endif
}
