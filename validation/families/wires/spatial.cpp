#include "validation/families/wires/wires.hpp"
#include "validation/scene_run.hpp"

#include <fmt/format.h>

namespace amontons::validation {
namespace {

std::vector<Measured> spatial_rows(const Run& r)
{
    std::vector<Measured> rows;
    add_energy_and_certificates(rows, r, 0.01);
    rows.push_back(at_most(
        "points beyond a wall",
        [&] {
            for (const Quantity& q : r.summary.quantities)
                if (q.name == "passed_through") return q.value;
            return -1.0;
        }(),
        0));
    rows.back().note = fmt::format("largest push {:.4f} N, largest |z| {:.2f} mm",
                                   largest(r, &Step::push), 1e3 * largest(r, &Step::out_of_plane));
    return rows;
}

constexpr const char* kSpatialWire =
    "bodies/wire={{\"kind\":\"beam\",\"segments\":[{{\"length\":0.330,\"radius\":4.445e-4,"
    "\"EI\":5.2e-4,\"EA\":5000,\"element\":2.5e-3{}}}],\"contact_spacing\":1.25e-3,"
    "\"introducer\":{{\"fade\":0.005,\"normal\":[0,1,0]}},"
    "\"drive\":{{\"insertion\":[[0,0],[15,0.300]]}}}}";

} // namespace

std::vector<Measured> double_u_curved()
{
    return spatial_rows(run(scene(
        "double-u",
        {fmt::format(kSpatialWire, ",\"curvature\":1,\"curvature_angle\":1.5707963267948966")})));
}

std::vector<Measured> double_u_unheld()
{
    return spatial_rows(run(scene("double-u", {fmt::format(kSpatialWire, "")})));
}

std::vector<Measured> j_tip_twist()
{
    return spatial_rows(run(scene("j-tip-twist")));
}

} // namespace amontons::validation
