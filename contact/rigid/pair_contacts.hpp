#pragma once

#include "contact/rigid/detect.hpp"

// One function for each pair of shapes, for detect.cpp alone. All work in the frame of b, where
// round-off does not depend on the distance of the pair from the origin of space.

namespace amontons {

/// What a contact's id states of one side: kind and number.
enum class Feature : std::uint32_t { whole, vertex, edge, face, rim, spread, corner };

/// The identity of a contact by its features on both bodies: constant while they are the same.
constexpr std::uint64_t contact_id(Feature kind_a, std::size_t a, Feature kind_b, std::size_t b)
{
    const auto side = [](Feature kind, std::size_t i) {
        return static_cast<std::uint64_t>(kind) << 28 | (static_cast<std::uint64_t>(i) & 0xfffffff);
    };
    return side(kind_a, a) << 32 | side(kind_b, b);
}

/// A pair in the frame of b: x = turn * (x in the frame of a) + shift.
struct PairFrame {
    /// Rotation of a in the frame of b.
    Mat3 turn = Mat3::Identity();
    Vec3 shift = Vec3::Zero(); ///< origin of a in the frame of b [m]
    double reach = 0;          ///< largest gap of a contact [m]
    double size = 0;           ///< of the smaller body: its bounding radius [m]
};

/// Places nearer than this part of the size are the same. Ratio.
constexpr double kSamePlace = 1e-9;
/// Corners and edges nearer than this part of the size have no direction of their own: normals
/// come from the faces around them. Ratio.
constexpr double kTouching = 1e-6;
/// Faces inclined by less than 30 degrees are opposed: all their corners count. Cosine and sine.
constexpr double kOpposed = 0.86602540378443865, kInclined = 0.5;
/// Round-off allowed where a direction is tested to point behind a normal (cosine); edges whose
/// directions differ by less do not cross (sine).
constexpr double kStrict = 1e-9, kParallel = 1e-6;
/// A face with `spread` that is inclined by less (sine) touches with its area.
constexpr double kFlatOn = 1e-3;

/// Contacts of one pair, in the order in which they were found.
using RigidContacts = std::vector<RigidContact>;

/// Appends the contacts of a pair of shapes whose gap is at most pair.reach; places and normals in
/// the frame of b [m].
void touch(const PairFrame& pair, const Ball& a, const Ball& b, RigidContacts& out);
void touch(const PairFrame& pair, const Ball& a, const Box& b, RigidContacts& out);
void touch(const PairFrame& pair, const Ball& a, const Cylinder& b, RigidContacts& out);
void touch(const PairFrame& pair, const Ball& a, const TriangleShape& b, RigidContacts& out);
void touch(const PairFrame& pair, const Ball& a, const Plane& b, RigidContacts& out);
void touch(const PairFrame& pair, const Box& a, const Plane& b, RigidContacts& out);
void touch(const PairFrame& pair, const Cylinder& a, const Plane& b, RigidContacts& out);
void touch(const PairFrame& pair, const TriangleShape& a, const Plane& b, RigidContacts& out);
void touch(const PairFrame& pair, const Cylinder& a, const Box& b, RigidContacts& out);
void touch(const PairFrame& pair, const Cylinder& a, const TriangleShape& b, RigidContacts& out);
void touch(const PairFrame& pair, const Cylinder& a, const Cylinder& b, RigidContacts& out);
void touch(const PairFrame& pair, const Ball& a, const Ellipsoid& b, RigidContacts& out);
void touch(const PairFrame& pair, const Ball& a, const Capsule& b, RigidContacts& out);
void touch(const PairFrame& pair, const Capsule& a, const Plane& b, RigidContacts& out);
void touch(const PairFrame& pair, const Capsule& a, const Box& b, RigidContacts& out);
void touch(const PairFrame& pair, const Capsule& a, const Cylinder& b, RigidContacts& out);
void touch(const PairFrame& pair, const Capsule& a, const TriangleShape& b, RigidContacts& out);
void touch(const PairFrame& pair, const Capsule& a, const Capsule& b, RigidContacts& out);
void touch(const PairFrame& pair, const Ellipsoid& a, const Plane& b, RigidContacts& out);
void touch(const PairFrame& pair, const Ellipsoid& a, const Box& b, RigidContacts& out);
void touch(const PairFrame& pair, const Ellipsoid& a, const Cylinder& b, RigidContacts& out);
void touch(const PairFrame& pair, const Ellipsoid& a, const TriangleShape& b, RigidContacts& out);
void touch(const PairFrame& pair, const Ellipsoid& a, const Capsule& b, RigidContacts& out);
void touch(const PairFrame& pair, const Ellipsoid& a, const Ellipsoid& b, RigidContacts& out);
void touch(const PairFrame& pair, const Box& a, const Box& b, RigidContacts& out);
void touch(const PairFrame& pair, const TriangleShape& a, const Box& b, RigidContacts& out);
void touch(const PairFrame& pair, const TriangleShape& a, const TriangleShape& b,
           RigidContacts& out);

/// Drops contacts from `begin` on that repeat an earlier one: same points, nearly the same normal.
/// @param size  of the smaller body, in whose unit points are compared [m]
void drop_repeated(RigidContacts& out, std::size_t begin, double size);

/// The place on a solid's surface nearest to x.
struct NearestPlace {
    /// The nearest point of the shape's surface [m].
    Vec3 point = Vec3::Zero();
    Vec3 normal = Vec3::UnitZ(); ///< unit, outwards; from the point to x where x is outside
    double distance = 0;         ///< < 0 inside [m]
    std::uint32_t feature = 0;   ///< kind and number, as in an id
};
/// The nearest place of the surface of a shape to x, in the frame of the shape [m].
NearestPlace nearest_on(const Box& box, const Vec3& x);
NearestPlace nearest_on(const Cylinder& cylinder, const Vec3& x);
/// Is a body convex, and are its faces so few that all are compared? Of many those alone are that
/// are near.
inline bool convex_and_small(const Polyhedron& body)
{
    return body.convex && body.vertices.size() * body.normals.size() <= 4'000'000;
}

/// @param close  a triangle that is probably near, or -1: makes the search fast, changes no bit
/// @param found  set to the nearest triangle, if not null
NearestPlace nearest_on(const TriangleShape& body, const Vec3& x, std::int32_t close = -1,
                        std::int32_t* found = nullptr);
NearestPlace nearest_on(const Ellipsoid& ellipsoid, const Vec3& x);
NearestPlace nearest_on(const Capsule& capsule, const Vec3& x);

} // namespace amontons
