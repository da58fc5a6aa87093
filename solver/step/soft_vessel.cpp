#include "solver/step/soft_vessel.hpp"

#include "mesh/base/curve.hpp"
#include "mesh/volume_check.hpp"
#include "solver/body/hyperelastic_input.hpp"
#include "solver/body/solid_conditions.hpp"
#include "solver/body/solid_sets.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/solid/assembly.hpp"
#include "solver/solid/material.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {
namespace {

SolidTubeOptions tube_of(const SolidInput& input, const Scene& scene)
{
    const MeshInput& m = input.mesh;
    SurfaceInput s;
    s.centreline = m.centreline;
    s.radius = m.radius;
    return {build_centreline(s, scene),
            m.thickness,
            m.around,
            m.through,
            m.along,
            m.element == "H8" ? ElementKind::H8 : ElementKind::T10};
}

/// @param follows  out: pressures, if they are to follow their faces
SoftTubeSupport support_of(const SolidInput& input, const VolumeMesh& mesh, const Scene& scene,
                           std::vector<WallPressure>* follows)
{
    const SolidConditions conditions = find_conditions(input, mesh, scene.file);
    SoftTubeSupport s;
    for (const SolidConditions::Held& held : conditions.held)
        s.fixed.push_back(held.dof);
    s.load = Eigen::VectorXd::Zero(3 * Eigen::Index(mesh.nodes.size()));
    for (const SolidConditions::Load& load : conditions.loads) {
        const LoadInput& l = *load.input;
        const double factor = l.over.empty() ? 1 : curve_value(l.over, 0);
        if (load.pressure.size() > 0 && follows)
            follows->push_back({load.faces->members, curve_value(l.pressure, 0)});
        else if (load.pressure.size() > 0)
            s.load += curve_value(l.pressure, 0) * load.pressure;
        if (l.traction)
            for (Eigen::Index i = 0; i < load.traction.size(); ++i)
                s.load.segment<3>(3 * i) += load.traction[i] * factor * *l.traction;
        if (l.force)
            for (const std::int32_t node : load.nodes)
                s.load.segment<3>(3 * Eigen::Index(node)) +=
                    factor / double(load.nodes.size()) * *l.force;
    }
    if (input.density > 0 && scene.gravity != Vec3::Zero()) {
        const SolidMaterial material{input.youngs_modulus, input.poisson_ratio, input.density};
        add_weight(mesh, {&material, 1}, scene.gravity, s.load);
    }
    return s;
}

} // namespace

std::vector<SoftVessel> build_soft_vessels(const Scene& scene)
{
    std::vector<SoftVessel> all;
    std::vector<Issue> issues;
    for (const SolidInput& input : scene.solids) {
        try {
            const SolidTubeOptions tube = tube_of(input, scene);
            VolumeMesh mesh = make_solid_tube(tube);
            // Of sizes that are too far apart elements are flat but for rounding.
            const VolumeReport report = check_volume(mesh);
            std::vector<Issue> faults = errors_of(report, mesh, scene.file);
            for (Issue& fault : faults)
                fault.place = "/bodies/" + input.name + "/mesh: " + fault.place;
            if (!faults.empty()) throw InputError(std::move(faults));
            add_sets(input, mesh, report.surface, scene.file);
            if (is_hyperelastic(input)) {
                WallMaterial material;
                material.law = hyperelastic_of(input, scene.file);
                material.elements = hyperelastic_elements(input, material.law, mesh, scene.file);
                const SoftTubeSupport support = support_of(input, mesh, scene, &material.pressures);
                all.push_back(
                    {input.name, std::make_unique<SoftTube>(tube, std::move(mesh),
                                                            std::move(material), support)});
                continue;
            }
            const SoftTubeSupport support = support_of(input, mesh, scene, nullptr);
            const SolidMaterial material{input.youngs_modulus, input.poisson_ratio, input.density};
            all.push_back(
                {input.name, std::make_unique<SoftTube>(tube, std::move(mesh), material, support)});
        } catch (const InputError& error) {
            for (Issue issue : error.issues()) {
                if (issue.file.empty()) {
                    issue.file = scene.file;
                    const bool own =
                        issue.place.starts_with("/hold") || issue.place.starts_with("/loads");
                    issue.place = "/bodies/" + input.name + (own ? "" : "/mesh") + issue.place;
                }
                issues.push_back(std::move(issue));
            }
        }
    }
    if (!issues.empty()) throw InputError(std::move(issues));
    return all;
}

namespace {

void save(const Eigen::VectorXd& v, ByteWriter& out)
{
    for (const double x : v)
        out.value(x);
}

Eigen::VectorXd read(const SoftTube& tube, ByteReader& in)
{
    Eigen::VectorXd v(3 * Eigen::Index(tube.mesh().nodes.size()));
    for (double& x : v)
        x = in.value<double>();
    if (!v.allFinite()) ByteReader::refuse("a wall with a coordinate that is not finite");
    return v;
}

} // namespace

void save_tangent(const SoftTube& tube, ByteWriter& out)
{
    if (tube.hyperelastic()) save(*tube.tangent_at(), out);
}

