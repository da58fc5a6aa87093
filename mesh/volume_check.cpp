#include "mesh/volume_check.hpp"

#include "mesh/base/text.hpp"
#include "mesh/check_limits.hpp"
#include "mesh/near_points.hpp"
#include "mesh/neighbours.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

constexpr double kFlatElement = 1e-12; // det J / edge^3: its sign is noise

bool has_node_twice(std::span<const std::int32_t> nodes)
{
    for (std::size_t i = 1; i < nodes.size(); ++i)
        if (std::find(nodes.begin(), nodes.begin() + static_cast<std::ptrdiff_t>(i), nodes[i]) !=
            nodes.begin() + static_cast<std::ptrdiff_t>(i))
            return true;
    return false;
}

/// Both faces are run through in the same direction: their elements lie on the same side.
bool same_side(const VolumeMesh& mesh, FaceRef a, FaceRef b)
{
    const FaceNodes x = face_nodes(mesh, a), y = face_nodes(mesh, b);
    const auto n = static_cast<std::size_t>(x.corners);
    const auto at = std::find(y.node.begin(), y.node.begin() + x.corners, x.node[0]);
    const auto j = static_cast<std::size_t>(at - y.node.begin());
    return j < n && y.node[(j + 1) % n] == x.node[1];
}

template <class Member>
void check_sets(const std::vector<NamedSet<Member>>& sets, const std::string& kind,
                VolumeReport& report)
{
    for (std::size_t i = 0; i < sets.size(); ++i) {
        if (sets[i].name.empty())
            report.nameless_sets.push_back(kind + " " + std::to_string(i + 1));
        if (sets[i].members.empty())
            report.empty_sets.push_back(kind + " " + quoted_text(sets[i].name));
    }
}

void check_nodes(const VolumeMesh& mesh, VolumeReport& report)
{
    std::vector<bool> used(mesh.nodes.size());
    const auto n = static_cast<std::int32_t>(mesh.nodes.size());
    Eigen::AlignedBox3d box;
    for_each_element(mesh, [&](std::int32_t, ElementKind kind, auto nodes) {
        ++report.elements[static_cast<std::size_t>(kind)];
        for (const std::int32_t i : nodes) {
            AMONTONS_ASSERT(i >= 0 && i < n);
            used[static_cast<std::size_t>(i)] = true;
        }
    });
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
        if (!mesh.nodes[i].allFinite())
            report.not_finite.push_back(static_cast<std::int32_t>(i));
        else if (used[i])
            box.extend(mesh.nodes[i]);
        if (!used[i]) report.unreferenced.push_back(static_cast<std::int32_t>(i));
    }
    if (!box.isEmpty()) {
        report.lowest = box.min();
        report.highest = box.max();
        report.coincident = near_points(mesh.nodes, kCoincident * box.diagonal().norm());
    }
}

void check_faces(const VolumeMesh& mesh, VolumeReport& report)
{
    std::vector<FaceRef> outside;
    for_each_face(sorted_faces(mesh), [&](std::span<const SortedFace> same) {
        if (same.size() == 1) {
            outside.push_back(same[0].face);
            return;
        }
        if (same.size() == 2 && !same_side(mesh, same[0].face, same[1].face)) return;
        std::vector<FaceRef> faces;
        for (const SortedFace& f : same)
            faces.push_back(f.face);
        (same.size() == 2 ? report.one_sided : report.crowded_faces).push_back(std::move(faces));
    });
    report.surface = surface_of(mesh, outside);
    SurfaceEdges edges = find_edges(report.surface, mesh.nodes);
    report.crowded_edges = std::move(edges.crowded);
    report.surface_edges =
        static_cast<std::int64_t>(edges.edges.size() + report.crowded_edges.size());
    report.surface_borders = edges.borders;
    report.surface_parts = edges.parts;
    report.euler_characteristic = edges.euler_characteristic;
    report.integrals = integrate(report.surface, mesh);
}

