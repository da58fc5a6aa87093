#include "solver/beam/nesting.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace amontons {
namespace {

using Mat3x12 = Eigen::Matrix<double, 3, 12>;
using Vec24 = Eigen::Matrix<double, 24, 1>;

double length_out(const Wire& w)
{
    return w.state.inserted;
}

double radius_at(const WireMaterial& m, double s, double BeamSegment::*which)
{
    std::size_t k = m.segments.size() - 1;
    while (k > 0 && m.segment_start[k] > s)
        --k;
    return m.segments[k].*which;
}

/// Material coordinate of a place [m].
double material_at(const Wire& w, const WirePlace& p)
{
    return w.material.node[std::size_t(p.element) + 1] - (1 - p.xi) * p.length;
}

double length_beyond(const Wire& w, const WirePlace& p)
{
    return w.material.length - material_at(w, p);
}

/// Spacing of the outer's points [m]; 0 if there are too few.
double spacing_of(const Nesting& n)
{
    return n.inners_tip() < 3 ? 0 : n.points[1].s - n.points[2].s;
}

std::size_t element_at(const WireMaterial& m, double s)
{
    const auto it = std::upper_bound(m.node.begin(), m.node.end(), s);
    return std::size_t(
        std::clamp<std::ptrdiff_t>(it - m.node.begin() - 1, 0, std::ptrdiff_t(m.node.size()) - 2));
}

/// The contact point at a distance from the tip.
MaterialPoint point_from_tip(const WireMaterial& m, double distance)
{
    MaterialPoint p;
    p.s = m.length - distance;
    const std::size_t e = element_at(m, p.s);
    p.element = int(e);
    p.xi = (p.s - m.node[e]) / (m.node[e + 1] - m.node[e]);
    p.radius = radius_at(m, p.s, &BeamSegment::radius);
    return p;
}

/// Place of a material point in a state; nothing if it is in the sheath then.
std::optional<WirePlace> place_in(const Wire& w, const WireState& state, double s)
{
    const std::size_t e = element_at(w.material, s);
    const double a = w.material.node[e], b = w.material.node[e + 1];
    if (!(state.first < w.last())) return {};
    // place_of reads from the wire whether it is out: here the state determines it.
    if (int(e) > state.first) return WirePlace{int(e), (s - a) / (b - a), b - a};
    const double end = w.material.length - state.inserted;
    if (s <= end) return {};
    const double next = w.material.node[std::size_t(state.first) + 1];
    return WirePlace{state.first, 1 - (next - s) / (next - end), next - end};
}

Vec3 point_in(const Wire& w, const WireState& state, double s)
{
    const auto p = place_in(w, state, s);
    return p ? centreline_point(state, *p) : held_point(w, state, s);
}

Quaternion section_in_state(const Wire& w, const WireState& state, double s)
{
    const auto p = place_in(w, state, s);
    return p ? section_rotation(state, *p) : held_rotation(w, state, s);
}

/// Derivatives of the Hermite centreline by xi.
struct Slope {
    Hermite first, second;
};
Slope slope_at(double x, double L)
{
    return {{-6 * x * (1 - x), 6 * x * (1 - x), L * (1 - x) * (1 - 3 * x), -L * x * (2 - 3 * x)},
            {12 * x - 6, 6 - 12 * x, L * (6 * x - 4), L * (6 * x - 2)}};
}

Vec3 combine(const WireState& s, int element, const Hermite& h)
{
    const BeamNode &a = s.nodes[std::size_t(element)], &b = s.nodes[std::size_t(element) + 1];
    return h.h0 * a.position() + h.h1 * b.position() + h.h2 * first_axis(a.q) +
           h.h3 * first_axis(b.q);
}

// A place further along than this many bores from where it is searched for is another turn of the
// instrument: both are as long up to a contact, but for their clearance in bends.
constexpr double kFurthest = 10;

// Where the inner one fills the bore, what ends or begins to bend needs a couple: two forces, the
// larger the nearer they are. Points of the outer count from this part of their spacing on, from
// the introducer's end and from the inner one's tip, which touches by itself.
constexpr double kLeastArm = 0.5;

/// The place on a wire's centreline nearest to a point, searched for near material coordinate s;
/// nothing if that is in the sheath or beyond the tip.
/// @param reach  how far off s it may be [m]
std::optional<WirePlace> nearest_place(const Wire& w, double s, const Vec3& x, double reach)
{
    const WireState& state = w.state;
    const double end = w.material.length - state.inserted;
    std::optional<WirePlace> p = place_in(w, state, std::clamp(s, end, w.material.length));
    if (!p) {
        const double next = w.material.node[std::size_t(state.first) + 1];
        p = WirePlace{state.first, 0, next - end};
    }
    for (int i = 0; i < 30; ++i) {
        const Slope d = slope_at(p->xi, p->length);
        const Vec3 way = centreline_point(state, *p) - x;
        const Vec3 x1 = combine(state, p->element, d.first);
        const Vec3 x2 = combine(state, p->element, d.second);
        const double bend = x1.squaredNorm() + way.dot(x2);
        const double step =
            -way.dot(x1) / (bend > 0.1 * x1.squaredNorm() ? bend : x1.squaredNorm());
        const double xi = p->xi + std::clamp(step, -2.0, 2.0);
        const bool settled = std::abs(step) < 1e-13;
        constexpr double kEdge = 1e-12;
        if (xi < -kEdge) {
            if (p->element == state.first) return {};
            const double over = -xi * p->length;
            --p->element;
            p->length = p->element == state.first
                            ? w.material.node[std::size_t(state.first) + 1] - end
                            : w.material.node[std::size_t(p->element) + 1] -
                                  w.material.node[std::size_t(p->element)];
            p->xi = std::max(0.0, 1 - over / p->length);
        } else if (xi > 1 + kEdge) {
            if (p->element + 1 == w.last()) return {};
            const double over = (xi - 1) * p->length;
            ++p->element;
            p->length = w.material.node[std::size_t(p->element) + 1] -
                        w.material.node[std::size_t(p->element)];
            p->xi = std::min(1.0, over / p->length);
        } else {
            p->xi = std::clamp(xi, 0.0, 1.0);
            if (settled) break;
        }
    }
    if (std::abs(material_at(w, *p) - s) > reach) return {};
    return p;
}

/// A point that is a node's but for round-off stands on that node alone.
void settle_on_node(const Wire& w, WirePlace& p)
{
    constexpr double kRoundOff = 1e-12;
    if (p.element == w.state.first) return; // its near end is the sheath's
    if (p.xi < kRoundOff) p.xi = 0;
    if (1 - p.xi < kRoundOff) p.xi = 1;
}

double widest_bore(const Wire& w)
{
    double r = 0;
    for (const BeamSegment& s : w.material.segments)
        r = std::max(r, s.inner_radius);
    return r;
}

/// Row of the motion along t of a wire's material point at `arm` from its centreline, times sign.
ContactRow motion_row(const Wire& w, const WirePlace& p, const Mat3x12& J, const Vec3& arm,
                      const Vec3& t, double sign)
{
    Vec12 v = J.transpose() * t;
    const Vec3 m = arm.cross(t);
    const std::size_t e = std::size_t(p.element);
    const Mat3 Ra = rotation_matrix(w.state.nodes[e].q),
               Rb = rotation_matrix(w.state.nodes[e + 1].q);
    Vec3 ma = (1 - p.xi) * (Ra.transpose() * m);
    if (p.element == w.state.first) ma = w.sheath ? Vec3(ma.x(), 0, 0) : Vec3::Zero();
    v.segment<3>(3) += ma;
    v.segment<3>(9) += p.xi * (Rb.transpose() * m);
    return contact_row(sign * v);
}

/// Motion of a surface point over the step, for an arm from the centreline as it is now.
Vec3 surface_motion(const Wire& w, const WireState& start, double s, const Vec3& x,
                    const Quaternion& section, const Vec3& arm)
{
    const Vec3 before = rotation_matrix(section_in_state(w, start, s).q) *
                        (rotation_matrix(section.q).transpose() * arm);
    return x - point_in(w, start, s) + arm - before;
}

void fill(const Nesting& n, const NestingStart& start, NestedContact& k)
{
    Candidate& c = k.on_inner;
    const Wire &in = *n.inner, &out = *n.outer;
    const Mat3x12 Ji = point_jacobian(in, c.place), Jo = point_jacobian(out, k.outer);
    c.hn = contact_row(Ji.transpose() * c.n);
    k.hn = contact_row(-(Jo.transpose() * c.n));
    if (!(c.mu > 0)) {
        for (int i = 0; i < 2; ++i)
            c.ht[i] = k.ht[i] = ContactRow{{Column6{}}, {Column6{}}};
        return;
    }
    const Vec3 arm_in = -c.radius * c.n, arm_out = -k.bore * c.n;
    const Vec3 u = surface_motion(in, start.inner, material_at(in, c.place), c.x,
                                  section_rotation(in.state, c.place), arm_in) -
                   surface_motion(out, start.outer, material_at(out, k.outer), k.x_outer,
                                  section_rotation(out.state, k.outer), arm_out);
    const Vec3* t[2] = {&c.t1, &c.t2};
    for (int i = 0; i < 2; ++i) {
        c.slip[i] = u.dot(*t[i]);
        c.ht[i] = motion_row(in, c.place, Ji, arm_in, *t[i], 1);
        k.ht[i] = motion_row(out, k.outer, Jo, arm_out, *t[i], -1);
    }
}

/// At the same xi, not at the same material point: the held element's length moves it.
void at_fixed_xi(const Wire& w, const WirePlace& p, const Hermite& h, Mat3x12& J)
{
    if (p.element != w.state.first || !w.sheath) return;
    const std::size_t e = std::size_t(p.element);
    J.col(0) = (h.h2 * first_axis(w.state.nodes[e].q) + h.h3 * first_axis(w.state.nodes[e + 1].q)) /
               p.length;
}

/// As point_jacobian, of a combination of the element's nodes.
Mat3x12 jacobian(const Wire& w, const WirePlace& p, const Hermite& h)
{
    const BeamNode &a = w.state.nodes[std::size_t(p.element)],
                   &b = w.state.nodes[std::size_t(p.element) + 1];
    const Mat3 A = rotation_matrix(a.q), B = rotation_matrix(b.q);
    Mat3x12 J;
    J << h.h0 * Mat3::Identity(), Vec3::Zero(), -h.h2 * A.col(2), h.h2 * A.col(1),
        h.h1 * Mat3::Identity(), Vec3::Zero(), -h.h3 * B.col(2), h.h3 * B.col(1);
    if (p.element == w.state.first) {
        J.leftCols<6>().setZero();
        at_fixed_xi(w, p, h, J);
    }
    return J;
}

/// Second derivatives of a surface point's work with its nodes' rotations, subtracted.
/// @param at  of the wire's first node among the 24
void subtract_turning(NestedTangent& K, int at, const Wire& w, const WirePlace& p, const Vec3& f,
                      const Vec3& moment)
{
    const Hermite h = hermite(p.xi, p.length);
    for (int side = 0; side < 2; ++side) {
        const int node = p.element + side;
        if (node == w.state.first) continue;
        const Mat3 R = rotation_matrix(w.state.nodes[std::size_t(node)].q);
        const Vec3 fb = R.transpose() * f;
        const double weight = side ? h.h3 : h.h2;
        const Vec3 mb = (side ? p.xi : 1 - p.xi) * (R.transpose() * moment);
        Mat3 k = 0.5 * skew_matrix(mb);
        k.row(0) += 0.5 * weight * fb.transpose();
        k.col(0) += 0.5 * weight * fb;
        k.diagonal().array() -= weight * fb.x();
        K.block<3, 3>(at + 6 * side + 3, at + 6 * side + 3) -= k;
    }
}

/// Adds a moment on a section, shared by the element's nodes, that changes with all unknowns.
/// @param at  as subtract_turning's
void add_moment(NestedTangent& K, int at, const Wire& w, const WirePlace& p,
                const std::array<double, 2>& weight, const Vec3& moment, const Vec24& change)
{
    for (int side = 0; side < 2; ++side) {
        const int node = p.element + side;
        const Mat3 R = rotation_matrix(w.state.nodes[std::size_t(node)].q);
        Vec3 m = weight[std::size_t(side)] * (R.transpose() * moment);
        if (node == w.state.first) m = w.sheath ? Vec3(m.x(), 0, 0) : Vec3::Zero();
        K.middleRows<3>(at + 6 * side + 3) += m * change.transpose();
    }
}

} // namespace

