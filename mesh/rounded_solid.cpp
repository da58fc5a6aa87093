#include "mesh/rounded_solid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

namespace amontons {
namespace {

constexpr int kSampleBlock = 4; // samples along an edge of a block that is kept together
// Distance / width of a block's middle from which all samples that its places need have one sign.
constexpr double kFarSamples = 7;
constexpr int kRounds = 30;  // of Newton's method
constexpr double kOn = 1e-6; // value / width: on the surface
constexpr double kReach = 2; // of a projection / width

/// Signed distances of a block [m].
using Samples = std::array<double, kSampleBlock * kSampleBlock * kSampleBlock>;

std::int64_t floor_div(std::int64_t a, std::int64_t b)
{
    return a >= 0 ? a / b : -((b - 1 - a) / b);
}

std::uint64_t key_of(const std::array<std::int64_t, 3>& i)
{
    constexpr std::int64_t shift = 1 << 20;
    return static_cast<std::uint64_t>(i[0] + shift) << 42 |
           static_cast<std::uint64_t>(i[1] + shift) << 21 |
           static_cast<std::uint64_t>(i[2] + shift);
}

/// Weights of the four uniform cubic B-splines at t in [0, 1], and their derivatives.
void weights(double t, std::array<double, 4>& w, std::array<double, 4>& d)
{
    const double s = 1 - t;
    w = {s * s * s / 6, (4 - 6 * t * t + 3 * t * t * t) / 6, (4 - 6 * s * s + 3 * s * s * s) / 6,
         t * t * t / 6};
    d = {-s * s / 2, (-4 * t + 3 * t * t) / 2, (4 * s - 3 * s * s) / 2, t * t / 2};
}

} // namespace

struct RoundedSolid::Grid {
    using Index = std::array<std::int64_t, 3>; ///< of a block

    /// The signed distance of a block's middle if it is far, else 0.
    double far(const RoundedSolid& solid, const Index& i);
    const Samples& samples(const RoundedSolid& solid, const Index& i);

private:
    /// Nodes of the maps stay where they are, so that the last ones can be kept.
    template <class Value> struct Kept {
        std::unordered_map<std::uint64_t, Value> all;
        std::uint64_t last_key = ~std::uint64_t{0};
        Value* last = nullptr;

        template <class Make> const Value& at(const Index& i, Make make)
        {
            const std::uint64_t key = key_of(i);
            if (key == last_key) return *last;
            const auto [found, is_new] = all.try_emplace(key);
            if (is_new) make(found->second);
            last_key = key;
            last = &found->second;
            return *last;
        }
    };

    double distance_(const RoundedSolid& solid, const Vec3& x)
    {
        const NearestTriangle nearest = solid.tree_.nearest(x, near_);
        near_ = nearest.triangle;
        return std::sqrt(nearest.squared);
    }
    static Vec3 corner_(const RoundedSolid& solid, const Index& i)
    {
        return solid.origin_ + solid.width_ * kSampleBlock *
                                   Vec3(static_cast<double>(i[0]), static_cast<double>(i[1]),
                                        static_cast<double>(i[2]));
    }

