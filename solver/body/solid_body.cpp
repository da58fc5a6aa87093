#include "solver/body/solid_body.hpp"

#include "mesh/base/curve.hpp"
#include "solver/body/drive.hpp"
#include "solver/solid/face_load.hpp"
#include "solver/solid/factor_cache.hpp"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <numeric>
#include <set>

namespace amontons {
namespace {

Eigen::Index at3(std::size_t node)
{
    return 3 * static_cast<Eigen::Index>(node);
}

/// The turn that brings the shape X nearest to x, both about their centres, weighted by mass.
Mat3 nearest_turn(const std::vector<Vec3>& X, const std::vector<Vec3>& x, const Vec3& X_centre,
                  const Vec3& x_centre, const Eigen::VectorXd& weight)
{
    Mat3 F = Mat3::Zero();
    for (std::size_t i = 0; i < X.size(); ++i)
        F += weight[at3(i)] * (x[i] - x_centre) * (X[i] - X_centre).transpose();
    return polar_rotation(F);
}

Vec3 mean(const std::vector<Vec3>& x, const Eigen::VectorXd& weight)
{
    Vec3 sum = Vec3::Zero();
    double total = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        sum += weight[at3(i)] * x[i];
        total += weight[at3(i)];
    }
    return sum / total;
}

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

bool same(const SparseColumns& a, const SparseColumns& b)
{
    return a.rows() == b.rows() && a.cols() == b.cols() && a.nonZeros() == b.nonZeros() &&
           std::equal(a.outerIndexPtr(), a.outerIndexPtr() + a.outerSize() + 1,
                      b.outerIndexPtr()) &&
           std::equal(a.innerIndexPtr(), a.innerIndexPtr() + a.nonZeros(), b.innerIndexPtr()) &&
           std::equal(a.valuePtr(), a.valuePtr() + a.nonZeros(), b.valuePtr());
}

std::vector<std::string> set_names(const VolumeMesh& mesh)
{
    std::vector<std::string> names;
    for (const FaceSet& s : mesh.face_sets)
        names.push_back(s.name);
    for (const NodeSet& s : mesh.node_sets)
        names.push_back(s.name);
    return names;
}

} // namespace

SolidBody::SolidBody(const SolidInput& input, VolumeMesh mesh, bool small,
                     std::span<const char> touching, const std::string& file)
    : input_(input)
    , mesh_(std::move(mesh))
    , material_{input.youngs_modulus, input.poisson_ratio, input.density}
    , small_(small)
    , corotational_(input.motion == "corotational")
    , exact_tangent_(corotational_)
{
    const std::size_t n = mesh_.nodes.size();
    for (std::size_t i = 0; i < touching.size(); ++i)
        if (touching[i]) touching_.push_back(std::int32_t(i));
    find_sets(file);
    pattern_ = make_pattern(mesh_);
    for (const Vec3& X : mesh_.nodes)
        middle_ += X / double(n);
    for (const Vec3& X : mesh_.nodes)
        size_ = std::max(size_, (X - middle_).norm());

    SolidMaterial unit = material_;
    if (!(unit.density > 0)) unit.density = 1; // weights of the mean motion need no true mass
    lumped_ = assemble_lumped_mass(mesh_, std::span(&unit, 1));
    mass_ = material_.density > 0 ? lumped_.sum() / 3 : 0;

    std::vector<std::int32_t> prescribed;
    for (const Held& h : held_)
        prescribed.push_back(h.dof);
    rigid_ = find_rigid_modes(mesh_.nodes, pattern_, prescribed, touching);
    // Floating: the frame carries the rigid motion that nothing prescribes.
    kind_ = input.drive.given                                 ? Frame::driven
            : rigid_.R.cols() > 0 && !small && !corotational_ ? Frame::floating
                                                              : Frame::fixed;
    state_.frame = frame_at(0);
    state_.u = Eigen::VectorXd::Zero(at3(n));
    state_.v = Eigen::VectorXd::Zero(at3(n));
    state_.x.resize(n);
    update_places(state_);
    first_ = state_.x; // before what is prescribed at the start
    hold(state_, 0);
    update_places(state_);
    const Vec3 centre = mean(state_.x, lumped_);
    for (std::size_t i = 0; i < n; ++i)
        state_.v.segment<3>(at3(i)) =
            input.start.velocity + input.start.spin.cross(state_.x[i] - centre);
    find_spin();
    if (material_.density > 0) {
        m_ = scalar_mass(mesh_, material_.density);
        weights_ = m_ * Eigen::VectorXd::Ones(m_.cols());
        momentum_ = mass_times(state_.v);
    }
    now_ = state_;
    contact_ = reaction_ = Eigen::VectorXd::Zero(at3(n));
}

