#include "solver/body/solid_body.hpp"

#include "solver/solid/factor_cache.hpp"

#include <algorithm>
#include <fmt/format.h>

// The matrix of a step, its factor and what is kept of both.

namespace amontons {
namespace {

bool same(const SparseColumns& a, const SparseColumns& b)
{
    return a.rows() == b.rows() && a.cols() == b.cols() && a.nonZeros() == b.nonZeros() &&
           std::equal(a.outerIndexPtr(), a.outerIndexPtr() + a.outerSize() + 1,
                      b.outerIndexPtr()) &&
           std::equal(a.innerIndexPtr(), a.innerIndexPtr() + a.nonZeros(), b.innerIndexPtr()) &&
           std::equal(a.valuePtr(), a.valuePtr() + a.nonZeros(), b.valuePtr());
}

} // namespace

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
    for (const SolidConditions::Held& h : conditions_.held)
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
    unknown_ = dofs_.free;
    if (!step_.dynamic) unknown_.insert(unknown_.end(), rigid_.pins.begin(), rigid_.pins.end());
    unknown_number_.assign(dofs_.number.size(), -1);
    for (std::size_t i = 0; i < unknown_.size(); ++i)
        unknown_number_[std::size_t(unknown_[i])] = std::int32_t(i);
    free_modes_.resize(Eigen::Index(unknown_.size()), step_.dynamic ? 0 : rigid_.R.cols());
    for (std::size_t i = 0; i < unknown_.size() && free_modes_.cols() > 0; ++i)
        free_modes_.row(Eigen::Index(i)) = rigid_.R.row(unknown_[i]);
}

void SolidBody::turn_modes()
{
    std::vector<Vec3> places = mesh_.nodes;
    for (std::size_t i = 0; i < places.size(); ++i)
        places[i] += now_.u.segment<3>(3 * Eigen::Index(i));
    std::vector<std::int32_t> prescribed;
    for (const SolidConditions::Held& h : conditions_.held)
        prescribed.push_back(h.dof);
    Eigen::MatrixXd R = find_rigid_modes(places, pattern_, prescribed).R;
    if (R.cols() != rigid_.R.cols()) return; // nearly aligned nodes: the modes at rest do
    rigid_.R = std::move(R);
    for (std::size_t i = 0; i < unknown_.size(); ++i)
        free_modes_.row(Eigen::Index(i)) = rigid_.R.row(unknown_[i]);
}

void SolidBody::make_matrix()
{
    if (dofs_.free.empty()) return;
    const bool same_step = step_.h == factored_h_ && step_.rule.end == factored_theta_;
    if (constant_ && (!step_.dynamic || same_step)) return;

    const double h = step_.h, theta = step_.rule.end;
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
    if (step.dynamic && step.rule.filtered && memory_.inner.size() == 0)
        for (Eigen::VectorXd* carried : carried_on())
            carried->setZero(state_.v.size());
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
    if (dofs_.free.empty()) // held everywhere
        W.setZero(C.cols(), C.cols());
    else {
        const auto free = Eigen::Index(dofs_.free.size());
        const SparseColumns top = C.rows() == free ? C : SparseColumns(C.topRows(free));
        if (constant_)
            constant_->delassus(top, W);
        else
            factor_.compliance(top, W);
    }
    keep_W(C, W);
}

Eigen::VectorXd SolidBody::solve(const Eigen::VectorXd& force)
{
    return with_pins(solved(force.head(Eigen::Index(dofs_.free.size()))));
}

Eigen::VectorXd SolidBody::with_pins(const Eigen::VectorXd& y) const
{
    Eigen::VectorXd all = Eigen::VectorXd::Zero(Eigen::Index(unknown_.size()));
    all.head(y.size()) = y;
    return all;
}

} // namespace amontons
