#include "solver/linear/blas.hpp"

#include "mesh/tests/test_program.hpp"
#include "solver/linear/cholmod_api.hpp"

#include <atomic>
#include <dlfcn.h>
#include <doctest/doctest.h>
#include <thread>
#include <vector>

using namespace amontons;

TEST_CASE(
    "users of BLAS on several threads get the smallest number requested and restore what was set")
{
    cholmod_api(); // opens it
    const auto get = reinterpret_cast<int (*)()>(dlsym(RTLD_DEFAULT, "openblas_get_num_threads"));
    const auto set =
        reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT, "openblas_set_num_threads"));
    if (!get || !set) {
        skip_test("the BLAS here is not OpenBLAS (libopenblas0)");
        return;
    }
    set(2);
    {
        const BlasThreads first(2);
        CHECK(get() == 2);
        {
            const BlasThreads inner{BlasThreads::OneEach{}};
            CHECK(get() == 1);
            std::vector<std::thread> threads;
            std::atomic<int> others{0};
            for (int k = 0; k < 4; ++k)
                threads.emplace_back([&, k] {
                    for (int i = 0; i < 200; ++i) {
                        const BlasThreads mine(1 + k % 2);
                        if (get() != 1) ++others;
                    }
                });
            for (std::thread& t : threads)
                t.join();
            CHECK(others == 0);
            CHECK(get() == 1);
        }
        CHECK(get() == 2);
    }
    CHECK(get() == 2);
    std::vector<std::thread> threads; // whoever comes first and is last
    for (int k = 0; k < 4; ++k)
        threads.emplace_back([] {
            for (int i = 0; i < 200; ++i)
                const BlasThreads mine(1);
        });
    for (std::thread& t : threads)
        t.join();
    CHECK(get() == 2);
    set(1);
}
