#include "solver/step/body_build.hpp"

#include "contact/surface/choose_slave.hpp"
#include "mesh/base/dense.hpp"
#include "mesh/format/read.hpp"
#include "mesh/format/read_volume.hpp"
#include "mesh/generate/solid_box.hpp"
#include "mesh/generate/solid_round.hpp"
#include "mesh/generate/solid_tube.hpp"
#include "mesh/orient_surface.hpp"
#include "mesh/size_check.hpp"
#include "mesh/volume_check.hpp"
#include "solver/body/condensed_solid.hpp"
#include "solver/body/drive.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/body/solid_probes.hpp"
#include "solver/body/solid_sets.hpp"
#include "solver/large/large_matrix.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/scene/read.hpp"
#include "solver/step/linear_choice.hpp"
#include "solver/step/rod_joints.hpp"
#include "solver/step/start_overlap.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numbers>
#include <set>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace amontons {
namespace {

ElementKind element_kind(const std::string& name)
{
    return name == "T4" ? ElementKind::T4 : name == "H8" ? ElementKind::H8 : ElementKind::T10;
}

/// Adds to Issues without a file the place in the scene that they are due to.
void add_issues(const std::vector<Issue>& found, const Scene& scene, const std::string& place,
                std::vector<Issue>& issues)
{
    for (Issue issue : found) {
        if (issue.file.empty()) {
            issue.file = scene.file;
            issue.place = place + (issue.place.empty() ? "" : ": " + issue.place);
        }
        issues.push_back(std::move(issue));
    }
}

MassProperties mass_of(const RigidInput& input, const RigidShape& shape)
{
    MassProperties m = mass_properties(shape, input.density > 0 ? input.density : 1);
    if (input.mass) {
        const double factor = *input.mass / m.mass;
        m.mass *= factor;
        m.inertia *= factor;
    } else if (!(input.density > 0)) {
        m.mass = 0; // no weight; its inertia is never used
    }
    if (input.inertia) m.inertia = input.inertia->asDiagonal();
    return m;
}

struct Built {
    const Scene& scene;
    BodySystem& system;
    std::vector<Issue>& issues;
    std::unordered_map<std::string, int> number; ///< of the bodies in `system`

