#include "contact/surface/mortar.hpp"

#include "contact/surface/collocation.hpp"
#include "contact/surface/contact_sums.hpp"
#include "contact/surface/facet_outline.hpp"
#include "contact/surface/fixed_integrals.hpp"
#include "contact/surface/polygon_sides.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

// For each face of the slave:
//
//   1 its facets are cut by the facets of the master that are directed at it, in the plane of the
//   slave's
//     facet: segments, convex polygons of which each lies on one facet of either side;
//   2 where layers of the master overlap, the nearer one takes its segments out of the farther;
//     so does the back of the master: what lies behind it belongs to another overlap, through a
//     whole body;
//   3 whole faces are integrated with dual functions, partly covered ones with the positive
//     partition, for which each segment is cut once more;
//   4 an integration point z of a segment has its place x on the true face of the slave: T3, Q4
//     over z (Q4: straight sides, so facet and face cover the same part of the plane), T6 by the
//     quarter's reference coordinates (quarters tile the reference triangle, whatever the
//     curvature). The true face of the master is found along the plane's normal from x, by Newton's
//     method; where segments of curved faces do not quite match it may lie slightly beyond its
//     border, which is harmless: its shape functions sum to 1 there too.

namespace amontons {
namespace {

/// A face is whole if this part of it is covered. Between the two shares the functions of a whole
/// face pass into those of a partly covered one: where bodies slide, a contact that changed them at
/// once would have no balance between the two.
constexpr double kWholeOverlap = 0.995, kPart = 0.9;
/// The weight of faces directed at each other increases from 0 at kFacing to 1 at this cosine: else
/// the side of a block that is pressed until it rolls onto the floor would be included at once,
/// with its whole gap.
constexpr double kFullyFacing = 0.6;
/// More than the facet's area is covered: the master has layers.
constexpr double kTwice = 1e-9;
/// Segments with less of the facet's area are round-off.
constexpr double kNoOverlap = 1e-14;
/// Faces of one body overlap by no more of their distance at rest: more is the body between them,
/// which would have to be pressed to this share of its thickness to be taken for an overlap.
constexpr double kOwnThickness = 0.3;
constexpr double kBeside = 1.1;  // of both faces' radii
constexpr double kBehind = 1e-3; // cosine: what lies beside a face, as in a closed slit, does not

/// Of a master that does not bend: from so many facets on they are compared with all sides of a
/// slave's facet at once, which rounds differently.
constexpr std::size_t kManyFacets = 64;

/// Quadrilaterals: bent by less they are parallelograms.
constexpr double kStraightEdge = 1e-3;

struct Segment {
    const Facet* slave = nullptr;
    const Facet* master = nullptr;
    ConvexPolygon polygon; ///< in the plane of the slave's facet
    double gap = 0;        ///< between the facets at its middle [m]
    bool hides = false;    ///< the back of a master's facet: it only covers what is behind it
};

class Mortar {
public:
    Mortar(const ExternalSurface& slave, std::span<const Vec3> slave_places,
           const ExternalSurface& master, std::span<const Vec3> master_places,
           const BoundingBox& master_box, const MortarOptions& options, bool fixed = false)
        : slave_(slave)
        , master_(master)
        , slave_places_(slave_places)
        , master_places_(master_places)
        , at_rest_(options.at_rest)
        , reach_(options.reach)
        , of_master_(options.master_normals)
        , smooth_(options.smooth_normals)
        , of_gap_(options.normals_of_gap)
        , slave_facets_(facets_near(slave, slave_places, master_box, options.reach))
        , sums_(slave, master, fixed)
    {
        if (smooth_ && !of_master_ && !slave_facets_.empty())
            slave_normals_.emplace(slave, slave_places);
    }

    /// With a master that bends: searched anew each time.
    SurfaceContacts contacts()
    {
        if (slave_facets_.empty()) return {};
        const FacetTree faces(facets_near(master_, master_places_, search_box_(), 0));
        std::optional<SmoothNormals> normals;
        if (smooth_) normals.emplace(master_, master_places_);
        return contacts(faces, normals ? &*normals : nullptr);
    }

