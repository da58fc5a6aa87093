#include "mesh/layered_field.hpp"

#include "mesh/tests/wall_checks.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <doctest/doctest.h>
#include <functional>
#include <memory>
#include <random>

using namespace amontons;

namespace {

/// A distance that counts its samples.
class CountedFunction : public DistanceSource {
public:
    CountedFunction(std::function<double(const Vec3&)> f, std::atomic<int>& cubes)
        : f_{std::move(f)}
        , cubes_{cubes}
    {
    }
    void sample_cube(const Vec3& corner, const Mat3& edges, int n, double* out) const override
    {
        ++cubes_;
        for (int i = 0; i < n; ++i)
            for (int j = 0; j < n; ++j)
                for (int k = 0; k < n; ++k)
                    *out++ = f_(corner + edges * Vec3{1.0 * i, 1.0 * j, 1.0 * k});
    }
    double clearance(const Vec3& x, std::int32_t&) const override { return f_(x); }

private:
    std::function<double(const Vec3&)> f_;
    std::atomic<int>& cubes_;
};

// Two distances that differ, so that what lies between them is tested.
double plain(const Vec3& x)
{
    return 0.9 * x.x() + 0.3 * x.y() + 0.2;
}
double bent(const Vec3& x)
{
    return 0.7 * x.x() + 0.14 * x.y() * x.y() - 0.07 * x.x() * x.z() + 0.3;
}

const FieldWindow kWindow{Vec3{0.2, 0, 0}, Vec3{0, 0.6, 0.8}, 0.5, 0.4, 0.6, 0.5};

DistanceField counted(double (*f)(const Vec3&), std::atomic<int>& cubes, double spacing)
{
    return {std::make_unique<CountedFunction>(f, cubes), Vec3{0.013, 0.027, -0.011}, spacing};
}

LayeredField layered(std::atomic<int>& coarse, std::atomic<int>& fine)
{
    std::vector<LayeredField::Layer> finer;
    finer.push_back({counted(bent, fine, 0.05), kWindow});
    return {counted(plain, coarse, 0.11), std::move(finer)};
}

/// A place by its way along the window's line and its distance from that.
Vec3 place(double along, double aside, double turn)
{
    const Vec3 u = kWindow.along.unitOrthogonal(), v = kWindow.along.cross(u);
    return kWindow.start + along * kWindow.along +
           aside * (std::cos(turn) * u + std::sin(turn) * v);
}

} // namespace

TEST_CASE("of two grids each is alone where its part is whole, and takes no samples of the other")
{
    std::atomic<int> coarse{0}, fine{0}, unused{0};
    const LayeredField both = layered(coarse, fine);
    const DistanceField coarse_alone = counted(plain, unused, 0.11),
                        fine_alone = counted(bent, unused, 0.05);
    const auto same = [](const auto& a, const auto& b, const Vec3& x) {
        WallHint first, second;
        const WallSample s = a.sample(x, first), t = b.sample(x, second);
        return s.distance == t.distance && s.normal == t.normal && s.hessian == t.hessian &&
               s.slope == t.slope && a.distance(x, first) == b.distance(x, second);
    };
    CHECK(same(both, fine_alone, place(0.6, 0.55, 1)));
    CHECK(same(both, fine_alone, place(4, 0.1, 2)));
    CHECK(fine > 0);
    CHECK(coarse == 0);
    const int before = fine;
    CHECK(same(both, coarse_alone, place(1, 1.15, 1)));
    CHECK(same(both, coarse_alone, place(0.05, 0.2, 1)));
    CHECK(coarse > 0);
    CHECK(fine == before);
    WallHint hint;
    CHECK(std::isnan(both.sample(Vec3::Constant(std::nan("")), hint).distance));
}

TEST_CASE("between two grids normal and Hessian are the derivatives of the distance")
{
    std::atomic<int> coarse{0}, fine{0};
    const LayeredField both = layered(coarse, fine);
    std::mt19937 draw{11};
    std::uniform_real_distribution<double> along{-0.1, 0.8}, aside{0, 1.2}, turn{0, 6.3};
    int between = 0;
    double value = 0, gradient = 0, hessian = 0;
    for (int k = 0; k < 3000; ++k) {
        const Vec3 x = place(along(draw), aside(draw), turn(draw));
        const double part = kWindow.value(x);
        if (!(part > 0.01 && part < 0.99)) continue;
        ++between;
        WallHint hint;
        const WallSample s = both.sample(x, hint);
        value = std::max({value, std::abs(s.distance - both.distance(x, hint)),
                          std::abs(s.distance - (1 - part) * plain(x) - part * bent(x))});
        const double step = 1e-5;
        Vec3 slope;
        for (int a = 0; a < 3; ++a) {
            const Vec3 d = step * Vec3::Unit(a);
            slope[a] = (both.distance(x + d, hint) - both.distance(x - d, hint)) / (2 * step);
            const Vec3 across = Vec3::Unit(a) - s.normal * s.normal[a];
            const WallSample up = both.sample(x + step * across, hint),
                             down = both.sample(x - step * across, hint);
            hessian = std::max(
                hessian, ((up.normal - down.normal) / (2 * step) - s.hessian * across).norm());
        }
        gradient = std::max(gradient, (slope - s.slope * s.normal).norm());
    }
    REQUIRE(between > 300);
    CHECK(value < 1e-12);
    CHECK(gradient < 1e-8);
    CHECK(hessian < 1e-5);
}

TEST_CASE("a view of two grids gives their bits, and a bound that holds for both")
{
    std::atomic<int> coarse{0}, fine{0};
    const LayeredField both = layered(coarse, fine), bounded = layered(coarse, fine);
    const LayeredField view = both.share();
    std::mt19937 draw{13};
    std::uniform_real_distribution<double> along{-0.5, 1.5}, aside{0, 1.5}, turn{0, 6.3};
    int known = 0;
    for (int k = 0; k < 500; ++k) {
        const Vec3 x = place(along(draw), aside(draw), turn(draw));
        WallHint hint, other, third;
        CHECK(both.distance(x, hint) == view.distance(x, other));
        const double least = bounded.clearance(x, third);
        CHECK(least <= both.distance(x, hint));
        known += least > 0;
    }
    CHECK(known > 100);
}
