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
    std::vector<Vec3> sums(model_.input.hold.size(), Vec3::Zero());
    for (const SolidConditions::Held& h :
         model_.conditions.held) { // of two holds the first takes a node
        const Vec3 f =
            state_.frame.turn.conjugate() * Vec3(at_state_.reaction.segment<3>(h.dof - h.dof % 3));
        sums[h.hold][h.dof % 3] += f[h.dof % 3];
    }
    for (Vec3& sum : sums)
        sum = state_.frame.turn * sum;
    return sums;
}

std::vector<Vec3> SolidBody::moments() const
{
    std::vector<Vec3> sums(model_.input.hold.size(), Vec3::Zero());
    const std::vector<Vec3> centres =
        centres_of_holds(model_, nonlinear_ ? state_.u : Eigen::VectorXd());
    for (const SolidConditions::Held& h : model_.conditions.held) {
        const std::int32_t first = h.dof - h.dof % 3;
        const Vec3 f = state_.frame.turn.conjugate() * Vec3(at_state_.reaction.segment<3>(first));
        Vec3 arm = model_.mesh.nodes[std::size_t(h.dof / 3)] - centres[h.hold];
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
        d += probe.found.weights[i] * (state_.x[node] - first_.x[node]);
    }
    return d;
}

std::optional<Vec6> SolidBody::probe_stress(const ProbeInput& probe) const
{
    if (probe.found.element >= 0)
        return element_stress(model_, corotated_, hyper_, state_, probe.found.element,
                              probe.found.xi);
    if (probe.found.behind.empty()) return {};
    Vec6 mean = Vec6::Zero();
    for (const auto& [element, share] : probe.found.behind) {
        const bool brick = element_of(model_.mesh, element).kind == ElementKind::H8;
        mean += share * element_stress(model_, corotated_, hyper_, state_, element,
                                       brick ? Vec3(Vec3::Zero()) : Vec3(Vec3::Constant(0.25)));
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
        size_ / std::cbrt(double(std::max<std::size_t>(element_count(model_.mesh), 1)));
    return kDigits * model_.material.youngs_modulus * (far + size_) / element;
}

// Source: Horn 1987, JOSA A 4: the quaternion of the nearest turn is the eigenvector of the largest
// eigenvalue of a 4 x 4 matrix; nodes of a plane have one, too.
Vec3 SolidBody::turn_since_start()
{
    std::vector<std::int32_t> all;
    if (unknowns_.touching.size() < 3) { // else those: the same for every way to solve it
        complete();
        all.resize(model_.mesh.nodes.size());
        std::iota(all.begin(), all.end(), 0);
    }
    const std::vector<std::int32_t>& nodes = all.empty() ? unknowns_.touching : all;
    const Mat3 whole = (state_.frame.turn * first_.frame.turn.conjugate()).toRotationMatrix();
    Vec3 before = Vec3::Zero(), now = before;
    for (const std::int32_t i : nodes) {
        before += first_.x[std::size_t(i)];
        now += state_.x[std::size_t(i)];
    }
    before /= double(nodes.size());
    now /= double(nodes.size());
    // On top of the frame's own turn, so that small ones keep their digits.
    Mat3 M = Mat3::Zero();
    for (const std::int32_t i : nodes)
        M += (first_.x[std::size_t(i)] - before) * (state_.x[std::size_t(i)] - now).transpose();
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
    q = q * state_.frame.turn * first_.frame.turn.conjugate();
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    const double sine = q.vec().norm();
    return sine > 0 ? Vec3(2 * std::atan2(sine, q.w()) / sine * q.vec()) : Vec3(Vec3::Zero());
}

std::vector<SolidBody::Support> SolidBody::supports() const
{
    std::vector<Support> all;
    for (const SparseMatrix& K : *model_.supports) {
        const Eigen::VectorXd needed =
            symmetric_times(*model_.pattern, K, state_.u, solving_.threads);
        const Eigen::Map<const Eigen::Matrix3Xd> f(needed.data(), 3, needed.size() / 3);
        all.push_back({state_.frame.turn * Vec3(-f.rowwise().sum()), 0.5 * state_.u.dot(needed)});
    }
    return all;
}

double SolidBody::thinnest() const
{
    return least_thickness(extract_surface(model_.mesh), model_.mesh.nodes);
}

double SolidBody::thickness() const
{
    return least_thickness(extract_surface(model_.mesh), model_.mesh.nodes, 2 * size_);
}

void SolidBody::stresses(std::vector<Vec6>& stress, std::vector<double>& energy) const
{
    const Mat6 C = elasticity_matrix(model_.material);
    stress.clear();
    energy.clear();
    if (model_.hyperelastic) {
        for_each_element(model_.mesh, [&](std::int32_t e, ElementKind, auto nodes) {
            ElementPlaces x = places_of(model_.mesh, nodes);
            for (std::size_t i = 0; i < nodes.size(); ++i)
                x.col(Eigen::Index(i)) += state_.u.segment<3>(3 * nodes[i]);
            const HyperelasticMean mean = hyperelastic_mean(
                hyper_.elements[std::size_t(e)], model_.law, x, hyper_.states[std::size_t(e)]);
            stress.push_back(mean.stress);
            energy.push_back(mean.energy);
        });
        return;
    }
    for_each_element(model_.mesh, [&](std::int32_t e, ElementKind kind, auto nodes) {
        const ElementPlaces X = places_of(model_.mesh, nodes);
        ElementVector u(3 * Eigen::Index(nodes.size()));
        for (std::size_t i = 0; i < nodes.size(); ++i)
            u.segment<3>(3 * Eigen::Index(i)) = state_.u.segment<3>(3 * nodes[i]);
        if (model_.corotational && std::size_t(e) < corotated_.states.size())
            u = corotated_.states[std::size_t(e)].u;
        const Vec3 centre = kind == ElementKind::H8 ? Vec3(0, 0, 0) : Vec3(0.25, 0.25, 0.25);
        const InternalModes inner = solid_internal_modes(kind, X, C, u);
        const Vec6 strain = solid_strain(kind, X, u, inner, centre);
        stress.push_back(C * strain);
        energy.push_back(0.5 * strain.dot(stress.back()));
    });
}

std::vector<double> SolidBody::state() const
{
    const std::vector<double> columns = kept_columns(*matrix_, kept_, unknowns_);
    std::vector<double> s;
    s.reserve(8 + 15 * state_.x.size() + columns.size());
    const auto add = [&](const auto& v) { s.insert(s.end(), v.data(), v.data() + v.size()); };
    add(state_.frame.turn.coeffs());
    add(state_.frame.shift);
    add(state_.u);
    add(state_.v);
    for (const Vec3& x : state_.x)
        s.insert(s.end(), {x[0], x[1], x[2]});
    add(at_state_.reaction);
    s.push_back(
        at_state_.load.size() > 0 ? 1 : 0); // the trapezoid's of work begins with the last step's
    add(at_state_.load.size() > 0 ? at_state_.load
                                  : Eigen::VectorXd(Eigen::VectorXd::Zero(state_.u.size())));
    if (memory_.inner.size() > 0) {
        s.push_back(memory_.begun ? 1 : 0);
        for (const Eigen::VectorXd* carried : memory_.all())
            add(*carried);
    }
    if (model_.hyperelastic) {
        s.push_back(at_state_.energy);
        s.push_back(at_state_.unstable ? 1 : 0);
        for (const VolumeLoads::Load& v : volumes_.loads)
            s.push_back(v.state_pressure);
        add(at_state_.contact);
        add(contact_.on_unknowns); // the first matrix of a step depends on what pushed in the last
        for (const InternalModes& a : hyper_.accepted_modes)
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
    if (!solid || solid->model_.mesh.nodes != model_.mesh.nodes) return {};
    const std::vector<double> columns = kept_columns(*matrix_, kept_, unknowns_);
    const std::size_t of_other =
        kept_columns(*solid->matrix_, solid->kept_, solid->unknowns_).size();
    if (columns.size() == of_other) return s; // the same, as far as it counts
    s.resize(s.size() - of_other);
    s.insert(s.end(), columns.begin(), columns.end());
    return s;
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
    take(at_state_.reaction);
    const bool loaded = s.front() != 0;
    s = s.subspan(1);
    at_state_.load.resize(state_.u.size());
    take(at_state_.load);
    if (!loaded) at_state_.load.resize(0);
    if (memory_.inner.size() > 0) {
        memory_.begun = s.front() != 0;
        s = s.subspan(1);
        for (Eigen::VectorXd* carried : memory_.all())
            take(*carried);
    }
    if (model_.hyperelastic) {
        const auto number = [&](double& v) {
            v = s.front();
            s = s.subspan(1);
        };
        number(at_state_.energy);
        at_state_.unstable = s.front() != 0;
        s = s.subspan(1);
        for (VolumeLoads::Load& v : volumes_.loads) {
            number(v.state_pressure);
            v.pressure = v.state_pressure;
        }
        take(at_state_.contact);
        take(contact_.on_unknowns);
        for (InternalModes& a : hyper_.accepted_modes)
            take(a);
    }
    keep_columns(*matrix_, kept_, s);
    state_.version = ++known_.last_version;
    now_ = state_;
    if (model_.hyperelastic) {
        begin_hyperelastic();
        Eigen::VectorXd f;
        inner_forces(state_, f); // of which stresses are reported
    } else if (model_.corotational) {
        Eigen::VectorXd f;
        at_state_.energy = inner_forces(state_, f);
    }
    at_state_.spin = mean_spin(model_, state_);
    if (model_.material.density > 0) at_state_.momentum = mass_times(model_, state_.v);
}

std::string SolidBody::worst_imbalance(const Eigen::VectorXd& force)
{
    Eigen::VectorXd scale, missing = Eigen::VectorXd::Zero(3 * Eigen::Index(now_.x.size()));
    const Eigen::VectorXd r = residual(scale);
    for (std::size_t i = 0; i < unknowns_.dof.size(); ++i)
        missing[unknowns_.dof[i]] = r[unknowns_.dof[i]] + force[Eigen::Index(i)];
    std::size_t worst = 0;
    for (std::size_t i = 1; i < now_.x.size(); ++i)
        if (missing.segment<3>(at3(i)).norm() > missing.segment<3>(at3(worst)).norm()) worst = i;
    const Vec3& x = now_.x[worst];
    return fmt::format(", most at ({:.4g}, {:.4g}, {:.4g})", x.x(), x.y(), x.z());
}

} // namespace amontons
