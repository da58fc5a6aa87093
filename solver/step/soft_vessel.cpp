#include "solver/step/soft_vessel.hpp"

#include "mesh/base/curve.hpp"
#include "solver/body/solid_conditions.hpp"
#include "solver/scene/build.hpp"
#include "solver/solid/assembly.hpp"

#include <algorithm>
#include <cmath>

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

SoftTubeSupport support_of(const SolidInput& input, const VolumeMesh& mesh, const Scene& scene)
{
    const SolidConditions conditions = find_conditions(input, mesh, scene.file);
    SoftTubeSupport s;
    for (const SolidConditions::Held& held : conditions.held)
        s.fixed.push_back(held.dof);
    s.load = Eigen::VectorXd::Zero(3 * Eigen::Index(mesh.nodes.size()));
    for (const SolidConditions::Load& load : conditions.loads) {
        const LoadInput& l = *load.input;
        const double factor = l.over.empty() ? 1 : curve_value(l.over, 0);
        if (load.pressure.size() > 0) s.load += curve_value(l.pressure, 0) * load.pressure;
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

double von_mises(const Vec6& s)
{
    const double a = s[0] - s[1], b = s[1] - s[2], c = s[2] - s[0];
    return std::sqrt(0.5 * (a * a + b * b + c * c) + 3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
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
            const SoftTubeSupport support = support_of(input, mesh, scene);
            const SolidMaterial material{input.youngs_modulus, input.poisson_ratio, input.density};
            all.push_back(
                {input.name, std::make_unique<SoftTube>(tube, std::move(mesh), material, support)});
        } catch (const InputError& error) {
            for (Issue issue : error.issues()) {
                if (issue.file.empty()) {
                    issue.file = scene.file;
                    issue.place = "/bodies/" + input.name +
                                  (issue.place.starts_with("/hold") ? "" : "/mesh") + issue.place;
                }
                issues.push_back(std::move(issue));
            }
        }
    }
    if (!issues.empty()) throw InputError(std::move(issues));
    return all;
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
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
        r.points.push_back(mesh.nodes[i] + u.segment<3>(3 * Eigen::Index(i)));
    const Mat6 C = elasticity_matrix(tube.material());
    for_each_element(mesh, [&](std::int32_t, ElementKind kind, auto nodes) {
        const ElementPlaces X = places_of(mesh, nodes);
        ElementVector own(3 * Eigen::Index(nodes.size()));
        for (std::size_t i = 0; i < nodes.size(); ++i)
            own.segment<3>(3 * Eigen::Index(i)) = u.segment<3>(3 * nodes[i]);
        const Vec3 centre = kind == ElementKind::H8 ? Vec3(0, 0, 0) : Vec3(0.25, 0.25, 0.25);
        const Vec6 s =
            C * solid_strain(kind, X, own, solid_internal_modes(kind, X, C, own), centre);
        stress.values.insert(stress.values.end(), s.data(), s.data() + 6);
        mises.values.push_back(von_mises(s));
    });
    r.point_fields = {std::move(moved), std::move(force)};
    r.cell_fields = {std::move(stress), std::move(mises)};
    return r;
}

} // namespace amontons
