#include "solver/beam/soft_tube.hpp"

#include "mesh/swept_tube.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace amontons {
namespace {

constexpr std::size_t kMostUsed = 700; // nodes in use before those of long ago are released
constexpr std::int32_t kBlock = 8;     // of nodes whose columns are solved together
constexpr double kSingular = 1e-14;    // of a factor's pivots
constexpr int kMostPulls = 8;          // of Newton's method that pulls a point back

/// Values and derivatives of the four uniform cubic B-splines at t in [0, 1).
void cubic(double t, double* w, double* d, double* dd)
{
    const double s = 1 - t;
    w[0] = s * s * s / 6;
    w[1] = (3 * t * t * t - 6 * t * t + 4) / 6;
    w[2] = (3 * s * s * s - 6 * s * s + 4) / 6;
    w[3] = t * t * t / 6;
    d[0] = -s * s / 2;
    d[1] = (3 * t * t - 4 * t) / 2;
    d[2] = (4 * s - 3 * s * s) / 2;
    d[3] = t * t / 2;
    dd[0] = s;
    dd[1] = 3 * t - 2;
    dd[2] = 3 * s - 2;
    dd[3] = t;
}

Wall wall_of(const SolidTubeOptions& o)
{
    return make_wall(SweptTube(o.centreline));
}

} // namespace

// ---- the grid and its columns ------------------------------------------------------------

TubeGrid tube_grid(const SolidTubeOptions& options, const VolumeMesh& mesh)
{
    TubeGrid grid;
    // A T10's middle nodes make the grid twice as fine.
    const std::int32_t half = options.kind == ElementKind::H8 ? 2 : 1;
    const std::vector<TubeSection> all = tube_sections(options);
    grid.rings = 2 * options.along / half + 1;
    grid.ring = 2 * options.around / half;
    grid.ring_distance = options.centreline.length() / (grid.rings - 1);
    const auto key = [&](const Vec3& x) {
        const double unit = 1e-6 * options.thickness;
        return std::array{std::llround(x[0] / unit), std::llround(x[1] / unit),
                          std::llround(x[2] / unit)};
    };
    std::map<std::array<long long, 3>, std::int32_t> node_at;
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i)
        node_at[key(mesh.nodes[i])] = std::int32_t(i);
    for (std::int32_t i = 0; i < grid.rings; ++i)
        for (std::int32_t k = 0; k < grid.ring; ++k) {
            const Vec3 x = tube_point(options, all, half * i, 0, half * k);
            std::int32_t found = -1;
            for (int corner = 0; corner < 27 && found < 0; ++corner) { // rounding of the key
                std::array<long long, 3> at = key(x);
                at[0] += corner % 3 - 1, at[1] += corner / 3 % 3 - 1, at[2] += corner / 9 - 1;
                if (const auto it = node_at.find(at); it != node_at.end()) found = it->second;
            }
            AMONTONS_ASSERT(found >= 0);
            grid.node.push_back(found);
        }
    return grid;
}

TubePlace place_on(const TubeGrid& grid, double along, double around)
{
    TubePlace p;
    p.along = along;
    p.around = around;
    double wa[4], da[4], ea[4], wb[4], db[4], eb[4];
    const double a = std::clamp(along / grid.ring_distance, 0.0, double(grid.rings - 1));
    const double i = std::min(std::floor(a), double(grid.rings - 2));
    cubic(a - i, wa, da, ea);
    const double turn = around / (2 * std::numbers::pi) * grid.ring;
    const double k = std::floor(turn);
    cubic(turn - k, wb, db, eb);
    const double turns = grid.ring / (2 * std::numbers::pi);
    // Beyond its ends the tube moves as its ends do.
    const bool outside = along < 0 || along > grid.ring_distance * (grid.rings - 1);
    for (int m = 0; m < 4; ++m)
        for (int n = 0; n < 4; ++n) {
            const auto at = std::size_t(4 * m + n);
            const auto ring = std::clamp(std::int32_t(i) + m - 1, 0, grid.rings - 1);
            auto in_ring = (std::int64_t(k) + n - 1) % grid.ring;
            if (in_ring < 0) in_ring += grid.ring;
            p.node[at] = ring * grid.ring + std::int32_t(in_ring);
            p.weight[at] = wa[m] * wb[n];
            p.by_along[at] = outside ? 0 : da[m] / grid.ring_distance * wb[n];
            p.by_around[at] = wa[m] * db[n] * turns;
            p.second[0][at] =
                outside ? 0 : ea[m] * wb[n] / (grid.ring_distance * grid.ring_distance);
            p.second[1][at] = outside ? 0 : da[m] * db[n] / grid.ring_distance * turns;
            p.second[2][at] = wa[m] * eb[n] * turns * turns;
        }
    return p;
}

