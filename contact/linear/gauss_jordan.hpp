#pragma once

#include "contact/linear/lanes.hpp"

#include <algorithm>
#include <cmath>

// The inverse of a small dense matrix whose columns are held in vector registers.

namespace amontons {

/// In place, by Gauss-Jordan steps with row exchange.
/// @param matrix  n <= R kLanes rows, each column in R vectors
/// @return        false where a pivot is zero or not finite
template <int R> inline bool invert_by_gauss_jordan(double* matrix, int n)
{
    constexpr int stride = R * kLanes;
    int exchange[stride];
    for (int k = 0; k < n; ++k) {
        double* column = matrix + k * stride;
        int pivot = k;
        for (int i = k + 1; i < n; ++i)
            if (std::abs(column[i]) > std::abs(column[pivot])) pivot = i;
        const double inverse = 1 / column[pivot];
        if (!std::isfinite(inverse)) return false;
        exchange[k] = pivot;
        if (pivot != k)
            for (int j = 0; j < n; ++j)
                std::swap(matrix[j * stride + k], matrix[j * stride + pivot]);
        column[k] = 0;
        Lanes eliminator[R];
        for (int r = 0; r < R; ++r)
            eliminator[r] = Eigen::Map<const Lanes>(column + kLanes * r);
        // The k-th entry of the eliminator is zero. Single entries are written after the vector
        // that holds them, never shortly before it is read: that would stall.
        for (int j = 0; j < n; ++j) {
            double* other = matrix + j * stride;
            const double factor = other[k] * inverse;
            for (int r = 0; r < R; ++r)
                Eigen::Map<Lanes>(other + kLanes * r) -= eliminator[r] * factor;
            other[k] = factor;
        }
        for (int r = 0; r < R; ++r)
            Eigen::Map<Lanes>(column + kLanes * r) = eliminator[r] * -inverse;
        column[k] = inverse;
    }
    for (int k = n; k-- > 0;)
        if (exchange[k] != k)
            std::swap_ranges(matrix + k * stride, matrix + k * stride + n,
                             matrix + exchange[k] * stride);
    return true;
}

} // namespace amontons
