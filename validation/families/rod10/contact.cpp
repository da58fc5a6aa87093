// The contact of WSCG 2003 beside contact without penalty; see cases/rod10-contact.

#include "validation/families/rods/rods.hpp"
#include "validation/solid_run.hpp"

#include "solver/rod10/rod10_contact.hpp"

#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

constexpr double kDepth = 1e-4; // of the tip below the post's top, if the rod were stiff [m]

/// The top of a post under the tip, as wide as no other test point.
SurfaceMesh post(const Rod10& rod)
{
    const double top = kDepth - rod.diameter / 2, half = rod.element() / 10;
    SurfaceMesh mesh;
    for (int k = 0; k < 8; ++k)
        mesh.points.emplace_back(rod.length + (k & 1 ? half : -half), k & 2 ? 0.01 : -0.01,
                                 k & 4 ? top : top - 0.01);
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return mesh;
}

/// Force on the tip after some frames, and its change in the last of them, for springs of a
/// stiffness K [N].
struct Settled {
    double force = 0, change = 0;
};

Settled pressed(const Rod10& rod, double K, int frames)
{
    Rod10Contact contact(rod, {Rod10Object(post(rod))}, {.stiffness = K});
    Settled s;
    for (int i = 0; i < frames; ++i) {
        const double force = contact.frame(Vec3::Zero(), Mat3::Identity()).force.z();
        s = {force, std::abs(force - s.force)};
    }
    return s;
}

/// The same rod with its base lowered onto a plane that only its tip can touch [N].
double rigid_contact(const Rod10& rod)
{
    SolidScene s("tip on a plane");
    const double radius = rod.diameter / 2;
    const Vec3 normal = Vec3(-0.05, 0, 1).normalized();
    s.plane("plane", Vec3(rod.length, 0, 0) - radius * normal, normal);
    RodInput input = uniform_rod(rod.length, rod.bending(), 0.77 * rod.bending(),
                                 rod.youngs_modulus * rod.area(), 0, rod.nodes - 1);
    input.name = "rod";
    input.segments[0].radius = radius;
    input.hold[0].z = {{0, 0}, {1, -kDepth}};
    input.hold[0].x = input.hold[0].y = still();
    s.scene.rods.push_back(input);
    s.scene.order.push_back("rod");
    s.touch("rod", "plane", 0);
    s.scene.time.step = s.scene.time.end = 1;
    return run_solids(s.scene).vector("plane_on_rod_force").z();
}

} // namespace

std::vector<Measured> rod10_contact()
{
    std::vector<Measured> rows;
    const Rod10 rod;
    const double C = std::pow(rod.length, 3) / (3 * rod.bending());
    const double rigid = rigid_contact(rod);
    rows.push_back(relative("force on a tip that nothing may enter [N]", kDepth / C, rigid, 1e-4));
    for (const double KC : {0.1, 0.5, 0.9})
        rows.push_back(relative(fmt::format("force of the springs over that force, K C = {}", KC),
                                KC / (1 + KC), pressed(rod, KC / C, 400).force / rigid, 1e-4));
    double settles = 0.5, swings = 2;
    while (swings - settles > 1e-3) {
        const double KC = 0.5 * (settles + swings);
        (pressed(rod, KC / C, 4000).change < 1e-6 * kDepth / C ? settles : swings) = KC;
    }
    rows.push_back(relative("largest K C of which frames settle", 1, settles, 0.01));
    return rows;
}

} // namespace amontons::validation
