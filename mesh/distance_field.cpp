#include "mesh/distance_field.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

// f(x) = sum_k c_k B(x/h - k) with the cubic B-spline B per axis. To interpolate f at the grid
// points the coefficients would need the inverse of the filter (1, 4, 1)/6 = 1 + delta^2/6 over
// the whole grid. Its series 1 - delta^2/6 + delta^4/36 - ... cut after delta^4,
//   c_k = 3/2 f_k - 5/18 (f_{k-1} + f_{k+1}) + 1/36 (f_{k-2} + f_{k+2}),
// needs five samples and leaves a defect of h^6 f^(6) / 216 at the grid points, below the
// error h^4 f^(4) / 384 of spline interpolation itself: blocks can be filled one by one.
//
// A block holds what its 8^3 cells need: 11^3 coefficients from 15^3 samples. Samples are kept
// in bricks of 4^3, since neighbouring blocks share most of them.

namespace amontons {

namespace {

constexpr int kFieldBlock = 8;          // cells along an edge of a block
constexpr int kBrick = 4;               // samples along an edge of a brick
constexpr int kRow = kFieldBlock + 3;   // coefficients along an edge of a block
constexpr int kBuffer = 4 * kBrick;     // samples along an edge, gathered for a block
constexpr double kFarthest = 1 << 22;   // cells from the origin: 2^20 bricks, 21 bits of a key
constexpr double kLeastGradient = 1e-8; // below it the normal has no meaning

struct Key {
    std::int32_t x, y, z;
    bool operator==(const Key&) const = default;
};

struct KeyHash {
    std::size_t operator()(const Key& k) const
    {
        const auto part = [](std::int32_t v) { return static_cast<std::uint64_t>(v + (1 << 20)); };
        std::uint64_t h = part(k.x) << 42 | part(k.y) << 21 | part(k.z);
        h = (h ^ (h >> 31)) * 0x9e3779b97f4a7c15ULL;
        return static_cast<std::size_t>(h ^ (h >> 29));
    }
};

using Brick = std::array<double, kBrick * kBrick * kBrick>;

struct Block {
    Key key;
    std::array<double, kRow * kRow * kRow> c;
};

// Value, first and second derivative of the four B-splines that meet in a cell.
void basis(double t, double w[4], double d[4], double dd[4])
{
    const double s = 1 - t;
    w[0] = s * s * s / 6;
    w[1] = (4 + t * t * (3 * t - 6)) / 6;
    w[2] = (4 + s * s * (3 * s - 6)) / 6;
    w[3] = t * t * t / 6;
    d[0] = -s * s / 2;
    d[1] = t * (3 * t - 4) / 2;
    d[2] = -s * (3 * s - 4) / 2;
    d[3] = t * t / 2;
    dd[0] = s;
    dd[1] = 3 * t - 2;
    dd[2] = 3 * s - 2;
    dd[3] = t;
}

double prefilter(const double* f, int stride)
{
    return 1.5 * f[0] - (5.0 / 18) * (f[-stride] + f[stride]) +
           (1.0 / 36) * (f[-2 * stride] + f[2 * stride]);
}

} // namespace

struct DistanceField::Cache {
    std::unordered_map<Key, std::unique_ptr<Brick>, KeyHash> bricks;
    std::unordered_map<Key, std::int32_t, KeyHash> index;
    std::vector<std::unique_ptr<Block>> blocks;

    const Brick& brick(const Key& key, const DistanceSource& source, const Vec3& origin,
                       const Mat3& edges)
    {
        std::unique_ptr<Brick>& slot = bricks[key];
        if (slot) return *slot;
        slot = std::make_unique<Brick>();
        const Vec3 first{static_cast<double>(key.x), static_cast<double>(key.y),
                         static_cast<double>(key.z)};
        source.sample_cube(origin + kBrick * (edges * first), edges, kBrick, slot->data());
        return *slot;
    }

