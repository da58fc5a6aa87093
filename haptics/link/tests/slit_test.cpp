// A slit of rubber that a ball in the hand presses shut: the solid touches itself.

#include "haptics/link/body_link.hpp"
#include "haptics/link/settings.hpp"
#include "haptics/loop/haptic_loop.hpp"
#include "mesh/base/file.hpp"
#include "mesh/tests/relative.hpp"
#include "mesh/tests/temporary_folder.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <array>
#include <fmt/format.h>
#include <map>

using namespace amontons;

namespace {

constexpr int kCells[3] = {8, 2, 5};
constexpr double kSize[3] = {0.005, 0.005, 0.002}; // of a cell [m]

/// A block with a slit in its middle layer, open at the end of x; face set low: its foot.
void write_slit(const std::string& path)
{
    std::map<std::array<int, 3>, int> number;
    std::string nodes, elements, low;
    const auto node = [&](std::array<int, 3> at) {
        const auto [known, added] = number.try_emplace(at, int(number.size()));
        if (added)
            nodes += fmt::format("{:.17g} {:.17g} {:.17g}\n", at[0] * kSize[0], at[1] * kSize[1],
                                 at[2] * kSize[2]);
        return known->second;
    };
    int count = 0;
    for (int k = 0; k < kCells[2]; ++k)
        for (int j = 0; j < kCells[1]; ++j)
            for (int i = 0; i < kCells[0]; ++i) {
                if (k == kCells[2] / 2 && i > 0) continue;
                for (const int up : {0, 1})
                    for (const auto& [a, b] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}})
                        elements += fmt::format("{} ", node({i + a, j + b, k + up}));
                elements.back() = '\n';
                if (k == 0) low += fmt::format("{} 4\n", count);
                ++count;
            }
    write_file(path + ".nodes", nodes);
    write_file(path + ".elements", elements + "face_set low\n" + low);
}

/// The slit under a ball. @param rest  of the ball, and of the scene
std::string scene_of(const std::string& mesh, const std::string& ball, const std::string& rest)
{
    return fmt::format(
        R"("bodies": {{
            "slit": {{"kind": "solid", "mesh": {{"file": "{}.nodes"}}, "hold": [{{"set": "low"}}],
                      "material": {{"law": "neo_hooke", "youngs_modulus": 2e6, "poisson_ratio": 0.3}}}},
            "ball": {{"kind": "rigid", "shape": {{"generate": "ball", "radius": 0.004}},
                      "start": {{"place": [0.034, 0.005, 0.0142]}}{}}}}},
          "contact": [{{"between": ["slit", "slit"]}}, {{"between": ["slit", "ball"]}}], {})",
        mesh, ball, rest);
}

} // namespace

TEST_CASE("a hand that presses a slit shut receives the force of the same run")
{
    const TemporaryFolder folder;
    const std::string mesh = folder / "slit";
    write_slit(mesh);
    const Scene scene = parse_scene(
        "{\"schema\": 1, " +
            scene_of(mesh, "",
                     R"("haptic": {"handle": "ball", "device": "touch", "stiffness": 1e5},
                        "time": {"step": 0.02, "end": 1})") +
            "}",
        "test.json");
    const std::vector<Obstacle> obstacles = build_obstacles(scene);
    HapticInput input = scene.haptic;
    input.simulation_rate = 50;
    const HapticSettings set = make_settings(input, device_profile(input.device), 0);
    BodyLink link(scene, obstacles, set.link);
    HandPose device = link.start();
    REQUIRE(link.step(device));
    const Vec3 start = device.position;
    const double way = -0.0027;
    const int steps = 6;
    for (int i = 1; i <= steps; ++i) {
        device.position.z() = start.z() + way * i / steps;
        REQUIRE_MESSAGE(link.step(device), link.refusal());
    }
    REQUIRE(link.not_touched() == 0); // all of the way to the device, each time
    const Vec3 moved = link.held().pose().position - start;
    const Vec3 force = link.held().force().force;
    CHECK(force.z() == // the spring's
          test::relative(set.link.spring.stiffness * (moved.z() - way)).epsilon(1e-6));
    int shut = 0;
    for (const ContactRecord& c : link.contact_records())
        shut += c.body_a == c.body_b && c.force.norm() > 0;
    CHECK(shut > 0);

    // Neither way has friction: the force is that of the place.
    const auto along = [&](int axis) {
        return fmt::format(R"("{}": [[0, 0], [1, {:.17g}]])", "xyz"[axis], moved[axis]);
    };
    const Result same = done(
        scene_of(mesh, fmt::format(R"(, "drive": {{{}, {}, {}}})", along(0), along(1), along(2)),
                 R"("time": {"kind": "quasi_static", "step": 0.125, "end": 1})"));
    CHECK(same.value("slit_on_slit_normal_force") > 0);
    CHECK((same.vector("ball_on_slit_force") + force).norm() < 1e-5 * force.norm());

    // The operator gives that force at its own pose.
    ReducedOperator<double> op(300);
    REQUIRE(link.publish(op, 1, 1));
    ProxyOptions options;
    options.tolerance = 1e-10;
    options.max_sweeps = 5000;
    ProxyLoop<double> loop(300, options);
    REQUIRE(loop.take(op, 0));
    CHECK((loop.tick(device, 1e-3).wrench.force - force).norm() < 1e-6 * force.norm());
}