TubeColumns tube_columns(const TubeGrid& grid, const FreeDofs& dofs)
{
    TubeColumns columns;
    const std::vector<std::int32_t>& inner = grid.node;
    for (std::size_t g = 0; g < inner.size(); ++g)
        for (int a = 0; a < 3; ++a)
            if (const auto n = dofs.number[std::size_t(3 * inner[g] + a)]; n >= 0) {
                columns.rows.push_back(n);
                columns.row_place.push_back(std::int32_t(3 * g) + a);
            }
    columns.column.resize(inner.size());
    columns.pieces.resize(inner.size());
    columns.number.assign(inner.size(), -1);
    return columns;
}

void solve_columns(const TubeGrid& grid, const FreeDofs& dofs, const SupernodalFactor& K,
                   std::span<const std::int32_t> grid_nodes, TubeColumns& columns)
{
    // By blocks that are always the same: a column's last bit depends on those solved with it.
    for (const std::int32_t g : grid_nodes) {
        if (columns.column[std::size_t(g)]) continue;
        const std::int32_t first = g / kBlock * kBlock;
        const auto end = std::min(first + kBlock, std::int32_t(grid.node.size()));
        std::vector<std::int32_t> dof, place;
        for (std::int32_t i = first; i < end; ++i) {
            columns.column[std::size_t(i)] = std::make_unique<Eigen::MatrixXd>(
                Eigen::MatrixXd::Zero(3 * Eigen::Index(grid.node.size()), 3));
            for (int a = 0; a < 3; ++a)
                if (const auto n = dofs.number[std::size_t(3 * grid.node[std::size_t(i)] + a)];
                    n >= 0) {
                    dof.push_back(n);
                    place.push_back(3 * i + a);
                }
        }
        columns.solved += int(end - first);
        columns.kept += int(end - first);
        if (dof.empty()) continue;
        Eigen::MatrixXd out(Eigen::Index(columns.rows.size()), Eigen::Index(dof.size()));
        K.inverse_part(columns.rows, dof, out);
        for (std::size_t c = 0; c < dof.size(); ++c) {
            Eigen::MatrixXd& to = *columns.column[std::size_t(place[c] / 3)];
            for (std::size_t r = 0; r < columns.rows.size(); ++r)
                to(columns.row_place[r], place[c] % 3) = out(Eigen::Index(r), Eigen::Index(c));
        }
    }
}

const TubeColumns::Piece& piece_of(TubeColumns& columns, std::int32_t g)
{
    TubeColumns::Piece& piece = columns.pieces[std::size_t(g)];
    const std::vector<std::int32_t>& used = columns.used;
    const Eigen::Index have = piece.cols(), need = Eigen::Index(used.size());
    if (have < need) {
        if (have == 0) columns.with_piece.push_back(g);
        const Eigen::MatrixXd& whole = *columns.column[std::size_t(g)];
        piece.conservativeResize(9, need);
        for (Eigen::Index i = have; i < need; ++i)
            Eigen::Map<Mat3>(piece.col(i).data()) = whole.middleRows<3>(3 * used[std::size_t(i)]);
    }
    return piece;
}

void release_used(TubeColumns& columns)
{
    for (const std::int32_t g : columns.used)
        columns.number[std::size_t(g)] = -1;
    columns.used.clear();
    for (const std::int32_t g : columns.with_piece)
        columns.pieces[std::size_t(g)].resize(9, 0);
    columns.with_piece.clear();
}

void drop_columns(TubeColumns& columns)
{
    for (auto& column : columns.column)
        column.reset();
    columns.kept = 0;
    for (TubeColumns::Piece& piece : columns.pieces)
        piece.resize(9, 0);
    columns.with_piece.clear();
}

// ---- the tube ----------------------------------------------------------------------------

