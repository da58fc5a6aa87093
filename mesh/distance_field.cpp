#include "mesh/distance_field.hpp"

#include "mesh/base/error.hpp"
#include "mesh/sample_file.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <condition_variable>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <future>
#include <limits>
#include <mutex>
#include <thread>
#include <unordered_map>
#include <utility>

// f(x) = sum_k c_k B(x/h - k) with the cubic B-spline B per axis. To interpolate f at the grid
// points the coefficients would need the inverse of the filter (1, 4, 1)/6 = 1 + delta^2/6 over
// the whole grid. Its series 1 - delta^2/6 + delta^4/36 - ... cut after delta^4,
//   c_k = 3/2 f_k - 5/18 (f_{k-1} + f_{k+1}) + 1/36 (f_{k-2} + f_{k+2}),
// needs five samples and leaves a defect of h^6 f^(6) / 216 at the grid points, below the
// error h^4 f^(4) / 384 of spline interpolation itself: blocks can be filled one by one.
//
// A block holds what its 4^3 cells need: 7^3 coefficients from 11^3 samples. Samples are kept
// in bricks of 4^3, since neighbouring blocks share most of them.

namespace amontons {

namespace {

constexpr int kFieldBlock = 4;          // cells along an edge of a block
constexpr int kRow = kFieldBlock + 3;   // coefficients along an edge of a block
constexpr int kBuffer = 3 * kBrick;     // samples along an edge, gathered for a block
constexpr double kFarthest = 1 << 22;   // cells from the origin: 2^20 bricks, 21 bits of a key
constexpr double kLeastGradient = 1e-8; // below it the normal has no meaning
constexpr double kSplineOff = 1;        // cells by which the spline may miss a kinked distance
constexpr std::size_t kMostBlocks = 16384, kMostBricks = 49152; // 47 and 30 MB
// Bounds that are kept, along a cell of the grid: of places at the wall, and of places so far from
// it that a point beside them loses no more than this part of the bound.
constexpr double kTrackCells = 6, kFarTrackCells = 1, kFarTrackLoss = 0.1;
constexpr std::size_t kTrackPlaces = 8192;  // of each, a power of two: 0.4 MB
constexpr std::size_t kLeastShare = 4;      // bricks for which a thread is worth starting
constexpr std::uint64_t kSampleVersion = 2; // changes with the formulas of samples
constexpr double kUnbounded = -std::numeric_limits<double>::infinity();

using Key = BrickKey;

struct Block {
    Key key;
    std::array<double, kRow * kRow * kRow> c;
};

// Value, first and second derivative of the four B-splines that are nonzero in a cell.
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

struct DistanceField::Shared {
    std::unique_ptr<DistanceSource> source;
    mutable std::mutex mutex; // of all that follows
    Bricks bricks;
    std::unordered_map<Key, std::shared_ptr<const Block>, BrickHash> blocks;
    std::deque<Key> order; // in which they were filled
    int threads = 1;
    std::string path; // of the file of samples, or ""
    std::vector<std::string> messages;
    bool sampled = false;      // since the file was read
    std::vector<Key> expected; // blocks that will probably be requested, the latest last
    std::condition_variable_any wake;

    struct NewBrick {
        Key key;
        Brick* samples;
    };

    void sample_brick(const Key& key, const Vec3& origin, const Mat3& edges, Brick& out) const
    {
        const Vec3 first{static_cast<double>(key.x), static_cast<double>(key.y),
                         static_cast<double>(key.z)};
        source->sample_cube(origin + kBrick * (edges * first), edges, kBrick, out.data());
    }

    /// The 3^3 bricks around a block, sampled where they are not known.
    std::array<const Brick*, 27> around(const Key& block, const Vec3& origin, const Mat3& edges)
    {
        if (bricks.size() > kMostBricks) bricks.clear();
        std::array<const Brick*, 27> found;
        std::vector<NewBrick> new_bricks;
        std::size_t n = 0;
        for (int i = 0; i < 3; ++i) // samples -4 .. 7 of the block's cells
            for (int j = 0; j < 3; ++j)
                for (int k = 0; k < 3; ++k) {
                    const Key key{block.x - 1 + i, block.y - 1 + j, block.z - 1 + k};
                    std::unique_ptr<Brick>& slot = bricks[key];
                    if (!slot) {
                        slot = std::make_unique<Brick>();
                        new_bricks.push_back({key, slot.get()});
                    }
                    found[n++] = slot.get();
                }
        if (new_bricks.empty()) return found;
        sampled = true;
        const auto sample = [&](std::size_t begin, std::size_t end) {
            for (std::size_t w = begin; w < end; ++w)
                sample_brick(new_bricks[w].key, origin, edges, *new_bricks[w].samples);
        };
        // Threads of its own: those of OpenMP would wait busily from one block to the next.
        const std::size_t parts = std::clamp<std::size_t>(new_bricks.size() / kLeastShare, 1,
                                                          static_cast<std::size_t>(threads));
        std::vector<std::future<void>> others;
        for (std::size_t k = 1; k < parts; ++k)
            others.push_back(std::async(std::launch::async, sample, new_bricks.size() * k / parts,
                                        new_bricks.size() * (k + 1) / parts));
        sample(0, new_bricks.size() / parts);
        for (std::future<void>& other : others)
            other.get();
        return found;
    }

