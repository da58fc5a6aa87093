#include "mesh/size_field.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace amontons {
namespace {

std::vector<BoundingBox> reaches(const std::vector<SizeSource>& sources, double greatest,
                                 double gradation)
{
    std::vector<BoundingBox> boxes;
    for (const SizeSource& s : sources) {
        const double reach = std::max((greatest - s.size) / gradation, 0.0);
        BoundingBox box;
        box.low = s.at.array() - reach;
        box.high = s.at.array() + reach;
        boxes.push_back(box);
    }
    return boxes;
}

} // namespace

SizeField::SizeField(double greatest, std::vector<SizeSource> sources, double gradation)
    : greatest_(greatest)
    , gradation_(gradation)
    , least_(greatest)
    , sources_(std::move(sources))
    , reach_(reaches(sources_, greatest, gradation))
{
    for (const SizeSource& s : sources_)
        least_ = std::min(least_, s.size);
}

double SizeField::at(const Vec3& x) const
{
    double size = greatest_;
    BoundingBox here;
    here.add(x);
    reach_.visit(here, [&](std::int32_t i) {
        const SizeSource& s = sources_[static_cast<std::size_t>(i)];
        size = std::min(size, s.size + gradation_ * (x - s.at).norm());
    });
    return size;
}

double count_by_size(const SurfaceMesh& surface, const SizeField& size, int across)
{
    Eigen::AlignedBox3d box;
    for (const auto& t : surface.triangles)
        for (const std::int32_t corner : t)
            box.extend(surface.points[static_cast<std::size_t>(corner)]);
    if (box.isEmpty()) return 0;
    const double h = box.sizes().maxCoeff() / across;
    const Vec3 low = box.min();
    const auto nx = static_cast<std::size_t>(std::ceil(box.sizes()[0] / h)) + 1,
               ny = static_cast<std::size_t>(std::ceil(box.sizes()[1] / h)) + 1;
    // Columns off the lines and diagonals of regular meshes, so that hardly one hits an edge.
    constexpr std::array<double, 2> kOffset{0.41421356, 0.72360680};
    const auto column = [&](std::size_t i, int axis) {
        return low[axis] + (static_cast<double>(i) + kOffset[static_cast<std::size_t>(axis)]) * h;
    };
    std::vector<std::vector<double>> crossings(nx * ny);
    for (const auto& t : surface.triangles) {
        const auto corner = [&](std::size_t k) -> const Vec3& {
            return surface.points[static_cast<std::size_t>(t[k])];
        };
        const Vec3 &a = corner(0), &b = corner(1), &c = corner(2);
        const double area =
            (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]); // twice, seen along z
        if (area == 0) continue;
        const auto range = [&](int k, std::size_t n) {
            const auto [least, most] = std::minmax({a[k], b[k], c[k]});
            const auto clamp = [&](double x) {
                return static_cast<std::size_t>(std::clamp(x, 0.0, static_cast<double>(n)));
            };
            const double offset = kOffset[static_cast<std::size_t>(k)];
            return std::pair{clamp(std::floor((least - low[k]) / h - offset)),
                             clamp(std::floor((most - low[k]) / h - offset) + 1)};
        };
        const auto [i0, i1] = range(0, nx);
        const auto [j0, j1] = range(1, ny);
        for (std::size_t i = i0; i < i1; ++i)
            for (std::size_t j = j0; j < j1; ++j) {
                const double x = column(i, 0), y = column(j, 1);
                const auto side = [&](const Vec3& p, const Vec3& q) {
                    return ((q[0] - p[0]) * (y - p[1]) - (x - p[0]) * (q[1] - p[1])) / area;
                };
                const double wc = side(a, b), wa = side(b, c), wb = side(c, a);
                if (wa < 0 || wb < 0 || wc < 0) continue;
                crossings[i * ny + j].push_back(wa * a[2] + wb * b[2] + wc * c[2]);
            }
    }
    double count = 0;
    for (std::size_t i = 0; i < nx; ++i)
        for (std::size_t j = 0; j < ny; ++j) {
            std::vector<double>& z = crossings[i * ny + j];
            std::sort(z.begin(), z.end());
            for (std::size_t k = 0; k + 1 < z.size(); k += 2) {
                const int steps = std::max(1, static_cast<int>(std::ceil((z[k + 1] - z[k]) / h)));
                const double dz = (z[k + 1] - z[k]) / steps;
                for (int s = 0; s < steps; ++s) {
                    const double edge =
                        size.at({column(i, 0), column(j, 1), z[k] + (s + 0.5) * dz});
                    count += h * h * dz / (edge * edge * edge);
                }
            }
        }
    return count;
}

} // namespace amontons