Issue SoftTube::loose_wall()
{
    return {"", "/hold", "a wall that can move as a whole",
            "both ends held, for example: a wall of a wire has no inertia"};
}

SoftTube::SoftTube(SolidTubeOptions options, VolumeMesh mesh, const SolidMaterial& material,
                   const SoftTubeSupport& support)
    : options_(std::move(options))
    , mesh_(std::move(mesh))
    , material_(material)
    , wall_(wall_of(options_))
    , frame_(tube_frame(options_))
    , grid_(tube_grid(options_, mesh_))
{
    pattern_ = make_pattern(mesh_);
    SparseMatrix K = zero_matrix(pattern_);
    assemble_stiffness(mesh_, pattern_, {&material_, 1}, K);
    dofs_ = make_free_dofs(pattern_, support.fixed);
    if (!factor_(K)) throw InputError({loose_wall()});
    columns_ = tube_columns(grid_, dofs_);
    load_ = support.load.size() > 0 ? support.load
                                    : Eigen::VectorXd::Zero(3 * Eigen::Index(mesh_.nodes.size()));
    const Eigen::VectorXd u = load_.isZero(0) ? load_ : answer(load_);
    set_offset_(now_, u);
    set_offset_(start_, u);
}

bool SoftTube::factor_(const SparseMatrix& K)
{
    SupernodalFactor made;
    if (!factor_free(K, dofs_, {}, made) || made.pivot_ratio() < kSingular) return false;
    made.drop_matrix();
    K_ = std::move(made);
    return true;
}

void SoftTube::set_offset_(Field& field, const Eigen::VectorXd& whole)
{
    field.offset.resize(3 * Eigen::Index(grid_.node.size()));
    double largest = 0;
    for (std::size_t g = 0; g < grid_.node.size(); ++g) {
        field.offset.segment<3>(3 * Eigen::Index(g)) = whole.segment<3>(3 * grid_.node[g]);
        largest = std::max(largest, whole.segment<3>(3 * grid_.node[g]).norm());
    }
    if (&field == &now_) loaded_ = largest;
}

/// Makes sure that what the nodes around a place do is known.
void SoftTube::use_(const TubePlace& place)
{
    for (const std::int32_t g : place.node)
        if (columns_.number[std::size_t(g)] < 0) {
            columns_.number[std::size_t(g)] = std::int32_t(columns_.used.size());
            columns_.used.push_back(g);
            now_.current = start_.current = false;
        }
}

void SoftTube::set_(Field& field, std::vector<TubeForce> forces)
{
    if (columns_.used.size() > kMostUsed) { // the wire has continued
        release_used(columns_);
        now_.current = start_.current = false;
    }
    field.forces = std::move(forces);
    field.current = false;
    for (const TubeForce& f : field.forces)
        use_(f.place);
}

void SoftTube::bring_up_(Field& field)
{
    if (field.current) return;
    field.u = Eigen::VectorXd::Zero(3 * Eigen::Index(columns_.used.size()));
    std::vector<std::int32_t> nodes;
    for (const TubeForce& f : field.forces)
        nodes.insert(nodes.end(), f.place.node.begin(), f.place.node.end());
    solve_columns(grid_, dofs_, K_, nodes, columns_);
    // Forces of many places act on the same nodes: one product for each node.
    std::map<std::int32_t, Vec3> at_node;
    for (const TubeForce& f : field.forces)
        for (std::size_t a = 0; a < 16; ++a)
            at_node.try_emplace(f.place.node[a], Vec3::Zero()).first->second +=
                f.place.weight[a] * f.force;
    for (const auto& [g, force] : at_node) {
        const TubeColumns::Piece& piece = piece_of(columns_, g);
        for (Eigen::Index i = 0; i < piece.cols(); ++i)
            field.u.segment<3>(3 * i).noalias() +=
                Eigen::Map<const Mat3>(piece.col(i).data()) * force;
    }
    field.current = true;
}

// ---- displacements -----------------------------------------------------------------------

Vec3 SoftTube::at_(const Field& field, const std::array<double, 16>& weight,
                   const TubePlace& p) const
{
    Vec3 sum = Vec3::Zero();
    for (std::size_t a = 0; a < 16; ++a)
        sum += weight[a] * field.u.segment<3>(3 * columns_.number[std::size_t(p.node[a])]);
    return sum;
}

