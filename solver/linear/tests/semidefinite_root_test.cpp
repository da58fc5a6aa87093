#include "solver/linear/semidefinite_root.hpp"

#include <doctest/doctest.h>

using namespace amontons;

TEST_CASE("the root of a semidefinite matrix has as many rows as its rank")
{
    for (const int rank : {0, 1, 6, 30, 50}) {
        CAPTURE(rank);
        Eigen::MatrixXd C(rank, 50);
        for (Eigen::Index k = 0; k < C.size(); ++k)
            C.data()[k] = std::sin(1.0 + static_cast<double>(k * k % 1009));
        Eigen::MatrixXd W = C.transpose() * C;
        const Eigen::MatrixXd G = semidefinite_root(W);
        CHECK(G.rows() == rank);
        CHECK(G.cols() == 50);
        CHECK((G.transpose() * G - W).cwiseAbs().maxCoeff() <= 1e-13 * W.diagonal().sum());
    }
    CHECK(semidefinite_root(Eigen::MatrixXd(0, 0)).size() == 0);
}
