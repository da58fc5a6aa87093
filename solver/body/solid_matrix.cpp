#include "solver/body/solid_body.hpp"

#include "mesh/base/file.hpp"
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

bool same(const VolumeMesh& a, const VolumeMesh& b)
{
    const auto alike = [](const ElementBlock& x, const ElementBlock& y) {
        return x.kind == y.kind && x.nodes == y.nodes;
    };
    return a.nodes == b.nodes && std::ranges::equal(a.blocks, b.blocks, alike);
}

/// A number that distinguishes columns from others.
double print_of(const SparseColumns& C)
{
    const auto bytes = [](const auto* data, Eigen::Index count) {
        return std::string_view(reinterpret_cast<const char*>(data),
                                std::size_t(count) * sizeof *data);
    };
    const std::uint64_t print = hash_bytes(bytes(C.valuePtr(), C.nonZeros())) ^
                                hash_bytes(bytes(C.innerIndexPtr(), C.nonZeros()));
    return double(print >> 12); // exact as a double
}

/// Columns of a moving body are kept with all rows where their product with the forces on them
/// reads less than a solve does: not on meshes of so many nodes that too few columns had room.
constexpr std::size_t kMostNodesOfAllRows = 20000;

} // namespace

bool SolidBody::share_matrix(const SolidBody& other)
{
    const auto dofs = [](const SolidBody& b) {
        std::vector<std::int32_t> all;
        for (const SolidConditions::Held& h : b.conditions_.held)
            all.push_back(h.dof);
        return all;
    };
    if (nonlinear_ || other.nonlinear_ || !same(mesh_, other.mesh_) ||
        material_.youngs_modulus != other.material_.youngs_modulus ||
        material_.poissons_ratio != other.material_.poissons_ratio ||
        material_.density != other.material_.density ||
        input_.mass_damping != other.input_.mass_damping ||
        input_.stiffness_damping != other.input_.stiffness_damping ||
        !conditions_.supports.empty() || !other.conditions_.supports.empty() ||
        touching_ != other.touching_ || rigid_->pins != other.rigid_->pins ||
        dofs(*this) != dofs(other))
        return false;
    matrix_ = other.matrix_;
    return true;
}

/// Once: matrices at rest, the unknowns, the order and pattern of the factor.
void SolidBody::prepare()
{
    prepared_ = true;
    const bool first = matrix_->K.size() == 0; // of those that share it
    if (first) {
        matrix_->K = zero_matrix(*pattern_);
        assemble_stiffness(mesh_, *pattern_, std::span(&material_, 1), matrix_->K, threads_);
        if (!conditions_.supports.empty()) matrix_->K.coeffs() += support_->coeffs();
    }
    if (hyperelastic_) stiffest_ = matrix_->K.coeffs().cwiseAbs().maxCoeff();
    if (corotational_) {
        stiffest_ = matrix_->K.coeffs().cwiseAbs().maxCoeff();
        const Mat6 C = elasticity_matrix(material_);
        for_each_element(mesh_, [&](std::int32_t, ElementKind kind, auto nodes) {
            elements_.push_back(make_corotational(kind, places_of(mesh_, nodes), C));
        });
    }
    std::vector<std::int32_t> fixed;
    for (const SolidConditions::Held& h : conditions_.held)
        fixed.push_back(h.dof);
    const bool pinned = !step_.dynamic && !hyperelastic_; // those: solid_free.cpp
    if (pinned) fixed.insert(fixed.end(), rigid_->pins.begin(), rigid_->pins.end());
    dofs_ = make_free_dofs(*pattern_, fixed);
    const std::vector<std::int32_t> node = node_of_free();
    if (first) {
        if (step_.dynamic && !iterative_) {
            matrix_->M = zero_matrix(*pattern_);
            assemble_mass(mesh_, *pattern_, std::span(&material_, 1), matrix_->M, threads_);
        }
        if (nonlinear_ && !node.empty()) {
            make_step_matrix();
            matrix_->factor.analyse(matrix_->parts.ff, node);
        }
    }
    unknown_ = dofs_.free;
    if (pinned) unknown_.insert(unknown_.end(), rigid_->pins.begin(), rigid_->pins.end());
    unknown_number_.assign(dofs_.number.size(), -1);
    for (std::size_t i = 0; i < unknown_.size(); ++i)
        unknown_number_[std::size_t(unknown_[i])] = std::int32_t(i);
    free_modes_.resize(Eigen::Index(unknown_.size()), step_.dynamic ? 0 : rigid_->R.cols());
    for (std::size_t i = 0; i < unknown_.size() && free_modes_.cols() > 0; ++i)
        free_modes_.row(Eigen::Index(i)) = rigid_->R.row(unknown_[i]);
}

