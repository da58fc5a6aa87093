#include "solver/body/solid_elements.hpp"
#include "solver/body/node_index.hpp"

#include "mesh/base/dense.hpp"
#include "solver/body/hyperelastic_input.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>

namespace amontons {

std::vector<CorotationalElement> corotational_elements(const SolidModel& model)
{
    std::vector<CorotationalElement> all;
    const Mat6 C = elasticity_matrix(model.material);
    for_each_element(model.mesh, [&](std::int32_t, ElementKind kind, auto nodes) {
        all.push_back(make_corotational(kind, places_of(model.mesh, nodes), C));
    });
    return all;
}

HyperelasticPart hyperelastic_part(const SolidModel& model)
{
    HyperelasticPart hyper;
    hyper.elements = hyperelastic_elements(model.input, model.law, model.mesh, model.file);
    for (const HyperelasticElement& e : hyper.elements)
        hyper.accepted_modes.push_back(e.kind == ElementKind::H8
                                           ? InternalModes(InternalModes::Zero(kMostInternalModes))
                                           : InternalModes());
    hyper.states.resize(hyper.elements.size());
    hyper.force_size = Eigen::VectorXd::Zero(at3(model.mesh.nodes.size()));
    return hyper;
}

double corotational_inner(const SolidModel& model, int threads, const SolidMotion& m,
                          CorotationalPart& corotated, KnownForces& known, Eigen::VectorXd& f)
{
    f.setZero(at3(model.mesh.nodes.size()));
    if (m.version == known.version) { // places have not changed since
        f = known.forces;
        return known.energy;
    }
    double energy = 0;
    corotated.states.resize(corotated.elements.size());
    ElementPlaces x;
    ElementVector forces;
    const Mat3 back = m.frame.turn.toRotationMatrix().transpose();
    for_each_element(
        model.mesh, [&](std::int32_t e, ElementKind, std::span<const std::int32_t> nodes) {
            x.resize(3, Eigen::Index(nodes.size()));
            for (std::size_t i = 0; i < nodes.size(); ++i)
                x.col(Eigen::Index(i)) = back * (m.x[std::size_t(nodes[i])] - m.frame.shift);
            CorotationalState& s = corotated.states[std::size_t(e)];
            s = corotational_forces(corotated.elements[std::size_t(e)], x, forces);
            energy += s.energy;
            for (std::size_t i = 0; i < nodes.size(); ++i)
                f.segment<3>(3 * nodes[i]) += forces.segment<3>(3 * Eigen::Index(i));
        });
    energy += add_support_forces(model, threads, m.u, f);
    known.version = m.version;
    known.forces = f;
    known.energy = energy;
    return energy;
}

double hyperelastic_inner(const SolidModel& model, int threads, const SolidMotion& m,
                          HyperelasticPart& hyper, KnownForces& known, Eigen::VectorXd& f)
{
    f.setZero(at3(model.mesh.nodes.size()));
    if (m.version == known.version) {
        f = known.forces;
        return known.energy;
    }
    double energy = 0;
    ElementPlaces x;
    ElementVector forces;
    hyper.force_size.setZero();
    known.version = -1;
    hyper.fault.clear();
    for_each_element(model.mesh, [&](std::int32_t e, ElementKind,
                                     std::span<const std::int32_t> nodes) {
        if (!hyper.fault.empty()) return;
        x = displaced_places(model.mesh, nodes, m.u);
        HyperelasticState& s = hyper.states[std::size_t(e)];
        const ElementFault fault =
            hyperelastic_forces(hyper.elements[std::size_t(e)], model.law, x, s, forces);
        if (fault != ElementFault::none) {
            hyper.fault = fmt::format("{}: {} {}", model.input.name, element_place(model.mesh, e),
                                      fault == ElementFault::inverted ? "would be inverted"
                                                                      : "buckles within itself");
            return;
        }
        energy += s.energy;
        for (std::size_t i = 0; i < nodes.size(); ++i) {
            const Eigen::Index at = 3 * Eigen::Index(i);
            f.segment<3>(3 * nodes[i]) += forces.segment<3>(at);
            hyper.force_size.segment<3>(3 * nodes[i]) += forces.segment<3>(at).cwiseAbs();
        }
    });
    if (!hyper.fault.empty()) return 0;
    if (!model.conditions.supports.empty()) {
        Eigen::VectorXd of_support = Eigen::VectorXd::Zero(f.size());
        energy += add_support_forces(model, threads, m.u, of_support);
        f += of_support;
        hyper.force_size += of_support.cwiseAbs();
    }
    known.version = m.version;
    known.forces = f;
    known.energy = energy;
    hyper.u = m.u;
    return energy;
}

void expect_pressures(const SolidModel& model, HyperelasticPart& hyper)
{
    ElementPlaces x, move;
    for_each_element(
        model.mesh, [&](std::int32_t e, ElementKind, std::span<const std::int32_t> nodes) {
            double& pressure = hyper.states[std::size_t(e)].pressure;
            pressure = std::numeric_limits<double>::quiet_NaN();
            if (hyper.tangent_u.size() == 0) return;
            x = displaced_places(model.mesh, nodes, hyper.tangent_u);
            move = displaced_places(model.mesh, nodes, hyper.u) - x;
            pressure = pressure_after(hyper.elements[std::size_t(e)], model.law, x, move);
        });
    hyper.tangent_u = hyper.u;
}

std::string unstable_elements(const SolidModel& model, const Eigen::VectorXd& u)
{
    if (!model.hyperelastic || !(model.law.law->least_stretch > 0)) return "";
    double least = 1;
    std::int32_t where = 0;
    for_each_element(model.mesh, [&](std::int32_t e, ElementKind kind, auto nodes) {
        const ElementPlaces X = places_of(model.mesh, nodes),
                            x = displaced_places(model.mesh, nodes, u);
        const Vec3 centre = kind == ElementKind::H8 ? Vec3(0, 0, 0) : Vec3(0.25, 0.25, 0.25);
        const ShapeGradients d = shape_gradients(kind, centre);
        const Mat3 J = X * d.transpose(), F = x * (J.inverse().transpose() * d).transpose();
        const double l =
            std::sqrt(std::max(0.0, symmetric_eigenvalues(Mat3(F.transpose() * F))[0]));
        if (l < least) {
            least = l;
            where = e;
        }
    });
    if (least >= model.law.law->least_stretch) return "";
    return fmt::format("{} is pressed to {:.3g} of its length, below {:.3g}: {} is unstable there",
                       element_place(model.mesh, where), least, model.law.law->least_stretch,
                       model.law.law->name);
}

Eigen::VectorXd damping_forces(const SolidModel& model, const SolidMatrix& matrix, int threads,
                               const CorotationalPart& corotated, const SolidMotion& m)
{
    Eigen::VectorXd f = Eigen::VectorXd::Zero(m.v.size());
    if (model.input.mass_damping > 0)
        f += model.input.mass_damping * into_frame(m, mass_times(model, m.v));
    if (model.input.stiffness_damping > 0)
        f += model.input.stiffness_damping *
             rate_forces(model, matrix, threads, corotated, into_frame(m, m.v));
    return f;
}

Eigen::VectorXd rate_forces(const SolidModel& model, const SolidMatrix& matrix, int threads,
                            const CorotationalPart& corotated, const Eigen::VectorXd& v)
{
    if (!model.corotational) return stiffness_times(model, matrix, threads, v);
    Eigen::VectorXd f = Eigen::VectorXd::Zero(v.size());
    ElementVector of_element, forces;
    for_each_element(
        model.mesh, [&](std::int32_t e, ElementKind, std::span<const std::int32_t> nodes) {
            of_element.resize(3 * Eigen::Index(nodes.size()));
            for (std::size_t i = 0; i < nodes.size(); ++i)
                of_element.segment<3>(3 * Eigen::Index(i)) = v.segment<3>(3 * nodes[i]);
            corotational_rate_forces(corotated.elements[std::size_t(e)],
                                     corotated.states[std::size_t(e)], of_element, forces);
            for (std::size_t i = 0; i < nodes.size(); ++i)
                f.segment<3>(3 * nodes[i]) += forces.segment<3>(3 * Eigen::Index(i));
        });
    return f;
}

Vec6 element_stress(const SolidModel& model, const CorotationalPart& corotated,
                    const HyperelasticPart& hyper, const SolidMotion& state, std::int32_t element,
                    const Vec3& xi)
{
    const ElementView view = element_of(model.mesh, element);
    ElementPlaces X = places_of(model.mesh, view.nodes);
    ElementVector u(3 * Eigen::Index(view.nodes.size()));
    for (std::size_t i = 0; i < view.nodes.size(); ++i)
        u.segment<3>(3 * Eigen::Index(i)) = state.u.segment<3>(3 * view.nodes[i]);
    Vec6 stress;
    const auto e = std::size_t(element);
    if (model.hyperelastic) {
        for (Eigen::Index i = 0; i < X.cols(); ++i)
            X.col(i) += u.segment<3>(3 * i);
        stress = hyperelastic_mean(hyper.elements[e], model.law, X, hyper.states[e]).stress;
    } else {
        if (model.corotational && e < corotated.states.size()) u = corotated.states[e].u;
        const Mat6 C = elasticity_matrix(model.material);
        stress = C * solid_strain(view.kind, X, u, solid_internal_modes(view.kind, X, C, u), xi);
    }
    const Mat3 R = state.frame.turn.toRotationMatrix() * rotation_of_element(corotated, element);
    Mat3 m;
    m << stress[0], stress[3], stress[5], stress[3], stress[1], stress[4], stress[5], stress[4],
        stress[2];
    const Mat3 t = R * m * R.transpose();
    Vec6 out;
    out << t(0, 0), t(1, 1), t(2, 2), t(0, 1), t(1, 2), t(0, 2);
    return out;
}

Mat3 rotation_of_element(const CorotationalPart& corotated, std::int32_t element)
{
    if (std::size_t(element) >= corotated.states.size()) return Mat3::Identity();
    return corotated.states[std::size_t(element)].rotation;
}

} // namespace amontons
