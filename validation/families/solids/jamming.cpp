// A wedge pressed between two walls and released: it jams where friction holds it.

#include "validation/families/solids/solids.hpp"
#include "validation/solid_meshes.hpp"
#include "validation/solid_run.hpp"

#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {

std::vector<Measured> wedge_jamming()
{
    const double alpha = 10 * 3.14159265358979323846 / 180, slope = std::tan(alpha);
    const double half = 0.05, high = 0.1, thick = 0.02; // half its width below [m]
    std::vector<Measured> rows;
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T10})
        for (const double mu : {0.1, 0.17, 0.18, 0.3}) {
            SolidScene s("a wedge between two walls");
            const VolumeMesh mesh = lattice_mesh(
                {graded(2 * half, 4, 1), graded(thick, 1, 1), graded(high, 6, 1)}, kind,
                [&](const Vec3& x) {
                    return Vec3((x.x() - half) * (1 + x.z() * slope / half), x.y(), x.z());
                });
            SolidInput& b = s.solid("wedge", 1e6, 0.3, mesh);
            b.hold = {hold("all", {}, still(), {})};
            LoadInput press = traction("z_max", {0, 0, -1e3});
            press.over = {{0, 1e-2}, {1, 1}, {2, 0}};
            b.loads = {press};
            const Vec3 inwards(std::cos(alpha), 0, std::sin(alpha));
            s.plane("left", {-half, 0, 0}, inwards);
            s.plane("right", {half, 0, 0}, {-inwards.x(), 0, inwards.z()});
            s.touch("wedge", "left", mu, "x_min");
            s.touch("wedge", "right", mu, "x_max");
            s.scene.time.step = 0.05;
            s.scene.time.end = 2;
            const SolidRun run = try_run(s.scene);
            const std::string of =
                fmt::format(", mu {}, {}", mu, kind == ElementKind::H8 ? "H8" : "T10");
            if (run.summary.status != "done") {
                rows.push_back(at_most("no balance" + of, std::nan(""), 0));
                rows.back().note = run.summary.message;
                continue;
            }
            // Two forces alone hold it, each against the other: on both walls together friction
            // over pressure is the walls' own slope, whatever the coefficient.
            const Vec3 left = run.vector("left_on_wedge_force"),
                       right = run.vector("right_on_wedge_force");
            const double c = inwards.x(), d = inwards.z();
            const double normal = c * (left.x() - right.x()) + d * (left.z() + right.z());
            const double along = d * (left.x() - right.x()) - c * (left.z() + right.z());
            if (mu < slope) {
                rows.push_back(
                    at_most("force left without a load [N]" + of, certified(run, normal), 1e-7));
                continue;
            }
            rows.push_back(relative("friction over pressure without a load" + of, slope,
                                    certified(run, along / normal), 1e-6));
            rows.back().note = fmt::format("{:.4g} N left on both walls", normal);
        }
    return rows;
}

} // namespace amontons::validation
