#include "solver/linear/gmres.hpp"

#include "mesh/base/dense.hpp"

namespace amontons {

GmresResult gmres(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& A,
                  const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& inverse,
                  const Eigen::VectorXd& b, double tolerance, int most)
{
    GmresResult out;
    Eigen::VectorXd r = inverse(b);
    const double size = r.norm();
    out.x = Eigen::VectorXd::Zero(b.size());
    if (!(size > 0)) return out;
    Eigen::MatrixXd V(b.size(), most + 1);
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(most + 1, most);
    V.col(0) = r / size;
    Eigen::VectorXd y;
    for (int k = 0; k < most; ++k) {
        Eigen::VectorXd w = inverse(A(V.col(k)));
        for (int pass = 0; pass < 2; ++pass) // the second takes out what rounding left
            for (int i = 0; i <= k; ++i) {
                const double h = V.col(i).dot(w);
                H(i, k) += h;
                w -= h * V.col(i);
            }
        H(k + 1, k) = w.norm();
        if (H(k + 1, k) > 0) V.col(k + 1) = w / H(k + 1, k);
        ++out.products;
        const Eigen::MatrixXd part = H.topLeftCorner(k + 2, k + 1);
        const Eigen::VectorXd right = size * Eigen::VectorXd::Unit(k + 2, 0);
        y = least_squares(part, right);
        out.residual = (part * y - right).norm() / size;
        if (out.residual <= tolerance || !(H(k + 1, k) > 0)) break;
    }
    out.x = V.leftCols(y.size()) * y;
    return out;
}

} // namespace amontons
