#include "contact/solvers/local.hpp"

#include "contact/tests/contact_problems.hpp"

#include <Eigen/Dense>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

/// The error of one contact in the size of its own round-off: || |A||r| + |b| ||.
double error_in_round_off(const Mat3& A, double mu, const Vec3& b, const Vec3& r)
{
    const ContactProblem p{Eigen::MatrixXd(A), b, Eigen::VectorXd::Constant(1, mu), {}, {}};
    const double terms = (A.cwiseAbs() * r.cwiseAbs() + b.cwiseAbs()).norm();
    // Not by the trace: that of an indefinite block is no scale.
    const double error = static_cast<double>(test::reference_error(p, r, 1 / A.norm()));
    return error * b.norm() / terms;
}

double log_uniform(std::mt19937& rng, double low, double high)
{
    return std::pow(10, std::uniform_real_distribution<double>(low, high)(rng));
}

struct RandomBlock {
    Mat3 A;
    Vec3 b;
    double mu;
};

/// A = D (G G^T) D with rank 1 to 3 of G, D graded by up to `grading` decades, all times a scale
/// of 1e-12 to 1e12; b independently scaled.
RandomBlock random_block(std::mt19937& rng, int rank, double grading, double skew)
{
    std::normal_distribution<double> normal;
    const auto gaussian = [&] { return Vec3{normal(rng), normal(rng), normal(rng)}; };
    RandomBlock block;
    block.A.setZero();
    for (int k = 0; k < rank; ++k) {
        const Vec3 g = gaussian();
        block.A += g * g.transpose();
    }
    block.A(1, 2) += skew * normal(rng) * block.A.norm();
    block.A(0, 1) += skew * normal(rng) * block.A.norm();
    const Vec3 D{log_uniform(rng, -grading, 0), log_uniform(rng, -grading, 0),
                 log_uniform(rng, -grading, 0)};
    block.A = D.asDiagonal() * block.A * D.asDiagonal() * log_uniform(rng, -12, 12);
    block.b = gaussian() * log_uniform(rng, -12, 12);
    const double friction[] = {0, 0.01, 0.3, 1, 2, 10};
    block.mu = friction[rng() % 6];
    return block;
}

} // namespace

TEST_CASE("any positive definite block is solved to round-off")
{
    std::mt19937 rng{1};
    int count[4] = {};
    double worst[2] = {};
    for (int k = 0; k < 40000; ++k) {
        const bool graded = k % 2;
        const RandomBlock x = random_block(rng, 3, graded ? 3 : 0, 0);
        const LocalReaction local = solve_local(prepare(x.A), x.mu, x.b);
        ++count[static_cast<int>(local.state)];
        const double error = error_in_round_off(x.A, x.mu, x.b, local.r);
        worst[graded] = std::max(worst[graded], error);
        CAPTURE(x.A);
        CAPTURE(x.b.transpose());
        CAPTURE(x.mu);
        REQUIRE(local.state != LocalState::unsolved);
        REQUIRE(error <= (graded ? 1e-12 : 1e-14));
    }
    MESSAGE("worst error over round-off size " << worst[0] << ", graded " << worst[1] << "; open "
                                               << count[0] << ", stick " << count[1] << ", slip "
                                               << count[2]);
    for (int state = 0; state < 3; ++state)
        CHECK(count[state] > 3000);
}

TEST_CASE("a loose slip from a near guess is on the cone and off by second order")
{
    std::mt19937 rng{7};
    int slips = 0;
    for (int k = 0; k < 20000; ++k) {
        const RandomBlock x = random_block(rng, 3, 0, 0);
        const LocalBlock block = prepare(x.A);
        const LocalReaction exact = solve_local(block, x.mu, x.b);
        if (exact.state != LocalState::slip || x.mu == 0) continue;
        const double away = log_uniform(rng, -6, -2.3); // in S + s: a Newton step further is near
        const double guess = exact.multiplier + away * (block.small + exact.multiplier);
        const LocalReaction loose = solve_local(block, x.mu, x.b, guess, true);
        CAPTURE(x.A);
        CAPTURE(x.b.transpose());
        CAPTURE(x.mu);
        CAPTURE(away);
        ++slips;
        REQUIRE(loose.state == LocalState::slip);
        const double t = loose.r.tail<2>().norm();
        REQUIRE(std::abs(t - x.mu * loose.r[0]) <= 1e-15 * t);
        // The step's own second order, by how much h bends: mu |A_nt| / A_nn.
        const double bend = 1 + x.mu * block.coupling;
        REQUIRE((loose.r - exact.r).norm() <=
                (100 * bend * away * away + 1e-12 * bend) * exact.r.norm());
    }
    CHECK(slips > 4000);
}

TEST_CASE("a slightly unsymmetric block is solved as it is given")
{
    std::mt19937 rng{2};
    double worst = 0;
    for (int k = 0; k < 10000; ++k) {
        RandomBlock x = random_block(rng, 3, 0, 2.5e-3);
        // An indefinite symmetric part is another matter.
        if (Eigen::SelfAdjointEigenSolver<Mat3>((x.A + x.A.transpose()) / x.A.norm())
                .eigenvalues()[0] < 1e-2)
            continue;
        const LocalReaction local = solve_local(prepare(x.A), x.mu, x.b);
        CAPTURE(x.A);
        CAPTURE(x.b.transpose());
        CAPTURE(x.mu);
        REQUIRE(local.state != LocalState::unsolved);
        const double error = error_in_round_off(x.A, x.mu, x.b, local.r);
        worst = std::max(worst, error);
        REQUIRE(error <= 1e-13);
        // It can fail: the symmetrised block has another answer.
        if (local.state == LocalState::stick) {
            const Mat3 symmetric = (x.A + x.A.transpose()) / 2;
            const Vec3 other = solve_local(prepare(symmetric), x.mu, x.b).r;
            CHECK(error_in_round_off(x.A, x.mu, x.b, other) > 1e-10);
        }
    }
}