/// Nodes on the surface whose elements fall apart without them. A pair of elements at a node hangs
/// together if it shares another node; edges that elements share wrongly are crowded_edges.
void check_joints(const VolumeMesh& mesh, VolumeReport& report)
{
    const Lists at_node = elements_at_nodes(mesh);
    std::vector<std::int32_t> owner(mesh.nodes.size(), -1); // first element of this node's list
    std::vector<std::int32_t> group;
    const auto root = [&](std::int32_t i) {
        while (group[static_cast<std::size_t>(i)] != i)
            i = group[static_cast<std::size_t>(i)];
        return i;
    };
    for (const std::int32_t node : report.surface.used_nodes) {
        const std::span<const std::int32_t> elements = at_node.of(node);
        const auto n = static_cast<std::int32_t>(elements.size());
        group.resize(elements.size());
        std::int32_t groups = n;
        for (std::int32_t i = 0; i < n; ++i) {
            group[static_cast<std::size_t>(i)] = i;
            for (const std::int32_t other :
                 element_of(mesh, elements[static_cast<std::size_t>(i)]).nodes) {
                if (other == node) continue;
                std::int32_t& first = owner[static_cast<std::size_t>(other)];
                if (first < 0) {
                    first = i;
                } else if (const std::int32_t a = root(first), b = root(i); a != b) {
                    group[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
                    --groups;
                }
            }
        }
        for (const std::int32_t e : elements)
            for (const std::int32_t other : element_of(mesh, e).nodes)
                owner[static_cast<std::size_t>(other)] = -1;
        if (groups > 1) report.pinched.push_back(node);
    }
}

// ---- messages ----------------------------------------------------------------------------

/// Names the first faults of a kind and counts the others.
template <class Faults, class Place, class Found>
void add(std::vector<Issue>& issues, const std::string& file, const Faults& faults,
         const std::string& allowed, Place place, Found found)
{
    for (std::size_t i = 0; i < std::min(faults.size(), kMostNamed); ++i)
        issues.push_back({file, place(faults[i]), found(faults[i]), allowed});
    if (faults.size() > kMostNamed)
        issues.push_back(
            {file, "", std::to_string(faults.size() - kMostNamed) + " more of this", allowed});
}

/// The words of messages about a mesh.
struct Words {
    const VolumeReport& report;
    const VolumeMesh& mesh;

    std::string at(std::int32_t node) const
    {
        return place_text(mesh.nodes[static_cast<std::size_t>(node)]);
    }
    std::string node(std::int32_t i) const { return node_place(mesh, i); }
    std::string element(std::int32_t i) const
    {
        const ElementView e = element_of(mesh, i);
        return element_place(mesh, i) + " (" + shape_of(e.kind).name + " at " + at(e.nodes[0]) +
               ")";
    }
    std::string elements(const std::vector<FaceRef>& faces) const
    {
        std::string text;
        for (std::size_t i = 0; i < std::min<std::size_t>(faces.size(), 5); ++i)
            text.append(i > 0 ? ", " : "").append(element_place(mesh, faces[i].element));
        return text + (faces.size() > 5 ? ", ..." : "");
    }
    std::string corners(const std::vector<FaceRef>& faces) const
    {
        const FaceNodes on = face_nodes(mesh, faces[0]);
        std::string text = "face";
        for (int i = 0; i < on.corners; ++i)
            text.append(" ").append(at(on.node[static_cast<std::size_t>(i)]));
        return text;
    }
    const ElementQuality& quality(std::int32_t i) const
    {
        return report.element_quality[static_cast<std::size_t>(i)];
    }
};

void add_coincident(std::vector<Issue>& issues, const std::string& file, const VolumeReport& report,
                    const Words& words)
{
    add(
        issues, file, report.coincident, "one node at a place, unless bodies may separate there",
        [&](const auto& pair) { return words.node(pair[1]); },
        [&](const auto& pair) {
            return "the place of " + words.node(pair[0]) + ", " + words.at(pair[1]);
        });
}

} // namespace

bool VolumeReport::touches_itself() const
{
    return !crowded_edges.empty() || !pinched.empty();
}

bool VolumeReport::resembles_millimetres() const
{
    return (highest - lowest).maxCoeff() > options.largest_size;
}

