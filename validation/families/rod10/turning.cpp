#include "validation/families/rod10/turning.hpp"

#include "validation/measure.hpp"

#include <algorithm>
#include <cmath>

namespace amontons::validation {

std::vector<Rod10Node> loaded(const Rod10& rod, const Mat3& to_rod, int node, const Vec3& own)
{
    std::vector<Rod10Node> loads(std::size_t(rod.nodes));
    loads[std::size_t(node)].along = to_rod.transpose() * own;
    return loads;
}

Mat3 turned_to(int frame)
{
    return rotation_of_angles({0, 0, frame * kTurnOfFrame});
}

TurningErrors turning_errors(const Rod10& rod, int every)
{
    const double P = 1e-5, exact = P * std::pow(rod.length, 3) / (3 * rod.bending());
    Rod10Solver solver(rod, every);
    TurningErrors worst;
    double first_length = 0;
    for (int frame = 0; frame <= kTurnFrames; ++frame) {
        const Mat3 to_rod = turned_to(frame);
        solver.orient(to_rod);
        const auto d = solver.deflections(loaded(rod, to_rod, rod.nodes - 1, Vec3(0, P, 0)));
        const Vec3 own = to_rod * d.back().along;
        raise_to(worst.deflection, (own - Vec3(0, exact, 0)).norm() / exact);
        double sum = 0;
        for (int i = 0; i + 1 < rod.nodes; ++i) {
            const Vec3 along = to_rod.transpose() * Vec3(rod.element(), 0, 0);
            sum += (along + d[std::size_t(i) + 1].along - d[std::size_t(i)].along).norm();
        }
        if (frame == 0) first_length = sum;
        raise_to(worst.length, std::abs(sum - first_length) / rod.length);
    }
    return worst;
}

} // namespace amontons::validation
