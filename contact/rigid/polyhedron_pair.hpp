#pragma once

#include "contact/rigid/pair_contacts.hpp"

#include <optional>
#include <vector>

// Contacts between corners, edges and faces of two polyhedra, one pair of features at a time. For
// polyhedron_contacts.cpp alone, which chooses the pairs; both work in the frame of b.

namespace amontons {

/// Space for as many items as needed, without the heap for the common few.
template <class T, std::size_t Few> class Buffer {
public:
    explicit Buffer(std::size_t size) : size_(size)
    {
        if (size > Few) many_.resize(size);
    }
    T& operator[](std::size_t i) { return data()[i]; }
    /// The numbers, for writing.
    T* data() { return size_ > Few ? many_.data() : few_.data(); }
    /// The numbers.
    std::span<T> all() { return {data(), size_}; }

private:
    std::size_t size_;
    std::array<T, Few> few_;
    std::vector<T> many_;
};

/// A polyhedron put into another frame; what connects its features is borrowed.
class TurnedPolyhedron {
public:
    TurnedPolyhedron(const PolyhedronView& own, const Mat3& turn, const Vec3& shift);
    TurnedPolyhedron(const TurnedPolyhedron&) = delete;
    TurnedPolyhedron& operator=(const TurnedPolyhedron&) = delete;
    /// A view of the turned body; it must not outlive it.
    PolyhedronView view();

private:
    const PolyhedronView& own_;
    Buffer<Vec3, 16> vertices_, normals_;
    Buffer<double, 16> offsets_;
    Buffer<PolyhedronEdge, 24> edges_;
};

/// One of the two bodies, in the frame of b.
struct PolyhedronSide {
    PolyhedronView view;
    const TriangleShape* mesh = nullptr; ///< nullptr: a box
    const Box* box = nullptr;
    Mat3 turn = Mat3::Identity(); ///< own frame -> frame of b
    /// Origin of the body in the frame of b [m].
    Vec3 shift = Vec3::Zero();

    /// x of the frame of b in the frame of the body [m].
    Vec3 own(const Vec3& x) const { return turn.transpose() * (x - shift); }
};

/// Two polyhedra and what all their features' contacts share.
struct PolyhedronPair {
    /// The two bodies.
    PolyhedronSide a, b;
    double reach = 0, size = 0; ///< [m]
    RigidContacts* out = nullptr;
    bool convex = false;   ///< both
    double least = -1e300; ///< gaps of convex bodies that are apart are not below [m]
    double deepest = 0;    ///< overlap of edges of others [m]
    /// Of convex bodies that overlap or touch: the direction from b to a of least overlap.
    /// Contacts that would push otherwise are none.
    std::optional<Vec3> away{};

    /// True if a contact with this normal separates the bodies: within 60 degrees of `away`, where
    /// that is set.
    bool agrees(const Vec3& normal) const { return !away || normal.dot(*away) > 0.5; }
};

/// True if no edge of the body descends from this vertex below the plane through it by more than
/// the sine `overhang`; n is the plane's normal, outwards from the other body. Edges along `free`
/// (unit, within 30 degrees) do not count.
bool rises(const PolyhedronView& body, std::int32_t vertex, const Vec3& n, double overhang,
           const Vec3& free = Vec3::Zero());

/// Is a point of a face's plane on the face, or outside it by no more than `slack` [m]?
bool on_face(const PolyhedronSide& side, std::int32_t face, const Vec3& x, double slack);

/// Height of a vertex over a face if it may touch it: the foot lies on the face, and the body at
/// the vertex rises from the face or falls towards it by less than 30 degrees.
/// @param on_a    the vertex is a's, the face b's; else the other way round
/// @param beyond  how far the foot may lie beyond an edge that the face shares with another in a
///                hollow [m]
/// @returns nothing above reach
std::optional<double> height_over_face(const PolyhedronPair& pair, bool on_a, std::int32_t vertex,
                                       std::int32_t face, double beyond = 0);
/// Adds a contact of a vertex with a face of the other body, if it is within reach and valid.
/// @param height  of the vertex over the face [m]
void add_vertex_face(const PolyhedronPair& pair, bool on_a, std::int32_t vertex, std::int32_t face,
                     double height);

/// An edge and the normals of its two faces.
struct EdgeWithFaces {
    /// The edge.
    const PolyhedronEdge& edge;
    /// Outward normals of its faces.
    const Vec3 &normal_0, &normal_1;
};
/// The normal of two convex edges that touch crosswise: both bodies lie behind it.
std::optional<Vec3> crossing_normal(const EdgeWithFaces& a, const EdgeWithFaces& b);
std::optional<Vec3> crossing_normal(const PolyhedronPair& pair, std::int32_t edge_a,
                                    std::int32_t edge_b);

/// Adds the crossing of two convex edges, if they cross seen along their common normal and both
/// bodies lie behind it, or opposed faces are nearly normal to it.
void add_edge_edge(const PolyhedronPair& pair, std::int32_t edge_a, std::int32_t edge_b);

/// Adds a vertex beside an edge, which it may touch sideways.
void add_vertex_edge(const PolyhedronPair& pair, bool on_a, std::int32_t vertex, std::int32_t edge);

/// Adds two vertices that face each other.
void add_vertex_vertex(const PolyhedronPair& pair, std::int32_t vertex_a, std::int32_t vertex_b);

/// Distance from the surface of one side, < 0 inside [m]; x in the frame of b.
/// @param close  if not null, a triangle that is probably near, or -1; that of x on return
double signed_distance(const PolyhedronSide& side, const Vec3& x, std::int32_t* close = nullptr);

} // namespace amontons
