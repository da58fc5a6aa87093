#include "solver/body/solid_body.hpp"

#include "contact/surface/passage.hpp"
#include "mesh/base/dense.hpp"
#include "solver/body/node_index.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <limits>
#include <numeric>
#include <set>

// What is reported of the accepted state, and the state itself to be kept and read back.

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

std::vector<Vec3> SolidBody::moments() const
{
    std::vector<Vec3> sums(input_.hold.size(), Vec3::Zero());
    const std::vector<Vec3> centres = centres_of_holds(nonlinear_ ? state_.u : Eigen::VectorXd());
    for (const SolidConditions::Held& h : conditions_.held) {
        const std::int32_t first = h.dof - h.dof % 3;
        const Vec3 f = state_.frame.turn.conjugate() * Vec3(reaction_.segment<3>(first));
        Vec3 arm = mesh_.nodes[std::size_t(h.dof / 3)] - centres[h.hold];
        if (nonlinear_) arm += state_.u.segment<3>(first);
        sums[h.hold] += arm.cross(f[h.dof % 3] * Vec3::Unit(h.dof % 3));
    }
    for (Vec3& sum : sums)
        sum = state_.frame.turn * sum;
    return sums;
}

Vec3 SolidBody::probe_displacement(const ProbeInput& probe) const
{
    Vec3 d = Vec3::Zero();
    for (std::size_t i = 0; i < probe.found.nodes.size(); ++i) {
        const auto node = std::size_t(probe.found.nodes[i]);
        d += probe.found.weights[i] * (state_.x[node] - first_[node]);
    }
    return d;
}

/// In space.
Vec6 SolidBody::element_stress(std::int32_t element, const Vec3& xi) const
{
    const ElementView view = element_of(mesh_, element);
    ElementPlaces X = places_of(mesh_, view.nodes);
    ElementVector u(3 * Eigen::Index(view.nodes.size()));
    for (std::size_t i = 0; i < view.nodes.size(); ++i)
        u.segment<3>(3 * Eigen::Index(i)) = state_.u.segment<3>(3 * view.nodes[i]);
    Vec6 stress;
    const auto e = std::size_t(element);
    if (hyperelastic_) {
        for (Eigen::Index i = 0; i < X.cols(); ++i)
            X.col(i) += u.segment<3>(3 * i);
        stress = hyperelastic_mean(hyper_[e], law_, X, hyper_states_[e]).stress;
    } else {
        if (corotational_ && e < element_states_.size()) u = element_states_[e].u;
        const Mat6 C = elasticity_matrix(material_);
        stress = C * solid_strain(view.kind, X, u, solid_internal_modes(view.kind, X, C, u), xi);
    }
    const Mat3 R = state_.frame.turn.toRotationMatrix() * element_rotation(element);
    Mat3 m;
    m << stress[0], stress[3], stress[5], stress[3], stress[1], stress[4], stress[5], stress[4],
        stress[2];
    const Mat3 t = R * m * R.transpose();
    Vec6 out;
    out << t(0, 0), t(1, 1), t(2, 2), t(0, 1), t(1, 2), t(0, 2);
    return out;
}

std::optional<Vec6> SolidBody::probe_stress(const ProbeInput& probe) const
{
    if (probe.found.element >= 0) return element_stress(probe.found.element, probe.found.xi);
    if (probe.found.behind.empty()) return {};
    Vec6 mean = Vec6::Zero();
    for (const auto& [element, share] : probe.found.behind) {
        const bool brick = element_of(mesh_, element).kind == ElementKind::H8;
        mean += share *
                element_stress(element, brick ? Vec3(Vec3::Zero()) : Vec3(Vec3::Constant(0.25)));
    }
    return mean;
}

double SolidBody::stress_round_off() const
{
    // Places are numbers of 16 digits, strains their differences over an element.
    constexpr double kDigits = 1e-14;
    double far = 0;
    for (const Vec3& x : state_.x)
        far = std::max(far, x.cwiseAbs().maxCoeff());
    const double element =
        size_ / std::cbrt(double(std::max<std::size_t>(element_count(mesh_), 1)));
    return kDigits * material_.youngs_modulus * (far + size_) / element;
}

/// What the moment of each hold is taken about, in the frame [m]: its `about`, or the mean place of
/// its nodes.
/// @param u  displacements; empty: at rest
std::vector<Vec3> SolidBody::centres_of_holds(const Eigen::VectorXd& u) const
{
    std::vector<Vec3> sums(input_.hold.size(), Vec3::Zero());
    std::vector<std::set<std::int32_t>> nodes(input_.hold.size());
    for (const SolidConditions::Held& h : conditions_.held) {
        const std::int32_t node = h.dof / 3;
        if (!nodes[h.hold].insert(node).second) continue;
        sums[h.hold] += mesh_.nodes[std::size_t(node)];
        if (u.size() > 0) sums[h.hold] += u.segment<3>(3 * node);
    }
    for (std::size_t k = 0; k < sums.size(); ++k)
        sums[k] = conditions_.affine[k].input
                      ? conditions_.affine[k].about
                      : Vec3(sums[k] / std::max<double>(1, double(nodes[k].size())));
    return sums;
}

