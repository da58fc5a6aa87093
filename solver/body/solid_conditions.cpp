#include "solver/body/solid_conditions.hpp"

#include "solver/solid/assembly.hpp"

#include <algorithm>
#include <array>
#include <fmt/format.h>
#include <map>
#include <numeric>
#include <set>

namespace amontons {
namespace {

std::vector<std::string> set_names(const VolumeMesh& mesh)
{
    std::vector<std::string> names;
    for (const FaceSet& s : mesh.face_sets)
        names.push_back(s.name);
    for (const NodeSet& s : mesh.node_sets)
        names.push_back(s.name);
    return names;
}

/// Null is at rest. Curves of other times count as others, even where they mean the same.
bool same_motion(const CurvePoints* a, const CurvePoints* b)
{
    const auto at_rest = [](const CurvePoints* c) {
        return !c || std::ranges::all_of(*c, [](const auto& point) { return point[1] == 0; });
    };
    return (at_rest(a) && at_rest(b)) || (a && b && *a == *b);
}

} // namespace

SolidConditions find_conditions(const SolidInput& input, const VolumeMesh& mesh,
                                const std::string& file)
{
    std::vector<Issue> issues;
    const std::vector<std::string> names = set_names(mesh);
    const auto nodes_of_set = [&](const std::string& name, const std::string& place) {
        if (const FaceSet* f = find_set(mesh.face_sets, name)) return nodes_of(mesh, *f);
        if (const NodeSet* s = find_set(mesh.node_sets, name)) return s->members;
        if (name == "all") {
            std::vector<std::int32_t> all(mesh.nodes.size());
            std::iota(all.begin(), all.end(), 0);
            return all;
        }
        const std::string near = nearest_name(name, names);
        std::string list;
        for (const std::string& s : names)
            list += (list.empty() ? "one of " : ", ") + quoted_text(s);
        issues.push_back({file, place, quoted_text(name),
                          names.empty()  ? "a set of the mesh, which has none"
                          : near.empty() ? list
                                         : quoted_text(near) + " (nearest name)"});
        return std::vector<std::int32_t>{};
    };
    SolidConditions c;
    const std::string body = "/bodies/" + input.name;
    std::map<std::int32_t, std::size_t> seen; // place in c.held of a dof
    std::set<std::array<std::size_t, 2>> told;
    for (std::size_t i = 0; i < input.hold.size(); ++i) {
        const HoldInput& h = input.hold[i];
        const std::string place = fmt::format("{}/hold/{}/set", body, i);
        const std::vector<std::int32_t> nodes = nodes_of_set(h.set, place);
        if (nodes.empty() && issues.empty())
            issues.push_back(
                {file, place, quoted_text(h.set) + ", an empty set", "a set of nodes"});
        const CurvePoints* curve[] = {&h.x, &h.y, &h.z};
        const bool all = h.x.empty() && h.y.empty() && h.z.empty();
        for (const std::int32_t node : nodes)
            for (int axis = 0; axis < 3; ++axis) {
                if (!all && curve[axis]->empty()) continue;
                const SolidConditions::Held held{3 * node + axis, all ? nullptr : curve[axis], i};
                const auto [at, is_new] = seen.insert({held.dof, c.held.size()});
                if (is_new) {
                    c.held.push_back(held);
                    continue;
                }
                const SolidConditions::Held& first = c.held[at->second];
                if (same_motion(first.curve, held.curve) || !told.insert({first.hold, i}).second)
                    continue;
                const Vec3& X = mesh.nodes[std::size_t(node)];
                c.warnings.push_back(
                    {file, place,
                     fmt::format(
                         "the node at ({:.4g}, {:.4g}, {:.4g}), which hold {} (\"{}\") takes "
                         "elsewhere along {}: that one counts",
                         X.x(), X.y(), X.z(), first.hold, input.hold[first.hold].set, "xyz"[axis]),
                     "one motion of a node"});
            }
    }
    for (std::size_t i = 0; i < input.loads.size(); ++i) {
        const LoadInput& l = input.loads[i];
        const std::string place = fmt::format("{}/loads/{}/set", body, i);
        SolidConditions::Load load;
        load.input = &l;
        load.nodes = nodes_of_set(l.set, place);
        load.faces = find_set(mesh.face_sets, l.set);
        if (!load.faces && !load.nodes.empty() &&
            (l.traction || !l.pressure.empty() || !l.volume.empty()))
            issues.push_back({file, place, quoted_text(l.set) + ", a set of nodes",
                              "a set of faces: pressure and traction act on an area"});
        c.loads.push_back(std::move(load));
    }
    if (!issues.empty()) throw InputError(std::move(issues));
    const Eigen::Index n = Eigen::Index(mesh.nodes.size());
    for (SolidConditions::Load& load : c.loads) {
        if (!load.input->pressure.empty()) {
            load.pressure = Eigen::VectorXd::Zero(3 * n);
            add_pressure(mesh, load.faces->members, 1, load.pressure);
        }
        if (load.input->traction) {
            Eigen::VectorXd forces = Eigen::VectorXd::Zero(3 * n);
            add_traction(mesh, load.faces->members, Vec3::UnitX(), forces);
            load.traction = forces(Eigen::seqN(0, n, 3));
        }
    }
    return c;
}

} // namespace amontons
