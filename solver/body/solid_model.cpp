#include "solver/body/solid_model.hpp"
#include "solver/body/node_index.hpp"

#include "mesh/base/curve.hpp"
#include "solver/body/drive.hpp"
#include "solver/body/hyperelastic_input.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <set>

namespace amontons {
namespace {

/// The integral of density N_i N_j, the same along each axis: nodes x nodes [kg].
SparseMatrix scalar_mass(const VolumeMesh& mesh, double density)
{
    std::vector<Eigen::Triplet<double>> entries;
    ElementMatrix M;
    for_each_element(mesh, [&](std::int32_t, ElementKind kind, auto nodes) {
        solid_mass(kind, places_of(mesh, nodes), density, M);
        for (std::size_t j = 0; j < nodes.size(); ++j)
            for (std::size_t i = 0; i < nodes.size(); ++i)
                entries.emplace_back(nodes[i], nodes[j], M(Eigen::Index(i), Eigen::Index(j)));
    });
    SparseMatrix m(Eigen::Index(mesh.nodes.size()), Eigen::Index(mesh.nodes.size()));
    m.setFromTriplets(entries.begin(), entries.end());
    return m;
}

} // namespace

SolidModel::SolidModel(const SolidInput& of, VolumeMesh its_mesh, bool small_sliding,
                       const std::string& scene)
    : input(of)
    , file(scene)
    , mesh(std::move(its_mesh))
    , material{of.youngs_modulus, of.poisson_ratio, of.density}
    , small(small_sliding)
    , corotational(of.motion == "corotational")
    , hyperelastic(is_hyperelastic(of))
    , conditions(find_conditions(input, mesh, scene))
    , pattern([this] { return make_pattern(mesh); })
    , supports([this] {
        std::vector<SparseMatrix> all;
        for (const SolidConditions::Support& s : conditions.supports) {
            all.push_back(zero_matrix(*pattern));
            add_support(mesh, s.faces->members, s.input->normal, s.input->tangential, all.back());
        }
        return all;
    })
    , support([this] {
        SparseMatrix sum;
        for (const SparseMatrix& one : *supports)
            if (sum.size() == 0)
                sum = one;
            else
                sum.coeffs() += one.coeffs();
        return sum;
    })
    , mass([this] {
        return material.density > 0 ? scalar_mass(mesh, material.density) : SparseMatrix();
    })
    , weights([this] { return Eigen::VectorXd(*mass * Eigen::VectorXd::Ones(mass->cols())); })
    , lumped([this] {
        SolidMaterial unit = material;
        if (!(unit.density > 0)) unit.density = 1; // weights of the mean motion need no true mass
        return assemble_lumped_mass(mesh, std::span(&unit, 1));
    })
{
    if (hyperelastic) {
        law = hyperelastic_of(input, file);
        material.youngs_modulus = youngs_modulus(law);
        material.poissons_ratio = poissons_ratio(law);
    }
    for (const Vec3& X : mesh.nodes)
        middle += X / double(mesh.nodes.size());
    for (const Vec3& X : mesh.nodes)
        size = std::max(size, (X - middle).norm());
}

void set_touching(const SolidModel& model, std::span<const char> touching, SolidUnknowns& unknowns)
{
    unknowns.touching.clear();
    for (std::size_t i = 0; i < touching.size(); ++i)
        if (touching[i]) unknowns.touching.push_back(std::int32_t(i));
    unknowns.rigid =
        Late<RigidModes>([&model, avoided = std::vector<char>(touching.begin(), touching.end())] {
            RigidModes found = find_rigid_modes(model.mesh.nodes, *model.pattern,
                                                prescribed_dofs(model.conditions), avoided);
            if (model.conditions.supports.empty() || found.R.cols() == 0) return found;
            return not_resisted(found, *model.support, avoided);
        });
}

SolidFrame frame_kind(const SolidModel& model, const SolidUnknowns& unknowns)
{
    if (model.input.drive.given) return SolidFrame::driven;
    if (!model.conditions.supports.empty()) return SolidFrame::fixed; // they stand in space
    const bool floats = !model.small && !model.nonlinear() && unknowns.rigid->R.cols() > 0;
    return floats ? SolidFrame::floating : SolidFrame::fixed;
}

void apply_holds(const SolidModel& model, double t, Eigen::VectorXd& u)
{
    const Eigen::VectorXd held = held_displacements(model.conditions, model.mesh, t);
    for (std::size_t i = 0; i < model.conditions.held.size(); ++i)
        u[model.conditions.held[i].dof] = held[Eigen::Index(i)];
}

std::vector<LiveCurve> live_curves_of(SolidInput& input)
{
    std::vector<LiveCurve> all;
    if (input.drive.given) add_drive(input.name, input.drive, all);
    for (std::size_t k = 0; k < input.loads.size(); ++k) {
        LoadInput& l = input.loads[k];
        const std::string load = fmt::format("{}.loads.{}.", input.name, k);
        if (!l.pressure.empty()) all.push_back({load + "pressure", "Pa", &l.pressure});
        if (!l.volume.empty()) all.push_back({load + "volume", "m^3", &l.volume});
        if (l.traction || l.force) all.push_back({load + "over", "", &l.over, 1});
    }
    // What the scene gives a value: an axis without one is free, or at rest with all others.
    for (std::size_t k = 0; k < input.hold.size(); ++k) {
        HoldInput& h = input.hold[k];
        const std::string hold = fmt::format("{}.hold.{}.", input.name, k);
        for (const auto& [name, curve] : {std::pair("x", &h.x), {"y", &h.y}, {"z", &h.z}})
            if (!curve->empty()) all.push_back({hold + name, "m", curve});
        if (!h.angle.empty()) all.push_back({hold + "angle", "rad", &h.angle});
        if (h.gradient || !h.over.empty()) all.push_back({hold + "over", "", &h.over, 1});
    }
    return all;
}

double add_support_forces(const SolidModel& model, int threads, const Eigen::VectorXd& u,
                          Eigen::VectorXd& f)
{
    if (model.conditions.supports.empty()) return 0;
    const Eigen::VectorXd of_support = symmetric_times(*model.pattern, *model.support, u, threads);
    f += of_support;
    return 0.5 * u.dot(of_support);
}

Eigen::VectorXd mass_times(const SolidModel& model, const Eigen::VectorXd& v)
{
    Eigen::VectorXd out(v.size());
    Eigen::Map<Eigen::Matrix3Xd>(out.data(), 3, v.size() / 3).noalias() =
        Eigen::Map<const Eigen::Matrix3Xd>(v.data(), 3, v.size() / 3) * *model.mass;
    return out;
}

void turn_modes(const SolidModel& model, const SolidMotion& m, SolidUnknowns& unknowns)
{
    std::vector<Vec3> places = model.mesh.nodes;
    for (std::size_t i = 0; i < places.size(); ++i)
        places[i] += m.u.segment<3>(3 * Eigen::Index(i));
    RigidModes turned = *unknowns.rigid;
    turned.R = find_rigid_modes(places, *model.pattern, prescribed_dofs(model.conditions)).R;
    if (turned.R.cols() != unknowns.rigid->R.cols())
        return; // nearly aligned nodes: the modes at rest do
    unknowns.rigid = std::move(turned);
    for (std::size_t i = 0; i < unknowns.dof.size(); ++i)
        unknowns.modes.row(Eigen::Index(i)) = unknowns.rigid->R.row(unknowns.dof[i]);
}

Eigen::VectorXd free_part(const SolidUnknowns& unknowns, const Eigen::VectorXd& all)
{
    Eigen::VectorXd part(Eigen::Index(unknowns.dofs.free.size()));
    for (std::size_t i = 0; i < unknowns.dofs.free.size(); ++i)
        part[Eigen::Index(i)] = all[unknowns.dofs.free[i]];
    return part;
}

Eigen::VectorXd unknown_part(const SolidUnknowns& unknowns, const Eigen::VectorXd& all)
{
    Eigen::VectorXd part(Eigen::Index(unknowns.dof.size()));
    for (std::size_t i = 0; i < unknowns.dof.size(); ++i)
        part[Eigen::Index(i)] = all[unknowns.dof[i]];
    return part;
}

Eigen::VectorXd with_pins(const SolidUnknowns& unknowns, const Eigen::VectorXd& y)
{
    Eigen::VectorXd all = Eigen::VectorXd::Zero(Eigen::Index(unknowns.dof.size()));
    all.head(y.size()) = y;
    return all;
}

/// What the moment of each hold is taken about, in the frame [m]: its `about`, or the mean place of
/// its nodes.
/// @param u  displacements; empty: at rest
std::vector<Vec3> centres_of_holds(const SolidModel& model, const Eigen::VectorXd& u)
{
    std::vector<Vec3> sums(model.input.hold.size(), Vec3::Zero());
    std::vector<std::set<std::int32_t>> nodes(model.input.hold.size());
    for (const SolidConditions::Held& h : model.conditions.held) {
        const std::int32_t node = h.dof / 3;
        if (!nodes[h.hold].insert(node).second) continue;
        sums[h.hold] += model.mesh.nodes[std::size_t(node)];
        if (u.size() > 0) sums[h.hold] += u.segment<3>(3 * node);
    }
    for (std::size_t k = 0; k < sums.size(); ++k)
        sums[k] = model.conditions.affine[k].input
                      ? model.conditions.affine[k].about
                      : Vec3(sums[k] / std::max<double>(1, double(nodes[k].size())));
    return sums;
}

Eigen::VectorXd mean_motion(const SolidUnknowns& unknowns, const Eigen::VectorXd& u)
{
    return (unknowns.rigid->R.transpose() * u)
        .cwiseQuotient(unknowns.rigid->R.colwise().squaredNorm().transpose());
}

} // namespace amontons
