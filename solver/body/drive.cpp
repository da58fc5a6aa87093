#include "solver/body/drive.hpp"

#include "mesh/base/curve.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {

Vec3 rotation_vector(const Eigen::Quaterniond& q)
{
    const double w = std::abs(q.w());
    const double s = q.vec().norm();
    const double sign = q.w() < 0 ? -1 : 1;
    const double factor = s > 1e-12 ? 2 * std::atan2(s, w) / s : 2 / w;
    return sign * factor * q.vec();
}

Eigen::Quaterniond rotation(const Vec3& vector)
{
    const double angle = vector.norm();
    const double half = 0.5 * angle;
    const double factor = angle > 1e-9 ? std::sin(half) / angle : 0.5 - angle * angle / 48;
    Eigen::Quaterniond q;
    q.w() = std::cos(half);
    q.vec() = factor * vector;
    return q;
}

std::string name_of_motion(const Vec3& shift, const Vec3& turn)
{
    constexpr double kSmall = 0.02;
    const double size = std::max(shift.norm(), turn.norm());
    const auto words = [](const Vec3& v) {
        Vec3 d = v.normalized();
        for (int i = 0; i < 3; ++i)
            if (std::abs(d[i]) < kSmall) d[i] = 0;
        return fmt::format("({:.2g}, {:.2g}, {:.2g})", d.x(), d.y(), d.z());
    };
    std::string text;
    if (shift.norm() > kSmall * size) text = "shift along " + words(shift);
    if (turn.norm() > kSmall * size)
        text += (text.empty() ? "turn about " : " with a turn about ") + words(turn);
    return text;
}

Placement start_placement(const StartInput& start)
{
    return {rotation(start.turn), start.place};
}

Placement driven_placement(const DriveInput& drive, const Placement& start, const Vec3& centre,
                           double t)
{
    const auto at = [&](const CurvePoints& c) { return c.empty() ? 0.0 : curve_value(c, t); };
    const Eigen::Quaterniond turn = rotation(at(drive.angle) * drive.axis.normalized());
    const Vec3 about = drive.about.value_or(start * centre);
    const Vec3 shift(at(drive.x), at(drive.y), at(drive.z));
    return {turn * start.turn, about + turn * (start.shift - about) + shift};
}

void turn_with_mesh(SolidInput& input, VolumeMesh& mesh)
{
    const bool axes_matter = std::ranges::any_of(input.hold, [](const HoldInput& h) {
        return !h.x.empty() || !h.y.empty() || !h.z.empty() || h.affine();
    });
    if (!axes_matter) return;
    if (input.start.turn.isZero(0) || (!input.hold.empty() && input.hold[0].axes == "body")) return;
    const Eigen::Quaterniond turn = rotation(input.start.turn);
    for (Vec3& x : mesh.nodes)
        x = turn * x;
    input.material.fibre = turn * input.material.fibre;
    input.material.turned = input.start.turn;
    input.start.turn.setZero();
}

} // namespace amontons