VolumeReport check_volume(const VolumeMesh& mesh, const VolumeCheckOptions& options)
{
    VolumeReport report;
    report.options = options;
    report.nodes = static_cast<std::int64_t>(mesh.nodes.size());
    check_nodes(mesh, report);
    check_sets(mesh.node_sets, "node set", report);
    check_sets(mesh.element_sets, "element set", report);
    check_sets(mesh.face_sets, "face set", report);
    check_faces(mesh, report);
    check_joints(mesh, report);
    report.element_quality = measure_quality(mesh);
    report.quality = report_of(report.element_quality);
    for_each_element(mesh, [&](std::int32_t e, ElementKind, auto nodes) {
        const ElementQuality& q = report.element_quality[static_cast<std::size_t>(e)];
        const double noise = kFlatElement * q.longest_edge * q.longest_edge * q.longest_edge;
        if (has_node_twice(nodes))
            report.collapsed.push_back(e);
        else if (!(q.least_jacobian > noise)) // also if it is not a number
            report.inverted.push_back(e);
        else if (!(q.shape >= options.sliver))
            report.slivers.push_back(e);
    });
    return report;
}

std::vector<Issue> errors_of(const VolumeReport& report, const VolumeMesh& mesh,
                             const std::string& file)
{
    std::vector<Issue> all;
    const Words words{report, mesh};
    const auto element = [&](std::int32_t e) { return words.element(e); };
    add(
        all, file, report.not_finite, "finite coordinates",
        [&](std::int32_t n) { return words.node(n); },
        [&](std::int32_t n) { return "coordinates " + words.at(n); });
    add(all, file, report.collapsed, "different nodes", element,
        [](std::int32_t) { return std::string("a node that is used twice"); });
    add(all, file, report.inverted,
        "det J > 0 at every corner and integration point (node order as in docs/mesh_formats.md)",
        element, [&](std::int32_t e) {
            return "an inverted element, least det J " +
                   number_text(words.quality(e).least_jacobian) + " m^3";
        });
    add(
        all, file, report.crowded_faces, "one or two elements at a face",
        [&](const auto& faces) { return words.corners(faces); },
        [&](const auto& faces) {
            return std::to_string(faces.size()) + " elements (" + words.elements(faces) + ")";
        });
    add(
        all, file, report.one_sided, "elements on both sides of it",
        [&](const auto& faces) { return words.corners(faces); },
        [&](const auto& faces) {
            return "two elements that overlap (" + words.elements(faces) + ")";
        });
    add(
        all, file, report.crowded_edges, "two faces of the surface at an edge",
        [&](const CrowdedEdge& e) {
            return "edge " + words.at(e.nodes[0]) + " " + words.at(e.nodes[1]);
        },
        [&](const CrowdedEdge& e) {
            return std::to_string(e.faces.size()) + " faces of the surface";
        });
    add(
        all, file, report.pinched, "elements that share an edge or a face",
        [&](std::int32_t n) { return words.node(n); },
        [&](std::int32_t n) { return "elements that share this node only, " + words.at(n); });
    if (report.touches_itself()) add_coincident(all, file, report, words);
    return all;
}

std::vector<Issue> warnings_of(const VolumeReport& report, const VolumeMesh& mesh,
                               const std::string& file)
{
    std::vector<Issue> all;
    const Words words{report, mesh};
    all = size_warnings(Vec3(report.highest - report.lowest), file, report.options.largest_size);
    add(
        all, file, report.unreferenced, "nodes of elements",
        [&](std::int32_t n) { return words.node(n); },
        [&](std::int32_t n) { return "a node of no element at " + words.at(n); });
    if (!report.touches_itself()) add_coincident(all, file, report, words);
    add(
        all, file, report.slivers,
        "shape >= " + number_text(report.options.sliver) +
            " (T4, T10: mean ratio; H8: scaled Jacobian; 1 is best)",
        [&](std::int32_t e) { return words.element(e); },
        [&](std::int32_t e) { return "a sliver of shape " + number_text(words.quality(e).shape); });
    const auto itself = [](const std::string& name) { return name; };
    add(all, file, report.empty_sets, "members", itself,
        [](const std::string&) { return std::string("nothing in it"); });
    add(all, file, report.nameless_sets, "a name", itself,
        [](const std::string&) { return std::string("no name"); });
    return all;
}

} // namespace amontons
