#include "mesh/generate/solid_tube.hpp"
#include "mesh/tests/relative.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/step/soft_vessel.hpp"
#include "solver/step/tests/body_runs.hpp"
#include "solver/step/tests/vessel_scene.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>
#include <doctest/doctest.h>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <unistd.h>

using namespace amontons;

namespace {

Scene hyperelastic_scene(double E, double mu, double depth)
{
    Scene scene = vessel_scene(E, mu, depth);
    SolidInput& vessel = scene.solids[0];
    vessel.motion = "hyperelastic";
    vessel.mesh.around = 12; // few elements: steps take a tenth of a second
    vessel.mesh.along = 26;
    scene.time.step *= 2;
    return scene;
}

void use_T10(Scene& scene)
{
    MeshInput& m = scene.solids[0].mesh;
    m.element = "T10";
    m.around = 6;
    m.along = 13;
}

void set_pressure(Scene& scene, double pressure)
{
    LoadInput load;
    load.set = "inner";
    load.pressure = {{0, pressure}};
    scene.solids[0].loads = {load};
}

MaterialInput material(const std::string& law, const std::array<double, 8>& constants)
{
    MaterialInput m;
    m.law = law;
    m.constants = constants;
    return m;
}

double largest_displacement(const Run& r)
{
    double largest = 0;
    const std::vector<double>& u = r.bodies[0].point_fields[0].values;
    for (std::size_t i = 0; i + 2 < u.size(); i += 3)
        largest = std::max(largest, Vec3(u[i], u[i + 1], u[i + 2]).norm());
    return largest;
}

} // namespace

TEST_CASE("a hyperelastic wall of small strains is the linear one: they differ by the strain" *
          doctest::test_suite("slow"))
{
    double before = 0;
    for (const double E : {6e6, 6e7, 6e8}) {
        CAPTURE(E);
        Scene scene = hyperelastic_scene(E, 0.1, 0.05);
        const Run large = run(scene);
        scene.solids[0].motion = "linear";
        const Run linear = run(scene);
        REQUIRE_MESSAGE(large.summary.status == "done", large.summary.message);
        const double a = largest_displacement(linear), b = largest_displacement(large);
        const double off = std::abs(a - b) / a;
        CHECK(off > 0);
        if (before > 0) CHECK(off == test::relative(0.1 * before).epsilon(0.3));
        before = off;
    }
    CHECK(before < 1e-4);
}

TEST_CASE("a wire in a hyperelastic vessel: certified and in balance and its energy accounted for" *
          doctest::test_suite("slow"))
{
    struct Kind {
        const char* element;
        MaterialInput material;
        double mu, pressure;
    };
    const double E = 0.4e6;
    const std::vector<Kind> kinds{
        {"H8", material("neo_hooke", {E, 0.45}), 0.0, 0},
        {"H8", material("neo_hooke", {E, 0.49}), 0.1, 3000},
        {"H8", material("mooney_rivlin", {5e4, 1.5e4, 0.49}), 0.1, 3000},
        {"T10", material("neo_hooke", {E, 0.49}), 0.1, 3000},
    };
    for (const Kind& k : kinds) {
        CAPTURE(k.element);
        CAPTURE(k.material.law);
        CAPTURE(k.mu);
        Scene scene = hyperelastic_scene(E, k.mu, 0.08);
        scene.solids[0].material = k.material;
        if (std::string(k.element) == "T10") use_T10(scene);
        if (k.pressure > 0) set_pressure(scene, k.pressure);
        const Run r = run(scene);
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        CHECK(r.summary.uncertified_steps == 0);
        CHECK(std::abs(r.summary.energy.error()) < 0.01 * r.summary.energy.work_absolute);
        CHECK((r.summary.energy.friction > 0) == (k.mu > 0));
        CHECK(largest_displacement(r) > 2e-4);
        Vec3 on_wire = Vec3::Zero(), on_wall = Vec3::Zero();
        for (const ContactRecord& c : r.keep.records.back().contacts)
            on_wire += c.force;
        const std::vector<double>& f = r.bodies[0].point_fields[1].values;
        for (std::size_t i = 0; i + 2 < f.size(); i += 3)
            on_wall += Vec3(f[i], f[i + 1], f[i + 2]);
        CHECK(on_wire.norm() > 0.01);
        CHECK((on_wire + on_wall).norm() < 1e-8 * on_wire.norm());
    }
}

