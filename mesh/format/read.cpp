#include "mesh/format/read.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"
#include "mesh/format/csv.hpp"
#include "mesh/format/obj.hpp"
#include "mesh/format/ply.hpp"
#include "mesh/format/polygon.hpp"
#include "mesh/format/slicer_markups.hpp"
#include "mesh/format/stl.hpp"
#include "mesh/size_field.hpp"
#include "mesh/suffix.hpp"
#include "mesh/weld.hpp"

#include <cmath>

namespace amontons {
namespace {

bool is_table(const std::string& path)
{
    return has_suffix(path, ".csv") || has_suffix(path, ".txt") || has_suffix(path, ".dat");
}

void check_scale(const std::string& path, double scale)
{
    if (!(scale > 0 && std::isfinite(scale)))
        FileIssues(path).fatal("", "scale " + number_text(scale), "> 0 and finite [m per unit]");
}

SurfaceMesh scaled(SurfaceMesh mesh, const std::string& path, double scale)
{
    FileIssues issues(path);
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
        mesh.points[i] = finite_point(mesh.points[i], scale, "vertex " + std::to_string(i), issues);
    refuse_empty(mesh, issues);
    issues.throw_if_any();
    return mesh;
}

} // namespace

SurfaceMesh read_surface(const std::string& path, double scale, const VtpReader& vtp,
                         std::int64_t* merged)
{
    check_scale(path, scale);
    SurfaceMesh mesh;
    if (has_suffix(path, ".stl"))
        mesh = parse_stl(read_file(path), path, scale);
    else if (has_suffix(path, ".obj"))
        mesh = parse_obj(read_file(path), path, scale);
    else if (has_suffix(path, ".ply"))
        mesh = parse_ply(read_file(path), path, scale);
    else if (has_suffix(path, ".vtp") && vtp)
        mesh = scaled(vtp(path), path, scale);
    else if (has_suffix(path, ".vtp"))
        refuse_suffix(path, ".stl, .obj or .ply: this program has no VTK module for .vtp");
    else
        refuse_suffix(path, std::string(vtp ? ".stl, .obj, .ply or .vtp" : ".stl, .obj or .ply") +
                                suffix_hint(path, false));
    const std::size_t vertices = mesh.points.size();
    weld(mesh);
    if (merged)
        *merged =
            has_suffix(path, ".stl") ? 0 : static_cast<std::int64_t>(vertices - mesh.points.size());
    return mesh;
}

Polyline read_centreline(const std::string& path, double scale)
{
    check_scale(path, scale);
    if (has_suffix(path, ".mrk.json")) return parse_slicer_markups(read_file(path), path, scale);
    if (is_table(path)) return parse_centreline_csv(read_file(path), path, scale);
    refuse_suffix(path, ".csv, .txt, .dat or .mrk.json");
}

std::vector<SizeSource> read_size_field(const std::string& path, double scale)
{
    if (is_table(path)) {
        check_scale(path, scale);
        return parse_size_field_csv(read_file(path), path, scale);
    }
    const Polyline line = read_centreline(path, scale);
    if (line.radius.empty())
        FileIssues(path).fatal("", "points without a radius", "a centreline with its radius");
    std::vector<SizeSource> sources;
    for (std::size_t i = 0; i < line.points.size(); ++i)
        sources.push_back({line.points[i], line.radius[i]});
    return sources;
}

double default_scale(const std::string& path)
{
    return has_suffix(path, ".mrk.json") ? 1e-3 : 1;
}

void write_surface(const std::string& path, const SurfaceMesh& mesh)
{
    if (has_suffix(path, ".stl"))
        write_file(path, stl_bytes(mesh));
    else if (has_suffix(path, ".obj"))
        write_file(path, obj_text(mesh));
    else if (has_suffix(path, ".ply"))
        write_file(path, ply_bytes(mesh));
    else
        refuse_suffix(path, ".stl, .obj or .ply");
}

} // namespace amontons
