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

// Contacts of the bodies of a scene: the pairs to which its contact laws apply, and their contacts
// at the iterate.

namespace amontons {

class ByteReader;
class ByteWriter;
class RigidBody;
class RodBody;
class SolidBody;

/// A contact, or a place where two bodies may touch within the step.
struct BodyContact {
    /// Number of the pair.
    int pair = 0;
    std::int64_t id = 0;           ///< of its kind within the pair, stable over steps
    int a = 0, b = -1;             ///< bodies; b -1: an obstacle
    Mat3 frame = Mat3::Identity(); ///< columns n (from b into a), t1, t2
    double gap = 0;                ///< at the iterate [m]
    double area = 0;               ///< area that it represents, 0 if unknown [m^2]
    double friction = -1;          ///< coefficient [-]; < 0: that of its pair
    /// Derivative of the normal by the place on a, of surfaces that do not bend [1/m].
    Mat3 curvature = Mat3::Zero();
    bool slides_a = false, slides_b = false; ///< of rods: see CurveContact
    /// True if it slid at the start of the step: friction then opposes the mean velocity of the
    /// step, not the velocity at its end.
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

/// Least thickness of a body [m]; of a solid at rest.
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
    bool nodal = false; ///< contacts of meshes at nodes instead of mortar integrals
    bool named = true;  ///< its law is between two names, not by "*"
    bool names_b = false; ///< its columns are those of the force on b: they keep their names
    double reach = 0;   ///< gaps and overlaps that are examined [m]
    /// Gaps of dynamic steps beyond what the bodies can close within one [m]: normals of what is
    /// farther apart may not be those of the touch, and stay for the step.
    double margin = 0;
    std::vector<FaceStation> stations; ///< of a rod on a solid
    StartOverlap start_overlap = StartOverlap::refuse;
    std::string end_a;         ///< of a rod that touches with an end alone: "start", "end"
    std::optional<Pose> plane; ///< of an obstacle that is one: exact for every rigid shape
    const ContactSurface *surface_a = nullptr, *surface_b = nullptr; ///< of solids; outlive it
};

/// Coulomb's coefficient of a contact: its own, else that of its pair [-].
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
    bool of_b = false; ///< the place is on b
    SurfacePlace own;  ///< its nodes; none on a rigid body
    /// What the meshes leave, and the depth beyond which the step is refused [m].
    double allowed = 0, most = 0;
    double silent = 0;      ///< depth beyond which the overlap is warned of [m]
    double rows_beyond = 0; ///< depth beyond which a row is added for the place [m]
    double tolerance = 0;   ///< overlap that such a row leaves [m]
};

/// A contact row at a place of a mesh, in addition to those of multipliers.
struct PlaceRow {
    /// Identity of the row.
    std::int64_t id = 0;
    /// True if the place is on body b.
    bool of_b = false;
    /// The place on its surface.
    SurfacePlace own;
    double tolerance = 0; ///< the overlap that it leaves [m]
};

/// The law of "*" and "*" for free rigid bodies. n bodies have n (n - 1) / 2 pairs, most of which
/// never touch: a pair is created when its bodies come near.
struct DefaultLaw {
    /// Coefficients of friction and restitution.
    double friction = 0, restitution = 0;
    double reach = 0; ///< of ContactPair [m]; 0: chosen
    StartOverlap start_overlap = StartOverlap::refuse;
    std::set<std::pair<int, int>> others; ///< pairs with a law of their own, lower number first
};

/// Largest search distance of contacts between meshes over the thickness of the thinner body:
/// farther away lies the other side of that body (ratio).
constexpr double kReachOfThickness = 0.4;
/// In motion, rows for the next step are added from this share of BodyOverlap::rows_beyond on,
/// since a step that has to be repeated costs twice (ratio).
constexpr double kRowsAhead = 0.7;
/// The id of a contact of a multiplier is the number of its node, plus a multiple of this.
constexpr std::int64_t kNodeNumbers = std::int64_t(1) << 40;
/// Added to the id of a contact: the same contact with the normal of another iteration.
constexpr std::int64_t kOtherNormal = std::int64_t(1) << 62;
/// Ids of the contacts of PlaceRows begin here.
constexpr std::int64_t kFirstPlaceRow = std::int64_t(1) << 61;

/// Sets pair.reach, the search distance of a pair [m].
/// @param given  reach of its law [m]; 0: chosen from the size
/// @param size   of the smaller body [m]
void set_reach(ContactPair& pair, double given, double size);

/// The same placement as a Pose.
Pose pose_of(const Placement& p);

/// The points of a mesh in space, with the mesh placed at `at` [m].
std::vector<Vec3> moved_points(const SurfaceMesh& mesh, const Placement& at);

/// A box around all places that a body has occupied in the step so far.
AxisBox swept_box(const RigidBody& body);

/// A frame with the given normal: t1 the x axis projected, or y's where the normal is along x.
Mat3 contact_frame(const Vec3& normal);

/// Signed distance from a rigid body placed at `at`, with its derivatives.
/// @param body  outlives the result
std::function<WallSample(const Vec3&)> distance_from(const RigidBody& body, const Placement& at);

/// Finds all contacts of all pairs.
class ContactFinder {
public:
    /// @param walls  of the obstacles, outlive the finder
    ContactFinder(std::vector<ContactPair> pairs, std::vector<const Wall*> walls,
                  std::optional<DefaultLaw> rest = {});

