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

/// Node of each free degree of freedom.
std::vector<std::int32_t> node_of_free(const SolidUnknowns& unknowns)
{
    std::vector<std::int32_t> node(unknowns.dofs.free.size());
    for (std::size_t i = 0; i < node.size(); ++i)
        node[i] = unknowns.dofs.free[i] / 3;
    return node;
}

double print_of_last_columns(const KeptCompliance& kept)
{
    if (kept.restored >= 0) return kept.restored;
    if (kept.print < 0) kept.print = print_of(kept.columns);
    return kept.print;
}

} // namespace

bool SolidBody::share_matrix(const SolidBody& other)
{
    if (nonlinear_ || other.nonlinear_ || !same(model_.mesh, other.model_.mesh) ||
        model_.material.youngs_modulus != other.model_.material.youngs_modulus ||
        model_.material.poissons_ratio != other.model_.material.poissons_ratio ||
        model_.material.density != other.model_.material.density ||
        model_.input.mass_damping != other.model_.input.mass_damping ||
        model_.input.stiffness_damping != other.model_.input.stiffness_damping ||
        !model_.conditions.supports.empty() || !other.model_.conditions.supports.empty() ||
        unknowns_.touching != other.unknowns_.touching ||
        unknowns_.rigid->pins != other.unknowns_.rigid->pins ||
        prescribed_dofs(model_.conditions) != prescribed_dofs(other.model_.conditions))
        return false;
    matrix_ = other.matrix_;
    return true;
}

/// Once: matrices at rest, the unknowns, the order and pattern of the factor.
void SolidBody::prepare()
{
    const bool first = matrix_->K.size() == 0; // of those that share it
    if (first) {
        matrix_->K = zero_matrix(*model_.pattern);
        assemble_stiffness(model_.mesh, *model_.pattern, std::span(&model_.material, 1), matrix_->K,
                           solving_.threads);
        if (!model_.conditions.supports.empty()) matrix_->K.coeffs() += model_.support->coeffs();
    }
    if (nonlinear_) matrix_->stiffest = matrix_->K.coeffs().cwiseAbs().maxCoeff();
    if (model_.corotational) corotated_.elements = corotational_elements(model_);
    std::vector<std::int32_t> fixed = prescribed_dofs(model_.conditions);
    const bool pinned = !step_.dynamic && !model_.hyperelastic; // those: solid_free.cpp
    if (pinned)
        fixed.insert(fixed.end(), unknowns_.rigid->pins.begin(), unknowns_.rigid->pins.end());
    unknowns_.dofs = make_free_dofs(*model_.pattern, fixed);
    const std::vector<std::int32_t> node = node_of_free(unknowns_);
    if (first) {
        if (step_.dynamic && !solving_.iterative) {
            matrix_->M = zero_matrix(*model_.pattern);
            assemble_mass(model_.mesh, *model_.pattern, std::span(&model_.material, 1), matrix_->M,
                          solving_.threads);
        }
        if (nonlinear_ && !node.empty()) {
            make_step_matrix();
            matrix_->factor.analyse(matrix_->parts.ff, node);
        }
    }
    unknowns_.dof = unknowns_.dofs.free;
    if (pinned)
        unknowns_.dof.insert(unknowns_.dof.end(), unknowns_.rigid->pins.begin(),
                             unknowns_.rigid->pins.end());
    unknowns_.number.assign(unknowns_.dofs.number.size(), -1);
    for (std::size_t i = 0; i < unknowns_.dof.size(); ++i)
        unknowns_.number[std::size_t(unknowns_.dof[i])] = std::int32_t(i);
    unknowns_.modes.resize(Eigen::Index(unknowns_.dof.size()),
                           step_.dynamic ? 0 : unknowns_.rigid->R.cols());
    for (std::size_t i = 0; i < unknowns_.dof.size() && unknowns_.modes.cols() > 0; ++i)
        unknowns_.modes.row(Eigen::Index(i)) = unknowns_.rigid->R.row(unknowns_.dof[i]);
}

/// Factors the matrix of the step, or reads its factor where one is kept.
/// @param scale  of the step's matrix over the one that is factored
FactorResult SolidBody::factor_step_matrix(std::vector<std::string>* messages, double& scale)
{
    SolidMatrix& m = *matrix_;
    // A kept factor is known by its mesh, material and holds, not by supports.
    if (messages && !solving_.cache.empty() && model_.conditions.supports.empty()) {
        SolidMatrixKind kind;
        if (step_.dynamic) {
            const auto [of_mass, of_stiffness] = shares(model_, step_);
            kind.mass = of_mass;
            kind.stiffness = of_stiffness;
        }
        SolidFactor kept =
            cached_factor(solving_.cache, model_.mesh, std::span(&model_.material, 1),
                          unknowns_.dofs, kind, m.parts.ff);
        m.factor = std::move(kept.factor);
        scale = kept.scale;
        for (const std::string& message : kept.messages)
            messages->push_back(model_.input.name + ": " + message);
        messages->push_back(model_.input.name + (kept.factor_read ? ": factor read from the cache"
                                                                  : ": factor made and kept"));
        return kept.result;
    }
    if (m.factor.size() == 0) m.factor.analyse(m.parts.ff, node_of_free(unknowns_));
    if (model_.hyperelastic)
        m.factor.take({m.S.valuePtr(), std::size_t(m.S.nonZeros())}, m.parts.ff_source);
    else
        m.factor.take(m.parts.ff);
    if (!nonlinear_) drop_step_matrix(m); // before L is there: it takes all memory
    return m.factor.factor_taken();
}

