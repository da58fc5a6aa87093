#include "solver/body/solid_body.hpp"

#include "contact/surface/passage.hpp"
#include "solver/body/node_index.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <limits>

// What is told of the accepted state, and the state itself to be kept and read back.

namespace amontons {
std::vector<Vec3> SolidBody::reactions() const
{
    std::vector<Vec3> sums(input_.hold.size(), Vec3::Zero());
    for (const SolidConditions::Held& h : conditions_.held) { // of two holds the first takes a node
        const Vec3 f =
            state_.frame.turn.conjugate() * Vec3(reaction_.segment<3>(h.dof - h.dof % 3));
        sums[h.hold][h.dof % 3] += f[h.dof % 3];
    }
    for (Vec3& sum : sums)
        sum = state_.frame.turn * sum;
    return sums;
}

Mat3 SolidBody::element_rotation(std::int32_t element) const
{
    if (!corotational_ || std::size_t(element) >= element_states_.size()) return Mat3::Identity();
    return element_states_[std::size_t(element)].rotation;
}

double SolidBody::thinnest() const
{
    return least_thickness(extract_surface(mesh_), mesh_.nodes);
}

double SolidBody::thickness() const
{
    return least_thickness(extract_surface(mesh_), mesh_.nodes, 2 * size_);
}

void SolidBody::stresses(std::vector<Vec6>& stress, std::vector<double>& energy) const
{
    const Mat6 C = elasticity_matrix(material_);
    stress.clear();
    energy.clear();
    if (hyperelastic_) {
        for_each_element(mesh_, [&](std::int32_t e, ElementKind, auto nodes) {
            ElementPlaces x = places_of(mesh_, nodes);
            for (std::size_t i = 0; i < nodes.size(); ++i)
                x.col(Eigen::Index(i)) += state_.u.segment<3>(3 * nodes[i]);
            const HyperelasticMean mean =
                hyperelastic_mean(hyper_[std::size_t(e)], law_, x, hyper_states_[std::size_t(e)]);
            stress.push_back(mean.stress);
            energy.push_back(mean.energy);
        });
        return;
    }
    for_each_element(mesh_, [&](std::int32_t e, ElementKind kind, auto nodes) {
        const ElementPlaces X = places_of(mesh_, nodes);
        ElementVector u(3 * Eigen::Index(nodes.size()));
        for (std::size_t i = 0; i < nodes.size(); ++i)
            u.segment<3>(3 * Eigen::Index(i)) = state_.u.segment<3>(3 * nodes[i]);
        if (corotational_ && std::size_t(e) < element_states_.size())
            u = element_states_[std::size_t(e)].u;
        const Vec3 centre = kind == ElementKind::H8 ? Vec3(0, 0, 0) : Vec3(0.25, 0.25, 0.25);
        const InternalModes inner = solid_internal_modes(kind, X, C, u);
        const Vec6 strain = solid_strain(kind, X, u, inner, centre);
        stress.push_back(C * strain);
        energy.push_back(0.5 * strain.dot(stress.back()));
    });
}

std::vector<double> SolidBody::state() const
{
    std::vector<double> s;
    const auto add = [&](const auto& v) { s.insert(s.end(), v.data(), v.data() + v.size()); };
    add(state_.frame.turn.coeffs());
    add(state_.frame.shift);
    add(state_.u);
    add(state_.v);
    for (const Vec3& x : state_.x)
        add(x);
    add(reaction_);
    s.push_back(load_.size() > 0 ? 1 : 0); // the trapezoid's of work begins with the last step's
    add(load_.size() > 0 ? load_ : Eigen::VectorXd(Eigen::VectorXd::Zero(state_.u.size())));
    if (memory_.inner.size() > 0) {
        s.push_back(memory_.begun ? 1 : 0);
        for (const Eigen::VectorXd* carried :
             {&memory_.elastic, &memory_.inner, &memory_.load, &memory_.filtered_velocity,
              &memory_.filtered_inner, &memory_.filtered_load})
            add(*carried);
    }
    if (hyperelastic_) {
        s.push_back(state_energy_);
        s.push_back(unstable_ ? 1 : 0);
        for (const VolumeLoad& v : volumes_)
            s.push_back(v.state_pressure);
        add(contact_before_);
        add(contact_); // the first matrix of a step depends on what pushed in the last
        for (const InternalModes& a : state_modes_)
            add(a);
    }
    const std::vector<double> columns = kept_columns();
    s.insert(s.end(), columns.begin(), columns.end());
    return s;
}

std::vector<double> SolidBody::kept_columns() const
{
    std::vector<double> out{print_of_last_columns(), double(last_from_factor_)};
    const std::vector<double> kept =
        matrix_->constant ? matrix_->constant->kept()
                          : std::vector<double>(SolidCompliance::kept_size(touching_.size()), -1);
    out.insert(out.end(), kept.begin(), kept.end());
    return out;
}

void SolidBody::keep_columns(std::span<const double> kept)
{
    last_columns_ = SparseColumns(); // what they were is known by their print alone
    restored_columns_ = kept[0];
    last_from_factor_ = kept[1] != 0;
    if (matrix_->constant) matrix_->constant->keep(kept.subspan(2));
}

void SolidBody::set_state(std::span<const double> s)
{
    const auto take = [&](auto& v) {
        std::copy_n(s.begin(), v.size(), v.data());
        s = s.subspan(std::size_t(v.size()));
    };
    take(state_.frame.turn.coeffs());
    take(state_.frame.shift);
    take(state_.u);
    take(state_.v);
    for (Vec3& x : state_.x)
        take(x);
    take(reaction_);
    const bool loaded = s.front() != 0;
    s = s.subspan(1);
    load_.resize(state_.u.size());
    take(load_);
    if (!loaded) load_.resize(0);
    if (memory_.inner.size() > 0) {
        memory_.begun = s.front() != 0;
        s = s.subspan(1);
        for (Eigen::VectorXd* carried : carried_on())
            take(*carried);
    }
    if (hyperelastic_) {
        const auto number = [&](double& v) {
            v = s.front();
            s = s.subspan(1);
        };
        number(state_energy_);
        unstable_ = s.front() != 0;
        s = s.subspan(1);
        for (VolumeLoad& v : volumes_) {
            number(v.state_pressure);
            v.pressure = v.state_pressure;
        }
        take(contact_before_);
        take(contact_);
        for (InternalModes& a : state_modes_)
            take(a);
    }
    keep_columns(s);
    state_.version = ++last_version_;
    now_ = state_;
    if (hyperelastic_) {
        begin_hyperelastic();
        Eigen::VectorXd f;
        inner_forces(state_, f); // of which stresses are told
    } else if (corotational_) {
        Eigen::VectorXd f;
        state_energy_ = inner_forces(state_, f);
    }
    find_spin();
    if (material_.density > 0) momentum_ = mass_times(state_.v);
}

std::string SolidBody::worst_imbalance(const Eigen::VectorXd& force)
{
    Eigen::VectorXd scale, missing = Eigen::VectorXd::Zero(3 * Eigen::Index(now_.x.size()));
    const Eigen::VectorXd r = residual(scale);
    for (std::size_t i = 0; i < unknown_.size(); ++i)
        missing[unknown_[i]] = r[unknown_[i]] + force[Eigen::Index(i)];
    std::size_t worst = 0;
    for (std::size_t i = 1; i < now_.x.size(); ++i)
        if (missing.segment<3>(at3(i)).norm() > missing.segment<3>(at3(worst)).norm()) worst = i;
    const Vec3& x = now_.x[worst];
    return fmt::format(", most at ({:.4g}, {:.4g}, {:.4g})", x.x(), x.y(), x.z());
}

} // namespace amontons
