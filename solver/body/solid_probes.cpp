#include "solver/body/solid_probes.hpp"

#include "mesh/base/file.hpp"
#include "mesh/format/columns.hpp"
#include "solver/solid/assembly.hpp"
#include "solver/solid/face_load.hpp"
#include "solver/solid/place_in.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fmt/format.h>
#include <limits>

namespace amontons {
namespace {

/// The element around a place. @return  whether there is one
bool find_place(const VolumeMesh& mesh, const Vec3& at, ProbeInput::Found& found)
{
    constexpr double kOnBorder = 1e-6; // of an element: round-off of places on its faces
    PlaceIn best;
    for_each_element(mesh, [&](std::int32_t e, ElementKind kind, auto nodes) {
        const ElementPlaces X = places_of(mesh, nodes);
        const Vec3 room = 0.1 * (X.rowwise().maxCoeff() - X.rowwise().minCoeff());
        if (((X.rowwise().minCoeff() - room - at).array() > 0).any() ||
            ((at - X.rowwise().maxCoeff() - room).array() > 0).any())
            return;
        const PlaceIn p = place_in(kind, X, at);
        if (!(p.outside < best.outside) || best.outside <= 0) return;
        best = p;
        found.element = e;
        found.xi = p.xi;
        const ShapeValues N = shape_values(kind, p.xi);
        found.nodes.assign(nodes.begin(), nodes.end());
        found.weights.assign(N.data(), N.data() + N.size());
    });
    return best.outside <= kOnBorder;
}

std::string place_text(const Vec3& x)
{
    return fmt::format("[{:g}, {:g}, {:g}]", x[0], x[1], x[2]);
}

constexpr const char* kPlaceAllowed = "a place in the mesh, before it is placed by \"start\"";

/// "stress_xx [Pa]" -> "stress_xx"
std::string without_unit(const std::string& column)
{
    return column.substr(0, column.find(" ["));
}

/// Reads the reference of a line, and finds its places.
void place_line(ProbeInput& probe, const VolumeMesh& mesh, const std::string& file,
                const std::string& here, std::vector<Issue>& issues)
{
    constexpr double kBeyond = 1e-9; // of the line's length
    const std::string path =
        (std::filesystem::path(file).parent_path() / probe.line.reference).string();
    const Columns table = parse_columns(read_file(path), path);
    const auto refuse = [&](std::string place, std::string found, std::string allowed) {
        issues.push_back({path, std::move(place), std::move(found), std::move(allowed)});
    };
    probe.along.clear();
    probe.fields.clear();
    std::vector<std::string> known(std::begin(kProbeFields), std::end(kProbeFields));
    std::string all;
    for (const std::string& name : known)
        all += (all.empty() ? "one of " : ", ") + name;
    for (std::size_t k = 1; k < table.names.size(); ++k) {
        const std::string name = without_unit(table.names[k]);
        if (std::ranges::find(known, name) == known.end())
            refuse("", "column " + quoted_text(table.names[k]), all);
        probe.fields.emplace_back(name, table.values[k]);
        double size = 0;
        for (const double v : table.values[k])
            size = std::max(size, std::isfinite(v) ? std::abs(v) : HUGE_VAL);
        if (!(size > 0 && std::isfinite(size)))
            refuse("", "column " + quoted_text(table.names[k]) + " without numbers but 0",
                   "numbers in every row, not all 0: errors are relative to them");
    }
    if (table.names.size() < 2 || table.values.front().size() < 2)
        refuse("", "no field along the line", "a distance [m] and fields, two rows or more");
    const Vec3 way = probe.line.to - probe.line.from;
    double before = -HUGE_VAL;
    for (const double s : table.names.empty() ? std::vector<double>() : table.values.front()) {
        if (!(s > before) || !(s >= 0) || !(s <= way.norm() * (1 + kBeyond))) {
            refuse("", fmt::format("distance {:g}", s),
                   fmt::format("0 to {:g} [m], increasing", way.norm()));
            break;
        }
        before = s;
        ProbeInput::Place place;
        place.s = s;
        const Vec3 at = probe.line.from + s * way.normalized();
        if (!find_place(mesh, at, place.found)) {
            issues.push_back({file, here + "/line", place_text(at), kPlaceAllowed});
            break;
        }
        probe.along.push_back(std::move(place));
    }
}

} // namespace

void place_probes(SolidInput& input, const VolumeMesh& mesh, const std::string& file)
{
    std::vector<Issue> issues;
    for (ProbeInput& probe : input.probes) {
        const std::string here = "/bodies/" + input.name + "/probes/" + probe.name;
        probe.found = {};
        if (probe.line.given) {
            place_line(probe, mesh, file, here, issues);
            continue;
        }
        if (probe.at) {
            if (!find_place(mesh, *probe.at, probe.found))
                issues.push_back({file, here + "/at", place_text(*probe.at), kPlaceAllowed});
            continue;
        }
        if (const FaceSet* faces = find_set(mesh.face_sets, probe.set);
            faces && !faces->members.empty()) {
            Eigen::VectorXd area = Eigen::VectorXd::Zero(3 * Eigen::Index(mesh.nodes.size()));
            add_traction(mesh, faces->members, Vec3::UnitX(), area);
            probe.found.area = area.sum();
            for (const std::int32_t node : nodes_of(mesh, *faces)) {
                probe.found.nodes.push_back(node);
                probe.found.weights.push_back(area[3 * node] / probe.found.area);
            }
            for (const FaceRef& face : faces->members) {
                const FaceNodes of_face = face_nodes(mesh, face);
                Eigen::Matrix3Xd X(3, of_face.count);
                for (int k = 0; k < of_face.count; ++k)
                    X.col(k) = mesh.nodes[std::size_t(of_face.node[std::size_t(k)])];
                probe.found.behind.emplace_back(face.element,
                                                traction_forces(X, Vec3::UnitX()).row(0).sum() /
                                                    probe.found.area);
            }
        } else if (const NodeSet* set = find_set(mesh.node_sets, probe.set);
                   set && !set->members.empty()) {
            probe.found.nodes = set->members;
            probe.found.weights.assign(set->members.size(), 1 / double(set->members.size()));
        } else {
            std::vector<std::string> names;
            for (const FaceSet& s : mesh.face_sets)
                names.push_back(s.name);
            for (const NodeSet& s : mesh.node_sets)
                names.push_back(s.name);
            std::string list;
            for (const std::string& s : names)
                list += (list.empty() ? "one of " : ", ") + quoted_text(s);
            issues.push_back({file, here + "/set", quoted_text(probe.set),
                              list.empty() ? "a set of the mesh, which has none" : list});
        }
    }
    if (!issues.empty()) throw InputError(std::move(issues));
}

} // namespace amontons