    std::int32_t fill(const Key& key, const DistanceSource& source, const Vec3& origin,
                      const Mat3& edges)
    {
        static_assert(kFieldBlock == 2 * kBrick);
        std::vector<double> a(kBuffer * kBuffer * kBuffer), b(a.size());
        for (int i = 0; i < 4; ++i) // samples -4 .. 11 of the block's cells
            for (int j = 0; j < 4; ++j)
                for (int k = 0; k < 4; ++k) {
                    const Brick& from =
                        brick({2 * key.x - 1 + i, 2 * key.y - 1 + j, 2 * key.z - 1 + k}, source,
                              origin, edges);
                    for (int u = 0; u < kBrick; ++u)
                        for (int v = 0; v < kBrick; ++v)
                            std::copy_n(
                                &from[static_cast<std::size_t>(kBrick * (kBrick * u + v))], kBrick,
                                &a[static_cast<std::size_t>(
                                    kBuffer * (kBuffer * (kBrick * i + u) + kBrick * j + v) +
                                    kBrick * k)]);
                }
        constexpr int first = kBrick - 1, end = first + kRow; // coefficients -1 .. 9
        constexpr int sx = kBuffer * kBuffer, sy = kBuffer;
        const auto pass = [&](const std::vector<double>& in, std::vector<double>& out, int stride,
                              int j0, int j1, int k0, int k1) {
            for (int i = first; i < end; ++i)
                for (int j = j0; j < j1; ++j)
                    for (int k = k0; k < k1; ++k) {
                        const auto at = static_cast<std::size_t>(i * sx + j * sy + k);
                        out[at] = prefilter(&in[at], stride);
                    }
        };
        pass(a, b, sx, 0, kBuffer, 0, kBuffer);
        pass(b, a, sy, first, end, 0, kBuffer);
        pass(a, b, 1, first, end, first, end);
        blocks.push_back(std::make_unique<Block>());
        Block& block = *blocks.back();
        block.key = key;
        double* c = block.c.data();
        for (int i = first; i < end; ++i)
            for (int j = first; j < end; ++j, c += kRow)
                std::copy_n(&b[static_cast<std::size_t>(i * sx + j * sy + first)], kRow, c);
        const auto number = static_cast<std::int32_t>(blocks.size() - 1);
        index.emplace(key, number);
        return number;
    }
};

Mat3 axes_of(std::span<const Vec3> points)
{
    constexpr double kSame = 1e-9;
    Vec3 mean = Vec3::Zero();
    for (const Vec3& x : points)
        mean += x / static_cast<double>(points.size());
    const auto farthest = [&](auto from_mean) {
        Vec3 best = Vec3::Zero();
        for (const Vec3& x : points)
            if (const Vec3 y = from_mean(x - mean); y.norm() > (1 + kSame) * best.norm()) best = y;
        return best;
    };
    const Vec3 longest = farthest([](const Vec3& y) { return y; });
    if (!(longest.norm() > 0)) return Mat3::Identity();
    Mat3 axes;
    axes.col(0) = longest.normalized();
    const Vec3 aside =
        farthest([&](const Vec3& y) { return Vec3(y - axes.col(0).dot(y) * axes.col(0)); });
    axes.col(1) =
        aside.norm() > kSame * longest.norm() ? aside.normalized() : axes.col(0).unitOrthogonal();
    axes.col(2) = axes.col(0).cross(axes.col(1));
    return axes;
}

DistanceField::DistanceField(std::unique_ptr<DistanceSource> source, const Vec3& origin,
                             double spacing, const Mat3& axes)
    : source_{std::move(source)}
    , origin_{origin}
    , spacing_{spacing}
    , axes_{axes}
    , cache_{std::make_unique<Cache>()}
{
}
DistanceField::DistanceField(DistanceField&&) noexcept = default;
DistanceField& DistanceField::operator=(DistanceField&&) noexcept = default;
DistanceField::~DistanceField() = default;

std::size_t DistanceField::block_count() const
{
    return cache_->blocks.size();
}

std::size_t DistanceField::memory() const
{
    return cache_->blocks.size() * (sizeof(Block) + 64) +
           cache_->bricks.size() * (sizeof(Brick) + 64);
}

// The first of the 4^3 coefficients around x, and the place of x in its cell.
const double* DistanceField::cell_(const Vec3& x, WallHint& hint, Vec3& fraction) const
{
    std::int32_t cell[3];
    const Vec3 local = axes_.transpose() * (x - origin_);
    for (int a = 0; a < 3; ++a) {
        const double u = std::clamp(local[a] / spacing_, -kFarthest, kFarthest);
        const double down = std::floor(u);
        cell[a] = static_cast<std::int32_t>(down);
        fraction[a] = u - down;
    }
    const Key key{cell[0] >> 3, cell[1] >> 3, cell[2] >> 3};
    if (hint.piece < 0 || static_cast<std::size_t>(hint.piece) >= cache_->blocks.size() ||
        !(cache_->blocks[static_cast<std::size_t>(hint.piece)]->key == key)) {
        const auto found = cache_->index.find(key);
        hint.piece = found != cache_->index.end()
                         ? found->second
                         : cache_->fill(key, *source_, origin_, spacing_ * axes_);
    }
    const Block& block = *cache_->blocks[static_cast<std::size_t>(hint.piece)];
    return &block.c[static_cast<std::size_t>(
        kRow * (kRow * (cell[0] & (kFieldBlock - 1)) + (cell[1] & (kFieldBlock - 1))) +
        (cell[2] & (kFieldBlock - 1)))];
}

double DistanceField::distance(const Vec3& x, WallHint& hint) const
{
    if (!x.allFinite()) return std::numeric_limits<double>::quiet_NaN();
    Vec3 t;
    const double* c = cell_(x, hint, t);
    double w[3][4], unused[4], unused2[4];
    for (int a = 0; a < 3; ++a)
        basis(t[a], w[a], unused, unused2);
    double sum = 0;
    for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j) {
            const double* row = c + kRow * (kRow * i + j);
            sum += w[0][i] * w[1][j] *
                   (w[2][0] * row[0] + w[2][1] * row[1] + w[2][2] * row[2] + w[2][3] * row[3]);
        }
    return sum;
}

