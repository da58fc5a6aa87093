#include "mesh/size_check.hpp"

#include "mesh/base/text.hpp"

#include <Eigen/Geometry>

namespace amontons {

std::vector<Issue> size_warnings(const Vec3& size, const std::string& file, double largest)
{
    if (!(size.maxCoeff() > largest)) return {};
    return {{file, "",
             "a size of " + number_text(size[0]) + " x " + number_text(size[1]) + " x " +
                 number_text(size[2]) + " m",
             "at most " + number_text(largest) +
                 " m without a warning; a file in millimetres needs the scale 0.001"}};
}

std::vector<Issue> size_warnings(const std::vector<Vec3>& points, const std::string& file)
{
    Eigen::AlignedBox3d box;
    for (const Vec3& x : points)
        box.extend(x);
    return box.isEmpty() ? std::vector<Issue>{} : size_warnings(Vec3(box.sizes()), file);
}

} // namespace amontons