void SolidBody::turn_modes()
{
    std::vector<Vec3> places = mesh_.nodes;
    for (std::size_t i = 0; i < places.size(); ++i)
        places[i] += now_.u.segment<3>(3 * Eigen::Index(i));
    std::vector<std::int32_t> prescribed;
    for (const SolidConditions::Held& h : conditions_.held)
        prescribed.push_back(h.dof);
    RigidModes turned = *rigid_;
    turned.R = find_rigid_modes(places, *pattern_, prescribed).R;
    if (turned.R.cols() != rigid_->R.cols()) return; // nearly aligned nodes: the modes at rest do
    rigid_ = std::move(turned);
    for (std::size_t i = 0; i < unknown_.size(); ++i)
        free_modes_.row(Eigen::Index(i)) = rigid_->R.row(unknown_[i]);
}

std::vector<std::int32_t> SolidBody::node_of_free() const
{
    std::vector<std::int32_t> node(dofs_.free.size());
    for (std::size_t i = 0; i < node.size(); ++i)
        node[i] = dofs_.free[i] / 3;
    return node;
}

void SolidBody::make_matrix()
{
    if (dofs_.free.empty()) return;
    const bool same_step = step_.h == matrix_->h && step_.rule.end == matrix_->theta;
    if (matrix_->constant && (!step_.dynamic || same_step)) return;

    const double h = step_.h, theta = step_.rule.end;

    // ---- Without a factor, or with the last order
    if (iterative_) {
        if (matrix_->large && (!step_.dynamic || same_step)) return;
        matrix_->large.reset(); // its memory first
        const auto [of_mass, of_stiffness] = shares();
        matrix_->large = std::make_unique<LargeMatrix>(mesh_, *pattern_, material_, of_mass,
                                                       of_stiffness, dofs_.fixed, on_all_ranks_);
        ++matrix_->made;
        matrix_->h = h;
        matrix_->theta = theta;
        return;
    }
    make_step_matrix();
    ++matrix_->made;
    if (matrix_->constant) { // another step length: the order and pattern of the factor stay
        matrix_->factor = matrix_->constant->release();
        matrix_->constant.reset();
    }
    FactorResult done;
    double scale = 1;

    // ---- A kept factor
    // A kept factor is known by its mesh, material and holds, not by supports.
    if (messages_ && !cache_.empty() && conditions_.supports.empty()) {
        SolidMatrixKind matrix;
        if (step_.dynamic) {
            const auto [of_mass, of_stiffness] = shares();
            matrix.mass = of_mass;
            matrix.stiffness = of_stiffness;
        }
        SolidFactor kept = cached_factor(cache_, mesh_, std::span(&material_, 1), dofs_, matrix,
                                         matrix_->parts.ff);
        matrix_->factor = std::move(kept.factor);
        done = kept.result;
        scale = kept.scale;
        if (messages_) {
            for (const std::string& m : kept.messages)
                messages_->push_back(input_.name + ": " + m);
            messages_->push_back(input_.name + (kept.factor_read ? ": factor read from the cache"
                                                                 : ": factor made and kept"));
        }
    } else {
        if (matrix_->factor.size() == 0) matrix_->factor.analyse(matrix_->parts.ff, node_of_free());
        if (hyperelastic_)
            matrix_->factor.take({matrix_->S.valuePtr(), std::size_t(matrix_->S.nonZeros())},
                                 matrix_->parts.ff_source);
        else
            matrix_->factor.take(matrix_->parts.ff);
        if (!nonlinear_) drop_step_matrix(); // before L is there: it takes all memory
        done = matrix_->factor.factor_taken();
    }

    // ---- Factor: exact tangent, stabilised, shifted
    if (exact_tangent_) not_positive_ = false;
    border_.resize(0, 0);
    if (done && hyperelastic_ && free_modes_.cols() > 0) find_border();
    if (!done && hyperelastic_) {
        if (next_shift() > 0) return make_matrix();
        std::size_t worst = 0;
        for (std::size_t e = 0; e < hyper_states_.size(); ++e)
            if (hyper_states_[e].least_volume < hyper_states_[worst].least_volume) worst = e;
        fault_ = fmt::format("{}: its matrix cannot be made positive definite: an iterate is too "
                             "far from balance, {} has {:.2g} of its volume left",
                             input_.name, element_place(mesh_, std::int32_t(worst)),
                             hyper_states_[worst].least_volume);
        return;
    }
    if (!done && exact_tangent_) { // W must be positive: leave out what made it indefinite
        exact_tangent_ = false;
        make_matrix();
        exact_tangent_ = true;
        not_positive_ = true;
        return;
    }
    if (!done) { // rounding: of mass beside stiffness, of stiffness beside damping, of thin
                 // elements
        const std::string found = fmt::format(
            "a matrix that is not positive definite at {}",
            done.failed_dof < 0 ? "some node"
                                : node_place(mesh_, dofs_.free[std::size_t(done.failed_dof)] / 3));
        if (!messages_) throw LinearFault(input_.name + ": " + found); // in the midst of a run
        throw InputError(
            {{file_, "/bodies/" + input_.name, found,
              "sizes, stiffness, density, damping and time.step that a step can add up "
              "in 16 digits"}});
    }

    // ---- Columns of the compliance
    matrix_->h = h;
    matrix_->theta = theta;
    if (nonlinear_) return;
    drop_step_matrix();
    matrix_->factor.drop_matrix();
    const bool all_rows = step_.dynamic && mesh_.nodes.size() <= kMostNodesOfAllRows;
    matrix_->constant.emplace(std::move(matrix_->factor), dofs_, touching_,
                              SolidCompliance::kColumnMemory,
                              all_rows ? ColumnRows::all : ColumnRows::surface);
    matrix_->constant->set_scale(scale);
    matrix_->constant->use_threads(threads_);
    matrix_->scale = scale;
    constexpr double kSolvesPerStep = 2;
    if (step_.dynamic) matrix_->constant->expect(kSolvesPerStep * expected_steps_);
}

