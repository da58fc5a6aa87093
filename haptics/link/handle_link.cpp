#include "haptics/link/handle_link.hpp"

#include "haptics/link/body_link.hpp"
#include "haptics/link/wire_link.hpp"

#include <algorithm>

namespace amontons {

template <class Real>
bool HandleLink::publish(ReducedOperator<Real>& op, double time, std::uint64_t sequence)
{
    condensed_ = condense_step(std::min(most_contacts_, op.capacity));
    count_.left_out = std::max(count_.left_out, condensed_.left_out);
    std::copy(condensed_.contact.begin(), condensed_.contact.end(), op.contact.begin());
    op.handle = device();
    op.rest = condensed_.rest;
    op.stiffness = condensed_.stiffness;
    op.ahead = condensed_.ahead;
    op.looks = static_cast<int>(condensed_.look.size());
    for (std::size_t k = 0; k < condensed_.look.size(); ++k) {
        const CondensedLook& look = condensed_.look[k];
        op.look_at[k] = look.at;
        op.rest_bend[k] = look.rest;
        for (std::size_t i = 0; i < look.bend.size(); ++i)
            op.bend[kMostLooks * i + k] = look.bend[i];
    }
    op.validity = condensed_.reach;
    op.period = condense_.period;
    op.time = time;
    op.sequence = sequence;
    return condensed_.solvable && set_delassus(op, condensed_.W);
}

std::unique_ptr<HandleLink> make_link(const Scene& scene, const std::vector<Obstacle>& obstacles,
                                      const LinkOptions& options)
{
    if (holds_wire(scene)) return std::make_unique<WireLink>(scene, obstacles, options);
    return std::make_unique<BodyLink>(scene, obstacles, options);
}

HandPose between(const HandPose& a, const HandPose& b, double share)
{
    const Vec6 d = displacement(a, b);
    return {a.position + share * d.head<3>(),
            (turn(share * d.tail<3>()) * a.rotation).normalized()};
}

template bool HandleLink::publish(ReducedOperator<float>&, double, std::uint64_t);
template bool HandleLink::publish(ReducedOperator<double>&, double, std::uint64_t);

} // namespace amontons
