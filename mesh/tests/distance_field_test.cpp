#include "mesh/distance_field.hpp"

#include "mesh/sample_file.hpp"
#include "mesh/tests/temporary_folder.hpp"
#include "mesh/tests/wall_checks.hpp"

#include <Eigen/Geometry>
#include <atomic>
#include <chrono>
#include <cmath>
#include <doctest/doctest.h>
#include <filesystem>
#include <functional>
#include <random>
#include <thread>

using namespace amontons;

namespace {

class FunctionSource : public DistanceSource {
public:
    explicit FunctionSource(std::function<double(const Vec3&)> f) : f_{std::move(f)} {}
    void sample_cube(const Vec3& corner, const Mat3& edges, int n, double* out) const override
    {
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
                for (int k = 0; k < n; ++k)
                    *out++ = f_(corner + edges * Vec3{1.0 * i, 1.0 * j, 1.0 * k});
    }

private:
    std::function<double(const Vec3&)> f_;
};

DistanceField field(std::function<double(const Vec3&)> f, double h, double unit = 1)
{
    return DistanceField{std::make_unique<FunctionSource>(std::move(f)),
                         unit * Vec3{0.013, 0.027, -0.011}, h};
}

Vec3 direction(std::mt19937& rng)
{
    std::normal_distribution<double> normal;
    return Vec3{normal(rng), normal(rng), normal(rng)}.normalized();
}

} // namespace

TEST_CASE("the field of a round wall converges with the fourth order and normals with the third")
{
    struct Round {
        std::function<double(const Vec3&)> distance;
        double curvature; // twice the mean
    };
    for (const auto& [f, exact] :
         {Round{[](const Vec3& x) { return 1 - x.norm(); }, -2},
          Round{[](const Vec3& x) { return 1 - x.head<2>().norm(); }, -1}}) {
        double zero[3], turned[3], bent[3];
        int level = 0;
        for (double h : {0.2, 0.1, 0.05}) {
            const DistanceField wall = field(f, h);
            std::mt19937 rng{5};
            zero[level] = turned[level] = bent[level] = 0;
            for (int k = 0; k < 2000; ++k) {
                Vec3 x = direction(rng);
                x /= 1 - f(x); // onto the wall
                WallHint hint;
                const WallSample s = wall.sample(x, hint);
                Vec3 normal;
                for (int a = 0; a < 3; ++a)
                    normal[a] = (f(x + 1e-6 * Vec3::Unit(a)) - f(x - 1e-6 * Vec3::Unit(a))) / 2e-6;
                zero[level] = std::max(zero[level], std::abs(s.distance));
                turned[level] = std::max(turned[level], (s.normal - normal).norm());
                bent[level] = std::max(bent[level], std::abs(s.hessian.trace() - exact));
            }
            ++level;
        }
        CHECK(zero[0] <
              1e-4); // [regression] a spacing of a fifth of the radius, as walls are sampled
        CHECK(zero[0] / zero[1] > 12);
        CHECK(zero[1] / zero[2] > 12);
        CHECK(turned[0] < 1e-3); // [regression] of that spacing, too
        CHECK(turned[1] / turned[2] > 7);
        CHECK(bent[1] / bent[2] > 3);
    }
}

TEST_CASE("cubic polynomials come back exactly with their derivatives")
{
    const auto cubic = [](const Vec3& x) {
        return 0.3 + x[0] - 2 * x[1] * x[2] + x[0] * x[0] * x[1] - 0.5 * x[2] * x[2] * x[2];
    };
    const DistanceField wall = field(cubic, 0.2);
    std::mt19937 rng{7};
    for (int k = 0; k < 200; ++k) {
        const Vec3 x = 3 * direction(rng);
        WallHint hint;
        const WallSample s = wall.sample(x, hint);
        CHECK(std::abs(s.distance - cubic(x)) < 1e-12 * 30);
        const Vec3 g{1 + 2 * x[0] * x[1], -2 * x[2] + x[0] * x[0], -2 * x[1] - 1.5 * x[2] * x[2]};
        CHECK((s.normal - g.normalized()).norm() < 1e-12);
        CHECK(wall.distance(x, hint) == doctest::Approx(s.distance).epsilon(1e-12));
    }
}