    /// The samples around the blocks that are expected, taken one brick after the other while the
    /// views work: the bits are those that the views would take.
    void sample_ahead(const std::stop_token& stop, const Vec3& origin, const Mat3& edges)
    {
        std::unique_lock lock(mutex);
        while (wake.wait(lock, stop, [&] { return !expected.empty(); })) {
            const Key block = expected.back();
            expected.pop_back();
            for (int n = 0; n < 27 && !stop.stop_requested(); ++n) {
                const Key key{block.x - 1 + n / 9, block.y - 1 + n / 3 % 3, block.z - 1 + n % 3};
                if (bricks.contains(key)) continue;
                lock.unlock();
                auto brick = std::make_unique<Brick>();
                sample_brick(key, origin, edges, *brick);
                lock.lock();
                bricks.try_emplace(key, std::move(brick));
                sampled = true;
            }
        }
    }

    /// Who comes from the block `before` to a new one probably continues.
    void expect_beyond(const Key& key, const Key& before, const Vec3& origin, const Mat3& edges)
    {
        constexpr std::int32_t kFarStep = 1; // blocks: farther ones are not on the way
        const Key way{key.x - before.x, key.y - before.y, key.z - before.z};
        if (std::max({std::abs(way.x), std::abs(way.y), std::abs(way.z)}) > kFarStep) return;
        const Key next{key.x + way.x, key.y + way.y, key.z + way.z};
        if (blocks.contains(next) || bricks.size() > kMostBricks) return;
        expected.push_back(next);
        if (!ahead.joinable())
            ahead = std::jthread([this, origin, edges](const std::stop_token& stop) {
                sample_ahead(stop, origin, edges);
            });
        wake.notify_one();
    }

    /// A block, filled if no view has requested it yet. Views wait for each other here.
    /// @param before  where the point of the query was before, or nullptr
    std::shared_ptr<const Block> block(const Key& key, const Key* before, const Vec3& origin,
                                       const Mat3& edges)
    {
        const std::lock_guard lock(mutex);
        if (const auto found = blocks.find(key); found != blocks.end()) return found->second;
        if (order.size() >= kMostBlocks) {
            blocks.erase(order.front());
            order.pop_front();
        }
        std::shared_ptr<const Block> made = fill(key, origin, edges);
        blocks.emplace(key, made);
        order.push_back(key);
        if (threads > 1 && before) expect_beyond(key, *before, origin, edges);
        return made;
    }

    std::shared_ptr<const Block> fill(const Key& key, const Vec3& origin, const Mat3& edges)
    {
        static_assert(kFieldBlock == kBrick);
        constexpr int slice = kBuffer * kBuffer, first = kBrick - 1; // of coefficients -1 .. 5
        std::array<double, kBuffer * slice> a;
        std::array<double, kRow * slice> b;
        std::array<double, kRow * kRow * kBuffer> c;
        const std::array<const Brick*, 27> bricks_of = around(key, origin, edges);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                for (int k = 0; k < 3; ++k) {
                    const double* from =
                        bricks_of[static_cast<std::size_t>(9 * i + 3 * j + k)]->data();
                    double* to = a.data() + kBrick * (slice * i + kBuffer * j + k);
                    for (int u = 0; u < kBrick; ++u)
                        for (int v = 0; v < kBrick; ++v, from += kBrick)
                            std::copy_n(from, kBrick, to + slice * u + kBuffer * v);
                }
        for (int i = 0; i < kRow; ++i)
            for (int jk = 0; jk < slice; ++jk)
                b[static_cast<std::size_t>(slice * i + jk)] =
                    prefilter(a.data() + slice * (i + first) + jk, slice);
        for (int i = 0; i < kRow; ++i)
            for (int j = 0; j < kRow; ++j)
                for (int k = 0; k < kBuffer; ++k)
                    c[static_cast<std::size_t>(kBuffer * (kRow * i + j) + k)] =
                        prefilter(b.data() + slice * i + kBuffer * (j + first) + k, kBuffer);
        const auto made = std::make_shared<Block>();
        made->key = key;
        for (int ij = 0; ij < kRow * kRow; ++ij)
            for (int k = 0; k < kRow; ++k)
                made->c[static_cast<std::size_t>(kRow * ij + k)] =
                    prefilter(c.data() + kBuffer * ij + k + first, 1);
        return made;
    }