    Kept<double> far_;
    Kept<Samples> samples_;
    std::int32_t near_ = -1; ///< triangle nearest to the last place
};

double RoundedSolid::Grid::far(const RoundedSolid& solid, const Index& i)
{
    return far_.at(i, [&](double& value) {
        const Vec3 middle = corner_(solid, i) + 0.5 * solid.width_ * kSampleBlock * Vec3::Ones();
        const double d = distance_(solid, middle);
        if (d > kFarSamples * solid.width_) value = solid.winding_.at(middle) > 0.5 ? -d : d;
    });
}

const Samples& RoundedSolid::Grid::samples(const RoundedSolid& solid, const Index& i)
{
    return samples_.at(i, [&](Samples& samples) {
        const double w = solid.width_;
        double sign = 1, before = 0; // of the sample before, which is one width away
        for (int n = 0; n < kSampleBlock * kSampleBlock * kSampleBlock; ++n) {
            const Vec3 x =
                corner_(solid, i) + w * Vec3(n / (kSampleBlock * kSampleBlock),
                                             n / kSampleBlock % kSampleBlock, n % kSampleBlock);
            const double d = distance_(solid, x);
            const bool same_side = n % kSampleBlock > 0 && std::max(d, before) > 1.001 * w;
            if (!same_side) sign = solid.winding_.at(x) > 0.5 ? -1 : 1;
            samples[static_cast<std::size_t>(n)] = sign * d;
            before = d;
        }
    });
}

RoundedSolid::RoundedSolid(const SurfaceMesh& surface, double width)
    : tree_(surface)
    , winding_(surface)
    , width_(width)
    , grid_(std::make_unique<Grid>())
{
    // Not through corners of the surface, whose coordinates often are round numbers.
    origin_ = surface.points.front() - width * Vec3(0.3137, 0.4241, 0.2713);
}

RoundedSolid::~RoundedSolid() = default;

RoundedSolid::Sample RoundedSolid::at(const Vec3& x) const
{
    const Vec3 place = (x - origin_) / width_;
    std::array<std::int64_t, 3> cell{};
    std::array<std::array<double, 4>, 3> w{}, d{};
    for (std::size_t a = 0; a < 3; ++a) {
        const double along = place[static_cast<Eigen::Index>(a)];
        cell[a] = static_cast<std::int64_t>(std::floor(along));
        weights(along - static_cast<double>(cell[a]), w[a], d[a]);
    }
    const Grid::Index middle{floor_div(cell[0], kSampleBlock), floor_div(cell[1], kSampleBlock),
                             floor_div(cell[2], kSampleBlock)};
    if (const double far = grid_->far(*this, middle); far != 0) return {far, Vec3::Zero()};
    // Samples cell - 1 to cell + 2 lie in one or two blocks along each axis.
    std::array<const Samples*, 8> blocks{};
    std::array<std::array<std::int64_t, 4>, 3> in{};          // the block
    std::array<std::array<std::size_t, 4>, 3> second{}, at{}; // 1 in the second one; sample there
    for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t i = 0; i < 4; ++i) {
            const std::int64_t n = cell[a] - 1 + static_cast<std::int64_t>(i);
            in[a][i] = floor_div(n, kSampleBlock);
            second[a][i] = in[a][i] != in[a][0];
            at[a][i] = static_cast<std::size_t>(n - in[a][i] * kSampleBlock);
        }
    Sample s;
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = 0; j < 4; ++j)
            for (std::size_t k = 0; k < 4; ++k) {
                const Samples*& block = blocks[4 * second[0][i] + 2 * second[1][j] + second[2][k]];
                if (!block) block = &grid_->samples(*this, {in[0][i], in[1][j], in[2][k]});
                const double c =
                    (*block)[(at[0][i] * kSampleBlock + at[1][j]) * kSampleBlock + at[2][k]];
                s.value += w[0][i] * w[1][j] * w[2][k] * c;
                s.gradient += c * Vec3(d[0][i] * w[1][j] * w[2][k], w[0][i] * d[1][j] * w[2][k],
                                       w[0][i] * w[1][j] * d[2][k]);
            }
    s.gradient /= width_;
    return s;
}

bool RoundedSolid::project(Vec3& x) const
{
    const Vec3 start = x;
    for (int round = 0; round < kRounds; ++round) {
        const Sample s = at(x);
        if (std::abs(s.value) <= kOn * width_) return true;
        const double slope = s.gradient.squaredNorm();
        if (!(slope > 1e-4)) return false; // half-way between two sheets
        x -= std::clamp(s.value / slope, -width_, width_) * s.gradient;
        if ((x - start).squaredNorm() > kReach * kReach * width_ * width_) return false;
    }
    return false;
}

} // namespace amontons
