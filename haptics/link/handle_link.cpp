#include "haptics/link/handle_link.hpp"

#include "haptics/link/body_link.hpp"
#include "haptics/link/wire_link.hpp"

#include <algorithm>

namespace amontons {

namespace {

/// Of a pose read at that time [s].
struct Stamp {
    double period = 0, time = 0;
    std::uint64_t sequence = 0;
};

void fill(SampledPath& way, const CondensedPath& condensed, int capacity)
{
    way.ahead = condensed.ahead;
    way.backwards = condensed.backwards;
    way.samples = static_cast<int>(condensed.samples.size());
    way.bend.resize(static_cast<std::size_t>(capacity) * kMostPathSamples);
    for (std::size_t k = 0; k < condensed.samples.size(); ++k) {
        const CondensedSample& sample = condensed.samples[k];
        way.at[k] = sample.at;
        way.rest[k] = sample.rest;
        for (std::size_t i = 0; i < sample.bend.size(); ++i)
            way.bend[kMostPathSamples * i + k] = sample.bend[i];
    }
}

template <class Real>
bool fill(ReducedOperator<Real>& op, const Condensed& condensed, const Stamp& stamp)
{
    std::copy(condensed.contact.begin(), condensed.contact.end(), op.contact.begin());
    op.handle = condensed.handle;
    op.rest = condensed.rest;
    op.stiffness = condensed.stiffness;
    op.ways = static_cast<int>(condensed.way.size());
    if (op.way.size() < condensed.way.size()) op.way.resize(condensed.way.size());
    for (std::size_t w = 0; w < condensed.way.size(); ++w)
        fill(op.way[w], condensed.way[w], op.capacity);
    op.validity = condensed.reach;
    op.period = stamp.period;
    op.time = stamp.time;
    op.sequence = stamp.sequence;
    op.jump_at = std::numeric_limits<double>::infinity();
    if (!condensed.solvable || !set_delassus(op, condensed.W)) return false;
    if (condensed.after.empty()) return true;
    if (op.after.empty()) op.after.emplace_back(op.capacity);
    if (fill(op.after[0], condensed.after[0], stamp) && op.ways > 0) op.jump_at = condensed.jump_at;
    return true;
}

} // namespace

template <class Real>
bool HandleLink::publish(ReducedOperator<Real>& op, double time, std::uint64_t sequence)
{
    condensed_ = condense_step(std::min(most_contacts_, op.capacity));
    condensed_.handle = device();
    count_.left_out = std::max(count_.left_out, condensed_.left_out);
    return fill(op, condensed_, {condense_.period, time, sequence});
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
