#include "solver/body/solid_tangent.hpp"
#include "solver/body/node_index.hpp"

#include "mesh/base/curve.hpp"
#include "solver/solid/face_load.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {

VolumeLoads volume_loads(const SolidModel& model)
{
    VolumeLoads volumes;
    for (std::size_t i = 0; i < model.conditions.loads.size(); ++i)
        if (!model.conditions.loads[i].input->volume.empty()) volumes.loads.push_back({i, 0, 0});
    return volumes;
}

Eigen::VectorXd load_forces(const SolidModel& model, const StepInput& step,
                            const VolumeLoads& volumes, const SolidMotion& m, double t)
{
    Eigen::VectorXd f = Eigen::VectorXd::Zero(at3(model.mesh.nodes.size()));
    const auto of_frame = [&](const Vec3& v) { return Vec3(m.frame.turn.conjugate() * v); };
    for (const SolidConditions::Load& load : model.conditions.loads) {
        const LoadInput& l = *load.input;
        const double factor = step.load * (l.over.empty() ? 1 : curve_value(l.over, t));
        if (load.pressure.size() > 0) {
            const double p = step.load * curve_value(l.pressure, t);
            if (!model.nonlinear())
                f += p * load.pressure;
            else
                f += follower_pressure(model.mesh, load.faces->members, m.u, p);
        }
        if (l.traction) {
            const Vec3 traction = of_frame(factor * *l.traction);
            for (const std::int32_t node : load.nodes)
                f.segment<3>(3 * node) += load.traction[node] * traction;
        }
        if (l.force)
            for (const std::int32_t node : load.nodes)
                f.segment<3>(3 * node) += of_frame(factor * *l.force) / double(load.nodes.size());
    }
    for (const VolumeLoads::Load& v : volumes.loads)
        f += follower_pressure(model.mesh, model.conditions.loads[v.load].faces->members, m.u,
                               v.pressure);
    if (model.material.density > 0 && !step.gravity.isZero(0))
        Eigen::Map<Eigen::Matrix3Xd>(f.data(), 3, f.size() / 3).noalias() +=
            of_frame(step.gravity) * model.weights->transpose();
    return f; // along the frame's axes
}

double volumes_missing(const SolidModel& model, const StepInput& step, const VolumeLoads& volumes,
                       const SolidMotion& now)
{
    constexpr double kSmall = 1e-6; // of the body's size, cubed: a volume of 0 has no scale
    double worst = 0;
    for (const VolumeLoads::Load& v : volumes.loads) {
        const SolidConditions::Load& load = model.conditions.loads[v.load];
        const double target = curve_value(load.input->volume, step.end());
        const double scale = std::abs(target) + kSmall * model.size * model.size * model.size;
        worst = std::max(
            worst, std::abs(target - swept_volume(model.mesh, load.faces->members, now.u)) / scale);
    }
    return worst;
}

Eigen::SparseMatrix<double>
assemble_hyperelastic(const SolidModel& model, const SolidUnknowns& unknowns, const StepInput& step,
                      const HyperelasticPart& hyper, const VolumeLoads& volumes, SparseMatrix& S)
{
    std::vector<std::vector<std::pair<std::int32_t, double>>> pressed; // of each element: face, p
    const auto press = [&](const FaceSet& faces, double p) {
        if (p == 0) return;
        pressed.resize(hyper.elements.size());
        for (const FaceRef& face : faces.members)
            pressed[std::size_t(face.element)].emplace_back(face.face, p);
    };
    const double t = step.dynamic ? step.start + step.rule.end * step.h : step.end();
    for (const SolidConditions::Load& load : model.conditions.loads)
        if (!load.input->pressure.empty())
            press(*load.faces, step.load * curve_value(load.input->pressure, t));
    for (const VolumeLoads::Load& v : volumes.loads)
        press(*model.conditions.loads[v.load].faces, v.pressure);

    std::vector<Eigen::Triplet<double>> entries;
    assemble(
        model.mesh, *model.pattern,
        [&](std::int32_t e, ElementKind kind, std::span<const std::int32_t> nodes,
            ElementMatrix& K) {
            const ElementPlaces x = displaced_places(model.mesh, nodes, hyper.u);
            hyperelastic_tangent(hyper.elements[std::size_t(e)], model.law, x,
                                 hyper.states[std::size_t(e)], K);
            if (pressed.empty()) return;
            for (const auto& [face, p] : pressed[std::size_t(e)]) {
                const LocalFace& local = shape_of(kind).faces[std::size_t(face)];
                const auto on = local.nodes();
                const auto n = Eigen::Index(on.size());
                FaceForces y(3, n);
                for (Eigen::Index i = 0; i < n; ++i)
                    y.col(i) = x.col(on[std::size_t(i)]);
                const FaceTangent T = pressure_tangent(y, p);
                for (Eigen::Index j = 0; j < n; ++j)
                    for (Eigen::Index i = 0; i < n; ++i) {
                        const Mat3 ij = T.block<3, 3>(3 * i, 3 * j),
                                   ji = T.block<3, 3>(3 * j, 3 * i);
                        const Eigen::Index a = 3 * on[std::size_t(i)], b = 3 * on[std::size_t(j)];
                        K.block<3, 3>(a, b) -= 0.5 * (ij + ji.transpose());
                        const Mat3 rest = 0.5 * (ji.transpose() - ij);
                        for (int c = 0; c < 3; ++c)
                            for (int r = 0; r < 3; ++r) {
                                const std::int32_t row = unknowns.dofs.number[std::size_t(
                                                       3 * nodes[std::size_t(a / 3)] + r)],
                                                   column = unknowns.dofs.number[std::size_t(
                                                       3 * nodes[std::size_t(b / 3)] + c)];
                                if (row >= 0 && column >= 0)
                                    entries.emplace_back(row, column, rest(r, c));
                            }
                    }
            }
        },
        S);
    if (!model.conditions.supports.empty()) S.coeffs() += model.support->coeffs();
    const auto free = Eigen::Index(unknowns.dofs.free.size());
    Eigen::SparseMatrix<double> skew(free, free);
    skew.setFromTriplets(entries.begin(), entries.end());
    // Inside a set of faces the skew parts cancel: what is left is of its rim.
    const double size = skew.nonZeros() > 0 ? S.coeffs().cwiseAbs().maxCoeff() : 0;
    skew.prune([&](Eigen::Index, Eigen::Index, double v) { return std::abs(v) > 1e-14 * size; });
    return skew;
}

} // namespace amontons