void SolidBody::find_sets(const std::string& file)
{
    std::vector<Issue> issues;
    const std::vector<std::string> names = set_names(mesh_);
    const auto nodes_of_set = [&](const std::string& name, const std::string& place) {
        if (const FaceSet* f = find_set(mesh_.face_sets, name)) return nodes_of(mesh_, *f);
        if (const NodeSet* s = find_set(mesh_.node_sets, name)) return s->members;
        if (name == "all") {
            std::vector<std::int32_t> all(mesh_.nodes.size());
            std::iota(all.begin(), all.end(), 0);
            return all;
        }
        const std::string near = nearest_name(name, names);
        std::string list;
        for (const std::string& s : names)
            list += (list.empty() ? "one of " : ", ") + quoted_text(s);
        issues.push_back({file, place, quoted_text(name),
                          names.empty()  ? "a set of the mesh, which has none"
                          : near.empty() ? list
                                         : quoted_text(near) + " (nearest name)"});
        return std::vector<std::int32_t>{};
    };
    const std::string body = "/bodies/" + input_.name;
    std::set<std::int32_t> seen;
    for (std::size_t i = 0; i < input_.hold.size(); ++i) {
        const HoldInput& h = input_.hold[i];
        const std::string place = fmt::format("{}/hold/{}/set", body, i);
        hold_nodes_.push_back(nodes_of_set(h.set, place));
        if (hold_nodes_.back().empty() && issues.empty())
            issues.push_back(
                {file, place, quoted_text(h.set) + ", an empty set", "a set of nodes"});
        const bool all = h.x.empty() && h.y.empty() && h.z.empty();
        const CurvePoints* curve[] = {&h.x, &h.y, &h.z};
        for (const std::int32_t node : hold_nodes_.back())
            for (int axis = 0; axis < 3; ++axis)
                if ((all || !curve[axis]->empty()) && seen.insert(3 * node + axis).second)
                    held_.push_back({3 * node + axis, all ? nullptr : curve[axis], i});
    }
    for (std::size_t i = 0; i < input_.loads.size(); ++i) {
        const LoadInput& l = input_.loads[i];
        const std::string place = fmt::format("{}/loads/{}/set", body, i);
        load_nodes_.push_back(nodes_of_set(l.set, place));
        load_faces_.push_back(find_set(mesh_.face_sets, l.set));
        if (!load_faces_.back() && !load_nodes_.back().empty() &&
            (l.traction || !l.pressure.empty()))
            issues.push_back({file, place, quoted_text(l.set) + ", a set of nodes",
                              "a set of faces: pressure and traction act on an area"});
    }
    if (!issues.empty()) throw InputError(std::move(issues));
    for (std::size_t i = 0; i < input_.loads.size(); ++i) { // of 1 Pa, once
        Eigen::VectorXd pressure, traction;
        if (load_faces_[i] && !input_.loads[i].pressure.empty()) {
            pressure = Eigen::VectorXd::Zero(at3(mesh_.nodes.size()));
            add_pressure(mesh_, load_faces_[i]->members, 1, pressure);
        }
        if (load_faces_[i] && input_.loads[i].traction) {
            traction = Eigen::VectorXd::Zero(at3(mesh_.nodes.size()));
            add_traction(mesh_, load_faces_[i]->members, Vec3::UnitX(), traction);
        }
        unit_pressure_.push_back(std::move(pressure));
        unit_traction_.push_back(std::move(traction));
    }
}

Placement SolidBody::frame_at(double t) const
{
    const Placement start = start_placement(input_.start);
    return input_.drive.given ? driven_placement(input_.drive, start, middle_, t) : start;
}

void SolidBody::hold(Motion& m, double t) const
{
    for (const Held& h : held_)
        m.u[h.dof] = h.curve ? curve_value(*h.curve, t) : 0;
}

void SolidBody::update_places(Motion& m)
{
    m.version = ++last_version_;
    const Mat3 R = m.frame.turn.toRotationMatrix();
    for (std::size_t i = 0; i < m.x.size(); ++i)
        m.x[i] = R * (mesh_.nodes[i] + Vec3(m.u.segment<3>(at3(i)))) + m.frame.shift;
}

/// u from the places in the present frame.
void SolidBody::into_frame_displacements(Motion& m) const
{
    const Mat3 back = m.frame.turn.toRotationMatrix().transpose();
    for (std::size_t i = 0; i < m.x.size(); ++i)
        m.u.segment<3>(at3(i)) = back * (m.x[i] - m.frame.shift) - mesh_.nodes[i];
}

void SolidBody::float_frame(Motion& m) const
{
    const Vec3 X = mean(mesh_.nodes, lumped_), x = mean(m.x, lumped_);
    const Mat3 R = nearest_turn(mesh_.nodes, m.x, X, x, lumped_);
    m.frame.turn = Eigen::Quaterniond(R).normalized();
    m.frame.shift = x - m.frame.turn * X;
    into_frame_displacements(m);
}

