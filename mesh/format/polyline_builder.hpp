#pragma once

#include "mesh/base/text.hpp"
#include "mesh/polyline.hpp"

#include <optional>
#include <string>

namespace amontons {

/// Collects the points of a centreline and checks them, whatever the file's format.
class PolylineBuilder {
public:
    PolylineBuilder(double scale, FileIssues& issues) : scale_(scale), issues_(issues) {}

    /// Adds a point, scaled. Adds an Issue instead if a number is not finite or the radius not
    /// > 0. A point at exactly the place of the last one is passed over.
    /// @param radius  given for every point or for none
    void add(const Vec3& x, std::optional<double> radius, const std::string& place);

    /// @throws InputError  if there were Issues, or fewer than 2 points
    Polyline finish();

private:
    double scale_;
    FileIssues& issues_;
    Polyline polyline_;
};

} // namespace amontons
