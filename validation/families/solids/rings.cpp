// A12: a ring shrunk on another one.

#include "validation/families/solids/blocks.hpp"
#include "validation/families/solids/solids.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {

std::vector<Measured> shrink_fit()
{
    const double a = 0.05, b = 0.1, c = 0.15, over = 1e-4;
    struct Fit {
        const char* name;
        double outer_E, outer_nu, reference;
        bool plane_strain;
        double mu;
    };
    std::vector<Measured> rows;
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T10})
        for (const Fit& f :
             {Fit{"steel on steel, plane stress", 210e9, 0.3, 49218750, false, 0},
              Fit{"aluminium on steel, plane stress", 70e9, 0.33, 20676074.8, false, 0},
              Fit{"steel on steel, plane strain", 210e9, 0.3, 54086538.5, true, 0},
              Fit{"steel on steel, plane strain, mu 0.3", 210e9, 0.3, 54086538.5, true, 0.3}}) {
            SolidScene s("shrink fit");
            const double thick = 0.004;
            const std::vector<HoldInput> sides{hold("y_min", {}, still(), {}),
                                               hold("y_max", still(), {}, {}),
                                               hold("z_min", {}, {}, still())};
            // Half the overlap on each side. Middle nodes lie on the circles, so the cells around
            // need not match; the gap between two polygons of unequal sides is no closed form.
            const int around = kind == ElementKind::H8 ? 32 : 27;
            SolidInput* ring =
                &s.solid("inner", 210e9, 0.3, quarter_ring(a, b + 0.5 * over, thick, 8, 32, kind));
            ring->hold = sides;
            if (f.plane_strain) ring->hold.push_back(hold("z_max", {}, {}, still()));
            ring = &s.solid("outer", f.outer_E, f.outer_nu,
                            quarter_ring(b - 0.5 * over, c, thick, 8, around, kind));
            ring->hold = sides;
            if (f.plane_strain) ring->hold.push_back(hold("z_max", {}, {}, still()));
            s.touch("outer", "inner", f.mu, "x_min", "x_max").start_overlap = "resolve";
            const SolidRun run = run_solids(s.scene);
            double force = 0, area = 0, worst = 0;
            for (const ContactRecord& k : run.last().contacts) {
                force += k.normal_force;
                area += k.area;
                raise_to(worst, std::abs(k.pressure / f.reference - 1));
            }
            const std::string of =
                std::string(", ") + f.name + (kind == ElementKind::H8 ? ", H8" : ", T10");
            rows.push_back(relative("mean pressure" + of, f.reference, force / area, 5e-3));
            rows.back().note = fmt::format("largest error at a point {:.1e}", worst);
            rows.push_back(
                at_most("steps without certificate" + of, run.summary.uncertified_steps, 0));
        }
    return rows;
}

} // namespace amontons::validation