TEST_CASE("normal and Hessian are the derivatives of the field also across blocks")
{
    const DistanceField wall = field([](const Vec3& x) { return 1 - x.norm(); }, 0.2);
    std::mt19937 rng{11};
    for (int k = 0; k < 500; ++k) {
        const Vec3 x = (0.7 + 0.4 * (k % 7) / 6) * direction(rng);
        WallHint hint;
        const WallSample s = wall.sample(x, hint);
        const double step = 1e-5;
        Vec3 gradient;
        for (int a = 0; a < 3; ++a) {
            const WallSample up = wall.sample(x + step * Vec3::Unit(a), hint);
            const WallSample down = wall.sample(x - step * Vec3::Unit(a), hint);
            gradient[a] = (up.distance - down.distance) / (2 * step);
            const Vec3 across = Vec3::Unit(a) - s.normal * s.normal[a];
            // The Hessian is projected on both sides: compare along directions on the wall.
            const WallSample u = wall.sample(x + step * across, hint);
            const WallSample d = wall.sample(x - step * across, hint);
            CHECK(((u.normal - d.normal) / (2 * step) - s.hessian * across).norm() < 1e-6);
        }
        CHECK((gradient.normalized() - s.normal).norm() < 1e-9);
        CHECK(std::abs(gradient.norm() - s.slope) < 1e-9);
        CHECK(std::abs(s.normal.norm() - 1) < 1e-14);
    }
}

TEST_CASE("neither hints nor earlier queries change a bit of a result")
{
    const auto f = [](const Vec3& x) { return 1 - x.norm(); };
    const DistanceField forward = field(f, 0.25), backward = field(f, 0.25);
    std::vector<Vec3> points;
    std::mt19937 rng{13};
    for (int k = 0; k < 300; ++k)
        points.push_back(1.3 * direction(rng));
    std::vector<WallSample> first;
    for (const Vec3& x : points) {
        WallHint hint;
        first.push_back(forward.sample(x, hint));
    }
    WallHint hint{3};
    int differences = 0;
    for (std::size_t k = points.size(); k-- > 0;) {
        const WallSample s = backward.sample(points[k], hint);
        differences += s.distance != first[k].distance || s.normal != first[k].normal ||
                       s.hessian != first[k].hessian;
    }
    CHECK(differences == 0);
    CHECK(forward.block_count() == backward.block_count());
    CHECK(forward.memory() < 40000 * forward.block_count()); // [regression] bytes of our blocks
}

TEST_CASE("a wall in mm is a wall in m")
{
    const double mm = 1000;
    const DistanceField in_m = field([](const Vec3& x) { return 0.01 - x.norm(); }, 0.0025);
    const DistanceField in_mm = field([](const Vec3& x) { return 10 - x.norm(); }, 0.0025 * mm, mm);
    std::mt19937 rng{17};
    for (int k = 0; k < 200; ++k) {
        const Vec3 x = 0.0095 * direction(rng);
        WallHint a, b;
        const WallSample s = in_m.sample(x, a), t = in_mm.sample(mm * x, b);
        CHECK(std::abs(t.distance - mm * s.distance) < 1e-12 * mm);
        CHECK((t.normal - s.normal).norm() < 1e-11);
        CHECK((t.hessian - s.hessian / mm).norm() < 1e-9 * 100 / mm);
    }
}

TEST_CASE("finite everywhere: at the centre and outside and out of all bounds")
{
    const DistanceField wall = field([](const Vec3& x) { return 1 - x.norm(); }, 0.25);
    std::mt19937 rng{19};
    for (double far : {0.0, 1e-9, 0.5, 3.0, 1e3, 1e6, 1e12, 1e300})
        for (int k = 0; k < 5; ++k) {
            WallHint hint;
            const WallSample s = wall.sample(far * direction(rng), hint);
            CHECK(std::isfinite(s.distance));
            CHECK(std::abs(s.normal.norm() - 1) < 1e-9);
            CHECK(s.hessian.allFinite());
            if (far > 1) CHECK(s.distance < 0);
        }
}