void SolidBody::use_threads(int threads)
{
    threads_ = threads;
    if (matrix_->constant) matrix_->constant->use_threads(threads);
}

void SolidBody::drop_step_matrix()
{
    SolidMatrix& m =
        *matrix_; // swapped: a matrix that an empty one is assigned to keeps its memory
    for (SparseMatrix* const A : {&m.S, &m.parts.ff, &m.parts.fc})
        SparseMatrix().swap(*A);
    m.parts = {};
}

/// Of mass and stiffness in A.
std::pair<double, double> SolidBody::shares() const
{
    if (!step_.dynamic) return {0, 1};
    return matrix_shares(step_.rule, step_.h, input_.mass_damping, input_.stiffness_damping);
}

Eigen::VectorXd SolidBody::step_times(const Eigen::VectorXd& y) const
{
    const auto [of_mass, of_stiffness] = shares();
    Eigen::VectorXd f = of_stiffness * stiffness_times(y);
    if (of_mass != 0) f += of_mass * mass_times(y);
    for (const std::int32_t dof : dofs_.fixed)
        f[dof] = 0;
    return f;
}

Eigen::VectorXd SolidBody::step_diagonal() const
{
    const auto [of_mass, of_stiffness] = shares();
    Eigen::VectorXd d = of_stiffness * matrix_->K.diagonal();
    if (of_mass != 0)
        for (Eigen::Index i = 0; i < d.size(); ++i)
            d[i] += of_mass * m_->coeff(i / 3, i / 3);
    return d;
}

void SolidBody::find_free_change()
{
    Eigen::VectorXd f(Eigen::Index(dofs_.free.size()));
    for (std::size_t i = 0; i < dofs_.free.size(); ++i)
        f[Eigen::Index(i)] = large_load_[dofs_.free[i]];
    free_change_ = with_pins(solved(f));
}

/// A of the step, and its parts.
void SolidBody::make_step_matrix()
{
    SolidMatrix& m = *matrix_;
    const bool of_state = hyperelastic_ && known_version_ >= 0;
    if (!of_state || m.S.nonZeros() != m.K.nonZeros()) m.S = m.K; // or its pattern alone
    if (of_state) assemble_tangent(m.S);
    if (corotational_ && !element_states_.empty()) {
        const auto matrix = exact_tangent_ ? corotational_tangent : corotational_stiffness;
        assemble(
            mesh_, *pattern_,
            [&](std::int32_t e, ElementKind, auto, ElementMatrix& K) {
                matrix(elements_[std::size_t(e)], element_states_[std::size_t(e)], K);
            },
            m.S);
        if (!conditions_.supports.empty()) m.S.coeffs() += support_->coeffs();
    }
    if (step_.dynamic) {
        const auto [of_mass, of_stiffness] = shares();
        m.S.coeffs() = of_mass * m.M.coeffs() + of_stiffness * m.S.coeffs();
    }
    if (m.parts.ff.size() == 0)
        m.parts = make_elimination(m.S, dofs_);
    else if (!hyperelastic_ || pending_.size() > 0 || skew_.nonZeros() > 0)
        eliminate(m.S, m.parts); // of others the factor takes the values from S
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
    if (!prepared_) prepare();
    if (!nonlinear_) make_matrix(); // that of other elements needs their state
    messages_ = nullptr;
}