bool fills_bore(double radius, double bore)
{
    constexpr double kRoundOff = 1e-9; // of two equal radii
    return bore - radius <= kRoundOff * bore;
}

Nesting make_nesting(const Wire& inner, const Wire& outer, double friction, double spacing)
{
    Nesting n;
    n.inner = &inner;
    n.outer = &outer;
    n.friction = friction;
    const WireMaterial& out = outer.material;
    for (int k = 0; k * spacing < out.length * (1 - 1e-12); ++k)
        n.points.push_back(point_from_tip(out, k * spacing));
    n.points.push_back(point_from_tip(inner.material, 0));
    n.reaction.assign(n.points.size(), {});
    return n;
}

void lie_along(Wire& wire, const Wire& guide)
{
    WireState& state = wire.state;
    const double from = guide.material.length - length_out(guide);
    for (int i = state.first + 1; i <= wire.last(); ++i) {
        const std::size_t k = std::size_t(i);
        const double s = from + wire.material.node[k] - wire.material.length + state.inserted;
        const double on = std::min(s, guide.material.length);
        Quaternion q = section_in_state(guide, guide.state, on);
        const Vec3 x = point_in(guide, guide.state, on) + (s - on) * first_axis(q.q);
        rotate_in_body(q.q, (state.rotation - guide.state.rotation) * Vec3::UnitX());
        BeamNode& n = state.nodes[k];
        n = BeamNode{};
        for (int axis = 0; axis < 3; ++axis)
            n.x[axis] = x[axis];
        std::copy(q.q, q.q + 4, n.q);
    }
}

