#include "validation/random/draw.hpp"

#include <cmath>
#include <cstdlib>
#include <fmt/format.h>
#include <numeric>
#include <utility>

namespace amontons::validation {
namespace {

constexpr std::uint64_t kGolden = 0x9e3779b97f4a7c15ULL;

std::uint64_t mixed(std::uint64_t z)
{
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
}

} // namespace

double four_digits(double value)
{
    return std::strtod(fmt::format("{:.4g}", value).c_str(), nullptr);
}

std::uint64_t SplitMix::next()
{
    state += kGolden;
    return mixed(state);
}

Draw::Draw(std::uint64_t seed, std::uint64_t stream)
    : numbers_{mixed(mixed(seed + kGolden) + stream * kGolden)}
{
}

double Draw::unit()
{
    return static_cast<double>(bits() >> 11) * 0x1p-53;
}

double Draw::real(double low, double high)
{
    return four_digits(low + (high - low) * unit());
}

double Draw::ratio(double low, double high)
{
    return four_digits(low * std::pow(high / low, unit()));
}

int Draw::whole(int low, int high)
{
    return low + static_cast<int>(bits() % static_cast<std::uint64_t>(high - low + 1));
}

Vec3 Draw::direction()
{
    while (true) {
        const Vec3 v{2 * unit() - 1, 2 * unit() - 1, 2 * unit() - 1};
        const double n = v.norm();
        if (n > 0.2 && n < 1) return (v / n).unaryExpr(&four_digits);
    }
}

Vec3 Draw::rotation(double largest)
{
    const double angle = largest * unit();
    return (angle * direction()).unaryExpr(&four_digits);
}

Vec3 Draw::shift(double size)
{
    return Vec3{2 * unit() - 1, 2 * unit() - 1, 2 * unit() - 1}.unaryExpr(
        [&](double x) { return four_digits(size * x); });
}

std::vector<int> Draw::order(int count)
{
    std::vector<int> list(static_cast<std::size_t>(count));
    std::iota(list.begin(), list.end(), 0);
    for (int i = count - 1; i > 0; --i)
        std::swap(list[static_cast<std::size_t>(i)], list[static_cast<std::size_t>(whole(0, i))]);
    return list;
}

} // namespace amontons::validation
