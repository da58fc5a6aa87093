#include "mesh/size_field.hpp"

#include "mesh/orient_surface.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

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

constexpr int kFinest = 64;                    // times as many columns at the most
constexpr std::size_t kEnoughCrossings = 5000; // of columns with triangles, for a mean

/// A body cut into columns along z.
class LatticeColumns {
public:
    using Box = Eigen::AlignedBox3d;
    struct Crossing {
        std::int64_t column = 0;
        double z = 0;
        bool operator<(const Crossing& o) const
        {
            return std::tie(column, z) < std::tie(o.column, o.z);
        }
    };
    struct Sum {
        double volume = 0, count = 0; ///< integrals of 1 and of 1 / size^3
    };

    static Box box_of(const SurfaceMesh& surface)
    {
        Box box;
        for (const auto& t : surface.triangles)
            for (const std::int32_t corner : t)
                box.extend(surface.points[static_cast<std::size_t>(corner)]);
        return box;
    }

    LatticeColumns(const SurfaceMesh& surface, const Box& box, int across)
        : low_(box.min())
        , h_(box.sizes() / across)
        , n_(across)
        , step_(box.sizes().maxCoeff() / across)
    {
        for (const auto& t : surface.triangles) {
            const auto corner = [&](std::size_t k) -> const Vec3& {
                return surface.points[static_cast<std::size_t>(t[k])];
            };
            cross(corner(0), corner(1), corner(2));
        }
        std::sort(crossings_.begin(), crossings_.end());
    }

    const std::vector<Crossing>& crossings() const { return crossings_; }

    Sum sum(const SizeField& size) const
    {
        Sum all;
        for (std::size_t k = 0; k + 1 < crossings_.size();) {
            const Crossing &in = crossings_[k], &out = crossings_[k + 1];
            if (in.column != out.column) { // rounding at an edge lost the other one
                ++k;
                continue;
            }
            const double x = at(in.column / n_, 0), y = at(in.column % n_, 1);
            const int steps = std::max(1, static_cast<int>(std::ceil((out.z - in.z) / step_)));
            const double dz = (out.z - in.z) / steps, part = h_[0] * h_[1] * dz;
            for (int s = 0; s < steps; ++s) {
                all.volume += part;
                all.count += part / std::pow(size.at({x, y, in.z + (s + 0.5) * dz}), 3);
            }
            k += 2;
        }
        return all;
    }

private:
    // Columns off the lines and diagonals of regular meshes, so that hardly one hits an edge.
    static constexpr std::array<double, 2> kOffset{0.41421356, 0.72360680};

    double at(std::int64_t i, int axis) const
    {
        return low_[axis] +
               (static_cast<double>(i) + kOffset[static_cast<std::size_t>(axis)]) * h_[axis];
    }
    void cross(const Vec3& a, const Vec3& b, const Vec3& c)
    {
        const double area =
            (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1]); // twice, seen along z
        if (area == 0) return;
        const auto range = [&](int k) {
            const auto [least, most] = std::minmax({a[k], b[k], c[k]});
            const double offset = kOffset[static_cast<std::size_t>(k)];
            const auto clamp = [&](double x) {
                return static_cast<std::int64_t>(std::clamp(x, 0.0, static_cast<double>(n_)));
            };
            return std::pair{clamp(std::floor((least - low_[k]) / h_[k] - offset)),
                             clamp(std::floor((most - low_[k]) / h_[k] - offset) + 1)};
        };
        const auto [i0, i1] = range(0);
        const auto [j0, j1] = range(1);
        for (std::int64_t i = i0; i < i1; ++i)
            for (std::int64_t j = j0; j < j1; ++j) {
                const double x = at(i, 0), y = at(j, 1);
                const auto side = [&](const Vec3& p, const Vec3& q) {
                    return ((q[0] - p[0]) * (y - p[1]) - (x - p[0]) * (q[1] - p[1])) / area;
                };
                const double wc = side(a, b), wa = side(b, c), wb = side(c, a);
                if (wa < 0 || wb < 0 || wc < 0) continue;
                crossings_.push_back({i * n_ + j, wa * a[2] + wb * b[2] + wc * c[2]});
            }
    }

    Vec3 low_, h_;
    std::int64_t n_;
    double step_; ///< along z
    std::vector<Crossing> crossings_;
};

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
    const LatticeColumns::Box box = LatticeColumns::box_of(surface);
    const double volume = std::abs(enclosed_volume(surface));
    if (box.isEmpty() || !(box.sizes().minCoeff() > 0 && volume > 0)) return 0;
    for (int n = across; n <= kFinest * across; n *= 4) {
        const LatticeColumns columns(surface, box, n);
        if (columns.crossings().size() < kEnoughCrossings && 4 * n <= kFinest * across) continue;
        const LatticeColumns::Sum sum = columns.sum(size);
        if (sum.volume > 0) return sum.count * (volume / sum.volume);
    }
    return volume / std::pow(size.least(), 3); // nothing was found: rather too many
}

} // namespace amontons
