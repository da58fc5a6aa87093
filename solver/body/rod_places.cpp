#include "solver/body/rod_body.hpp"

// Places on a rod: what a motion of its nodes does to them, and their forces to the nodes.

namespace amontons {

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
