#include "solver/obstacle/build.hpp"

#include "mesh/base/error.hpp"
#include "mesh/format/read.hpp"
#include "mesh/generate/ball.hpp"
#include "mesh/generate/cylinder.hpp"
#include "mesh/generate/plane.hpp"
#include "mesh/generate/tube.hpp"
#include "mesh/generate/vessel.hpp"
#include "mesh/orient_surface.hpp"
#include "mesh/repair_surface.hpp"
#include "mesh/size_check.hpp"
#include "mesh/surface_check.hpp"
#include "mesh/surface_edges.hpp"
#include "mesh/surface_wall.hpp"
#include "solver/module.hpp"
#include "solver/output/vtk/vtk_module.hpp"
#include "solver/scene/findings.hpp"
#include "solver/scene/read.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <stdexcept>
#include <unordered_map>

namespace amontons {

SurfaceMesh read_vtp(const std::string& path)
{
    const auto refuse = [&](const std::string& found, const std::string& allowed) {
        throw InputError({{path, "", found, allowed}});
    };
    double* points = nullptr;
    int* triangles = nullptr;
    long point_count = 0, triangle_count = 0;
    char message[500] = "";
    try {
        const Module vtk("vtk");
        const auto read =
            vtk.function<decltype(amontons_vtk_read_surface)>("amontons_vtk_read_surface");
        const auto release = vtk.function<decltype(amontons_vtk_free)>("amontons_vtk_free");
        if (read(path.c_str(), &points, &point_count, &triangles, &triangle_count, message,
                 sizeof message) != 0)
            refuse(message, "a surface in VTK's XML format");
        SurfaceMesh mesh;
        for (long i = 0; i < point_count; ++i)
            mesh.points.emplace_back(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
        for (long i = 0; i < triangle_count; ++i)
            mesh.triangles.push_back(
                {triangles[3 * i], triangles[3 * i + 1], triangles[3 * i + 2]});
        release(points);
        release(triangles);
        return mesh;
    } catch (const InputError&) {
        throw;
    } catch (const std::runtime_error& error) {
        refuse(error.what(), "an STL, OBJ or PLY file, which need no module");
    }
    return {};
}

namespace {

/// A spline through points of a file, which its Issues name.
Centreline spline(const std::vector<Vec3>& points, const std::vector<double>& radius,
                  const std::string& path)
{
    try {
        return make_spline(points, radius);
    } catch (const InputError& error) {
        std::vector<Issue> found = error.issues();
        for (Issue& issue : found)
            issue.file = path;
        throw InputError(std::move(found));
    }
}

} // namespace

Centreline build_centreline(const SurfaceInput& s, const Scene& scene)
{
    const CentrelineInput& c = s.centreline;
    if (c.file.empty()) {
        Centreline line(c.start, c.direction, c.normal, s.radius);
        for (const CentrelinePiece& p : c.pieces) {
            if (p.radius > 0)
                line.append_arc(p.radius, p.angle, p.direction, s.radius);
            else
                line.append_line(p.length, s.radius);
        }
        return line;
    }
    const std::string path = beside(scene, c.file);
    const Polyline points = read_centreline(path, c.scale > 0 ? c.scale : default_scale(path));
    std::vector<double> radius = points.radius;
    if (s.radius > 0) radius.assign(points.points.size(), s.radius);
    if (radius.size() != points.points.size())
        throw InputError(
            {{path, "", "no radius", "a radius at each point, or \"radius\" in the scene"}});
    return spline(points.points, radius, path);
}

namespace {

VesselOptions vessel_options(const SurfaceInput& s)
{
    VesselOptions v;
    v.inlet = s.centre;
    v.axis = s.axis;
    v.arch_towards = s.arch_towards;
    v.descending_length = s.descending_length;
    v.arch_radius = s.arch_radius;
    v.arch_angle = s.arch_angle;
    v.ascending_length = s.ascending_length;
    v.ascending_diameter = s.ascending_diameter;
    for (std::size_t end = 0; end < 2; ++end) {
        v.descending_diameter[end] = s.descending_diameter[end];
        v.arch_diameter[end] = s.arch_diameter[end];
    }
    for (const BranchInput& b : s.branches)
        v.branches.push_back({b.name, b.at, b.diameter[0], b.diameter[1], b.length, b.angle});
    v.blend = s.blend;
    v.resolution = s.resolution;
    return v;
}

WallModel wall_from_file(const ObstacleInput& o, const Scene& scene, std::vector<Issue>* warnings)
{
    const std::string path = beside(scene, o.surface.file);
    SurfaceMesh mesh = read_surface(path, o.surface.scale.x(), read_vtp);
    stretch_axes(mesh.points, o.surface.scale);
    orient_consistently(mesh); // files that mix both sides are common, and this mends them
    SurfaceReport report = check_surface(mesh);
    if (!report.degenerate.empty()) { // marching cubes make some
        const SurfaceRepair repair = repair_surface(mesh);
        if (repair.turned_around) turn_around(mesh); // its side is the file's
        if (warnings)
            warnings->push_back({path, "",
                                 fmt::format("{} triangles without area, which were left out",
                                             report.degenerate.size()),
                                 "triangles with an area (amontons mesh surface --repair)"});
        report = check_surface(mesh);
    }
    std::vector<Issue> found = issues(report, mesh, SurfaceRequirements{}, path);
    if (!found.empty()) throw InputError(std::move(found));
    if (warnings)
        for (Issue& odd : size_warnings(mesh.points, path))
            warnings->push_back(std::move(odd));
    try {
        return make_wall_from_surface(std::move(mesh), o.side);
    } catch (const InputError& error) {
        found = error.issues();
        for (Issue& issue : found)
            if (issue.file.empty()) issue.file = path;
        throw InputError(std::move(found));
    }
}

/// The points of a branch's centreline, with the radii that it has.
Polyline line_of(const CentrelineInput& c, const Scene& scene)
{
    if (!c.file.empty()) {
        const std::string path = beside(scene, c.file);
        Polyline line = read_centreline(path, c.scale > 0 ? c.scale : default_scale(path));
        if (line.points.size() < 2)
            throw InputError({{path, "", "a centreline of one point", "at least two points"}});
        return line;
    }
    constexpr int kPoints = 200;
    SurfaceInput s;
    s.centreline = c;
    s.radius = 1e-9; // no tube: bends of any radius
    const Centreline curve = build_centreline(s, scene);
    Polyline line;
    for (int i = 0; i <= kPoints; ++i)
        line.points.push_back(curve.at(curve.length() * i / kPoints).position);
    return line;
}

/// Names of the scene for parts of a vessel, and of the openings that they lead to.
void add_named_branches(const ObstacleInput& o, const Scene& scene, WallModel& model)
{
    for (const NamedBranchInput& b : o.surface.named_branches) {
        Branch branch;
        branch.name = b.name;
        if (b.ball.given) {
            branch.kind = Branch::ball;
            branch.centreline = {b.ball.centre};
            branch.radius = {b.ball.radius};
        } else if (b.box.given) {
            branch.kind = Branch::box;
            branch.centreline = {b.box.from, b.box.to};
        } else {
            branch.kind = Branch::line;
            Polyline line = line_of(b.centreline, scene);
            branch.centreline = std::move(line.points);
            branch.radius = std::move(line.radius);
            WallHint hint;
            for (std::size_t i = branch.radius.size(); i < branch.centreline.size(); ++i)
                branch.radius.push_back(
                    std::max(0.0, model.wall.distance(branch.centreline[i], hint)));
        }
        if (branch.kind == Branch::line &&
            *std::max_element(branch.radius.begin(), branch.radius.end()) <= 0)
            throw InputError({{scene.file, "/bodies/" + o.name + "/surface/branches: " + b.name,
                               "a centreline outside of the free space", "one in the vessel"}});
        model.branches.push_back(std::move(branch));
    }
    if (o.surface.named_branches.empty()) return;
    for (Opening& opening : model.openings)
        if (const std::string name =
                branch_at(model, opening.centre - 0.5 * opening.radius * opening.outward);
            !name.empty())
            opening.name = name;
}

WallModel wall_model(const ObstacleInput& o, const Scene& scene, std::vector<Issue>* warnings)
{
    const SurfaceInput& s = o.surface;
    if (s.generate == "tube") return make_tube({build_centreline(s, scene), s.resolution});
    if (s.generate == "ball")
        return make_ball({s.centre, s.radius, o.side == "inside", s.resolution});
    if (s.generate == "cylinder") {
        CylinderOptions options;
        options.point = s.centre;
        options.axis = s.axis;
        options.radius = s.radius;
        options.inside = o.side == "inside";
        return make_cylinder(options);
    }
    if (s.generate == "plane") {
        PlaneOptions options;
        options.point = s.centre;
        options.normal = s.axis;
        return make_plane(options);
    }
    if (s.generate == "vessel") return make_vessel(vessel_options(s));
    return wall_from_file(o, scene, warnings);
}

} // namespace

std::vector<Obstacle> build_obstacles(const Scene& scene, std::vector<Issue>* warnings)
{
    std::vector<Issue> issues;
    std::vector<Obstacle> obstacles;
    for (const ObstacleInput& o : scene.obstacles) {
        try {
            obstacles.push_back({o.name, wall_model(o, scene, warnings)});
            add_named_branches(o, scene, obstacles.back().model);
        } catch (const InputError& error) {
            const std::string body = "/bodies/" + o.name;
            for (Issue issue : error.issues()) { // a generator has no JSON paths of its numbers
                if (issue.place == "/side") {
                    issue.file = scene.file;
                    issue.place = body + "/side";
                } else if (issue.file.empty()) {
                    issue.file = scene.file;
                    const bool path = issue.place.empty() || issue.place.front() == '/';
                    issue.place = body + "/surface" + (path ? "" : ": ") + issue.place;
                }
                issues.push_back(std::move(issue));
            }
        }
    }
    if (!issues.empty()) throw InputError(std::move(issues));
    return obstacles;
}

namespace {

/// Fans over the borders of a surface, whose faults are known by now; how many there are.
std::int64_t fill_borders(SurfaceMesh& mesh)
{
    std::unordered_map<std::int32_t, std::int32_t> next; // against the triangles' sense
    for_each_edge(sorted_half_edges(mesh), [&](std::span<const HalfEdge> sides) {
        if (sides.size() == 1) next[sides[0].end] = sides[0].begin;
    });
    std::int64_t holes = 0;
    while (!next.empty()) {
        const auto centre = static_cast<std::int32_t>(mesh.points.size());
        const std::size_t first = mesh.triangles.size();
        Vec3 sum = Vec3::Zero();
        for (auto step = next.begin(); step != next.end();) {
            const auto [from, to] = *step;
            sum += mesh.points[static_cast<std::size_t>(from)];
            mesh.triangles.push_back({from, to, centre});
            next.erase(step);
            step = next.find(to);
        }
        mesh.points.emplace_back(sum / static_cast<double>(mesh.triangles.size() - first));
        ++holes;
    }
    return holes;
}

} // namespace

SurfaceFacts surface_facts(const ObstacleInput& input, const Obstacle& obstacle)
{
    SurfaceFacts f;
    f.triangles = static_cast<std::int64_t>(*obstacle.model.triangle_count);
    if (input.surface.generate == "vessel") {
        f.side = "inside";
        f.holes = static_cast<std::int64_t>(obstacle.model.openings.size());
        return f;
    }
    if (input.surface.generate == "plane") return f;
    SurfaceMesh mesh = *obstacle.model.surface;
    // Normals point into the free space: outwards of what they enclose, if that is around it.
    f.holes = fill_borders(mesh);
    const double volume = enclosed_volume(mesh);
    f.side = volume > 0 ? "outside" : "inside";
    f.volume = std::abs(volume);
    return f;
}

std::string side_hint(const Scene& scene, const Obstacle& obstacle)
{
    const ObstacleInput* input = body_named(scene.obstacles, obstacle.name);
    if (!input || input->side == "inside" || input->surface.generate == "plane" ||
        input->surface.generate == "tube" || input->surface.generate == "vessel" ||
        surface_facts(*input, obstacle).side != "outside")
        return "";
    return input->side.empty() && input->surface.generate.empty()
               ? "; the orientation of the surface of " + obstacle.name +
                     " puts the free space outside: \"side\": \"inside\" of it is the other way"
               : "; the free space of " + obstacle.name +
                     " is outside: \"side\": \"inside\" of it is the other way";
}

double DepthLine::depth(const Vec3& x) const
{
    return line ? sign * (line->arc_length(line->nearest(x, -1)) - start) : 0;
}

namespace {

/// Puts an introducer at an end of the centreline of a branch, along it.
void place_in_branch(const Scene& scene, IntroducerInput& introducer)
{
    std::vector<Vec3> line;
    for (const ObstacleInput& o : scene.obstacles) {
        for (const NamedBranchInput& b : o.surface.named_branches)
            if (b.name == introducer.branch && b.has_line())
                line = line_of(b.centreline, scene).points;
        for (const BranchInput& b : o.surface.branches)
            if (b.name == introducer.branch)
                for (const Branch& made : make_vessel(vessel_options(o.surface)).branches)
                    if (made.name == b.name) line = made.centreline;
    }
    if (introducer.end != "start") std::reverse(line.begin(), line.end());
    std::size_t next = 1;
    while (next + 1 < line.size() && !((line[next] - line[0]).norm() > 0))
        ++next;
    introducer.at = line[0];
    introducer.direction = (line[next] - line[0]).normalized();
}

/// What the scene specifies across the direction that the centreline gave.
void check_placed(const Scene& scene, const BeamInput& beam, std::vector<Issue>& issues)
{
    const Vec3& d = beam.introducer.direction;
    const std::string along = fmt::format(
        "the direction ({:.4g}, {:.4g}, {:.4g}) that the centreline gives", d.x(), d.y(), d.z());
    if (beam.introducer.normal &&
        !(d.normalized().cross(beam.introducer.normal->normalized()).norm() > kInputRoundOff))
        issues.push_back({scene.file, "/bodies/" + beam.name + "/introducer/normal",
                          "parallel to " + along, "another direction"});
    if (beam.plane && std::abs(d.normalized().dot(beam.plane->normalized())) > kInputRoundOff)
        issues.push_back({scene.file, "/bodies/" + beam.name + "/plane",
                          "a plane that the introducer leaves", "a normal across " + along});
}

} // namespace

std::vector<DepthLine> place_introducers(Scene& scene)
{
    std::vector<Issue> issues;
    std::vector<DepthLine> lines;
    for (BeamInput& beam : scene.beams) {
        DepthLine& depth = lines.emplace_back();
        depth.beam = beam.name;
        if (!beam.introducer.branch.empty()) {
            try {
                place_in_branch(scene, beam.introducer);
                check_placed(scene, beam, issues);
            } catch (const InputError& error) {
                issues.insert(issues.end(), error.issues().begin(), error.issues().end());
            }
            continue;
        }
        IntroducerPlace& place = beam.introducer.centreline;
        if (place.file.empty()) continue;
        if (beam.introducer.end == "end") place.reverse = true;
        const std::string path = beside(scene, place.file);
        try {
            const Polyline points =
                read_centreline(path, place.scale > 0 ? place.scale : default_scale(path));
            const std::vector<double> any_radius(points.points.size(), 1.0);
            depth.line = spline(points.points, any_radius, path);
        } catch (const InputError& error) {
            issues.insert(issues.end(), error.issues().begin(), error.issues().end());
            continue;
        }
        const double length = depth.line->length();
        if (place.along >= length) {
            issues.push_back({scene.file, "/bodies/" + beam.name + "/introducer/centreline/along",
                              std::to_string(place.along),
                              "< " + std::to_string(length) + " [m], the centreline's length"});
            continue;
        }
        depth.sign = place.reverse ? -1 : 1;
        depth.start = place.reverse ? length - place.along : place.along;
        const CurvePoint end = depth.line->at(depth.start);
        beam.introducer.at = end.position;
        beam.introducer.direction = depth.sign * end.tangent;
        check_placed(scene, beam, issues);
    }
    if (!issues.empty()) throw InputError(std::move(issues));
    return lines;
}

bool any_depth_line(const std::vector<DepthLine>& lines)
{
    return std::any_of(lines.begin(), lines.end(),
                       [](const DepthLine& l) { return l.line.has_value(); });
}

void add_centreline_depths(StepRecord& record, const std::vector<DepthLine>& lines)
{
    for (const DepthLine& l : lines) {
        if (!l.line) continue;
        const auto of = std::ranges::find(record.beams, l.beam, &BeamRecord::name);
        if (of != record.beams.end() && !of->points.empty())
            record.quantities.push_back(
                {l.beam + "_centreline_depth", "m", l.depth(of->points.back())});
    }
}

} // namespace amontons
