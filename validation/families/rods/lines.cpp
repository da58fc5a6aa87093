// Middle lines of wires, examined from the places of their nodes alone.

#include "validation/families/rods/rods.hpp"

#include <algorithm>
#include <cmath>

namespace amontons::validation {

double segment_distance(const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1)
{
    // That of a point of one from the other is convex along it.
    const auto from = [&](double t) {
        const Vec3 x = a0 + t * (a1 - a0), d = b1 - b0;
        return (x - b0 - std::clamp((x - b0).dot(d) / d.squaredNorm(), 0.0, 1.0) * d).norm();
    };
    double low = 0, high = 1;
    for (int i = 0; i < 40; ++i) {
        const double third = (high - low) / 3;
        if (from(low + third) < from(high - third))
            high -= third;
        else
            low += third;
    }
    return from(0.5 * (low + high));
}

std::vector<Vec3> refined(const std::vector<Vec3>& line)
{
    if (line.empty()) return {};
    std::vector<Vec3> fine{line[0]};
    for (std::size_t i = 0; i + 1 < line.size(); ++i) {
        const Vec3 sum = line[i] + line[i + 1];
        const bool inside = i > 0 && i + 2 < line.size();
        fine.push_back(inside ? Vec3((9 * sum - line[i - 1] - line[i + 2]) / 16) : Vec3(sum / 2));
        fine.push_back(line[i + 1]);
    }
    return fine;
}

double least_distance(const std::vector<Vec3>& line, double radius)
{
    const double span = 6 * radius;
    std::vector<double> arc{0};
    for (std::size_t i = 1; i < line.size(); ++i)
        arc.push_back(arc.back() + (line[i] - line[i - 1]).norm());
    double least = span;
    for (std::size_t i = 0; i + 1 < line.size(); ++i)
        for (std::size_t j = i + 1; j + 1 < line.size(); ++j) {
            const double apart = (line[i] - line[j]).norm();
            if (arc[j] - arc[i + 1] <= span ||
                apart >= least + (arc[i + 1] - arc[i]) + (arc[j + 1] - arc[j]))
                continue;
            least = std::min(least, segment_distance(line[i], line[i + 1], line[j], line[j + 1]));
        }
    return least;
}

} // namespace amontons::validation
