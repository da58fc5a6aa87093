#include "mesh/generate/solid_box.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/text.hpp"
#include "mesh/split_elements.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

std::vector<Issue> box_issues(const SolidBoxOptions& o)
{
    std::vector<Issue> issues;
    double count = 1;
    for (std::size_t i = 0; i < 3; ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        const std::string axis = "/" + std::to_string(i);
        const double size = o.highest[k] - o.lowest[k];
        if (!(size > 0) || !std::isfinite(size))
            issues.push_back({"", "/size" + axis, number_text(size), "> 0 and finite [m]"});
        if (o.cells[i] < 1)
            issues.push_back({"", "/cells" + axis, std::to_string(o.cells[i]), ">= 1"});
        if (!(o.grading[i] >= 1e-6 && o.grading[i] <= 1e6))
            issues.push_back({"", "/grading" + axis, number_text(o.grading[i]), "1e-6 to 1e6"});
        count *= o.cells[i];
    }
    if (count * 6 > static_cast<double>(kMostElements))
        issues.push_back({"", "/cells", number_text(count) + " cells",
                          "at most " + std::to_string(kMostElements / 6)});
    return issues;
}

/// n + 1 places whose distances grow by a constant factor from the first to the last.
std::vector<double> graded(double low, double high, std::int32_t n, double grading)
{
    std::vector<double> at{low};
    const double factor = n > 1 ? std::pow(grading, 1.0 / (n - 1)) : 1;
    double sum = 0, cell = 1;
    std::vector<double> ends;
    for (std::int32_t i = 0; i < n; ++i, cell *= factor)
        ends.push_back(sum += cell);
    for (std::int32_t i = 0; i + 1 < n; ++i)
        at.push_back(low + (high - low) * (ends[static_cast<std::size_t>(i)] / sum));
    at.push_back(high);
    return at;
}

} // namespace

VolumeMesh make_solid_box(const SolidBoxOptions& o)
{
    if (std::vector<Issue> issues = box_issues(o); !issues.empty())
        throw InputError(std::move(issues));
    std::array<std::vector<double>, 3> at;
    for (std::size_t i = 0; i < 3; ++i) {
        const auto k = static_cast<Eigen::Index>(i);
        at[i] = graded(o.lowest[k], o.highest[k], o.cells[i], o.grading[i]);
    }
    const auto [nx, ny, nz] = o.cells;
    VolumeMesh mesh;
    for (const double z : at[2])
        for (const double y : at[1])
            for (const double x : at[0])
                mesh.nodes.emplace_back(x, y, z);

    const std::int32_t row = nx + 1, layer = row * (ny + 1);
    ElementBlock block{ElementKind::H8, {}};
    mesh.element_sets = {{"volume", {}}};
    mesh.face_sets = {{"x_min", {}}, {"x_max", {}}, {"y_min", {}},
                      {"y_max", {}}, {"z_min", {}}, {"z_max", {}}};
    std::int32_t e = 0;
    for (std::int32_t k = 0; k < nz; ++k)
        for (std::int32_t j = 0; j < ny; ++j)
            for (std::int32_t i = 0; i < nx; ++i, ++e) {
                const std::int32_t a = i + j * row + k * layer, b = a + layer;
                block.nodes.insert(block.nodes.end(), {a, a + 1, a + 1 + row, a + row, //
                                                       b, b + 1, b + 1 + row, b + row});
                mesh.element_sets[0].members.push_back(e);
                const bool outside[] = {i == 0,      i == nx - 1, j == 0,
                                        j == ny - 1, k == 0,      k == nz - 1};
                for (std::int32_t f = 0; f < 6; ++f) // H8's faces have this order
                    if (outside[f])
                        mesh.face_sets[static_cast<std::size_t>(f)].members.push_back({e, f});
            }
    mesh.blocks.push_back(std::move(block));
    return as_kind(std::move(mesh), o.kind);
}

} // namespace amontons