Eigen::VectorXd read_tangent(const SoftTube& tube, ByteReader& in)
{
    return tube.hyperelastic() ? read(tube, in) : Eigen::VectorXd();
}

void restore_tangent(SoftTube& tube, const Eigen::VectorXd& at)
{
    if (!tube.hyperelastic() || at == *tube.tangent_at()) return;
    if (!tube.relinearise(std::make_shared<const Eigen::VectorXd>(at)))
        ByteReader::refuse("a wall without a tangent");
}

void save_walls(const WireState& state, const std::vector<WireWall>& walls, ByteWriter& out)
{
    for (std::size_t w = 0; w < state.wall.size(); ++w) {
        if (!state.wall[w]) continue;
        const WallState& s = *state.wall[w];
        out.value(s.tangent_at == walls[w].soft->tangent_at());
        save(s.u, out);
        save(s.off, out);
        save(s.offset, out);
        out.value(s.energy);
        for (const HyperelasticState& e : s.elements) {
            for (const double mode : e.modes)
                out.value(mode);
            out.value(e.energy);
            out.value(e.least_volume);
        }
    }
}

std::vector<std::shared_ptr<WallState>> read_walls(const std::vector<WireWall>& walls,
                                                   ByteReader& in)
{
    std::vector<std::shared_ptr<WallState>> all;
    for (const WireWall& w : walls) {
        all.emplace_back();
        if (!w.soft || !w.soft->hyperelastic()) continue;
        all.back() = std::make_shared<WallState>();
        WallState& s = *all.back();
        if (!in.value<bool>()) s.tangent_at = std::make_shared<const Eigen::VectorXd>();
        s.u = read(*w.soft, in);
        s.off = read(*w.soft, in);
        s.offset = read(*w.soft, in);
        s.energy = in.value<double>();
        s.elements = w.soft->at_rest()->elements;
        for (HyperelasticState& e : s.elements) {
            for (double& mode : e.modes)
                mode = in.value<double>();
            e.energy = in.value<double>();
            e.least_volume = in.value<double>();
        }
    }
    return all;
}

double wall_motion(const SoftVessel& vessel)
{
    if (vessel.tube->hyperelastic()) return 0;
    const Eigen::VectorXd u = vessel.tube->whole_displacement();
    double most = 0;
    for (Eigen::Index i = 0; i + 2 < u.size(); i += 3)
        most = std::max(most, u.segment<3>(i).norm());
    return most;
}

std::string wall_warning(const SoftVessel& vessel, double moved)
{
    constexpr double kOfRadius = 0.1;
    const double radius = vessel.tube->radius_scale();
    if (!(moved >= kOfRadius * radius)) return "";
    return fmt::format(
        "{} is linear, but its wall moved by {:.2g} m, {:.0f} % of the lumen's radius: "
        "displacements and forces may be far off; a \"material\" of it takes large "
        "ones",
        vessel.name, moved, 100 * moved / radius);
}

BodyRecord record_vessel(const SoftVessel& vessel)
{
    const SoftTube& tube = *vessel.tube;
    const VolumeMesh& mesh = tube.mesh();
    const Eigen::VectorXd u = tube.whole_displacement(), f = tube.nodal_forces();
    BodyRecord r;
    r.name = vessel.name;
    r.elements = &mesh;
    Field moved{"displacement", "m", 3, {u.data(), u.data() + u.size()}},
        force{"contact_force", "N", 3, {f.data(), f.data() + f.size()}},
        stress{"stress", "Pa", 6, {}}, mises{"von_mises", "Pa", 1, {}};
    const auto add = [&](const Vec6& s) {
        stress.values.insert(stress.values.end(), s.data(), s.data() + 6);
        mises.values.push_back(von_mises(s));
    };
    const WallMaterial* beyond = tube.hyperelastic();
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
        r.points.push_back(mesh.nodes[i] + u.segment<3>(3 * Eigen::Index(i)));
    const Mat6 C = elasticity_matrix(tube.material());
    for_each_element(mesh, [&](std::int32_t e, ElementKind kind, auto nodes) {
        const ElementPlaces X = places_of(mesh, nodes);
        ElementVector own(3 * Eigen::Index(nodes.size()));
        for (std::size_t i = 0; i < nodes.size(); ++i)
            own.segment<3>(3 * Eigen::Index(i)) = u.segment<3>(3 * nodes[i]);
        if (beyond) {
            const ElementPlaces x = X + own.reshaped(3, X.cols());
            add(hyperelastic_mean(beyond->elements[std::size_t(e)], beyond->law, x,
                                  tube.state().elements[std::size_t(e)])
                    .stress);
            return;
        }
        const Vec3 centre = kind == ElementKind::H8 ? Vec3(0, 0, 0) : Vec3(0.25, 0.25, 0.25);
        add(C * solid_strain(kind, X, own, solid_internal_modes(kind, X, C, own), centre));
    });
    r.point_fields = {std::move(moved), std::move(force)};
    r.cell_fields = {std::move(stress), std::move(mises)};
    return r;
}

} // namespace amontons
