#include "mesh/format/polygon.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

// Ear clipping (Meisters 1975): a corner whose triangle is convex and holds no other corner can
// be cut off. A simple polygon always has two such ears. Where a polygon is not simple, or
// flat, none may be left: the rest is then cut as a fan, and check_surface finds what is wrong.

namespace amontons {
namespace {

using CornerList = std::vector<std::int32_t>;
constexpr std::size_t kMostCorners = 1024; // bounds the time, at worst O(corners^3)

const Vec3& corner_at(const SurfaceMesh& mesh, std::int32_t corner)
{
    return mesh.points[static_cast<std::size_t>(corner)];
}

/// Area vector of a polygon, twice. Taken about its first corner, so that a polygon far from the
/// origin loses no digits.
Vec3 newell_normal(const SurfaceMesh& mesh, const CornerList& polygon)
{
    Vec3 sum = Vec3::Zero();
    const Vec3& o = corner_at(mesh, polygon[0]);
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
        sum += (corner_at(mesh, polygon[i]) - o).cross(corner_at(mesh, polygon[i + 1]) - o);
    return sum;
}

double turn_of(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& normal)
{
    return (b - a).cross(c - a).dot(normal);
}

bool is_ear(const SurfaceMesh& mesh, const CornerList& polygon, std::size_t i, const Vec3& normal)
{
    const std::size_t n = polygon.size();
    const std::size_t before = (i + n - 1) % n, after = (i + 1) % n;
    const Vec3 &a = corner_at(mesh, polygon[before]), &b = corner_at(mesh, polygon[i]),
               &c = corner_at(mesh, polygon[after]);
    if (!(turn_of(a, b, c, normal) > 0)) return false;
    for (std::size_t j = 0; j < n; ++j) {
        if (j == before || j == i || j == after) continue;
        const Vec3& p = corner_at(mesh, polygon[j]);
        if (p == a || p == b || p == c) continue; // a polygon that touches itself at a corner
        if (turn_of(a, b, p, normal) >= 0 && turn_of(b, c, p, normal) >= 0 &&
            turn_of(c, a, p, normal) >= 0)
            return false;
    }
    return true;
}

void append_quadrilateral(SurfaceMesh& mesh, const CornerList& q)
{
    const Vec3 normal = newell_normal(mesh, q);
    const auto smaller_turn = [&](int i, int j, int k, int l) { // of the two triangles
        const auto x = [&](int c) -> const Vec3& {
            return corner_at(mesh, q[static_cast<std::size_t>(c)]);
        };
        return std::min(turn_of(x(i), x(j), x(k), normal), turn_of(x(i), x(k), x(l), normal));
    };
    const bool fits_02 = smaller_turn(0, 1, 2, 3) > 0, fits_13 = smaller_turn(1, 2, 3, 0) > 0;
    const double diagonal_02 = (corner_at(mesh, q[0]) - corner_at(mesh, q[2])).squaredNorm();
    const double diagonal_13 = (corner_at(mesh, q[1]) - corner_at(mesh, q[3])).squaredNorm();
    if (fits_02 == fits_13 ? diagonal_02 <= diagonal_13 : fits_02) {
        mesh.triangles.push_back({q[0], q[1], q[2]});
        mesh.triangles.push_back({q[0], q[2], q[3]});
    } else {
        mesh.triangles.push_back({q[1], q[2], q[3]});
        mesh.triangles.push_back({q[1], q[3], q[0]});
    }
}

void append_polygon(SurfaceMesh& mesh, CornerList polygon)
{
    if (polygon.size() == 4) return append_quadrilateral(mesh, polygon);
    const Vec3 normal = polygon.size() > 3 ? newell_normal(mesh, polygon) : Vec3::Zero();
    std::size_t i = 1, refused = 0;
    while (polygon.size() > 3 && refused < polygon.size()) {
        const std::size_t n = polygon.size();
        i %= n;
        if (!is_ear(mesh, polygon, i, normal)) {
            ++i;
            ++refused;
            continue;
        }
        mesh.triangles.push_back({polygon[(i + n - 1) % n], polygon[i], polygon[(i + 1) % n]});
        polygon.erase(polygon.begin() + static_cast<std::ptrdiff_t>(i));
        ++i; // run around, rather than cut all ears at one corner into slivers
        refused = 0;
    }
    for (std::size_t k = 1; k + 1 < polygon.size(); ++k)
        mesh.triangles.push_back({polygon[0], polygon[k], polygon[k + 1]});
}

} // namespace

void append_faces(SurfaceMesh& mesh, const PolygonList& faces, const FaceWords& words,
                  FileIssues& issues)
{
    const auto vertices = static_cast<std::int64_t>(mesh.points.size());
    mesh.triangles.reserve(mesh.triangles.size() + faces.ends.size());
    CornerList polygon;
    std::size_t begin = 0;
    for (std::size_t f = 0; f < faces.ends.size(); ++f) {
        const std::size_t end = faces.ends[f];
        const auto place = [&] {
            return std::string(words.place) + ' ' + std::to_string(faces.places[f]);
        };
        polygon.clear();
        bool valid = end - begin >= 3 && end - begin <= kMostCorners;
        if (!valid)
            issues.add(place(), "a face with " + std::to_string(end - begin) + " corners",
                       "3 to " + std::to_string(kMostCorners) + " corners");
        for (std::size_t i = begin; valid && i < end; ++i) {
            const std::int64_t corner = faces.corners[i];
            valid = corner >= 0 && corner < vertices;
            if (valid)
                polygon.push_back(static_cast<std::int32_t>(corner));
            else
                issues.add(place(), "vertex " + std::to_string(corner + words.first_index),
                           std::to_string(words.first_index) + " to " +
                               std::to_string(vertices - 1 + words.first_index));
        }
        begin = end;
        if (!valid) continue;
        if (polygon.size() == 3)
            mesh.triangles.push_back({polygon[0], polygon[1], polygon[2]});
        else
            append_polygon(mesh, polygon);
    }
}

void refuse_empty(const SurfaceMesh& mesh, FileIssues& issues)
{
    if (mesh.triangles.empty())
        issues.add(
            "", "a surface without triangles (" + std::to_string(mesh.points.size()) + " vertices)",
            "at least one face");
}

Vec3 finite_point(const Vec3& x, double scale, const std::string& place, FileIssues& issues)
{
    const Vec3 scaled = scale * x;
    if (scaled.allFinite()) return scaled;
    issues.add(place,
               "coordinates " + number_text(x[0]) + " " + number_text(x[1]) + " " +
                   number_text(x[2]) + (scale == 1 ? "" : " times " + number_text(scale)),
               "finite numbers");
    return Vec3::Zero();
}

} // namespace amontons
