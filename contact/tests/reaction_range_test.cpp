#include "contact/reaction_range.hpp"

#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

constexpr double kAccuracy = 1e-8;

/// Normal contacts on a bar at these places: two balances, of force and moment.
ReactionSet supports(const std::vector<double>& place, const std::vector<double>& found)
{
    ReactionSet set;
    const auto n = Eigen::Index(place.size());
    Eigen::MatrixXd K(2, n);
    set.found = Eigen::Map<const Eigen::VectorXd>(found.data(), n);
    for (Eigen::Index i = 0; i < n; ++i) {
        K.col(i) << 1, place[std::size_t(i)];
        set.contact.push_back({int(i), ContactKind::frictionless});
    }
    set.K = K.sparseView(1, 0);
    set.upper = Eigen::Vector2d::Constant(kAccuracy);
    set.lower = -set.upper;
    return set;
}

ReactionInterval interval(const ReactionSet& set, const Eigen::VectorXd& c)
{
    ReactionRange range(set, 1e6);
    std::int64_t work = 1'000'000;
    const ReactionInterval i = range.interval(c, work);
    CHECK(i.certain);
    return i;
}

} // namespace

TEST_CASE("three supports in a row share a load in all ways that balance it")
{
    const ReactionSet set = supports({-1, 0, 1}, {0.25, 0.5, 0.25});
    const ReactionInterval outer = interval(set, Eigen::Vector3d(1, 0, 0)),
                           middle = interval(set, Eigen::Vector3d(0, 1, 0));
    CHECK(outer.min == doctest::Approx(0));
    CHECK(outer.max == doctest::Approx(0.5));
    CHECK(middle.min == doctest::Approx(0));
    CHECK(middle.max == doctest::Approx(1));
    const ReactionInterval sum = interval(set, Eigen::Vector3d(1, 1, 1));
    CHECK(sum.max - sum.min <= 2.01 * kAccuracy);
    ReactionRange range(set, 1e6);
    CHECK(range.widest(Eigen::Vector3d(1, 1, 1)) <= 3 * kAccuracy);
    CHECK(!std::isfinite(range.widest(Eigen::Vector3d(1, 0, 0))));
}

TEST_CASE("two supports are determined and by how much depends on how far they are apart")
{
    // Of d_1 + d_2 = 0 and |x (d_1 - d_2)| <= eps: |d_1| <= eps / (2 x).
    for (const double x : {1.0, 1e-2, 1e-5, 1e-7}) {
        CAPTURE(x);
        const ReactionSet set = supports({-x, x}, {0.5, 0.5});
        const ReactionInterval i = interval(set, Eigen::Vector2d(1, 0));
        const double half = 0.5 * (kAccuracy + kAccuracy / x);
        constexpr double kEnds = 1e-6; // of the load: ends are not sought closer
        CHECK(std::abs(i.max - (0.5 + half)) < kEnds + 1e-3 * half);
        CHECK(std::abs(i.min - (0.5 - half)) < kEnds + 1e-3 * half);
        ReactionRange range(set, 1e6);
        const double widest = range.widest(Eigen::Vector2d(1, 0));
        CHECK(widest >= 2 * half * (1 - 1e-9));
        if (x > 1e-4) CHECK(widest <= 3 * half);
    }
}

TEST_CASE("a wedge without friction holds what its load states and with friction an interval")
{
    // A block between planes at +-a, with N and T up along each of them: N cos a + T sin a = 1/2
    // where both are alike; |T| <= mu N.
    const double a = 0.5;
    for (const double mu : {0.1, 0.5}) {
        CAPTURE(mu);
        ReactionSet set;
        Eigen::MatrixXd K(3, 6); // forces, and the moment that makes both alike
        K << std::sin(a), -std::cos(a), 0, -std::sin(a), std::cos(a), 0, //
            std::cos(a), std::sin(a), 0, std::cos(a), std::sin(a), 0,    //
            0, 1, 0, 0, -1, 0;
        set.K = K.sparseView(1, 0);
        set.upper = Eigen::Vector3d::Constant(kAccuracy);
        set.lower = -set.upper;
        const double even = 0.5 / std::cos(a);
        set.found.resize(6);
        set.found << even, 0, 0, even, 0, 0;
        set.contact = {{0, ContactKind::frictional, mu}, {3, ContactKind::frictional, mu}};
        Eigen::VectorXd c = Eigen::VectorXd::Zero(6);
        c[0] = 1;
        const ReactionInterval i = interval(set, c);
        CHECK(i.min == doctest::Approx(0.5 / (std::cos(a) + mu * std::sin(a))).epsilon(2e-3));
        CHECK(i.max == doctest::Approx(0.5 / (std::cos(a) - mu * std::sin(a))).epsilon(2e-3));
        // What slides up keeps its friction: one answer.
        for (ReactionSet::Contact& k : set.contact) {
            k.slides = true;
            k.direction[0] = -mu;
        }
        const double up = 0.5 / (std::cos(a) - mu * std::sin(a));
        set.found << up, -mu * up, 0, up, -mu * up, 0;
        const ReactionInterval one = interval(set, c);
        CHECK(one.max - one.min < 1e-6);
        CHECK(one.max == doctest::Approx(up));
    }
}

TEST_CASE("what is squeezed between two walls has no upper bound")
{
    ReactionSet set;
    set.K = Eigen::RowVector2d(1, -1).sparseView();
    set.upper = Eigen::VectorXd::Constant(1, kAccuracy);
    set.lower = -set.upper;
    set.found = Eigen::Vector2d(1, 1);
    set.contact = {{0, ContactKind::frictionless}, {1, ContactKind::frictionless}};
    const ReactionInterval i = interval(set, Eigen::Vector2d(1, 0));
    CHECK(i.min == doctest::Approx(0));
    CHECK(std::isinf(i.max));
}
