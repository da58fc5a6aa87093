#include "contact/rigid/detect.hpp"

#include "contact/rigid/pair_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <concepts>

namespace amontons {

// A contact of two touching corners (Feature::corner) stands for all that faces state of these
// places.
void drop_repeated(RigidContacts& out, std::size_t begin, double size)
{
    const auto is_corner = [](const RigidContact& c) {
        const auto kind = [](std::uint64_t side) { return static_cast<Feature>(side >> 28 & 0xf); };
        return kind(c.id >> 32) == Feature::corner || kind(c.id & 0xffffffff) == Feature::corner;
    };
    const auto repeats = [&](const RigidContact& earlier, const RigidContact& c) {
        const bool corner = is_corner(earlier);
        const double near = (corner ? 2 * kTouching : kSamePlace) * size;
        return (earlier.point_a - c.point_a).squaredNorm() <= near * near &&
               (earlier.point_b - c.point_b).squaredNorm() <= near * near &&
               earlier.normal.dot(c.normal) > (corner ? 0 : 0.9);
    };
    std::size_t kept = begin;
    if (out.size() - begin <= 128) {
        for (std::size_t i = begin; i < out.size(); ++i) {
            bool repeated = false;
            for (std::size_t j = begin; j < kept && !repeated; ++j)
                repeated = repeats(out[j], out[i]);
            if (!repeated) out[kept++] = out[i];
        }
        out.resize(kept);
        return;
    }
    // Many: only those near along x are compared.
    std::vector<std::size_t> order(out.size() - begin);
    for (std::size_t i = 0; i < order.size(); ++i)
        order[i] = begin + i;
    std::sort(order.begin(), order.end(), [&](std::size_t i, std::size_t j) {
        const double x = out[i].point_a.x(), y = out[j].point_a.x();
        return x != y ? x < y : i < j;
    });
    std::vector<char> dropped(order.size(), 0);
    for (std::size_t i = 0; i < order.size(); ++i)
        for (std::size_t j = i + 1; j < order.size(); ++j) {
            if (out[order[j]].point_a.x() - out[order[i]].point_a.x() > 2 * kTouching * size) break;
            const std::size_t early = std::min(order[i], order[j]);
            const std::size_t late = std::max(order[i], order[j]);
            if (repeats(out[early], out[late])) dropped[late - begin] = 1;
        }
    for (std::size_t i = begin; i < out.size(); ++i)
        if (dropped[i - begin] == 0) out[kept++] = out[i];
    out.resize(kept);
}

namespace {

template <class A, class B>
concept Known = requires(const PairFrame& pair, const A& a, const B& b, RigidContacts& out)
{
    touch(pair, a, b, out);
};

void turn_round(RigidContact& c)
{
    std::swap(c.point_a, c.point_b);
    c.normal = -c.normal;
    c.id = c.id << 32 | c.id >> 32;
}

// In the frame of b, then out into space.
template <class A, class B>
void detect_known(const A& a, const Pose& pose_a, const B& b, const Pose& pose_b, PairFrame pair,
                  RigidContacts& out)
{
    const Mat3 turn = pose_b.turn.toRotationMatrix();
    pair.turn = turn.transpose() * pose_a.turn.toRotationMatrix();
    pair.shift = turn.transpose() * (pose_a.place - pose_b.place);
    const std::size_t begin = out.size();
    touch(pair, a, b, out);
    drop_repeated(out, begin, pair.size);
    for (std::size_t i = begin; i < out.size(); ++i) {
        RigidContact& c = out[i];
        c.point_a = pose_b.place + turn * c.point_a;
        c.point_b = pose_b.place + turn * c.point_b;
        c.normal = turn * c.normal;
    }
}

} // namespace

void detect(const RigidShape& a, const Pose& pose_a, const RigidShape& b, const Pose& pose_b,
            double reach, std::vector<RigidContact>& out)
{
    PairFrame pair;
    pair.reach = reach;
    pair.size = std::min(bounding_radius(a), bounding_radius(b));
    std::visit(
        [&](const auto& one, const auto& two) {
            using A = std::decay_t<decltype(one)>;
            using B = std::decay_t<decltype(two)>;
            if constexpr (Known<A, B>) {
                detect_known(one, pose_a, two, pose_b, pair, out);
            } else if constexpr (Known<B, A>) {
                const std::size_t begin = out.size();
                detect_known(two, pose_b, one, pose_a, pair, out);
                for (std::size_t i = begin; i < out.size(); ++i)
                    turn_round(out[i]);
            }
        },
        a, b);
}

} // namespace amontons
