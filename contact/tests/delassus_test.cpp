#include "contact/delassus.hpp"

#include <doctest/doctest.h>

#include <random>

using namespace amontons;

namespace {

/// Some entries, some of them without their mirror image, some zeros that are stored.
Eigen::MatrixXd random_positive(int rows, std::mt19937& rng)
{
    std::normal_distribution<double> normal;
    Eigen::MatrixXd W = Eigen::MatrixXd::Zero(rows, rows);
    for (int k = 0; k < 3 * rows; ++k) {
        const auto i = static_cast<Eigen::Index>(rng() % static_cast<unsigned>(rows));
        const auto j = static_cast<Eigen::Index>(rng() % static_cast<unsigned>(rows));
        W(i, j) = normal(rng);
        if (k % 3) W(j, i) = k % 2 ? W(i, j) : normal(rng);
    }
    return W;
}

} // namespace

TEST_CASE("a sparse W has the same properties as the dense one")
{
    std::mt19937 rng{1};
    for (const int rows : {1, 2, 3, 9, 30, 60})
        for (int k = 0; k < 10; ++k) {
            CAPTURE(rows);
            CAPTURE(k);
            const Eigen::MatrixXd W = random_positive(rows, rng);
            Delassus::Sparse entries = W.sparseView();
            entries.coeffRef(rows - 1, 0) += 0; // stored, and often zero
            const Delassus dense{Eigen::MatrixXd(W)}, sparse{Delassus::Sparse(entries)};
            const double expected = W.norm() > 0 ? (W - W.transpose()).norm() / W.norm() : 0;
            CHECK(dense.asymmetry() == doctest::Approx(expected).epsilon(1e-12));
            CHECK(sparse.asymmetry() == doctest::Approx(expected).epsilon(1e-12));
            CHECK(sparse.diagonal() == W.diagonal());
            for (int row = 0; row + 3 <= rows; ++row)
                CHECK((sparse.block(row, 3) - W.block(row, row, 3, 3)).norm() == 0);
        }
}

TEST_CASE("apply_exactly rounds once, in each form of W")
{
    // (2^45 + 1)^2 = 2^90 + 2^46 + 1: the one is lost in a double and in 64 digits.
    const double a = std::ldexp(1, 45) + 1, b = std::ldexp(1, 45), c = std::ldexp(1, 46);
    Eigen::MatrixXd W = Eigen::MatrixXd::Zero(3, 3);
    W.row(0) << a, b, c;
    W.col(0) = W.row(0);
    const Eigen::Vector3d r(a, -b, -1), q(2, 0, 0);
    Eigen::VectorXd u;
    for (const Delassus& form :
         {Delassus(Eigen::MatrixXd(W)), Delassus(Delassus::Sparse(W.sparseView()))}) {
        form.apply_exactly(r, q, u);
        CHECK(u[0] == 3);
        CHECK(u[1] == b * a);
    }

    // One body with one mode: W = G^T G, and G r = (2^30 + 1)^2 - 2^60 = 2^31 + 1.
    const double e = std::ldexp(1, 30);
    DelassusOfBodies bodies;
    bodies.parts.push_back({{0, 1}, Eigen::RowVector2d(e + 1, e)});
    bodies.compliance = Eigen::Vector2d(0, 2);
    const Delassus of_bodies(bodies);
    of_bodies.apply_exactly(Eigen::Vector2d(e + 1, -e),
                            Eigen::Vector2d(-(2 * e * e + 3 * e), -2 * e * e), u);
    CHECK(u[0] == 1);
    CHECK(u[1] == -e);
}
