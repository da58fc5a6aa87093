#pragma once

#include "contact/curve/curve_on_faces.hpp"
#include "contact/rigid/broad_phase.hpp"
#include "contact/rigid/detect.hpp"
#include "contact/surface/faceted_surface.hpp"
#include "contact/surface/fixed_shape.hpp"
#include "mesh/base/late.hpp"
#include "mesh/extract_surface.hpp"
#include "mesh/wall.hpp"
#include "solver/body/body.hpp"
#include "solver/scene/scene.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>

// Where the bodies of a scene touch: the pairs that its laws name, and their contacts at the
// iterate.

namespace amontons {

class ByteReader;
class ByteWriter;
class RigidBody;
class RodBody;
class SolidBody;

/// Where two bodies touch or may touch within the step.
struct BodyContact {
    /// Number of the pair.
    int pair = 0;
    std::int64_t id = 0;           ///< of its kind within the pair, stable over steps
    int a = 0, b = -1;             ///< bodies; b -1: an obstacle
    Mat3 frame = Mat3::Identity(); ///< columns n (from b into a), t1, t2
    double gap = 0;                ///< at the iterate [m]
    double area = 0;               ///< that it stands for, 0 if unknown [m^2]
    double friction = -1;          ///< coefficient [-]; < 0: that of its pair
    /// Derivative of the normal by the place on a, of surfaces that do not bend [1/m].
    Mat3 curvature = Mat3::Zero();
    bool slides_a = false, slides_b = false; ///< of rods: see CurveContact
    /// It slid where the step starts: friction opposes the mean velocity, not that of the end.
    bool sliding_at_start = false;
    /// Place [m].
    Vec3 point = Vec3::Zero();
    std::int32_t a_begin = 0, a_end = 0, b_begin = 0, b_end = 0; ///< in BodyContacts::stencil
};

/// Contacts of all pairs, found at an iterate.
struct BodyContacts {
    std::vector<BodyContact> contact;
    /// Nodes and weights of all contacts.
    std::vector<StencilEntry> stencil;

