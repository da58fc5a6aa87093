#include "solver/step/body_record.hpp"

#include "contact/rigid/shape_surface.hpp"
#include "contact/surface/faceted_surface.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <map>
#include <set>

namespace amontons {
namespace {

Vec6 turned(const Vec6& s, const Mat3& R)
{
    Mat3 m;
    m << s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2];
    const Mat3 t = R * m * R.transpose();
    Vec6 out;
    out << t(0, 0), t(1, 1), t(2, 2), t(0, 1), t(1, 2), t(0, 2);
    return out;
}

BodyRecord record_rigid(const RigidBody& body)
{
    BodyRecord r;
    const SurfaceMesh picture = surface_of(body.shape());
    const Placement at = body.placement();
    for (const Vec3& X : picture.points)
        r.points.push_back(at * X);
    for (const auto& t : picture.triangles)
        r.triangles.push_back({t[0], t[1], t[2]});
    Field velocity{"velocity", "m/s", 3, {}};
    for (const Vec3& x : r.points) {
        const Vec3 v = body.velocity({{}, x}, VelocityAt::iterate);
        velocity.values.insert(velocity.values.end(), v.data(), v.data() + 3);
    }
    r.point_fields.push_back(std::move(velocity));
    return r;
}

/// The force of each contact [N]; of a solid and itself with what multipliers of the side that it
/// faces do at its node: two sides carry multipliers there, and only their sum is unique.
std::vector<Vec3> forces_of_both_sides(const BodyStepReport& step)
{
    std::vector<Vec3> force = step.force;
    std::map<std::pair<int, std::int64_t>, Vec3> from_other; // by body and node
    const BodyContacts& all = step.contacts;
    for (std::size_t c = 0; c < force.size(); ++c)
        if (const BodyContact& k = all.contact[c]; k.a == k.b && k.area > 0)
            for (const StencilEntry& e : all.place_b(k).nodes)
                from_other.try_emplace({k.b, e.node}, Vec3::Zero()).first->second -=
                    e.weight * step.force[c];
    for (std::size_t c = 0; c < force.size(); ++c)
        if (const BodyContact& k = all.contact[c]; k.a == k.b && k.area > 0)
            if (const auto at = from_other.find({k.a, k.id}); at != from_other.end())
                force[c] += at->second;
    return force;
}

/// A rotation vector of at most pi.
Vec3 turn_since_start(const RigidBody& body)
{
    const Vec3& begun = body.begun().turn;
    const double angle = begun.norm();
    Eigen::Quaterniond q = body.placement().turn;
    if (angle > 0) q = q * Eigen::Quaterniond(Eigen::AngleAxisd(-angle, begun / angle));
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    const double sine = q.vec().norm();
    return sine > 0 ? Vec3(2 * std::atan2(sine, q.w()) / sine * q.vec()) : Vec3(Vec3::Zero());
}

/// Of each node on the outside: its share of the faces around it [m^2].
std::vector<double> areas_of_nodes(const SolidBody& solid)
{
    const ExternalSurface outside = extract_surface(solid.mesh());
    const TriangulatedSurface flat = triangulate(outside, solid.mesh());
    std::vector<double> area(solid.places().size(), 0);
    for (std::size_t i = 0; i < flat.faces.size(); ++i) {
        std::array<std::int32_t, 3> node;
        for (std::size_t k = 0; k < 3; ++k)
            node[k] = outside.used_nodes[std::size_t(flat.mesh.triangles[i][k])];
        const auto x = [&](std::size_t k) { return solid.places()[std::size_t(node[k])]; };
        const double own = 0.5 * (x(1) - x(0)).cross(x(2) - x(0)).norm();
        const std::span<const std::int32_t> face = outside.face(std::size_t(flat.faces[i]));
        const bool half = face.size() == 4; // of a quadrilateral, cut along either diagonal
        for (const std::int32_t n : half ? face : std::span<const std::int32_t>(node))
            area[std::size_t(n)] += own / (half ? 4 : 3);
    }
    return area;
}

/// What rods do to the nodes of a solid that carry no functions of theirs: their forces over the
/// area that a node stands for.
void add_rod_contacts(const SolidBody& solid, int b, const BodySystem& system,
                      const BodyStepReport& step, Field& pressure, Field& traction)
{
    const BodyContacts& all = step.contacts;
    std::vector<double> area;
    for (std::size_t c = 0; c < all.contact.size(); ++c) {
        const BodyContact& k = all.contact[c];
        if (k.b != b || !system.refs[std::size_t(k.a)].rod || step.force[c].isZero(0)) continue;
        if (area.empty()) area = areas_of_nodes(solid);
        const Vec3 n = k.frame.col(0);
        for (const StencilEntry& e : all.place_b(k).nodes) {
            const auto node = std::size_t(e.node);
            const double per_area = e.weight / (k.area > 0 ? k.area : area[node]);
            pressure.values[node] += per_area * n.dot(step.force[c]);
            for (std::size_t i = 0; i < 3; ++i)
                traction.values[3 * node + i] -= per_area * step.force[c][Eigen::Index(i)];
        }
    }
}

BodyRecord record_solid(SolidBody& solid, int b, const BodySystem& system,
                        const BodyStepReport& step)
{
    BodyRecord r;
    solid.complete();
    r.elements = &solid.mesh();
    r.stress_round_off = solid.stress_round_off();
    r.points.assign(solid.places().begin(), solid.places().end());
    const std::size_t n = r.points.size();
    Field moved{"displacement", "m", 3, {}};
    for (std::size_t i = 0; i < n; ++i) {
        const Vec3 d = r.points[i] - solid.first_places()[i];
        moved.values.insert(moved.values.end(), d.data(), d.data() + 3);
    }
    std::vector<Vec6> stress;
    std::vector<double> energy;
    solid.stresses(stress, energy);
    Field cauchy{"stress", "Pa", 6, {}}, mises{"von_mises", "Pa", 1, {}},
        density{"strain_energy_density", "J/m^3", 1, energy};
    const Mat3 R = solid.frame().turn.toRotationMatrix();
    std::vector<Vec6> nodal(n, Vec6::Zero());
    std::vector<double> shares(n, 0);
    for_each_element(solid.mesh(), [&](std::int32_t e, ElementKind, auto nodes) {
        const Vec6 t = turned(stress[std::size_t(e)], R * solid.element_rotation(e));
        cauchy.values.insert(cauchy.values.end(), t.data(), t.data() + 6);
        mises.values.push_back(von_mises(t));
        for (const std::int32_t node : nodes) {
            nodal[std::size_t(node)] += t;
            shares[std::size_t(node)] += 1;
        }
    });
    Field smooth{"stress_averaged", "Pa", 6, {}}, smooth_mises{"von_mises_averaged", "Pa", 1, {}};
    for (std::size_t i = 0; i < n; ++i) {
        const Vec6 t = nodal[i] / std::max(1.0, shares[i]);
        smooth.values.insert(smooth.values.end(), t.data(), t.data() + 6);
        smooth_mises.values.push_back(von_mises(t));
    }
    const std::vector<Vec3> force = forces_of_both_sides(step);
    // Pressure and traction on the body where it carries the contacts' functions.
    Field pressure{"contact_pressure", "Pa", 1, std::vector<double>(n, 0.0)};
    Field traction{"contact_traction", "Pa", 3, std::vector<double>(3 * n, 0.0)};
    for (std::size_t c = 0; c < step.contacts.contact.size(); ++c) {
        const BodyContact& k = step.contacts.contact[c];
        if (k.a != b || !(k.area > 0)) continue;
        const auto node = std::size_t(k.id % kNodeNumbers);
        pressure.values[node] += k.frame.col(0).dot(force[c]) / k.area;
        for (std::size_t i = 0; i < 3; ++i)
            traction.values[3 * node + i] += force[c][Eigen::Index(i)] / k.area;
    }
    add_rod_contacts(solid, b, system, step, pressure, traction);
    r.point_fields = {std::move(moved), std::move(smooth), std::move(smooth_mises),
                      std::move(pressure), std::move(traction)};
    r.cell_fields = {std::move(cauchy), std::move(mises), std::move(density)};
    return r;
}

/// NAME_SET_support_force; two of one set are distinguished.
std::vector<std::string> names_of_supports(const SolidInput& input)
{
    std::vector<std::string> names;
    std::map<std::string, int> seen;
    for (const SupportInput& s : input.supports) {
        const int n = ++seen[s.set];
        names.push_back(input.name + "_" + s.set + (n > 1 ? fmt::format("_{}", n) : "") +
                        "_support_force");
    }
    return names;
}

/// What contacts exert on the nodes of a solid, along their normals [N].
struct PressedNodes {
    std::vector<double> force;    ///< > 0: pressed
    std::vector<Vec3> direction;  ///< sum of these forces as vectors
    std::vector<double> pressure; ///< where the body carries the contacts' functions [Pa]
    std::vector<char> known;      ///< that
    bool any = false;
};

PressedNodes pressed_nodes(const SolidBody& solid, int b, const BodyStepReport& step)
{
    const std::size_t n = solid.places().size();
    PressedNodes p{std::vector<double>(n, 0), std::vector<Vec3>(n, Vec3::Zero()),
                   std::vector<double>(n, 0), std::vector<char>(n, 0)};
    const BodyContacts& all = step.contacts;
    for (std::size_t c = 0; c < all.contact.size(); ++c) {
        const BodyContact& k = all.contact[c];
        const double force = k.frame.col(0).dot(step.force[c]);
        if (force == 0 || (k.a != b && k.b != b)) continue;
        p.any = true;
        const auto add = [&](std::span<const StencilEntry> nodes, double sign) {
            for (const StencilEntry& e : nodes) {
                p.force[std::size_t(e.node)] += e.weight * force;
                p.direction[std::size_t(e.node)] += sign * e.weight * force * k.frame.col(0);
            }
        };
        if (k.a == b) add(all.place_a(k).nodes, 1);
        if (k.b == b) add(all.place_b(k).nodes, -1);
        if (k.a == b && k.area > 0) {
            p.pressure[std::size_t(k.id % kNodeNumbers)] += force / k.area;
            p.known[std::size_t(k.id % kNodeNumbers)] = 1;
        }
    }
    return p;
}

/// Largest pressure on the solid of a pair where rows press that stand for no area (places and
/// edges of faces that are larger than what they touch): all forces on a node over the area there
/// that faces them.
double largest_pressure_of_nodes(const ContactPair& pair, const SolidBody& solid, int number,
                                 const BodyStepReport& step)
{
    std::map<std::int32_t, Vec3> force;
    const BodyContacts& all = step.contacts;
    for (std::size_t c = 0; c < all.contact.size(); ++c) {
        const BodyContact& k = all.contact[c];
        if (k.pair != number) continue;
        const Vec3 normal = k.frame.col(0).dot(step.force[c]) * k.frame.col(0);
        for (const StencilEntry& e : all.place_a(k).nodes)
            force.try_emplace(e.node, Vec3::Zero()).first->second += e.weight * normal;
    }
    std::map<std::int32_t, double> area;
    const ExternalSurface& surface = pair.surface_a->outside;
    for (std::size_t f = 0; f < surface.faces.size(); ++f) {
        const std::span<const std::int32_t> nodes = surface.face(f);
        const auto x = [&](int i) { return solid.places()[std::size_t(nodes[std::size_t(i)])]; };
        for (const std::array<int, 3>& t : flat_parts(nodes.size()).triangles) {
            const Vec3 outwards = 0.5 * (x(t[1]) - x(t[0])).cross(x(t[2]) - x(t[0]));
            const bool half = nodes.size() == 4; // of a quadrilateral, cut along either diagonal
            const auto add = [&](std::int32_t node) {
                const auto at = force.find(node);
                if (at == force.end() || !(at->second.norm() > 0)) return;
                area[node] +=
                    std::max(0.0, -outwards.dot(at->second.normalized())) / (half ? 4 : 3);
            };
            if (half)
                std::ranges::for_each(nodes, add);
            else
                for (const int i : t)
                    add(nodes[std::size_t(i)]);
        }
    }
    double most = 0;
    for (const auto& [node, of_node] : area)
        if (of_node > 0) most = std::max(most, force.at(node).norm() / of_node);
    return most;
}

/// Pressures of nodes: those of the body's own functions, elsewhere force over the area that faces
/// it.
std::vector<double> pressures_of_nodes(const SolidBody& solid, PressedNodes p)
{
    const ExternalSurface outside = extract_surface(solid.mesh());
    const TriangulatedSurface flat = triangulate(outside, solid.mesh());
    std::vector<double> area(p.force.size(), 0);
    for (const auto& triangle : flat.mesh.triangles) {
        std::array<std::size_t, 3> node;
        for (std::size_t k = 0; k < 3; ++k)
            node[k] = std::size_t(outside.used_nodes[std::size_t(triangle[k])]);
        const std::span<const Vec3> x = solid.places();
        const Vec3 outwards = 0.5 * (x[node[1]] - x[node[0]]).cross(x[node[2]] - x[node[0]]);
        for (const std::size_t k : node)
            if (const double size = p.direction[k].norm(); size > 0)
                area[k] += std::max(0.0, -outwards.dot(p.direction[k]) / size) / 3;
    }
    for (std::size_t i = 0; i < area.size(); ++i)
        if (!p.known[i]) p.pressure[i] = area[i] > 0 ? p.force[i] / area[i] : 0;
    return p.pressure;
}

void add_probes(SolidBody& solid, int b, const std::string& name, const BodyStepReport& step,
                std::vector<Quantity>& out)
{
    if (solid.probes().empty()) return;
    solid.complete();
    const PressedNodes pressed = pressed_nodes(solid, b, step);
    std::vector<double> at_nodes; // pressures
    // Values of a probe at a place or a set, in the order of kProbeFields; without stress where
    // there is none.
    const auto add_probe = [&](const ProbeInput& probe, auto&& add) {
        const Vec3 d = solid.probe_displacement(probe);
        add("_displacement_x", "m", d[0]);
        add("_displacement_y", "m", d[1]);
        add("_displacement_z", "m", d[2]);
        if (const std::optional<Vec6> stress = solid.probe_stress(probe)) {
            const char* components[] = {"xx", "yy", "zz", "xy", "yz", "zx"};
            for (int i = 0; i < 6; ++i)
                add(std::string("_stress_") + components[i], "Pa", (*stress)[i]);
            add("_von_mises", "Pa", von_mises(*stress));
        }
        double pressure = 0;
        if (probe.found.area > 0) { // over a set: the force on its nodes
            for (const std::int32_t node : probe.found.nodes)
                pressure += pressed.force[std::size_t(node)] / probe.found.area;
        } else if (pressed.any) {
            if (at_nodes.empty()) at_nodes = pressures_of_nodes(solid, pressed);
            for (std::size_t i = 0; i < probe.found.nodes.size(); ++i)
                pressure += probe.found.weights[i] * at_nodes[std::size_t(probe.found.nodes[i])];
        }
        add("_contact_pressure", "Pa", pressure);
    };
    for (const ProbeInput& probe : solid.probes()) {
        const std::string own = name + "_" + probe.name;
        if (!probe.line.given) {
            add_probe(probe, [&](const std::string& what, const char* unit, double value) {
                out.push_back({own + what, unit, value});
            });
            continue;
        }
        std::vector<std::map<std::string, double>> found;
        ProbeInput place;
        for (const ProbeInput::Place& p : probe.along) {
            place.found = p.found;
            std::map<std::string, double>& values = found.emplace_back();
            add_probe(place, [&](const std::string& what, const char*, double value) {
                values[what.substr(1)] = value;
            });
        }
        for (const auto& [field, reference] : probe.fields) {
            // Both linear between the places: the trapezoidal rule.
            double missed = 0, size = 0;
            for (std::size_t i = 0; i < found.size(); ++i) {
                const double left = i > 0 ? probe.along[i].s - probe.along[i - 1].s : 0,
                             right =
                                 i + 1 < found.size() ? probe.along[i + 1].s - probe.along[i].s : 0;
                const double miss = found[i].at(field) - reference[i];
                missed += (left + right) * miss * miss;
                size += (left + right) * reference[i] * reference[i];
            }
            out.push_back({own + "_" + field + "_error", "", std::sqrt(missed / size)});
        }
    }
}

} // namespace

