#include "mesh/generate/solid_box.hpp"
#include "solver/body/solid_body.hpp"

#include <doctest/doctest.h>
#include <thread>

using namespace amontons;

namespace {

constexpr double kBoxDensity = 1200;
const Vec3 kSize{0.3, 0.2, 0.1}, kVelocity{0.3, -0.1, 0.7}, kSpin{2, -1, 3};

/// A box of bricks that flies and turns, or does not.
std::unique_ptr<SolidBody> box(bool moves)
{
    SolidInput input;
    input.name = "box";
    input.youngs_modulus = 1e6;
    input.poisson_ratio = 0.3;
    input.density = kBoxDensity;
    input.motion = "linear";
    if (moves) {
        input.start.velocity = kVelocity;
        input.start.spin = kSpin;
    }
    SolidBoxOptions o;
    o.lowest = -0.5 * kSize;
    o.highest = 0.5 * kSize;
    o.cells = {3, 2, 2};
    VolumeMesh mesh = make_solid_box(o);
    const std::vector<char> touching(mesh.nodes.size(), 0);
    return std::make_unique<SolidBody>(input, std::move(mesh), false, touching, "");
}

StepInput first_step()
{
    StepInput step;
    step.h = 1e-3;
    step.dynamic = true;
    return step;
}

} // namespace

TEST_CASE("a box that starts to fly has the momenta and the energy of a rigid box")
{
    const auto body = box(true);
    const double mass = kBoxDensity * kSize.prod();
    const Vec3 square = kSize.cwiseAbs2();
    const Vec3 inertia = mass / 12 * (Vec3::Constant(square.sum()) - square);
    CHECK((body->momentum() - mass * kVelocity).norm() < 1e-13 * mass);
    CHECK((body->angular_momentum() - inertia.cwiseProduct(kSpin)).norm() < 1e-12 * inertia.norm());
    CHECK(body->kinetic_energy() == doctest::Approx(0.5 * mass * kVelocity.squaredNorm() +
                                                    0.5 * kSpin.dot(inertia.cwiseProduct(kSpin)))
                                        .epsilon(1e-12));
    CHECK(box(false)->kinetic_energy() == 0);
    CHECK(box(false)->momentum().isZero(0));
}

TEST_CASE("a solid's momenta do not depend on when and where they were first computed")
{
    const auto early = box(true), late = box(true), shared = box(true);
    const Vec3 momentum = early->momentum(), turning = early->angular_momentum();
    const double energy = early->kinetic_energy();
    CHECK(early->free_motions() == std::vector<std::string>{"every shift and turn"});

    std::vector<std::string> messages;
    for (SolidBody* body : {early.get(), late.get()}) {
        body->make_ready(first_step(), "", messages);
        body->begin(first_step());
        CHECK(body->momentum() == momentum);
        CHECK(body->angular_momentum() == turning);
        CHECK(body->kinetic_energy() == energy);
        body->linearise();
    }
    CHECK(early->free_change() == late->free_change());
    CHECK(early->free_change().size() > 0);

    std::vector<double> energies(4);
    std::vector<std::thread> threads;
    for (double& e : energies)
        threads.emplace_back([&] { e = shared->kinetic_energy(); });
    for (std::thread& t : threads)
        t.join();
    for (const double e : energies)
        CHECK(e == energy);
    CHECK(late->free_motions() == early->free_motions());
}
