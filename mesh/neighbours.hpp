#pragma once

#include "mesh/volume_mesh.hpp"

namespace amontons {

/// For each of n things a list of others, all lists in one array.
struct Lists {
    std::vector<std::int64_t> starts; ///< n + 1, in `items`
    std::vector<std::int32_t> items;
    /// Number of lists.
    std::size_t size() const { return starts.empty() ? 0 : starts.size() - 1; }
    /// The list of i.
    std::span<const std::int32_t> of(std::int32_t i) const
    {
        const auto k = static_cast<std::size_t>(i);
        return std::span<const std::int32_t>(items).subspan(
            static_cast<std::size_t>(starts[k]),
            static_cast<std::size_t>(starts[k + 1] - starts[k]));
    }
};

/// The elements at each node, ascending. O(n).
Lists elements_at_nodes(const VolumeMesh& mesh);

/// The nodes that share an element with each node, ascending, without itself: the graph of a
/// stiffness matrix. O(n) for a bounded number of elements at a node.
Lists nodes_at_nodes(const VolumeMesh& mesh);

/// A face and its corners in ascending order (the fourth of a triangle is -1).
struct SortedFace {
    /// Corners of the face, ascending; -1 behind the last.
    std::array<std::int32_t, 4> corners{};
    /// The element and its local face.
    FaceRef face;
    /// True if both are the same face.
    bool same_corners(const SortedFace& other) const { return corners == other.corners; }
};

/// Sorts a few numbers, ascending (std::sort on so short an array causes warnings).
inline void sort_few(std::span<std::int32_t> values)
{
    for (std::size_t i = 1; i < values.size(); ++i)
        for (std::size_t j = i; j > 0 && values[j - 1] > values[j]; --j)
            std::swap(values[j - 1], values[j]);
}

/// All faces of all elements, those with the same corners next to each other: by corners, then by
/// element. O(n) for a bounded number of elements at a node.
std::vector<SortedFace> sorted_faces(const VolumeMesh& mesh);

/// Calls visit(std::span<const SortedFace>) for each group of faces with the same corners.
template <class Visit> void for_each_face(const std::vector<SortedFace>& sorted, Visit visit)
{
    for (std::size_t i = 0, j = 0; i < sorted.size(); i = j) {
        while (j < sorted.size() && sorted[i].same_corners(sorted[j]))
            ++j;
        visit(std::span<const SortedFace>(&sorted[i], j - i));
    }
}

/// The element beyond each local face of each element (in the order of shape_of(kind).faces), or
/// -1 where there is none, or more than one.
Lists elements_at_faces(const VolumeMesh& mesh);

} // namespace amontons
