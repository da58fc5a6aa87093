#include "solver/beam/clamp.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace amontons {

void start_clamped(Wire& wire, const Vec3& at, const Mat3& frame)
{
    wire.sheath.reset();
    WireState& s = wire.state;
    s.first = 0;
    s.inserted = s.base_insertion = wire.material.length;
    s.rotation = s.base_twist = 0;
    s.nodes.assign(wire.material.node.size(), BeamNode{});
    const Quaternion start = quaternion_of(frame);
    std::copy(start.q, start.q + 4, s.nodes[0].q);
    for (int k = 0; k < 3; ++k)
        s.nodes[0].x[k] = at[k];
    grow_naturally(s.nodes, wire.material.law);
}

void grow_naturally(std::vector<BeamNode>& nodes, const std::vector<ElementLaw>& laws)
{
    for (std::size_t i = 0; i + 1 < nodes.size(); ++i) {
        const ElementLaw& law = laws[i];
        Vec3 natural; // twist and curvatures [1/m]
        for (int k = 0; k < 3; ++k) {
            const std::size_t j = std::size_t(k) + 3;
            natural[k] = law.S[j] > 0 ? law.P[j] / law.S[j] : 0;
        }
        const BeamNode& a = nodes[i];
        BeamNode b = a;
        rotate_in_body(b.q, law.length * natural);
        // Chord of a helix: integral of exp(s [natural]) e1, by Rodrigues' formula.
        const Vec3 e = Vec3::UnitX();
        const double k = natural.norm(), angle = k * law.length;
        Vec3 chord = law.length * e;
        if (angle > 1e-9) {
            const Vec3 u = natural / k, along = u * u.dot(e);
            const double half = std::sin(0.5 * angle);
            chord = law.length * along + std::sin(angle) / k * (e - along) +
                    2 * half * half / k * u.cross(e);
        }
        const Vec3 step = rotation_matrix(a.q) * chord;
        for (int j = 0; j < 3; ++j)
            b.move(j, step[j]);
        nodes[i + 1] = b;
    }
}

} // namespace amontons
