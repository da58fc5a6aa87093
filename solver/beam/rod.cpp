#include "solver/beam/rod.hpp"

#include "mesh/base/dense.hpp"
#include "mesh/base/error.hpp"
#include "solver/beam/clamp.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>

namespace amontons {
namespace {

constexpr double kLengths = 1e-3; // of lengths that are given twice, relative
constexpr double kPi = 3.14159265358979323846;

std::string number(double x)
{
    char text[40];
    std::snprintf(text, sizeof text, "%.9g", x);
    return text;
}

void set_place(BeamNode& n, const Vec3& x)
{
    for (int k = 0; k < 3; ++k) {
        n.x[k] = x[k];
        n.rest[k] = 0;
    }
}

void set_frame(BeamNode& n, const Mat3& frame)
{
    const Quaternion q = quaternion_of(frame);
    std::copy(q.q, q.q + 4, n.q);
}

Mat3 frame_of(const Vec3& tangent, const Vec3& near)
{
    Mat3 f;
    f.col(0) = tangent.normalized();
    f.col(1) = (near - near.dot(f.col(0)) * f.col(0)).normalized();
    f.col(2) = f.col(0).cross(f.col(1));
    return f;
}

/// The frame carried from one tangent to another without twist.
Mat3 carried(const Mat3& frame, const Vec3& tangent)
{
    const Eigen::Quaterniond turn = rotation_between(frame.col(0), tangent.normalized());
    return frame_of(tangent, turn * Vec3(frame.col(1)));
}

/// Nodes of the segments and at the given places: an inner node nearby is moved there.
std::vector<double> node_places(const WireMaterial& m, std::vector<double> places)
{
    constexpr double kSame = 1e-9, kNear = 0.35;
    std::vector<double> s = m.node;
    std::vector<char> fixed(s.size(), 0);
    for (std::size_t i = 0; i < s.size(); ++i)
        fixed[i] = i == 0 || i + 1 == s.size() ||
                   std::find(m.segment_start.begin(), m.segment_start.end(), s[i]) !=
                       m.segment_start.end();
    std::sort(places.begin(), places.end());
    for (const double a : places) {
        const auto after = std::size_t(std::upper_bound(s.begin(), s.end(), a) - s.begin());
        const std::size_t i = std::clamp<std::size_t>(after, 1, s.size() - 1);
        const double h = s[i] - s[i - 1];
        std::size_t near = a - s[i - 1] < s[i] - a ? i - 1 : i;
        if (std::abs(s[near] - a) <= kSame * m.length) {
            fixed[near] = 1;
            continue;
        }
        if (!fixed[near] && std::abs(s[near] - a) < kNear * h) {
            s[near] = a;
            fixed[near] = 1;
            continue;
        }
        s.insert(s.begin() + std::ptrdiff_t(i), a);
        fixed.insert(fixed.begin() + std::ptrdiff_t(i), 1);
    }
    return s;
}

} // namespace

Vec3 RodModel::axis(int element, int end) const
{
    for (const RodCorner& c : corners)
        if (c.element == element && c.end == end) return first_axis(c.turn.q);
    return Vec3::UnitX();
}

int RodModel::node_at(double at) const
{
    const auto after = std::lower_bound(s.begin(), s.end(), at);
    std::size_t i = std::min(std::size_t(after - s.begin()), s.size() - 1);
    if (i > 0 && at - s[i - 1] < s[i] - at) --i;
    if (closed && at > 0.5 * (s.back() + length)) i = 0;
    return int(i);
}

Mat3 first_frame(const RodShape& shape, const Vec3& tangent)
{
    const Vec3 t = tangent.normalized();
    const bool fits = shape.normal && t.cross(shape.normal->normalized()).norm() > 1e-9;
    if (fits) return frame_of(t, *shape.normal);
    return frame_of(t, std::abs(t.z()) < 0.9 ? Vec3(Vec3::UnitZ().cross(t)) : Vec3::UnitX());
}

RodModel make_rod(const std::vector<BeamSegment>& given, const RodShape& shape,
                  const Centreline* curve, std::span<const double> at)
{
    RodModel r;
    r.closed = shape.closed;
    r.segments = given;
    std::vector<double> corner{0}; // arc lengths of a polyline's points

    // ---- Length along the shape, segments
    for (std::size_t i = 0; i + 1 < shape.points.size(); ++i)
        corner.push_back(corner.back() + (shape.points[i + 1].at - shape.points[i].at).norm());
    const bool polyline = shape.points.size() > 1;
    double length = 0;
    for (const BeamSegment& g : given)
        length += g.length;
    const double along = curve ? curve->length() : polyline ? corner.back() : length;
    if (std::abs(along - length) > kLengths * along)
        throw InputError({{"", "/segments", number(length) + " m in all",
                           number(along) + " [m], the length of the shape, within 0.1 %"}});
    for (BeamSegment& g : r.segments)
        g.length *= along / length;
    if (curve && r.closed &&
        !((curve->at(0).position - curve->at(along).position).norm() <= 1e-6 * along))
        throw InputError({{"", "/shape/curve", "an end away from the start",
                           "a curve that leads back to its start: the rod is closed"}});

    // ---- Nodes
    const WireMaterial m = make_material(r.segments, 0);
    r.length = m.length;
    r.segment_start = m.segment_start;
    std::vector<double> places(at.begin(), at.end());
    if (polyline) places.insert(places.end(), corner.begin() + 1, corner.end() - 1);
    for (double& a : places)
        a = std::clamp(a, 0.0, r.length);
    r.s = node_places(m, std::move(places));
    const std::vector<double> ends = r.s;
    if (r.closed) r.s.pop_back(); // the last is the first again
    if (r.closed && r.s.size() < 3)
        throw InputError({{"", "/segments", std::to_string(r.s.size()) + " elements",
                           "at least 3 elements of a closed rod"}});

    for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
        const double a = ends[i], b = ends[i + 1];
        r.law.push_back(law_between(m, a, b));
        ElementMass mass;
        double radius = 0;
        for (std::size_t k = 0; k < r.segments.size(); ++k) { // shares of the segments
            const BeamSegment& g = r.segments[k];
            const double start = m.segment_start[k];
            const double share = (std::min(b, start + g.length) - std::max(a, start)) / (b - a);
            if (!(share > 0)) continue;
            const double r2 = g.radius * g.radius, bore2 = g.inner_radius * g.inner_radius,
                         area = kPi * (r2 - bore2), inertia = area * (r2 + bore2) / 4;
            mass.per_length += share * g.density * area;
            mass.spin += 2 * share * g.density * inertia;
            mass.bend += share * g.density * inertia;
            radius = std::max(radius, g.radius);
        }
        r.mass.push_back(mass);
        r.radius.push_back(radius);
    }

