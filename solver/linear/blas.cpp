#include "solver/linear/blas.hpp"

#include "solver/linear/cholmod_api.hpp"

#include <dlfcn.h>
#include <mutex>
#include <set>

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
    cholmod_api();
    static const ThreadCalls found;
    return found;
}

/// Requested numbers of threads, by user: the setting is the process's.
struct Users {
    std::mutex mutex;
    std::multiset<int> requested;
    int before = 0; ///< of the first

    void enter(int threads)
    {
        const std::lock_guard lock(mutex);
        if (requested.empty()) before = calls().blas_threads();
        requested.insert(threads);
        set(*requested.begin());
    }
    void leave(int threads)
    {
        const std::lock_guard lock(mutex);
        requested.erase(requested.find(threads));
        set(requested.empty() ? before : *requested.begin());
    }

private:
    static void set(int threads)
    {
        if (calls().blas_threads() != threads) calls().set_blas_threads(threads);
    }
};

Users& users()
{
    static Users all;
    return all;
}

bool can_set()
{
    return calls().blas_threads && calls().set_blas_threads;
}

} // namespace

BlasThreads::BlasThreads(OneEach) : threads_(1)
{
    if (can_set()) users().enter(threads_);
}

BlasThreads::BlasThreads(int threads) : threads_(threads)
{
    if (can_set()) users().enter(threads_);
    // CHOLMOD requests four threads of OpenMP on any machine; with no active level it gets one.
    // This setting is of each thread that makes regions.
    if (threads == 1 && calls().levels && calls().set_levels) {
        levels_before_ = calls().levels();
        calls().set_levels(0);
    }
}

BlasThreads::~BlasThreads()
{
    if (can_set()) users().leave(threads_);
    if (levels_before_ >= 0) calls().set_levels(levels_before_);
}

} // namespace amontons
