#pragma once

#include "solver/linear/blas.hpp"

#include <cstddef>
#include <cstdint>

struct cholmod_common_struct;
struct cholmod_factor_struct;
struct cholmod_sparse_struct;

namespace amontons {

/// Functions of CHOLMOD and of the BLAS that it uses, loaded at the first call: linked, they would
/// add 4 ms and 5 MB to every start of the program, also for scenes without a solid, and a thread
/// for each further processor (OpenBLAS makes them when it is loaded).
struct LoadedCholmod {
    /// cholmod_start.
    int (*start)(cholmod_common_struct*);
    /// cholmod_finish.
    int (*finish)(cholmod_common_struct*);
    /// cholmod_analyze_p.
    cholmod_factor_struct* (*analyze_p)(cholmod_sparse_struct*, std::int32_t*, std::int32_t*,
                                        std::size_t, cholmod_common_struct*);
    /// cholmod_super_numeric.
    int (*super_numeric)(cholmod_sparse_struct*, cholmod_sparse_struct*, double*,
                         cholmod_factor_struct*, cholmod_common_struct*);
    /// cholmod_allocate_factor.
    cholmod_factor_struct* (*allocate_factor)(std::size_t, cholmod_common_struct*);
    /// cholmod_free_factor.
    int (*free_factor)(cholmod_factor_struct**, cholmod_common_struct*);
    /// cholmod_malloc.
    void* (*malloc)(std::size_t, std::size_t, cholmod_common_struct*);
    /// Of BLAS: triangular solve with many right-hand sides.
    decltype(&::dtrsm_) dtrsm;
    /// Of BLAS: general product.
    decltype(&::dgemm_) dgemm;
    /// Of BLAS: symmetric product.
    decltype(&::dsyrk_) dsyrk;
    /// Of BLAS: triangular solve.
    decltype(&::dtrsv_) dtrsv;
    /// Of BLAS: matrix times vector.
    decltype(&::dgemv_) dgemv;
};

/// The functions. @throws std::runtime_error  if the libraries cannot be loaded
const LoadedCholmod& cholmod_api();

} // namespace amontons