    /// With one that does not: with `options` that smooth its normals.
    SurfaceContacts contacts(const FixedShape& master)
    {
        fixed_.emplace(master, slave_, slave_places_);
        return contacts(master.faces, &master.normals);
    }

    SurfaceContacts contacts(const FacetTree& master, const SmoothNormals* normals)
    {
        master_faces_ = &master;
        at_once_ = fixed_ && master.facets.size() >= kManyFacets;
        master_normals_ = smooth_ ? normals : nullptr;
        if (master.facets.empty()) return {};
        for (std::size_t i = 0; i < slave_facets_.size();) {
            std::size_t end = i + 1;
            while (end < slave_facets_.size() && slave_facets_[end].face == slave_facets_[i].face)
                ++end;
            add_face_(std::span(slave_facets_).subspan(i, end - i));
            i = end;
        }
        return sums_.contacts(slave_places_, master_places_, reach_, of_gap_);
    }

private:
    /// Where the master is searched for, beyond the reach: all of a face of which a part is near
    /// must find its master, else it would count as partly covered.
    double range_(const Facet& facet) const { return reach_ + facet.size / 2; }

    /// Whether two faces of one body have a node in common.
    bool joined_(std::int32_t slave_face, std::int32_t master_face) const
    {
        const auto a = slave_.face(static_cast<std::size_t>(slave_face)),
                   b = master_.face(static_cast<std::size_t>(master_face));
        return std::any_of(a.begin(), a.end(), [&](std::int32_t node) {
            return std::find(b.begin(), b.end(), node) != b.end();
        });
    }

    /// How far a face of one body lies behind another at rest: the body's thickness there, or the
    /// way between the middles of faces that are not beside each other across it.
    struct Behind {
        double way = 0; ///< [m]
        bool across = false;
    };
    /// Nothing where it lies in front, as across a slit.
    std::optional<Behind> behind_at_rest_(std::int32_t slave_face, std::int32_t master_face) const
    {
        const auto corners_of = [&](const ExternalSurface& surface, std::int32_t face) {
            const auto nodes = surface.face(static_cast<std::size_t>(face));
            return nodes.first(nodes.size() == 4 ? 4 : 3);
        };
        const auto middle_of = [&](std::span<const std::int32_t> corners) {
            Vec3 sum = Vec3::Zero();
            for (const std::int32_t node : corners)
                sum += at_rest_[static_cast<std::size_t>(node)];
            return Vec3(sum / double(corners.size()));
        };
        const auto radius_of = [&](std::span<const std::int32_t> corners, const Vec3& middle) {
            double most = 0;
            for (const std::int32_t node : corners)
                most = std::max(most, (at_rest_[static_cast<std::size_t>(node)] - middle).norm());
            return most;
        };
        const auto own = corners_of(slave_, slave_face), other = corners_of(master_, master_face);
        const Vec3 middle = middle_of(own), other_middle = middle_of(other),
                   way = other_middle - middle;
        Vec3 normal = Vec3::Zero();
        for (std::size_t i = 0; i < own.size(); ++i)
            normal +=
                (at_rest_[static_cast<std::size_t>(own[i])] - middle)
                    .cross(at_rest_[static_cast<std::size_t>(own[(i + 1) % own.size()])] - middle);
        if (!(normal.dot(way) < -kBehind * normal.norm() * way.norm())) return std::nullopt;
        // Faces wider than the body is thick: their middles are farther apart than its sides.
        const double thick = -normal.normalized().dot(way);
        const double beside = (way + thick * normal.normalized()).norm();
        const bool across =
            beside <= kBeside * (radius_of(own, middle) + radius_of(other, other_middle));
        return Behind{across ? thick : way.norm(), across};
    }

    /// Around all that the slave's facets are directed at.
    BoundingBox search_box_() const
    {
        BoundingBox box;
        for (const Facet& facet : slave_facets_)
            box.add(box_of(facet, range_(facet) * facet.normal));
        return box;
    }

