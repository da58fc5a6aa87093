#include "solver/beam/wall_material.hpp"

#include "solver/solid/face_load.hpp"

namespace amontons {
std::string find_balance(const VolumeMesh& mesh, const WallMaterial& material,
                         const Eigen::VectorXd& dead, WallState& s)
{
    s.elements.resize(material.elements.size());
    s.off = dead;
    s.energy = -dead.dot(s.u);
    for (const WallPressure& p : material.pressures) {
        s.off += follower_pressure(mesh, p.faces, s.u, p.pressure);
        s.energy -= p.pressure * swept_volume(mesh, p.faces, s.u);
    }
    std::string fault;
    ElementVector forces;
    for_each_element(mesh, [&](std::int32_t e, ElementKind, std::span<const std::int32_t> nodes) {
        if (!fault.empty()) return;
        HyperelasticState& state = s.elements[std::size_t(e)];
        const ElementFault found =
            hyperelastic_forces(material.elements[std::size_t(e)], material.law,
                                displaced_places(mesh, nodes, s.u), state, forces);
        if (found != ElementFault::none) {
            fault =
                element_place(mesh, e) +
                (found == ElementFault::inverted ? " would be inverted" : " buckles within itself");
            return;
        }
        s.energy += state.energy;
        for (std::size_t i = 0; i < nodes.size(); ++i)
            s.off.segment<3>(3 * nodes[i]) -= forces.segment<3>(3 * Eigen::Index(i));
    });
    return fault;
}

void assemble_wall_tangent(const VolumeMesh& mesh, const SolidPattern& pattern,
                           const WallMaterial& material, const WallState& state, SparseMatrix& K)
{
    std::vector<std::vector<std::pair<std::int32_t, double>>> pressed(material.elements.size());
    for (const WallPressure& p : material.pressures)
        for (const FaceRef& face : p.faces)
            pressed[std::size_t(face.element)].emplace_back(face.face, p.pressure);
    assemble(
        mesh, pattern,
        [&](std::int32_t e, ElementKind kind, std::span<const std::int32_t> nodes,
            ElementMatrix& own) {
            const ElementPlaces x = displaced_places(mesh, nodes, state.u);
            hyperelastic_tangent(material.elements[std::size_t(e)], material.law, x,
                                 state.elements[std::size_t(e)], own);
            for (const auto& [face, pressure] : pressed[std::size_t(e)]) {
                const auto on = shape_of(kind).faces[std::size_t(face)].nodes();
                const auto n = Eigen::Index(on.size());
                Eigen::Matrix3Xd y(3, n);
                for (Eigen::Index i = 0; i < n; ++i)
                    y.col(i) = x.col(on[std::size_t(i)]);
                const FaceTangent T = pressure_tangent(y, pressure);
                for (Eigen::Index j = 0; j < n; ++j)
                    for (Eigen::Index i = 0; i < n; ++i)
                        own.block<3, 3>(3 * on[std::size_t(i)], 3 * on[std::size_t(j)]) -=
                            0.5 *
                            (T.block<3, 3>(3 * i, 3 * j) + T.block<3, 3>(3 * j, 3 * i).transpose());
            }
        },
        K);
}

} // namespace amontons