Eigen::VectorXd SolidBody::into_frame(const Eigen::VectorXd& f) const
{
    if (now_.frame.turn.coeffs() == Eigen::Quaterniond::Identity().coeffs()) return f;
    const Mat3 back = now_.frame.turn.toRotationMatrix().transpose();
    Eigen::VectorXd out(f.size());
    Eigen::Map<Eigen::Matrix3Xd>(out.data(), 3, f.size() / 3).noalias() =
        back * Eigen::Map<const Eigen::Matrix3Xd>(f.data(), 3, f.size() / 3);
    return out;
}

Eigen::VectorXd SolidBody::into_space(const Eigen::VectorXd& f) const
{
    if (now_.frame.turn.coeffs() == Eigen::Quaterniond::Identity().coeffs()) return f;
    const Mat3 R = now_.frame.turn.toRotationMatrix();
    Eigen::VectorXd out(f.size());
    Eigen::Map<Eigen::Matrix3Xd>(out.data(), 3, f.size() / 3).noalias() =
        R * Eigen::Map<const Eigen::Matrix3Xd>(f.data(), 3, f.size() / 3);
    return out;
}

Eigen::VectorXd SolidBody::loads(const Motion& m, double t) const
{
    Eigen::VectorXd f = Eigen::VectorXd::Zero(at3(mesh_.nodes.size()));
    const auto of_frame = [&](const Vec3& v) { return Vec3(m.frame.turn.conjugate() * v); };
    for (std::size_t i = 0; i < input_.loads.size(); ++i) {
        const LoadInput& l = input_.loads[i];
        const double factor = l.over.empty() ? 1 : curve_value(l.over, t);
        if (load_faces_[i] && !l.pressure.empty()) {
            const double p = curve_value(l.pressure, t);
            if (!corotational_) {
                f += p * unit_pressure_[i];
            } else { // follows the faces
                for (const FaceRef& face : load_faces_[i]->members) {
                    const FaceNodes nodes = face_nodes(mesh_, face);
                    Eigen::Matrix3Xd x(3, nodes.count);
                    for (int k = 0; k < nodes.count; ++k)
                        x.col(k) = m.frame.turn.conjugate() *
                                   (m.x[std::size_t(nodes.node[std::size_t(k)])] - m.frame.shift);
                    const FaceForces forces = pressure_forces(x, p);
                    for (int k = 0; k < nodes.count; ++k)
                        f.segment<3>(3 * nodes.node[std::size_t(k)]) += forces.col(k);
                }
            }
        }
        if (load_faces_[i] && l.traction) {
            const Vec3 traction = of_frame(factor * *l.traction);
            for (const std::int32_t node : load_nodes_[i])
                f.segment<3>(3 * node) += unit_traction_[i][3 * node] * traction;
        }
        if (l.force)
            for (const std::int32_t node : load_nodes_[i])
                f.segment<3>(3 * node) +=
                    of_frame(factor * *l.force) / double(load_nodes_[i].size());
    }
    if (material_.density > 0 && !step_.gravity.isZero())
        Eigen::Map<Eigen::Matrix3Xd>(f.data(), 3, f.size() / 3).noalias() +=
            of_frame(step_.gravity) * weights_.transpose();
    return f; // along the frame's axes
}

double SolidBody::inner_forces(const Motion& m, Eigen::VectorXd& f)
{
    f.setZero(at3(mesh_.nodes.size()));
    if (!corotational_) {
        f.noalias() = K_ * m.u;
        return 0.5 * m.u.dot(f);
    }
    if (m.version == known_version_) { // places have not changed since
        f = known_forces_;
        return known_energy_;
    }
    double energy = 0;
    element_states_.resize(elements_.size());
    ElementPlaces x;
    ElementVector forces;
    const Mat3 back = m.frame.turn.toRotationMatrix().transpose();
    for_each_element(mesh_, [&](std::int32_t e, ElementKind, std::span<const std::int32_t> nodes) {
        x.resize(3, Eigen::Index(nodes.size()));
        for (std::size_t i = 0; i < nodes.size(); ++i)
            x.col(Eigen::Index(i)) = back * (m.x[std::size_t(nodes[i])] - m.frame.shift);
        CorotationalState& s = element_states_[std::size_t(e)];
        s = corotational_forces(elements_[std::size_t(e)], x, forces);
        energy += s.energy;
        for (std::size_t i = 0; i < nodes.size(); ++i)
            f.segment<3>(3 * nodes[i]) += forces.segment<3>(3 * Eigen::Index(i));
    });
    known_version_ = m.version;
    known_forces_ = f;
    known_energy_ = energy;
    return energy;
}

