#include "solver/body/solid_sets.hpp"

#include "mesh/pick_faces.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <unordered_map>

namespace amontons {
namespace {

std::string shown(const Vec3& x)
{
    return fmt::format("({:.6g}, {:.6g}, {:.6g})", x.x(), x.y(), x.z());
}

std::string bounds_of(const VolumeMesh& mesh)
{
    Vec3 low = mesh.nodes.front(), high = low;
    for (const Vec3& x : mesh.nodes) {
        low = low.cwiseMin(x);
        high = high.cwiseMax(x);
    }
    return "the mesh reaches from " + shown(low) + " to " + shown(high) + " [m]";
}

Region region_of(const SetInput& s, double slack)
{
    if (s.box.given) return inside_box(s.box.from, s.box.to, slack);
    if (s.ball.given) return inside_ball(s.ball.centre, s.ball.radius, slack);
    return near_plane(s.plane.at, s.plane.normal, s.within > 0 ? s.within : slack);
}

/// Labels of a file as numbers of the mesh; those that it has not are left and reported.
std::vector<std::int32_t> nodes_of_labels(const VolumeMesh& mesh, const std::vector<int>& labels,
                                          std::vector<std::int64_t>& unknown)
{
    std::unordered_map<std::int64_t, std::int32_t> number;
    for (std::size_t i = 0; i < mesh.node_labels.size(); ++i)
        number.emplace(mesh.node_labels[i], std::int32_t(i));
    std::vector<std::int32_t> nodes;
    for (const int label : labels) {
        std::int64_t node = label - mesh.first_label;
        if (!mesh.node_labels.empty()) {
            const auto at = number.find(label);
            node = at == number.end() ? -1 : at->second;
        }
        if (node < 0 || node >= std::int64_t(mesh.nodes.size()))
            unknown.push_back(label);
        else
            nodes.push_back(std::int32_t(node));
    }
    return nodes;
}

template <class Member>
void add_set(std::vector<NamedSet<Member>>& sets, const std::string& name,
             std::vector<Member> members)
{
    std::ranges::sort(members);
    members.erase(std::unique(members.begin(), members.end()), members.end());
    sets.push_back({name, std::move(members)});
}

} // namespace

void add_sets(const SolidInput& input, VolumeMesh& mesh, const ExternalSurface& outside,
              const std::string& file)
{
    std::vector<Issue> issues;
    const double slack = input.sets.empty() ? 0 : place_tolerance(mesh);
    for (const SetInput& s : input.sets) {
        const std::string place = "/bodies/" + input.name + "/sets/" + s.name;
        const auto refuse = [&](const std::string& below, std::string found, std::string allowed) {
            issues.push_back({file, place + below, std::move(found), std::move(allowed)});
        };
        if (find_set(mesh.face_sets, s.name) || find_set(mesh.node_sets, s.name)) {
            refuse("", quoted_text(s.name) + ", a set of the mesh itself", "another name");
            continue;
        }
        std::vector<FaceRef> faces;
        if (!s.faces.empty()) {
            const std::int64_t count = std::int64_t(outside.faces.size());
            for (const int f : s.faces)
                if (f < count)
                    faces.push_back(outside.faces[std::size_t(f)]);
                else
                    refuse("/faces", fmt::format("face {}", f),
                           fmt::format("0 to {}: the outside has {} faces", count - 1, count));
        } else if (!s.nodes.empty()) {
            std::vector<std::int64_t> unknown;
            std::vector<std::int32_t> nodes = nodes_of_labels(mesh, s.nodes, unknown);
            for (const std::int64_t label : unknown)
                refuse("/nodes", fmt::format("node {}", label),
                       fmt::format("a node of the mesh, which has {}", mesh.nodes.size()));
            add_set(mesh.node_sets, s.name, std::move(nodes));
            continue;
        } else if (s.faces_like.given) {
            AlikeFaces alike = faces_alike(outside, mesh, s.faces_like.at,
                                           s.faces_like.angle * std::numbers::pi / 180);
            if (alike.away > alike.size)
                refuse("/faces_like/at",
                       fmt::format("{}, {:.3g} m from the outside", shown(s.faces_like.at),
                                   alike.away),
                       "a place on it; the nearest is " + shown(alike.seed) + " [m]");
            else
                faces = std::move(alike.faces);
        } else {
            const Region region = region_of(s, slack);
            const std::vector<std::int32_t> nodes = nodes_in(mesh, region);
            faces = faces_in(outside, mesh, region);
            if (s.of == "nodes" && !nodes.empty()) {
                add_set(mesh.node_sets, s.name, nodes);
                continue;
            }
            if (nodes.empty())
                refuse("", "an empty set",
                       "a place where there is some of the body: " + bounds_of(mesh));
            else if (faces.empty())
                refuse("",
                       fmt::format("{} nodes, but no face of the outside with all its nodes",
                                   nodes.size()),
                       "a place that holds whole faces, or \"of\": \"nodes\"");
        }
        if (!faces.empty()) add_set(mesh.face_sets, s.name, std::move(faces));
    }
    if (!issues.empty()) throw InputError(std::move(issues));
}

std::vector<SetSize> set_sizes(const VolumeMesh& mesh)
{
    std::vector<SetSize> sizes;
    for (const FaceSet& set : mesh.face_sets)
        sizes.push_back({set.name, std::int64_t(set.members.size()),
                         std::int64_t(nodes_of(mesh, set).size()),
                         integrate(surface_of(mesh, set.members), mesh).area});
    for (const NodeSet& set : mesh.node_sets)
        sizes.push_back({set.name, 0, std::int64_t(set.members.size()), 0});
    return sizes;
}

} // namespace amontons