    void add_face_(std::span<const Facet> facets)
    {
        segments_.clear();
        double covered = 0, whole = 0;
        for (const Facet& facet : facets) {
            const FacetPlane plane(facet);
            const std::size_t first = segments_.size();
            whole += cut_(facet, plane);
            for (std::size_t i = first; i < segments_.size(); ++i)
                covered += facing_(segments_[i]) * area(segments_[i].polygon);
        }
        if (segments_.empty()) return;
        const auto face = static_cast<std::size_t>(facets[0].face);
        const FaceMultipliers multipliers = face_multipliers({slave_.face(face), slave_places_});
        const double dual =
            std::clamp((covered / whole - kPart) / (kWholeOverlap - kPart), 0.0, 1.0);
        face_sums_.clear();
        if (fixed_)
            integrate_fixed_(multipliers, dual);
        else
            for (const Segment& segment : segments_)
                integrate_(segment, multipliers, dual, facing_(segment));
        sums_.add(face, multipliers, face_sums_);
    }

    /// Segments of a facet of the slave.
    /// @return  its area [m^2]
    double cut_(const Facet& facet, const FacetPlane& plane)
    {
        double heights[2];
        const ConvexPolygon own = outline(facet, plane, false, heights);
        const PolygonSides sides(own);
        const double whole = area(own), least = kNoOverlap * whole;
        const double range = range_(facet);
        const std::size_t first = segments_.size();
        double covered = 0;
        bool layers = false;
        near_.clear();
        master_faces_->tree.visit(box_of(facet, range * facet.normal), [&](std::int32_t i) {
            if (std::abs(facet.normal.dot(
                    master_faces_->facets[static_cast<std::size_t>(i)].normal)) >= kFacing)
                near_.push_back(i);
        });
        // The tree's order is of no meaning; that of the surface finds neighbours close in memory.
        std::sort(near_.begin(), near_.end());
        // Behind a face comes first what the body has there itself: no overlap is deeper.
        if (!at_rest_.empty()) behind_.assign(near_.size(), std::nullopt);
        double own_thickness = range;
        for (std::size_t k = 0; k < near_.size() && !at_rest_.empty(); ++k) {
            const Facet& other = master_faces_->facets[static_cast<std::size_t>(near_[k])];
            if (facet.normal.dot(other.normal) > 0 || joined_(facet.face, other.face)) continue;
            behind_[k] = behind_at_rest_(facet.face, other.face);
            if (behind_[k] && behind_[k]->across)
                own_thickness = std::min(own_thickness, behind_[k]->way);
        }
        for (std::size_t k = 0; k < near_.size(); ++k) {
            const Facet& other = master_faces_->facets[static_cast<std::size_t>(near_[k])];
            const bool hides = facet.normal.dot(other.normal) > 0;
            double deepest = range;
            if (!at_rest_.empty()) {
                if (joined_(facet.face, other.face)) continue;
                if (!hides) deepest = own_thickness;
                if (behind_[k]) deepest = std::min(deepest, kOwnThickness * behind_[k]->way);
            }
            double far[2];
            outline_to(other, plane, !hides, far, shared_);
            if (far[0] > range || far[1] < -range) continue;
            const Vec3 normal = plane.axes * other.normal, middle_place = plane(other.middle);
            const auto add_shared = [&] {
                if (!(at_once_ ? cut_to(sides, shared_) : cut_to(own, shared_))) return;
                const double size = area(shared_);
                if (!(size > least)) return;
                const Vec2 off = middle(shared_) - middle_place.head<2>();
                const double gap = middle_place.z() - normal.head<2>().dot(off) / normal.z();
                if (std::abs(gap) > range || gap < -deepest) return;
                if (hides)
                    layers = true;
                else
                    covered += size;
                Segment& segment = segments_.emplace_back();
                segment.slave = &facet;
                segment.master = &other;
                copy_corners(shared_, segment.polygon);
                segment.gap = gap;
                segment.hides = hides;
            };
            if (shared_.count == 3) {
                add_shared();
                continue;
            }
            const ConvexPolygon seen = shared_;
            for_convex_parts(seen, [&](const ConvexPolygon& part) {
                shared_ = part;
                add_shared();
            });
        }
        if (layers || covered > (1 + kTwice) * whole) keep_nearest_(first, least);
        return whole;
    }

