// E05, E07, G06: solids alone or in series.

#include "validation/families/solids/blocks.hpp"
#include "validation/families/solids/solids.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>

namespace amontons::validation {

VolumeMesh quarter_ring(double inner, double outer, double thick, int through, int around,
                        ElementKind kind)
{
    return lattice_mesh({graded(outer - inner, through, 1), graded(std::numbers::pi / 2, around, 1),
                         graded(thick, 1, 1)},
                        kind, [&](const Vec3& x) {
                            const double r = inner + x.x();
                            const double c = std::abs(x.y() - std::numbers::pi / 2) < 1e-14
                                                 ? 0
                                                 : std::cos(x.y());
                            return Vec3(r * c, r * std::sin(x.y()), x.z());
                        });
}

std::vector<Measured> thick_cylinder()
{
    std::vector<Measured> rows;
    const std::array<std::pair<double, double>, 3> reference{
        {{0.3, 0.00190666667}, {0.49, 0.0019966}, {0.4999, 0.00199996666}}};
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T10})
        for (const auto& [nu, u_r] : reference) {
            SolidScene s("thick cylinder under pressure");
            SolidInput& b = s.solid("ring", 1e9, nu, quarter_ring(0.1, 0.2, 0.0125, 8, 16, kind));
            b.hold = {hold("y_min", {}, still(), {}), hold("y_max", still(), {}, {}),
                      hold("z_min", {}, {}, still()), hold("z_max", {}, {}, still())};
            b.loads = {pressure("x_min", 1e7)};
            const SolidRun run = run_solids(s.scene, true);
            const BodyRecord& ring = run.bodies.back()[0];
            const std::vector<Vec3> u = displacements(ring), x = first_places(ring);
            double mean = 0, worst = 0;
            int count = 0;
            for (std::size_t i = 0; i < u.size(); ++i) {
                const double r = std::hypot(x[i].x(), x[i].y());
                if (r > 0.1 * (1 + 1e-9)) continue;
                const double own = (u[i].x() * x[i].x() + u[i].y() * x[i].y()) / r;
                mean += own;
                raise_to(worst, std::abs(own - u_r) / u_r);
                ++count;
            }
            rows.push_back(relative(
                fmt::format("u_r at r = a, nu {}, {}", nu, kind == ElementKind::H8 ? "H8" : "T10"),
                u_r, mean / count, 1e-2));
            rows.back().note = fmt::format("worst node {:.1e}", worst);
        }
    return rows;
}

std::vector<Measured> turned_solid()
{
    std::vector<Measured> rows;
    for (const char* element : {"T4", "T10", "H8"})
        for (const char* motion : {"corotational", "hyperelastic", "linear"}) {
            SolidScene s("a solid that is turned");
            SolidInput& b =
                s.block("body", 1e6, 0.3, {-0.5, -0.2, -0.1}, {0.5, 0.2, 0.1}, {4, 2, 2}, element);
            b.motion = motion;
            b.hold = {hold("x_min", still(), still(), still())};
            b.drive.given = true;
            b.drive.axis = {1, 2, 3};
            b.drive.angle = {{0, 0}, {36, 2 * std::numbers::pi}};
            s.scene.time.end = 36;
            const SolidRun run = run_solids(s.scene, true);
            double stress = 0;
            for (const auto& bodies : run.bodies)
                for (const Field& f : bodies[0].cell_fields)
                    if (f.name == "von_mises")
                        raise_to(stress, *std::max_element(f.values.begin(), f.values.end()));
            rows.push_back(at_most(
                fmt::format("largest stress over E in a full turn, {}, {}", element, b.motion),
                stress / 1e6, 1e-12));
        }
    // A held end that turns: the pull of a dead load on it does not.
    for (const char* motion : {"corotational", "hyperelastic", "linear"}) {
        SolidScene s("a loaded solid that is turned");
        SolidInput& b =
            s.block("body", 1e6, 0.3, {0, -0.1, -0.1}, {0.2, 0.1, 0.1}, {2, 2, 2}, "T10");
        b.motion = motion;
        b.hold = {hold("x_min", still(), still(), still())};
        // Forces are right to eps E A, 1e-11 N: the load has to be large beside it.
        b.loads = {traction("x_max", {0, 0, -1e5})};
        b.drive.given = true;
        b.drive.axis = {0, 1, 0};
        b.drive.about = Vec3(0, 0, 0);
        b.drive.angle = {{0, 0}, {36, 2 * std::numbers::pi}};
        s.scene.time.end = 36;
        s.scene.accuracy.contact = 1e-10; // the balance of solids too
        const SolidRun run = run_solids(s.scene);
        double worst = 0;
        // Step 0 brings the load on; its iterations end where the rounding of places begins.
        for (int k = 1; k <= 36; ++k)
            raise_to(worst, (run.vector("body_x_min_force", k) - Vec3(0, 0, 4000)).norm() / 4000);
        rows.push_back(
            at_most(std::string("reaction to a dead load, any angle, ") + b.motion, worst, 1e-12));
    }
    return rows;
}

std::vector<Measured> contrast_in_series()
{
    std::vector<Measured> rows;
    for (const char* element : {"T4", "T10", "H8"})
        for (const bool soft_below : {true, false})
            for (const double ratio : {1.0, 1e-6, 1e-12}) {
                const double hard = 1e12, soft = hard * ratio, p = 1e-3 * soft;
                SolidScene s("two blocks in series");
                SolidInput* b = &s.block("lower", soft_below ? soft : hard, 0, {0, 0, 0}, {1, 1, 1},
                                         {2, 2, 2}, element);
                b->hold = {hold("z_min", {}, {}, still()), hold("x_min", still(), {}, {}),
                           hold("y_min", {}, still(), {})};
                b = &s.block("upper", soft_below ? hard : soft, 0, {0, 0, 1}, {1, 1, 2}, {3, 3, 3},
                             element);
                b->hold = {hold("x_min", still(), {}, {}), hold("y_min", {}, still(), {})};
                b->loads = {pressure("z_max", p)};
                // Without lateral strain the geometry of the end is as exact; a body that floats in
                // its frame keeps its small strains apart from its large shift.
                s.touch("upper", "lower", 0, "z_min", "z_max").sliding = "finite";
                s.scene.accuracy.contact = 5e-11;
                const std::string of =
                    fmt::format(", E {:.0e} on {:.0e}, {}", soft_below ? hard : soft,
                                soft_below ? soft : hard, element);
                const SolidRun run = run_solids(s.scene, true);
                const BodyRecord& top = body_of(run.bodies.back(), "upper");
                const std::vector<Vec3> u = displacements(top), x = first_places(top);
                double worst = 0;
                const double exact = -p * (1 / soft + 1 / hard);
                for (std::size_t i = 0; i < u.size(); ++i)
                    if (x[i].z() > 2 - 1e-9) raise_to(worst, std::abs(u[i].z() / exact - 1));
                rows.push_back(at_most("top displacement" + of, certified(run, worst), 1e-8));
                double pressure = run.last().contacts.empty() ? 1 : 0;
                for (const ContactRecord& c : run.last().contacts)
                    raise_to(pressure, std::abs(c.pressure / p - 1));
                rows.push_back(at_most("contact pressure" + of, certified(run, pressure), 1e-8));
            }
    return rows;
}

} // namespace amontons::validation