    /// The place of a contact on body a.
    BodyPlace place_a(const BodyContact& c) const
    {
        return {
            std::span(stencil).subspan(std::size_t(c.a_begin), std::size_t(c.a_end - c.a_begin)),
            c.point};
    }
    /// The place of a contact on body b.
    BodyPlace place_b(const BodyContact& c) const
    {
        return {
            std::span(stencil).subspan(std::size_t(c.b_begin), std::size_t(c.b_end - c.b_begin)),
            c.point};
    }
};

/// A body of the scene, by its kind.
struct BodyRef {
    Body* body = nullptr;
    /// The body, if it is rigid.
    RigidBody* rigid = nullptr;
    /// The body, if it is a solid.
    SolidBody* solid = nullptr;
    std::string name;
    /// The body, if it is a rod.
    RodBody* rod = nullptr;
};

/// No part of a body is thinner [m]. Of a solid: at rest.
double thickness_of(const BodyRef& body);

/// Outside of a solid, or a set of its faces, for pairs.
struct ContactSurface {
    /// Outside of the solid.
    ExternalSurface outside;
    SharpFeatures sharp;         ///< at rest
    Late<FacetedSurface> facets; ///< for measuring overlaps
    bool whole = true;           ///< all of the outside
};

/// Treatment of overlaps at the start of the run.
enum class StartOverlap { refuse, resolve, close };

/// Two bodies with a contact law. There may be millions.
struct ContactPair {
    /// Numbers of the bodies; b -1: an obstacle.
    int a = 0, b = -1;
    int obstacle = -1;                       ///< of the scene's, where b is -1
    double friction = 0, restitution = 0;    ///< coefficients [-]; of segments: the largest
    std::vector<double> friction_of_segment; ///< of an instrument a; empty: one for all
    bool small = false; ///< contacts of the start are kept: they move with their bodies
    bool nodal = false;
    bool named = true; ///< not by "*"
    double reach = 0;  ///< gaps and overlaps that are examined [m]
    /// Gaps of dynamic steps beyond what the bodies can close within one [m]: normals of what is
    /// farther apart may not be those of the touch, and stay for the step.
    double margin = 0;
    std::vector<FaceStation> stations; ///< of a rod on a solid
    StartOverlap start_overlap = StartOverlap::refuse;
    std::string end_a;         ///< of a rod that touches with an end alone: "start", "end"
    std::optional<Pose> plane; ///< of an obstacle that is one: exact for every rigid shape
    const ContactSurface *surface_a = nullptr, *surface_b = nullptr; ///< of solids; outlive it
};

/// Coulomb's coefficient of a contact [-].
inline double friction_of(std::span<const ContactPair> pairs, const BodyContact& c)
{
    return c.friction >= 0 ? c.friction : pairs[std::size_t(c.pair)].friction;
}

/// An overlap of two bodies.
struct BodyOverlap {
    int a = 0, b = -1, obstacle = -1; ///< as in ContactPair
    int pair = -1;                    ///< of those given; -1: of the rest
    double depth = 0;                 ///< of the place in the other body [m], > 0
    /// The deepest place [m].
    Vec3 point = Vec3::Zero();
    bool of_b = false;            ///< the place is on b
    SurfacePlace own;             ///< its nodes; none on a rigid body
    double allowed = 0, most = 0; ///< more is warned of, ends the step [m]
    double rows_beyond = 0;       ///< more gets a row, also where `allowed` is more [m]
    double tolerance = 0;         ///< what such a row leaves of it [m]
};

/// A row at a place of a mesh, beside those of multipliers.
struct PlaceRow {
    /// Identity of the row.
    std::int64_t id = 0;
    /// True if the place is on body b.
    bool of_b = false;
    /// The place on its surface.
    SurfacePlace own;
    double tolerance = 0; ///< the overlap that it leaves [m]
};

/// The law of "*" and "*" for free rigid bodies. Of n of them there are n^2 pairs, and
/// most never touch: a pair is made where its bodies come near.
struct DefaultLaw {
    /// Coefficients of friction and restitution.
    double friction = 0, restitution = 0;
    double reach = 0; ///< of ContactPair [m]; 0: chosen
    StartOverlap start_overlap = StartOverlap::refuse;
    std::set<std::pair<int, int>> others; ///< pairs with a law of their own, lower number first
};

/// How far contacts between meshes are searched for, of the thinner body: beyond lie far sides.
/// Ratio.
constexpr double kReachOfThickness = 0.4;
/// In motion places get rows from here on for the step to come, of the depth beyond which they get
/// rows: a step that is done again costs all of it. Ratio.
constexpr double kRowsAhead = 0.7;
/// The number of a contact that stands for an area is that of the node which carries its
/// multiplier, beside multiples of this.
constexpr std::int64_t kNodeNumbers = std::int64_t(1) << 40;
/// Beside the number of a contact: the same with a normal that it had in another iteration.
constexpr std::int64_t kOtherNormal = std::int64_t(1) << 62;
/// Numbers of contacts of such places begin here.
constexpr std::int64_t kFirstPlaceRow = std::int64_t(1) << 61;

/// Search distance of a pair [m]. @param given  by its law, 0: chosen [m]; size of the smaller body
/// [m]
void set_reach(ContactPair& pair, double given, double size);

/// The same placement, as rigid shapes take it.
Pose pose_of(const Placement& p);

/// Points of a mesh that stands there.
std::vector<Vec3> moved_points(const SurfaceMesh& mesh, const Placement& at);

/// Around all that a body fills in a step so far.
AxisBox swept_box(const RigidBody& body);

/// A frame with the given normal: t1 the x axis projected, or y's where the normal is along x.
Mat3 contact_frame(const Vec3& normal);

/// Signed distance from a rigid body that stands there, with its derivatives.
/// @param body  outlives the result
std::function<WallSample(const Vec3&)> distance_from(const RigidBody& body, const Placement& at);

/// Finds all contacts of all pairs.
class ContactFinder {
public:
    /// @param walls  of the obstacles, outlive the finder
    ContactFinder(std::vector<ContactPair> pairs, std::vector<const Wall*> walls,
                  std::optional<DefaultLaw> rest = {});

    /// Those given, and after them those of the rest that have come near so far.
    const std::vector<ContactPair>& pairs() const { return pairs_; }
    /// True if a law names all other pairs.
    bool has_rest() const { return rest_.has_value(); }
    /// What is done with overlaps at the start of pairs without a law.
    StartOverlap default_start_overlap() const
    {
        return rest_ ? rest_->start_overlap : StartOverlap::refuse;
    }
    /// Bodies of the pairs of the rest, two numbers each: numbers of pairs depend on their order.
    std::vector<std::int64_t> known_pairs() const;
    /// Makes pairs of the rest anew. @returns  false, and does nothing, if there are no such pairs
    bool restore_pairs(std::span<const std::int64_t> bodies_of_pairs,
                       const std::vector<BodyRef>& bodies);
    /// True if rows never change: then a step of linear bodies is one contact problem.
    bool all_small() const;

