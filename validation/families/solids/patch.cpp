// A01: two blocks one on the other, meshes that do not match, pressed uniformly. The answer is
// uniform, for any friction.

#include "validation/families/solids/solids.hpp"
#include "validation/solid_run.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <fmt/format.h>
#include <numbers>

namespace amontons::validation {
namespace {

constexpr double kPatchModulus = 1e6, kPatchPressure = 1e3;

struct Worst {
    double u = 0, p = 0, force = 0;
};

/// @param accuracy  of the contact problem; 0: the default
Worst patch(const std::string& element, double nu, double mu, double turn, double accuracy)
{
    SolidScene s("patch");
    SolidInput* lower =
        &s.block("lower", kPatchModulus, nu, {0, 0, 0}, {1, 1, 0.5}, {4, 4, 2}, element);
    lower->hold = {hold("z_min", {}, {}, still()), hold("x_min", still(), {}, {}),
                   hold("y_min", {}, still(), {})};
    lower->start.turn = {0, 0, turn};
    SolidInput& upper =
        s.block("upper", kPatchModulus, nu, {0, 0, 0.5}, {1, 1, 1}, {3, 3, 2}, element);
    upper.hold = {hold("x_min", still(), {}, {}), hold("y_min", {}, still(), {})};
    upper.loads = {pressure("z_max", kPatchPressure)};
    upper.start.turn = {0, 0, turn};
    for (SolidInput& body : s.scene.solids) // they turn with the blocks
        for (HoldInput& h : body.hold)
            h.axes = "body";
    s.touch("upper", "lower", mu, "z_min", "z_max").sliding = "small";
    if (accuracy > 0) s.scene.accuracy.contact = accuracy;
    const SolidRun run = run_solids(s.scene, true);

    Worst w;
    const Mat3 R = Eigen::AngleAxisd(turn, Vec3::UnitZ()).toRotationMatrix();
    for (const BodyRecord& b : run.bodies.back()) {
        const std::vector<Vec3> u = displacements(b), x = first_places(b);
        for (std::size_t i = 0; i < u.size(); ++i) {
            const Vec3 X = R.transpose() * x[i];
            const Vec3 exact = R * Vec3(nu * kPatchPressure / kPatchModulus * X.x(),
                                        nu * kPatchPressure / kPatchModulus * X.y(),
                                        -kPatchPressure / kPatchModulus * X.z());
            raise_to(w.u, (u[i] - exact).norm() / (kPatchPressure / kPatchModulus));
        }
    }
    double sum = 0;
    if (run.last().contacts.empty()) w.p = 1;
    for (const ContactRecord& c : run.last().contacts) {
        raise_to(w.p, std::abs(c.pressure - kPatchPressure) / kPatchPressure);
        sum += c.normal_force;
    }
    w.force = std::abs(sum - kPatchPressure) / kPatchPressure;
    for (double* x : {&w.u, &w.p, &w.force})
        *x = certified(run, *x);
    return w;
}

} // namespace

std::vector<Measured> contact_patch()
{
    std::vector<Measured> rows;
    for (const char* element : {"T4", "T10", "H8"})
        for (const double turn : {0.0, std::numbers::pi / 6}) {
            const std::string of = std::string(element) + (turn > 0 ? " turned by 30 degrees" : "");
            for (const double accuracy : {2e-12, 0.0}) {
                Worst all;
                std::string worst;
                for (const double nu : {0.0, 0.3, 0.49})
                    for (const double mu : {0.0, 0.5}) {
                        const Worst w = patch(element, nu, mu, turn, accuracy);
                        if (!(w.u <= all.u)) worst = fmt::format("worst at nu {}, mu {}", nu, mu);
                        raise_to(all.u, w.u);
                        raise_to(all.p, w.p);
                        raise_to(all.force, w.force);
                    }
                if (accuracy > 0) {
                    rows.push_back(at_most("displacement, largest error, " + of, all.u, 1e-10));
                    rows.back().note = "nu 0, 0.3, 0.49; mu 0, 0.5; " + worst;
                    rows.push_back(at_most("pressure, largest error, " + of, all.p, 1e-10));
                    rows.push_back(at_most("sum of contact forces, " + of, all.force, 1e-10));
                } else {
                    raise_to(all.u, all.p);
                    rows.push_back(at_most("displacement and pressure, accuracy as it comes, " + of,
                                           all.u, 1e-9));
                }
            }
        }
    return rows;
}

} // namespace amontons::validation