    // ---- Places and frames
    // places and frames
    r.nodes.assign(r.s.size(), BeamNode{});
    if (curve) {
        const CurvePoint begin = curve->at(0);
        const Vec3 bend = begin.curvature;
        Mat3 frame = shape.normal || !(bend.norm() > 0) ? first_frame(shape, begin.tangent)
                                                        : frame_of(begin.tangent, bend);
        double s = 0;
        for (std::size_t i = 0; i < r.s.size(); ++i) {
            // Without twist: in many small turns, since one long one is not along the curve.
            constexpr int kParts = 16;
            for (int k = 1; i > 0 && k <= kParts; ++k)
                frame = carried(frame, curve->at(s + (r.s[i] - s) * k / kParts).tangent);
            s = r.s[i];
            set_place(r.nodes[i], curve->at(s).position);
            set_frame(r.nodes[i], frame);
        }
    } else if (polyline) {
        std::vector<Mat3> frame;
        for (std::size_t k = 0; k + 1 < shape.points.size(); ++k) {
            const Vec3 t = (shape.points[k + 1].at - shape.points[k].at).normalized();
            if (k > 0 && frame.back().col(0).dot(t) < -1 + 1e-6)
                throw InputError(
                    {{"", "/shape/points/" + std::to_string(k), "a corner that leads back",
                      "a corner of less than 180 degrees"}});
            frame.push_back(k == 0 ? first_frame(shape, t) : carried(frame.back(), t));
        }
        const auto piece = [&](double s) { // that ends at or holds s
            std::size_t k = 0;
            while (k + 2 < corner.size() && s > corner[k + 1] + 1e-9 * r.length)
                ++k;
            return k;
        };
        for (std::size_t i = 0; i < r.s.size(); ++i) {
            const std::size_t k = piece(r.s[i]);
            const Vec3 a = shape.points[k].at, b = shape.points[k + 1].at;
            const double t = (r.s[i] - corner[k]) / (corner[k + 1] - corner[k]);
            set_place(r.nodes[i], a + t * (b - a));
            set_frame(r.nodes[i], frame[k]);
        }
        const auto turned = [&](int element, int end, std::size_t node, std::size_t k) {
            const Mat3 turn = rotation_matrix(r.nodes[node].q).transpose() * frame[k];
            if ((turn - Mat3::Identity()).norm() > 1e-12)
                r.corners.push_back({element, end, quaternion_of(turn)});
        };
        for (std::size_t e = 0; e < r.law.size(); ++e) {
            const std::size_t k = piece(0.5 * (ends[e] + ends[e + 1]));
            turned(int(e), 0, e, k);
            turned(int(e), 1, std::size_t(r.second(int(e))), k);
        }
    } else {
        BeamNode& n = r.nodes[0];
        set_place(n, shape.start);
        set_frame(n, first_frame(shape, shape.direction));
        grow_naturally(r.nodes, r.law);
    }

    // ---- Natural shape
    if ((curve || polyline) && shape.stress_free) {
        // What the strains are now is natural.
        for (int e = 0; e < r.element_count(); ++e) {
            BeamNode a = r.nodes[std::size_t(e)], b = r.nodes[std::size_t(r.second(e))];
            for (const RodCorner& c : r.corners)
                if (c.element == e) {
                    double* q = c.end == 0 ? a.q : b.q;
                    quaternion_product(q, c.turn.q, q);
                }
            ElementLaw& law = r.law[std::size_t(e)];
            std::array<double, 6> strain = element_strain(a, b, law.length);
            strain[0] = mean_stretch(law, strain);
            law.constant = 0;
            for (std::size_t i = 0; i < 6; ++i) {
                law.P[i] = law.S[i] * strain[i];
                law.constant += 0.5 * law.P[i] * strain[i];
            }
        }
    }
    for (const ElementLaw& law : r.law)
        r.natural.push_back(corotational_natural(law));
    return r;
}

} // namespace amontons
