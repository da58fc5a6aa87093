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
        nodes[i + 1] = nodes[i];
        move_along(nodes[i + 1], natural_strain(laws[i]), laws[i].length);
    }
}

} // namespace amontons