std::vector<Quantity> body_quantities(const Scene& scene, const std::vector<Obstacle>& obstacles,
                                      const BodySystem& system, const BodyStepReport& step)
{
    std::vector<Quantity> out;
    // Moving thousands of names in every step takes longer than making them.
    out.reserve(15 * system.refs.size() + 6 * system.finder.pairs().size() +
                6 * scene.couplings.size());
    const bool dynamic = scene.time.kind == "dynamic";
    const auto vector = [&](std::string_view of, std::string_view what, const char* unit,
                            const Vec3& v) {
        for (int i = 0; i < 3; ++i) {
            Quantity& component = out.emplace_back();
            component.name.reserve(of.size() + what.size() + 2);
            component.name.append(of).append(what).append({'_', "xyz"[i]});
            component.unit = unit;
            component.value = v[i];
        }
    };

    // ---- Contact forces by pair and by body
    const std::vector<ContactPair>& pairs = system.finder.pairs();
    std::vector<Vec3> force(pairs.size(), Vec3::Zero());
    std::vector<double> pressure(pairs.size(), 0), normal(pairs.size(), 0), closed(pairs.size(), 0);
    std::vector<double> without_area(pairs.size(), 0); // normal forces [N]
    const std::vector<Vec3> of_both_sides = forces_of_both_sides(step);
    for (std::size_t c = 0; c < step.contacts.contact.size(); ++c) {
        const BodyContact& k = step.contacts.contact[c];
        force[std::size_t(k.pair)] += step.force[c];
        normal[std::size_t(k.pair)] += k.frame.col(0).dot(step.force[c]);
        closed[std::size_t(k.pair)] += !step.force[c].isZero(0);
        if (k.area > 0)
            pressure[std::size_t(k.pair)] = std::max(pressure[std::size_t(k.pair)],
                                                     k.frame.col(0).dot(of_both_sides[c]) / k.area);
        else
            without_area[std::size_t(k.pair)] += k.frame.col(0).dot(step.force[c]);
    }
    for (std::size_t p = 0; p < pairs.size(); ++p)
        if (const SolidBody* solid = system.refs[std::size_t(pairs[p].a)].solid;
            solid && without_area[p] > 0.5 * normal[p] && pairs[p].surface_a)
            pressure[p] =
                std::max(pressure[p], largest_pressure_of_nodes(pairs[p], *solid, int(p), step));
    std::vector<Vec3> on_body(system.refs.size(), Vec3::Zero());
    bool unnamed = system.finder.has_rest();
    for (std::size_t p = 0; p < pairs.size(); ++p) {
        on_body[std::size_t(pairs[p].a)] += force[p];
        if (pairs[p].b >= 0) on_body[std::size_t(pairs[p].b)] -= force[p];
        if (!pairs[p].named) { // there may be thousands
            unnamed = true;
            continue;
        }
        // A_on_B is what A exerts on B: the contacts' forces act on their first body.
        const std::string& first = system.refs[std::size_t(pairs[p].a)].name;
        const std::string& second = pairs[p].b < 0 ? obstacles[std::size_t(pairs[p].obstacle)].name
                                                   : system.refs[std::size_t(pairs[p].b)].name;
        const bool on_second = pairs[p].names_b;
        const std::string name = on_second ? first + "_on_" + second : second + "_on_" + first;
        // Of a solid and itself forces act on either side: their sum is zero.
        const bool itself = system.refs[std::size_t(pairs[p].a)].solid && pairs[p].a == pairs[p].b;
        if (!itself) vector(name, "_force", "N", on_second ? Vec3(-force[p]) : force[p]);
        out.push_back({name + "_contacts", "", closed[p]});
        if (system.refs[std::size_t(pairs[p].a)].rod || itself)
            out.push_back({name + "_normal_force", "N", normal[p]}); // of all sides
        if (system.refs[std::size_t(pairs[p].a)].solid)
            out.push_back({name + "_max_pressure", "Pa", pressure[p]});
    }
    for (std::size_t b = 0; b < on_body.size() && unnamed; ++b)
        vector(system.refs[b].name, "_contact_force", "N", on_body[b]);
    std::size_t solid = 0, rod = 0;

    // ---- Quantities of each body
    for (const BodyRef& b : system.refs) {
        if (b.rigid) {
            vector(b.name, "", "m", b.rigid->centre());
            vector(b.name, "_turn", "rad", turn_since_start(*b.rigid));
            if (dynamic) vector(b.name, "_velocity", "m/s", b.rigid->centre_velocity());
            if (dynamic) vector(b.name, "_spin", "rad/s", b.rigid->spin());
            continue;
        }
        if (b.rod) {
            const RodInput& input = scene.rods[rod++];
            std::set<std::string> taken_places; // two may act at one place
            const auto place_of = [&](const std::string& set, const std::optional<double>& at) {
                return set.empty() ? fmt::format("{:g}", *at) : set;
            };
            const std::vector<std::array<Vec3, 2>> reactions = b.rod->reactions();
            for (std::size_t k = 0; k < reactions.size(); ++k) {
                if (input.instrument && input.hold[k].set == "start") continue; // its base: below
                std::string place = place_of(input.hold[k].set, input.hold[k].at);
                for (int n = 2; !taken_places.insert(place).second; ++n)
                    place = fmt::format("{}_{}", place_of(input.hold[k].set, input.hold[k].at), n);
                vector(b.name + "_" + place, "_force", "N", reactions[k][0]);
                vector(b.name + "_" + place, "_moment", "N m", reactions[k][1]);
            }
            const std::vector<BeamNode>& nodes = b.rod->nodes();
            const std::vector<BeamNode>& first = b.rod->first_nodes();
            double most = 0;
            for (std::size_t i = 0; i < nodes.size(); ++i)
                most = std::max(most, (nodes[i].position() - first[i].position()).norm());
            vector(b.name, "_end", "m", nodes.back().position());
            vector(b.name, "_end_tangent", "",
                   rotation_matrix(nodes.back().q) *
                       b.rod->model().axis(b.rod->model().element_count() - 1, 1));
            taken_places.clear();
            for (const RodLoad& l : input.loads)
                if (l.at && taken_places.insert(place_of("", l.at)).second)
                    vector(fmt::format("{}_{:g}", b.name, *l.at), "", "m",
                           nodes[std::size_t(b.rod->model().node_at(*l.at))].position());
            out.push_back({b.name + "_max_displacement", "m", most});
            if (!input.fed.empty()) {
                out.push_back({b.name + "_push_force", "N", b.rod->push_force()});
                out.push_back({b.name + "_torque", "N m", b.rod->sheath_torque()});
                out.push_back({b.name + "_base_twist", "rad", b.rod->turned_in_sheath()});
                out.push_back({b.name + "_tip_rotation", "rad", b.rod->tip_rotation()});
            }
            out.push_back({b.name + "_negative", "", double(b.rod->negative())});
            continue;
        }
        const SolidInput& input = scene.solids[solid++];
        const std::vector<Vec3> reactions = b.solid->reactions();
        const std::vector<Vec3> moments = b.solid->moments();
        for (std::size_t k = 0; k < reactions.size(); ++k) {
            vector(b.name + "_" + input.hold[k].set, "_force", "N", reactions[k]);
            vector(b.name + "_" + input.hold[k].set, "_moment", "N m", moments[k]);
        }
        if (!input.supports.empty()) {
            b.solid->complete();
            const std::vector<SolidBody::Support> supports = b.solid->supports();
            double energy = 0;
            for (std::size_t k = 0; k < supports.size(); ++k) {
                vector(names_of_supports(input)[k], "", "N", supports[k].force);
                energy += supports[k].energy;
            }
            out.push_back({b.name + "_support_energy", "J", energy});
        }
        const std::vector<double> pressures = b.solid->found_pressures();
        for (std::size_t k = 0, found = 0; k < input.loads.size(); ++k)
            if (!input.loads[k].volume.empty() && found < pressures.size())
                out.push_back(
                    {b.name + "_" + input.loads[k].set + "_pressure", "Pa", pressures[found++]});
        double largest = 0;
        const std::span<const Vec3> now = b.solid->places(), first = b.solid->first_places();
        if (b.solid->condensed() && !b.solid->touching().empty()) { // the rest costs a solve
            for (const std::int32_t node : b.solid->touching())
                largest =
                    std::max(largest, (now[std::size_t(node)] - first[std::size_t(node)]).norm());
        } else {
            b.solid->complete();
            for (std::size_t i = 0; i < now.size(); ++i)
                largest = std::max(largest, (now[i] - first[i]).norm());
        }
        out.push_back({b.name + "_max_displacement", "m", largest});
        vector(b.name, "_turn", "rad", b.solid->turn_since_start());
        add_probes(*b.solid, int(&b - system.refs.data()), b.name, step, out);
    }

    // ---- Momentum and couplings
    Vec3 momentum = Vec3::Zero(), angular = Vec3::Zero();
    if (dynamic) {
        for (const BodyRef& b : system.refs) {
            const BodyMotion motion = b.body->motion();
            momentum += motion.momentum;
            angular += motion.angular_momentum;
        }
        vector("momentum", "", "kg m/s", momentum);
        vector("angular_momentum", "", "kg m^2/s", angular);
    }
    // Of each coupling on its first body, the moment about its place: where its first row acts.
    std::vector<Vec3> joint(scene.couplings.size(), Vec3::Zero()), moment = joint;
    std::size_t first = 0;
    for (std::size_t r = 0; r < std::min(system.couplings.size(), step.coupling_force.size());
         ++r) {
        const Coupling& c = system.couplings[r];
        if (c.input != system.couplings[first].input) first = r;
        const Vec3& f = step.coupling_force[r];
        if (c.turns) {
            moment[std::size_t(c.input)] += f;
            continue;
        }
        joint[std::size_t(c.input)] += f;
        moment[std::size_t(c.input)] +=
            (step.coupling_place[r] - step.coupling_place[first]).cross(f);
    }
    std::string name;
    for (std::size_t k = 0; k < joint.size(); ++k) {
        const CouplingInput& c = scene.couplings[k];
        name.assign(c.between[0]).append("_on_").append(c.between[1]);
        name.append("_coupling_").append(std::to_string(k));
        if (c.kind != "turn_spring") vector(name, "_force", "N", -joint[k]);
        if (c.kind != "ball" && c.kind != "distance" && c.kind != "spring")
            vector(name, "_moment", "N m", -moment[k]);
    }
    return out;
}