    void keep_nearest_(std::size_t first, double least)
    {
        layers_.assign(segments_.begin() + static_cast<std::ptrdiff_t>(first), segments_.end());
        std::stable_sort(layers_.begin(), layers_.end(), [](const Segment& a, const Segment& b) {
            return std::abs(a.gap) < std::abs(b.gap);
        });
        segments_.resize(first);
        std::vector<ConvexPolygon> pieces, rest;
        for (std::size_t i = 0; i < layers_.size(); ++i) {
            const Segment& segment = layers_[i];
            if (segment.hides) continue;
            pieces = {segment.polygon};
            for (std::size_t j = 0; j < i; ++j) {
                if (layers_[j].hides && layers_[j].gap * segment.gap <= 0) continue;
                rest.clear();
                for (const ConvexPolygon& p : pieces)
                    subtract(p, layers_[j].polygon, least, rest);
                std::swap(pieces, rest);
            }
            for (const ConvexPolygon& p : pieces) {
                segments_.push_back(segment);
                segments_.back().polygon = p;
            }
        }
    }

    /// What a segment counts for, in means and in what is covered: a face that turns towards the
    /// other surface is included gradually.
    static double facing_(const Segment& s)
    {
        const double cosine = std::abs(s.slave->normal.dot(s.master->normal));
        const double x = std::clamp((cosine - kFacing) / (kFullyFacing - kFacing), 0.0, 1.0);
        return x * x * (3 - 2 * x);
    }

    /// All segments of a face with a master that does not bend.
    void integrate_fixed_(const FaceMultipliers& multipliers, double dual)
    {
        fixed_->begin_face(multipliers, face_sums_);
        const Facet* facet = nullptr;
        std::array<ConvexPolygon, 4> own; // parts of the facet where one function is 1
        std::array<PolygonSides, 4> sides_of_own;
        ConvexPolygon shared;
        for (const Segment& segment : segments_) {
            if (segment.slave != facet) {
                if (facet) fixed_->end_facet();
                facet = segment.slave;
                fixed_->begin_facet(*facet);
                for (int i = 0; i < multipliers.count && dual < 1; ++i) {
                    ConvexPolygon& part = own[std::size_t(i)];
                    part = nearest_part(int(slave_.face(std::size_t(facet->face)).size()), i);
                    for (int k = 0; k < part.count; ++k)
                        part.corner[std::size_t(k)] = fixed_->in_plane(part[k]);
                    if (at_once_) sides_of_own[std::size_t(i)] = PolygonSides(part);
                }
            }
            const double facing = facing_(segment);
            if (dual > 0) fixed_->add(*segment.master, segment.polygon, -1, facing * dual);
            for (int i = 0; i < multipliers.count && dual < 1; ++i) {
                const auto part = std::size_t(i);
                const Shared share = at_once_ ? shared_with(sides_of_own[part], segment.polygon)
                                              : shared_with(own[part], segment.polygon);
                if (share == Shared::nothing) continue;
                if (share == Shared::all) {
                    fixed_->add(*segment.master, segment.polygon, i, facing * (1 - dual));
                    break;
                }
                copy_corners(segment.polygon, shared);
                if (at_once_ ? cut_to(sides_of_own[part], shared) : cut_to(own[part], shared))
                    fixed_->add(*segment.master, shared, i, facing * (1 - dual));
            }
        }
        fixed_->end_facet();
    }

    /// @param dual    share of the dual functions; the rest is 1 on each node's own part
    /// @param facing  factor on all functions
    void integrate_(const Segment& segment, const FaceMultipliers& multipliers, double dual,
                    double facing)
    {
        if (!(facing > 0)) return;
        const FacetPlane plane(*segment.slave);
        const Sides sides(*this, segment, plane);
        FaceSums::Master& master = face_sums_.of(segment.master->face);
        if (dual > 0) integrate_(sides, segment.polygon, multipliers, -1, facing * dual, master);
        if (dual == 1) return;
        ConvexPolygon part, shared;
        for (int i = 0; i < multipliers.count; ++i) {
            part = nearest_part(sides.slave.nodes, i);
            for (int k = 0; k < part.count; ++k)
                part.corner[static_cast<std::size_t>(k)] = sides.in_plane(part[k]);
            intersect(segment.polygon, part, shared);
            if (shared.count > 0)
                integrate_(sides, shared, multipliers, i, facing * (1 - dual), master);
        }
    }

