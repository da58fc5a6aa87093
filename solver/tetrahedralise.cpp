#include "solver/tetrahedralise.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/text.hpp"
#include "mesh/bounding_tree.hpp"
#include "mesh/cgal/cgal_module.hpp"
#include "mesh/extract_surface.hpp"
#include "mesh/orient_surface.hpp"
#include "mesh/quality.hpp"
#include "mesh/repair_surface.hpp"
#include "mesh/small_features.hpp"
#include "mesh/split_elements.hpp"
#include "mesh/surface_check.hpp"
#include "mesh/surface_edges.hpp"
#include "mesh/volume_check.hpp"
#include "solver/module.hpp"
#include "solver/tetrahedralise_repair.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <new>
#include <optional>
#include <stdexcept>
#include <unistd.h>
#include <utility>

namespace amontons {
namespace {

// Measured on balls, cubes and tori: docs/meshing.md.
constexpr double kElementsPerCube = 22;  // in a cube of the size
constexpr double kBytesPerElement = 700; // at the peak, with the mesh that is handed out
constexpr double kBytesAtLeast = 40e6;
constexpr double kMostElements = 50e6;
constexpr double kSliverBound = 12;  // dihedral angle that elements are moved to reach [deg]
constexpr double kMostQueries = 300; // questions for the size, a vertex (15 are usual): it is stuck
constexpr double kKnife = -0.64;     // cosine between the normals of its two sides
constexpr double kFlat = 1e-6;       // dihedral angle of an element without volume [rad]
constexpr double kLeastSlope = 0.1;  // of a rounded distance: 1 where nothing is thin
constexpr int kRounds = 5;           // of halving elements where the surface touches itself
constexpr std::size_t kMostFeatures = 5; // small features that are shown
constexpr const char* kOtherSurface =
    "a surface that can be followed; a smaller --size, --deviation or --feature-angle; or --repair "
    "WIDTH, which rounds what is thinner";
constexpr const char* kOtherWidth = "a smaller --size or --deviation; another --repair WIDTH";

std::string place_of(const Vec3& x)
{
    return "at (" + number_text(x[0]) + ", " + number_text(x[1]) + ", " + number_text(x[2]) + ")";
}

/// @return  whether it passes through itself or touches itself, which `repair` allows
bool repair(SurfaceMesh& surface, const TetrahedraliseOptions& o, const std::string& file,
            std::vector<std::string>& notes)
{
    SurfaceRepair done = repair_surface(surface);
    if (o.close_holes && (done.closed_holes = close_holes(surface)) > 0) {
        const SurfaceRepair after = repair_surface(surface); // what had no inside has one now
        done.turned += after.turned;
        done.turned_parts += after.turned_parts;
        done.turned_around = done.turned_around || after.turned_around;
    }
    for (const std::string& sentence : sentences(done))
        notes.push_back(sentence);
    SurfaceRequirements required;
    required.closed = true;
    required.simple = o.repair == 0;
    const SurfaceReport report = check_surface(surface);
    std::vector<Issue> found = issues(report, surface, required, file);
    if (!report.boundaries.empty())
        found.push_back({file, "",
                         std::to_string(report.boundaries.size()) +
                             (report.boundaries.size() == 1 ? " hole" : " holes"),
                         "a surface that encloses something; --close-holes fills each with "
                         "triangles"});
    if (required.simple && report.intersection_count > 0)
        found.push_back({file, "",
                         std::to_string(report.intersection_count) +
                             " pairs of triangles that pass through each other",
                         "a surface that does not touch itself; --repair WIDTH rounds it"});
    if (surface.triangles.empty())
        found.push_back({file, "", "no triangles with an area", "a closed surface"});
    if (!found.empty()) throw InputError(std::move(found));
    if (report.intersection_count > 0)
        if (const std::int64_t turned = turn_crossing_parts(surface); turned > 0)
            notes.push_back("repaired: " + std::to_string(turned) +
                            (turned == 1 ? " part" : " parts") +
                            " that others pass through turned outwards");
    return report.intersection_count > 0;
}

/// Features below the size: sources, or an error.
SizeField field_of(const SurfaceMesh& surface, const TetrahedraliseOptions& o,
                   const std::string& file, std::vector<std::string>& notes)
{
    SizeField field(o.size, o.sources, o.gradation);
    // Where it is rounded no edge is kept, and what is thinner will be lost.
    std::vector<SmallFeature> small =
        find_small_features(surface, field, o.repair > 0 ? std::numbers::pi : o.feature_angle);
    std::erase_if(small, [&](const SmallFeature& f) { return f.extent < o.repair; });
    if (small.empty()) return field;
    std::stable_sort(small.begin(), small.end(),
                     [](const auto& a, const auto& b) { return a.extent < b.extent; });
    if (!o.refine_small) {
        std::vector<Issue> issues;
        std::map<std::string, std::size_t> of_a_kind;
        for (const SmallFeature& f : small)
            if (of_a_kind[f.what]++ < kMostFeatures)
                issues.push_back({file, place_of(f.at),
                                  std::string(f.what) + " of " + number_text(f.extent) + " m",
                                  "at least the size there, " + number_text(f.size) + " m"});
        issues.push_back({file, "", std::to_string(small.size()) + " places below the mesh size",
                          "a smaller --size, also only there (--size-at, --size-field); or "
                          "--small-features refine, which makes elements as small as they are"});
        throw InputError(std::move(issues));
    }
    std::vector<SizeSource> sources = o.sources, more = sources_of(small);
    notes.push_back("refined: " + std::to_string(small.size()) +
                    " places below the mesh size, the smallest " + std::string(small[0].what) +
                    " of " + number_text(small[0].extent) + " m " + place_of(small[0].at));
    sources.insert(sources.end(), more.begin(), more.end());
    return SizeField(o.size, std::move(sources), o.gradation);
}

struct Entries {
    decltype(amontons_cgal_tetrahedralise)* tetrahedralise;
    decltype(amontons_cgal_free)* free;
};

Entries module(const std::string& file)
{
    try {
        const Module cgal("cgal");
        return {
            cgal.function<decltype(amontons_cgal_tetrahedralise)>("amontons_cgal_tetrahedralise"),
            cgal.function<decltype(amontons_cgal_free)>("amontons_cgal_free")};
    } catch (const std::runtime_error& error) {
        throw InputError({{file, "", error.what(), "an installed CGAL module"}});
    }
}

/// The surface as the module expects it: around the origin, of size 1.
struct Scaled {
    Vec3 centre = Vec3::Zero();
    double length = 1; ///< [m]
    const SizeField* size = nullptr;
    const RoundedSolid* solid = nullptr; ///< null: the surface is meshed as it is
    double queries = 0, most = 0;