Vec3 SoftTube::offset_at_(const Field& field, const std::array<double, 16>& weight,
                          const TubePlace& p) const
{
    Vec3 sum = Vec3::Zero();
    for (std::size_t a = 0; a < 16; ++a)
        sum += weight[a] * field.offset.segment<3>(3 * p.node[a]);
    return sum;
}

Vec3 SoftTube::displacement(const TubePlace& p)
{
    use_(p);
    bring_up_(now_);
    return offset_at_(now_, p.weight, p) + at_(now_, p.weight, p);
}

/// Since the start, of both fields brought up.
Vec3 SoftTube::moved_(const std::array<double, 16>& weight, const TubePlace& p) const
{
    const Vec3 by_forces = at_(now_, weight, p) - at_(start_, weight, p);
    if (!hyperelastic_) return by_forces; // the load is the same
    return by_forces + offset_at_(now_, weight, p) - offset_at_(start_, weight, p);
}

Vec3 SoftTube::since_start(const TubePlace& p)
{
    use_(p);
    bring_up_(now_);
    bring_up_(start_);
    return moved_(p.weight, p);
}

// y + u(y) = x by Newton's method from y = x: strains are small, so three rounds do.
PulledBack SoftTube::pull_back(const Vec3& x, WallHint& hint)
{
    PulledBack b;
    b.y = x;
    for (int round = 0; round < kMostPulls; ++round) {
        const CurveLocation at = options_.centreline.nearest(b.y, hint.piece);
        hint.piece = at.piece;
        const CurvePoint c = options_.centreline.at(at);
        const double along = options_.centreline.arc_length(at);
        const Vec3 across = frame_.across(along, c.tangent);
        const Vec3 third = c.tangent.cross(across), arm = b.y - c.position;
        const double u1 = arm.dot(across), u2 = arm.dot(third),
                     distance = std::max(std::hypot(u1, u2), 1e-9 * c.radius);
        b.place = place(along, std::atan2(u2, u1));
        b.u = displacement(b.place);
        const Vec3 turning = (u1 * third - u2 * across) / (distance * distance);
        const double stretch = 1 - c.curvature.dot(arm);
        b.along = c.tangent / stretch;
        b.around = turning;
        b.by_along =
            offset_at_(now_, b.place.by_along, b.place) + at_(now_, b.place.by_along, b.place);
        b.by_around =
            offset_at_(now_, b.place.by_around, b.place) + at_(now_, b.place.by_around, b.place);
        b.gradient = Mat3::Identity() + b.by_along * b.along.transpose() +
                     b.by_around * b.around.transpose();
        b.along_bend =
            (c.curvature * b.along.transpose() + b.along * c.curvature.transpose()) / stretch;
        const Vec3 out = (u1 * across + u2 * third) / distance, sideways = c.tangent.cross(out);
        b.around_bend =
            (c.tangent * (c.tangent.dot(c.curvature.cross(arm)) / stretch) * c.tangent.transpose() -
             out * sideways.transpose() - sideways * out.transpose()) /
            (distance * distance);
        const Vec3 off = x - b.u - b.y;
        if (off.norm() <= 4e-16 * (x.norm() + c.radius)) break;
        b.y += b.gradient.inverse() * off;
    }
    return b;
}

Mat3 SoftTube::bend(const PulledBack& b, const Vec3& m)
{
    double s[3];
    for (std::size_t k = 0; k < 3; ++k)
        s[k] = m.dot(offset_at_(now_, b.place.second[k], b.place) +
                     at_(now_, b.place.second[k], b.place));
    return s[0] * b.along * b.along.transpose() + s[2] * b.around * b.around.transpose() +
           s[1] * (b.along * b.around.transpose() + b.around * b.along.transpose()) +
           m.dot(b.by_along) * b.along_bend + m.dot(b.by_around) * b.around_bend;
}

std::array<Vec3, 2> SoftTube::since_start_slopes(const TubePlace& p)
{
    use_(p);
    bring_up_(now_);
    bring_up_(start_);
    return {moved_(p.by_along, p), moved_(p.by_around, p)};
}

double SoftTube::contact_energy()
{
    bring_up_(now_);
    double sum = 0;
    for (const TubeForce& f : now_.forces)
        sum += 0.5 * f.force.dot(at_(now_, f.place.weight, f.place));
    return sum;
}

