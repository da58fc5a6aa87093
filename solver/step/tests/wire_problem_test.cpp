#include "solver/step/wire_problem.hpp"

#include "contact/certificate.hpp"
#include "mesh/generate/tube.hpp"
#include "solver/beam/clamp.hpp"
#include "solver/step/wire_simulation.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

constexpr double kGuidewireEI = 5.2e-4, kGuidewireRadius = 4.445e-4;

BeamSegment wire_segment(double length)
{
    BeamSegment g;
    g.length = length;
    g.radius = kGuidewireRadius;
    g.EI = {kGuidewireEI, kGuidewireEI};
    g.GJ = {4e-4, 4e-4};
    g.EA = {5000, 5000};
    g.element = 2.5e-3;
    return g;
}

int negative_eigenvalues(const Eigen::MatrixXd& W)
{
    const Eigen::VectorXd values =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(0.5 * (W + W.transpose())).eigenvalues();
    return static_cast<int>((values.array() < -1e-9 * values.cwiseAbs().maxCoeff()).count());
}

struct Check : StepObserver {
    const Simulation* simulation = nullptr;
    int problems = 0, indefinite = 0, most = 0, acting = 0;
    double worst = 0, worst_inverse = 0, worst_asymmetry = 0;
    void on_step(const StepRecord& record) override
    {
        const std::vector<RecordedProblem> all = simulation->contact_problems();
        REQUIRE(all.size() == 1);
        const RecordedProblem& r = all[0];
        std::size_t pressed = 0;
        for (int k = 0; k < contact_count(r.problem); ++k)
            pressed += r.reaction[3 * k] > 0;
        CHECK(pressed == record.contacts.size());
        CHECK(r.contact.size() == static_cast<std::size_t>(contact_count(r.problem)));
        if (r.contact.empty()) return;
        ++problems;
        most = std::max(most, contact_count(r.problem));
        const Certificate c = certify(r.problem, r.reaction, 1e-8);
        worst = std::max(worst, c.error / std::max(c.threshold, 1e-8));
        worst_inverse = std::max(worst_inverse, r.inverse_error);
        worst_asymmetry = std::max(worst_asymmetry, r.problem.W.asymmetry());
        const int negative = negative_eigenvalues(r.problem.W.dense());
        CHECK(negative <= r.negative_eigenvalues);
        if (r.negative_eigenvalues > 0) ++indefinite;
        // The check can fail: another reaction is no solution.
        if (pressed > 0) {
            ++acting;
            CHECK(certify(r.problem, 1.01 * r.reaction, 1e-8).error > 1e-7);
        }
    }
};

} // namespace

TEST_CASE("the reaction of every step solves the problem that is recorded of it")
{
    for (const double mu : {0.0, 0.2}) {
        Scene scene;
        scene.order = {"tube", "wire"};
        scene.obstacles.resize(1);
        scene.obstacles[0].name = "tube";
        BeamInput wire;
        wire.name = "wire";
        wire.segments = {wire_segment(0.15)};
        wire.insertion = {{0, 0}, {10, 0.09}};
        scene.beams = {wire};
        scene.contact = {{{"wire", "tube"}, mu}};
        scene.time.step = 0.1;
        scene.time.end = 10;
        Centreline line(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), 4e-3);
        line.append_line(0.02, 4e-3);
        line.append_arc(0.03, 1.5, 0, 4e-3);
        line.append_line(0.06, 4e-3);
        std::vector<Obstacle> obstacles;
        obstacles.push_back({"tube", make_tube({line, 0})});

        WireSimulation simulation(scene, std::move(obstacles));
        Check check;
        check.simulation = &simulation;
        const std::atomic<bool> stop{false};
        REQUIRE(simulation.run(check, stop).status == "done");
        CHECK(check.acting > 0); // wherever something acts the check was seen to fail
        MESSAGE("mu " << mu << ": " << check.problems << " problems, at most " << check.most
                      << " contacts, " << check.indefinite << " indefinite; error over threshold "
                      << check.worst << ", of the inverse " << check.worst_inverse << ", asymmetry "
                      << check.worst_asymmetry);
        CHECK(check.problems > 50);
        CHECK(check.worst <= 1);
        CHECK(check.worst_inverse < 1e-6);
        CHECK(check.worst_asymmetry < 1e-6);
    }
}

namespace {

/// Of a wire of 0.1 m that is clamped at its start and lies on a plane, on springs if there is a
/// foundation [N/m^2].
RecordedProblem lying(double foundation)
{
    Wire wire;
    wire.material = make_material({wire_segment(0.1)}, 2.5e-3);
    start_clamped(wire, Vec3::Zero(), Mat3::Identity());
    const Wall plane = make_plane_wall(Vec3(0, 0, -kGuidewireRadius), Vec3::UnitZ());
    std::vector<WireWall> walls(1);
    walls[0].wall = &plane;
    walls[0].foundation = foundation;
    walls[0].friction.assign(wire.material.point.size(), 0.3);
    const WireBody body = make_wire_body(std::move(wire), std::move(walls), {}, 1e-8);
    NewtonOptions options;
    options.reach = kGuidewireRadius;
    residual_of(body.wire, body.walls, mark_step_start(body.wire), {}, options, *body.work);
    return contact_problem(body);
}

} // namespace

TEST_CASE("the compliance of a clamped wire's tip is L^3 / (3 EI)")
{
    const RecordedProblem r = lying(0);
    REQUIRE(r.contact.size() > 10); // it lies on the plane
    CHECK(r.negative_eigenvalues == 0);
    double W = 0; // the tip is the softest place
    for (Eigen::Index k = 0; k < r.problem.mu.size(); ++k)
        W = std::max(W, r.problem.W.dense()(3 * k, 3 * k));
    CHECK(W == doctest::Approx(std::pow(0.1, 3) / (3 * kGuidewireEI)).epsilon(2e-3));
    CHECK(r.problem.W.asymmetry() < 1e-10);
    CHECK(r.asymmetry < 1e-12);
}

TEST_CASE("a foundation adds 1 / (k h) to a contact's compliance along its normal and nothing else")
{
    const double k = 1e3, h = 2.5e-3;
    const RecordedProblem rigid = lying(0), springs = lying(k);
    REQUIRE(springs.contact == rigid.contact);
    Eigen::MatrixXd more = springs.problem.W.dense() - rigid.problem.W.dense();
    for (Eigen::Index i = 0; i < more.rows(); i += 3)
        more(i, i) -= 1 / (k * h);
    CHECK(more.cwiseAbs().maxCoeff() < 1e-9 / (k * h));
}
