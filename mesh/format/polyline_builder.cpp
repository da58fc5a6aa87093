#include "mesh/format/polyline_builder.hpp"

#include "mesh/format/polygon.hpp"

#include <cmath>
#include <limits>

namespace amontons {

void PolylineBuilder::add(const Vec3& x, std::optional<double> radius, const std::string& place)
{
    const Vec3 point = finite_point(x, scale_, place, issues_);
    const double scaled_radius = scale_ * radius.value_or(1);
    if (!(scaled_radius > 0 && scaled_radius <= std::numeric_limits<double>::max()))
        issues_.add(place, "radius " + number_text(*radius), "> 0 and finite");
    if (!polyline_.points.empty() && polyline_.points.back() == point) return;
    polyline_.points.push_back(point);
    if (radius) polyline_.radius.push_back(scaled_radius);
}

Polyline PolylineBuilder::finish()
{
    if (issues_.empty() && polyline_.points.size() < 2)
        issues_.add(
            "", "a centreline of " + std::to_string(polyline_.points.size()) + " different points",
            "at least 2");
    issues_.throw_if_any();
    return std::move(polyline_);
}

} // namespace amontons
