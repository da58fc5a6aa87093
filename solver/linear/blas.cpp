#include "solver/linear/blas.hpp"

#include "solver/linear/late.hpp"

#include <dlfcn.h>

namespace amontons {
namespace {

// Which BLAS is behind libblas.so.3 is known only when the program runs.
template <class Function> Function* loaded(const char* name)
{
    return reinterpret_cast<Function*>(dlsym(RTLD_DEFAULT, name));
}

struct ThreadCalls {
    int (*blas_threads)() = loaded<int()>("openblas_get_num_threads");
    void (*set_blas_threads)(int) = loaded<void(int)>("openblas_set_num_threads");
    int (*levels)() = loaded<int()>("omp_get_max_active_levels");
    void (*set_levels)(int) = loaded<void(int)>("omp_set_max_active_levels");
};

const ThreadCalls& calls()
{
    late();
    static const ThreadCalls found;
    return found;
}

} // namespace

void BlasThreads::set_blas_(int threads)
{
    if (!calls().blas_threads || !calls().set_blas_threads) return;
    const int before = calls().blas_threads();
    if (before == threads) return;
    calls().set_blas_threads(threads);
    blas_before_ = before;
}

BlasThreads::BlasThreads(OneEach)
{
    set_blas_(1);
}

BlasThreads::BlasThreads(int threads)
{
    set_blas_(threads);
    // CHOLMOD asks OpenMP for four threads whatever the machine; with no active level it gets one.
    if (threads == 1 && calls().levels && calls().set_levels) {
        levels_before_ = calls().levels();
        calls().set_levels(0);
    }
}

BlasThreads::~BlasThreads()
{
    if (blas_before_ > 0) calls().set_blas_threads(blas_before_);
    if (levels_before_ >= 0) calls().set_levels(levels_before_);
}

} // namespace amontons