void SolidBody::begin(const StepInput& step)
{
    step_ = step;
    now_ = state_;
    free_known_ = false;
    if (kind_ == Frame::driven) now_.frame = frame_at(step.end());
    hold(now_, step.end());
    if (!step.dynamic) {
        update_places(now_);
        return;
    }
    // The iterate stands where the step starts, but for what is prescribed.
    const double a = step.theta, b = 1 - step.theta, h = step.h;
    if (kind_ == Frame::floating) {
        // Where the frame will be if the body turns on as it does: elastic forces of the step are
        // linear in it, and the turn left for u is of second order.
        const Eigen::Quaterniond turn = rotation(h * spin_);
        const Vec3 x = mean(state_.x, lumped_), X = mean(mesh_.nodes, lumped_);
        now_.frame.turn = (turn * state_.frame.turn).normalized();
        now_.frame.shift = x - now_.frame.turn * X;
        into_frame_displacements(now_);
    } else if (kind_ == Frame::driven || !held_.empty()) {
        update_places(now_);
    }
    for (std::size_t i = 0; i < now_.x.size(); ++i)
        now_.v.segment<3>(at3(i)) =
            ((now_.x[i] - state_.x[i]) / h - b * Vec3(state_.v.segment<3>(at3(i)))) / a;
}

/// Once: matrices at rest, the unknowns, the order and pattern of the factor.
void SolidBody::prepare()
{
    K_ = zero_matrix(pattern_);
    assemble_stiffness(mesh_, pattern_, std::span(&material_, 1), K_);
    stiffest_ = K_.coeffs().cwiseAbs().maxCoeff();
    if (corotational_) {
        const Mat6 C = elasticity_matrix(material_);
        for_each_element(mesh_, [&](std::int32_t, ElementKind kind, auto nodes) {
            elements_.push_back(make_corotational(kind, places_of(mesh_, nodes), C));
        });
    }
    std::vector<std::int32_t> fixed;
    for (const Held& h : held_)
        fixed.push_back(h.dof);
    if (step_.dynamic) {
        M_ = zero_matrix(pattern_);
        assemble_mass(mesh_, pattern_, std::span(&material_, 1), M_);
    } else {
        fixed.insert(fixed.end(), rigid_.pins.begin(), rigid_.pins.end());
    }
    dofs_ = make_free_dofs(pattern_, fixed);
    S_ = K_;
    parts_ = make_elimination(S_, dofs_);
    std::vector<std::int32_t> node(dofs_.free.size());
    for (std::size_t i = 0; i < node.size(); ++i)
        node[i] = dofs_.free[i] / 3;
    if (!node.empty() && (corotational_ || cache_.empty())) factor_.analyse(parts_.ff, node);
    free_modes_.resize(Eigen::Index(node.size()), step_.dynamic ? 0 : rigid_.R.cols());
    for (std::size_t i = 0; i < node.size() && free_modes_.cols() > 0; ++i)
        free_modes_.row(Eigen::Index(i)) = rigid_.R.row(dofs_.free[i]);
}

void SolidBody::make_matrix()
{
    if (dofs_.free.empty()) return;
    const bool same_step = step_.h == factored_h_ && step_.theta == factored_theta_;
    if (constant_ && (!step_.dynamic || same_step)) return;

    const double h = step_.h, theta = step_.theta;
    if (corotational_) {
        const auto matrix = exact_tangent_ ? corotational_tangent : corotational_stiffness;
        assemble(
            mesh_, pattern_,
            [&](std::int32_t e, ElementKind, auto, ElementMatrix& K) {
                matrix(elements_[std::size_t(e)], element_states_[std::size_t(e)], K);
            },
            S_);
    } else {
        S_ = K_;
    }
    if (step_.dynamic) {
        const double of_mass = 1 + h * theta * input_.mass_damping;
        const double of_stiffness = h * theta * (input_.stiffness_damping + h * theta);
        S_.coeffs() = of_mass * M_.coeffs() + of_stiffness * S_.coeffs();
    }
    eliminate(S_, parts_);
    last_columns_ = SparseColumns();
    if (constant_) { // another step length: the order and pattern of the factor stay
        factor_ = constant_->release();
        constant_.reset();
    }
    FactorResult done;
    double scale = 1;
    if (messages_ && !cache_.empty()) {
        SolidMatrixKind matrix;
        if (step_.dynamic) {
            matrix.mass = 1 + h * theta * input_.mass_damping;
            matrix.stiffness = h * theta * (input_.stiffness_damping + h * theta);
        }
        SolidFactor kept =
            cached_factor(cache_, mesh_, std::span(&material_, 1), dofs_, matrix, parts_.ff);
        factor_ = std::move(kept.factor);
        done = kept.result;
        scale = kept.scale;
        if (messages_) {
            for (const std::string& m : kept.messages)
                messages_->push_back(input_.name + ": " + m);
            messages_->push_back(input_.name + (kept.factor_read ? ": factor read from the cache"
                                                                 : ": factor made and kept"));
        }
    } else {
        done = factor_.factor(parts_.ff);
    }
    if (!done && exact_tangent_) { // W must be positive: leave out what made it indefinite
        exact_tangent_ = false;
        make_matrix();
        exact_tangent_ = true;
        return;
    }
    if (!done)
        throw std::runtime_error(fmt::format(
            "{}: its matrix is not positive definite at {}", input_.name,
            done.failed_dof < 0 ? "some node"
                                : node_place(mesh_, dofs_.free[std::size_t(done.failed_dof)] / 3)));
    factored_h_ = h;
    factored_theta_ = theta;
    if (!corotational_) {
        constant_.emplace(std::move(factor_), dofs_, touching_);
        constant_->set_scale(scale);
        scale_ = scale;
    }
}