/// @param messages  of make_ready(); nullptr in the midst of a run
void SolidBody::make_matrix(std::vector<std::string>* messages)
{
    if (unknowns_.dofs.free.empty()) return;
    const bool same_step = step_.h == matrix_->h && step_.rule.end == matrix_->theta;
    if (matrix_->constant && (!step_.dynamic || same_step)) return;

    const double h = step_.h, theta = step_.rule.end;

    // ---- Without a factor, or with the last order
    if (solving_.iterative) {
        if (matrix_->large && (!step_.dynamic || same_step)) return;
        matrix_->large.reset(); // its memory first
        const auto [of_mass, of_stiffness] = shares(model_, step_);
        matrix_->large = std::make_unique<LargeMatrix>(model_.mesh, *model_.pattern,
                                                       model_.material, of_mass, of_stiffness,
                                                       unknowns_.dofs.fixed, solving_.on_all_ranks);
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
    double scale = 1;
    const FactorResult done = factor_step_matrix(messages, scale);

    // ---- Factor: exact tangent, stabilised, shifted
    if (corotated_.exact_tangent) corotated_.not_positive = false;
    border_.X.resize(0, 0);
    if (done && model_.hyperelastic && unknowns_.modes.cols() > 0)
        find_border(model_, unknowns_, *matrix_, border_);
    if (!done && model_.hyperelastic) {
        if (next_shift(step_, contact_, tangent_) > 0) return make_matrix(messages);
        std::size_t worst = 0;
        for (std::size_t e = 0; e < hyper_.states.size(); ++e)
            if (hyper_.states[e].least_volume < hyper_.states[worst].least_volume) worst = e;
        hyper_.fault =
            fmt::format("{}: its matrix cannot be made positive definite: an iterate is too "
                        "far from balance, {} has {:.2g} of its volume left",
                        model_.input.name, element_place(model_.mesh, std::int32_t(worst)),
                        hyper_.states[worst].least_volume);
        return;
    }
    if (!done &&
        corotated_.exact_tangent) { // W must be positive: leave out what made it indefinite
        corotated_.exact_tangent = false;
        make_matrix(messages);
        corotated_.exact_tangent = true;
        corotated_.not_positive = true;
        return;
    }
    if (!done) { // rounding: of mass beside stiffness, of stiffness beside damping, of thin
                 // elements
        const std::string found = fmt::format(
            "a matrix that is not positive definite at {}",
            done.failed_dof < 0
                ? "some node"
                : node_place(model_.mesh, unknowns_.dofs.free[std::size_t(done.failed_dof)] / 3));
        if (!messages) throw LinearFault(model_.input.name + ": " + found); // in the midst of a run
        throw InputError(
            {{model_.file, "/bodies/" + model_.input.name, found,
              "sizes, stiffness, density, damping and time.step that a step can add up "
              "in 16 digits"}});
    }

    // ---- Columns of the compliance
    matrix_->h = h;
    matrix_->theta = theta;
    if (nonlinear_) return;
    drop_step_matrix(*matrix_);
    matrix_->factor.drop_matrix();
    const bool all_rows = step_.dynamic && model_.mesh.nodes.size() <= kMostNodesOfAllRows;
    matrix_->constant.emplace(std::move(matrix_->factor), unknowns_.dofs, unknowns_.touching,
                              SolidCompliance::kColumnMemory,
                              all_rows ? ColumnRows::all : ColumnRows::surface);
    matrix_->constant->set_scale(scale);
    matrix_->constant->use_threads(solving_.threads);
    matrix_->scale = scale;
    constexpr double kSolvesPerStep = 2;
    if (step_.dynamic) matrix_->constant->expect(kSolvesPerStep * solving_.expected_steps);
}

void SolidBody::use_threads(int threads)
{
    solving_.threads = threads;
    if (matrix_->constant) matrix_->constant->use_threads(threads);
}

void drop_step_matrix(SolidMatrix& matrix)
{
    SolidMatrix& m = matrix; // swapped: a matrix that an empty one is assigned to keeps its memory
    for (SparseMatrix* const A : {&m.S, &m.parts.ff, &m.parts.fc})
        SparseMatrix().swap(*A);
    m.parts = {};
}

std::pair<double, double> shares(const SolidModel& model, const StepInput& step)
{
    if (!step.dynamic) return {0, 1};
    return matrix_shares(step.rule, step.h, model.input.mass_damping,
                         model.input.stiffness_damping);
}

Eigen::VectorXd SolidBody::step_times(const Eigen::VectorXd& y) const
{
    const auto [of_mass, of_stiffness] = shares(model_, step_);
    Eigen::VectorXd f = of_stiffness * stiffness_times(model_, *matrix_, solving_.threads, y);
    if (of_mass != 0) f += of_mass * mass_times(model_, y);
    for (const std::int32_t dof : unknowns_.dofs.fixed)
        f[dof] = 0;
    return f;
}

Eigen::VectorXd SolidBody::step_diagonal() const
{
    const auto [of_mass, of_stiffness] = shares(model_, step_);
    Eigen::VectorXd d = of_stiffness * matrix_->K.diagonal();
    if (of_mass != 0)
        for (Eigen::Index i = 0; i < d.size(); ++i)
            d[i] += of_mass * model_.mass->coeff(i / 3, i / 3);
    return d;
}

void SolidBody::find_free_change()
{
    const Eigen::VectorXd f = free_part(unknowns_, free_.load);
    free_.change = with_pins(unknowns_, solved(model_, unknowns_, *matrix_, border_, f));
}

/// A of the step, and its parts.
void SolidBody::make_step_matrix()
{
    SolidMatrix& m = *matrix_;
    const bool of_state = model_.hyperelastic && known_.version >= 0;
    if (!of_state || m.S.nonZeros() != m.K.nonZeros()) m.S = m.K; // or its pattern alone
    if (of_state) assemble_tangent(m.S);
    if (model_.corotational && !corotated_.states.empty()) {
        const auto matrix =
            corotated_.exact_tangent ? corotational_tangent : corotational_stiffness;
        assemble(
            model_.mesh, *model_.pattern,
            [&](std::int32_t e, ElementKind, auto, ElementMatrix& K) {
                matrix(corotated_.elements[std::size_t(e)], corotated_.states[std::size_t(e)], K);
            },
            m.S);
        if (!model_.conditions.supports.empty()) m.S.coeffs() += model_.support->coeffs();
    }
    if (step_.dynamic) {
        const auto [of_mass, of_stiffness] = shares(model_, step_);
        m.S.coeffs() = of_mass * m.M.coeffs() + of_stiffness * m.S.coeffs();
    }
    if (m.parts.ff.size() == 0)
        m.parts = make_elimination(m.S, unknowns_.dofs);
    else if (!model_.hyperelastic || search_.pending.size() > 0 || tangent_.skew.nonZeros() > 0)
        eliminate(m.S, m.parts); // of others the factor takes the values from S
}

void SolidBody::make_ready(const StepInput& step, const std::string& cache,
                           std::vector<std::string>& messages)
{
    step_ = step;
    if (step.dynamic && step.rule.filtered && memory_.inner.size() == 0)
        for (Eigen::VectorXd* carried : memory_.all())
            carried->setZero(state_.v.size());
    solving_.cache = cache;
    if (!prepared()) prepare();
    if (!nonlinear_) make_matrix(&messages); // that of other elements needs their state
}

Eigen::VectorXd solved(const SolidModel& model, const SolidUnknowns& unknowns,
                       const SolidMatrix& matrix, const ContactBorder& border,
                       const Eigen::VectorXd& f)
{
    if (f.size() == 0) return f;
    if (matrix.large) {
        constexpr double kTolerance = 1e-11, kEnough = 1e-9; // where rounding ends it before
        Eigen::VectorXd all = Eigen::VectorXd::Zero(Eigen::Index(unknowns.dofs.number.size())),
                        y(f.size());
        for (std::size_t i = 0; i < unknowns.dofs.free.size(); ++i)
            all[unknowns.dofs.free[i]] = f[Eigen::Index(i)];
        matrix.large->set_blocks({}, true, true);
        const LargeMatrix::Result done = matrix.large->solve(all, kTolerance);
        if (!done.fault.empty() && !(done.reached <= kEnough))
            throw LinearFault(model.input.name + ": " + done.fault);
        for (std::size_t i = 0; i < unknowns.dofs.free.size(); ++i)
            y[Eigen::Index(i)] = all[unknowns.dofs.free[i]];
        return y;
    }
    if (!matrix.constant) {
        Eigen::VectorXd y = matrix.factor.solved(f);
        if (border.X.size() > 0)
            y += border.X * (border.T_inverse * Eigen::VectorXd(border.X.transpose() * f));
        return y;
    }
    return matrix.constant->factor().solved(f) / matrix.scale;
}

void solve_all(const SolidModel& model, const SolidUnknowns& unknowns, const SolidMatrix& matrix,
               const ContactBorder& border, Eigen::MatrixXd& F)
{
    if (matrix.constant && F.rows() > 0) {
        matrix.constant->factor().solve(F);
        F /= matrix.scale;
    } else
        for (Eigen::Index j = 0; j < F.cols(); ++j)
            F.col(j) = solved(model, unknowns, matrix, border, F.col(j));
}

bool kept_W(const SolidMatrix& matrix, const KeptCompliance& kept, const SparseColumns& C,
            Eigen::MatrixXd& W)
{
    if (kept.columns.cols() == 0 || kept.made != matrix.made || !same(C, kept.columns))
        return false;
    W = kept.W;
    return true;
}

void keep_W(const SolidMatrix& matrix, KeptCompliance& kept, const SparseColumns& C,
            const Eigen::MatrixXd& W)
{
    kept.columns = C;
    kept.W = W;
    kept.made = matrix.made;
    kept.print = -1;
}

bool make_W(SolidMatrix& matrix, KeptCompliance& kept, const SparseColumns& C,
            const SparseColumns& whole, Eigen::MatrixXd& W)
{
    const bool again = kept.restored >= 0 && kept.restored == print_of(C);
    kept.restored = -1;
    if (again && kept.from_factor)
        matrix.constant->delassus_from_factor(whole, W);
    else
        kept.from_factor = !matrix.constant->delassus(whole, W);
    return again;
}

void SolidBody::compliance(const SparseColumns& C, Eigen::MatrixXd& W)
{
    if (kept_W(*matrix_, kept_, C, W)) return;
    if (unknowns_.dofs.free.empty()) // held everywhere
        W.setZero(C.cols(), C.cols());
    else {
        const auto free = Eigen::Index(unknowns_.dofs.free.size());
        const SparseColumns top = C.rows() == free ? C : SparseColumns(C.topRows(free));
        if (solving_.iterative) { // a solve a column: for a few contacts that no other way serves
            W.resize(C.cols(), C.cols());
            for (Eigen::Index j = 0; j < C.cols(); ++j)
                W.col(j) = top.transpose() * solved(model_, unknowns_, *matrix_, border_,
                                                    Eigen::VectorXd(top.col(j)));
            W = (0.5 * (W + W.transpose())).eval();
        } else if (matrix_->constant)
            make_W(*matrix_, kept_, C, top, W);
        else
            matrix_->factor.compliance(top, W);
        if (border_.X.size() > 0) {
            const Eigen::MatrixXd seen = border_.X.transpose() * top;
            W += seen.transpose() * (border_.T_inverse * seen);
            W = (0.5 * (W + W.transpose())).eval();
        }
        if (!volumes_.loads.empty()) { // what moves leaves the prescribed volumes as they are
            const Eigen::MatrixXd moved = top.transpose() * volumes_.compliance;
            W -= moved * volumes_.matrix * moved.transpose();
        }
    }
    keep_W(*matrix_, kept_, C, W);
}

Eigen::VectorXd SolidBody::solve(const Eigen::VectorXd& force)
{
    const Eigen::VectorXd on_free = force.head(Eigen::Index(unknowns_.dofs.free.size()));
    Eigen::VectorXd y = matrix_->constant && on_free.size() > 0
                            ? matrix_->constant->solved(on_free)
                            : solved(model_, unknowns_, *matrix_, border_, on_free);
    if (!volumes_.loads.empty())
        y -= volumes_.compliance * (volumes_.matrix * (volumes_.compliance.transpose() * on_free));
    return with_pins(unknowns_, y);
}

Eigen::VectorXd stiffness_times(const SolidModel& model, const SolidMatrix& matrix, int threads,
                                const Eigen::VectorXd& u)
{
    return symmetric_times(*model.pattern, matrix.K, u, threads);
}

std::vector<double> kept_columns(const SolidMatrix& matrix, const KeptCompliance& kept,
                                 const SolidUnknowns& unknowns)
{
    std::vector<double> out{print_of_last_columns(kept), double(kept.from_factor)};
    const std::vector<double> columns =
        matrix.constant
            ? matrix.constant->kept()
            : std::vector<double>(SolidCompliance::kept_size(unknowns.touching.size()), -1);
    out.insert(out.end(), columns.begin(), columns.end());
    return out;
}

void keep_columns(SolidMatrix& matrix, KeptCompliance& kept, std::span<const double> columns)
{
    kept.columns = SparseColumns(); // what they were is known by their print alone
    kept.restored = columns[0];
    kept.from_factor = columns[1] != 0;
    if (matrix.constant) matrix.constant->keep(columns.subspan(2));
}

} // namespace amontons