Eigen::VectorXd SolidBody::solved(const Eigen::VectorXd& f) const
{
    if (f.size() == 0) return f;
    if (iterative_) {
        constexpr double kTolerance = 1e-11, kEnough = 1e-9; // where rounding ends it before
        Eigen::VectorXd all = Eigen::VectorXd::Zero(Eigen::Index(dofs_.number.size())), y(f.size());
        for (std::size_t i = 0; i < dofs_.free.size(); ++i)
            all[dofs_.free[i]] = f[Eigen::Index(i)];
        matrix_->large->set_blocks({}, true, true);
        const LargeMatrix::Result done = matrix_->large->solve(all, kTolerance);
        if (!done.fault.empty() && !(done.reached <= kEnough))
            throw LinearFault(input_.name + ": " + done.fault);
        for (std::size_t i = 0; i < dofs_.free.size(); ++i)
            y[Eigen::Index(i)] = all[dofs_.free[i]];
        return y;
    }
    if (!matrix_->constant) {
        Eigen::VectorXd y = matrix_->factor.solved(f);
        if (border_.size() > 0)
            y += border_ * (border_matrix_ * Eigen::VectorXd(border_.transpose() * f));
        return y;
    }
    return matrix_->constant->factor().solved(f) / matrix_->scale;
}

void SolidBody::solve_all(Eigen::MatrixXd& F) const
{
    if (matrix_->constant && !iterative_ && F.rows() > 0) {
        matrix_->constant->factor().solve(F);
        F /= matrix_->scale;
    } else
        for (Eigen::Index j = 0; j < F.cols(); ++j)
            F.col(j) = solved(F.col(j));
}

bool SolidBody::kept_W(const SparseColumns& C, Eigen::MatrixXd& W) const
{
    if (last_columns_.cols() == 0 || last_made_ != matrix_->made || !same(C, last_columns_))
        return false;
    W = last_W_;
    return true;
}

void SolidBody::keep_W(const SparseColumns& C, const Eigen::MatrixXd& W)
{
    last_columns_ = C;
    last_W_ = W;
    last_made_ = matrix_->made;
    known_print_ = -1;
}

bool SolidBody::make_W(const SparseColumns& C, const SparseColumns& whole, Eigen::MatrixXd& W)
{
    const bool again = restored_columns_ >= 0 && restored_columns_ == print_of(C);
    restored_columns_ = -1;
    if (again && last_from_factor_)
        matrix_->constant->delassus_from_factor(whole, W);
    else
        last_from_factor_ = !matrix_->constant->delassus(whole, W);
    return again;
}

double SolidBody::print_of_last_columns() const
{
    if (restored_columns_ >= 0) return restored_columns_;
    if (known_print_ < 0) known_print_ = print_of(last_columns_);
    return known_print_;
}

void SolidBody::compliance(const SparseColumns& C, Eigen::MatrixXd& W)
{
    if (kept_W(C, W)) return;
    if (dofs_.free.empty()) // held everywhere
        W.setZero(C.cols(), C.cols());
    else {
        const auto free = Eigen::Index(dofs_.free.size());
        const SparseColumns top = C.rows() == free ? C : SparseColumns(C.topRows(free));
        if (iterative_) { // a solve a column: for a few contacts that no other way serves
            W.resize(C.cols(), C.cols());
            for (Eigen::Index j = 0; j < C.cols(); ++j)
                W.col(j) = top.transpose() * solved(Eigen::VectorXd(top.col(j)));
            W = (0.5 * (W + W.transpose())).eval();
        } else if (matrix_->constant)
            make_W(C, top, W);
        else
            matrix_->factor.compliance(top, W);
        if (border_.size() > 0) {
            const Eigen::MatrixXd seen = border_.transpose() * top;
            W += seen.transpose() * (border_matrix_ * seen);
            W = (0.5 * (W + W.transpose())).eval();
        }
        if (!volumes_.empty()) { // what moves leaves the prescribed volumes as they are
            const Eigen::MatrixXd moved = top.transpose() * volume_compliance_;
            W -= moved * volume_matrix_ * moved.transpose();
        }
    }
    keep_W(C, W);
}

Eigen::VectorXd SolidBody::solve(const Eigen::VectorXd& force)
{
    const Eigen::VectorXd on_free = force.head(Eigen::Index(dofs_.free.size()));
    Eigen::VectorXd y = matrix_->constant && on_free.size() > 0 ? matrix_->constant->solved(on_free)
                                                                : solved(on_free);
    if (!volumes_.empty())
        y -= volume_compliance_ * (volume_matrix_ * (volume_compliance_.transpose() * on_free));
    return with_pins(y);
}

Eigen::VectorXd SolidBody::with_pins(const Eigen::VectorXd& y) const
{
    Eigen::VectorXd all = Eigen::VectorXd::Zero(Eigen::Index(unknown_.size()));
    all.head(y.size()) = y;
    return all;
}

} // namespace amontons
