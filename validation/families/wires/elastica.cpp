#include "validation/families/rods/rods.hpp"
#include "validation/families/wires/wires.hpp"
#include "validation/loaded_wire.hpp"

#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

// EA this large: the reference is inextensible, and extension shortens by alpha / kStiffExtension.
constexpr double kStiffExtension = 1e8;

struct Reference {
    double alpha, w, u;
};
constexpr Reference kReferences[] = {
    {1, 0.301720774, 0.0564332363}, {5, 0.713791524, 0.387628361}, {10, 0.810609025, 0.554995598}};

Vec3 tip(double alpha, int elements)
{
    LoadedWire wire;
    wire.EA = kStiffExtension;
    wire.elements = elements;
    wire.force = Vec3(0, alpha, 0);
    return solve(wire).state.nodes.back().position();
}

} // namespace

std::vector<Measured> elastica()
{
    std::vector<Measured> rows;
    for (const Reference& r : kReferences) {
        const Vec3 x = tip(r.alpha, 20);
        rows.push_back(
            relative(fmt::format("deflection, alpha {}, 20 elements", r.alpha), r.w, x.y(), 1e-5));
        rows.push_back(relative(fmt::format("shortening, alpha {}, 20 elements", r.alpha), r.u,
                                1 - x.x(), 1e-5));
    }
    ReferenceCurve& curve = rows.front().curve;
    curve = {"alpha = P L^2 / EI", "deflection over L", {}, {}, {}};
    for (double alpha = 0.5; alpha <= 10; alpha += 0.5)
        curve.add(alpha, elastica_of(alpha).w, tip(alpha, 20).y());
    const Reference& r = kReferences[2];
    std::vector<double> error;
    std::string note = "errors of the tip";
    for (int n : {5, 10, 20, 40}) {
        error.push_back((tip(r.alpha, n) - Vec3(1 - r.u, r.w, 0)).norm());
        note += fmt::format("{} {}: {:.2e}", n == 5 ? "" : ",", n, error.back());
    }
    rows.push_back(absolute("observed order, alpha 10, 5 to 20 elements", 4,
                            0.5 * std::log2(error[0] / error[2]), 0.5));
    rows.back().note = note;
    return rows;
}

} // namespace amontons::validation