    /// Both faces of a segment in its plane.
    struct Sides {
        std::int32_t slave_face = 0, master_face = 0;
        Mat3 axes; ///< of the plane
        FaceInPlane slave, master;
        Vec3 master_normal; ///< of the facet
        // Between the plane and the reference face, for triangles.
        AffineMap to_slave, to_master, from_slave;
        double stretch = 1; ///< area on the reference face per area of the plane, for T6

        Sides(const Mortar& m, const Segment& s, const FacetPlane& plane)
            : slave_face(s.slave->face)
            , master_face(s.master->face)
            , axes(plane.axes)
            , slave(m.slave_.face(static_cast<std::size_t>(s.slave->face)), m.slave_places_, plane)
            , master(m.master_.face(static_cast<std::size_t>(s.master->face)), m.master_places_,
                     plane)
            , master_normal(plane.axes * s.master->normal)
            , to_slave(map_(*s.slave, plane))
            , to_master(map_(*s.master, plane))
            , from_slave(inverse_(*s.slave, plane))
            , stretch(std::abs(to_slave.slope.determinant()))
        {
        }

        /// A point of the slave's reference face, in the plane of the facet.
        Vec2 in_plane(const Vec2& xi) const
        {
            if (slave.nodes == 4) return spot(slave, xi).place.head<2>();
            return from_slave(xi);
        }

    private:
        static std::array<Vec2, 3> corners_(const Facet& facet, const FacetPlane& plane)
        {
            return {plane(facet.corner[0]).head<2>(), plane(facet.corner[1]).head<2>(),
                    plane(facet.corner[2]).head<2>()};
        }
        static AffineMap map_(const Facet& facet, const FacetPlane& plane)
        {
            return {corners_(facet, plane).data(), facet.xi.data()};
        }
        static AffineMap inverse_(const Facet& facet, const FacetPlane& plane)
        {
            return {facet.xi.data(), corners_(facet, plane).data()};
        }
    };

    static std::span<const QuadraturePoint> points_for_(const Sides& sides,
                                                        const ConvexPolygon& polygon)
    {
        // A product of two linear functions needs no more.
        if (sides.slave.nodes == 3 && sides.master.nodes == 3) return triangle_points(2);
        const double bend = std::max(bend_(sides.slave, polygon), bend_(sides.master, polygon));
        if (!(bend > kStraightEdge)) return triangle_points(4);
        return points_for_bend(bend);
    }

    /// The shape functions of a quadrilateral that is no parallelogram are no polynomials of the
    /// place: their root is singular where the area per reference area vanishes, which is linear.
    /// @return  its half range over the polygon, of its mean
    static double bend_(const FaceInPlane& face, const ConvexPolygon& polygon)
    {
        if (face.nodes != 4) return 0;
        const Vec2 twist = (face.node[0] - face.node[1] + face.node[2] - face.node[3]).head<2>(),
                   across = (face.node[2] - face.node[0]).head<2>();
        if (!(twist.norm() > kStraightEdge * across.norm())) return 0;
        double least = std::numeric_limits<double>::infinity(), most = 0;
        for (int i = 0; i < polygon.count; ++i)
            if (const auto at = locate(face, polygon[i], Vec2::Zero())) {
                const double size = std::abs(at->along[0].x() * at->along[1].y() -
                                             at->along[0].y() * at->along[1].x());
                least = std::min(least, size);
                most = std::max(most, size);
            }
        return most > 0 ? (most - least) / (most + least) : 0;
    }

