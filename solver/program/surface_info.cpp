#include "solver/program/surface_info.hpp"

#include "mesh/format/read.hpp"
#include "mesh/surface_check.hpp"
#include "mesh/weld.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/program/mesh_output.hpp"
#include "solver/program/session.hpp"
#include "solver/scene/json_text.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <fmt/format.h>
#include <numbers>

namespace amontons {
namespace {

constexpr double kPoint = 1e-9; // of the diagonal: the length of a border that is none

/// A hole as the end of a vessel.
struct SurfaceOpening {
    Vec3 centre, inwards;
    double radius = 0; ///< of the circle as long as the border [m]
    std::size_t edges = 0;
};

SurfaceOpening opening_of(const BoundaryLoop& loop, const SurfaceMesh& mesh)
{
    const auto at = [&](std::int32_t v) { return mesh.points[std::size_t(v)]; };
    Vec3 normal = Vec3::Zero();
    for (std::size_t i = 0; i < loop.vertices.size(); ++i)
        normal += (at(loop.vertices[i]) - loop.centre)
                      .cross(at(loop.vertices[(i + 1) % loop.vertices.size()]) - loop.centre);
    if (normal.norm() > 0) normal.normalize();
    // The surface lies on the inner side of its border.
    std::vector<char> is_border(mesh.points.size(), 0);
    for (const std::int32_t v : loop.vertices)
        is_border[std::size_t(v)] = 1;
    double side = 0;
    for (const auto& triangle : mesh.triangles)
        if (std::ranges::any_of(triangle, [&](auto v) { return is_border[std::size_t(v)]; }))
            for (const auto v : triangle)
                side += normal.dot(at(v) - loop.centre);
    if (side < 0) normal = -normal;
    return {loop.centre, normal, loop.length / (2 * std::numbers::pi), loop.vertices.size()};
}

void add_vector(JsonText& json, const char* name, const Vec3& x)
{
    json.key(name).open('[').value(x[0]).value(x[1]).value(x[2]).close(']');
}

std::string vector_text(const Vec3& x)
{
    return fmt::format("({:.4g}, {:.4g}, {:.4g})", x[0], x[1], x[2]);
}

} // namespace

bool is_surface_file(const std::string& file)
{
    std::string suffix = std::filesystem::path(file).extension().string();
    std::ranges::transform(suffix, suffix.begin(),
                           [](unsigned char c) { return char(std::tolower(c)); });
    return suffix == ".stl" || suffix == ".obj" || suffix == ".ply" || suffix == ".vtp";
}

void surface_info(const std::string& file, double scale, Session& session)
{
    SurfaceMesh mesh = read_surface(file, scale, read_vtp);
    weld(mesh);
    const SurfaceReport report = check_surface(mesh);
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
    double area = 0;
    for (const auto& t : mesh.triangles) {
        const Vec3 &a = mesh.points[std::size_t(t[0])], &b = mesh.points[std::size_t(t[1])],
                   &c = mesh.points[std::size_t(t[2])];
        area += 0.5 * (b - a).cross(c - a).norm();
        for (const Vec3& p : {a, b, c}) {
            low = low.cwiseMin(p);
            high = high.cwiseMax(p);
        }
    }
    std::vector<SurfaceOpening> openings;
    for (const BoundaryLoop& loop : report.boundaries) // not between vertices that coincide nearly
        if (loop.length > kPoint * report.diagonal) openings.push_back(opening_of(loop, mesh));
    const std::vector<Issue> faults = issues(report, mesh, {}, file);
    const char* const facing = report.enclosed_volume < 0 ? "inwards" : "outwards";
    const bool is_closed = openings.empty() && report.non_manifold.empty();

    if (session.json) {
        JsonText json;
        json.open('{').member("status", "ok");
        json.member("triangles", report.triangles).member("points", report.vertices);
        json.member("parts", report.components).member("closed", is_closed);
        json.key("box").open('{');
        add_vector(json, "lowest", low);
        add_vector(json, "highest", high);
        json.close('}').member("area", area);
        if (is_closed) json.member("volume", std::abs(report.enclosed_volume));
        if (is_closed) json.member("facing", facing);
        json.key("openings").open('[');
        for (const SurfaceOpening& o : openings) {
            json.open('{');
            add_vector(json, "centre", o.centre);
            add_vector(json, "inwards", o.inwards);
            json.member("radius", o.radius).member("edges", std::int64_t(o.edges)).close('}');
        }
        json.close(']');
        write_issues(json, "faults", faults);
        session.print(json.close('}').text() + "\n");
        return;
    }
    std::string t =
        fmt::format("{}: {} triangles, {} points, {} {}\n", file, report.triangles, report.vertices,
                    report.components, report.components == 1 ? "part" : "parts");
    t += fmt::format("  box      {} to {} m\n", vector_text(low), vector_text(high));
    t += fmt::format("  area     {:.6g} m^2\n", area);
    t += is_closed ? fmt::format("  closed   {:.6g} m^3, triangles face {}\n",
                                 std::abs(report.enclosed_volume), facing)
                   : fmt::format("  open     {} {}\n", openings.size(),
                                 openings.size() == 1 ? "hole" : "holes");
    for (const SurfaceOpening& o : openings)
        t += fmt::format("    at {} m, radius {:.4g} m, inwards {}, {} edges\n",
                         vector_text(o.centre), o.radius, vector_text(o.inwards), o.edges);
    session.print(t);
    session.warn(faults);
}

} // namespace amontons
