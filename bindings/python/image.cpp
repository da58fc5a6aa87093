#include "bindings/python/image.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace amontons::python {
namespace {

/// Mean lengths inside the wires, times a pixel's area: volumes on the plane.
class Film {
public:
    Film(const XrayCamera& c, const XrayOptions& o)
        : camera_(c)
        , rows_(o.height)
        , columns_(o.width)
        , pixel_(c.width / o.width)
        , volume_(std::size_t(o.height) * std::size_t(o.width), 0)
    {
        distance_ = (c.target - c.source).norm();
        ahead_ = (c.target - c.source) / distance_;
        right_ = ahead_.cross(c.up).normalized();
        up_ = right_.cross(ahead_);
    }

    void draw(const Vec3& a, const Vec3& b, double radius)
    {
        const double before = (a - camera_.source).dot(ahead_),
                     behind = (b - camera_.source).dot(ahead_);
        if (!(before > radius && behind > radius)) return; // beside or behind the source
        const Eigen::Vector2d from = place(a), to = place(b);
        const Eigen::Vector2d along = to - from;
        const double shadow = along.norm();
        constexpr int kPerPixel = 4;
        const int steps = 1 + int(kPerPixel * shadow);
        const double widest = radius * distance_ / std::min(before, behind) / pixel_;
        const int lanes = 1 + 2 * int(2 * widest);
        const Eigen::Vector2d across =
            shadow > 0 ? Eigen::Vector2d(-along.y(), along.x()) / shadow : Eigen::Vector2d(1, 0);
        double shares = 0;
        for (int lane = 0; lane < lanes; ++lane)
            shares += share(lane, lanes);
        const double volume = std::numbers::pi * radius * radius * (b - a).norm() / steps;
        for (int k = 0; k < steps; ++k) {
            const double t = (k + 0.5) / steps;
            const double larger = distance_ / ((1 - t) * before + t * behind); // magnification
            const Eigen::Vector2d middle = place(a + t * (b - a));
            for (int lane = 0; lane < lanes; ++lane)
                add(middle + off(lane, lanes) * radius * larger / pixel_ * across,
                    volume * larger * larger * share(lane, lanes) / shares);
        }
    }
    double mean_length(std::size_t pixel) const { return volume_[pixel] / (pixel_ * pixel_); }
    std::size_t size() const { return volume_.size(); }

private:
    static double off(int lane, int lanes) { return (2.0 * lane + 1) / lanes - 1; }
    /// Of a disc's chords.
    static double share(int lane, int lanes)
    {
        const double x = off(lane, lanes);
        return std::sqrt(1 - x * x);
    }
    /// In pixels, to the right and up from the lower left corner.
    Eigen::Vector2d place(const Vec3& x) const
    {
        const Vec3 ray = x - camera_.source;
        const Vec3 on_plane = ray * (distance_ / ray.dot(ahead_));
        return {on_plane.dot(right_) / pixel_ + 0.5 * columns_,
                on_plane.dot(up_) / pixel_ + 0.5 * rows_};
    }
    /// To the four pixels whose middles are around it.
    void add(const Eigen::Vector2d& at, double volume)
    {
        const double u = at.x() - 0.5, v = at.y() - 0.5;
        if (!(u > -1 && u < columns_ && v > -1 && v < rows_)) return;
        const int i = int(std::floor(u)), j = int(std::floor(v));
        for (int p = 0; p < 2; ++p)
            for (int q = 0; q < 2; ++q) {
                const int column = i + p, row = rows_ - 1 - (j + q);
                if (column < 0 || column >= columns_ || row < 0 || row >= rows_) continue;
                const double x = p == 0 ? 1 - (u - i) : u - i, y = q == 0 ? 1 - (v - j) : v - j;
                volume_[std::size_t(row) * std::size_t(columns_) + std::size_t(column)] +=
                    volume * x * y;
            }
    }

    XrayCamera camera_;
    int rows_, columns_;
    double pixel_;
    std::vector<double> volume_;
    double distance_ = 0;
    Vec3 ahead_, right_, up_;
};

/// The same numbers on every machine, unlike std::normal_distribution.
class Normal {
public:
    explicit Normal(std::uint64_t seed) : engine_(seed) {}
    double operator()()
    {
        const auto uniform = [&] { return (double(engine_() >> 11) + 0.5) * 0x1p-53; };
        const double r = std::sqrt(-2 * std::log(uniform()));
        return r * std::cos(2 * std::numbers::pi * uniform());
    }

private:
    std::mt19937_64 engine_;
};

} // namespace

void draw_xray(const std::vector<BeamRecord>& beams, const XrayCamera& camera, const XrayOptions& o,
               std::uint8_t* out)
{
    Film film(camera, o);
    for (const BeamRecord& b : beams) {
        const Field* radius = find_field(b.fields, "radius");
        for (std::size_t i = 1; i < b.points.size(); ++i)
            film.draw(b.points[i - 1], b.points[i],
                      radius ? 0.5 * (radius->values[i - 1] + radius->values[i]) : 0);
    }
    Normal normal(o.seed);
    for (std::size_t k = 0; k < film.size(); ++k) {
        double grey = o.white * std::exp(-o.attenuation * film.mean_length(k));
        if (o.noise > 0) grey += o.noise * normal();
        out[k] = std::uint8_t(std::clamp(std::lround(grey), 0L, 255L));
    }
}

} // namespace amontons::python