void SolidBody::make_ready(const StepInput& step, const std::string& cache,
                           std::vector<std::string>& messages)
{
    step_ = step;
    cache_ = cache;
    messages_ = &messages;
    if (K_.size() == 0) prepare();
    if (!corotational_) make_matrix(); // that of corotational elements needs their state
    messages_ = nullptr;
}

Eigen::VectorXd SolidBody::solved(const Eigen::VectorXd& f) const
{
    if (f.size() == 0) return f;
    if (!constant_) return factor_.solved(f);
    return constant_->factor().solved(f) / scale_;
}

Eigen::VectorXd SolidBody::residual(Eigen::VectorXd& scale)
{
    // Along the frame's axes. Dynamic: the change of momentum over the step that is missing.
    Eigen::VectorXd inner;
    if (!step_.dynamic) {
        inner_forces(now_, inner);
        Eigen::VectorXd f = loads(now_, step_.end());
        scale = f.cwiseAbs() + inner.cwiseAbs();
        last_load_ = f;
        return f - inner;
    }
    const double h = step_.h, theta = step_.theta;
    Motion between;
    if (theta < 1) {
        between = now_;
        Motion& middle = between;
        middle.version = ++last_version_;
        for (std::size_t i = 0; i < middle.x.size(); ++i)
            middle.x[i] = (1 - theta) * state_.x[i] + theta * now_.x[i];
        if (kind_ == Frame::driven) middle.frame = frame_at(step_.start + theta * h);
        into_frame_displacements(middle);
    }
    const Motion& middle = theta < 1 ? between : now_;
    inner_forces(middle, inner);
    const Eigen::VectorXd f = loads(middle, step_.start + theta * h);
    last_load_ = f;
    Eigen::VectorXd change = now_.v - state_.v;
    Eigen::VectorXd mean_v = theta * now_.v + (1 - theta) * state_.v;
    if (middle.frame.turn.coeffs() != now_.frame.turn.coeffs()) {
        // Forces turn from the frame they were found in to that of the iterate.
        const Mat3 turn = (now_.frame.turn.conjugate() * middle.frame.turn).toRotationMatrix();
        Eigen::Map<Eigen::Matrix3Xd> g(inner.data(), 3, inner.size() / 3);
        g = (turn * g).eval();
    }
    const Eigen::VectorXd momentum = into_frame(mass_times(change));
    scale = momentum.cwiseAbs() + h * (f.cwiseAbs() + inner.cwiseAbs());
    Eigen::VectorXd r = h * (f - inner) - momentum;
    if (input_.mass_damping > 0) r -= h * input_.mass_damping * into_frame(mass_times(mean_v));
    if (input_.stiffness_damping > 0) r -= h * input_.stiffness_damping * (K_ * into_frame(mean_v));
    return r;
}

void SolidBody::linearise()
{
    if (K_.size() == 0) prepare();
    if (free_known_) return;
    Eigen::VectorXd scale;
    const Eigen::VectorXd r = residual(scale);
    make_matrix();
    Eigen::VectorXd rf(Eigen::Index(dofs_.free.size()));
    for (std::size_t i = 0; i < dofs_.free.size(); ++i)
        rf[Eigen::Index(i)] = r[dofs_.free[i]];
    free_change_ = solved(rf);
    if (free_modes_.cols() > 0)
        mode_load_ = rigid_.R.transpose() * r;
    else
        mode_load_.resize(0);
}

void SolidBody::add_column(const BodyPlace& at, const Vec3& direction, double scale, int column,
                           std::vector<Eigen::Triplet<double>>& out) const
{
    const Vec3 d = now_.frame.turn.conjugate() * direction;
    for (const StencilEntry& e : at.nodes)
        for (int axis = 0; axis < 3; ++axis) {
            const std::int32_t dof = dofs_.number[std::size_t(3 * e.node + axis)];
            if (dof >= 0) out.emplace_back(dof, column, scale * e.weight * d[axis]);
        }
}