double nested_length(const Nesting& n)
{
    return n.outer->outside() ? length_out(*n.outer) : 0;
}

void find_nested(const Nesting& n, const NestingStart& start, double reach,
                 std::vector<NestedContact>& contacts)
{
    contacts.clear();
    const Wire &in = *n.inner, &out = *n.outer;
    if (!in.outside() || !out.outside()) return;
    const double behind_in = in.material.length - length_out(in),
                 behind_out = out.material.length - length_out(out);
    const int count = int(n.points.size());
    const double widest = widest_bore(out), least = kLeastArm * spacing_of(n);

    // ---- Contact points in the bore
    for (int k = 0; k < count; ++k) {
        const bool outers = k != n.inners_tip();
        NestedContact contact;
        Candidate& c = contact.on_inner;
        c.index = k;
        c.point = -1;
        contact.moves_on_inner = outers;
        const Wire &fixed = outers ? out : in, &moving = outers ? in : out;
        const MaterialPoint& m = n.points[std::size_t(k)];
        auto at = place_of(fixed, fixed.state, m.s, m.element, m.xi);
        if (!at) {
            if (outers)
                k = n.inners_tip() - 1; // the rest is in the sheath; the inner's tip comes last
            continue;
        }

        // ---- The place x of the point, the nearest place y on the other's centreline, the gap c -
        // |x - y|
        settle_on_node(fixed, *at);
        const Vec3 x = centreline_point(fixed.state, *at);
        const double beyond = m.s - (outers ? behind_out : behind_in);
        const auto near = nearest_place(moving, (outers ? behind_in : behind_out) + beyond, x,
                                        kFurthest * widest);
        if (!near) continue;
        const Vec3 y = centreline_point(moving.state, *near);
        c.place = outers ? *near : *at;
        contact.outer = outers ? *at : *near;
        c.x = outers ? y : x;
        contact.x_outer = outers ? x : y;
        const Reaction& r = n.reaction[std::size_t(k)];
        const Vec3 off = c.x - contact.x_outer;
        contact.distance = off.norm();
        c.radius = radius_at(in.material, material_at(in, c.place), &BeamSegment::radius);
        contact.bore =
            radius_at(out.material, material_at(out, contact.outer), &BeamSegment::inner_radius);
        const double clearance = contact.bore - c.radius;
        c.bilateral = fills_bore(c.radius, contact.bore);
        if (c.bilateral &&
            (beyond < least || (k > 0 && outers && length_beyond(in, c.place) < least)))
            continue;
        c.gap = c.bilateral ? 0 : clearance - contact.distance;
        if (c.gap > reach && r.normal == 0) continue;

        // ---- Frame: n from the bore's wall to the inner axis, across the centreline at y
        const Vec3 tangent =
            combine(moving.state, near->element, slope_at(near->xi, near->length).first)
                .normalized();
        // In the middle of the bore any normal is as good.
        if (c.bilateral && r.touch.n.squaredNorm() > 0)
            c.n = r.touch.n;
        else if (!c.bilateral && contact.distance > 1e-12 * contact.bore)
            c.n = -off / contact.distance;
        else
            c.n = rotation_matrix(section_rotation(in.state, c.place).q).col(1);
        c.n = (c.n - tangent * tangent.dot(c.n)).normalized();
        c.t1 = tangent;
        c.t2 = c.n.cross(c.t1);
        c.hessian = Mat3::Zero();
        c.mu = n.friction;
        c.stiffness = std::min(in.material.stiffness[std::size_t(c.place.element)],
                               out.material.stiffness[std::size_t(contact.outer.element)]);
        c.normal = r.normal;
        c.sticks = r.sticks;
        if (c.mu > 0) {
            c.tangential[0] = r.tangential.dot(c.t1);
            c.tangential[1] = r.tangential.dot(c.t2);
        }
        if (c.bilateral) c.gap = off.dot(c.n);
        fill(n, start, contact);
        contacts.push_back(contact);
        // ---- Without clearance: a second row, across the first and the bore
        if (!c.bilateral) continue;
        std::swap(c.n, c.t2);
        c.gap = off.dot(c.n);
        c.mu = c.normal = c.tangential[0] = c.tangential[1] = 0;
        contact.across = true;
        fill(n, start, contact);
        contacts.push_back(contact);
    }
}

