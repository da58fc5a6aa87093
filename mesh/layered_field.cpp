#include "mesh/layered_field.hpp"

#include <algorithm>
#include <limits>

namespace amontons {

namespace {

/// From 0 to 1 between 0 and 1, with two derivatives that vanish at both ends.
struct SmoothStep {
    double value, first, second;
};
SmoothStep smooth_step(double t)
{
    if (t <= 0) return {0, 0, 0};
    if (t >= 1) return {1, 0, 0};
    const double s = 1 - t;
    return {t * t * t * (10 + t * (6 * t - 15)), 30 * t * t * s * s, 60 * t * s * (s - t)};
}

} // namespace

double FieldWindow::value(const Vec3& x) const
{
    const Vec3 e = x - start;
    const double s = e.dot(along), outer = radius + fall,
                 aside = outer * outer - (e.squaredNorm() - s * s);
    if (aside <= 0) return 0;
    return smooth_step((s - from) / rise + 1).value *
           smooth_step(aside / (outer * outer - radius * radius)).value;
}

FieldSample FieldWindow::at(const Vec3& x) const
{
    const Vec3 e = x - start;
    const double s = e.dot(along), outer = radius + fall, ring = outer * outer - radius * radius;
    const Vec3 off = e - s * along;
    const SmoothStep a = smooth_step((s - from) / rise + 1),
                     b = smooth_step((outer * outer - (e.squaredNorm() - s * s)) / ring);
    const Vec3 da = along / rise, db = -2 / ring * off;
    FieldSample w;
    w.value = a.value * b.value;
    w.gradient = a.first * b.value * da + a.value * b.first * db;
    w.hessian = a.second * b.value * da * da.transpose() +
                a.first * b.first * (da * db.transpose() + db * da.transpose()) +
                a.value * (b.second * db * db.transpose() -
                           2 * b.first / ring * (Mat3::Identity() - along * along.transpose()));
    return w;
}

LayeredField::LayeredField(DistanceField everywhere, std::vector<Layer> finer)
    : all_{std::move(everywhere)}
    , finer_{std::move(finer)}
{
}

LayeredField LayeredField::share() const
{
    std::vector<Layer> finer;
    for (const Layer& layer : finer_)
        finer.push_back({layer.field.share(), layer.window});
    return {all_.share(), std::move(finer)};
}

/// The finest grid that is used alone or with finer ones: none before it has a part at x.
std::size_t LayeredField::whole_(const Vec3& x) const
{
    std::size_t k = finer_.size();
    while (k > 0 && finer_[k - 1].window.value(x) < 1)
        --k;
    return k;
}

WallSample LayeredField::sample(const Vec3& x, WallHint& hint) const
{
    const std::size_t first = whole_(x);
    FieldSample sum;
    bool mixed = false;
    for (std::size_t k = first; k < finer_.size(); ++k) {
        const FieldSample w = finer_[k].window.at(x);
        if (w.value == 0) continue;
        if (!mixed) {
            sum = field_(first).evaluate(x, hint);
            sum.hessian /= sum.unit;
            sum.unit = 1;
            mixed = true;
        }
        const FieldSample fine = finer_[k].field.evaluate(x, hint);
        const double more = fine.value - sum.value;
        const Vec3 steeper = fine.gradient - sum.gradient;
        sum.hessian += w.value * (fine.hessian / fine.unit - sum.hessian) + more * w.hessian +
                       w.gradient * steeper.transpose() + steeper * w.gradient.transpose();
        sum.gradient += w.value * steeper + more * w.gradient;
        sum.value += w.value * more;
    }
    return mixed ? wall_sample(sum) : field_(first).sample(x, hint);
}

double LayeredField::distance(const Vec3& x, WallHint& hint) const
{
    const std::size_t first = whole_(x);
    double sum = field_(first).distance(x, hint);
    for (std::size_t k = first; k < finer_.size(); ++k)
        if (const double w = finer_[k].window.value(x); w > 0)
            sum += w * (finer_[k].field.distance(x, hint) - sum);
    return sum;
}

double LayeredField::clearance(const Vec3& x, WallHint& hint) const
{
    const std::size_t first = whole_(x);
    double least = field_(first).clearance(x, hint);
    for (std::size_t k = first; k < finer_.size(); ++k)
        if (finer_[k].window.value(x) > 0)
            least = std::min(least, finer_[k].field.clearance(x, hint));
    return least;
}

void LayeredField::prepare(const std::string& cache, int threads)
{
    all_.prepare(cache, threads);
    for (Layer& layer : finer_)
        layer.field.prepare(cache, threads);
}

std::vector<std::string> LayeredField::keep() const
{
    std::vector<std::string> lines = all_.keep();
    for (const Layer& layer : finer_)
        for (std::string& line : layer.field.keep())
            lines.push_back(std::move(line));
    return lines;
}

std::size_t LayeredField::memory() const
{
    std::size_t sum = all_.memory();
    for (const Layer& layer : finer_)
        sum += layer.field.memory();
    return sum;
}

} // namespace amontons
