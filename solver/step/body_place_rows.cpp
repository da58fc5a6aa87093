#include "contact/rigid/shape_distance.hpp"
#include "contact/surface/collocation.hpp"
#include "contact/surface/facets.hpp"
#include "contact/surface/overlap.hpp"
#include "contact/surface/smooth_normals.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_contacts.hpp"
#include "solver/step/byte_stream.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

// Rows at places deep in another body (found by body_overlap.cpp): multipliers of a coarse side
// constrain means only, and do not resolve a body that enters its faces between them.

namespace amontons {
namespace {

constexpr double kSameRow = 0.05; // of weights
constexpr double kOnFace = 0.01;  // of a face: corners of a flat side that lies on it
constexpr double kInward = 1e-3;  // of the way to their middle: a corner itself has several normals
constexpr double kReachOut = 0.6; // of the way to a corner: three rows in a line are at 2/3
/// The same of nodes of sharp edges of a free solid: beside so few contacts, which are on a line.
constexpr double kReachOfLine = 0.25;
constexpr std::size_t kFewOnLine = 8;
constexpr int kAround = 8; // places on the rim of a cylinder's end
constexpr std::size_t kMostCorners = 1000;
/// Rows below corners have numbers from here on, those of the corners: they move with them.
constexpr std::int64_t kFirstCornerRow = kFirstPlaceRow + (std::int64_t(1) << 60);

bool same_place(const SurfacePlace& a, const SurfacePlace& b)
{
    if (a.count != b.count) return false;
    for (std::size_t k = 0; k < std::size_t(a.count); ++k)
        if (a.node[k].node != b.node[k].node ||
            std::abs(a.node[k].weight - b.node[k].weight) > kSameRow)
            return false;
    return true;
}

} // namespace

bool ContactFinder::add_row(const BodyOverlap& o, double tolerance)
{
    std::vector<PlaceRow>& rows = rows_[std::size_t(o.pair)];
    const auto known = [&](const PlaceRow& r) {
        return r.of_b == o.of_b && same_place(r.own, o.own);
    };
    if (std::ranges::any_of(rows, known)) return false;
    std::int64_t id = kFirstPlaceRow;
    for (const PlaceRow& r : rows)
        if (r.id < kFirstCornerRow) id = std::max(id, r.id + 1);
    rows.push_back({id, o.of_b, o.own, tolerance});
    return true;
}

namespace {

/// Ends of the flat sides of a rigid shape, in its own frame [m]; none of other shapes.
std::vector<Vec3> corners_of(const RigidShape& shape)
{
    std::vector<Vec3> corners;
    if (const auto* box = std::get_if<Box>(&shape)) {
        for (const double x : {-1.0, 1.0})
            for (const double y : {-1.0, 1.0})
                for (const double z : {-1.0, 1.0})
                    corners.push_back(Vec3(x, y, z).cwiseProduct(box->half_extents));
    } else if (const auto* rod = std::get_if<Cylinder>(&shape)) {
        for (const double z : {-rod->half_length, rod->half_length})
            for (int k = 0; k < kAround; ++k) {
                const double angle = 2 * std::numbers::pi * k / kAround;
                corners.emplace_back(rod->radius * std::cos(angle), rod->radius * std::sin(angle),
                                     z);
            }
    } else if (const auto* triangles = std::get_if<TriangleShape>(&shape)) {
        if (triangles->mesh.points.size() <= kMostCorners) corners = triangles->mesh.points;
    }
    return corners;
}

Vec3 mean(std::span<const Vec3> places)
{
    Vec3 middle = Vec3::Zero();
    for (const Vec3& x : places)
        middle += x / double(places.size());
    return middle;
}

/// Do places lie so far out, seen from the middle of the corners, as some share of each corner?
bool reach_out(std::span<const Vec3> places, std::span<const Vec3> corners, double share)
{
    const Vec3 middle = mean(corners);
    return std::ranges::all_of(corners, [&](const Vec3& x) {
        const Vec3 way = x - middle;
        return std::ranges::any_of(places, [&](const Vec3& p) {
            return way.dot(p - middle) >= share * way.squaredNorm();
        });
    });
}

} // namespace

/// A free body may lie with a flat side on faces so large that its multipliers, which are at the
/// nearest nodes of faces that are covered in part, are on one line, or are one alone. It would
/// turn about them, freely, as far as rows of overlaps leave; and so it would beside two by two,
/// under half of the moment that tips it. Then places below its corners get rows that leave
/// nothing. Of one face that is linear between its corners the multipliers would repeat them, and
/// friction would have several solutions: these are left out.
/// @param first  of the pair's contacts in `out`
void ContactFinder::add_corner_rows(const std::vector<BodyRef>& bodies, int pair, std::size_t first,
                                    BodyContacts& out)
{
    const ContactPair& p = pairs_[std::size_t(pair)];
    const SolidBody* solid = bodies[std::size_t(p.a)].solid;
    if (!solid || p.b < 0 || p.a == p.b) return;
    const BodyRef& b = bodies[std::size_t(p.b)];
    if (b.rigid ? b.rigid->driven() : !b.solid) return;
    if (rows_.size() > std::size_t(pair))
        std::erase_if(rows_[std::size_t(pair)],
                      [](const PlaceRow& r) { return r.id >= kFirstCornerRow; });
    const auto contacts = std::span(out.contact).subspan(first);
    double area = 0;
    for (const BodyContact& c : contacts)
        area = std::max(area, c.area);
    const double on_face = kOnFace * std::sqrt(area);
    std::vector<Vec3> points;
    Vec3 normal = Vec3::Zero();
    for (const BodyContact& c : contacts) {
        if (!(c.gap <= on_face && c.area > 0)) continue;
        points.push_back(c.point);
        normal += c.area * c.frame.col(0);
    }
    if (points.empty() || normal.isZero(0)) return;
    normal.normalize();
    const Vec3 middle = mean(points);

    // Adds rows below corners, on the faces of a solid. @return  a face if all are in that one
    const auto add_below = [&](std::vector<std::int32_t> number, std::vector<Vec3> corner,
                               bool of_b, double share) -> std::int32_t {
        const auto keep = [&](const auto& touches) {
            std::size_t kept = 0;
            for (std::size_t i = 0; i < corner.size(); ++i) {
                if (!touches(corner[i])) continue;
                number[kept] = number[i];
                corner[kept++] = corner[i];
            }
            number.resize(kept);
            corner.resize(kept);
            return kept >= 3 && !reach_out(points, corner, share);
        };
        if (!keep([&](const Vec3& x) { return std::abs(normal.dot(x - middle)) <= on_face; }))
            return -1;
        BoundingBox near;
        for (const Vec3& x : corner)
            near.add(x);
        const FacetedSurface& facets = *(of_b ? p.surface_b : p.surface_a)->facets;
        const FaceDistance faces({facets, (of_b ? b.solid : solid)->places()}, near);
        if (faces.empty()) return -1;
        std::int32_t hint = -1, face = -1;
        if (!keep([&](const Vec3& x) {
                const auto foot = faces.at(x, hint);
                return foot && std::abs(foot->distance) <= on_face;
            }))
            return -1;
        const Vec3 centre = mean(corner);
        bool one_face = true;
        rows_.resize(given_);
        for (std::size_t i = 0; i < corner.size(); ++i) {
            const auto foot = faces.at(corner[i] + kInward * (centre - corner[i]), hint);
            if (!foot) return -1;
            rows_[std::size_t(pair)].push_back(
                {kFirstCornerRow + 2 * number[i] + (of_b ? 1 : 0), of_b, faces.place_of(*foot), 0});
            const std::int32_t on = facets.triangles()[std::size_t(foot->triangle)].face;
            one_face = one_face && (face < 0 || face == on);
            face = on;
        }
        return one_face ? face : -1;
    };
    std::vector<std::int32_t> number;
    if (b.rigid) {
        std::vector<Vec3> corners = corners_of(b.rigid->shape());
        for (Vec3& x : corners) {
            x = b.rigid->placement() * x;
            number.push_back(std::int32_t(number.size()));
        }
        const std::int32_t face = add_below(number, std::move(corners), false, kReachOut);
        constexpr std::size_t kMostLinear = 4; // nodes
        if (face < 0 || p.surface_a->facets->surface().face(std::size_t(face)).size() > kMostLinear)
            return;
        out.contact.erase(std::remove_if(out.contact.begin() + std::ptrdiff_t(first),
                                         out.contact.end(),
                                         [](const BodyContact& c) { return c.area > 0; }),
                          out.contact.end());
        return;
    }
    if (points.size() > kFewOnLine) return;
    for (const bool of_b : {true, false}) { // the solid below
        const SolidBody& lying = of_b ? *solid : *b.solid;
        if (lying.free_motions().empty()) continue;
        number = (of_b ? p.surface_a : p.surface_b)->sharp.nodes;
        std::vector<Vec3> corners;
        for (const std::int32_t n : number)
            corners.push_back(lying.places()[std::size_t(n)]);
        add_below(number, std::move(corners), of_b, kReachOfLine);
    }
}

bool ContactFinder::add_rows(std::span<const BodyOverlap> overlaps)
{
    rows_.resize(given_);
    bool some = false;
    for (const BodyOverlap& o : overlaps)
        if (o.own.count > 0 && o.depth > o.rows_beyond) some |= add_row(o, o.tolerance);
    return some;
}

void ContactFinder::add_rows_ahead(std::span<const BodyOverlap> overlaps)
{
    rows_.resize(given_);
    // Their present overlap is allowed: they get no deeper, and are not separated within a step.
    for (const BodyOverlap& o : overlaps)
        if (o.own.count > 0 && o.tolerance > 0 && o.depth <= o.rows_beyond &&
            o.depth > kRowsAhead * o.rows_beyond)
            add_row(o, std::max(o.tolerance, o.depth));
}

namespace {

std::optional<FaceDistance::Foot> exit_from_mesh(const FaceDistance& surface, const Vec3& x,
                                                 const Vec3& way, double longest,
                                                 std::int32_t& hint)
{
    const std::optional<FaceDistance::Foot> nearest = surface.at(x, hint);
    if (!nearest || !(nearest->distance < 0) || way.isZero(0)) return nearest;
    std::vector<double> shares;
    surface.crossings(x, x + longest * way, shares);
    if (shares.empty()) return nearest;
    const Vec3 out = x + shares.front() * longest * way;
    std::int32_t near = hint;
    std::optional<FaceDistance::Foot> foot = surface.at(out, near);
    if (!foot || foot->normal.dot(way) < kFacing) return nearest;
    foot->distance = foot->normal.dot(x - foot->point);
    return foot;
}

} // namespace

namespace {

/// The normal of a surface at a foot, which does not jump from face to face.
Vec3 normal_at_foot(const FaceDistance::Foot& foot, const SurfacePlace& place,
                    const FacetedSurface& facets, SmoothNormalsOnDemand& smooth)
{
    const std::int32_t face = facets.triangles()[std::size_t(foot.triangle)].face;
    const auto nodes = facets.surface().face(std::size_t(face));
    PerNode values = PerNode::Zero();
    for (const StencilEntry& e : place.nodes())
        if (const auto at = std::ranges::find(nodes, e.node); at != nodes.end())
            values[at - nodes.begin()] = e.weight;
    return smooth.normal(face, values).value_or(foot.normal);
}

} // namespace

/// As distance_from. Triangles that stand for a curved surface have its normals: where a place
/// slides across an edge of theirs a force that turns at once would have no balance.
std::function<WallSample(const Vec3&)>
ContactFinder::distance_for_rows(const std::vector<BodyRef>& bodies, int body)
{
    const RigidBody& rigid = *bodies[std::size_t(body)].rigid;
    const Placement at = rigid.placement();
    if (!std::holds_alternative<TriangleShape>(rigid.shape())) return distance_from(rigid, at);
    return [&rigid, &facets = facets_of(bodies, body), at,
            near = std::int32_t(-1)](const Vec3& x) mutable {
        const Vec3 own = at.turn.conjugate() * (x - at.shift);
        WallSample s = shape_distance(rigid.shape(), own, near);
        const auto& [a, b, c] = facets.mesh.triangles[std::size_t(near)];
        const std::vector<Vec3>& points = facets.mesh.points;
        const TrianglePoint place = closest_on_triangle(
            own, points[std::size_t(a)], points[std::size_t(b)], points[std::size_t(c)]);
        s.normal =
            at.turn * smooth_normal_at(*facets.fixed, *facets.flat, near, place).value_or(s.normal);
        return s;
    };
}

void ContactFinder::add_place_rows(const std::vector<BodyRef>& bodies, int pair, BodyContacts& out)
{
    if (std::size_t(pair) >= rows_.size() || rows_[std::size_t(pair)].empty()) return;
    const ContactPair& p = pairs_[std::size_t(pair)];
    const BodyRef& a = bodies[std::size_t(p.a)];
    const SolidBody* b = p.b >= 0 ? bodies[std::size_t(p.b)].solid : nullptr;
    std::function<WallSample(const Vec3&)> exact;
    if (p.b < 0)
        exact = distance_from_obstacle(p);
    else if (bodies[std::size_t(p.b)].rigid)
        exact = distance_for_rows(bodies, p.b);
    for (const bool of_b : {false, true}) {
        const SolidBody* own = of_b ? b : a.solid;
        if (!own) continue;
        BoundingBox near;
        for (const PlaceRow& r : rows_[std::size_t(pair)])
            if (r.of_b == of_b) near.add(weighted(r.own.nodes(), own->places()));
        if (!(near.low <= near.high).all()) continue;
        std::optional<FaceDistance> faces;
        const ContactSurface* opposite = exact ? nullptr : of_b ? p.surface_a : p.surface_b;
        std::optional<SmoothNormalsOnDemand> smooth;
        if (opposite) {
            // The nearest face is no farther than this, or out of reach.
            near.low -= 2 * reach_;
            near.high += 2 * reach_;
            const std::span<const Vec3> places = (of_b ? a.solid : b)->places();
            faces.emplace(PlacedSurface{*opposite->facets, places}, near);
            if (faces->empty()) continue;
            smooth.emplace(opposite->facets->surface(), places, opposite->sharp.smooth);
        }
        std::int32_t hint = -1;
        for (const PlaceRow& r : rows_[std::size_t(pair)]) {
            if (r.of_b != of_b) continue;
            BodyContact k;
            k.pair = pair;
            k.id = r.id;
            k.a = p.a;
            k.b = p.b;
            k.point = weighted(r.own.nodes(), own->places());
            const Vec3 out_of = outward_normal_at(
                {of_b ? *p.surface_b->facets : *p.surface_a->facets, own->places()}, r.own);
            Vec3 normal;
            SurfacePlace foot_place;
            if (exact) {
                const WallSample s = exit_from(exact, k.point, -out_of, reach_);
                k.gap = s.distance;
                normal = s.normal;
            } else {
                const auto foot = exit_from_mesh(*faces, k.point, -out_of, 2 * reach_, hint);
                if (!foot || std::abs(foot->distance) > 2 * reach_) continue;
                foot_place = faces->place_of(*foot);
                normal = normal_at_foot(*foot, foot_place, *opposite->facets, *smooth);
                k.gap = normal.dot(k.point - foot->point);
            }
            if (out_of.dot(normal) > -kFacing) continue; // a side, which this face does not press
            k.gap += r.tolerance;
            if (k.gap > reach_) continue;
            k.frame = contact_frame(of_b ? Vec3(-normal) : normal);
            const auto add_side = [&](const SurfacePlace& place, std::int32_t& begin,
                                      std::int32_t& end) {
                begin = std::int32_t(out.stencil.size());
                for (const StencilEntry& e : place.nodes())
                    out.stencil.push_back(e);
                end = std::int32_t(out.stencil.size());
            };
            add_side(of_b ? foot_place : r.own, k.a_begin, k.a_end);
            add_side(of_b ? r.own : foot_place, k.b_begin, k.b_end);
            out.contact.push_back(k);
        }
    }
}

void ContactFinder::find_rows(const std::vector<BodyRef>& bodies, const StepInput& step,
                              BodyContacts& out)
{
    step_ = step;
    for (std::size_t p = 0; p < rows_.size(); ++p) {
        reach_ = pairs_[p].reach + most_closed(pairs_[p].a) + most_closed(pairs_[p].b);
        add_place_rows(bodies, int(p), out);
    }
}

void ContactFinder::begin_rows(bool dynamic)
{
    if (dynamic) return;
    for (std::size_t p = 0; p < rows_.size(); ++p)
        if (!(pairs_[p].friction > 0)) rows_[p].clear();
}

void ContactFinder::keep_rows(const std::function<bool(int pair, std::int64_t id)>& acts)
{
    for (std::size_t p = 0; p < rows_.size(); ++p)
        std::erase_if(rows_[p], [&](const PlaceRow& r) { return !acts(int(p), r.id); });
}

void ContactFinder::save_rows(ByteWriter& out) const
{
    for (std::size_t p = 0; p < given_; ++p) {
        const std::vector<PlaceRow> none;
        const std::vector<PlaceRow>& rows = p < rows_.size() ? rows_[p] : none;
        out.value(std::uint64_t(rows.size()));
        for (const PlaceRow& r : rows) {
            out.value(r.id);
            out.value(r.of_b);
            out.value(r.tolerance);
            out.value(r.own.count);
            for (const StencilEntry& e : r.own.nodes()) {
                out.value(e.node);
                out.value(e.weight);
            }
        }
    }
}

std::vector<std::vector<PlaceRow>> ContactFinder::read_rows(ByteReader& in) const
{
    constexpr std::uint64_t kMost = 1u << 24;
    std::vector<std::vector<PlaceRow>> rows(given_);
    for (std::size_t p = 0; p < given_; ++p) {
        const auto count = in.value<std::uint64_t>();
        if (count > kMost) ByteReader::refuse("an impossible size");
        for (std::uint64_t i = 0; i < count; ++i) {
            PlaceRow r;
            r.id = in.value<std::int64_t>();
            r.of_b = in.value<bool>();
            r.tolerance = in.value<double>();
            r.own.count = in.value<int>();
            const ContactSurface* s = r.of_b ? pairs_[p].surface_b : pairs_[p].surface_a;
            if (!s || r.own.count < 1 || r.own.count > int(r.own.node.size()))
                ByteReader::refuse("a contact of another mesh");
            for (std::size_t k = 0; k < std::size_t(r.own.count); ++k) {
                StencilEntry& e = r.own.node[k];
                e.node = in.value<std::int32_t>();
                e.weight = in.value<double>();
                if (!std::ranges::binary_search(s->outside.used_nodes, e.node))
                    ByteReader::refuse("a contact of another mesh");
            }
            rows[p].push_back(r);
        }
    }
    return rows;
}

} // namespace amontons
