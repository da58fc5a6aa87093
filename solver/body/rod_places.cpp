#include "solver/body/drive.hpp"
#include "solver/body/rod_body.hpp"
#include "solver/scene/instrument_rods.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

// Places on a rod: what a motion of its nodes does to them, and their forces to the nodes.

namespace amontons {
namespace {

// What holds a contact's normal motion in the matrix, of compression times the half wave that it
// buckles in over an element's length squared: two neighbours hold the rod's slope, too.
constexpr double kHold = 4;
constexpr double kRope = 10;
constexpr double kStabilise = 0.1; // on what is compliant, of its own stiffness there
constexpr double kTautRod = 1e3;   // tension times length squared of EI: bending holds nothing

/// Between two nodes, in space [rad/s].
Vec3 spin_between(const std::vector<BeamNode>& nodes, const std::vector<Vec6>& velocity,
                  std::array<int, 2> node, double share)
{
    const auto spin = [&](int i) {
        const auto n = std::size_t(i);
        return Vec3(rotation_matrix(nodes[n].q) * velocity[n].tail<3>());
    };
    return (1 - share) * spin(node[0]) + share * spin(node[1]);
}

} // namespace

Curve RodBody::curve_of(const Motion& m) const
{
    const std::vector<BeamNode>& nodes = m.nodes;
    Curve c;
    c.closed = rod_.closed;
    c.pieces.reserve(std::size_t(rod_.element_count()));
    c.start.reserve(std::size_t(rod_.element_count()) + 1);
    c.start.push_back(0);
    Mat3 before = rotation_matrix(nodes[0].q);
    for (int e = 0; e < rod_.element_count(); ++e) {
        const BeamNode &a = nodes[std::size_t(e)], &b = nodes[std::size_t(rod_.second(e))];
        const double L = grows(e) ? first_length(m.end) : rod_.law[std::size_t(e)].length;
        const Mat3 behind = rotation_matrix(b.q);
        c.pieces.push_back({a.position(), b.position(), L * (before * rod_.axis(e, 0)),
                            L * (behind * rod_.axis(e, 1)), rod_.radius[std::size_t(e)]});
        c.start.push_back(c.start.back() + L);
        before = behind; // elements follow each other
    }
    return c;
}

RodBody::Nearest RodBody::nearest(const Vec3& x) const
{
    constexpr int kParts = 16, kSteps = 60; // of an element; of a bisection between two of them
    Nearest best;
    best.distance = std::numeric_limits<double>::infinity();
    for (int e = 0; e < rod_.element_count(); ++e) {
        const auto away = [&](double t) { return (rod_point(rod_, rod_.nodes, e, t) - x).norm(); };
        int k = 0;
        double least = away(0);
        for (int i = 1; i <= kParts; ++i)
            if (const double d = away(double(i) / kParts); d < least) {
                least = d;
                k = i;
            }
        double low = double(std::max(k - 1, 0)) / kParts,
               high = double(std::min(k + 1, kParts)) / kParts;
        for (int i = 0; i < kSteps; ++i) {
            const double a = low + (high - low) / 3, b = high - (high - low) / 3;
            (away(a) <= away(b) ? high : low) = away(a) <= away(b) ? b : a;
        }
        double t = 0.5 * (low + high);
        for (const double end : {0.0, 1.0}) // which the search only comes near to
            if (away(end) <= away(t) * (1 + 1e-12) + 1e-15 * rod_.length) t = end;
        if (!(away(t) < best.distance)) continue;
        best.distance = away(t);
        best.s = rod_.s[std::size_t(e)] + t * rod_.law[std::size_t(e)].length;
        best.radius = rod_.radius[std::size_t(e)];
    }
    best.node = rod_.node_at(best.s);
    return best;
}

StencilEntry RodBody::place_of_node(int node) const
{
    return node < rod_.element_count() ? StencilEntry{node, 0.0} : StencilEntry{node - 1, 1.0};
}

Placement RodBody::node_pose(int node) const
{
    const BeamNode& n = now_.nodes[std::size_t(node)];
    return {Eigen::Quaterniond(n.q[0], n.q[1], n.q[2], n.q[3]).normalized(), n.position()};
}

int RodBody::segment_of(const CurvePlace& at) const
{
    constexpr double kRounding = 1e-12;
    const bool grows = material_ && at.piece == sheath_.node; // its start is no node's place
    const double L = rod_.law[std::size_t(at.piece)].length,
                 s = grows ? rod_.s[std::size_t(at.piece) + 1] - (1 - at.t) * L
                           : rod_.s[std::size_t(at.piece)] + at.t * L;
    const auto after = std::lower_bound(rod_.segment_start.begin(), rod_.segment_start.end(),
                                        s - kRounding * rod_.length);
    return std::max(int(after - rod_.segment_start.begin()) - 1, 0);
}

bool RodBody::lies_in(const RodBody& other) const
{
    return slide_in_one_another(input_, other.input_) && fits_in(input_, other.input_);
}

std::vector<double> RodBody::bore() const
{
    std::vector<double> radii;
    for (int e = 0; e < rod_.element_count(); ++e)
        radii.push_back(input_.segments[std::size_t(segment_of({e, 0.5}))].inner_radius);
    return radii;
}

bool RodBody::starts_in_sheath(int node) const
{
    // The node at the sheath's end stands there, whatever material that is.
    if (!material_) return false;
    double least = rod_.length;
    for (const auto& point : input_.fed)
        least = std::min(least, point[1]);
    return node <= node_at_end(rod_.length - least);
}

Curve RodBody::curve() const
{
    return curve_of(now_);
}

Curve RodBody::curve_before() const
{
    return curve_of(state_);
}

bool RodBody::holds(const CurvePlace& at, const Vec3& direction) const
{
    const int node = at.t <= 0 ? at.piece : at.t >= 1 ? rod_.second(at.piece) : -1;
    if (node < 0) return false;
    Vec3 left = direction;
    for (const Hold& h : holds_)
        if (std::find(h.nodes.begin(), h.nodes.end(), node) != h.nodes.end())
            for (int k = 0; k < 3; ++k)
                if (h.axis[std::size_t(k)]) left[k] = 0;
    if (input_.plane) {
        const Vec3 normal = input_.plane->normalized();
        left -= normal.dot(left) * normal;
    }
    return left.norm() < 1e-6;
}

double RodBody::least_radius() const
{
    return *std::min_element(rod_.radius.begin(), rod_.radius.end());
}

double RodBody::contact_reach() const
{
    double longest = 0;
    for (const ElementLaw& law : rod_.law)
        longest = std::max(longest, law.length);
    return 2 * *std::max_element(rod_.radius.begin(), rod_.radius.end()) + 0.25 * longest;
}

double RodBody::reach_of_iteration() const
{
    constexpr double kOfRadius = 1.35, kOfRadiusLater = 0.1, kOfWay = 1.5;
    const bool fed_alone = material_ && !step_.dynamic && loads_.empty() && drag() == 0 &&
                           step_.gravity.isZero(0) &&
                           std::ranges::all_of(holds_, [](const Hold& h) {
                               return h.nodes[0] == 0; // in the sheath
                           });
    if (!fed_alone) return std::numeric_limits<double>::infinity();
    const double thickest = *std::max_element(rod_.radius.begin(), rod_.radius.end());
    // Newton's method moves less and less. What an iterate should pass nevertheless is found in the
    // next one, since all that overlaps is.
    if (std::isfinite(last_motion_))
        return std::max(kOfRadiusLater * thickest, kOfWay * last_motion_);
    const double way = std::max(std::abs(sheath_.fed - accepted_.end.fed), largest_motion());
    return std::max(kOfRadius * thickest, kOfWay * way);
}

void RodBody::set_contact_forces(std::span<const ContactLoad> loads)
{
    expected_.clear();
    for (const ContactLoad& l : loads)
        expected_.push_back({l.at.nodes[0], l});
}

// A force f = r n of a smooth surface on a place x(y) of the middle line adds to the tangent
//
//   -r J^T (dn/dx) J - (dJ/dy)^T f.
//
// Where what is touched stands still and the rod is compressed, the row n^T J is held besides: with
// r = s - rho (g + n^T J y) the answer s of the contact problem is r itself, since g + n^T J y = 0
// where s > 0, and K with rho is positive definite where the rod is stable between its contacts:
// under compression it is not without them. A contact that releases in this iteration is held once
// too long; the next one does not expect it.
//
// On a solid, rows are held too, as if it stood still: at the end of the iteration it does. A rope
// would move far without contact, and what is left when contact forces take it back is round-off.
// On the way forces on the rod are off by rho times the solid's motion, which is a small part of
// them where rho is far below the solid's own stiffness.
void RodBody::add_contact_stiffness(Eigen::VectorXd& rest)
{
    double compression = 0, tension = 0;                   // the largest [N]
    double pressed = 0;                                    // by all contacts [N]
    double soft = std::numeric_limits<double>::infinity(); // the least EI [N m^2]
    for (const KnownForce& x : expected_)
        pressed += x.load.force.norm();
    for (int e = 0; e < rod_.element_count() && !expected_.empty(); ++e) {
        const ElementLaw& law = rod_.law[std::size_t(e)];
        const double axial = rod_resultants(rod_, now_.nodes, kind_, e)[0];
        compression = std::max(compression, -axial);
        tension = std::max(tension, axial);
        soft = std::min(soft, std::min(law.S[4], law.S[5]) / law.length);
    }
    // Bending does not reach its ends. What is compressed is stabilised by
    // solver/step/body_stabilisation.cpp.
    const bool rope = pressed * size_ * size_ > kRope * soft && tension > compression;
    for (const KnownForce& x : expected_) {
        const int e = x.at.node;
        const ElementLaw& law = rod_.law[std::size_t(e)];
        const double xi = x.at.weight, L = law.length;
        const RodPlace p = rod_place(rod_, now_.nodes, e, xi);
        const double r = x.load.force.dot(x.load.normal);
        Mat12 k = -r * (p.J.transpose() * x.load.curvature * p.J);
        k += force_stiffness({std::span(&x.at, 1), x.load.at.point}, x.load.force);
        const int node[2] = {e, rod_.second(e)};
        double rho = 0;
        if (x.load.still && compression > 0) {
            const double wave =
                3.14159265358979 * std::sqrt(std::min(law.S[4], law.S[5]) / L / compression);
            rho = kHold * compression * std::min(wave, size_) / (L * L);
        } else if (!x.load.still && rope) {
            rho = std::min(kStabilise * x.load.firm, element_stiffness(e));
        }
        if (r > 0 && rho > 0) {
            const Eigen::Matrix<double, 12, 1> row = p.J.transpose() * x.load.normal;
            k += rho * row * row.transpose();
            rest.segment<6>(6 * node[0]) -= rho * x.load.gap * row.head<6>();
            rest.segment<6>(6 * node[1]) -= rho * x.load.gap * row.tail<6>();
        }
        add_element_matrix(rod_, e, k, K_);
    }
}

bool RodBody::slip_is_unbalanced()
{
    if (negative_ == 0 || !stable_ || !is_taut()) return false;
    if (negative_ < 0) factor_at_iterate();
    return negative_ > 0;
}

bool RodBody::is_taut() const
{
    double compression = 0, tension = 0, soft = std::numeric_limits<double>::infinity();
    for (const ElementLaw& law : rod_.law)
        soft = std::min(soft, std::min(law.S[4], law.S[5]) / law.length);
    for (int e = first_outside(); e < rod_.element_count(); ++e) {
        const double axial = rod_resultants(rod_, now_.nodes, kind_, e)[0];
        compression = std::max(compression, -axial);
        tension = std::max(tension, axial);
    }
    return tension > compression && tension * size_ * size_ > kTautRod * soft;
}

RodBody::Line RodBody::line(const BodyPlace& at) const
{
    const int e = at.nodes[0].node;
    const double t = at.nodes[0].weight, L = rod_.law[std::size_t(e)].length;
    const RodPlace p = rod_place(rod_, now_.nodes, e, t);
    Line line;
    line.x = p.x;
    line.J = p.J;
    if (compliant_in_sheath() && e == sheath_.node)
        line.J.leftCols<3>() = along_by_way(now_.nodes, L, t) * along_sheath().transpose();
    line.slope.setZero();
    line.bend.setZero();
    // Of places, and of tangents.
    const double shift[2] = {-6 * t * (1 - t), 6 * t * (1 - t)},
                 turn[2] = {L * (1 - t) * (1 - 3 * t), -L * t * (2 - 3 * t)};
    const double shift2[2] = {12 * t - 6, 6 - 12 * t},
                 turn2[2] = {L * (6 * t - 4), L * (6 * t - 2)};
    for (int i = 0; i < 2; ++i) {
        line.node[i] = i == 0 ? e : rod_.second(e);
        const BeamNode& node = now_.nodes[std::size_t(line.node[i])];
        const Mat3 R = rotation_matrix(node.q);
        const Vec3 a = rod_.axis(e, i);
        line.slope += shift[i] * node.position() + turn[i] * (R * a);
        line.bend += shift2[i] * node.position() + turn2[i] * (R * a);
        line.J_slope.block<3, 3>(0, 6 * i) = shift[i] * Mat3::Identity();
        line.J_slope.block<3, 3>(0, 6 * i + 3) = -turn[i] * (R * skew_matrix(a));
    }
    return line;
}

Mat12 RodBody::force_stiffness(const BodyPlace& at, const Vec3& force) const
{
    const int e = at.nodes[0].node;
    const double xi = at.nodes[0].weight, L = rod_.law[std::size_t(e)].length;
    const double c[2] = {L * xi * (1 - xi) * (1 - xi), -L * xi * xi * (1 - xi)};
    const int node[2] = {e, rod_.second(e)};
    Mat12 k = Mat12::Zero();
    for (int i = 0; i < 2; ++i) { // as of line loads: see add_loads
        const Vec3 a = rod_.axis(e, i);
        const Vec3 f = rotation_matrix(now_.nodes[std::size_t(node[i])].q).transpose() * force;
        k.block<3, 3>(6 * i + 3, 6 * i + 3) -=
            c[i] * (0.5 * (f * a.transpose() + a * f.transpose()) - f.dot(a) * Mat3::Identity());
    }
    return k;
}

double RodBody::element_stiffness(int element) const
{
    const ElementLaw& law = rod_.law[std::size_t(element)];
    return std::min(law.S[4], law.S[5]) / std::pow(law.length, 4);
}

void RodBody::add_free_of_nodes(int from, std::vector<Mat6>& free) const
{
    const auto first = std::ptrdiff_t(free.size()) - from;
    free.resize(std::size_t(first + std::ptrdiff_t(now_.nodes.size())), Mat6::Identity());
    for (const Held& h : held_)
        if (h.node >= from) free[std::size_t(first + h.node)] = h.free;
}

double RodBody::force_scale() const
{
    double most = 0;
    for (const ElementLaw& law : rod_.law)
        most = std::max(most, std::max(law.S[4], law.S[5]) / (law.length * size_ * size_));
    for (const Node6& n : load_)
        most = std::max(most, Eigen::Map<const Vec3>(n.value).norm());
    return most;
}

Vec12 RodBody::row(const BodyPlace& at, const Vec3& direction) const
{
    const int e = at.nodes[0].node;
    const double xi = at.nodes[0].weight;
    const int node[2] = {e, rod_.second(e)};
    if (at.turns || at.half_way) {
        // A node's own place: of its two, the other has no share.
        Vec12 v = Vec12::Zero();
        const int i = xi < 0.5 ? 0 : 1;
        const BeamNode n =
            at.half_way && step_.dynamic ? half_way(node[i]) : now_.nodes[std::size_t(node[i])];
        Vec3 moment = direction;
        if (!at.turns) {
            v.segment<3>(6 * i) = direction;
            moment = (at.point - n.position()).cross(direction);
        }
        v.segment<3>(6 * i + 3) = rotation_matrix(n.q).transpose() * moment;
        return v;
    }
    return rows_along<1>(at, direction);
}

/// Of a place that is fixed to a cross-section.
template <int Count>
Eigen::Matrix<double, 12, Count>
RodBody::rows_along(const BodyPlace& at, const Eigen::Matrix<double, 3, Count>& directions) const
{
    const int e = at.nodes[0].node, node[2] = {e, rod_.second(e)};
    const double xi = at.nodes[0].weight, there = xi_now(e, xi), share = std::max(there, 0.0);
    const RodPlace p = place_on(now_, e, there);
    Eigen::Matrix<double, 12, Count> v = p.J.transpose() * directions;
    if (compliant_in_sheath() && e == sheath_.node && !step_.dynamic)
        v.template topRows<3>() =
            along_sheath() *
            (along_by_way(now_.nodes, rod_.law[std::size_t(e)].length, xi).transpose() *
             directions);
    const Vec3 centre = step_.dynamic ? place_on(begun_, e, xi).x : p.x;
    Eigen::Matrix<double, 3, Count> moments;
    for (int k = 0; k < Count; ++k)
        moments.col(k) = (at.point - centre).cross(Vec3(directions.col(k)));
    for (int i = 0; i < 2; ++i)
        v.template middleRows<3>(6 * i + 3) +=
            (i == 0 ? 1 - share : share) *
            (rotation_matrix(now_.nodes[std::size_t(node[i])].q).transpose() * moments);
    return v;
}

Mat12x3 RodBody::rows(const BodyPlace& at, const Mat3& frame) const
{
    return rows_along<3>(at, frame);
}

void RodBody::add_column(const BodyPlace& at, const Vec3& direction, double scale, int column,
                         std::vector<Eigen::Triplet<double>>& out) const
{
    const int e = at.nodes[0].node, node[2] = {e, rod_.second(e)};
    const Vec12 v = row(at, direction);
    for (int i = 0; i < 12; ++i)
        out.emplace_back(6 * node[i / 6] + i % 6, column, scale * v[i]);
}

Mat3 RodBody::section(const Motion& m, int element, double xi) const
{
    const Quaternion q = interpolate(m.nodes[std::size_t(element)].q,
                                     m.nodes[std::size_t(rod_.second(element))].q, xi);
    return rotation_matrix(q.q);
}

// Contacts of a step of motion are where the step found them, at its start, and so are their arms:
// the section that has moved on is no centre of theirs. Those at rest, and joints, are at the
// iterate.
Vec3 RodBody::displacement(const BodyPlace& at) const
{
    const int e = at.nodes[0].node;
    const double xi = at.nodes[0].weight;
    const double now = xi_now(e, xi), share = std::max(now, 0.0);
    if (step_.dynamic && !at.half_way && !at.turns) { // by the velocities: what forces work on
        const Vec3 from = place_on(state_, e, xi).x;
        const Vec3 spin =
            step_.rule.end * spin_between(now_.nodes, now_.velocity, {e, rod_.second(e)}, share) +
            spin_between(state_.nodes, past_velocity_, {e, rod_.second(e)}, std::max(xi, 0.0));
        return place_on(now_, e, now).x - from + step_.h * spin.cross(at.point - from);
    }
    std::optional<BeamNode> there;
    if (!step_.dynamic) there = place_before(e, xi);
    const Mat3 before = there ? rotation_matrix(there->q) : section(state_, e, xi);
    if (at.turns) {
        const Eigen::Quaterniond turn(section(now_, e, share) * before.transpose());
        return rotation_vector(turn);
    }
    const Vec3 x = place_on(now_, e, now).x, arm = at.point - x;
    const Vec3 turned = before * (section(now_, e, share).transpose() * arm);
    return x - (there ? there->position() : place_on(state_, e, xi).x) + arm - turned;
}

Vec3 RodBody::iterate_velocity(const BodyPlace& at) const
{
    const int e = at.nodes[0].node;
    const double start = at.nodes[0].weight, xi = xi_now(e, start);
    const Vec3 spin =
        spin_between(now_.nodes, now_.velocity, {e, rod_.second(e)}, std::max(xi, 0.0));
    if (at.turns) return spin;
    const bool of_start = step_.dynamic && !at.half_way;
    const Vec3 centre = of_start ? place_on(begun_, e, start).x : place_on(now_, e, xi).x;
    return point_velocity(now_, now_.velocity, e, xi) + spin.cross(at.point - centre);
}

Vec3 RodBody::with_velocity(const std::vector<Vec6>& velocity, const BodyPlace& at) const
{
    const int e = at.nodes[0].node;
    const double xi = at.nodes[0].weight;
    const double now = xi_now(e, xi);
    const Vec3 spin = spin_between(state_.nodes, velocity, {e, rod_.second(e)}, xi);
    if (at.turns) return spin;
    // A joint: the place of the iterate's cross-section, at the state.
    const Vec3 arm =
        step_.dynamic && !at.half_way
            ? Vec3(at.point - place_on(begun_, e, xi).x)
            : Vec3(section(state_, e, xi) * (section(now_, e, std::max(now, 0.0)).transpose() *
                                             (at.point - place_on(now_, e, now).x)));
    return point_velocity(state_, velocity, e, xi) + spin.cross(arm);
}

Vec3 RodBody::start_velocity(const BodyPlace& at) const
{
    return with_velocity(state_.velocity, at);
}

Vec3 RodBody::past_velocity(const BodyPlace& at) const
{
    return with_velocity(past_velocity_, at);
}

} // namespace amontons
