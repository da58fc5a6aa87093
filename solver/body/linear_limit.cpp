#include "solver/body/linear_limit.hpp"

#include "mesh/base/dense.hpp"

#include <cmath>
#include <fmt/format.h>

namespace amontons {
namespace {

constexpr double kMostRotation = 0.1; // [rad]
constexpr double kMostStrain = 0.1;

/// The mean of d f / d xi over the corners of an element, f given at its nodes.
template <class At> Mat3 mean_derivative(ElementKind kind, const At& f)
{
    Mat3 d = Mat3::Zero();
    if (kind != ElementKind::H8) {
        for (int i = 0; i < 3; ++i)
            d.col(i) = f(i + 1) - f(0);
        return d;
    }
    constexpr int kSign[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                 {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
    for (int node = 0; node < 8; ++node)
        for (int i = 0; i < 3; ++i)
            d.col(i) += 0.125 * kSign[node][i] * f(node);
    return d;
}

std::string at_text(std::array<double, 3> x, double time)
{
    const double size = std::hypot(x[0], x[1], x[2]);
    for (double& c : x)
        if (std::abs(c) < 1e-9 * size) c = 0; // round-off of a mean
    return fmt::format("at ({:.3g}, {:.3g}, {:.3g}), t = {:.4g} s", x[0], x[1], x[2], time);
}

} // namespace

void LinearLimit::note(const VolumeMesh& mesh, std::span<const Vec3> places, const Mat3& turn,
                       double time)
{
    for_each_element(mesh, [&](std::int32_t, ElementKind kind, auto nodes) {
        const Mat3 X = mean_derivative(
            kind, [&](int i) { return mesh.nodes[std::size_t(nodes[std::size_t(i)])]; });
        const Mat3 x = mean_derivative(
            kind, [&](int i) { return places[std::size_t(nodes[std::size_t(i)])]; });
        const Mat3 G = turn.transpose() * x * X.inverse() - Mat3::Identity();
        const Mat3 E = 0.5 * (G + G.transpose());
        const double w = 0.5 * Vec3(G(2, 1) - G(1, 2), G(0, 2) - G(2, 0), G(1, 0) - G(0, 1)).norm();
        const auto middle = [&] {
            Vec3 m = Vec3::Zero();
            const int corners = shape_of(kind).corners;
            for (int i = 0; i < corners; ++i)
                m += mesh.nodes[std::size_t(nodes[std::size_t(i)])] / corners;
            return std::array{m.x(), m.y(), m.z()};
        };
        if (w > rotation) {
            rotation = w;
            rotated_at = middle();
            rotated_when = time;
        }
        if (!(E.norm() > strain)) return; // no principal strain is larger
        const double largest = symmetric_eigenvalues(E).cwiseAbs().maxCoeff();
        if (!(largest > strain)) return;
        strain = largest;
        strained_at = middle();
        strained_when = time;
    });
}

std::string LinearLimit::warning(const std::string& body) const
{
    if (rotation < kMostRotation && strain < kMostStrain) return "";
    std::string text = body + " is linear, but an element of it ";
    if (rotation >= kMostRotation)
        text += fmt::format("turned by {:.2g} rad {}", rotation, at_text(rotated_at, rotated_when));
    if (strain >= kMostStrain)
        text += fmt::format("{}was strained by {:.0f} % {}",
                            rotation >= kMostRotation ? ", another one " : "", 100 * strain,
                            at_text(strained_at, strained_when));
    return text + fmt::format(": displacements and forces may be far off; \"motion\": \"{}\" of it "
                              "takes {}",
                              strain >= kMostStrain ? "hyperelastic" : "corotational",
                              strain >= kMostStrain ? "large strains" : "large turns");
}

} // namespace amontons