    int find(const std::string& name) const
    {
        const auto at = number.find(name);
        return at == number.end() ? -1 : at->second;
    }
    /// Made once for all pairs; null if the mesh has no such set.
    /// @param outside  all of the mesh's
    const ContactSurface* surface(const std::string& body, const VolumeMesh& mesh,
                                  const ExternalSurface& outside, const std::string& set,
                                  std::size_t law, std::size_t side)
    {
        const auto known = system.surfaces.find({body, set});
        if (known != system.surfaces.end()) return &known->second;
        const auto keep = [&](ExternalSurface of_set) -> ContactSurface* {
            ContactSurface& s = system.surfaces[{body, set}];
            s.outside = std::move(of_set);
            s.facets = Late<FacetedSurface>([&s] { return FacetedSurface(s.outside); });
            return &s;
        };
        if (set.empty()) return keep(outside);
        if (const FaceSet* faces = find_set(mesh.face_sets, set)) {
            ContactSurface* s = keep(surface_of(mesh, faces->members));
            s->whole = s->outside.faces.size() == outside.faces.size();
            return s;
        }
        std::vector<std::string> names;
        for (const FaceSet& f : mesh.face_sets)
            names.push_back(f.name);
        const std::string near = nearest_name(set, names);
        std::string list;
        for (const std::string& s : names)
            list += (list.empty() ? "one of " : ", ") + quoted_text(s);
        issues.push_back({scene.file, fmt::format("/contact/{}/surfaces/{}", law, side),
                          quoted_text(set),
                          names.empty()  ? "a face set of the mesh, which has none"
                          : near.empty() ? list
                                         : quoted_text(near) + " (nearest name)"});
        return nullptr;
    }
};

/// Elements that are much too stiff for the material, with the element to use; those that carry no
/// shear beside such a resistance to volume are errors.
void check_locking(const SolidInput& input, const VolumeMesh& mesh, const std::string& file,
                   std::vector<Issue>& warnings, std::vector<Issue>& issues)
{
    constexpr double kNoneOfT4 = 0.49999;
    // A pressed block with 4 T10 through it: the largest contact pressure is 4 % too high at 0.45,
    // 10 % at 0.47 and 30 % at 0.49.
    constexpr double kMostPoissonOfT10 = 0.47;
    double nu = input.poisson_ratio;
    bool by_mean = is_hyperelastic(input); // T10 that take the volume at its mean
    if (!input.material.law.empty()) {
        Hyperelastic m{find_law(input.material.law), {}};
        std::copy(input.material.constants.begin(), input.material.constants.end(),
                  m.constants.begin());
        nu = poissons_ratio(m);
        by_mean = m.law->volumetric(m.constants) > 0;
    }
    for (const ElementBlock& block : mesh.blocks) {
        const bool t4 = block.kind == ElementKind::T4 && nu > kMostPoissonOfT4;
        const bool t10 = block.kind == ElementKind::T10 && nu > kMostPoissonOfT10 && !by_mean;
        if (!t4 && !t10) continue;
        const bool none = t4 && nu > kNoneOfT4 * (1 + 1e-9);
        const char* allowed =
            none ? "T10 or H8, which carry it, or a ratio <= 0.49999: T4 would lock altogether"
            : t4 ? "T10 or H8: T4 lock above 0.45, they would be much too stiff"
                 : "H8, or at least 8 elements through what bends: above 0.47 coarse T10 are too "
                   "stiff, and their contact pressures alternate from node to node";
        (none ? issues : warnings)
            .push_back({file, "/bodies/" + input.name,
                        fmt::format("{} with a Poisson's ratio of {:.8g}", t4 ? "T4" : "T10", nu),
                        allowed});
    }
}

/// Bodies that gravity would move if they had mass.
std::vector<Issue> weightless(const Scene& scene)
{
    std::vector<Issue> found;
    const auto note = [&](const std::string& name, const char* place, const char* allowed) {
        found.push_back({scene.file, "/bodies/" + name + place,
                         "none: gravity does not act on " + name, allowed});
    };
    if (scene.gravity.isZero()) return found;
    for (const SolidInput& b : scene.solids)
        if (!(b.density > 0)) note(b.name, "/density", "> 0, to have weight [kg/m^3]");
    for (const RigidInput& b : scene.rigids)
        if (!b.drive.given && !b.mass && !(b.density > 0))
            note(b.name, "/density", "> 0 [kg/m^3], or a mass > 0 [kg], to have weight");
    for (const RodInput& b : scene.rods)
        if (std::ranges::none_of(b.segments, [](const BeamSegment& g) { return g.density > 0; }))
            note(b.name, "/segments", "a density > 0, to have weight [kg/m^3]");
    return found;
}

/// The kind of elements that a scene specifies.
VolumeMesh build_mesh(const MeshInput& m, const Scene& scene, std::vector<Issue>& warnings)
{
    if (m.generate == "box") {
        SolidBoxOptions o;
        o.lowest = m.centre - 0.5 * m.size;
        o.highest = m.centre + 0.5 * m.size;
        for (int i = 0; i < 3; ++i) {
            o.cells[std::size_t(i)] = std::int32_t(m.cells[i]);
            o.grading[std::size_t(i)] = m.grading[i];
        }
        o.kind = element_kind(m.element);
        return make_solid_box(o);
    }
    if (m.generate == "ball")
        return make_solid_ball({m.centre, m.radius, m.around, element_kind(m.element)});
    if (m.generate == "cylinder")
        return make_solid_cylinder(
            {m.centre, m.axis, m.radius, m.length, m.around, m.along, element_kind(m.element)});
    if (m.generate == "tube") {
        SurfaceInput s;
        s.centreline = m.centreline;
        s.radius = m.radius;
        return make_solid_tube({build_centreline(s, scene), m.thickness, m.around, m.through,
                                m.along, element_kind(m.element)});
    }
    const std::string path = beside(scene, m.file);
    VolumeFile file = read_volume(path, m.scale.x());
    stretch_axes(file.mesh.nodes, m.scale);
    if (!file.cut.empty())
        warnings.push_back({file.cut, "", "a last line without an end", "a whole file"});
    return std::move(file.mesh);
}

constexpr double kMemoryShare = 0.95; // of what is free

/// Refuses a generated mesh that would need more memory than is available, before it is made.
void refuse_mesh(const SolidInput& input, const Scene& scene, std::vector<Issue>& issues)
{
    const MeshInput& m = input.mesh;
    double cells = 0;
    if (m.generate == "box") cells = m.cells.prod();
    if (m.generate == "ball") cells = std::pow(m.around, 3);
    if (m.generate == "cylinder") cells = double(m.around) * m.around * m.along;
    if (m.generate == "tube") cells = double(m.around) * m.through * m.along;
    const double nodes = m.element == "T10" ? 8 * cells : cells;
    const double need = mesh_memory(nodes, m.element == "H8" ? cells : 6 * cells),
                 free = available_memory();
    if (need > kMemoryShare * free)
        issues.push_back({scene.file, "/bodies/" + input.name + "/mesh",
                          fmt::format("about {:.3g} nodes: {:.3g} GB of memory by prediction, "
                                      "{:.3g} GB are free",
                                      nodes, need / 1e9, free / 1e9),
                          "fewer cells"});
}

StartOverlap start_overlap(const ContactLaw& law)
{
    return law.start_overlap == "resolve" ? StartOverlap::resolve
           : law.start_overlap == "close" ? StartOverlap::close
                                          : StartOverlap::refuse;
}

/// The friction of an instrument's segments is used with all bodies that it touches, except other
/// rods.
void set_friction_of_segments(ContactPair& p, const std::vector<BeamSegment>& segments)
{
    if (std::ranges::none_of(segments, [](const BeamSegment& s) { return s.friction.has_value(); }))
        return;
    const double of_pair = std::exchange(p.friction, 0);
    for (const BeamSegment& s : segments) {
        p.friction_of_segment.push_back(s.friction.value_or(of_pair));
        p.friction = std::max(p.friction, p.friction_of_segment.back());
    }
}

/// Where a rod that hangs comes down on something it bends within (EI / w)^(1/3), w its weight per
/// length: elements longer than that pass below a surface that only their nodes touch.
/// @return  half the shortest such element [m]; 0: there is none
double slack_spacing(const RodInput& rod, const Vec3& gravity)
{
    double shortest = 0;
    for (const BeamSegment& s : rod.segments) {
        const double area =
                         std::numbers::pi * (s.radius * s.radius - s.inner_radius * s.inner_radius),
                     weight = s.density * area * gravity.norm(), EI = std::min(s.EI[0], s.EI[1]);
        const bool slack = s.element * s.element * s.element * weight > EI;
        if (slack && !(shortest > 0 && shortest < s.element)) shortest = s.element;
    }
    return 0.5 * shortest;
}

} // namespace