template <int kinds> Eigen::MatrixXd SoftTube::compliance_(std::span<const TubePlace> places)
{
    std::vector<std::int32_t> nodes;
    for (const TubePlace& p : places) {
        use_(p);
        nodes.insert(nodes.end(), p.node.begin(), p.node.end());
    }
    solve_columns(grid_, dofs_, K_, nodes, columns_);
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    const auto n = Eigen::Index(places.size()), m = Eigen::Index(nodes.size());
    const auto number = [&](std::int32_t g) {
        return std::lower_bound(nodes.begin(), nodes.end(), g) - nodes.begin();
    };
    std::vector<TubeColumns::Piece> near(nodes.size()); // blocks between these nodes
    for (std::size_t j = 0; j < nodes.size(); ++j) {
        const TubeColumns::Piece& piece = piece_of(columns_, nodes[j]);
        near[j].resize(9, m);
        for (Eigen::Index i = 0; i < m; ++i)
            near[j].col(i) = piece.col(columns_.number[std::size_t(nodes[std::size_t(i)])]);
    }
    const auto weights = [](const TubePlace& p, int kind) -> const std::array<double, 16>& {
        return kind == 0 ? p.weight : kind == 1 ? p.by_along : p.by_around;
    };
    std::vector<std::array<Eigen::Index, 16>> at(places.size());
    for (std::size_t k = 0; k < places.size(); ++k)
        for (std::size_t a = 0; a < 16; ++a)
            at[k][a] = number(places[k].node[a]);
    constexpr int size = 3 * kinds;
    Eigen::MatrixXd C(size * n, size * n);
    TubeColumns::Piece by(9, m);
    for (Eigen::Index j = 0; j < n; ++j)
        for (int b = 0; b < kinds; ++b) {
            by.setZero();
            for (std::size_t a = 0; a < 16; ++a)
                by += weights(places[std::size_t(j)], b)[a] *
                      near[std::size_t(at[std::size_t(j)][a])];
            for (Eigen::Index k = 0; k < n; ++k)
                for (int c = 0; c < kinds; ++c) {
                    Eigen::Matrix<double, 9, 1> sum = Eigen::Matrix<double, 9, 1>::Zero();
                    for (std::size_t a = 0; a < 16; ++a)
                        sum +=
                            weights(places[std::size_t(k)], c)[a] * by.col(at[std::size_t(k)][a]);
                    C.block<3, 3>(size * k + 3 * c, size * j + 3 * b) =
                        Eigen::Map<const Mat3>(sum.data());
                }
        }
    return 0.5 * (C + C.transpose());
}

Eigen::MatrixXd SoftTube::compliance(std::span<const TubePlace> places)
{
    return compliance_<1>(places);
}

Eigen::MatrixXd SoftTube::compliance_with_slopes(std::span<const TubePlace> places)
{
    return compliance_<3>(places);
}

Eigen::VectorXd SoftTube::nodal_forces() const
{
    Eigen::VectorXd f = Eigen::VectorXd::Zero(3 * Eigen::Index(mesh_.nodes.size()));
    for (const TubeForce& force : now_.forces)
        for (std::size_t a = 0; a < 16; ++a)
            f.segment<3>(3 * grid_.node[std::size_t(force.place.node[a])]) +=
                force.place.weight[a] * force.force;
    return f;
}

Eigen::VectorXd SoftTube::answer(const Eigen::VectorXd& f) const
{
    Eigen::VectorXd some(Eigen::Index(dofs_.free.size()));
    for (std::size_t k = 0; k < dofs_.free.size(); ++k)
        some[Eigen::Index(k)] = f[dofs_.free[k]];
    K_.solve(some);
    Eigen::VectorXd u = Eigen::VectorXd::Zero(f.size());
    for (std::size_t k = 0; k < dofs_.free.size(); ++k)
        u[dofs_.free[k]] = some[Eigen::Index(k)];
    return u;
}

Eigen::VectorXd SoftTube::whole_displacement() const
{
    if (hyperelastic_) return state_->offset + answer(nodal_forces());
    return answer(load_ + nodal_forces());
}

std::size_t SoftTube::kept_bytes() const
{
    return std::size_t(columns_.kept) * 9 * sizeof(double) * grid_.node.size();
}

} // namespace amontons
