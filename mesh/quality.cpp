#include "mesh/quality.hpp"

#include "mesh/base/error.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace amontons {
namespace {

using Gradient = std::array<double, 3>; // of a shape function by the three local coordinates

struct Sample {
    double weight = 0; // of the volume integral; 0: det J is only examined
    std::array<Gradient, kMostElementNodes> gradient{};
};

// With L = 1 - r - s - t: corner functions L_i (2 L_i - 1), edge functions 4 L_i L_j.
Sample t10_sample(double r, double s, double t, double weight)
{
    const std::array<double, 4> l{1 - r - s - t, r, s, t};
    constexpr std::array<Gradient, 4> dl{{{-1, -1, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    Sample sample;
    sample.weight = weight;
    for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t i = 0; i < 4; ++i)
            sample.gradient[i][k] = (4 * l[i] - 1) * dl[i][k];
        for (const LocalEdge& e : shape_of(ElementKind::T10).edges) {
            const auto i = static_cast<std::size_t>(e.begin), j = static_cast<std::size_t>(e.end);
            sample.gradient[static_cast<std::size_t>(e.middle)][k] =
                4 * (l[i] * dl[j][k] + l[j] * dl[i][k]);
        }
    }
    return sample;
}

constexpr std::array<Gradient, 8> kCubeGradients{{{-1, -1, -1},
                                                  {1, -1, -1},
                                                  {1, 1, -1},
                                                  {-1, 1, -1},
                                                  {-1, -1, 1},
                                                  {1, -1, 1},
                                                  {1, 1, 1},
                                                  {-1, 1, 1}}};

Sample h8_sample(const Gradient& x, double weight)
{
    Sample sample;
    sample.weight = weight;
    for (std::size_t i = 0; i < 8; ++i) {
        const auto& c = kCubeGradients[i];
        const Gradient f{1 + c[0] * x[0], 1 + c[1] * x[1], 1 + c[2] * x[2]};
        sample.gradient[i] = {c[0] * f[1] * f[2] / 8, c[1] * f[0] * f[2] / 8,
                              c[2] * f[0] * f[1] / 8};
    }
    return sample;
}

std::vector<Sample> samples_of(ElementKind kind)
{
    std::vector<Sample> all;
    if (kind == ElementKind::T4) {
        Sample sample;
        sample.weight = 1. / 6;
        sample.gradient = {{{-1, -1, -1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
        all.push_back(sample);
    } else if (kind == ElementKind::T10) {
        // det J is cubic: the centre with weight -4/5 and four points with 9/20 are exact.
        all.push_back(t10_sample(0.25, 0.25, 0.25, -4. / 30));
        const double a = 1. / 6, b = (5 - std::sqrt(5.0)) / 20;
        for (int i = 0; i < 4; ++i) {
            const auto at = [&](double x, double weight) {
                const double y = 1 - 3 * x;
                return t10_sample(i == 1 ? y : x, i == 2 ? y : x, i == 3 ? y : x, weight);
            };
            all.push_back(at(a, 9. / 120));
            all.push_back(at(b, 0));
            all.push_back(at(0, 0)); // the corners
            all.push_back(
                at(1. / 3, 0)); // the middles of the faces, where a stiffness is integrated
        }
    } else {
        const double g = 1 / std::sqrt(3.0);
        for (const Gradient& c : kCubeGradients) {
            all.push_back(h8_sample({g * c[0], g * c[1], g * c[2]}, 1));
            all.push_back(h8_sample(c, 0));
        }
    }
    return all;
}

double angle_between(const Vec3& a, const Vec3& b)
{
    return std::atan2(a.cross(b).norm(), a.dot(b));
}

struct Corner { // of an element: itself and what its edges lead to
    int self = 0;
    std::array<int, 3> to{}; // counter-clockwise seen from inside, so that det > 0
};
constexpr Corner kT4Corners[] = {{0, {1, 2, 3}}, {1, {2, 0, 3}}, {2, {0, 1, 3}}, {3, {0, 2, 1}}};
constexpr Corner kH8Corners[] = {{0, {1, 3, 4}}, {1, {2, 0, 5}}, {2, {3, 1, 6}}, {3, {0, 2, 7}},
                                 {4, {7, 5, 0}}, {5, {4, 6, 1}}, {6, {5, 7, 2}}, {7, {6, 4, 3}}};

std::span<const Corner> corners_of(ElementKind kind)
{
    if (kind == ElementKind::H8) return kH8Corners;
    return kT4Corners;
}

const std::vector<Sample>& cached_samples(ElementKind kind)
{
    static const std::array<std::vector<Sample>, kElementKinds> all{
        samples_of(ElementKind::T4), samples_of(ElementKind::T10), samples_of(ElementKind::H8)};
    return all[static_cast<std::size_t>(kind)];
}

Spread spread_of(std::vector<double> values)
{
    if (values.empty()) return {};
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return {*std::min_element(values.begin(), middle + 1), *middle,
            *std::max_element(middle, values.end())};
}

} // namespace

ElementQuality quality_of(const VolumeMesh& mesh, const ElementView& element)
{
    std::array<Vec3, kMostElementNodes> x;
    std::array<Eigen::Vector4d, kMostElementNodes> from_first; // four numbers: whole registers
    for (std::size_t i = 0; i < element.nodes.size(); ++i) {
        AMONTONS_ASSERT(static_cast<std::size_t>(element.nodes[i]) < mesh.nodes.size());
        x[i] = mesh.nodes[static_cast<std::size_t>(element.nodes[i])];
        from_first[i] << x[i] - x[0], 0;
    }
    ElementQuality q;
    q.least_jacobian = std::numeric_limits<double>::infinity();
    q.greatest_jacobian = -q.least_jacobian;
    for (const Sample& sample : cached_samples(element.kind)) {
        Eigen::Matrix<double, 4, 3> jacobian = Eigen::Matrix<double, 4, 3>::Zero();
        for (std::size_t i = 0; i < element.nodes.size(); ++i)
            for (int k = 0; k < 3; ++k)
                jacobian.col(k) += sample.gradient[i][static_cast<std::size_t>(k)] * from_first[i];
        const double det = jacobian.topRows<3>().determinant();
        q.volume += sample.weight * det;
        q.least_jacobian = std::min(q.least_jacobian, det);
        q.greatest_jacobian = std::max(q.greatest_jacobian, det);
    }

    const ElementShape& shape = shape_of(element.kind);
    double squares = 0;
    q.shortest_edge = std::numeric_limits<double>::infinity();
    for (const LocalEdge& e : shape.edges) {
        const double square =
            (x[static_cast<std::size_t>(e.begin)] - x[static_cast<std::size_t>(e.end)])
                .squaredNorm();
        squares += square;
        q.shortest_edge = std::min(q.shortest_edge, std::sqrt(square));
        q.longest_edge = std::max(q.longest_edge, std::sqrt(square));
    }

    q.least_dihedral = std::numbers::pi;
    q.shape = 1;
    for (const Corner& c : corners_of(element.kind)) {
        std::array<Vec3, 3> d;
        for (std::size_t k = 0; k < 3; ++k)
            d[k] = x[static_cast<std::size_t>(c.to[k])] - x[static_cast<std::size_t>(c.self)];
        for (std::size_t k = 0; k < 3; ++k) { // between the two faces at the edge k
            const Vec3 &edge = d[k], &a = d[(k + 1) % 3], &b = d[(k + 2) % 3];
            const double angle = angle_between(edge.cross(a), edge.cross(b));
            q.least_dihedral = std::min(q.least_dihedral, angle);
            q.greatest_dihedral = std::max(q.greatest_dihedral, angle);
        }
        const double lengths = d[0].norm() * d[1].norm() * d[2].norm();
        const double det = d[0].cross(d[1]).dot(d[2]);
        if (element.kind == ElementKind::H8)
            q.shape = std::min(q.shape, lengths > 0 ? det / lengths : 0.0);
        else if (c.self == 0) // 3 V = det / 2
            q.shape = squares > 0 ? std::copysign(12 * std::cbrt(det * det / 4) / squares, det) : 0;
    }
    return q;
}

std::vector<ElementQuality> measure_quality(const VolumeMesh& mesh)
{
    std::vector<ElementQuality> all;
    all.reserve(element_count(mesh));
    for_each_element(mesh, [&](std::int32_t, ElementKind kind, auto nodes) {
        all.push_back(quality_of(mesh, {kind, nodes}));
    });
    return all;
}

QualityReport report_of(const std::vector<ElementQuality>& all)
{
    const auto spread = [&](auto value) {
        std::vector<double> values;
        values.reserve(all.size());
        for (const ElementQuality& q : all)
            values.push_back(value(q));
        return spread_of(std::move(values));
    };
    using Q = ElementQuality;
    QualityReport report;
    for (const Q& q : all)
        report.volume += q.volume;
    report.element_volume = spread([](const Q& q) { return q.volume; });
    report.least_dihedral = spread([](const Q& q) { return q.least_dihedral; });
    report.greatest_dihedral = spread([](const Q& q) { return q.greatest_dihedral; });
    report.jacobian_ratio = spread([](const Q& q) { return q.jacobian_ratio(); });
    report.shape = spread([](const Q& q) { return q.shape; });
    report.aspect = spread([](const Q& q) { return q.aspect(); });
    report.longest_edge = spread([](const Q& q) { return q.longest_edge; });
    report.shortest_edge = spread([](const Q& q) { return q.shortest_edge; });
    return report;
}

} // namespace amontons