RigidShape build_shape(const ShapeInput& s, const Scene& scene, std::vector<Issue>& warnings)
{
    if (s.generate == "box") return Box{0.5 * s.size, s.points};
    if (s.generate == "ball") return Ball{s.radius};
    if (s.generate == "cylinder") return Cylinder{s.radius, 0.5 * s.length, s.points};
    if (s.generate == "ellipsoid") return Ellipsoid{s.radii};
    if (s.generate == "capsule") return Capsule{s.radius, 0.5 * s.length};
    if (s.generate == "wedge") return make_wedge(s.outline, s.length);
    const std::string path = beside(scene, s.file);
    SurfaceMesh mesh = read_surface(path, s.scale.x(), nullptr);
    stretch_axes(mesh.points, s.scale);
    orient_consistently(mesh);
    for (Issue& odd : size_warnings(mesh.points, path))
        warnings.push_back(std::move(odd));
    return make_triangle_shape(std::move(mesh), path);
}

TimeRule time_rule(const TimeInput& time)
{
    return time.rule == "generalised_alpha" ? generalised_alpha(time.spectral_radius)
                                            : theta_rule(time.theta);
}

namespace {

/// What steps at rest cannot do with rods that only couplings hold.
void check_joined_rods(const Scene& scene, const BodySystem& system)
{
    std::vector<Issue> issues;
    std::set<int> joined;
    for (const Coupling& c : system.couplings)
        joined.insert({c.a.body, c.b.body});
    if (!system.rods_alone() || scene.accuracy.solver != "auto") {
        for (const int b : joined) {
            if (b < 0 || !system.refs[std::size_t(b)].rod) continue;
            const std::vector<std::string> free = system.refs[std::size_t(b)].rod->free_motions();
            if (free.empty()) continue;
            issues.push_back(
                {scene.file, "/bodies/" + system.refs[std::size_t(b)].name,
                 "a rod that only couplings keep from a " + free.front() +
                     (system.rods_alone() ? ", and \"accuracy\" with a solver of its own"
                                          : ", at rest beside bodies that can move"),
                 system.rods_alone() ? "\"solver\": \"auto\""
                                     : "a hold of the rod, bodies that are held or driven, or "
                                       "\"kind\": \"dynamic\""});
        }
        if (!issues.empty()) throw InputError(std::move(issues));
        return;
    }
    const FreeMotion free = free_motion_of_rods(system.refs, system.couplings);
    if (free.body < 0) return;
    const std::string& name = system.refs[std::size_t(free.body)].name;
    issues.push_back(
        {scene.file, "/bodies/" + name,
         "a rod in a mechanism: neither holds nor couplings prevent its " + free.motion,
         "a hold or a coupling that does (a \"hinge\" or a \"weld\" stops turns, a "
         "\"ball\" none), or \"drag\", a medium that resists every motion"});
    throw InputError(std::move(issues));
}

} // namespace