Vec3 SolidBody::displacement(const BodyPlace& at) const
{
    Vec3 d = Vec3::Zero();
    for (const StencilEntry& e : at.nodes)
        d += e.weight * (now_.x[std::size_t(e.node)] - state_.x[std::size_t(e.node)]);
    return d;
}

Vec3 SolidBody::velocity(const BodyPlace& at) const
{
    Vec3 d = Vec3::Zero();
    for (const StencilEntry& e : at.nodes)
        d += e.weight * now_.v.segment<3>(3 * e.node);
    return d;
}

Vec3 SolidBody::start_velocity(const BodyPlace& at) const
{
    Vec3 d = Vec3::Zero();
    for (const StencilEntry& e : at.nodes)
        d += e.weight * state_.v.segment<3>(3 * e.node);
    return d;
}

bool SolidBody::kept_W(const SparseColumns& C, Eigen::MatrixXd& W) const
{
    if (last_columns_.cols() == 0 || !same(C, last_columns_)) return false;
    W = last_W_;
    return true;
}

void SolidBody::keep_W(const SparseColumns& C, const Eigen::MatrixXd& W)
{
    last_columns_ = C;
    last_W_ = W;
}

void SolidBody::compliance(const SparseColumns& C, Eigen::MatrixXd& W)
{
    if (kept_W(C, W)) return;
    if (constant_)
        constant_->delassus(C, W);
    else
        factor_.compliance(C, W);
    keep_W(C, W);
}

Eigen::VectorXd SolidBody::solve(const Eigen::VectorXd& force)
{
    return solved(force);
}

std::string SolidBody::mode_name(const Eigen::VectorXd& a) const
{
    // The shift of the middle and the turn about it that are nearest to the motion.
    const Eigen::VectorXd motion = rigid_.R * a;
    Vec3 shift = Vec3::Zero(), moment = Vec3::Zero();
    Mat3 inertia = Mat3::Zero();
    for (std::size_t i = 0; i < mesh_.nodes.size(); ++i) {
        const Vec3 arm = mesh_.nodes[i] - middle_, d = motion.segment<3>(at3(i));
        shift += d / double(mesh_.nodes.size());
        moment += arm.cross(d);
        inertia += arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose();
    }
    return name_of_motion(shift, size_ * inertia.ldlt().solve(moment));
}

std::vector<std::string> SolidBody::free_motions() const
{
    std::vector<std::string> names;
    for (Eigen::Index m = 0; m < rigid_.R.cols(); ++m)
        names.push_back(mode_name(Eigen::VectorXd::Unit(rigid_.R.cols(), m)));
    return names;
}

void SolidBody::move_frame(Motion& m, const Eigen::VectorXd& mode) const
{
    const Eigen::VectorXd rigid = rigid_.R * mode;
    Vec3 shift = Vec3::Zero(), moment = Vec3::Zero();
    Mat3 inertia = Mat3::Zero();
    for (std::size_t i = 0; i < mesh_.nodes.size(); ++i) {
        const Vec3 arm = mesh_.nodes[i] - middle_, d = rigid.segment<3>(at3(i));
        shift += d / double(mesh_.nodes.size());
        moment += arm.cross(d);
        inertia += arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose();
    }
    const Eigen::Quaterniond turn = rotation(inertia.ldlt().solve(moment));
    // x = frame (turn (X + u - middle) + middle + shift)
    m.frame.shift = m.frame * (middle_ + shift - turn * middle_);
    m.frame.turn = (m.frame.turn * turn).normalized();
}

void SolidBody::change(const Eigen::VectorXd& y, const Eigen::VectorXd& mode,
                       const Eigen::VectorXd& force)
{
    contact_.setZero();
    for (std::size_t i = 0; i < dofs_.free.size(); ++i)
        contact_[dofs_.free[i]] = force[Eigen::Index(i)];
    Eigen::VectorXd whole = Eigen::VectorXd::Zero(at3(mesh_.nodes.size()));
    for (std::size_t i = 0; i < dofs_.free.size(); ++i)
        whole[dofs_.free[i]] = y[Eigen::Index(i)];
    if (!step_.dynamic) {
        now_.u += whole;
        // A linear body: the residual has changed by A y, so what is left of y_free is known. Not
        // where loads turn against the frame.
        const bool turns =
            kind_ == Frame::floating && (!input_.loads.empty() || !step_.gravity.isZero());
        free_known_ = !corotational_ && !turns;
        if (free_known_) free_change_ -= y;
        if (mode.size() > 0) {
            if (kind_ != Frame::floating) {
                now_.u += rigid_.R * mode;
            } else {
                move_frame(now_, mode);
            }
        }
        update_places(now_);
        return;
    }
    const Eigen::VectorXd dv = into_space(whole);
    now_.v += dv;
    now_.version = ++last_version_;
    const double a = step_.theta, b = 1 - a, h = step_.h;
    for (std::size_t i = 0; i < now_.x.size(); ++i)
        now_.x[i] = state_.x[i] + h * (a * Vec3(now_.v.segment<3>(at3(i))) +
                                       b * Vec3(state_.v.segment<3>(at3(i))));
    into_frame_displacements(now_);
}