    static double at(const double* x, void* with)
    {
        auto& self = *static_cast<Scaled*>(with);
        if (++self.queries > self.most)
            throw std::runtime_error("it refines without end, most likely at a sharp angle");
        return self.size->at(self.centre + self.length * Vec3(x[0], x[1], x[2])) / self.length;
    }
    static double outside(const double* x, void* with)
    {
        const auto& self = *static_cast<const Scaled*>(with);
        return self.solid->at(self.centre + self.length * Vec3(x[0], x[1], x[2])).value;
    }
};

struct ModuleMesh {
    AmontonsCgalMesh mesh{};
    decltype(amontons_cgal_free)* free;
    ~ModuleMesh() { free(&mesh); }
};

/// Face sets from the module's triangles.
void add_patches(VolumeMesh& mesh, const AmontonsCgalMesh& from)
{
    std::map<std::array<int, 3>, int> patch;
    for (long i = 0; i < from.face_count; ++i) {
        std::array<int, 3> key{from.faces[4 * i], from.faces[4 * i + 1], from.faces[4 * i + 2]};
        std::sort(key.begin(), key.end());
        patch[key] = from.faces[4 * i + 3];
    }
    for (int i = 0; i < from.patch_count; ++i)
        mesh.face_sets.push_back({"face_" + std::to_string(i + 1), {}});
    for (const FaceRef face : mesh.face_sets[0].members) {
        const FaceNodes on = face_nodes(mesh, face);
        std::array<int, 3> key{on.node[0], on.node[1], on.node[2]};
        std::sort(key.begin(), key.end());
        if (const auto found = patch.find(key); found != patch.end())
            mesh.face_sets[static_cast<std::size_t>(found->second) + 1].members.push_back(face);
    }
    std::erase_if(mesh.face_sets, [](const FaceSet& s) { return s.members.empty(); });
}

VolumeMesh mesh_of(const AmontonsCgalMesh& from, const Scaled& scaled)
{
    VolumeMesh mesh;
    for (long i = 0; i < from.point_count; ++i)
        mesh.nodes.push_back(scaled.centre +
                             scaled.length * Eigen::Map<const Vec3>(from.points + 3 * i));
    mesh.blocks = {
        {ElementKind::T4, {from.tetrahedra, from.tetrahedra + 4 * from.tetrahedron_count}}};
    mesh.element_sets = {{"volume", {}}};
    for (std::int32_t e = 0; e < static_cast<std::int32_t>(element_count(mesh)); ++e)
        mesh.element_sets[0].members.push_back(e);
    mesh.face_sets = {{"outer", extract_surface(mesh).faces}};
    return mesh;
}

/// What a mesh must share with the surface that it fills.
struct Topology {
    int parts = 0;
    std::int64_t euler = 0;
};

Topology topology_of(const SurfaceMesh& surface) // each vertex is one of a triangle
{
    Topology of;
    for (const std::int32_t part : parts_of(surface))
        of.parts = std::max(of.parts, part + 1);
    of.euler = static_cast<std::int64_t>(surface.points.size()) -
               static_cast<std::int64_t>(sorted_half_edges(surface).size()) / 2 +
               static_cast<std::int64_t>(surface.triangles.size());
    return of;
}

/// How far two surfaces are apart, and the place where that is most of what is allowed there.
struct Departure {
    double largest = 0; ///< [m]
    double distance = 0, allowed = 0;
    Vec3 at = Vec3::Zero();

