#include "solver/body/solid_conditions.hpp"

#include "mesh/base/curve.hpp"
#include "solver/body/drive.hpp"
#include "solver/solid/assembly.hpp"

#include <algorithm>
#include <array>
#include <cmath>
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

/// The part of a hold's displacements that is linear in places.
Mat3 gradient_at(const HoldInput& h, double t)
{
    if (h.gradient) return (h.over.empty() ? 1 : curve_value(h.over, t)) * *h.gradient;
    const double angle = curve_value(h.angle, t);
    return rotation(angle * h.axis.normalized()).toRotationMatrix() - Mat3::Identity();
}

/// Displacement of a node that a hold would give it.
Vec3 displacement_of(const HoldInput& h, const SolidConditions::Affine& affine, const Vec3& X,
                     double t)
{
    const auto at = [&](const CurvePoints& c) { return c.empty() ? 0.0 : curve_value(c, t); };
    const Vec3 shift(at(h.x), at(h.y), at(h.z));
    return affine.input ? Vec3(shift + gradient_at(h, t) * (X - affine.about)) : shift;
}

/// Whether two holds give a node the same motion along an axis, at the times that they name and
/// between these.
bool same_affine_motion(const SolidInput& input, const SolidConditions& c, std::size_t a,
                        std::size_t b, const Vec3& X, int axis, double size)
{
    constexpr double kRounding = 1e-12; // of the size
    std::set<double> times{0};
    for (const std::size_t k : {a, b}) {
        const HoldInput& h = input.hold[k];
        for (const CurvePoints* curve : {&h.x, &h.y, &h.z, &h.angle, &h.over})
            for (const auto& point : *curve)
                times.insert(point[0]);
    }
    for (auto t = times.begin(); t != times.end(); ++t) {
        const auto next = std::next(t);
        for (const double time : {*t, next == times.end() ? *t : 0.5 * (*t + *next)})
            if (std::abs(displacement_of(input.hold[a], c.affine[a], X, time)[axis] -
                         displacement_of(input.hold[b], c.affine[b], X, time)[axis]) >
                kRounding * size)
                return false;
    }
    return true;
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

std::vector<std::int32_t> prescribed_dofs(const SolidConditions& conditions)
{
    std::vector<std::int32_t> all;
    for (const SolidConditions::Held& h : conditions.held)
        all.push_back(h.dof);
    return all;
}

Eigen::VectorXd held_displacements(const SolidConditions& conditions, const VolumeMesh& mesh,
                                   double t)
{
    std::vector<Mat3> gradient(conditions.affine.size());
    for (std::size_t k = 0; k < gradient.size(); ++k)
        if (const HoldInput* h = conditions.affine[k].input) gradient[k] = gradient_at(*h, t);
    Eigen::VectorXd u(Eigen::Index(conditions.held.size()));
    for (std::size_t i = 0; i < conditions.held.size(); ++i) {
        const SolidConditions::Held& h = conditions.held[i];
        double value = h.curve ? curve_value(*h.curve, t) : 0;
        if (const SolidConditions::Affine& affine = conditions.affine[h.hold]; affine.input)
            value += gradient[h.hold].row(h.dof % 3).dot(mesh.nodes[std::size_t(h.dof / 3)] -
                                                         affine.about);
        u[Eigen::Index(i)] = value;
    }
    return u;
}

bool moves(const SolidConditions& conditions, const SolidConditions::Held& held)
{
    return held.curve || conditions.affine[held.hold].input;
}

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

    // ---- Holds
    SolidConditions c;
    // Axes and places of the world where the body begins, whose turn the mesh has (turn_with_mesh),
    // or of the body.
    for (const HoldInput& h : input.hold)
        c.affine.push_back({h.affine() ? &h : nullptr,
                            h.axes == "body" ? h.about : Vec3(h.about - input.start.place)});
    double size = 0;
    for (const Vec3& X : mesh.nodes)
        size = std::max(size, (X - mesh.nodes.front()).norm());
    const std::string body = "/bodies/" + input.name;
    std::map<std::int32_t, std::size_t> seen; // place in c.held of a dof
    std::set<std::array<std::size_t, 2>> reported;
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
                const Vec3& X = mesh.nodes[std::size_t(node)];
                const bool same = c.affine[first.hold].input || c.affine[i].input
                                      ? same_affine_motion(input, c, first.hold, i, X, axis, size)
                                      : same_motion(first.curve, held.curve);
                if (same || !reported.insert({first.hold, i}).second) continue;
                c.warnings.push_back(
                    {file, place,
                     fmt::format(
                         "the node at ({:.4g}, {:.4g}, {:.4g}), which hold {} (\"{}\") takes "
                         "elsewhere along {}: that one counts",
                         X.x(), X.y(), X.z(), first.hold, input.hold[first.hold].set, "xyz"[axis]),
                     "one motion of a node"});
            }
    }

    // ---- Loads and supports
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
    for (std::size_t i = 0; i < input.supports.size(); ++i) {
        const std::string& set = input.supports[i].set;
        const std::string place = fmt::format("{}/supports/{}/set", body, i);
        const FaceSet* faces = find_set(mesh.face_sets, set);
        const std::vector<std::int32_t> nodes =
            faces ? nodes_of(mesh, *faces) : nodes_of_set(set, place);
        if (!faces && !nodes.empty())
            issues.push_back({file, place, quoted_text(set) + ", a set of nodes",
                              "a set of faces: supports act on an area"});
        else if (faces && nodes.empty())
            issues.push_back({file, place, quoted_text(set) + ", an empty set", "a set of faces"});
        c.supports.push_back({&input.supports[i], faces});
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