BeamRecord record_rod(const RodBody& rod, const std::string& name)
{
    const RodModel& model = rod.model();
    BeamRecord beam;
    beam.name = name;
    Field radius{"radius", "m", 1, {}}, curvature{"curvature", "1/m", 1, {}},
        twist{"twist", "1/m", 1, {}}, axial{"axial_force", "N", 1, {}},
        torque{"torque", "N m", 1, {}}, moment{"moment", "N m", 1, {}},
        arc{"arc_length", "m", 1, {}};
    Field* const fields[] = {&radius, &curvature, &twist, &axial, &torque, &moment, &arc};
    std::array<double, 6> before{};
    const int elements = model.element_count();
    // A node shows the mean of its elements; a closed rod comes back to its first node.
    for (int i = model.closed ? -1 : 0; i <= elements; ++i) {
        const std::size_t e =
            std::size_t(model.closed ? (i + elements) % elements : std::min(i, elements - 1));
        const std::array<double, 6> strain = rod.strain(int(e));
        const std::array<double, 6> force = rod.resultants(int(e));
        const std::array<double, 6> here{model.radius[e], std::hypot(strain[4], strain[5]),
                                         strain[3],       force[0],
                                         force[3],        std::hypot(force[4], force[5])};
        const bool inner = model.closed || (i > 0 && i < elements);
        if (i < 0) {
            before = here;
            continue;
        }
        for (std::size_t k = 0; k < 6; ++k)
            fields[k]->values.push_back(inner ? 0.5 * (before[k] + here[k]) : here[k]);
        const std::size_t node = std::size_t(i < model.node_count() ? i : 0);
        arc.values.push_back(i < model.node_count() ? model.s[node] : model.length);
        beam.points.push_back(rod.nodes()[node].position());
        before = here;
    }
    for (Field* f : fields)
        beam.fields.push_back(std::move(*f));
    return beam;
}

