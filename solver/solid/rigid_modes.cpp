#include "solver/solid/rigid_modes.hpp"

#include "mesh/base/dense.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

/// Pins at contact nodes are taken only if the best other one holds less than this share.
constexpr double kWeakPin = 1e-2;

using Motions = Eigen::Matrix<double, 3, 6>;

/// Columns: three shifts, three turns about the centre; `size` makes both of one order.
Motions motions(const Vec3& x, const Vec3& centre, double size)
{
    const Vec3 d = (x - centre) / size;
    Motions M;
    M.leftCols<3>().setIdentity();
    M.rightCols<3>() << 0, d[2], -d[1], -d[2], 0, d[0], d[1], -d[0], 0;
    return M;
}

/// Nodes of each part that elements connect.
std::vector<std::vector<std::int32_t>> connected_parts(const SolidPattern& pattern)
{
    const auto count = static_cast<std::int32_t>(pattern.start.size()) - 1;
    std::vector<char> seen(std::size_t(count), 0);
    std::vector<std::vector<std::int32_t>> parts;
    for (std::int32_t first = 0; first < count; ++first) {
        const auto has_element = [&](std::int32_t i) {
            return pattern.start[std::size_t(i)] < pattern.start[std::size_t(i) + 1];
        };
        if (seen[std::size_t(first)] || !has_element(first)) continue;
        std::vector<std::int32_t>& part = parts.emplace_back(1, first);
        seen[std::size_t(first)] = 1;
        for (std::size_t k = 0; k < part.size(); ++k) {
            const auto node = std::size_t(part[k]);
            for (std::int32_t e = pattern.start[node]; e < pattern.start[node + 1]; ++e) {
                const std::int32_t other = pattern.neighbour[std::size_t(e)];
                if (seen[std::size_t(other)]) continue;
                seen[std::size_t(other)] = 1;
                part.push_back(other);
            }
        }
        std::sort(part.begin(), part.end());
    }
    return parts;
}

using ModesOfPart = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, Eigen::Dynamic, 6>;

/// Rows 3 i .. 3 i + 2 belong to the part's i-th node.
ModesOfPart modes_of_part(std::span<const Vec3> places, std::span<const std::int32_t> part,
                          std::span<const char> is_prescribed)
{
    const auto count = static_cast<Eigen::Index>(part.size());
    Vec3 centre = Vec3::Zero();
    for (const std::int32_t node : part)
        centre += places[std::size_t(node)] / double(count);
    double size = 0;
    for (const std::int32_t node : part)
        size = std::max(size, (places[std::size_t(node)] - centre).norm());

    Eigen::Matrix<double, 6, 6> held = Eigen::Matrix<double, 6, 6>::Zero();
    for (const std::int32_t node : part) {
        const Motions M = motions(places[std::size_t(node)], centre, size);
        for (int a = 0; a < 3; ++a)
            if (is_prescribed[3 * std::size_t(node) + std::size_t(a)])
                held += M.row(a).transpose() * M.row(a);
    }
    const SymmetricEigen6 eigen = symmetric_eigen(held);
    const double limit = kRigidThreshold * eigen.values[5];
    Eigen::Index free = 0; // eigenvalues ascend
    while (free < 6 && eigen.values[free] <= limit)
        ++free;

    ModesOfPart R(3 * count, free);
    for (Eigen::Index i = 0; i < count; ++i)
        R.middleRows(3 * i, 3) = motions(places[std::size_t(part[std::size_t(i)])], centre, size) *
                                 eigen.vectors.leftCols(free);
    for (Eigen::Index i = 0; i < count; ++i)
        for (int a = 0; a < 3; ++a)
            if (is_prescribed[3 * std::size_t(part[std::size_t(i)]) + std::size_t(a)])
                R.row(3 * i + a).setZero(); // rounding
    if (free == 0) return R;
    const Eigen::MatrixXd gram = R.transpose() * R / double(count);
    const SymmetricEigen axes = symmetric_eigen(gram);
    R = R * (axes.vectors * axes.values.cwiseSqrt().cwiseInverse().asDiagonal());
    return R;
}