WallSample DistanceField::sample(const Vec3& x, WallHint& hint) const
{
    using Row = Eigen::Array4d;
    WallSample out;
    if (!x.allFinite()) {
        out.distance = std::numeric_limits<double>::quiet_NaN();
        return out;
    }
    Vec3 t;
    const double* c = cell_(x, hint, t);
    double w[3][4], d[3][4], dd[3][4];
    for (int a = 0; a < 3; ++a)
        basis(t[a], w[a], d[a], dd[a]);
    // Contract x, then y, each for the derivatives that a Hessian needs; z is the vector lane.
    Row f = Row::Zero(), fx = f, fy = f, fxx = f, fxy = f, fyy = f;
    for (int j = 0; j < 4; ++j) {
        Row g = Row::Zero(), gx = g, gxx = g;
        for (int i = 0; i < 4; ++i) {
            const Row row = Eigen::Map<const Row>(c + kRow * (kRow * i + j));
            g += w[0][i] * row;
            gx += d[0][i] * row;
            gxx += dd[0][i] * row;
        }
        f += w[1][j] * g;
        fx += w[1][j] * gx;
        fxx += w[1][j] * gxx;
        fy += d[1][j] * g;
        fxy += d[1][j] * gx;
        fyy += dd[1][j] * g;
    }
    const Row wz = Eigen::Map<const Row>(w[2]), dz = Eigen::Map<const Row>(d[2]),
              ddz = Eigen::Map<const Row>(dd[2]);
    out.distance = (f * wz).sum();
    const Vec3 gradient = axes_ * Vec3{(fx * wz).sum(), (fy * wz).sum(), (f * dz).sum()} / spacing_;
    Mat3 hessian;
    hessian(0, 0) = (fxx * wz).sum();
    hessian(1, 1) = (fyy * wz).sum();
    hessian(2, 2) = (f * ddz).sum();
    hessian(0, 1) = hessian(1, 0) = (fxy * wz).sum();
    hessian(0, 2) = hessian(2, 0) = (fx * dz).sum();
    hessian(1, 2) = hessian(2, 1) = (fy * dz).sum();
    const double size = gradient.norm();
    if (size < kLeastGradient) { // on a medial axis by symmetry: nothing touches there
        out.normal = Vec3::UnitX();
        return out;
    }
    out.normal = gradient / size;
    out.slope = size;
    hessian = axes_ * hessian * axes_.transpose();
    const Mat3 across = Mat3::Identity() - out.normal * out.normal.transpose();
    out.hessian = across * (hessian / (size * spacing_ * spacing_)) * across;
    return out;
}

} // namespace amontons