BodyRecord record_body(const BodySystem& system, std::size_t b, const BodyStepReport& step)
{
    const BodyRef& ref = system.refs[b];
    BodyRecord r =
        ref.rigid ? record_rigid(*ref.rigid) : record_solid(*ref.solid, int(b), system, step);
    r.name = ref.name;
    return r;
}

std::vector<ContactRecord> contact_records_of(const BodySystem& system, const BodyStepReport& step,
                                              int obstacles)
{
    constexpr double kSticks = 1e-9; // slip per step below this share of the body sticks
    const auto number = [&](int body, int obstacle) { // obstacles first, then bodies
        return body < 0 ? obstacle : obstacles + body;
    };
    const std::vector<ContactPair>& pairs = system.finder.pairs();
    std::vector<ContactRecord> all;
    for (std::size_t c = 0; c < step.contacts.contact.size(); ++c) {
        const BodyContact& k = step.contacts.contact[c];
        if (step.force[c].isZero(0)) continue;
        const ContactPair& pair = pairs[std::size_t(k.pair)];
        ContactRecord r;
        r.point = k.point;
        if (pair.small) { // found where the run began: reported where the body is now
            const SolidBody& solid = *system.refs[std::size_t(k.a)].solid;
            const auto node = std::size_t(k.id % kNodeNumbers);
            r.point += solid.places()[node] - solid.first_places()[node];
        }
        r.force = step.force[c];
        r.normal = k.frame.col(0);
        r.slip = step.slip[c];
        r.normal_force = r.normal.dot(r.force);
        r.clustered_force = r.normal_force;
        r.gap = k.gap;
        r.pressure = k.area > 0 ? r.normal_force / k.area : 0;
        r.area = k.area;
        const Vec3 tangential = r.force - r.normal_force * r.normal;
        const double size = system.refs[std::size_t(k.a)].body->size();
        const bool slips =
            tangential.norm() >= (1 - 1e-6) * friction_of(pairs, k) * r.normal_force ||
            r.slip.norm() > kSticks * size;
        r.status = slips ? ContactStatus::slip : ContactStatus::stick;
        r.body_a = number(k.a, 0);
        r.body_b = number(k.b, pair.obstacle);
        all.push_back(r);
    }
    return all;
}

} // namespace amontons
