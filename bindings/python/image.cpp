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
        const Eigen::Vector2d ahead = shadow > 0 ? Eigen::Vector2d(along / shadow)
                                                 : Eigen::Vector2d(0, 1),
                              across(-ahead.y(), ahead.x());
        // The film lies within `far` of its middle, along the shadow and across it: no more is
        // drawn, however large a wire near the source appears.
        const Eigen::Vector2d middle_of_film = 0.5 * Eigen::Vector2d(columns_, rows_);
        const double far = middle_of_film.norm() + 1;
        const double here = ahead.dot(middle_of_film - from),
                     side = across.dot(middle_of_film - from);
        double first = 0, last = 1; // shares of the shadow
        if (shadow > 0) {
            first = std::clamp((here - far) / shadow, 0.0, 1.0);
            last = std::clamp((here + far) / shadow, 0.0, 1.0);
            if (!(first < last)) return;
        }
        // ... and of the piece, whose ends are not equally far from the source.
        const auto of_piece = [&](double share) {
            return share * before / (behind - share * (behind - before));
        };
        const double begin = of_piece(first), end = of_piece(last);
        constexpr int kPerPixel = 4;
        constexpr double kWidest = 1e8; // pixels: more is as dark all over
        const int steps = 1 + int(kPerPixel * shadow * (last - first));
        const double widest =
            std::min(radius * distance_ / std::min(before, behind) / pixel_, kWidest);
        const int lanes = 1 + 2 * int(2 * widest);
        const double volume = std::numbers::pi * radius * radius * (b - a).norm() * (end - begin) /
                              steps / shares_of(lanes);
        for (int k = 0; k < steps; ++k) {
            const double t = begin + (end - begin) * (k + 0.5) / steps;
            const double larger = distance_ / ((1 - t) * before + t * behind); // magnification
            const Eigen::Vector2d middle = place(a + t * (b - a));
            const double half = radius * larger / pixel_;
            const auto lane_at = [&](double x) { return 0.5 * lanes * (x / half + 1) - 0.5; };
            const int from_lane =
                          int(std::clamp(std::floor(lane_at(side - far)), 0.0, lanes - 1.0)),
                      to_lane = int(std::clamp(std::ceil(lane_at(side + far)), 0.0, lanes - 1.0));
            for (int lane = from_lane; lane <= to_lane; ++lane)
                add(middle + off(lane, lanes) * half * across,
                    volume * larger * larger * share(lane, lanes));
        }
    }
    double mean_length(std::size_t pixel) const { return volume_[pixel] / (pixel_ * pixel_); }
    std::size_t size() const { return volume_.size(); }

private:
    static double off(int lane, int lanes) { return (2.0 * lane + 1) / lanes - 1; }
    /// Of all lanes; of many, the disc's area.
    static double shares_of(int lanes)
    {
        constexpr int kMany = 10000;
        if (lanes > kMany) return 0.25 * std::numbers::pi * lanes;
        double sum = 0;
        for (int lane = 0; lane < lanes; ++lane)
            sum += share(lane, lanes);
        return sum;
    }
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
