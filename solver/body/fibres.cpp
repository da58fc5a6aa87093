#include "solver/body/fibres.hpp"

#include "mesh/base/text.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace amontons {

std::vector<Vec3> parse_fibres(std::string_view text, const std::string& file, std::size_t count)
{
    FileIssues issues(file);
    std::vector<Vec3> fibres;
    text = without_byte_order_mark(text);
    for (std::size_t line = 1; !text.empty(); ++line) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        std::string row(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
        for (char& c : row)
            if (c == ',' || c == ';') c = ' ';
        WordReader words(row);
        std::vector<std::string_view> parts;
        for (std::string_view w = words.next(); !w.empty(); w = words.next())
            parts.push_back(w);
        if (parts.empty() || parts[0].front() == '#') continue;
        Vec3 v = Vec3::Zero();
        bool good = parts.size() == 3;
        for (std::size_t i = 0; good && i < 3; ++i) {
            const std::optional<double> number = parse_double(parts[i]);
            good = number && std::isfinite(*number);
            if (good) v[Eigen::Index(i)] = *number;
        }
        const double size = v.cwiseAbs().maxCoeff();
        if (!good || !(size > 0)) {
            issues.add(line_place(line), quoted_text(row.substr(0, 60)),
                       "three numbers, not all 0: a direction");
            continue;
        }
        fibres.push_back((v / size).normalized());
    }
    if (issues.empty() && fibres.size() != count)
        issues.add("", number_text(double(fibres.size())) + " directions",
                   number_text(double(count)) + ", one of each element of the mesh");
    issues.throw_if_any();
    return fibres;
}

Mat3 fibre_axes(const Vec3& fibre)
{
    const Vec3 f = fibre.normalized();
    Mat3 axes;
    axes.col(0) = f;
    axes.col(1) = f.unitOrthogonal();
    axes.col(2) = f.cross(axes.col(1));
    return axes;
}

} // namespace amontons