TEST_CASE("a wall under a wire's forces is where a solid alone is under the same forces" *
          doctest::test_suite("slow"))
{
    for (const char* element : {"H8", "T10"}) {
        CAPTURE(element);
        Scene scene = hyperelastic_scene(0.3e6, 0.1, 0.08);
        if (std::string(element) == "T10") use_T10(scene);
        set_pressure(scene, 3000);
        scene.accuracy.contact = 1e-10;
        const Run r = run(scene);
        REQUIRE_MESSAGE(r.summary.status == "done", r.summary.message);
        const std::vector<double>&u = r.bodies[0].point_fields[0].values,
              &f = r.bodies[0].point_fields[1].values;
        // The same mesh as a file, each node that is pushed a set.
        const std::vector<SoftVessel> vessels = build_soft_vessels(scene);
        const VolumeMesh& mesh = vessels[0].tube->mesh();
        const auto folder = std::filesystem::temp_directory_path() /
                            fmt::format("amontons_soft_balance_{}", getpid());
        std::filesystem::create_directories(folder);
        std::ofstream nodes(folder / "wall.nodes"), elements(folder / "wall.elements");
        nodes.precision(17);
        for (const Vec3& x : mesh.nodes)
            nodes << x[0] << ' ' << x[1] << ' ' << x[2] << '\n';
        for_each_element(mesh, [&](std::int32_t, ElementKind, auto n) {
            for (const std::int32_t i : n)
                elements << i << ' ';
            elements << '\n';
        });
        for (const FaceSet& s : mesh.face_sets) {
            elements << "face_set " << s.name << '\n';
            for (const FaceRef& m : s.members)
                elements << m.element << ' ' << m.face << '\n';
        }
        std::string loads = R"({"set": "inner", "pressure": [[0, 0], [1, 3000]]})";
        for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
            const Vec3 force(f[3 * i], f[3 * i + 1], f[3 * i + 2]);
            if (force == Vec3::Zero()) continue;
            elements << "node_set n" << i << '\n' << i << '\n';
            loads += fmt::format(
                R"(, {{"set": "n{}", "force": [{}, {}, {}], "over": [[0, 0], [1, 1]]}})", i,
                force[0], force[1], force[2]);
        }
        nodes.close();
        elements.close();
        const Result alone =
            run(fmt::format(R"("bodies": {{"vessel": {{"kind": "solid", "motion": "hyperelastic",
                "youngs_modulus": 0.3e6, "poisson_ratio": 0.45, "mesh": {{"file": "{}"}},
                "hold": [{{"set": "start"}}, {{"set": "end"}}], "loads": [{}]}}}},
                "accuracy": {{"contact": 1e-12}}, "time": {{"step": 0.25, "end": 1}})",
                            (folder / "wall.nodes").string(), loads));
        REQUIRE_MESSAGE(alone.summary.status == "done", alone.summary.message);
        const std::vector<BodyRecord> record = alone.simulation->body_records();
        REQUIRE(record.size() == 1);
        double off = 0, largest = 0;
        for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
            const Vec3 own(u[3 * i], u[3 * i + 1], u[3 * i + 2]);
            off = std::max(off, (record[0].points[i] - mesh.nodes[i] - own).norm());
            largest = std::max(largest, own.norm());
        }
        CHECK(largest > 3e-4);
        CHECK(off < 1e-8 * largest);
        std::filesystem::remove_all(folder);
    }
}

TEST_CASE("a hyperelastic vessel does not depend on how the scene is turned" *
          doctest::test_suite("slow"))
{
    Scene scene = hyperelastic_scene(0.4e6, 0.1, 0.06);
    set_pressure(scene, 2000);
    scene.beams[0].introducer.normal = Vec3::UnitY();
    const Run one = run(scene);
    const Mat3 Q = Eigen::AngleAxisd(1.1, Vec3(1, -2, 0.5).normalized()).toRotationMatrix();
    CentrelineInput& line = scene.solids[0].mesh.centreline;
    line.direction = Q * line.direction;
    line.normal = Q * line.normal;
    IntroducerInput& in = scene.beams[0].introducer;
    in.direction = Q * in.direction;
    in.normal = Q * Vec3::UnitY();
    const Run two = run(scene);
    // The mesh's first row of nodes begins elsewhere around the tube.
    CHECK(value(two.keep.records.back(), "push_force") ==
          test::relative(value(one.keep.records.back(), "push_force")).epsilon(1e-4));
}

TEST_CASE("a run in a hyperelastic vessel continues from a saved state to the last bit" *
          doctest::test_suite("slow"))
{
    Scene scene = hyperelastic_scene(0.3e6, 0.1, 0.06);
    set_pressure(scene, 3000);
    std::atomic<bool> never{false}, stop{false};
    Keep whole, first, rest;
    WireSimulation a(scene, {});
    REQUIRE(a.run(whole, never).status == "done");
    first.stop = &stop;
    first.stop_at = 26;
    WireSimulation b(scene, {});
    REQUIRE(b.run(first, stop).status == "interrupted");
    WireSimulation c(scene, {});
    c.restore(b.save());
    REQUIRE(c.run(rest, never).status == "done");
    REQUIRE(!rest.records.empty());
    REQUIRE(first.records.size() + rest.records.size() == whole.records.size());
    const StepRecord &r = rest.records.back(), &w = whole.records.back();
    REQUIRE(r.quantities.size() == w.quantities.size());
    for (std::size_t q = 0; q < w.quantities.size(); ++q)
        CHECK(std::memcmp(&r.quantities[q].value, &w.quantities[q].value, sizeof(double)) == 0);
    const std::vector<BodyRecord> at = a.body_records(), ct = c.body_records();
    CHECK(at[0].point_fields[0].values == ct[0].point_fields[0].values);
}

TEST_CASE("a pressure that the wall does not hold is refused by its name")
{
    Scene scene = hyperelastic_scene(0.3e6, 0.1, 0.06);
    set_pressure(scene, 1e6);
    try {
        const WireSimulation s(scene, {});
        FAIL("taken");
    } catch (const InputError& e) {
        REQUIRE(e.issues().size() == 1);
        CHECK(e.issues()[0].place == "/bodies/vessel/loads");
        CHECK(e.issues()[0].file == "test.json");
    }
}