    /// Adds the integrals over a part of a segment.
    /// @param only   the multiplier whose function is 1 there, or -1: the dual functions
    /// @param share  factor on the functions
    void integrate_(const Sides& sides, const ConvexPolygon& polygon,
                    const FaceMultipliers& multipliers, int only, double share,
                    FaceSums::Master& master)
    {
        if (sides.slave.nodes == 3 && sides.master.nodes == 3 && !smooth_)
            return integrate_flat_(sides, polygon, multipliers, only, share, master);
        const std::span<const QuadraturePoint> points = points_for_(sides, polygon);
        // Triangles around the middle of the outline: a corner that appears or disappears, with a
        // side of no length, changes nothing at once.
        const Vec2 a = middle_of_outline(polygon);
        for (int i = 0; i < polygon.count; ++i) {
            const Vec2 &b = polygon[i], &c = polygon[(i + 1) % polygon.count];
            const double twice = twice_area(a, b, c);
            for (const QuadraturePoint& p : points) {
                const Vec2 z = a + p.xi[0] * (b - a) + p.xi[1] * (c - a);
                integrate_at_(sides, z, share * p.weight * twice, multipliers, only, master);
            }
        }
    }

    /// The same between two flat triangles: all is linear in the place, and normals stay.
    void integrate_flat_(const Sides& sides, const ConvexPolygon& polygon,
                         const FaceMultipliers& multipliers, int only, double share,
                         FaceSums::Master& master)
    {
        const auto functions = [](const Vec2& xi) {
            return Vec3(1 - xi.x() - xi.y(), xi.x(), xi.y());
        };
        const Mat3 dual = multipliers.functions.topLeftCorner<3, 3>();
        Mat3 slave = Mat3::Zero(), far = Mat3::Zero();
        Vec3 sum = Vec3::Zero();
        for (int i = 1; i + 1 < polygon.count; ++i) {
            const Vec2 &a = polygon[0], &b = polygon[i], &c = polygon[i + 1];
            const double twice = share * twice_area(a, b, c);
            for (const QuadraturePoint& p : triangle_points(2)) {
                const Vec2 z = a + p.xi[0] * (b - a) + p.xi[1] * (c - a);
                const Vec3 N = functions(sides.to_slave(z)), M = functions(sides.to_master(z));
                const double weight = p.weight * twice;
                const Vec3 psi =
                    only >= 0 ? Vec3(weight * Vec3::Unit(only)) : Vec3(weight * (dual * N));
                sum += psi;
                slave += psi * N.transpose();
                far += psi * M.transpose();
            }
        }
        const Vec3 apart =
            sides.axes.transpose() *
            (sides.master_normal - (of_master_ ? Vec3(Vec3::Zero()) : Vec3(Vec3::UnitZ())));
        const Mat3 slope = of_gap_ ? slope_(sides, sides.master_normal) : Mat3(Mat3::Zero());
        for (std::size_t i = 0; i < 3; ++i) {
            face_sums_.area[i] += sum[Eigen::Index(i)];
            face_sums_.normal[i] += sum[Eigen::Index(i)] * apart;
            if (of_gap_) face_sums_.slope[i] += sum[Eigen::Index(i)] * slope;
        }
        face_sums_.slave.topLeftCorner<3, 3>() += slave;
        master.weights.topLeftCorner<3, 3>() += far;
    }