namespace {

/// A wavy tube that counts its samples.
class CountedSource : public DistanceSource {
public:
    explicit CountedSource(std::atomic<int>& bricks) : bricks_{bricks} {}
    void sample_cube(const Vec3& corner, const Mat3& edges, int n, double* out) const override
    {
        ++bricks_;
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
                for (int k = 0; k < n; ++k) {
                    const Vec3 x = corner + edges * Vec3{1.0 * i, 1.0 * j, 1.0 * k};
                    *out++ = 1 + 0.1 * std::sin(3 * x.z()) - x.head<2>().norm();
                }
    }
    Hash128 fingerprint() const override { return {7, 9}; }

private:
    std::atomic<int>& bricks_;
};

std::vector<double> answers(const DistanceField& wall)
{
    std::mt19937 rng{11};
    std::uniform_real_distribution<double> any(-1.5, 1.5);
    std::vector<double> out;
    for (int k = 0; k < 300; ++k) {
        WallHint hint;
        const WallSample s = wall.sample({any(rng), any(rng), any(rng)}, hint);
        out.insert(out.end(), {s.distance, s.normal.x(), s.hessian(0, 1), s.slope});
    }
    return out;
}

} // namespace

TEST_CASE("views of one field give its bits on any thread, and sample once")
{
    std::atomic<int> alone{0}, shared{0};
    const auto made = [](std::atomic<int>& bricks) {
        return DistanceField{std::make_unique<CountedSource>(bricks), Vec3{0.01, 0.02, 0.03}, 0.1};
    };
    const std::vector<double> expected = answers(made(alone));
    const DistanceField first = made(shared);
    std::vector<std::vector<double>> found(6);
    std::vector<std::thread> threads;
    for (std::vector<double>& f : found)
        threads.emplace_back([&first, &f] { f = answers(first.share()); });
    for (std::thread& t : threads)
        t.join();
    for (const std::vector<double>& f : found)
        CHECK(f == expected);
    CHECK(shared == alone);
    CHECK(answers(first) == expected);
    CHECK(shared == alone);
    const std::size_t memory = first.memory();
    const DistanceField other = first.share();
    CHECK(answers(other) == expected);
    CHECK(other.memory() == memory);
    DistanceField dropped = made(shared);
    const DistanceField left = dropped.share();
    dropped = made(alone); // the first view passes, what it shared stays
    CHECK(answers(left) == expected);
}

TEST_CASE("threads and samples that an earlier run has left change no bit of a result")
{
    const TemporaryFolder folder;
    const std::string cache = folder / "cache";
    const auto made = [&](std::atomic<int>& bricks, const std::string& from, int threads,
                          double h = 0.1) {
        DistanceField wall{std::make_unique<CountedSource>(bricks), Vec3{0.01, 0.02, 0.03}, h};
        wall.prepare(from, threads);
        return wall;
    };
    std::atomic<int> alone{0}, many{0}, kept{0}, read{0}, other{0}, damaged{0};
    const std::vector<double> expected = answers(made(alone, "", 1));
    CHECK(alone > 0);
    CHECK(answers(made(many, "", 3)) == expected);
    CHECK(many == alone);
    {
        const DistanceField wall = made(kept, cache, 1);
        CHECK(answers(wall) == expected);
        CHECK(wall.keep().size() == 1); // one file, written
    }
    CHECK(kept == alone);
    {
        const DistanceField wall = made(read, cache, 2);
        CHECK(answers(wall) == expected);
        CHECK(wall.keep().size() == 1); // read, and nothing to write
    }
    CHECK(read == 0);
    answers(made(other, cache, 1, 0.2)); // another grid has samples of its own
    CHECK(other > 0);

    for (const auto& file : std::filesystem::directory_iterator(cache)) {
        std::string bytes = read_file(file.path().string());
        bytes[bytes.size() / 2] = char(bytes[bytes.size() / 2] ^ 1);
        write_file(file.path().string(), bytes);
    }
    const DistanceField wall = made(damaged, cache, 1);
    CHECK(answers(wall) == expected);
    CHECK(damaged == alone);
    REQUIRE(wall.keep().size() >= 1);
    CHECK(wall.keep()[0].find("ignored: damaged") != std::string::npos);
}