double SolidBody::imbalance(const Eigen::VectorXd& force)
{
    if (!corotational_) return 0;
    Eigen::VectorXd scale;
    const Eigen::VectorXd r = residual(scale);
    double missing = 0, size = 0;
    for (std::size_t i = 0; i < dofs_.free.size(); ++i) {
        const double f = force[Eigen::Index(i)];
        const double s = scale[dofs_.free[i]] + std::abs(f);
        const double e = r[dofs_.free[i]] + f;
        missing += e * e;
        size += s * s;
    }
    // What the round-off of places makes of forces, and that of velocities of momentum.
    const double places = stiffest_ * size_ * (step_.dynamic ? step_.h : 1);
    const double momentum = step_.dynamic ? lumped_.maxCoeff() * now_.v.cwiseAbs().maxCoeff() : 0;
    const double floor = 1e-14 * (places + momentum) * std::sqrt(double(dofs_.free.size()));
    if (missing <= floor * floor) return 0;
    return size > 0 ? std::sqrt(missing / size) : 0;
}

BodyEnergy SolidBody::accept(const Eigen::VectorXd&)
{
    BodyEnergy e;
    Eigen::VectorXd inner, scale;
    const Eigen::VectorXd before = reaction_;
    if (!held_.empty()) { // what prescribed nodes need, beside loads, inner forces and contacts
        Eigen::VectorXd missing = -residual(scale) - contact_;
        if (step_.dynamic) missing /= step_.h;
        Eigen::VectorXd held = Eigen::VectorXd::Zero(missing.size());
        for (const Held& h : held_)
            held[h.dof] = missing[h.dof];
        reaction_ = into_space(held);
    }
    const Eigen::VectorXd load = into_space(last_load_);
    if (load_.size() == 0) load_ = load;
    for (std::size_t i = 0; i < now_.x.size(); ++i) {
        const Vec3 moved = now_.x[i] - state_.x[i];
        Vec3 f = load.segment<3>(at3(i)) + reaction_.segment<3>(at3(i));
        if (!step_.dynamic) // the rule of the trapezoid
            f = 0.5 * (f + load_.segment<3>(at3(i)) + before.segment<3>(at3(i)));
        const double work = f.dot(moved);
        e.work += work;
        e.work_absolute += std::abs(work);
    }
    load_ = load;
    if (!step_.dynamic) {
        state_ = now_;
        e.elastic = inner_forces(now_, inner);
        return e;
    }
    if (held_.empty() && !input_.drive.given) keep_angular_momentum(load);
    const Eigen::VectorXd du = now_.u - state_.u;
    if (kind_ == Frame::floating) float_frame(now_);
    const Eigen::VectorXd dv = now_.v - state_.v;
    const Eigen::VectorXd momentum = mass_times(now_.v);
    // What the rule takes, (theta - 1/2) of the change's energy, and the damping.
    const double excess = step_.theta - 0.5;
    if (excess > 0) e.dissipated = excess * (dv.dot(momentum - momentum_) + du.dot(K_ * du));
    if (input_.mass_damping > 0 || input_.stiffness_damping > 0) {
        const Eigen::VectorXd v = step_.theta * now_.v + (1 - step_.theta) * state_.v;
        e.dissipated += step_.h * input_.mass_damping * v.dot(mass_times(v));
        if (input_.stiffness_damping > 0) {
            const Eigen::VectorXd v_frame = into_frame(v);
            e.dissipated += step_.h * input_.stiffness_damping * v_frame.dot(K_ * v_frame);
        }
    }
    momentum_ = momentum;
    state_ = now_;
    if (kind_ == Frame::floating) find_spin();
    e.elastic = inner_forces(now_, inner);
    e.kinetic = kinetic_energy();
    return e;
}