    void integrate_at_(const Sides& sides, const Vec2& z, double weight,
                       const FaceMultipliers& multipliers, int only, FaceSums::Master& master)
    {
        std::optional<FaceSpot> over;
        if (sides.slave.nodes == 4) {
            over = locate(sides.slave, z, Vec2::Zero());
            if (!over) return;
        }
        const FaceSpot x = over ? *over : spot(sides.slave, sides.to_slave(z));
        Vec3 normal = x.along[0].cross(x.along[1]);
        const double size = normal.norm();
        if (!(size > 0)) return;
        if (sides.slave.nodes == 4) weight *= size / std::abs(normal.z());
        if (sides.slave.nodes == 6) weight *= size * sides.stretch;
        normal /= size; // in the plane's coordinates, as all places here

        const bool four = sides.master.nodes == 4;
        const Vec2 eta = four ? Vec2(0, 0) : sides.to_master(x.place.head<2>());
        Vec3 far_normal = sides.master_normal;
        PerNode M;
        if (sides.master.nodes == 3) {
            M = shape_values(3, eta);
        } else {
            std::optional<FaceSpot> y = locate(sides.master, x.place.head<2>(), eta);
            if (!y && four) return;
            if (!y) y = spot(sides.master, eta);
            M = y->values;
            far_normal = y->along[0].cross(y->along[1]).normalized();
        }

        Eigen::Vector4d psi = Eigen::Vector4d::Zero();
        if (only >= 0)
            psi[only] = weight;
        else
            psi = weight * (multipliers.functions * x.values);
        if (of_master_) normal.setZero();
        Vec3 apart = sides.axes.transpose() * (far_normal - normal);
        if (smooth_) apart = smooth_apart_(sides, x.values, normal, M, far_normal);
        const Mat3 slope = of_gap_ ? slope_(sides, far_normal) : Mat3(Mat3::Zero());
        for (int i = 0; i < multipliers.count; ++i) {
            face_sums_.area[static_cast<std::size_t>(i)] += psi[i];
            face_sums_.normal[static_cast<std::size_t>(i)] += psi[i] * apart;
            if (of_gap_) face_sums_.slope[static_cast<std::size_t>(i)] += psi[i] * slope;
        }
        face_sums_.slave += psi * x.values.transpose();
        master.weights += psi * M.transpose();
    }

    /// Where a slave slides by s, its place sees the master farther along it: a gap along n changes
    /// by s . slope n.
    /// @param far_normal  of the master, in the plane's coordinates
    static Mat3 slope_(const Sides& sides, const Vec3& far_normal)
    {
        return sides.axes.transpose() * far_normal * sides.axes.row(2) / far_normal.z();
    }

    /// As far_normal - normal, with smooth normals of the faces that have them.
    Vec3 smooth_apart_(const Sides& sides, const PerNode& N, const Vec3& normal, const PerNode& M,
                       const Vec3& far_normal) const
    {
        const Vec3 far = master_normals_->has(sides.master_face)
                             ? master_normals_->normal(sides.master_face, M)
                             : Vec3(sides.axes.transpose() * far_normal);
        if (of_master_) return far;
        const Vec3 own = slave_normals_->has(sides.slave_face)
                             ? slave_normals_->normal(sides.slave_face, N)
                             : Vec3(sides.axes.transpose() * normal);
        return far - own;
    }

    const ExternalSurface& slave_;
    const ExternalSurface& master_;
    std::span<const Vec3> slave_places_, master_places_, at_rest_;
    std::vector<std::optional<Behind>> behind_; ///< of near_
    double reach_ = 0;
    bool of_master_ = false, smooth_ = false, of_gap_ = false, at_once_ = false;
    std::vector<Facet> slave_facets_;
    const FacetTree* master_faces_ = nullptr;
    std::optional<FixedIntegrals> fixed_;
    ContactSums sums_;
    std::optional<SmoothNormals> slave_normals_;
    const SmoothNormals* master_normals_ = nullptr;
    std::vector<Segment> segments_; ///< of one face
    std::vector<Segment> layers_;   ///< of one facet
    FaceSums face_sums_;            ///< of one face
    std::vector<std::int32_t> near_;
    ConvexPolygon shared_;
};

} // namespace

SurfaceContacts mortar_contacts(const ExternalSurface& slave, std::span<const Vec3> slave_places,
                                const ExternalSurface& master, std::span<const Vec3> master_places,
                                const MortarOptions& options)
{
    if (options.nodal)
        return nodal_contacts(slave, slave_places, master, master_places, options.reach,
                              options.smooth_normals);
    return Mortar(slave, slave_places, master, master_places, box_of(master, master_places),
                  options)
        .contacts();
}

SurfaceContacts mortar_contacts(const ExternalSurface& slave, std::span<const Vec3> slave_places,
                                const FixedShape& master, const MortarOptions& options)
{
    MortarOptions of_master = options;
    of_master.master_normals = of_master.smooth_normals = true;
    return Mortar(slave, slave_places, master.surface, master.places, master.box, of_master, true)
        .contacts(master);
}

} // namespace amontons
