#pragma once

#include "mesh/base/types.hpp"

#include <limits>
#include <span>
#include <vector>

namespace amontons {

/// An axis-aligned box; the default holds nothing.
struct BoundingBox {
    /// Least coordinates [m].
    Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity());
    /// Greatest coordinates [m].
    Eigen::Array3d high = -low;

    /// Extends the box by a point.
    void add(const Vec3& x)
    {
        low = low.min(x.array());
        high = high.max(x.array());
    }
    void add(const BoundingBox& other)
    {
        low = low.min(other.low);
        high = high.max(other.high);
    }
    /// True if the boxes have a point in common.
    bool touches(const BoundingBox& other) const
    {
        return (low <= other.high).all() && (other.low <= high).all();
    }
};

/// A tree over boxes of any things, to find those that touch a box. O(n log n) to build.
class BoxTree {
public:
    explicit BoxTree(std::span<const BoundingBox> boxes);

    /// Calls visit(std::int32_t) for each box that touches this one, in no certain order.
    template <class Visit> void visit(const BoundingBox& box, Visit visit) const
    {
        // Each level leaves at most one node behind on the stack.
        std::int32_t stack[64];
        int count = 0;
        if (!nodes_.empty()) stack[count++] = 0;
        while (count > 0) {
            const Node& node = nodes_[static_cast<std::size_t>(stack[--count])];
            if (!node.box.touches(box)) continue;
            if (node.count == 0) {
                stack[count++] = node.first + 1;
                stack[count++] = node.first;
                continue;
            }
            for (std::int32_t i = node.first; i < node.first + node.count; ++i)
                if (const auto k = static_cast<std::size_t>(i); boxes_[k].touches(box))
                    visit(order_[k]);
        }
    }

    const BoundingBox& all() const { return all_; } ///< around all of them

private:
    struct Node {
        BoundingBox box;
        std::int32_t first = 0; ///< leaf: position in order_; else left child, right is the next
        std::int32_t count = 0; ///< of boxes in a leaf; 0: inner node
    };

    void split_(std::size_t node, std::int32_t first, std::int32_t count,
                std::span<const BoundingBox> boxes);

    std::vector<Node> nodes_;
    std::vector<std::int32_t> order_; ///< boxes, leaf by leaf
    std::vector<BoundingBox> boxes_;  ///< in that order
    BoundingBox all_;
};

} // namespace amontons
