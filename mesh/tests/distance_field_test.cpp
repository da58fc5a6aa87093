#include "mesh/distance_field.hpp"

#include "mesh/tests/wall_checks.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <doctest/doctest.h>
#include <functional>
#include <random>

using namespace amontons;

namespace {

class FunctionSource : public DistanceSource {
public:
    explicit FunctionSource(std::function<double(const Vec3&)> f) : f_{std::move(f)} {}
    void sample_cube(const Vec3& corner, const Mat3& edges, int n,
                         double* out) const override
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

TEST_CASE("neither hints nor what was asked before change a bit of an answer")
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