/// The rules of time-stepping lose some angular momentum of a body that turns; what loads and
/// contacts gave it is exact, and the difference is put back as a turn of the whole.
void SolidBody::keep_angular_momentum(const Eigen::VectorXd& load)
{
    if (input_.mass_damping > 0 || input_.stiffness_damping > 0) return; // damping takes some too
    const double h = step_.h, theta = step_.theta;
    const Vec3 about = mean(now_.x, lumped_);
    const Eigen::VectorXd contact = into_space(contact_), reached = mass_times(now_.v);
    Eigen::VectorXd arms(now_.v.size());
    Vec3 missing = Vec3::Zero();
    for (std::size_t i = 0; i < now_.x.size(); ++i) {
        const Vec3 arm = now_.x[i] - about, before = state_.x[i] - about;
        missing += before.cross(Vec3(momentum_.segment<3>(at3(i)))) +
                   ((1 - theta) * before + theta * arm).cross(h * Vec3(load.segment<3>(at3(i)))) +
                   arm.cross(Vec3(contact.segment<3>(at3(i)) - reached.segment<3>(at3(i))));
        arms.segment<3>(at3(i)) = arm;
    }
    const Eigen::VectorXd weighted = mass_times(arms);
    Mat3 S = Mat3::Zero();
    for (std::size_t i = 0; i < now_.x.size(); ++i)
        S += arms.segment<3>(at3(i)) * weighted.segment<3>(at3(i)).transpose();
    const Mat3 inertia = S.trace() * Mat3::Identity() - 0.5 * (S + S.transpose());
    const Vec3 spin = inertia.inverse() * missing;
    for (std::size_t i = 0; i < now_.x.size(); ++i)
        now_.v.segment<3>(at3(i)) += spin.cross(Vec3(arms.segment<3>(at3(i))));
}

Eigen::VectorXd SolidBody::mass_times(const Eigen::VectorXd& v) const
{
    Eigen::VectorXd out(v.size());
    Eigen::Map<Eigen::Matrix3Xd>(out.data(), 3, v.size() / 3).noalias() =
        Eigen::Map<const Eigen::Matrix3Xd>(v.data(), 3, v.size() / 3) * m_;
    return out;
}

double SolidBody::kinetic_energy() const
{
    return momentum_.size() > 0 ? 0.5 * state_.v.dot(momentum_) : 0;
}

Mat3 SolidBody::element_rotation(std::int32_t element) const
{
    if (!corotational_ || std::size_t(element) >= element_states_.size()) return Mat3::Identity();
    return element_states_[std::size_t(element)].rotation;
}

/// The turn of the whole that has the velocities' angular momentum, by lumped masses.
void SolidBody::find_spin()
{
    const Vec3 x = mean(state_.x, lumped_);
    Vec3 momentum = Vec3::Zero();
    Mat3 inertia = Mat3::Zero();
    for (std::size_t i = 0; i < state_.x.size(); ++i) {
        const Vec3 arm = state_.x[i] - x;
        const double m = lumped_[at3(i)];
        momentum += m * arm.cross(Vec3(state_.v.segment<3>(at3(i))));
        inertia += m * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
    }
    spin_ = inertia.ldlt().solve(momentum);
}

double SolidBody::speed() const
{
    if (state_.v.size() == 0) return 0;
    return Eigen::Map<const Eigen::Matrix3Xd>(state_.v.data(), 3, state_.v.size() / 3)
        .colwise()
        .norm()
        .maxCoeff();
}

Vec3 SolidBody::momentum() const
{
    Vec3 p = Vec3::Zero();
    for (Eigen::Index i = 0; i < momentum_.size(); i += 3)
        p += momentum_.segment<3>(i);
    return p;
}

Vec3 SolidBody::angular_momentum() const
{
    Vec3 L = Vec3::Zero();
    for (Eigen::Index i = 0; i < momentum_.size(); i += 3)
        L += state_.x[std::size_t(i / 3)].cross(Vec3(momentum_.segment<3>(i)));
    return L;
}

std::vector<Vec3> SolidBody::reactions() const
{
    std::vector<Vec3> sums;
    for (std::size_t k = 0; k < hold_nodes_.size(); ++k) {
        Vec3 sum = Vec3::Zero();
        const HoldInput& h = input_.hold[k];
        const bool all = h.x.empty() && h.y.empty() && h.z.empty();
        const bool axes[] = {all || !h.x.empty(), all || !h.y.empty(), all || !h.z.empty()};
        for (const std::int32_t node : hold_nodes_[k]) {
            Vec3 f = state_.frame.turn.conjugate() * Vec3(reaction_.segment<3>(3 * node));
            for (int axis = 0; axis < 3; ++axis)
                if (!axes[axis]) f[axis] = 0;
            sum += state_.frame.turn * f;
        }
        sums.push_back(sum);
    }
    return sums;
}

void SolidBody::stresses(std::vector<Vec6>& stress, std::vector<double>& energy) const
{
    const Mat6 C = elasticity_matrix(material_);
    stress.clear();
    energy.clear();
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
    const std::vector<double> columns = kept_columns();
    s.insert(s.end(), columns.begin(), columns.end());
    return s;
}

std::vector<double> SolidBody::kept_columns() const
{
    return constant_ ? constant_->kept() : std::vector<double>(2 + 2 * touching_.size(), -1);
}

void SolidBody::keep_columns(std::span<const double> kept)
{
    last_columns_ = SparseColumns();
    if (constant_) constant_->keep(kept);
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
    keep_columns(s);
    state_.version = ++last_version_;
    now_ = state_;
    find_spin();
    if (material_.density > 0) momentum_ = mass_times(state_.v);
}

} // namespace amontons