    void add(const Vec3& x, double d, double allowed_here)
    {
        largest = std::max(largest, d);
        if (d * allowed <= distance * allowed_here && allowed > 0) return;
        distance = d;
        allowed = allowed_here;
        at = x;
    }
};

/// What a mesh lost of its surface, or "" if nothing: CGAL's criteria do not guarantee it.
/// @param places  out: where its surface touches itself
std::string fault_of(const Tetrahedralised& t, const Topology& expected, const Departure& vertices,
                     const Departure& faces, std::vector<Vec3>& places)
{
    const SurfaceEdges edges = find_edges(extract_surface(t.mesh), t.mesh.nodes);
    places.clear();
    const auto node = [&](std::int32_t i) -> const Vec3& {
        return t.mesh.nodes[static_cast<std::size_t>(i)];
    };
    for (const CrowdedEdge& e : edges.crowded)
        places.push_back(0.5 * (node(e.nodes[0]) + node(e.nodes[1])));
    const VolumeReport report = check_volume(t.mesh);
    for (const std::int32_t i : report.pinched)
        places.push_back(node(i));
    if (!places.empty())
        return "a mesh whose surface touches itself at " + std::to_string(places.size()) +
               (places.size() == 1 ? " place" : " places") + ", one " + place_of(places[0]);
    if (edges.parts != expected.parts || edges.euler_characteristic != expected.euler)
        return "a mesh with " + std::to_string(edges.parts) + " outer surfaces of Euler number " +
               std::to_string(edges.euler_characteristic) +
               " (the surface: " + std::to_string(expected.parts) + " of " +
               std::to_string(expected.euler) + ")";
    for (const auto& [departure, what] :
         {std::pair{&vertices, "a vertex of the surface "}, {&faces, "a face's middle "}})
        if (departure->distance > departure->allowed)
            return what + number_text(departure->distance) + " m from the " +
                   (departure == &vertices ? "mesh, " : "surface, ") + place_of(departure->at) +
                   ", more than " + number_text(departure->allowed);
    if (!report.inverted.empty())
        return std::to_string(report.inverted.size()) + " flat or inverted elements";
    return "";
}

/// Two sides at less than 50 degrees to each other: there CGAL's refining for a manifold has no
/// end.
bool has_knife(const SurfaceMesh& surface)
{
    const auto normal = [&](std::int32_t triangle) {
        return unit_normal(surface, surface.triangles[static_cast<std::size_t>(triangle)]);
    };
    bool found = false;
    for_each_edge(sorted_half_edges(surface), [&](std::span<const HalfEdge> sides) {
        found = found || (sides.size() == 2 &&
                          normal(sides[0].triangle).dot(normal(sides[1].triangle)) < kKnife);
    });
    return found;
}

/// The least dihedral angle; 0 if an element is inverted [rad].
double least_dihedral(const VolumeMesh& mesh)
{
    double least = std::numbers::pi;
    for (const ElementQuality& q : measure_quality(mesh))
        least = std::min(least, q.volume > 0 ? q.least_dihedral : 0);
    return least;
}

/// Of points from a surface. @param allowed  of a place [m]
template <class Allowed>
Departure departure(const std::vector<Vec3>& points, const SurfaceMesh& from, Allowed allowed)
{
    const BoundingTree tree(from);
    Departure all;
    std::int32_t near = -1;
    for (const Vec3& x : points) {
        const NearestTriangle found = tree.nearest(x, near);
        near = found.triangle;
        all.add(x, std::sqrt(found.squared), allowed(x));
    }
    return all;
}

/// Of points from a rounded surface.
template <class Allowed>
Departure departure(const std::vector<Vec3>& points, const RoundedSolid& from, Allowed allowed)
{
    Departure all;
    for (const Vec3& x : points) {
        const RoundedSolid::Sample s = from.at(x);
        all.add(x, std::abs(s.value) / std::max(s.gradient.norm(), kLeastSlope), allowed(x));
    }
    return all;
}

} // namespace

void check_options(const TetrahedraliseOptions& o)
{
    std::vector<Issue> issues;
    const auto positive = [&](double value, const char* name) {
        if (!(value > 0 && std::isfinite(value)))
            issues.push_back({"", name, number_text(value), "> 0 and finite"});
    };
    positive(o.size, "--size");
    positive(o.gradation, "--gradation");
    if (o.repair != 0) positive(o.repair, "--repair");
    if (o.deviation != 0) positive(o.deviation, "--deviation");
    if (o.memory != 0) positive(o.memory / 1e9, "--memory");
    for (const SizeSource& s : o.sources) {
        positive(s.size, "a local size");
        if (!s.at.allFinite())
            issues.push_back({"", "a place of a local size", "not finite", "finite"});
    }
    if (!(o.feature_angle > 0 && o.feature_angle <= std::numbers::pi))
        issues.push_back({"", "--feature-angle",
                          number_text(o.feature_angle * 180 / std::numbers::pi),
                          "> 0 and at most 180 [degrees]"});
    if (!issues.empty()) throw InputError(std::move(issues));
}

double memory_limit(const TetrahedraliseOptions& o)
{
    return o.memory > 0 ? o.memory
                        : 0.5 * static_cast<double>(::sysconf(_SC_PHYS_PAGES)) *
                              static_cast<double>(::sysconf(_SC_PAGESIZE));
}

Tetrahedralised tetrahedralise(SurfaceMesh surface, const TetrahedraliseOptions& o,
                               const std::string& file, std::vector<std::string>& notes)
{
    check_options(o);
    Tetrahedralised result;
    const bool touches_itself = repair(surface, o, file, notes);
    const SizeField field = field_of(surface, o, file, notes);

    // ---- Prediction and limits
    result.predicted_elements = kElementsPerCube * count_by_size(surface, field);
    result.predicted_memory = kBytesAtLeast + kBytesPerElement * result.predicted_elements;
    if (o.repair > 0) result.predicted_memory += rounded_memory(surface, o.repair);
    const double limit = memory_limit(o);
    if (result.predicted_memory > limit || result.predicted_elements > kMostElements)
        throw InputError(
            {{file, "",
              "about " + number_text(std::round(result.predicted_elements)) + " elements and " +
                  number_text(std::round(result.predicted_memory)) + " bytes of memory predicted",
              "at most " + number_text(limit) + " bytes (--memory) and " +
                  number_text(kMostElements) + " elements: a larger --size" +
                  (o.repair > 0 ? " or --repair" : "")}});

    // ---- Surface in the units of the module
    Eigen::AlignedBox3d box;
    for (const Vec3& x : surface.points)
        box.extend(x);
    Scaled scaled{box.center(), box.diagonal().norm(), &field, nullptr, 0, 0};
    scaled.most = kMostQueries * (1000 + result.predicted_elements / 5);
    std::optional<RoundedSolid> solid;
    if (o.repair > 0) scaled.solid = &solid.emplace(surface, o.repair);
    const std::vector<Vec3> begin = solid ? places_on(*solid, surface, 2 * o.size) : surface.points;
    if (begin.size() < 4)
        throw InputError({{file, "", "nothing is left of the surface", "a smaller --repair"}});
    std::vector<double> points;
    for (const Vec3& x : begin)
        for (int k = 0; k < 3; ++k)
            points.push_back((x[k] - scaled.centre[k]) / scaled.length);
    std::vector<int> triangles;
    for (const auto& t : surface.triangles)
        triangles.insert(triangles.end(), t.begin(), t.end());
    const double deviation =
        o.deviation > 0 ? o.deviation : std::min(field.greatest() / 20, field.least() / 2);
    AmontonsCgalInput input{points.data(),
                            static_cast<long>(begin.size()),
                            triangles.data(),
                            static_cast<long>(surface.triangles.size()),
                            o.feature_angle * 180 / std::numbers::pi,
                            &Scaled::at,
                            &scaled,
                            deviation / scaled.length,
                            !solid && has_knife(surface) ? 0 : 1,
                            kSliverBound,
                            solid ? &Scaled::outside : nullptr};

    // ---- Tolerances of the check
    const Entries cgal = module(file);
    // CGAL examines one place of a facet: the rest, and vertices on edges that are not kept, may be
    // farther. A requested deviation is an error then.
    const auto allowed = [&](const Vec3& x) {
        return o.deviation > 0 ? 4 * deviation : std::max(4 * deviation, 0.25 * field.at(x));
    };
    const Topology expected = topology_of(surface);
    std::vector<Vec3> rounded; // the surface's vertices, where they are now
    if (solid)
        for (Vec3 x : surface.points)
            if (solid->project(x)) rounded.push_back(x);
    // CGAL can be instructed to refine until the surface is a manifold, but continues without end
    // at a knife's edge. Elements are halved where it touched itself instead, a bounded number of
    // times.
    std::vector<SizeSource> sources = field.sources();
    std::string fault;

    // ---- Fill and check, with smaller elements where it fails
    for (int round = 0; round < kRounds; ++round) {
        const SizeField now(o.size, sources, o.gradation);
        scaled.size = &now;
        scaled.queries = 0;
        ModuleMesh made{{}, cgal.free};
        char message[1000] = "";
        const auto start = std::chrono::steady_clock::now();
        const int code = cgal.tetrahedralise(&input, &made.mesh, message, sizeof message);
        if (code == 2) throw std::bad_alloc();
        if (code != 0)
            throw InputError({{file, "", std::string("CGAL does not mesh it: ") + message,
                               solid ? kOtherWidth : kOtherSurface}});
        result.seconds +=
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        result.feature_edges = made.mesh.feature_edge_count;
        result.mesh = mesh_of(made.mesh, scaled);
        if (!solid) add_patches(result.mesh, made.mesh);
        result.least_dihedral = least_dihedral(result.mesh);
        const SurfaceMesh outside = triangulate(extract_surface(result.mesh), result.mesh).mesh;
        const Departure vertices = departure(surface.points, outside, allowed),
                        faces = departure(middles(outside), surface, allowed);
        result.deviation = vertices.largest;
        result.face_deviation = faces.largest;
        std::vector<Vec3> places;
        fault = solid ? fault_of(result, touches_itself ? topology_of(outside) : expected,
                                 departure(rounded, outside, allowed),
                                 departure(middles(outside), *solid, allowed), places)
                      : fault_of(result, expected, vertices, faces, places);
        if (places.empty() && input.manifold == 0 && !fault.empty() &&
            result.least_dihedral < kFlat) {
            input.manifold = 1;
            continue;
        }
        if (places.empty()) break;
        notes.push_back("refined: the mesh's surface touched itself at " +
                        std::to_string(places.size()) + " places, one " + place_of(places[0]) +
                        ": elements are halved there");
        for (const Vec3& x : places)
            sources.push_back({x, 0.5 * now.at(x)});
    }

    // ---- Result
    if (!fault.empty())
        throw InputError({{file, "", fault + ": features below the mesh size were lost",
                           solid ? kOtherWidth : kOtherSurface}});
    if (solid) {
        for (std::string& note : repair_notes(
                 surface, triangulate(extract_surface(result.mesh), result.mesh).mesh, o.repair))
            notes.push_back(std::move(note));
        add_face_sets(result.mesh, surface, o.feature_angle);
    }
    if (o.kind == ElementKind::T10) result.mesh = with_middle_nodes(result.mesh);
    return result;
}

} // namespace amontons
