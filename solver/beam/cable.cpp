#include "solver/beam/cable.hpp"

#include <cmath>

namespace amontons {
namespace {

Vec3 chord(const BeamNode& a, const BeamNode& b)
{
    return {b.difference(a, 0), b.difference(a, 1), b.difference(a, 2)};
}

} // namespace

double cable_energy(const BeamNode& a, const BeamNode& b, const ElementLaw& law)
{
    const double stretch = chord(a, b).norm() / law.length;
    return law.constant + 0.5 * (law.S[0] * stretch - 2 * law.P[0]) * stretch;
}

void add_cable(int first, int last, const std::vector<BeamNode>& nodes,
               const std::vector<ElementLaw>& laws, BlockTridiagonal& K, std::vector<Node6>& g)
{
    for (int i = first; i < last; ++i) {
        const std::size_t n = std::size_t(i);
        const ElementLaw& law = laws[n];
        const Vec3 d = chord(nodes[n], nodes[n + 1]);
        const double l = d.norm(), L = law.length;
        const Vec3 u = d / l;
        const double tension = (law.S[0] * (l / L) - law.P[0]) / L;
        const Mat3 k =
            tension / l * Mat3::Identity() + (law.S[0] / (L * L) - tension / l) * u * u.transpose();
        for (int r = 0; r < 3; ++r) {
            g[n].value[r] -= tension * u[r];
            g[n + 1].value[r] += tension * u[r];
            for (int c = 0; c < 3; ++c) {
                K.diagonal(i)(r, c) += k(r, c);
                K.diagonal(i + 1)(r, c) += k(r, c);
                K.upper(i)(r, c) -= k(r, c);
                K.lower(i)(r, c) -= k(r, c);
            }
        }
    }
    for (int i = first; i <= last; ++i)
        for (int r = 3; r < 6; ++r)
            K.diagonal(i)(r, r) = 1;
}

} // namespace amontons
