#include "solver/output/beam_tube.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

constexpr double kPi = 3.14159265358979323846;

Vec3 any_orthogonal(const Vec3& t)
{
    Eigen::Index smallest = 0;
    t.cwiseAbs().minCoeff(&smallest);
    return t.cross(Vec3::Unit(smallest)).normalized();
}

} // namespace

void make_tube_surface(const BeamRecord& beam, int corners, TubeSurface& s)
{
    s.points.clear();
    s.triangles.clear();
    const Field* radius = find_field(beam.fields, "radius");
    const std::size_t n = beam.points.size(), m = static_cast<std::size_t>(corners);
    s.fields.resize(beam.fields.size());
    for (std::size_t k = 0; k < s.fields.size(); ++k) {
        s.fields[k].name = beam.fields[k].name;
        s.fields[k].unit = beam.fields[k].unit;
        s.fields[k].components = beam.fields[k].components;
        s.fields[k].values.clear();
    }
    if (n < 2 || !radius || radius->values.size() != n) return;

    std::vector<double> cosine(m), sine(m);
    for (std::size_t j = 0; j < m; ++j) {
        const double angle = 2 * kPi * static_cast<double>(j) / static_cast<double>(m);
        cosine[j] = std::cos(angle);
        sine[j] = std::sin(angle);
    }
    Vec3 tangent = Vec3::UnitX(), across = Vec3::Zero();
    for (std::size_t i = 0; i < n; ++i) {
        const Vec3 chord = beam.points[std::min(i + 1, n - 1)] - beam.points[i > 0 ? i - 1 : 0];
        if (chord.norm() > 0) tangent = chord.normalized(); // two equal points: keep the last
        // The frame is carried along by projection, so that the rings do not turn.
        across -= across.dot(tangent) * tangent;
        const double length = across.norm();
        if (length > 1e-6)
            across /= length;
        else
            across = any_orthogonal(tangent);
        const Vec3 up = tangent.cross(across);
        for (std::size_t j = 0; j < m; ++j)
            s.points.push_back(beam.points[i] +
                               radius->values[i] * (cosine[j] * across + sine[j] * up));
    }
    for (std::size_t k = 0; k < s.fields.size(); ++k) {
        const Field& f = beam.fields[k];
        const std::size_t c = static_cast<std::size_t>(f.components);
        s.fields[k].values.reserve(n * m * c);
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t j = 0; j < m; ++j)
                for (std::size_t l = 0; l < c; ++l)
                    s.fields[k].values.push_back(f.values[i * c + l]);
    }
    const auto at = [&](std::size_t ring, std::size_t corner) {
        return static_cast<std::int32_t>(ring * m + corner % m);
    };
    for (std::size_t i = 0; i + 1 < n; ++i)
        for (std::size_t j = 0; j < m; ++j) {
            s.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
            s.triangles.push_back({at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)});
        }
    for (std::size_t j = 1; j + 1 < m; ++j) { // flat ends
        s.triangles.push_back({at(0, 0), at(0, j + 1), at(0, j)});
        s.triangles.push_back({at(n - 1, 0), at(n - 1, j), at(n - 1, j + 1)});
    }
}

} // namespace amontons
