#include "validation/random/geometry.hpp"

#include "validation/random/laws.hpp"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>

namespace amontons::validation {
namespace {

constexpr double kTurn = 6.283185307179586;

// ---- outside of a mesh

/// Corners of the faces of VTK's tetrahedron (10) and hexahedron (12), seen from outside.
const std::vector<std::vector<int>>& corners_of(int type)
{
    static const std::vector<std::vector<int>> tetrahedron{
        {0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};
    static const std::vector<std::vector<int>> hexahedron{{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4},
                                                          {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
    return type == 12 ? hexahedron : tetrahedron;
}

/// The node in the middle of two corners of VTK's quadratic tetrahedron (24).
int middle_of(int a, int b)
{
    const int low = std::min(a, b), high = std::max(a, b);
    if (high == 3) return 7 + low;
    return low == 0 ? (high == 1 ? 4 : 6) : 5;
}

struct Face {
    std::vector<int> corners, middles;
};

std::vector<Face> outer_faces(const VtkText& solid)
{
    const std::vector<double>&connectivity = solid.get("Cells/connectivity").values,
          &offsets = solid.get("Cells/offsets").values, &types = solid.get("Cells/types").values;
    std::map<std::vector<int>, std::pair<int, Face>> seen;
    std::size_t begin = 0;
    for (std::size_t c = 0; c < types.size(); ++c) {
        const int type = static_cast<int>(types[c]);
        if (type != 10 && type != 12 && type != 24)
            throw std::runtime_error("a cell of unknown type");
        for (const std::vector<int>& local : corners_of(type)) {
            Face f;
            for (std::size_t k = 0; k < local.size(); ++k) {
                f.corners.push_back(
                    static_cast<int>(connectivity[begin + static_cast<std::size_t>(local[k])]));
                if (type == 24)
                    f.middles.push_back(static_cast<int>(
                        connectivity[begin + static_cast<std::size_t>(middle_of(
                                                 local[k], local[(k + 1) % local.size()]))]));
            }
            std::vector<int> key = f.corners;
            std::sort(key.begin(), key.end());
            auto& entry = seen[key];
            ++entry.first;
            entry.second = std::move(f);
        }
        begin = static_cast<std::size_t>(offsets[c]);
    }
    std::vector<Face> faces;
    for (auto& [key, entry] : seen)
        if (entry.first == 1) faces.push_back(std::move(entry.second));
    return faces;
}

Vec3 nearest_on_triangle(const Vec3& p, const std::array<Vec3, 3>& t)
{
    const Vec3 ab = t[1] - t[0], ac = t[2] - t[0], n = ab.cross(ac);
    const double area = n.squaredNorm();
    if (area > 0) {
        const Vec3 w = p - t[0];
        const double u = w.cross(ac).dot(n) / area, v = ab.cross(w).dot(n) / area;
        if (u >= 0 && v >= 0 && u + v <= 1) return t[0] + u * ab + v * ac;
    }
    Vec3 best = t[0];
    for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 e = t[(k + 1) % 3] - t[k];
        const double length = e.squaredNorm();
        const double s = length > 0 ? std::clamp((p - t[k]).dot(e) / length, 0.0, 1.0) : 0;
        const Vec3 q = t[k] + s * e;
        if ((q - p).squaredNorm() < (best - p).squaredNorm()) best = q;
    }
    return best;
}

/// The solid angle of a triangle. Source: van Oosterom, Strackee 1983.
double solid_angle(const Vec3& p, const std::array<Vec3, 3>& t)
{
    const Vec3 a = t[0] - p, b = t[1] - p, c = t[2] - p;
    const double x = a.norm(), y = b.norm(), z = c.norm();
    return 2 *
           std::atan2(a.dot(b.cross(c)), x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y);
}

/// Signed distance to a closed surface, positive outside.
Depth distance_to(const std::vector<OuterTriangle>& surface, const Vec3& low, const Vec3& high,
                  const Vec3& p, double within)
{
    const Vec3 beyond = (low - p).cwiseMax(p - high);
    if (beyond.cwiseMax(0).norm() > within) return {beyond.cwiseMax(0).norm(), 0};
    Depth d{std::numeric_limits<double>::infinity(), 0};
    double winding = 0;
    for (const OuterTriangle& t : surface) {
        const double here = (nearest_on_triangle(p, t.corner) - p).norm();
        if (here < d.distance) d = {here, t.face};
        winding += solid_angle(p, t.corner);
    }
    if (winding > kTurn) d.distance = -d.distance; // 4 pi inside, 0 outside
    return d;
}

// ---- shapes in closed form

double box_distance(const Vec3& p, const Vec3& half)
{
    const Vec3 q = p.cwiseAbs() - half;
    return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0);
}

double cylinder_distance(const Vec3& p, double radius, double half)
{
    const double r = std::hypot(p.x(), p.y()) - radius, z = std::abs(p.z()) - half;
    return std::hypot(std::max(r, 0.0), std::max(z, 0.0)) + std::min(std::max(r, z), 0.0);
}

/// Points of a centreline of straight pieces and arcs, at most a hundredth of a radius apart.
std::vector<Vec3> centreline_points(const Json& line)
{
    Vec3 at = vector_of(line.at("start")), t = vector_of(line.at("direction")).normalized(),
         n = vector_of(line.at("normal"));
    n = (n - n.dot(t) * t).normalized();
    std::vector<Vec3> points{at};
    for (const Json& piece : line.at("pieces")) {
        const double length = piece.value("length", 0.0), radius = piece.value("radius", 0.0),
                     angle = piece.value("angle", 0.0), towards = piece.value("direction", 0.0);
        if (length > 0) points.push_back(at += length * t);
        if (angle <= 0) continue;
        const Vec3 b = t.cross(n), bend = std::cos(towards) * n + std::sin(towards) * b,
                   axis = t.cross(bend);
        const Vec3 centre = at + radius * bend, arm = at - centre, t0 = t, n0 = n;
        const int steps = std::max(1, static_cast<int>(std::ceil(angle / 0.005)));
        for (int k = 1; k <= steps; ++k)
            points.push_back(centre + turn_by(axis * (angle * k / steps)) * arm);
        const Mat3 turned = turn_by(axis * angle);
        at = points.back();
        t = turned * t0;
        n = turned * n0;
    }
    return points;
}

double distance_to_line(const std::vector<Vec3>& line, const Vec3& p)
{
    double best = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i + 1 < line.size(); ++i) {
        const Vec3 e = line[i + 1] - line[i];
        const double s = std::clamp((p - line[i]).dot(e) / e.squaredNorm(), 0.0, 1.0);
        best = std::min(best, (line[i] + s * e - p).squaredNorm());
    }
    return std::sqrt(best);
}

// ---- bodies

void place_rigid(PlacedBody& body, const Json& shape, const RigidMotion& pose)
{
    const std::string kind = shape.value("generate", "");
    std::function<double(const Vec3&)> distance;
    const auto add = [&](const Vec3& p) { body.places.push_back({pose.apply(p), 0, 0}); };
    if (kind == "box") {
        const Vec3 half = 0.5 * vector_of(shape.at("size"));
        body.thickness = 2 * half.minCoeff();
        distance = [half](const Vec3& p) { return box_distance(p, half); };
        constexpr int n = 12;
        for (int axis = 0; axis < 3; ++axis)
            for (const double side : {-1.0, 1.0})
                for (int i = 0; i <= n; ++i)
                    for (int j = 0; j <= n; ++j) {
                        Vec3 p;
                        p[axis] = side * half[axis];
                        p[(axis + 1) % 3] = half[(axis + 1) % 3] * (2.0 * i / n - 1);
                        p[(axis + 2) % 3] = half[(axis + 2) % 3] * (2.0 * j / n - 1);
                        add(p);
                    }
    } else if (kind == "ball") {
        const double radius = shape.at("radius");
        body.thickness = 2 * radius;
        body.curvature = 1 / radius;
        distance = [radius](const Vec3& p) { return p.norm() - radius; };
        body.places.push_back({pose.shift, 0, radius});
    } else if (kind == "cylinder") {
        const double radius = shape.at("radius"), half = 0.5 * shape.at("length").get<double>();
        body.thickness = 2 * std::min(radius, half);
        body.curvature = 1 / radius;
        distance = [=](const Vec3& p) { return cylinder_distance(p, radius, half); };
        for (int i = 0; i < 96; ++i)
            for (int j = -6; j <= 6; ++j)
                add({radius * std::cos(kTurn * i / 96), radius * std::sin(kTurn * i / 96),
                     half * j / 6});
        for (int i = 0; i < 24; ++i) // its ends
            for (int j = 0; j < 6; ++j)
                for (const double z : {-half, half})
                    add({radius * j / 6 * std::cos(kTurn * i / 24),
                         radius * j / 6 * std::sin(kTurn * i / 24), z});
    } else {
        throw std::runtime_error("a rigid shape that is unknown here");
    }
    body.depth = [=](const Vec3& p, double) { return Depth{distance(pose.back(p)), 0}; };
}

void place_obstacle(PlacedBody& body, const Json& description)
{
    const Json& s = description.at("surface");
    const std::string kind = s.value("generate", "");
    const double radius = s.contains("radius") ? s.at("radius").get<double>() : 0;
    std::function<double(const Vec3&)> distance;
    if (kind == "plane") {
        const Vec3 n = vector_of(s.at("axis")).normalized(), at = vector_of(s.at("centre"));
        distance = [=](const Vec3& p) { return n.dot(p - at); };
    } else if (kind == "ball") {
        const Vec3 at = vector_of(s.at("centre"));
        distance = [=](const Vec3& p) { return (p - at).norm() - radius; };
        body.curvature = 1 / radius;
    } else if (kind == "cylinder") {
        const Vec3 n = vector_of(s.at("axis")).normalized(), at = vector_of(s.at("centre"));
        distance = [=](const Vec3& p) { return (p - at - n.dot(p - at) * n).norm() - radius; };
        body.curvature = 1 / radius;
    } else if (kind == "tube" && s.at("centreline").contains("pieces")) {
        const std::vector<Vec3> line = centreline_points(s.at("centreline"));
        distance = [=](const Vec3& p) { return radius - distance_to_line(line, p); };
        body.curvature = 1 / radius;
    } else {
        throw std::runtime_error("an obstacle that is unknown here");
    }
    const bool inside = description.value("side", "") == "inside" && kind != "tube";
    body.depth = [=](const Vec3& p, double) {
        return Depth{inside ? -distance(p) : distance(p), 0};
    };
}

void place_solid(PlacedBody& body, const Json& mesh, const VtkText& solid)
{
    const std::vector<OuterTriangle> surface = outside_of(solid);
    Vec3 low = Vec3::Constant(1e300), high = -low;
    for (const OuterTriangle& t : surface)
        for (const Vec3& x : t.corner) {
            low = low.cwiseMin(x);
            high = high.cwiseMax(x);
        }
    for (const OuterTriangle& t : surface) {
        const int n = t.cuts;
        for (int i = 0; i <= n; ++i)
            for (int j = 0; i + j <= n; ++j)
                body.places.push_back(
                    {(t.corner[0] * i + t.corner[1] * j + t.corner[2] * (n - i - j)) / n, t.face,
                     0});
    }
    body.depth = [=](const Vec3& p, double within) {
        return distance_to(surface, low, high, p, within);
    };
    const std::string kind = mesh.value("generate", "");
    if (kind == "box") body.thickness = vector_of(mesh.at("size")).minCoeff();
    if (kind == "ball" || kind == "cylinder") {
        body.curvature = 1 / mesh.at("radius").get<double>();
        body.thickness = 2 * mesh.at("radius").get<double>();
        if (kind == "cylinder")
            body.thickness = std::min(body.thickness, mesh.at("length").get<double>());
    }
}

/// @param from  arc length from which it is out of its sheath [m]
void place_rod(PlacedBody& body, const VtkText& line, double from)
{
    const WrittenArray& points = line.get("Points/points");
    const WrittenArray& radius = line.get("PointData/radius");
    const std::vector<double>& arc = line.get("PointData/arc_length").values;
    body.thickness = 2 * *std::min_element(radius.values.begin(), radius.values.end());
    for (std::size_t i = 0; i < radius.values.size(); ++i)
        if (arc[i] >= from) body.places.push_back({points.vector(i), 0, radius.values[i]});
}

/// What of an instrument is in its sheath, whose walls it does not touch [m].
double held_length(const Json& body, double time)
{
    if (body.at("kind") != "beam") return 0;
    double length = 0;
    for (const Json& s : body.at("segments"))
        length += s.at("length").get<double>();
    return length - value_at(body.at("drive").at("insertion"), time);
}

} // namespace

Mat3 turn_by(const Vec3& v)
{
    const double angle = v.norm();
    if (angle == 0) return Mat3::Identity();
    const Vec3 k = v / angle;
    Mat3 cross;
    cross << 0, -k.z(), k.y(), k.z(), 0, -k.x(), -k.y(), k.x(), 0;
    return Mat3::Identity() + std::sin(angle) * cross + (1 - std::cos(angle)) * cross * cross;
}

RigidMotion start_of(const Json& body)
{
    RigidMotion m;
    if (!body.contains("start")) return m;
    const Json& start = body.at("start");
    if (start.contains("turn")) m.turn = turn_by(vector_of(start.at("turn")));
    if (start.contains("place")) m.shift = vector_of(start.at("place"));
    return m;
}

RigidMotion fit_motion(const WrittenArray& from, const WrittenArray& to, double& miss)
{
    const std::size_t n = from.values.size() / 3;
    if (n < 3 || to.values.size() != from.values.size())
        throw std::runtime_error("frames of a rigid body have different points");
    Vec3 a = Vec3::Zero(), b = Vec3::Zero();
    for (std::size_t i = 0; i < n; ++i) {
        a += from.vector(i) / double(n);
        b += to.vector(i) / double(n);
    }
    Mat3 h = Mat3::Zero();
    for (std::size_t i = 0; i < n; ++i)
        h += (to.vector(i) - b) * (from.vector(i) - a).transpose();
    const Eigen::JacobiSVD<Mat3> svd(h, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Mat3 flip = Mat3::Identity();
    flip(2, 2) = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
    RigidMotion m;
    m.turn = svd.matrixU() * flip * svd.matrixV().transpose();
    m.shift = b - m.turn * a;
    miss = 0;
    for (std::size_t i = 0; i < n; ++i)
        miss = std::max(miss, (m.apply(from.vector(i)) - to.vector(i)).norm());
    return m;
}

RigidMotion pose_in(const WrittenRun& run, const std::string& body, const WrittenFrame& frame)
{
    double miss = 0;
    const RigidMotion moved = fit_motion(run.frames.front().parts.at(body).get("Points/points"),
                                         frame.parts.at(body).get("Points/points"), miss);
    const RigidMotion start = start_of(run.body.at(body));
    return {moved.turn * start.turn, moved.apply(start.shift)};
}

PlacedBody place_body(const WrittenRun& run, const std::string& name, const WrittenFrame& frame)
{
    const Json& description = run.body.at(name);
    PlacedBody body;
    body.name = name;
    body.kind = description.at("kind");
    if (body.kind == "obstacle")
        place_obstacle(body, description);
    else if (body.kind == "rigid")
        place_rigid(body, description.at("shape"), pose_in(run, name, frame));
    else if (body.kind == "solid")
        place_solid(body, description.at("mesh"), frame.parts.at(name));
    else
        place_rod(body, frame.parts.at(name), held_length(description, frame.time));
    return body;
}

DeepestPlace deepest_place(const PlacedBody& a, const PlacedBody& b)
{
    DeepestPlace deepest;
    const auto examine = [&](const PlacedBody& mine, const PlacedBody& other) {
        if (!other.depth) return;
        for (const SurfacePlace& p : mine.places) {
            const Depth d = other.depth(p.at, p.round);
            if (p.round - d.distance <= deepest.depth) continue;
            const double face =
                p.face > 0 && d.face > 0 ? std::min(p.face, d.face) : std::max(p.face, d.face);
            deepest = {p.round - d.distance, p.at, face};
        }
    };
    examine(a, b);
    examine(b, a);
    return deepest;
}

std::vector<OuterTriangle> outside_of(const VtkText& solid)
{
    const WrittenArray& points = solid.get("Points/points");
    const auto at = [&](int i) { return points.vector(static_cast<std::size_t>(i)); };
    std::vector<OuterTriangle> out;
    for (const Face& f : outer_faces(solid)) {
        double longest = 0;
        for (std::size_t k = 0; k < f.corners.size(); ++k)
            longest = std::max(
                longest, (at(f.corners[k]) - at(f.corners[(k + 1) % f.corners.size()])).norm());
        const auto add = [&](const Vec3& x, const Vec3& y, const Vec3& z) {
            out.push_back({{x, y, z}, longest});
        };
        if (!f.middles.empty()) {
            constexpr int n = 4;
            const auto place = [&](int a, int b) -> Vec3 { // of the quadratic face
                const double u = double(a) / n, v = double(b) / n, w = 1 - u - v;
                return w * (2 * w - 1) * at(f.corners[0]) + u * (2 * u - 1) * at(f.corners[1]) +
                       v * (2 * v - 1) * at(f.corners[2]) + 4 * u * w * at(f.middles[0]) +
                       4 * u * v * at(f.middles[1]) + 4 * v * w * at(f.middles[2]);
            };
            const std::size_t first = out.size();
            for (int a = 0; a < n; ++a)
                for (int b = 0; a + b < n; ++b) {
                    add(place(a, b), place(a + 1, b), place(a, b + 1));
                    if (a + b + 1 < n) add(place(a + 1, b), place(a + 1, b + 1), place(a, b + 1));
                }
            for (std::size_t k = first; k < out.size(); ++k)
                out[k].cuts = 2;
        } else if (f.corners.size() == 3) {
            add(at(f.corners[0]), at(f.corners[1]), at(f.corners[2]));
        } else {
            const Vec3 middle =
                0.25 * (at(f.corners[0]) + at(f.corners[1]) + at(f.corners[2]) + at(f.corners[3]));
            for (std::size_t k = 0; k < 4; ++k)
                add(at(f.corners[k]), at(f.corners[(k + 1) % 4]), middle);
        }
    }
    return out;
}

std::vector<double> cell_volumes(const VtkText& solid, bool undeformed)
{
    const std::vector<double>&connectivity = solid.get("Cells/connectivity").values,
          &offsets = solid.get("Cells/offsets").values, &types = solid.get("Cells/types").values;
    const WrittenArray &points = solid.get("Points/points"),
                       &moved = solid.get("PointData/displacement");
    std::vector<double> volumes;
    std::size_t begin = 0;
    for (std::size_t c = 0; c < types.size(); ++c) {
        const auto x = [&](int k) -> Vec3 {
            const auto i =
                static_cast<std::size_t>(connectivity[begin + static_cast<std::size_t>(k)]);
            return points.vector(i) - (undeformed ? 1.0 : 0.0) * moved.vector(i);
        };
        const auto tetrahedron = [&](int i, int j, int k, int l) {
            return (x(j) - x(i)).dot((x(k) - x(i)).cross(x(l) - x(i))) / 6;
        };
        volumes.push_back(types[c] == 12 ? tetrahedron(0, 1, 2, 5) + tetrahedron(0, 2, 7, 5) +
                                               tetrahedron(0, 2, 3, 7) + tetrahedron(0, 5, 7, 4) +
                                               tetrahedron(2, 7, 5, 6)
                                         : tetrahedron(0, 1, 2, 3));
        begin = static_cast<std::size_t>(offsets[c]);
    }
    return volumes;
}

bool rigid_mass(const Json& body, double& mass, Vec3& inertia)
{
    const Json& shape = body.at("shape");
    const std::string kind = shape.value("generate", "");
    double volume = 0;
    if (kind == "box") {
        const Vec3 s = vector_of(shape.at("size"));
        volume = s.prod();
        inertia = Vec3(s.y() * s.y() + s.z() * s.z(), s.x() * s.x() + s.z() * s.z(),
                       s.x() * s.x() + s.y() * s.y()) /
                  12;
    } else if (kind == "ball") {
        const double r = shape.at("radius");
        volume = kTurn * 2 / 3 * r * r * r;
        inertia = Vec3::Constant(0.4 * r * r);
    } else if (kind == "cylinder") {
        const double r = shape.at("radius"), l = shape.at("length");
        volume = kTurn / 2 * r * r * l;
        inertia = Vec3(r * r / 4 + l * l / 12, r * r / 4 + l * l / 12, r * r / 2);
    } else {
        return false;
    }
    if (body.contains("mass"))
        mass = body.at("mass");
    else if (body.contains("density"))
        mass = body.at("density").get<double>() * volume;
    else
        return false;
    inertia *= mass;
    if (body.contains("inertia")) inertia = vector_of(body.at("inertia"));
    return true;
}

} // namespace amontons::validation
