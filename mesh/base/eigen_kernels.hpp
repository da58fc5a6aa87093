#pragma once

#include <Eigen/SparseCore>

// Functions of Eigen 3.4 that every third object would hold its own copy of, of products of
// matrices above all: a second and more to compile, each time. Eigen forbids to inline those that
// calculate, so that the digits are the same. For the precompiled header (docs/build.md): what is
// compiled with it has the flags of the libraries and is linked to amontons::mesh.

#if EIGEN_WORLD_VERSION == 3 && EIGEN_MAJOR_VERSION == 4
#define AMONTONS_EIGEN_KERNELS(EXTERN)                                                             \
    /* matrix by vector */                                                                         \
    EXTERN template struct general_matrix_vector_product<                                          \
        Index, double, Reader<RowMajor>, RowMajor, false, double, Reader<ColMajor>, false>;        \
    EXTERN template struct general_matrix_vector_product<                                          \
        Index, double, Reader<ColMajor>, ColMajor, false, double, Reader<RowMajor>, false>;        \
    EXTERN template struct general_matrix_vector_product<                                          \
        Index, double, Reader<ColMajor>, ColMajor, false, double, Reader<ColMajor>, false>;        \
    /* matrix by matrix */                                                                         \
    EXTERN template struct gebp_kernel<double, double, Index, blas_data_mapper<double, Index, 0>,  \
                                       Sizes::mr, Sizes::nr, false, false>;                        \
    EXTERN template struct gemm_pack_lhs<double, Index, Reader<ColMajor>, Sizes::mr,               \
                                         Sizes::LhsProgress, Sizes::LhsPacket4Packing, ColMajor>;  \
    EXTERN template struct gemm_pack_lhs<double, Index, Reader<RowMajor>, Sizes::mr,               \
                                         Sizes::LhsProgress, Sizes::LhsPacket4Packing, RowMajor>;  \
    EXTERN template struct gemm_pack_rhs<double, Index, Reader<ColMajor>, Sizes::nr, ColMajor>;    \
    EXTERN template struct gemm_pack_rhs<double, Index, Reader<RowMajor>, Sizes::nr, RowMajor>;    \
    EXTERN template struct general_matrix_matrix_product<Index, double, ColMajor, false, double,   \
                                                         ColMajor, false, ColMajor, 1>;            \
    EXTERN template struct general_matrix_matrix_product<Index, double, RowMajor, false, double,   \
                                                         ColMajor, false, ColMajor, 1>;            \
    EXTERN template struct general_matrix_matrix_product<Index, double, ColMajor, false, double,   \
                                                         RowMajor, false, ColMajor, 1>;            \
    EXTERN template void evaluateProductBlockingSizesHeuristic<double, double, 1, Index>(          \
        Index&, Index&, Index&, Index);                                                            \
    EXTERN template void evaluateProductBlockingSizesHeuristic<double, double, 4, Index>(          \
        Index&, Index&, Index&, Index);                                                            \
    /* copies */                                                                                   \
    EXTERN template void assign_sparse_to_sparse(SparseMatrix<double>&, const SparseMatrix<double>&)

namespace Eigen::internal {

/// Of a matrix.
template <int order> using Reader = const_blas_data_mapper<double, Index, order>;
/// Of the blocks of products.
using Sizes = gebp_traits<double, double>;
/// They are in eigen_kernels.cpp.
AMONTONS_EIGEN_KERNELS(extern);

} // namespace Eigen::internal
#else
#define AMONTONS_EIGEN_KERNELS(EXTERN) static_assert(true)
#endif