    std::jthread ahead; // the last: it ends before what it uses
};

struct DistanceField::Cache {
    std::unordered_map<Key, std::int32_t, BrickHash> index;
    std::vector<std::shared_ptr<const Block>> blocks;
    std::size_t oldest = 0; // of the blocks, once there are as many as are kept

    /// The last bound of the source's distance in a small cell. What is pushed along a wall passes
    /// the same cells again, and a point in Newton's method stays in one.
    struct Bound {
        Key cell{};
        Vec3 x = Vec3::Zero();
        double least = -1; // at x [m]; below 0: none
    };
    std::vector<Bound> bounds, far_bounds;

    /// @param u  place, in units of the cells of those bounds
    static Bound& bound_at(std::vector<Bound>& bounds, const Vec3& u)
    {
        if (bounds.empty()) bounds.resize(kTrackPlaces);
        const auto number = [&](int a) {
            return static_cast<std::int32_t>(
                std::floor(std::clamp(u[a], -double(1 << 30), double(1 << 30))));
        };
        const Key cell{number(0), number(1), number(2)};
        Bound& found = bounds[BrickHash{}(cell) & (kTrackPlaces - 1)];
        if (!(found.cell == cell)) found = {cell};
        return found;
    }

    /// Keeps a block, in place of the oldest where there are too many. @return  its number
    std::int32_t take(std::shared_ptr<const Block> block)
    {
        std::size_t number = blocks.size();
        if (number < kMostBlocks) {
            blocks.emplace_back();
        } else {
            number = oldest;
            oldest = (oldest + 1) % kMostBlocks;
            index.erase(blocks[number]->key);
        }
        index.emplace(block->key, static_cast<std::int32_t>(number));
        blocks[number] = std::move(block);
        return static_cast<std::int32_t>(number);
    }
};

double DistanceSource::clearance(const Vec3&, std::int32_t&) const
{
    return kUnbounded;
}

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
    : origin_{origin}
    , spacing_{spacing}
    , axes_{axes}
    , shared_{std::make_shared<Shared>()}
    , cache_{std::make_unique<Cache>()}
{
    shared_->source = std::move(source);
}
DistanceField::DistanceField(DistanceField&&) noexcept = default;
DistanceField& DistanceField::operator=(DistanceField&&) noexcept = default;
DistanceField::~DistanceField() = default;

DistanceField DistanceField::share() const
{
    DistanceField other;
    other.origin_ = origin_;
    other.spacing_ = spacing_;
    other.axes_ = axes_;
    other.shared_ = shared_;
    other.cache_ = std::make_unique<Cache>();
    return other;
}

std::size_t DistanceField::block_count() const
{
    return cache_->blocks.size();
}

std::size_t DistanceField::memory() const
{
    const std::lock_guard lock(shared_->mutex);
    return shared_->blocks.size() * (sizeof(Block) + 160) +
           shared_->bricks.size() * (sizeof(Brick) + 64);
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
    const Key key{cell[0] >> 2, cell[1] >> 2, cell[2] >> 2};
    const bool known =
        hint.piece >= 0 && static_cast<std::size_t>(hint.piece) < cache_->blocks.size();
    const Key* before =
        known ? &cache_->blocks[static_cast<std::size_t>(hint.piece)]->key : nullptr;
    if (!before || !(*before == key)) {
        const auto found = cache_->index.find(key);
        hint.piece = found != cache_->index.end()
                         ? found->second
                         : cache_->take(shared_->block(key, before, origin_, spacing_ * axes_));
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

double DistanceField::clearance(const Vec3& x, WallHint& hint) const
{
    const Vec3 u = axes_.transpose() * (x - origin_) / spacing_;
    if (!(u.cwiseAbs().maxCoeff() < kFarthest)) return kUnbounded;
    const auto block = [&](int a) { return static_cast<std::int32_t>(std::floor(u[a])) >> 2; };
    const Key key{block(0), block(1), block(2)};
    const auto& blocks = cache_->blocks;
    if (hint.piece >= 0 && static_cast<std::size_t>(hint.piece) < blocks.size() &&
        blocks[static_cast<std::size_t>(hint.piece)]->key == key)
        return kUnbounded;
    if (const auto found = cache_->index.find(key); found != cache_->index.end()) {
        hint.piece = found->second;
        return kUnbounded;
    }
    Cache::Bound& last = Cache::bound_at(cache_->bounds, kTrackCells * u);
    Cache::Bound& far = Cache::bound_at(cache_->far_bounds, kFarTrackCells * u);
    if (last.least < 0 && (x - far.x).norm() <= kFarTrackLoss * far.least) {
        const double least = far.least - (x - far.x).norm() - kSplineOff * spacing_;
        return least > 0 ? least : kUnbounded;
    }
    if (last.least < 0) {
        std::int32_t near = hint.far;
        last.x = x;
        last.least = std::max(shared_->source->clearance(x, near), 0.0);
        hint.far = near;
        far.x = x;
        far.least = last.least;
    }
    const double least = last.least - (x - last.x).norm() - kSplineOff * spacing_;
    return least > 0 ? least : kUnbounded;
}

Hash128 DistanceField::fingerprint_() const
{
    const Hash128 source = shared_->source->fingerprint();
    if (source == Hash128{}) return {};
    std::string bytes;
    const auto add = [&](const void* from, std::size_t size) {
        bytes.append(static_cast<const char*>(from), size);
    };
    add(&kSampleVersion, sizeof kSampleVersion);
    add(&source, sizeof source);
    add(origin_.data(), 3 * sizeof(double));
    add(&spacing_, sizeof spacing_);
    add(axes_.data(), 9 * sizeof(double));
    return hash128_bytes(bytes);
}

void DistanceField::prepare(const std::string& cache, int threads)
{
    Shared& c = *shared_;
    const std::lock_guard lock(c.mutex);
    c.threads = std::max(threads, 1);
    const std::string before = std::exchange(c.path, "");
    const Hash128 of = cache.empty() ? Hash128{} : fingerprint_();
    if (of == Hash128{}) return;
    char name[48];
    std::snprintf(name, sizeof name, "%016llx%016llx.samples",
                  static_cast<unsigned long long>(of.high),
                  static_cast<unsigned long long>(of.low));
    c.path = (std::filesystem::path(cache) / name).string();
    if (c.path == before) return; // another view has read it
    if (std::error_code error; !std::filesystem::exists(c.path, error)) return;
    std::string why;
    try {
        why = read_samples(read_file(c.path), of, c.bricks);
    } catch (const InputError& e) {
        c.messages.push_back(e.what());
        return;
    }
    c.messages.push_back(c.path + (why.empty() ? ": samples read" : ": ignored: " + why));
    c.sampled = !why.empty();
}

std::vector<std::string> DistanceField::keep() const
{
    const Shared& c = *shared_;
    const std::lock_guard lock(c.mutex);
    std::vector<std::string> lines = c.messages;
    if (c.path.empty() || !c.sampled) return lines;
    try {
        make_folder(std::filesystem::path(c.path).parent_path().string());
        write_file(c.path, sample_bytes(fingerprint_(), c.bricks), Flush::to_system);
        lines.push_back(c.path + ": samples written");
    } catch (const WriteError& e) {
        lines.push_back(e.what());
    }
    return lines;
}

WallSample DistanceField::sample(const Vec3& x, WallHint& hint) const
{
    if (x.allFinite()) return wall_sample(evaluate(x, hint));
    WallSample out;
    out.distance = std::numeric_limits<double>::quiet_NaN();
    return out;
}

FieldSample DistanceField::evaluate(const Vec3& x, WallHint& hint) const
{
    using Row = Eigen::Array4d;
    FieldSample out;
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
    out.value = (f * wz).sum();
    out.gradient = axes_ * Vec3{(fx * wz).sum(), (fy * wz).sum(), (f * dz).sum()} / spacing_;
    Mat3 hessian;
    hessian(0, 0) = (fxx * wz).sum();
    hessian(1, 1) = (fyy * wz).sum();
    hessian(2, 2) = (f * ddz).sum();
    hessian(0, 1) = hessian(1, 0) = (fxy * wz).sum();
    hessian(0, 2) = hessian(2, 0) = (fx * dz).sum();
    hessian(1, 2) = hessian(2, 1) = (fy * dz).sum();
    out.hessian = axes_ * hessian * axes_.transpose();
    out.unit = spacing_ * spacing_;
    return out;
}

WallSample wall_sample(const FieldSample& field)
{
    WallSample out;
    out.distance = field.value;
    const double size = field.gradient.norm();
    if (size < kLeastGradient) { // on a medial axis by symmetry: nothing touches there
        out.normal = Vec3::UnitX();
        return out;
    }
    out.normal = field.gradient / size;
    out.slope = size;
    const Mat3 across = Mat3::Identity() - out.normal * out.normal.transpose();
    out.hessian = across * (field.hessian / (size * field.unit)) * across;
    return out;
}

} // namespace amontons
