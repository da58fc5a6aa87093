#include "contact/linear/dense_lu.hpp"

#include "contact/linear/gauss_jordan.hpp"

#include <algorithm>
#include <cmath>

// Right-looking, kWidth columns at a time:
//
//      [ D  U ]      D is inverted in registers, with row exchange; L D^-1 and what it takes from
//      [ L  A ]      A are products by tiles held in registers.

namespace amontons {
namespace {

constexpr int kVectors = 24 / kLanes; ///< of a diagonal block's column
constexpr int kWidth = 24;            ///< columns eliminated at once
constexpr int kWideBlock = 96;        ///< columns, a multiple of kWidth, that are ...
constexpr int kSmall = 500; ///< ... eliminated at once where there are more rows than that
constexpr int kTileVectors = 3, kTileColumns = kLanes == 8 ? 8 : 4; // of 32 or 16 registers
constexpr std::ptrdiff_t kStrip = kTileVectors * kLanes;

using Panel = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

/// C -= A B: one tile of R vectors and N columns.
template <int R, int N>
inline void subtract_tile(const double* a, std::ptrdiff_t a_stride, const double* b,
                          std::ptrdiff_t b_stride, double* c, std::ptrdiff_t c_stride, int depth)
{
    Lanes tile[N][R];
    for (int j = 0; j < N; ++j)
        for (int r = 0; r < R; ++r)
            tile[j][r] = Eigen::Map<const Lanes>(c + j * c_stride + kLanes * r);
    for (int k = 0; k < depth; ++k, a += a_stride) {
        Lanes column[R];
        for (int r = 0; r < R; ++r)
            column[r] = Eigen::Map<const Lanes>(a + kLanes * r);
        for (int j = 0; j < N; ++j)
            for (int r = 0; r < R; ++r)
                tile[j][r] -= column[r] * b[k + j * b_stride];
    }
    for (int j = 0; j < N; ++j)
        for (int r = 0; r < R; ++r)
            Eigen::Map<Lanes>(c + j * c_stride + kLanes * r) = tile[j][r];
}

template <int R>
void subtract_rows(const double* a, std::ptrdiff_t a_stride, const double* b,
                   std::ptrdiff_t b_stride, double* c, std::ptrdiff_t c_stride, int columns,
                   int depth)
{
    int j = 0;
    for (; j + kTileColumns <= columns; j += kTileColumns)
        subtract_tile<R, kTileColumns>(a, a_stride, b + j * b_stride, b_stride, c + j * c_stride,
                                       c_stride, depth);
    for (; j < columns; ++j)
        subtract_tile<R, 1>(a, a_stride, b + j * b_stride, b_stride, c + j * c_stride, c_stride,
                            depth);
}

/// C -= A B. @param rows  whole vectors
void subtract_product(const double* a, std::ptrdiff_t a_stride, const double* b,
                      std::ptrdiff_t b_stride, double* c, std::ptrdiff_t c_stride,
                      std::ptrdiff_t rows, int columns, int depth)
{
    std::ptrdiff_t i = 0;
    for (; i + kTileVectors * kLanes <= rows; i += kTileVectors * kLanes)
        subtract_rows<kTileVectors>(a + i, a_stride, b, b_stride, c + i, c_stride, columns, depth);
    for (; i < rows; i += kLanes)
        subtract_rows<1>(a + i, a_stride, b, b_stride, c + i, c_stride, columns, depth);
}

/// Rows of A in strips that lie one after another, as tiles read them.
void pack(const double* a, std::ptrdiff_t a_stride, std::ptrdiff_t rows, int depth, double* packed)
{
    for (std::ptrdiff_t i = 0; i < rows; i += kStrip) {
        const std::ptrdiff_t height = std::min<std::ptrdiff_t>(kStrip, rows - i);
        for (int k = 0; k < depth; ++k, packed += height)
            std::copy_n(a + i + k * a_stride, height, packed);
    }
}

/// C -= A B with A packed: columns of B and C one group after another, for where neither stays in
/// the cache.
void subtract_packed(const double* packed, const double* b, std::ptrdiff_t b_stride, double* c,
                     std::ptrdiff_t c_stride, std::ptrdiff_t rows, int columns, int depth)
{
    for (int j = 0; j < columns; j += kTileColumns) {
        const int width = std::min(kTileColumns, columns - j);
        const double* strip = packed;
        for (std::ptrdiff_t i = 0; i < rows; i += kStrip) {
            const std::ptrdiff_t height = std::min<std::ptrdiff_t>(kStrip, rows - i);
            subtract_product(strip, height, b + j * b_stride, b_stride, c + i + j * c_stride,
                             c_stride, height, width, depth);
            strip += height * depth;
        }
    }
}

} // namespace

void DenseLu::open(int rows)
{
    rows_ = rows;
    stride_ = (rows + kLanes - 1) / kLanes * kLanes;
    // An odd number of vectors: columns of a power of two would touch in the same lines of the
    // cache.
    if (stride_ / kLanes % 2 == 0) stride_ += kLanes;
    const auto size = static_cast<std::size_t>(stride_ * rows);
    if (value_.size() < size) value_.resize(size);
    const auto panel = static_cast<std::size_t>(stride_ * kWidth);
    if (panel_.size() < panel) panel_.resize(panel);
    for (int j = 0; j < rows; ++j)
        std::fill(column(j) + rows, column(j) + stride_, 0.0);
}

bool DenseLu::factorise()
{
    // Small blocks within large ones: what a large one takes from the rest is read and written
    // once.
    const int large = rows_ > kSmall ? kWideBlock : rows_;
    for (int k = 0; k < rows_; k += large) {
        const int end = std::min(rows_, k + large);
        if (!factorise_block(k, end)) return false;
        if (end == rows_) break;
        // U of the large block: each of its rows depends on those above.
        for (int i = k; i < end; i += kWidth) {
            const int width = std::min(kWidth, end - i);
            subtract_product(column(i) + i + width, stride_, column(end) + i, stride_,
                             column(end) + i + width, stride_, end - i - width, rows_ - end, width);
        }
        packed_.resize(static_cast<std::size_t>((stride_ - end) * (end - k)));
        pack(column(k) + end, stride_, stride_ - end, end - k, packed_.data());
        subtract_packed(packed_.data(), column(end) + k, stride_, column(end) + end, stride_,
                        stride_ - end, rows_ - end, end - k);
    }
    return true;
}

/// Columns begin .. end - 1, all their rows from begin on.
bool DenseLu::factorise_block(int begin, int end)
{
    alignas(64) double diagonal[kWidth * kWidth], negative[kWidth * kWidth];
    for (int k = begin; k < end; k += kWidth) {
        const int width = std::min(kWidth, end - k);
        std::fill(std::begin(diagonal), std::end(diagonal), 0.0);
        for (int j = 0; j < width; ++j)
            std::copy_n(column(k + j) + k, width, diagonal + kWidth * j);
        if (!invert_by_gauss_jordan<kVectors>(diagonal, width)) return false;
        for (int j = 0; j < width; ++j)
            std::copy_n(diagonal + kWidth * j, width, column(k + j) + k);
        if (k + width == rows_) break;

        double* const below = column(k) + k + width;
        const std::ptrdiff_t rest = stride_ - (k + width);
        std::transform(std::begin(diagonal), std::end(diagonal), negative, std::negate<>());
        std::fill_n(panel_.begin(), stride_ * width, 0.0);
        subtract_product(below, stride_, negative, kWidth, panel_.data(), stride_, rest, width,
                         width);
        for (int j = 0; j < width; ++j)
            std::copy_n(panel_.data() + j * stride_, rest, below + j * stride_);
        double* const right = column(k + width) + k;
        subtract_product(below, stride_, right, stride_, right + width, stride_, rest,
                         end - k - width, width);
    }
    return true;
}

void DenseLu::solve(Eigen::VectorXd& x) const
{
    const auto panel = [&](int row, int column, int rows, int columns) {
        return Panel(value_.data() + column * stride_ + row, rows, columns,
                     Eigen::OuterStride<>(stride_));
    };
    for (int k = 0; k + kWidth < rows_; k += kWidth) {
        const int rest = rows_ - k - kWidth;
        x.tail(rest).noalias() -= panel(k + kWidth, k, rest, kWidth) * x.segment<kWidth>(k);
    }
    for (int k = (rows_ - 1) / kWidth * kWidth; k >= 0 && rows_ > 0; k -= kWidth) {
        const int width = std::min(kWidth, rows_ - k);
        const Eigen::VectorXd own = panel(k, k, width, width) * x.segment(k, width);
        x.segment(k, width) = own;
        x.head(k).noalias() -= panel(0, k, k, width) * own;
    }
}

} // namespace amontons