std::unique_ptr<BodySystem> build_bodies(const Scene& scene, const std::vector<Obstacle>& obstacles,
                                         std::vector<Issue>& warnings, bool refuse)
{
    std::vector<Issue> issues;
    const ContactLaw* rest_law = nullptr;

    // ---- Checks: laws, names, meshes
    // The operator of a hand needs all pairs of its handle.
    const std::vector<ContactLaw> laws =
        written_out(scene, scene.haptic.given ? nullptr : &rest_law);
    const std::size_t named = std::size_t(
        std::count_if(scene.contact.begin(), scene.contact.end(), [](const ContactLaw& l) {
            return l.between[0] != "*" && l.between[1] != "*";
        }));
    auto system = std::make_unique<BodySystem>();
    std::vector<std::size_t> order; // of scene.order: solids, rigids in the scene's order
    std::vector<VolumeMesh> meshes(scene.solids.size());
    std::vector<ExternalSurface> outsides(scene.solids.size());
    std::vector<SolidInput> solids = scene.solids;
    for (std::size_t i = 0; i < scene.solids.size(); ++i) {
        const SolidInput& input = scene.solids[i];
        const std::string place = "/bodies/" + input.name + "/mesh";
        refuse_mesh(input, scene, issues);
        if (!issues.empty()) continue;
        try {
            meshes[i] = build_mesh(input.mesh, scene, warnings);
            const std::string file =
                input.mesh.file.empty() ? scene.file : beside(scene, input.mesh.file);
            VolumeReport report = check_volume(meshes[i]);
            add_issues(errors_of(report, meshes[i], file), scene, place, issues);
            const std::vector<Issue> odd = warnings_of(report, meshes[i], file);
            warnings.insert(warnings.end(), odd.begin(), odd.end());
            check_locking(input, meshes[i], scene.file, warnings, issues);
            outsides[i] = std::move(report.surface);
            add_sets(input, meshes[i], outsides[i], scene.file);
            place_probes(solids[i], meshes[i], scene.file);
            turn_with_mesh(solids[i], meshes[i]);
        } catch (const InputError& error) {
            add_issues(error.issues(), scene, place, issues);
        }
    }
    if (!issues.empty()) throw InputError(std::move(issues));

    // ---- Which nodes may touch, by the pairs of the laws
    // Pairs first: they specify which nodes may touch.
    Built built{scene, *system, issues, {}};
    std::unordered_map<std::string, int> solid_number;
    for (std::size_t i = 0; i < scene.solids.size(); ++i)
        solid_number.emplace(scene.solids[i].name, int(i));
    const auto solid_index = [&](const std::string& name) {
        const auto at = solid_number.find(name);
        return at == solid_number.end() ? -1 : at->second;
    };
    std::unordered_set<std::string> rigid_names, free_rigids;
    for (const RigidInput& r : scene.rigids) {
        rigid_names.insert(r.name);
        if (!r.drive.given) free_rigids.insert(r.name);
    }
    std::unordered_map<std::string, const RodInput*> rods;
    for (const RodInput& r : scene.rods)
        rods.emplace(r.name, &r);
    std::vector<std::vector<char>> touching(scene.solids.size());
    std::vector<int> all_pairs(scene.solids.size(), 0), small_pairs(scene.solids.size(), 0);
    std::vector<std::array<const ContactSurface*, 2>> surfaces(laws.size(), {nullptr, nullptr});
    for (std::size_t k = 0; k < laws.size(); ++k) {
        const ContactLaw& law = laws[k];
        const bool no_mesh = std::ranges::any_of(law.between, [&](const std::string& name) {
            return rigid_names.count(name) + rods.count(name) > 0;
        });
        for (std::size_t side = 0; side < 2; ++side) {
            const int i = solid_index(law.between[side]);
            if (i < 0) continue;
            const VolumeMesh& mesh = meshes[std::size_t(i)];
            const std::size_t before = system->surfaces.size();
            const ContactSurface* s = built.surface(
                law.between[side], mesh, outsides[std::size_t(i)], law.surfaces[side], k, side);
            surfaces[k][side] = s;
            touching[std::size_t(i)].resize(mesh.nodes.size(), 0);
            if (s && system->surfaces.size() > before)
                for (const std::int32_t node : s->outside.used_nodes)
                    touching[std::size_t(i)][std::size_t(node)] = 1;
            ++all_pairs[std::size_t(i)];
            small_pairs[std::size_t(i)] += law.sliding == "small" && !no_mesh;
        }
    }

    // ---- Linear solver
    system->linear = choose_linear(scene, solids, meshes, obstacles, laws, surfaces, !refuse);
    if (refuse && !system->linear.refusal.empty()) {
        issues.push_back(
            {scene.file, "/solver/linear", system->linear.refusal,
             "a way that is possible and fits (amontons check states what each costs)"});
        throw InputError(std::move(issues));
    }
    const bool iterative = !meshes.empty() && system->linear.taken != "direct";

    // ---- Bodies, in the order of the scene
    for (const std::string& name : scene.order) {
        if (const int i = solid_index(name); i >= 0) {
            const SolidInput& input = solids[std::size_t(i)];
            const bool small = all_pairs[std::size_t(i)] > 0 &&
                               all_pairs[std::size_t(i)] == small_pairs[std::size_t(i)];
            try {
                const bool condensed = !iterative && scene.time.kind != "dynamic" &&
                                       input.motion == "linear" && !is_hyperelastic(input) &&
                                       std::ranges::none_of(input.hold, &HoldInput::affine) &&
                                       scene.couplings.empty(); // they may hold nodes inside
                const auto make = [&]<class Solid>() -> std::unique_ptr<SolidBody> {
                    return std::make_unique<Solid>(input, std::move(meshes[std::size_t(i)]), small,
                                                   touching[std::size_t(i)], scene.file);
                };
                std::unique_ptr<SolidBody> body =
                    condensed ? make.operator()<CondensedSolid>() : make.operator()<SolidBody>();
                warnings.insert(warnings.end(), body->warnings().begin(), body->warnings().end());
                if (iterative) body->iterate(system->linear.taken == "distributed");
                if (iterative && scene.time.kind != "dynamic" && !body->free_motions().empty())
                    issues.push_back({scene.file, "/solver/linear",
                                      quoted_text(system->linear.taken) + ", and " + name +
                                          " is free in its " + body->free_motions().front(),
                                      "\"direct\" where contacts alone hold a body"});
                system->refs.push_back({body.get(), nullptr, body.get(), name});
                system->bodies.push_back(std::move(body));
            } catch (const InputError& error) {
                add_issues(error.issues(), scene, "/bodies/" + name, issues);
            }
        }
        for (const RodInput& input : scene.rods) {
            if (input.name != name) continue;
            try {
                std::optional<Centreline> curve;
                if (input.shape.has_curve()) {
                    SurfaceInput s;
                    s.centreline = input.shape.curve;
                    s.radius = 1e-9 * input.segments.front().length; // no tube: bends of any radius
                    curve = build_centreline(s, scene);
                }
                std::vector<Vec3> joined;
                for (const CouplingInput& c : scene.couplings)
                    for (std::size_t side = 0; side < 2; ++side)
                        if (c.between[side] == name)
                            joined.push_back(side == 1 && c.to ? *c.to : c.at);
                RodInput own = input;
                if (own.contact_spacing == 0)
                    own.contact_spacing = slack_spacing(own, scene.gravity);
                auto body = std::make_unique<RodBody>(own, curve ? &*curve : nullptr,
                                                      scene.time.damping, joined);
                if (scene.time.kind == "dynamic") body->start_with_feed();
                system->refs.push_back({body.get(), nullptr, nullptr, name, body.get()});
                system->bodies.push_back(std::move(body));
            } catch (const InputError& error) {
                std::vector<Issue> found = error.issues();
                for (Issue& issue : found)
                    if (issue.file.empty()) {
                        issue.file = scene.file;
                        issue.place = "/bodies/" + name + issue.place;
                    }
                issues.insert(issues.end(), found.begin(), found.end());
            }
        }
        for (const RigidInput& input : scene.rigids) {
            if (input.name != name) continue;
            try {
                RigidShape shape = build_shape(input.shape, scene, warnings);
                const MassProperties mass = mass_of(input, shape);
                auto body = std::make_unique<RigidBody>(input, std::move(shape), mass);
                system->refs.push_back({body.get(), body.get(), nullptr, name});
                system->bodies.push_back(std::move(body));
            } catch (const InputError& error) {
                add_issues(error.issues(), scene, "/bodies/" + name + "/shape", issues);
            }
        }
    }
    if (!issues.empty()) throw InputError(std::move(issues));

    // ---- Rods at rest: what holds them
    if (scene.time.kind != "dynamic") {
        // Rods that neither holds nor contacts nor couplings constrain have no balance.
        std::set<std::string> in_contact;
        for (const ContactLaw& law : laws)
            if (law.between[0] != law.between[1])
                in_contact.insert(law.between.begin(), law.between.end());
        if (rest_law && free_rigids.size() > 1)
            in_contact.insert(free_rigids.begin(), free_rigids.end());
        std::set<std::string> joined;
        for (const CouplingInput& c : scene.couplings)
            joined.insert(c.between.begin(), c.between.end());
        in_contact.insert(joined.begin(), joined.end());
        for (const BodyRef& b : system->refs) {
            if (b.rod && joined.count(b.name)) continue; // with all that they are joined to
            if ((in_contact.count(b.name) && !b.rod) || (b.rigid && b.rigid->driven())) continue;
            std::string motions = b.rigid ? "every shift and turn" : "";
            if (b.solid || b.rod)
                for (const std::string& m : b.rod ? b.rod->free_motions() : b.solid->free_motions())
                    motions += (motions.empty() ? "" : "; ") + m;
            if (motions.empty()) continue;
            // Rods alone are solved on their own matrix, in which contacts can hold them.
            if (b.rod && in_contact.count(b.name) && scene.couplings.empty() &&
                system->rods_alone() && scene.accuracy.solver == "auto" &&
                !scene.contact_solver.given() && !(scene.time.path > 0)) {
                b.rod->stabilise_with_contacts();
                continue;
            }
            issues.push_back({scene.file, "/bodies/" + b.name, "nothing prevents: " + motions,
                              b.rod ? "a hold that does, or \"drag\", a medium that resists "
                                      "every motion"
                                    : "a hold, a drive, a contact or a coupling that does"});
        }
        if (!issues.empty()) throw InputError(std::move(issues));
    }

    // ---- Surfaces, walls and pairs
    std::vector<const Wall*> walls;
    for (const Obstacle& o : obstacles)
        walls.push_back(&o.model.wall);
    for (std::size_t b = 0; b < system->refs.size(); ++b)
        built.number.emplace(system->refs[b].name, int(b));
    for (auto& [of, surface] : system->surfaces)
        surface.sharp = sharp_features(
            surface.outside, system->refs[std::size_t(built.find(of.first))].solid->mesh().nodes);
    std::unordered_map<std::string, int> obstacle_number;
    for (std::size_t o = 0; o < obstacles.size(); ++o)
        obstacle_number.emplace(obstacles[o].name, int(o));
    std::unordered_map<std::string, Pose> planes;
    for (const ObstacleInput& o : scene.obstacles)
        if (o.surface.generate == "plane")
            planes[o.name] =
                Pose{o.surface.centre, rotation_between(Vec3::UnitZ(), o.surface.axis)};
    std::vector<ContactPair> pairs;
    pairs.reserve(laws.size());
    for (std::size_t k = 0; k < laws.size(); ++k) {
        const ContactLaw& law = laws[k];
        ContactPair p;
        p.friction = law.friction;
        p.restitution = law.restitution;
        p.named = k < named;
        p.nodal = law.discretisation == "nodal";
        p.start_overlap = start_overlap(law);
        int body[2];
        for (std::size_t side = 0; side < 2; ++side) {
            body[side] = built.find(law.between[side]);
            if (body[side] >= 0) continue;
            const auto obstacle = obstacle_number.find(law.between[side]);
            if (obstacle != obstacle_number.end()) p.obstacle = obstacle->second;
            const auto plane = planes.find(law.between[side]);
            if (plane != planes.end()) p.plane = plane->second;
        }
        bool swap = body[0] < 0;
        if (!swap && body[1] >= 0 && body[0] != body[1]) {
            const BodyRef &a = system->refs[std::size_t(body[0])],
                          &b = system->refs[std::size_t(body[1])];
            if (a.solid && b.solid) {
                const auto second_is_slave = [&](bool covered_first) {
                    return !first_is_slave(surfaces[k][0]->outside, a.solid->places(),
                                           a.solid->stiffness(), surfaces[k][1]->outside,
                                           b.solid->places(), b.solid->stiffness(), covered_first);
                };
                // Where no surfaces are named rims have rows of their own, and both sides are held.
                const bool faces_alone = !law.surfaces[0].empty() && !law.surfaces[1].empty() &&
                                         scene.time.kind != "dynamic" && !p.nodal &&
                                         law.sliding != "small";
                const bool by_mesh = second_is_slave(false);
                swap = faces_alone ? second_is_slave(true) : by_mesh;
                p.names_b = swap != by_mesh;
            } else if (a.rod && b.rod) {
                swap = a.rod->lies_in(*b.rod); // the outer one first
            } else
                swap = !a.rod && (b.rod || (b.solid && !a.solid)); // rods first, then solids
        }
        p.surface_a = surfaces[k][swap ? 1 : 0];
        p.surface_b = surfaces[k][swap ? 0 : 1];
        p.a = body[swap ? 1 : 0];
        p.b = body[swap ? 0 : 1];
        if (p.b < 0 || !system->refs[std::size_t(p.b)].rod)
            if (const auto rod = rods.find(system->refs[std::size_t(p.a)].name); rod != rods.end())
                set_friction_of_segments(p, rod->second->segments);
        if (system->refs[std::size_t(p.a)].rod) p.end_a = law.surfaces[swap ? 1 : 0];
        p.small = law.sliding == "small" && system->refs[std::size_t(p.a)].solid &&
                  (p.b < 0 || system->refs[std::size_t(p.b)].solid);
        double size = system->refs[std::size_t(p.a)].body->size();
        if (p.b >= 0) size = std::min(size, system->refs[std::size_t(p.b)].body->size());
        set_reach(p, law.reach, size);
        if (const RodBody* rod = system->refs[std::size_t(p.a)].rod; rod && !(law.reach > 0)) {
            p.reach = rod->contact_reach();
            if (p.b >= 0 && system->refs[std::size_t(p.b)].rod)
                p.reach = std::max(p.reach, system->refs[std::size_t(p.b)].rod->contact_reach());
            p.margin = p.reach;
        }
        if (const BodyRef& a = system->refs[std::size_t(p.a)]; a.rod && p.surface_b) {
            const std::span<const CurvePlace> own = a.rod->whole_stations();
            if (!p.end_a.empty())
                p.stations = face_stations(p.end_a == "start" ? own.first(1) : own.last(1));
            else if (rods.at(a.name)->contact_spacing > 0)
                p.stations = face_stations(own);
            else
                p.stations = face_stations(a.rod->curve(), p.surface_b->outside,
                                           system->refs[std::size_t(p.b)].solid->places());
        }
        pairs.push_back(std::move(p));
    }

    // ---- Pairs of all that no law names; the finder
    std::optional<DefaultLaw> rest;
    if (rest_law) {
        rest = DefaultLaw{rest_law->friction,
                          rest_law->restitution,
                          rest_law->reach,
                          start_overlap(*rest_law),
                          {}};
        const auto is_free = [&](int b) {
            const RigidBody* rigid = system->refs[std::size_t(b)].rigid;
            return rigid && !rigid->driven();
        };
        for (const ContactPair& p : pairs)
            if (p.b >= 0 && is_free(p.a) && is_free(p.b))
                rest->others.insert(std::minmax(p.a, p.b));
        const std::size_t n = free_rigids.size();
        if (rest->others.size() == n * (n - 1) / 2) rest.reset(); // nothing is left
    }
    system->finder = ContactFinder(std::move(pairs), std::move(walls), std::move(rest));

    // ---- State at the start: overlaps, rules of time
    for (const Obstacle& o : obstacles)
        system->obstacles.push_back(o.name);
    if (std::vector<Issue> inside = start_overlaps(*system, scene, obstacles); !inside.empty())
        throw InputError(std::move(inside));
    if (scene.time.kind != "dynamic") system->finder.keep_to_contacts(system->refs);
    system->couplings = make_couplings(scene, system->refs, system->patches);
    system->coupling_memory = begin_memory(system->refs, system->couplings);
    if (scene.time.kind != "dynamic" && system->has_rods() && !system->couplings.empty())
        check_joined_rods(scene, *system);
    for (Issue& none : weightless(scene))
        warnings.push_back(std::move(none));
    if (scene.time.kind == "dynamic" && time_rule(scene.time).end < 1)
        for (Issue& jolt : jolts(scene, system->refs, system->couplings))
            warnings.push_back(std::move(jolt));
    return system;
}

} // namespace amontons
