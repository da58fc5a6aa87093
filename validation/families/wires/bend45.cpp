#include "validation/families/wires/wires.hpp"
#include "validation/loaded_wire.hpp"

#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace amontons::validation {

std::vector<Measured> bend45()
{
    struct Reference {
        double force;
        Vec3 tip;
    };
    const Reference references[] = {{300, {22.24478, 58.77912, 40.19189}},
                                    {450, {18.50818, 52.23856, 48.50293}},
                                    {600, {15.6848, 47.15044, 53.47486}}};
    const double E = 1e7, R = 100;
    LoadedWire wire;
    wire.length = R * std::numbers::pi / 4;
    wire.EI = E / 12;
    wire.GJ = E / 2 / 6; // J = 1/6, as in the literature
    wire.EA = E;
    wire.GA = E / 2; // shear correction 1
    wire.curvature = 1 / R;
    wire.frame << 0, 1, 0, 1, 0, 0, 0, 0, -1; // tangent y, bends towards x

    std::vector<Measured> rows;
    for (const Reference& r : references)
        for (int n : {8, 16, 32, 64}) {
            wire.elements = n;
            wire.force = Vec3(0, 0, r.force);
            Vec3 start;
            const Vec3 tip = solve(wire, &start).state.nodes.back().position();
            const double size = (r.tip - start).norm();
            if (r.force < 600 && n != 8 && n != 64) continue;
            // Order 2: the tolerances of 16 and 32 lie between the two specified ones.
            const double tolerance = n == 8 ? 3e-4 : n == 64 ? 5e-6 : n == 16 ? 8e-5 : 2e-5;
            Measured m = relative(fmt::format("tip displacement, {} N, {} elements", r.force, n),
                                  size, (tip - start).norm(), tolerance);
            m.error = (tip - r.tip).norm() / size;
            m.note = fmt::format("tip ({:.5f}, {:.5f}, {:.5f})", tip.x(), tip.y(), tip.z());
            rows.push_back(m);
        }
    return rows;
}

} // namespace amontons::validation