    /// The given pairs, followed by those of the default law whose bodies have come near so far.
    const std::vector<ContactPair>& pairs() const { return pairs_; }
    /// True if there is a default law for all other pairs.
    bool has_rest() const { return rest_.has_value(); }
    /// Treatment of overlaps at the start of pairs under the default law.
    StartOverlap default_start_overlap() const
    {
        return rest_ ? rest_->start_overlap : StartOverlap::refuse;
    }
    /// Bodies of the pairs of the default law, two numbers each, in the order of the pairs'
    /// numbers.
    std::vector<std::int64_t> known_pairs() const;
    /// Creates the pairs that known_pairs() returned. @returns  false, and does nothing, if these
    /// are no pairs of the default law
    bool restore_pairs(std::span<const std::int64_t> bodies_of_pairs,
                       const std::vector<BodyRef>& bodies);
    /// True if all pairs are `small`: contact rows never change, and a step of linear bodies is one
    /// contact problem.
    bool all_small() const;

    /// Passes to condensed solids that are in small pairs only the nodes of their contacts, as no
    /// other nodes can touch. Of quasi-static scenes, before the offline stage.
    void keep_to_contacts(const std::vector<BodyRef>& bodies);

    /// Raises the search distance of the pairs of this body to at least `reach` [m], before the
    /// first step. Only of pairs with a signed distance: between faces of two meshes the far side
    /// of a body is an overlap, and the search distance has to stay below its thickness.
    void search_farther(const std::vector<BodyRef>& bodies, int body, double reach);

    /// Begins a step, or a new try of one, of bodies that have begun it: contacts found in
    /// iterations of earlier steps are dropped.
    void begin_step(const std::vector<BodyRef>& bodies);
    /// Contacts at the iterate whose gap is within reach.
    /// @param threads  pairs are distributed to so many threads; the result is the same for any
    ///                 number
    void find(const std::vector<BodyRef>& bodies, const StepInput& step, BodyContacts& out,
              int threads = 1);

    /// Contacts of a pair that find() has found, of rigid bodies or one and an obstacle, at the
    /// iterate.
    /// @param reach  no gap of a contact that is sought is larger now [m]
    void find_rigid(const std::vector<BodyRef>& bodies, int pair, double reach, BodyContacts& out);

    /// Overlaps at the iterate, measured on the surfaces, independently of the contacts found.
    /// @param small_too  include pairs with small sliding (contacts of the start)
    void overlaps(const std::vector<BodyRef>& bodies, std::vector<BodyOverlap>& out,
                  bool small_too = false);
    /// The pairs that overlaps() does not measure, a sentence each.
    std::vector<std::string> not_measured(const std::vector<BodyRef>& bodies) const;
    /// Appends the contacts of the overlap rows to contacts that an earlier try of the same step
    /// has found.
    void find_rows(const std::vector<BodyRef>& bodies, const StepInput& step, BodyContacts& out);
    /// Creates overlap rows at places of meshes that are deep in another body, from the next find()
    /// on.
    /// @return  true if some are new
    bool add_rows(std::span<const BodyOverlap> overlaps);
    /// After a step in motion: adds rows for places whose depth is above kRowsAhead of that limit.
    void add_rows_ahead(std::span<const BodyOverlap> overlaps);
    /// Before a step: a step at rest begins without overlap rows, so that its end does not depend
    /// on those of earlier steps. With friction and in motion it depends on the path in any case,
    /// and the rows stay.
    void begin_rows(bool dynamic);
    /// After a step: drops the overlap rows for which `acts` is false.
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
    /// The same of what is known already, 0 of what is not [m].
    double thinner_if_known(const ContactPair& p) const;
    /// Sets the depths by which the bodies of pairs overlap at the start, where these are to be
    /// separated or the overlap is to be kept as a fit. Before the first step.
    /// @param depths  of each pair [m]; 0: none
    void set_start_overlaps(const std::vector<BodyRef>& bodies, bool dynamic,
                            std::span<const double> depths);
    /// True if the bodies of some pair are to be separated.
    bool has_start_overlaps() const
    {
        return std::ranges::any_of(start_depth_, [](double d) { return d > 0; });
    }
    /// Sets the share in [0, 1] of the depths at the start that the gaps of those pairs leave.
    void set_start_overlap_share(double share) { start_share_ = share; }

    /// Upper bound of the relative motion that holds and drives prescribe in [from, to], over the
    /// search distance: the largest of all pairs that may come near within it; 0 where none moves
    /// farther than its search distance (ratio). Of quasi-static steps; rods are left out.
    double motion_over_reach(const std::vector<BodyRef>& bodies, double from, double to);
    /// The same wherever the bodies are (ratio).
    double prescribed_over_reach(const std::vector<BodyRef>& bodies, double from, double to);

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
    std::function<WallSample(const Vec3&)> distance_for_rows(const std::vector<BodyRef>& bodies,
                                                             int body);
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
    void add_corner_rows(const std::vector<BodyRef>& bodies, int pair, std::size_t first,
                         BodyContacts& out);
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
    std::vector<std::vector<SeenDistance>> seen_; // of rods' stations and walls, of each pair
    std::vector<std::vector<std::int64_t>>
        sharp_;                    // ids found in this step, of each pair, ascending
    std::vector<AxisBox> boxes_;   // of the bodies
    std::vector<AxisBox> swept_;   // of the bodies, over the step
    std::vector<double> speed_;    // of the bodies at the start of the step [m/s]
    std::vector<double> thinnest_; // no part of a body is thinner; made at first use [m]
    std::vector<double> motion_;   // of a body's nodes in the step, the longest; < 0: not yet [m]
    std::vector<std::unique_ptr<Facets>> facets_; // of the bodies, once one is needed
    std::vector<std::unique_ptr<Facets>> caps_;   // of the bodies: flat ends of cylinders
    std::vector<double> thickness_;               // of the bodies; made at first use [m]
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
