#include "validation/vibrating_wire.hpp"

#include <cmath>

namespace amontons::validation {

WireBody make_body(const VibratingWire& w)
{
    BeamSegment g;
    g.length = w.length + w.held;
    g.radius = w.radius;
    g.EI = {w.EI, w.EI};
    g.GJ = {w.torsion_of_bending * w.EI, w.torsion_of_bending * w.EI};
    g.EA = {w.EA, w.EA};
    g.element = w.length / w.elements;
    g.density = w.density;
    Wire wire;
    wire.material = make_material({g}, 0);
    wire.sheath = Sheath{};
    WireMotion motion = make_motion(wire.material, w.damping);
    WireBody body = make_wire_body(std::move(wire), {}, std::move(motion), w.tolerance);
    start_in_sheath(body.wire, w.length, 0);
    return body;
}

Oscillation fit_oscillation(const std::vector<double>& x)
{
    double aa = 0, ab = 0, bb = 0, ac = 0, bc = 0;
    for (std::size_t n = 1; n + 1 < x.size(); ++n) {
        const double a = x[n], b = -x[n - 1], c = x[n + 1];
        aa += a * a, ab += a * b, bb += b * b, ac += a * c, bc += b * c;
    }
    const double det = aa * bb - ab * ab;
    const double sum = (ac * bb - bc * ab) / det, product = (bc * aa - ac * ab) / det;
    const double rho = std::sqrt(product);
    return {std::acos(0.5 * sum / rho), -std::log(rho)};
}

} // namespace amontons::validation