TEST_CASE("a bound of the distance far from a wall serves the places around it")
{
    class Bounded : public FunctionSource {
    public:
        explicit Bounded(int& bounds)
            : FunctionSource{[](const Vec3& x) { return 3 - x.norm(); }}
            , bounds_{bounds}
        {
        }
        double clearance(const Vec3& x, std::int32_t&) const override
        {
            ++bounds_;
            return 3 - x.norm();
        }

    private:
        int& bounds_;
    };
    int bounds = 0, places = 0;
    const DistanceField wall{std::make_unique<Bounded>(bounds), Vec3{0.013, 0.027, -0.011}, 0.1};
    WallHint hint;
    for (int k = -1000; k <= 1000; ++k, ++places) {
        const Vec3 x{0.001 * k, 0.3 + 0.02 * std::sin(0.1 * k), 0.2};
        const double true_one = 3 - x.norm(), least = wall.clearance(x, hint);
        CHECK(least <= true_one);
        CHECK(least > 0.75 * true_one);
    }
    CHECK(bounds < 0.02 * places); // one in a cell of the grid
    CHECK(bounds >= 20);
}

TEST_CASE(
    "with more threads than one, samples are taken ahead of a point that moves and no bit changes")
{
    const auto along = [](const DistanceField& wall, double to) {
        std::vector<double> found;
        WallHint hint;
        for (int k = 0; 0.02 * k <= to; ++k)
            found.push_back(wall.distance({0.02 * k, 0.3, -0.1}, hint));
        return found;
    };
    std::atomic<int> one{0}, two{0};
    const auto made = [](std::atomic<int>& bricks, int threads) {
        DistanceField wall{std::make_unique<CountedSource>(bricks), Vec3{0.01, 0.02, 0.03}, 0.1};
        wall.prepare("", threads);
        return wall;
    };
    const DistanceField alone = made(one, 1), helped = made(two, 2);
    CHECK(along(alone, 2) == along(helped, 2));
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (two <= one && std::chrono::steady_clock::now() < until)
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    CHECK(two > one); // of the block beyond the last one
    CHECK(along(alone, 6) == along(helped, 6));
    { // ends while it samples
        std::atomic<int> some{0};
        const DistanceField wall = made(some, 2);
        along(wall, 1);
    }
}

TEST_CASE("files of samples that are cut off, longer, or of something else are not taken")
{
    Bricks bricks;
    for (int k = 0; k < 5; ++k) {
        bricks[{k, -k, 3}] = std::make_unique<Brick>();
        bricks[{k, -k, 3}]->fill(k);
    }
    const std::string bytes = sample_bytes({1, 2}, bricks);
    Bricks back;
    CHECK(read_samples(bytes, {1, 2}, back) == "");
    CHECK(back.size() == 5);
    CHECK((*back.at({4, -4, 3}))[63] == 4);
    Bricks none;
    CHECK(read_samples(bytes, {1, 3}, none) == "of something else");
    for (std::size_t n = 0; n < bytes.size(); n += 7)
        CHECK(read_samples(std::string_view(bytes).substr(0, n), {1, 2}, none) == "damaged");
    CHECK(read_samples(bytes + "x", {1, 2}, none) == "damaged");
    CHECK(none.empty());
}

TEST_CASE("a field keeps at most 80 MB, and fills again what it has dropped" *
          doctest::test_suite("slow"))
{
    const DistanceField wall = field([](const Vec3& x) { return x.z(); }, 0.1);
    WallHint hint;
    const Vec3 first{0.123, 0.456, 0.789};
    const double before = wall.distance(first, hint);
    for (int i = 0; i < 300; ++i)
        for (int j = 0; j < 100; ++j)
            wall.distance({0.4 * i, 0.4 * j, 0.05}, hint);
    CHECK(wall.memory() < 80e6);
    CHECK(wall.memory() > 40e6);
    CHECK(wall.distance(first, hint) == before);
}
