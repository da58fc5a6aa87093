#pragma once

// The BLAS routines that this program calls, column-major with 32-bit sizes (interface of the
// reference BLAS), and a limit on the threads of BLAS and CHOLMOD.

/// Level 3 and level 2 BLAS, as Fortran names them.
extern "C" {
void dtrsm_(const char* side, const char* triangle, const char* transposed, const char* diagonal,
            const int* m, const int* n, const double* alpha, const double* A, const int* lda,
            double* B, const int* ldb);
void dgemm_(const char* transposed_a, const char* transposed_b, const int* m, const int* n,
            const int* k, const double* alpha, const double* A, const int* lda, const double* B,
            const int* ldb, const double* beta, double* C, const int* ldc);
void dsyrk_(const char* triangle, const char* transposed, const int* n, const int* k,
            const double* alpha, const double* A, const int* lda, const double* beta, double* C,
            const int* ldc);
void dtrsv_(const char* triangle, const char* transposed, const char* diagonal, const int* n,
            const double* A, const int* lda, double* x, const int* step);
void dgemv_(const char* transposed, const int* m, const int* n, const double* alpha,
            const double* A, const int* lda, const double* x, const int* step_x, const double* beta,
            double* y, const int* step_y);
}

namespace amontons {

/// During its lifetime OpenBLAS uses `threads` threads, and OpenMP regions of libraries one if
/// threads is 1. Both settings are of the process; other BLAS libraries keep theirs. Several
/// objects may exist at once, on several threads: the smallest number counts, and the last one's
/// end restores the setting from before the first.
class BlasThreads {
public:
    explicit BlasThreads(int threads);
    /// Tag: calls of BLAS from threads of this program, one BLAS thread for each.
    struct OneEach {};
    explicit BlasThreads(OneEach);
    ~BlasThreads();
    BlasThreads(const BlasThreads&) = delete;
    BlasThreads& operator=(const BlasThreads&) = delete;

private:
    int threads_, levels_before_ = -1;
};

} // namespace amontons
