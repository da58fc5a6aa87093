#pragma once

// The few routines of BLAS that we call ourselves, by columns, 32-bit sizes (reference BLAS's
// interface), and how many threads BLAS and CHOLMOD may use meanwhile.

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

/// While it lives OpenBLAS uses `threads` threads, and OpenMP regions of libraries one if
/// threads is 1. Both settings belong to the process; other BLAS libraries keep theirs. Several may
/// live at once, on several threads: the least that any of them asks for counts, and what was set
/// before the first comes back with the last.
class BlasThreads {
public:
    explicit BlasThreads(int threads);
    /// For calls of BLAS from threads of our own: one each.
    struct OneEach {};
    explicit BlasThreads(OneEach);
    ~BlasThreads();
    BlasThreads(const BlasThreads&) = delete;
    BlasThreads& operator=(const BlasThreads&) = delete;

private:
    int threads_, levels_before_ = -1;
};

} // namespace amontons