// With e from the outer's to the inner's centreline and d their distance, the place on the moving
// one following so that e stays across it (x' = t |x'| there):
//   d'' = [(b.dr)^2 + (t.dr)^2 - (t.dr + d e.dt)^2 / (1 + d e.x''/|x'|^2)] / d + e.d^2 r,
// dr at the same place on it, dt = dx'/|x'|, b = t x e. Friction's direction turns with the normal,
// dn = -b (b.dr) / d + t (e.dt). Of one that fills the bore d is 0 and n does not turn about the
// bore: the limit of both without their first terms.
NestedTangent nested_tangent(const Nesting& n, const NestedContact& k)
{
    const Candidate& c = k.on_inner;
    const Wire &in = *n.inner, &out = *n.outer;
    const Wire& moving = k.moves_on_inner ? in : out;
    const WirePlace& place = k.moves_on_inner ? c.place : k.outer;
    const double sign = k.moves_on_inner ? 1 : -1; // of the moving one's part in dr
    const Vec3 e = -c.n * sign;                    // from the fixed point to the moving centreline
    const Slope slope = slope_at(place.xi, place.length);
    const Vec3 x1 = combine(moving.state, place.element, slope.first);
    const Vec3 x2 = combine(moving.state, place.element, slope.second);
    const double speed = x1.norm(), d = std::max(k.distance, 1e-3 * (k.bore - c.radius));

    const Mat3x12 Ji = jacobian(in, c.place, hermite(c.place.xi, c.place.length));
    const Mat3x12 Jo = jacobian(out, k.outer, hermite(k.outer.xi, k.outer.length));
    const Mat3x12 Jd = jacobian(moving, place, slope.first);
    Eigen::Matrix<double, 3, 24> dr;
    dr << sign * Ji, -sign * Jo;
    Vec24 turn = Vec24::Zero(); // e . dt
    turn.segment<12>(k.moves_on_inner ? 0 : 12) = Jd.transpose() * e / speed;
    const Vec24 along = dr.transpose() * c.t1, across = dr.transpose() * c.t2;
    const Vec24 mixed = along + d * turn;
    const double bent = 1 + d * e.dot(x2) / (speed * speed);

    // Work of the reaction is r_n gap + f_t.u; the tangent is minus its second derivative.
    NestedTangent K;
    if (c.bilateral)
        K = c.normal * (along * along.transpose() * (e.dot(x2) / (speed * speed)) -
                        along * turn.transpose() - turn * along.transpose());
    else
        K = (c.normal / d) * (across * across.transpose() + along * along.transpose() -
                              mixed * mixed.transpose() / bent);
    const Vec3 ft = c.tangential[0] * c.t1 + c.tangential[1] * c.t2;
    const Vec3 f = c.normal * c.n + ft;
    const Vec3 moment[2] = {(-c.radius * c.n).cross(ft), (k.bore * c.n).cross(ft)};
    if (c.mu > 0) {
        const Vec24 way = -mixed / bent; // of the place along the moving centreline [m]
        const Vec24 bends = turn + way * (e.dot(x2) / (speed * speed)); // e . dt at the place
        // d f_t = -n (f_t . dn) on the inner, the opposite on the outer. n is -sign e.
        const double spin = c.bilateral ? 0 : 1 / d;
        const Vec24 dn = sign * (bends * c.tangential[0] - across * (spin * c.tangential[1]));
        K += (sign * (dr.transpose() * c.n)) * dn.transpose();
        // The arms turn along: d (-r n x f_t) = -r n (f_t2 e.dt + f_t1 b.dr / d), a moment about n.
        const Vec24 turned = sign * (bends * c.tangential[1] + across * (spin * c.tangential[0]));
        add_moment(K, 0, in, c.place, {1 - c.place.xi, c.place.xi}, c.radius * c.n, turned);
        add_moment(K, 12, out, k.outer, {1 - k.outer.xi, k.outer.xi}, -k.bore * c.n, turned);
        // What acts on the moving one runs from node to node.
        const int at = k.moves_on_inner ? 0 : 12;
        K.middleRows<12>(at) -= (sign * (Jd.transpose() * ft)) * (way / speed).transpose();
        add_moment(K, at, moving, place, {-1, 1}, -moment[k.moves_on_inner ? 0 : 1], way / speed);
    }
    subtract_turning(K, 0, in, c.place, f, moment[0]);
    subtract_turning(K, 12, out, k.outer, -f, moment[1]);
    return K;
}

