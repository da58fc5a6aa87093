#include "solver/body/linear_limit.hpp"

#include "mesh/generate/solid_box.hpp"
#include "solver/scene/tests/issues_of.hpp"
#include "solver/step/tests/body_runs.hpp"

#include <Eigen/Geometry>
#include <fmt/format.h>

using namespace amontons;

namespace {

std::vector<Vec3> moved_by(const VolumeMesh& mesh, const Mat3& F)
{
    std::vector<Vec3> x;
    for (const Vec3& X : mesh.nodes)
        x.push_back(F * X + Vec3(1, 2, 3));
    return x;
}

std::string warnings_of(const Result& r)
{
    std::string all;
    for (const std::string& w : r.summary.warnings)
        all += w + "\n";
    return all;
}

/// A cantilever of length 1 under a load at its end, deflection over length by the linear theory.
Result cantilever(double deflection, const std::string& more = "")
{
    return run(fmt::format(R"("bodies": {{"b": {{"kind": "solid", "youngs_modulus": 1e6,
        "poisson_ratio": 0, "mesh": {{"generate": "box", "size": [1, 0.05, 0.05], "cells": [20, 1, 1],
        "element": "H8", "centre": [0.5, 0, 0]}}, "hold": [{{"set": "x_min"}}],
        "loads": [{{"set": "x_max", "traction": [0, 0, {}]}}]{}}}}},
        "time": {{"step": 1, "end": 1}})",
                           deflection * 1e6 * 0.05 * 0.05 / 4, more));
}

} // namespace

TEST_CASE("rotations and strains of affine motions are found exactly, apart from the rigid motion")
{
    for (const ElementKind kind : {ElementKind::T4, ElementKind::T10, ElementKind::H8}) {
        SolidBoxOptions o;
        o.cells = {2, 3, 1};
        o.grading = {2, 1, 1};
        o.kind = kind;
        const VolumeMesh mesh = make_solid_box(o);
        const Mat3 R = Eigen::AngleAxisd(1.1, Vec3(1, 2, 2).normalized()).toRotationMatrix();
        Mat3 G = Mat3::Zero();
        G << 0.02, 0.03, 0, -0.01, -0.05, 0, 0, 0, 0;
        LinearLimit limit;
        limit.note(mesh, moved_by(mesh, R * (Mat3::Identity() + G)), R, 7);
        CHECK(limit.rotation == doctest::Approx(0.02).epsilon(1e-9));
        const double half = std::hypot(0.035, 0.01); // of [0.02 0.01; 0.01 -0.05]
        CHECK(limit.strain == doctest::Approx(0.015 + half).epsilon(1e-9));
        CHECK(limit.strained_when == 7);
        CHECK(limit.warning("b") == "");
        limit.note(mesh, moved_by(mesh, R), Mat3::Identity(), 8);
        CHECK(limit.rotation > 0.1);
        CHECK(has(limit.warning("b"), "b is linear, but an element of it turned by"));
    }
}

TEST_CASE("a linear cantilever that bends beyond its theory reports it and one within does not")
{
    // The slope at the end is 3/2 of the deflection.
    CHECK(warnings_of(cantilever(0.05)) == "");
    const std::string far = warnings_of(cantilever(0.1));
    CHECK(has(far, "b is linear, but an element of it turned by 0.15 rad at (0.975, 0, 0)"));
    CHECK(has(far, "\"motion\": \"corotational\" of it takes large turns"));
    CHECK(warnings_of(cantilever(0.1, R"(, "motion": "corotational")")) == "");
}

TEST_CASE("a body that turns as a whole is not beyond linear theory")
{
    const Result r =
        run(R"("bodies": {"b": {"kind": "solid", "youngs_modulus": 1e9, "density": 1000,
        "poisson_ratio": 0.3, "mesh": {"generate": "box", "size": [0.3, 0.2, 0.1], "cells": [3, 2, 1],
        "element": "H8"}, "start": {"spin": [0, 0, 2]}}},
        "time": {"kind": "dynamic", "step": 0.01, "end": 1})");
    REQUIRE(r.summary.status == "done");
    CHECK(warnings_of(r).find("is linear") == std::string::npos);
}