    /// Reports condensed solids in nothing but small pairs which nodes these name: no others will
    /// ever touch. Of quasi-static scenes, before the offline stage.
    void keep_to_contacts(const std::vector<BodyRef>& bodies);

    /// Least search distance of the pairs of this body [m], before the first step: where distances
    /// have a sign. Between faces of meshes the far side of a body is an overlap, and what is
    /// examined must stay below its thickness.
    void search_farther(const std::vector<BodyRef>& bodies, int body, double reach);

    /// A new step, or try of one, of bodies that have begun it: what iterations of others have
    /// found is forgotten.
    void begin_step(const std::vector<BodyRef>& bodies);
    /// Contacts at the iterate whose gap is within reach.
    /// @param threads  share out what does not depend on each other: the same for any number
    void find(const std::vector<BodyRef>& bodies, const StepInput& step, BodyContacts& out,
              int threads = 1);

    /// Contacts of a pair that find() has found, of rigid bodies or one and an obstacle, at the
    /// iterate.
    void find_rigid(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out);

    /// Overlaps at the iterate: measured on the surfaces, whatever contacts were found.
    /// @param small_too  pairs that keep the geometry of the start, where that is the geometry
    void overlaps(const std::vector<BodyRef>& bodies, std::vector<BodyOverlap>& out,
                  bool small_too = false);
    /// Pairs that overlaps() leaves out, a sentence each.
    std::vector<std::string> not_measured(const std::vector<BodyRef>& bodies) const;
    /// Appends the rows of such places to contacts that a try of the same step has found.
    void find_rows(const std::vector<BodyRef>& bodies, const StepInput& step, BodyContacts& out);
    /// Creates overlap rows at places of meshes that are deep in another body, from the next find()
    /// on.
    /// @return  true if some are new
    bool add_rows(std::span<const BodyOverlap> overlaps);
    /// After a step in motion: rows for places that approach this depth.
    void add_rows_ahead(std::span<const BodyOverlap> overlaps);
    /// Before a step: one at rest begins without such rows, so that its end does not depend on
    /// those of steps before. Under friction and in motion it does anyway, and they stay.
    void begin_rows(bool dynamic);
    /// After a step: forgets others.
    void keep_rows(const std::function<bool(int pair, std::int64_t id)>& acts);
    /// Saves the overlap rows for a checkpoint.
    void save_rows(ByteWriter& out) const;
    /// @throws InputError  if they are none of these bodies' meshes
    std::vector<std::vector<PlaceRow>> read_rows(ByteReader& in) const;
    const std::vector<std::vector<PlaceRow>>& rows() const { return rows_; }
    /// Restores overlap rows.
    void set_rows(std::vector<std::vector<PlaceRow>> rows) { rows_ = std::move(rows); }
    double thickness(const std::vector<BodyRef>& bodies, int body); ///< thickness_of, kept [m]
    /// Thickness of the thinner body of a pair [m].
    double thinner_of(const std::vector<BodyRef>& bodies, const ContactPair& p);
    double thinner_if_known(const ContactPair& p) const;
    /// Of pairs whose bodies stand in each other at the start and are to be pressed out of each
    /// other or taken as they fit: how deep. Before the first step.
    void set_start_overlaps(const std::vector<BodyRef>& bodies, bool dynamic,
                            std::span<const double> depths);
    /// Some are to be pressed out.
    bool has_start_overlaps() const
    {
        return std::ranges::any_of(start_depth_, [](double d) { return d > 0; });
    }
    /// This share of the depths at the start is left in the gaps of those pairs.
    void set_start_overlap_share(double share) { start_share_ = share; }

    /// What is prescribed in [from, to] moves pairs that are near by this times what contacts are
    /// searched for, or less. Of quasi-static steps.
    double motion_over_reach(const std::vector<BodyRef>& bodies, double from, double to);

