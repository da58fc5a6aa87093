#include "solver/body/rod_body.hpp"

#include <algorithm>
#include <cmath>

// Places on a rod: what a motion of its nodes does to them, and their forces to the nodes.

namespace amontons {
namespace {

// What holds a contact's normal motion in the matrix, of compression times the half wave that it
// buckles in over an element's length squared: two neighbours hold the rod's slope, too.
constexpr double kHold = 4;

} // namespace

Curve RodBody::curve_of(const std::vector<BeamNode>& nodes) const
{
    Curve c;
    c.closed = rod_.closed;
    c.start.push_back(0);
    for (int e = 0; e < rod_.element_count(); ++e) {
        const BeamNode &a = nodes[std::size_t(e)], &b = nodes[std::size_t(rod_.second(e))];
        const double L = rod_.law[std::size_t(e)].length;
        c.pieces.push_back(
            {a.position(), b.position(), L * (rotation_matrix(a.q) * rod_.axis(e, 0)),
             L * (rotation_matrix(b.q) * rod_.axis(e, 1)), rod_.radius[std::size_t(e)]});
        c.start.push_back(c.start.back() + L);
    }
    return c;
}

Curve RodBody::curve() const
{
    return curve_of(now_.nodes);
}

Curve RodBody::curve_before() const
{
    return curve_of(state_.nodes);
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

double RodBody::contact_reach() const
{
    double longest = 0;
    for (const ElementLaw& law : rod_.law)
        longest = std::max(longest, law.length);
    return 2 * *std::max_element(rod_.radius.begin(), rod_.radius.end()) + 0.25 * longest;
}

void RodBody::expect_contacts(std::span<const ContactLoad> loads)
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
// under compression it is not without them. A contact that lets go in this iteration is held once
// too long; the next one does not expect it.
void RodBody::add_contact_stiffness(Eigen::VectorXd& rest)
{
    double compression = 0; // the largest [N]
    for (int e = 0; e < rod_.element_count() && !expected_.empty(); ++e) {
        const ElementLaw& law = rod_.law[std::size_t(e)];
        const double stretch = rod_strain(rod_, now_.nodes, kind_, e)[0];
        compression = std::max(compression, (law.P[0] - law.S[0] * stretch) / law.length);
    }
    for (const Expected& x : expected_) {
        const int e = x.at.node;
        const double xi = x.at.weight, L = rod_.law[std::size_t(e)].length;
        const RodPlace p = rod_place(rod_, now_.nodes, e, xi);
        const double r = x.load.force.dot(x.load.normal);
        Eigen::Matrix<double, 12, 12> k = -r * (p.J.transpose() * x.load.curvature * p.J);
        const double c[2] = {L * xi * (1 - xi) * (1 - xi), -L * xi * xi * (1 - xi)};
        const int node[2] = {e, rod_.second(e)};
        for (int i = 0; i < 2; ++i) { // as of line loads: see add_loads
            const Vec3 a = rod_.axis(e, i);
            const Vec3 f =
                rotation_matrix(now_.nodes[std::size_t(node[i])].q).transpose() * x.load.force;
            k.block<3, 3>(6 * i + 3, 6 * i + 3) -=
                c[i] *
                (0.5 * (f * a.transpose() + a * f.transpose()) - f.dot(a) * Mat3::Identity());
        }
        if (x.load.still && r > 0 && compression > 0) {
            const Eigen::Matrix<double, 12, 1> row = p.J.transpose() * x.load.normal;
            const double wave =
                3.14159265358979 * std::sqrt(rod_.law[std::size_t(e)].S[4] / L / compression);
            const double rho = kHold * compression * std::min(wave, size_) / (L * L);
            k += rho * row * row.transpose();
            rest.segment<6>(6 * node[0]) -= rho * x.load.gap * row.head<6>();
            rest.segment<6>(6 * node[1]) -= rho * x.load.gap * row.tail<6>();
        }
        add_element_matrix(rod_, e, k, K_);
    }
}

void RodBody::add_column(const BodyPlace& at, const Vec3& direction, double scale, int column,
                         std::vector<Eigen::Triplet<double>>& out) const
{
    const int e = at.nodes[0].node;
    const double xi = at.nodes[0].weight;
    const RodPlace p = rod_place(rod_, now_.nodes, e, xi);
    Eigen::Matrix<double, 12, 1> v = p.J.transpose() * direction;
    const Vec3 moment = (at.point - p.x).cross(direction);
    const int node[2] = {e, rod_.second(e)};
    for (int i = 0; i < 2; ++i)
        v.segment<3>(6 * i + 3) +=
            (i == 0 ? 1 - xi : xi) *
            (rotation_matrix(now_.nodes[std::size_t(node[i])].q).transpose() * moment);
    for (int i = 0; i < 12; ++i)
        out.emplace_back(6 * node[i / 6] + i % 6, column, scale * v[i]);
}

Mat3 RodBody::section(const Motion& m, int element, double xi) const
{
    const Quaternion q = interpolate(m.nodes[std::size_t(element)].q,
                                     m.nodes[std::size_t(rod_.second(element))].q, xi);
    return rotation_matrix(q.q);
}

Vec3 RodBody::displacement(const BodyPlace& at) const
{
    const int e = at.nodes[0].node;
    const double xi = at.nodes[0].weight;
    const Vec3 x = rod_point(rod_, now_.nodes, e, xi), arm = at.point - x;
    const Vec3 turned = section(state_, e, xi) * (section(now_, e, xi).transpose() * arm);
    return x - rod_point(rod_, state_.nodes, e, xi) + arm - turned;
}

Vec3 RodBody::velocity(const BodyPlace& at) const
{
    const int e = at.nodes[0].node;
    const double xi = at.nodes[0].weight;
    const Vec3 arm = at.point - rod_point(rod_, now_.nodes, e, xi);
    const std::size_t a = std::size_t(e), b = std::size_t(rod_.second(e));
    const Vec3 spin = (1 - xi) * (rotation_matrix(now_.nodes[a].q) * now_.velocity[a].tail<3>()) +
                      xi * (rotation_matrix(now_.nodes[b].q) * now_.velocity[b].tail<3>());
    return point_velocity(now_.nodes, now_.velocity, e, xi) + spin.cross(arm);
}

Vec3 RodBody::with_velocity(const std::vector<Vec6>& velocity, const BodyPlace& at) const
{
    // The place of the iterate's cross-section, at the state.
    const int e = at.nodes[0].node;
    const double xi = at.nodes[0].weight;
    const Vec3 arm = section(state_, e, xi) * (section(now_, e, xi).transpose() *
                                               (at.point - rod_point(rod_, now_.nodes, e, xi)));
    const std::size_t a = std::size_t(e), b = std::size_t(rod_.second(e));
    const Vec3 spin = (1 - xi) * (rotation_matrix(state_.nodes[a].q) * velocity[a].tail<3>()) +
                      xi * (rotation_matrix(state_.nodes[b].q) * velocity[b].tail<3>());
    return point_velocity(state_.nodes, velocity, e, xi) + spin.cross(arm);
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
