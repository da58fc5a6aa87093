#include "contact/linear/block_lu.hpp"

#include "contact/linear/block_lu_sizes.hpp"
#include "contact/linear/gauss_jordan.hpp"

#include <algorithm>
#include <cmath>

// The supernodal left-looking factorisation. Supernode S of w block columns has m block rows R below:
//
//      [ D_S   U_S ]        D_S: 3w x 3w, inverted (or factorised) with pivoting inside
//      [ L_S    .  ]        kept: D_S^-1, L_S D_S^-1 and U_S^T, the last two of one shape
//
// Every descendant d with rows in S first gives A(R_d, S) -= (L D^-1)_d(R_d) U_d(:, S) and the
// same transposed for U_S^T: a product of two thin panels, A B^T, scattered by block rows. Small
// products pass through kernels whose tile of results stays in vector registers, large ones through
// Eigen's, which packs. Which columns are joined: block_lu_analysis.cpp.

namespace amontons {
namespace {

using namespace block_lu;
constexpr int kFewBlocks = 2; // up to here, tiles are not faster
constexpr int kLanesOfNarrow = (3 * kNarrow + kLanes - 1) / kLanes;
constexpr double kLargeProduct = 1.5e5; // multiplications from which Eigen's product is faster

// ---- kernels

/// c[j] = rows of a times row j of b, transposed: 3 columns of R vectors; depth columns of a and b.
template <int R>
inline void multiply(const double* a, std::ptrdiff_t a_stride, const double* b,
                     std::ptrdiff_t b_stride, int depth, double* product)
{
    Lanes c[3][R];
    for (int j = 0; j < 3; ++j)
        for (int r = 0; r < R; ++r)
            c[j][r].setZero();
    for (int k = 0; k < depth; ++k, a += a_stride, b += b_stride)
        for (int r = 0; r < R; ++r) {
            const Lanes value = Eigen::Map<const Lanes>(a + kLanes * r);
            for (int j = 0; j < 3; ++j)
                c[j][r] += value * b[j];
        }
    for (int j = 0; j < 3; ++j)
        for (int r = 0; r < R; ++r)
            Eigen::Map<Lanes>(product + kTileRows * j + kLanes * r) = c[j][r];
}

/// One tile: `blocks` <= kTileBlocks block rows; product is kTileRows x 3.
inline void multiply_tile(int blocks, const double* a, std::ptrdiff_t a_stride, const double* b,
                          std::ptrdiff_t b_stride, int depth, double* product)
{
    const int vectors = (3 * blocks + kLanes - 1) / kLanes;
    if (vectors == 1)
        multiply<1>(a, a_stride, b, b_stride, depth, product);
    else if (vectors == 2)
        multiply<2>(a, a_stride, b, b_stride, depth, product);
    else
        multiply<3>(a, a_stride, b, b_stride, depth, product);
}

/// target -= a b^T: one block, from panels of one block column.
inline void subtract_block(const double* a, std::ptrdiff_t a_stride, const double* b,
                           std::ptrdiff_t b_stride, double* target, std::ptrdiff_t stride)
{
    using Lane = Eigen::Map<const Eigen::Array4d>;
    // The fourth entry is unused; kSlack makes it readable.
    const Eigen::Array4d first = Lane(a), second = Lane(a + a_stride),
                         third = Lane(a + 2 * a_stride);
    for (int c = 0; c < 3; ++c, target += stride) {
        const Eigen::Array4d product =
            first * b[c] + second * b[b_stride + c] + third * b[2 * b_stride + c];
        for (int r = 0; r < 3; ++r)
            target[r] -= product[r];
    }
}

/// Block rows i of product run from block rows at[i] of target: three columns.
inline void subtract_blocks(int blocks, const double* product, std::ptrdiff_t product_stride,
                            const int* at, double* target, std::ptrdiff_t stride)
{
    for (int i = 0; i < blocks;) {
        int end = i + 1;
        while (end < blocks && at[end] == at[end - 1] + 1)
            ++end;
        const double* from = product + 3 * i;
        double* to = target + 3 * at[i];
        for (int j = 0; j < 3; ++j, from += product_stride, to += stride) {
            if (end - i == 1)
                for (int a = 0; a < 3; ++a)
                    to[a] -= from[a];
            else
                for (int a = 0; a < 3 * (end - i); ++a)
                    to[a] -= from[a];
        }
        i = end;
    }
}

} // namespace

void BlockLu::clear()
{
    value_.assign(values_, 0);
    inverse_.resize(inverses_);
}

BlockLu::Place BlockLu::place(int i, int j) const
{
    const int row = place_[size(i)], column = place_[size(j)];
    const Supernode& s = supernodes_[size(supernode_of_[size(std::min(row, column))])];
    const int left = std::min(row, column), lower = std::max(row, column);
    if (lower < s.first + s.width) {
        const std::size_t stride = size(s.lower_stride());
        return {s.panel + 3 * (size(row - s.first) + stride * size(column - s.first)), 1,
                s.lower_stride()};
    }
    const auto begin = row_.begin() + static_cast<std::ptrdiff_t>(s.row);
    const std::size_t below =
        size(static_cast<int>(std::lower_bound(begin, begin + s.below, lower) - begin));
    if (row > column)
        return {s.lower() + 3 * (below + size(s.lower_stride()) * size(left - s.first)), 1,
                s.lower_stride()};
    return {s.upper() + 3 * (below + size(s.upper_stride()) * size(left - s.first)),
            s.upper_stride(), 1};
}

// ---- factor

void BlockLu::apply(const Update& update, const Supernode& target)
{
    const Supernode& s = supernodes_[size(update.source)];
    const int* rows = row_.data() + s.row;
    const double* lower = value_.data() + s.lower();
    const double* upper = value_.data() + s.upper();
    const std::ptrdiff_t lower_stride = s.lower_stride(), upper_stride = s.upper_stride();
    const std::ptrdiff_t target_lower_stride = target.lower_stride(),
                         target_upper_stride = target.upper_stride();
    double* const target_lower = value_.data() + target.panel;
    // at_ counts from the top of [D; L]: so that U^T begins `width` block rows earlier.
    double* const target_upper = value_.data() + target.upper() - 3 * target.width;
    const int depth = 3 * s.width;
    const int columns = update.end - update.begin, all = s.below - update.begin;

    if (s.width == 1 && all <= kFewBlocks) {
        for (int j = update.begin; j < update.end; ++j) {
            const int column = at_[size(rows[j])];
            for (int i = update.begin; i < s.below; ++i)
                subtract_block(lower + 3 * i, lower_stride, upper + 3 * j, upper_stride,
                               target_lower +
                                   3 * (target_lower_stride * column + at_[size(rows[i])]),
                               target_lower_stride);
            for (int i = update.end; i < s.below; ++i)
                subtract_block(upper + 3 * i, upper_stride, lower + 3 * j, lower_stride,
                               target_upper +
                                   3 * (target_upper_stride * column + at_[size(rows[i])]),
                               target_upper_stride);
        }
        return;
    }
    int* const at = part_at_.data();
    for (int i = update.begin; i < s.below; ++i)
        at[i] = at_[size(rows[i])];

    if (27.0 * columns * all * s.width > kLargeProduct && columns > 2) {
        using Panel = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
        const auto part = [&](const double* from, std::ptrdiff_t stride, int begin, int end) {
            return Panel(from + 3 * begin, 3 * (end - begin), depth, Eigen::OuterStride<>(stride));
        };
        Eigen::Map<Eigen::MatrixXd> product(scratch_.data(), 3 * all, 3 * columns);
        product.noalias() = part(lower, lower_stride, update.begin, s.below) *
                            part(upper, upper_stride, update.begin, update.end).transpose();
        for (int j = 0; j < columns; ++j)
            subtract_blocks(all, scratch_.data() + 9 * all * j, 3 * all, at + update.begin,
                            target_lower + 3 * target_lower_stride * at[update.begin + j],
                            target_lower_stride);
        if (update.end == s.below) return;
        const int rest = s.below - update.end;
        Eigen::Map<Eigen::MatrixXd> other(scratch_.data(), 3 * rest, 3 * columns);
        other.noalias() = part(upper, upper_stride, update.end, s.below) *
                          part(lower, lower_stride, update.begin, update.end).transpose();
        for (int j = 0; j < columns; ++j)
            subtract_blocks(rest, scratch_.data() + 9 * rest * j, 3 * rest, at + update.end,
                            target_upper + 3 * target_upper_stride * at[update.begin + j],
                            target_upper_stride);
        return;
    }
    alignas(64) double tile[3 * kTileRows];
    for (int j = update.begin; j < update.end; ++j) {
        double* const lower_column = target_lower + 3 * target_lower_stride * at[j];
        for (int i = update.begin; i < s.below; i += kTileBlocks) {
            const int blocks = std::min(kTileBlocks, s.below - i);
            multiply_tile(blocks, lower + 3 * i, lower_stride, upper + 3 * j, upper_stride, depth,
                          tile);
            subtract_blocks(blocks, tile, kTileRows, at + i, lower_column, target_lower_stride);
        }
        double* const upper_column = target_upper + 3 * target_upper_stride * at[j];
        for (int i = update.end; i < s.below; i += kTileBlocks) {
            const int blocks = std::min(kTileBlocks, s.below - i);
            multiply_tile(blocks, upper + 3 * i, upper_stride, lower + 3 * j, lower_stride, depth,
                          tile);
            subtract_blocks(blocks, tile, kTileRows, at + i, upper_column, target_upper_stride);
        }
    }
}

/// The diagonal block: inverted, or factorised if nothing is below it.
bool BlockLu::invert(const Supernode& s)
{
    const int size3 = 3 * s.width;
    const Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>> diagonal(
        value_.data() + s.panel, size3, size3, Eigen::OuterStride<>(s.lower_stride()));
    if (s.width > kNarrow) {
        Eigen::PartialPivLU<Eigen::MatrixXd>& lu = dense_[size(s.dense)];
        lu.compute(diagonal);
        const auto pivots = lu.matrixLU().diagonal().array();
        if (!pivots.isFinite().all() || (pivots == 0).any()) return false;
        if (s.below > 0)
            Eigen::Map<Eigen::MatrixXd>(inverse_.data() + s.inverse, size3, size3) = lu.inverse();
        return true;
    }
    if (s.width == 1) {
        const Mat3 block = diagonal.topLeftCorner<3, 3>();
        Mat3 result;
        double determinant = 0;
        bool regular = false;
        block.computeInverseAndDetWithCheck(result, determinant, regular, 0);
        Eigen::Map<Mat3>(inverse_.data() + s.inverse) = result;
        return regular && result.allFinite();
    }
    Eigen::Map<Eigen::MatrixXd> inverse(inverse_.data() + s.inverse, size3, size3);
    alignas(64) double work[3 * kNarrow * kLanes * kLanesOfNarrow];
    const int vectors = (size3 + kLanes - 1) / kLanes;
    for (int j = 0; j < size3; ++j) {
        double* column = work + j * vectors * kLanes;
        std::copy_n(&diagonal.coeffRef(0, j), size3, column);
        std::fill(column + size3, column + vectors * kLanes, 0.0);
    }
    const auto invert_work = [&] {
        switch (vectors) {
        case 1:
            return invert_by_gauss_jordan<1>(work, size3);
        case 2:
            return invert_by_gauss_jordan<2>(work, size3);
        case 3:
            return invert_by_gauss_jordan<3>(work, size3);
        case 4:
            return invert_by_gauss_jordan<4>(work, size3);
        case 5:
            return invert_by_gauss_jordan<5>(work, size3);
        default:
            return invert_by_gauss_jordan<6>(work, size3);
        }
    };
    if (!invert_work()) return false;
    for (int j = 0; j < size3; ++j)
        inverse.col(j) = Eigen::Map<const Eigen::VectorXd>(work + j * vectors * kLanes, size3);
    return inverse.allFinite();
}

/// L <- L D^-1.
void BlockLu::scale_panel(const Supernode& s)
{
    if (s.below == 0) return;
    const int width3 = 3 * s.width;
    double* const lower = value_.data() + s.lower();
    const std::ptrdiff_t stride = s.lower_stride();
    if (s.width > kNarrow) {
        Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>> panel(lower, 3 * s.below, width3,
                                                                   Eigen::OuterStride<>(stride));
        Eigen::Map<Eigen::MatrixXd> product(scratch_.data(), 3 * s.below, width3);
        product.noalias() =
            panel * Eigen::Map<const Eigen::MatrixXd>(inverse_.data() + s.inverse, width3, width3);
        panel = product;
        return;
    }
    if (s.width == 1) {
        const Mat3 inverse = Eigen::Map<const Mat3>(inverse_.data() + s.inverse);
        double *first = lower, *second = first + stride, *third = second + stride;
        for (int a = 0; a < 3 * s.below; ++a) {
            const Eigen::RowVector3d row(first[a], second[a], third[a]);
            first[a] = row.dot(inverse.col(0));
            second[a] = row.dot(inverse.col(1));
            third[a] = row.dot(inverse.col(2));
        }
        return;
    }
    alignas(64) double transposed[9 * kNarrow * kNarrow], rows[3 * kNarrow * kTileRows];
    Eigen::Map<Eigen::MatrixXd>(transposed, width3, width3) =
        Eigen::Map<const Eigen::MatrixXd>(inverse_.data() + s.inverse, width3, width3).transpose();
    alignas(64) double tile[3 * kTileRows];
    for (int i = 0; i < s.below; i += kTileBlocks) {
        const int blocks = std::min(kTileBlocks, s.below - i);
        for (int k = 0; k < width3; ++k)
            for (int a = 0; a < kTileRows; ++a)
                rows[k * kTileRows + a] = lower[3 * i + a + stride * k];
        for (int j = 0; j < width3; j += 3) {
            multiply_tile(blocks, rows, kTileRows, transposed + j, width3, width3, tile);
            for (int c = 0; c < 3; ++c)
                std::copy_n(tile + kTileRows * c, 3 * blocks, lower + 3 * i + stride * (j + c));
        }
    }
}

bool BlockLu::factorise()
{
    for (std::size_t k = 0; k < supernodes_.size(); ++k) {
        const Supernode& s = supernodes_[k];
        if (first_update_[k] < first_update_[k + 1]) {
            for (int i = 0; i < s.width; ++i)
                at_[size(s.first + i)] = i;
            for (int i = 0; i < s.below; ++i)
                at_[size(row_[s.row + size(i)])] = s.width + i;
            for (std::size_t u = first_update_[k]; u < first_update_[k + 1]; ++u)
                apply(updates_[u], s);
        }
        if (!invert(s)) return false;
        scale_panel(s);
    }
    return true;
}

// ---- solve

void BlockLu::divide(const Supernode& s, double* y) const
{
    if (s.width == 1) {
        const Vec3 value =
            Eigen::Map<const Mat3>(inverse_.data() + s.inverse) * Eigen::Map<const Vec3>(y);
        Eigen::Map<Vec3>{y} = value;
        return;
    }
    const int width3 = 3 * s.width;
    Eigen::Map<Eigen::VectorXd> part(y, width3), copy(part_.data(), width3);
    copy = part;
    if (s.width > kNarrow && s.below == 0) {
        copy = dense_[size(s.dense)].permutationP() * part;
        dense_[size(s.dense)].matrixLU().triangularView<Eigen::UnitLower>().solveInPlace(copy);
        dense_[size(s.dense)].matrixLU().triangularView<Eigen::Upper>().solveInPlace(copy);
        part = copy;
        return;
    }
    part.setZero();
    const double* inverse = inverse_.data() + s.inverse;
    for (int c = 0; c < width3; ++c, inverse += width3)
        for (int a = 0; a < width3; ++a)
            y[a] += inverse[a] * copy[c];
}

void BlockLu::solve(Eigen::VectorXd& x) const
{
    double* const y = x_.data();
    double* const part = part_.data();
    for (int k = 0; k < n_; ++k)
        for (int a = 0; a < 3; ++a)
            y[3 * k + a] = x[3 * order_[size(k)] + a];
    for (const Supernode& s : supernodes_) {
        if (s.below == 0) continue;
        const int below3 = 3 * s.below;
        std::fill_n(part, below3, 0.0);
        const double* lower = value_.data() + s.lower();
        for (int c = 0; c < 3 * s.width; c += 3, lower += 3 * s.lower_stride()) {
            const double *second = lower + s.lower_stride(), *third = second + s.lower_stride();
            const double* value = y + 3 * s.first + c;
            for (int a = 0; a < below3; ++a)
                part[a] += lower[a] * value[0] + second[a] * value[1] + third[a] * value[2];
        }
        const int* rows = row_.data() + s.row;
        for (int i = 0; i < s.below; ++i)
            for (int a = 0; a < 3; ++a)
                y[3 * rows[i] + a] -= part[3 * i + a];
    }
    for (auto s = supernodes_.rbegin(); s != supernodes_.rend(); ++s) {
        if (s->below > 0) {
            const int* rows = row_.data() + s->row;
            for (int i = 0; i < s->below; ++i)
                for (int a = 0; a < 3; ++a)
                    part[3 * i + a] = y[3 * rows[i] + a];
            const Eigen::Map<const Eigen::MatrixXd> upper(value_.data() + s->upper(), 3 * s->below,
                                                          3 * s->width);
            const Eigen::Map<const Eigen::VectorXd> other(part, 3 * s->below);
            for (int c = 0; c < 3 * s->width; ++c)
                if (s->below == 1)
                    y[3 * s->first + c] -= upper.col(c).head<3>().dot(other.head<3>());
                else
                    y[3 * s->first + c] -= upper.col(c).dot(other);
        }
        divide(*s, y + 3 * s->first);
    }
    for (int k = 0; k < n_; ++k)
        for (int a = 0; a < 3; ++a)
            x[3 * order_[size(k)] + a] = y[3 * k + a];
}

Eigen::MatrixXd BlockLu::between(const std::vector<int>& blocks, const Eigen::MatrixXd& C) const
{
    // A = (L D^-1) (D U): C^T A^-1 C = [(D U)^-T C]^T [(L D^-1)^-1 C], two forward substitutions.
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    using Panel = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
    const Eigen::Index m = C.cols();
    Rows left(3 * n_, m), right(3 * n_, m); // of what is reached alone
    std::vector<char> reached(supernodes_.size(), 0);
    const auto reach = [&](int block) {
        const auto k = size(supernode_of_[size(block)]);
        if (reached[k]) return;
        reached[k] = 1;
        const Supernode& s = supernodes_[k];
        left.middleRows(3 * s.first, 3 * s.width).setZero();
        right.middleRows(3 * s.first, 3 * s.width).setZero();
    };
    for (std::size_t b = 0; b < blocks.size(); ++b) {
        const int k = place_[size(blocks[b])];
        reach(k);
        right.middleRows<3>(3 * k) = C.middleRows<3>(3 * static_cast<Eigen::Index>(b));
        left.middleRows<3>(3 * k) = right.middleRows<3>(3 * k);
    }
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(m, m), own;
    Rows change;
    for (std::size_t k = 0; k < supernodes_.size(); ++k) {
        if (!reached[k]) continue;
        const Supernode& s = supernodes_[k];
        const auto of_left = left.middleRows(3 * s.first, 3 * s.width);
        const auto of_right = right.middleRows(3 * s.first, 3 * s.width);
        if (s.below == 0 && s.width > kNarrow) {
            own = of_right;
            sum.noalias() += of_left.transpose() * dense_[size(s.dense)].solve(own);
            continue;
        }
        own.noalias() = inverse_of(s).transpose() * of_left;
        sum.noalias() += own.transpose() * of_right;
        const int* const rows = row_.data() + s.row;
        for (int i = 0; i < s.below; ++i)
            reach(rows[i]);
        const auto pass_on = [&](std::size_t panel, int stride, const auto& value, Rows& to) {
            change.noalias() = Panel(value_.data() + panel, 3 * s.below, 3 * s.width,
                                     Eigen::OuterStride<>(stride)) *
                               value;
            for (int i = 0; i < s.below; ++i)
                to.middleRows<3>(3 * rows[i]) -= change.middleRows<3>(3 * i);
        };
        pass_on(s.lower(), s.lower_stride(), of_right, right);
        pass_on(s.upper(), s.upper_stride(), own, left);
    }
    return sum;
}

} // namespace amontons