    /// Bodies that have passed through each other between the start of the step and the iterate,
    /// farther than contacts can show; "" if none has.
    std::string passed(const std::vector<BodyRef>& bodies);

private:
    struct Facets { // of a rigid body with flat faces, in its frame
        SurfaceMesh mesh;
        ExternalSurface surface;
        SharpFeatures sharp;
        std::optional<FacetedSurface> flat;
        std::optional<FixedShape> fixed;
    };
    const Facets& facets_of(const std::vector<BodyRef>& bodies, int body);
    int default_pair(int a, int b, const std::vector<BodyRef>& bodies);
    /// Pairs of free rigid bodies whose boxes touch, without those that have a law of their own.
    std::vector<BoxPair> default_pairs_in_reach(const std::vector<BodyRef>& bodies,
                                                const std::function<AxisBox(int)>& box) const;
    double most_closed(int body) const;
    void find_boxes(const std::vector<BodyRef>& bodies);
    void find_cached(const std::vector<BodyRef>& bodies, int pair);
    void find_updated(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out);
    void add_start_gaps(int pair, std::size_t first, BodyContacts& out) const;
    void find_pair(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out);
    void solid_on_wall(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out);
    void solid_on_solid(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out);
    void solid_on_rigid(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out);
    void rigid_on_wall(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out);
    std::vector<BodyContact> rigid_on_rigid(const std::vector<BodyRef>& bodies, int pair,
                                            double reach) const;
    std::vector<BodyContact> rest_contacts(const std::vector<BodyRef>& bodies, int pair) const;
    bool apart(const ContactPair& p, double reach) const;
    // body_overlap.cpp
    bool add_row(const BodyOverlap& overlap, double tolerance);
    void overlaps_of_pair(const std::vector<BodyRef>& bodies, int pair,
                          std::vector<BodyOverlap>& out);
    void overlaps_of_rod(const std::vector<BodyRef>& bodies, int pair,
                         std::vector<BodyOverlap>& out);
    std::optional<BodyOverlap> overlap_with_obstacle(const std::vector<BodyRef>& bodies,
                                                     const ContactPair& p);
    std::optional<BodyOverlap> rigid_overlap(const std::vector<BodyRef>& bodies, int a, int b);
    std::function<WallSample(const Vec3&)> distance_from_obstacle(const ContactPair& p) const;
    const FacetedSurface* facets_if_triangles(const std::vector<BodyRef>& bodies, int body);
    double start_overlap_left(int pair) const;
    /// Reaches as chosen or given, within what bodies' thickness and steps allow: with the first
    /// search, since a scene is checked without.
    void limit_reach(const std::vector<BodyRef>& bodies, bool dynamic);
    void add_place_rows(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out);
    // body_passage.cpp
    bool passed(const std::vector<BodyRef>& bodies, const ContactPair& pair);
    // rod_contacts.cpp
    void rod_on_any(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out);
    void rod_on_solid(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out);
    bool rod_passed(const std::vector<BodyRef>& bodies, const ContactPair& pair);
    void sweep_rods(const std::vector<BodyRef>& bodies);

    void add_sharp(const SharpSurface& slave, const SharpSurface& master, int pair,
                   bool master_has_nodes, BodyContacts& out);
    Vec3 moved(const std::vector<BodyRef>& bodies, const BodyContacts& list,
               const BodyContact& c) const;

    std::vector<ContactPair> pairs_;
    std::size_t given_ = 0; // of them; the others are of the rest
    std::optional<DefaultLaw> rest_;
    std::map<std::pair<int, int>, int> number_; // of the rest's pairs, by their bodies
    std::vector<const Wall*> walls_;
    std::vector<BodyContacts> kept_; // of small pairs, with the gaps of the start
    std::vector<bool> made_;
    std::vector<std::vector<SeenDistance>> seen_;  // of rods' stations and walls, of each pair
    std::vector<std::vector<std::int64_t>> sharp_; // ids met in this step, of each pair, ascending
    std::vector<AxisBox> boxes_;                   // of the bodies
    std::vector<AxisBox> swept_;                   // of the bodies, over the step
    std::vector<double> speed_;                    // of the bodies at the start of the step [m/s]
    std::vector<double> thinnest_; // no part of a body is thinner, once asked for [m]
    std::vector<double> motion_;   // of a body's nodes in the step, the longest; < 0: not yet [m]
    std::vector<std::unique_ptr<Facets>> facets_; // of the bodies, once one is needed
    std::vector<std::unique_ptr<Facets>> caps_;   // of the bodies: flat ends of cylinders
    std::vector<double> thickness_;               // of the bodies, once asked for [m]
    std::vector<std::vector<PlaceRow>> rows_;     // of the given pairs, once there are some
    std::vector<double> start_depth_;     // of each pair at the start, if some begin inside [m]
    std::vector<double> start_tolerance_; // of each pair: what is closed stays an overlap [m]
    bool reach_limited_ = false;
    double start_share_ = 0; // share of it that gaps leave
    std::vector<std::map<std::int64_t, double>>
        gap_offset_; // of each pair's contacts: not in the gap
    StepInput step_;
    double reach_ = 0; // of the present pair and step
};

} // namespace amontons