/// The row of R that the others chosen so far hold least, and its square, among those allowed.
struct Pin {
    Eigen::Index row = -1;
    double square = -1;
};
template <class Modes, class Allowed> Pin best_pin(const Modes& rest, Allowed allowed)
{
    Pin best;
    for (Eigen::Index i = 0; i < rest.rows(); ++i)
        if (const double square = rest.row(i).squaredNorm(); square > best.square && allowed(i))
            best = {i, square};
    return best;
}

/// As many pins as modes, one by one where the others hold least; at contact nodes if they must be.
/// @param dof  degree of freedom of a row of the modes
template <class Modes, class Dof>
void add_pins(Modes rest, std::span<const char> contact_node, Dof dof, RigidModes& modes)
{
    for (Eigen::Index k = 0; k < rest.cols(); ++k) {
        const Pin any = best_pin(rest, [](Eigen::Index) { return true; });
        Pin pin = any;
        if (!contact_node.empty())
            pin = best_pin(rest,
                           [&](Eigen::Index i) { return !contact_node[std::size_t(dof(i) / 3)]; });
        if (pin.square < kWeakPin * kWeakPin * any.square) {
            pin = any;
            modes.pins_at_contacts = true;
        }
        modes.pins.push_back(dof(pin.row));
        const Eigen::VectorXd held = rest.row(pin.row).transpose().normalized();
        rest -= (rest * held).eval() * held.transpose();
    }
}

} // namespace

RigidModes find_rigid_modes(std::span<const Vec3> places, const SolidPattern& pattern,
                            std::span<const std::int32_t> prescribed,
                            std::span<const char> contact_node)
{
    AMONTONS_ASSERT(pattern.start.size() == places.size() + 1);
    AMONTONS_ASSERT(contact_node.empty() || contact_node.size() == places.size());
    std::vector<char> is_prescribed(3 * places.size(), 0);
    for (const std::int32_t dof : prescribed) {
        AMONTONS_ASSERT(dof >= 0 && std::size_t(dof) < is_prescribed.size());
        is_prescribed[std::size_t(dof)] = 1;
    }

    RigidModes modes;
    std::vector<std::pair<std::vector<std::int32_t>, ModesOfPart>> found;
    Eigen::Index columns = 0;
    for (std::vector<std::int32_t>& part : connected_parts(pattern)) {
        ModesOfPart R = modes_of_part(places, part, is_prescribed);
        columns += R.cols();
        if (R.cols() > 0) found.emplace_back(std::move(part), std::move(R));
    }
    modes.R.setZero(3 * Eigen::Index(places.size()), columns);
    columns = 0;
    for (const auto& of_part : found) { // no structured binding: the lambda below captures it
        const auto& part = of_part.first;
        const auto& R = of_part.second;
        for (std::size_t i = 0; i < part.size(); ++i)
            modes.R.block(3 * part[i], columns, 3, R.cols()) = R.middleRows(3 * Eigen::Index(i), 3);
        columns += R.cols();

        add_pins(
            R, contact_node,
            [&](Eigen::Index i) { return 3 * part[std::size_t(i / 3)] + std::int32_t(i % 3); },
            modes);
    }
    std::sort(modes.pins.begin(), modes.pins.end());
    return modes;
}

RigidModes not_resisted(const RigidModes& modes, const SparseMatrix& springs,
                        std::span<const char> contact_node)
{
    const Eigen::MatrixXd resisted = modes.R.transpose() * (springs * modes.R);
    const SymmetricEigen eigen = symmetric_eigen(resisted);
    const double limit = kRigidThreshold * eigen.values.tail(1)[0];
    Eigen::Index free = 0; // eigenvalues ascend
    while (free < eigen.values.size() && eigen.values[free] <= limit)
        ++free;
    RigidModes left;
    left.R = modes.R * eigen.vectors.leftCols(free);
    add_pins(
        left.R, contact_node, [](Eigen::Index i) { return std::int32_t(i); }, left);
    std::sort(left.pins.begin(), left.pins.end());
    return left;
}

} // namespace amontons