// Source: Horn 1987, JOSA A 4: the quaternion of the nearest turn is the eigenvector of the largest
// eigenvalue of a 4 x 4 matrix; nodes of a plane have one, too.
Vec3 SolidBody::turn_since_start()
{
    std::vector<std::int32_t> all;
    if (touching_.size() < 3) { // else those: the same for every way to solve it
        complete();
        all.resize(mesh_.nodes.size());
        std::iota(all.begin(), all.end(), 0);
    }
    const std::vector<std::int32_t>& nodes = all.empty() ? touching_ : all;
    const Mat3 whole = (state_.frame.turn * first_frame_.turn.conjugate()).toRotationMatrix();
    Vec3 before = Vec3::Zero(), now = before;
    for (const std::int32_t i : nodes) {
        before += first_[std::size_t(i)];
        now += state_.x[std::size_t(i)];
    }
    before /= double(nodes.size());
    now /= double(nodes.size());
    // On top of the frame's own turn, so that small ones keep their digits.
    Mat3 M = Mat3::Zero();
    for (const std::int32_t i : nodes)
        M += (first_[std::size_t(i)] - before) * (state_.x[std::size_t(i)] - now).transpose();
    M = whole * M;
    Eigen::MatrixXd N(4, 4);
    N << M.trace(), M(1, 2) - M(2, 1), M(2, 0) - M(0, 2), M(0, 1) - M(1, 0), //
        M(1, 2) - M(2, 1), M(0, 0) - M(1, 1) - M(2, 2), M(0, 1) + M(1, 0), M(2, 0) + M(0, 2),
        M(2, 0) - M(0, 2), M(0, 1) + M(1, 0), M(1, 1) - M(0, 0) - M(2, 2), M(1, 2) + M(2, 1),
        M(0, 1) - M(1, 0), M(2, 0) + M(0, 2), M(1, 2) + M(2, 1), M(2, 2) - M(0, 0) - M(1, 1);
    const SymmetricEigen eigen = symmetric_eigen(N);
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
    // Nodes on one line do not determine the turn about it.
    if (eigen.converged && eigen.values[3] - eigen.values[2] > 1e-9 * eigen.values[3])
        q = Eigen::Quaterniond(eigen.vectors(0, 3), eigen.vectors(1, 3), eigen.vectors(2, 3),
                               eigen.vectors(3, 3));
    q = q * state_.frame.turn * first_frame_.turn.conjugate();
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    const double sine = q.vec().norm();
    return sine > 0 ? Vec3(2 * std::atan2(sine, q.w()) / sine * q.vec()) : Vec3(Vec3::Zero());
}

std::vector<SolidBody::Support> SolidBody::supports() const
{
    std::vector<Support> all;
    for (const SparseMatrix& K : *supports_) {
        const Eigen::VectorXd needed = symmetric_times(*pattern_, K, state_.u, threads_);
        const Eigen::Map<const Eigen::Matrix3Xd> f(needed.data(), 3, needed.size() / 3);
        all.push_back({state_.frame.turn * Vec3(-f.rowwise().sum()), 0.5 * state_.u.dot(needed)});
    }
    return all;
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
    const std::vector<double> columns = kept_columns();
    std::vector<double> s;
    s.reserve(8 + 15 * state_.x.size() + columns.size());
    const auto add = [&](const auto& v) { s.insert(s.end(), v.data(), v.data() + v.size()); };
    add(state_.frame.turn.coeffs());
    add(state_.frame.shift);
    add(state_.u);
    add(state_.v);
    for (const Vec3& x : state_.x)
        s.insert(s.end(), {x[0], x[1], x[2]});
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
    s.insert(s.end(), columns.begin(), columns.end());
    return s;
}

/// Holds and surfaces may be others: which columns of the compliance are kept is then this one's.
std::vector<double> SolidBody::state_from(const Body& before) const
{
    std::vector<double> s = before.state();
    const auto* solid = dynamic_cast<const SolidBody*>(&before);
    if (!solid || solid->mesh_.nodes != mesh_.nodes) return {};
    const std::vector<double> columns = kept_columns();
    if (columns.size() == solid->kept_columns().size()) return s; // the same, as far as it counts
    s.resize(s.size() - solid->kept_columns().size());
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
        inner_forces(state_, f); // of which stresses are reported
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
