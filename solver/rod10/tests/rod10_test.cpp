#include "solver/rod10/rod10.hpp"

#include "mesh/base/error.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <doctest/doctest.h>
#include <random>

using namespace amontons;

namespace {

Mat3 some_rotation(std::mt19937& rng)
{
    std::normal_distribution<double> normal;
    return Eigen::Quaterniond(normal(rng), normal(rng), normal(rng), normal(rng))
        .normalized()
        .toRotationMatrix();
}

} // namespace

TEST_CASE("the table of a rod's rotation is that of turns about x and y and z in this order")
{
    const Vec3 a(0.3, -0.7, 1.1);
    const Mat3 turn =
        (Eigen::AngleAxisd(a.z(), Vec3::UnitZ()) * Eigen::AngleAxisd(a.y(), Vec3::UnitY()) *
         Eigen::AngleAxisd(a.x(), Vec3::UnitX()))
            .toRotationMatrix();
    CHECK((rotation_of_angles(a) - turn.transpose()).norm() < 1e-15);
}

TEST_CASE("rigid motions of an element need no force")
{
    const Mat10 k = element_stiffness(Rod10{});
    CHECK((k - k.transpose()).norm() == 0);
    const double L = Rod10{}.element(), size = k.norm();
    Eigen::Matrix<double, 10, 5> rigid = Eigen::Matrix<double, 10, 5>::Zero();
    for (int i = 0; i < 3; ++i)
        rigid(i, i) = rigid(5 + i, i) = 1;
    rigid(3, 3) = rigid(8, 3) = 1; // about y: the second node falls along z
    rigid(7, 3) = -L;
    rigid(4, 4) = rigid(9, 4) = 1; // about z
    rigid(6, 4) = L;
    CHECK((k * rigid).norm() < 1e-14 * size);
}

TEST_CASE("stored numbers are those of the paper: 855 against 2025 for ten nodes")
{
    CHECK(stored_band(10) == 855);
    CHECK(stored_full(10) == 2025);
    CHECK(assemble_band(Rod10{}, Mat3::Identity()).stored() == 855);
    CHECK(assemble_full(Rod10{}, Mat3::Identity()).values.size() == 2025);
}

TEST_CASE("band and full decompositions give the same deflections")
{
    std::mt19937 rng{3};
    std::normal_distribution<double> normal;
    Rod10 rod;
    rod.nodes = 14;
    const Mat3 m = some_rotation(rng);
    BandMatrix band = assemble_band(rod, m);
    FullMatrix full = assemble_full(rod, m);
    factor_band(band);
    factor_full(full);
    std::vector<double> x(std::size_t(rod.unknowns()));
    for (double& v : x)
        v = normal(rng);
    std::vector<double> y = x;
    solve_band(band, x);
    solve_full(full, y);
    double most = 0, miss = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        most = std::max(most, std::abs(x[i]));
        miss = std::max(miss, std::abs(x[i] - y[i]));
    }
    CHECK(miss < 1e-10 * most);
}

TEST_CASE("a rod answers in its own frame wherever it points")
{
    std::mt19937 rng{5};
    Rod10 rod;
    Rod10Solver still(rod), turned(rod);
    const Mat3 m = some_rotation(rng);
    still.orient(Mat3::Identity());
    turned.orient(m);
    std::vector<Rod10Node> load(10), same(10);
    load[6].along = Vec3(3e-5, -1e-5, 2e-5);
    load[9].turn = {1e-6, -2e-6};
    for (std::size_t i = 0; i < 10; ++i) {
        same[i] = load[i];
        same[i].along = m.transpose() * load[i].along;
    }
    const auto a = still.deflections(load), b = turned.deflections(same);
    for (std::size_t i = 0; i < 10; ++i) {
        CHECK((m * b[i].along - a[i].along).norm() < 1e-10 * a[9].along.norm());
        CHECK(std::abs(b[i].turn[1] - a[i].turn[1]) < 1e-10 * std::abs(a[9].turn[1]));
    }
}

TEST_CASE("a torque about its axis is refused as are bad sizes")
{
    Rod10Solver s(Rod10{});
    const Mat3 m = rotation_of_angles({0.1, 0.4, -0.8});
    s.orient(m);
    CHECK_THROWS_AS(s.moment(m.transpose() * Vec3(1e-3, 1, 0)), InputError);
    CHECK(std::abs(s.moment(m.transpose() * Vec3(0, 2, 1)).turn[0] - 2) < 1e-14);
    Rod10 bad;
    bad.length = -1;
    bad.diameter = 0;
    bad.nodes = 1;
    try {
        check(bad);
        FAIL("accepted");
    } catch (const InputError& error) {
        CHECK(error.issues().size() == 3);
    }
}
