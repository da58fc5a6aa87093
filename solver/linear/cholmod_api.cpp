#include "solver/linear/cholmod_api.hpp"

#include <cholmod.h>
#include <dlfcn.h>
#include <stdexcept>
#include <string>
#include <type_traits>

namespace amontons {
namespace {

static_assert(
    std::is_same_v<decltype(LoadedCholmod::start), decltype(&::cholmod_start)> &&
    std::is_same_v<decltype(LoadedCholmod::finish), decltype(&::cholmod_finish)> &&
    std::is_same_v<decltype(LoadedCholmod::analyze_p), decltype(&::cholmod_analyze_p)> &&
    std::is_same_v<decltype(LoadedCholmod::super_numeric), decltype(&::cholmod_super_numeric)> &&
    std::is_same_v<decltype(LoadedCholmod::allocate_factor),
                   decltype(&::cholmod_allocate_factor)> &&
    std::is_same_v<decltype(LoadedCholmod::free_factor), decltype(&::cholmod_free_factor)> &&
    std::is_same_v<decltype(LoadedCholmod::malloc), decltype(&::cholmod_malloc)>);

template <class Function> void find(void* library, const char* name, Function*& function)
{
    function = reinterpret_cast<Function*>(::dlsym(library, name));
    if (!function) throw std::runtime_error(std::string(AMONTONS_CHOLMOD_FILE " has no ") + name);
}

LoadedCholmod opened()
{
    // With its BLAS, whose names are then found among all: BlasThreads determines which one it is. Its
    // thousands of functions are bound where they are first called: all at once takes 3 ms.
    void* const library = ::dlopen(AMONTONS_CHOLMOD_FILE, RTLD_LAZY | RTLD_GLOBAL);
    if (!library) {
        const char* reason = ::dlerror();
        throw std::runtime_error(std::string("solids need " AMONTONS_CHOLMOD_FILE ": ") +
                                 (reason ? reason : "it cannot be loaded"));
    }
    LoadedCholmod l{};
    find(library, "cholmod_start", l.start);
    find(library, "cholmod_finish", l.finish);
    find(library, "cholmod_analyze_p", l.analyze_p);
    find(library, "cholmod_super_numeric", l.super_numeric);
    find(library, "cholmod_allocate_factor", l.allocate_factor);
    find(library, "cholmod_free_factor", l.free_factor);
    find(library, "cholmod_malloc", l.malloc);
    find(library, "dtrsm_", l.dtrsm);
    find(library, "dgemm_", l.dgemm);
    find(library, "dsyrk_", l.dsyrk);
    find(library, "dtrsv_", l.dtrsv);
    find(library, "dgemv_", l.dgemv);
    return l;
}

} // namespace

const LoadedCholmod& cholmod_api()
{
    static const LoadedCholmod libraries = opened();
    return libraries;
}

} // namespace amontons