TEST_CASE("a singular block is solved or reported as unsolved with r = 0")
{
    std::mt19937 rng{3};
    int solved = 0, unsolved = 0;
    for (int k = 0; k < 20000; ++k) {
        const RandomBlock x = random_block(rng, 1 + k % 2, k % 4 < 2 ? 0 : 3, 0);
        // Half of them with b in the range of A: a reaction that sticks exists.
        const bool in_range = k % 3 == 0;
        const Vec3 b = in_range ? Vec3(-x.A * Vec3{1, 0.1 * x.mu, 0}) : x.b;
        const LocalReaction local = solve_local(prepare(x.A), x.mu, b);
        CAPTURE(x.A);
        CAPTURE(b.transpose());
        CAPTURE(x.mu);
        REQUIRE(local.r.allFinite());
        if (local.state == LocalState::unsolved) {
            ++unsolved;
            REQUIRE(local.r.isZero(0));
            continue;
        }
        ++solved;
        REQUIRE(error_in_round_off(x.A, x.mu, b, local.r) <= 1e-12);
    }
    MESSAGE(solved << " solved, " << unsolved << " without a solution");
    CHECK(solved > 10000);
}

TEST_CASE("zero and indefinite and meaningless blocks end in a named state")
{
    const Vec3 closing{-1, 0.3, 0};
    CHECK(solve_local(prepare(Mat3::Zero()), 0.5, closing).state == LocalState::unsolved);
    CHECK(solve_local(prepare(Mat3::Zero()), 0.5, -closing).state == LocalState::open);
    CHECK(solve_local(prepare(-Mat3::Identity()), 0.5, closing).state == LocalState::unsolved);
    CHECK(solve_local(prepare(Mat3::Constant(NAN)), 0.5, closing).state == LocalState::unsolved);
    CHECK(solve_local(prepare(Mat3::Identity()), 0.5, {-1, NAN, 0}).state == LocalState::unsolved);

    std::mt19937 rng{4};
    std::normal_distribution<double> normal;
    for (int k = 0; k < 20000; ++k) {
        Mat3 A;
        for (double& x : A.reshaped())
            x = normal(rng);
        A = (A + A.transpose()).eval();
        const Vec3 b{normal(rng), normal(rng), normal(rng)};
        const LocalReaction local = solve_local(prepare(A), 0.7, b);
        REQUIRE(local.r.allFinite());
        if (local.state != LocalState::unsolved)
            REQUIRE(error_in_round_off(A, 0.7, b, local.r) <= 1e-11);
    }
}

TEST_CASE("turning the tangents turns the answer")
{
    std::mt19937 rng{5};
    for (int k = 0; k < 2000; ++k) {
        const RandomBlock x = random_block(rng, 3, 0, 0);
        const double angle = 0.1 + static_cast<double>(k);
        Mat3 Q = Mat3::Identity();
        Q.bottomRightCorner<2, 2>() << std::cos(angle), -std::sin(angle), std::sin(angle),
            std::cos(angle);
        // Several solutions may exist when friction couples strongly to the normal.
        if (x.mu * x.A.block<1, 2>(0, 1).norm() >= x.A(0, 0)) continue;
        const Vec3 r = solve_local(prepare(x.A), x.mu, x.b).r;
        const Vec3 turned = solve_local(prepare(Q * x.A * Q.transpose()), x.mu, Q * x.b).r;
        const double condition = x.A.norm() * x.A.inverse().norm();
        CHECK((Q * r - turned).norm() <= 1e-14 * condition * r.norm());
    }
}

TEST_CASE("the guess changes the effort and not the answer")
{
    std::mt19937 rng{6};
    for (int k = 0; k < 5000; ++k) {
        const RandomBlock x = random_block(rng, 3, 2, 0);
        const LocalBlock block = prepare(x.A);
        if (x.mu * x.A.block<1, 2>(0, 1).norm() >= x.A(0, 0)) continue;
        const Vec3 b = x.b;
        for (double guess : {1e-30, 1e-3, 1.0, 1e30, static_cast<double>(NAN)}) {
            const LocalReaction local = solve_local(block, x.mu, b, guess * x.A.norm());
            REQUIRE(error_in_round_off(x.A, x.mu, b, local.r) <= 1e-13);
        }
    }
}

TEST_CASE("loose answers that each begin from the one before become the exact one")
{
    std::mt19937 rng{7};
    int slips = 0;
    for (int k = 0; k < 2000; ++k) {
        const RandomBlock x = random_block(rng, 3, 1, 0);
        if (x.mu == 0) continue;
        const LocalBlock block = prepare(x.A);
        LocalReaction local = solve_local(block, x.mu, x.b);
        if (local.state != LocalState::slip) continue;
        ++slips;
        const double exact = local.multiplier;
        REQUIRE(exact > 0);
        local.multiplier *= 1.5;
        double last = 1;
        for (int step = 0; step < 8; ++step) {
            local = solve_local(block, x.mu, x.b, local.multiplier, 1e-2);
            REQUIRE(local.state == LocalState::slip);
            // On the cone whatever the multiplier is.
            CHECK(std::abs(local.r.tail<2>().norm() - x.mu * local.r[0]) <=
                  1e-15 * local.r.norm() * (1 + x.mu));
            const double now = std::abs(local.multiplier / exact - 1);
            CHECK(now <= std::max(last, 1e-9));
            last = now;
        }
        CHECK(error_in_round_off(x.A, x.mu, x.b, local.r) <= 1e-13);
    }
    CHECK(slips > 500);
}
