#include "haptics/reduced_operator.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

constexpr double kFarthestBack = 4; // of the bend at the first sample

template <class Real> constexpr int kPerLine = static_cast<int>(64 / sizeof(Real));

/// Numbers of a column of 3n rows, filled up to whole lines.
template <class Real> int stride_of(int contacts)
{
    return (3 * contacts + kPerLine<Real> - 1) / kPerLine<Real> * kPerLine<Real>;
}

} // namespace

template <class Real>
ReducedOperator<Real>::ReducedOperator(int most_contacts)
    : capacity(most_contacts)
    , contact(static_cast<std::size_t>(most_contacts))
    , W(static_cast<std::size_t>(3 * most_contacts) *
        static_cast<std::size_t>(stride_of<Real>(most_contacts) / kPerLine<Real>))
    , own(contact.size())
    , block(contact.size())
{
}

template <class Real>
bool set_delassus(ReducedOperator<Real>& op, const Eigen::Ref<const Eigen::MatrixXd>& W)
{
    const auto rows = static_cast<int>(W.rows());
    const double trace = W.trace();
    op.contacts = 0;
    if (rows > 3 * op.capacity || rows % 3 != 0 || W.cols() != W.rows()) return false;
    if (rows > 0 && !(trace > 0 && std::isfinite(trace))) return false;
    op.contacts = rows / 3;
    op.stride = stride_of<Real>(op.contacts);
    op.compliance = rows > 0 ? trace / rows : 1;

    double square = 0;
    for (int i = 0; i < op.contacts; ++i)
        square += op.contact[static_cast<std::size_t>(i)].q.squaredNorm();
    const double size = std::max(op.validity, std::sqrt(square / std::max(op.contacts, 1)));
    op.length = size > 0 && std::isfinite(size) ? size : 1;

    for (int j = 0; j < rows; ++j) {
        Real* out = op.column(j);
        for (int i = 0; i < rows; ++i)
            out[i] = static_cast<Real>(W(i, j) / op.compliance);
        std::fill(out + rows, out + op.stride, Real{0});
    }
    for (int i = 0; i < op.contacts; ++i) {
        Mat3& A = op.own[static_cast<std::size_t>(i)];
        for (int k = 0; k < 3; ++k)
            for (int j = 0; j < 3; ++j)
                A(j, k) = static_cast<double>(op.column(3 * i + k)[3 * i + j]);
        op.block[static_cast<std::size_t>(i)] = prepare(A);
    }
    return true;
}

PathBlend blend_of_samples(const SampledPath& way, double s)
{
    if (way.samples == 0 || (s < 0 && !way.backwards)) return {};
    if (s <= way.at[0]) {
        const double share = s / way.at[0];
        return {0, 0, std::min(share * share, kFarthestBack)};
    }
    int i = 1;
    while (i < way.samples && s > way.at[std::size_t(i)])
        ++i;
    if (i == way.samples) return {i - 1, 0, 1};
    const double from = way.at[std::size_t(i) - 1], to = way.at[std::size_t(i)];
    return {i, (to - s) / (to - from), (s - from) / (to - from)};
}

Eigen::Matrix<double, 3, 6> rigid_jacobian(const Mat3& frame, const Vec3& arm)
{
    Mat3 cross;
    cross << 0, -arm[2], arm[1], arm[2], 0, -arm[0], -arm[1], arm[0], 0;
    Eigen::Matrix<double, 3, 6> J;
    J << frame.transpose(), -frame.transpose() * cross;
    return J;
}

void add_coupling(Eigen::Ref<Eigen::MatrixXd> W,
                  const Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 6>>& J, double k,
                  double k_turn)
{
    W.noalias() += J.leftCols<3>() * J.leftCols<3>().transpose() / k;
    W.noalias() += J.rightCols<3>() * J.rightCols<3>().transpose() / k_turn;
}

template <class Real> ContactProblem contact_problem(const ReducedOperator<Real>& op)
{
    const Eigen::Index rows = 3 * op.contacts;
    ContactProblem problem;
    Eigen::MatrixXd W(rows, rows);
    problem.q.resize(rows);
    problem.mu.resize(op.contacts);
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < rows; ++i)
            W(i, j) = op.compliance * static_cast<double>(op.column(j)[i]);
    problem.W = std::move(W);
    for (int i = 0; i < op.contacts; ++i) {
        const CandidateContact& c = op.contact[static_cast<std::size_t>(i)];
        problem.q.segment<3>(3 * i) = c.q;
        problem.mu[i] = c.mu;
    }
    return problem;
}

template struct ReducedOperator<float>;
template struct ReducedOperator<double>;
template bool set_delassus(ReducedOperator<float>&, const Eigen::Ref<const Eigen::MatrixXd>&);
template bool set_delassus(ReducedOperator<double>&, const Eigen::Ref<const Eigen::MatrixXd>&);
template ContactProblem contact_problem(const ReducedOperator<float>&);
template ContactProblem contact_problem(const ReducedOperator<double>&);

} // namespace amontons