void shift_nested_reactions(Nesting& n, double shift)
{
    const double spacing = spacing_of(n);
    if (shift == 0 || !(spacing > 0)) return;
    const std::vector<Reaction> old = n.reaction;
    const std::size_t count = std::size_t(n.inners_tip());
    // The tip keeps its own.
    for (std::size_t p = 1; p < count; ++p) {
        const double t = double(p) - shift / spacing, down = std::floor(t);
        Reaction r;
        Vec3 push = Vec3::Zero(); // of one that fills the bore
        for (int side = 0; side < 2; ++side) {
            const double k = down + side, weight = side ? t - down : 1 - (t - down);
            if (k < 1 || k >= double(count) || weight == 0) continue;
            const Reaction& o = old[std::size_t(k)];
            r.normal += weight * o.normal;
            r.tangential += weight * o.tangential;
            push += weight * o.normal * o.touch.n;
            if (weight >= 0.5) r.sticks = o.sticks;
        }
        if (const double size = push.norm(); size > 0) {
            r.normal = size;
            r.touch.n = push / size;
        }
        n.reaction[p] = r;
    }
}

Vec3 nested_motion(const Nesting& n, const NestingStart& start, int k, const Vec3& normal)
{
    const Wire &in = *n.inner, &out = *n.outer;
    if (!in.outside() || !out.outside()) return Vec3::Zero();
    const bool outers = k != n.inners_tip();
    const Wire &fixed = outers ? out : in, &moving = outers ? in : out;
    const MaterialPoint& m = n.points[std::size_t(k)];
    const auto at = place_of(fixed, fixed.state, m.s, m.element, m.xi);
    if (!at) return Vec3::Zero();
    const Vec3 x = centreline_point(fixed.state, *at);
    const double behind_fixed = fixed.material.length - length_out(fixed),
                 behind = moving.material.length - length_out(moving);
    const auto near =
        nearest_place(moving, behind + m.s - behind_fixed, x, kFurthest * widest_bore(out));
    if (!near) return Vec3::Zero();
    const WirePlace &pi = outers ? *near : *at, &po = outers ? *at : *near;
    const double radius = radius_at(in.material, material_at(in, pi), &BeamSegment::radius);
    const double bore = radius_at(out.material, material_at(out, po), &BeamSegment::inner_radius);
    return surface_motion(in, start.inner, material_at(in, pi), centreline_point(in.state, pi),
                          section_rotation(in.state, pi), -radius * normal) -
           surface_motion(out, start.outer, material_at(out, po), centreline_point(out.state, po),
                          section_rotation(out.state, po), -bore * normal);
}

Vec3 nested_slip(const Nesting& n, const NestingStart& start, int k, const Vec3& normal)
{
    const Vec3 u = nested_motion(n, start, k, normal);
    return u - normal * normal.dot(u);
}

} // namespace amontons
