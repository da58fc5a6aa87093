#include "solver/solid/patch.hpp"

#include "mesh/generate/solid_box.hpp"
#include "solver/solid/corotational.hpp"
#include "solver/solid/tests/solid_samples.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <numbers>

using namespace amontons;
using test::kAllKinds;

namespace {

VolumeMesh box_of(ElementKind kind, std::array<std::int32_t, 3> cells)
{
    return make_solid_box({Vec3(-0.5, -0.4, -0.1), Vec3(0.5, 0.4, 0.1), cells, {1, 1, 1}, kind});
}

const std::vector<FaceRef>& faces_of(const VolumeMesh& mesh, const char* set)
{
    return find_set(mesh.face_sets, set)->members;
}

/// Places of a mesh that is stretched, sheared, bent, turned and moved.
std::vector<Vec3> moved(const VolumeMesh& mesh, test::Random& random, double strain)
{
    const Mat3 R = random.rotation(), F = Mat3::Identity() + strain * random.matrix(),
               bent = strain * random.matrix();
    const Vec3 shift = random.vector();
    std::vector<Vec3> x;
    for (const Vec3& X : mesh.nodes)
        x.push_back(R * (F * X + bent * X.cwiseProduct(X)) + shift);
    return x;
}

} // namespace

TEST_CASE("a patch takes a force and a moment and its motion is the one that works with them")
{
    test::Random random(3);
    for (const ElementKind kind : kAllKinds) {
        CAPTURE(shape_of(kind).name);
        const VolumeMesh mesh = box_of(kind, {3, 2, 2});
        const Patch patches[] = {
            patch_of_faces(mesh, faces_of(mesh, "x_max")),
            patch_within(mesh, extract_surface(mesh), Vec3(0.4, 0.1, 0.1), 0.3)};
        CHECK(patches[0].area == doctest::Approx(0.8 * 0.2));
        CHECK((patches[0].centre - Vec3(0.5, 0, 0)).norm() < 1e-15);
        for (const Patch& patch : patches) {
            double weights = 0;
            Vec3 arms = Vec3::Zero();
            for (const PatchNode& n : patch.nodes) {
                weights += n.weight;
                arms += n.arm;
            }
            CHECK(weights == doctest::Approx(1).epsilon(1e-12));
            CHECK(arms.norm() < 1e-13);
            const std::vector<Vec3> x = moved(mesh, random, 0.2);
            const PatchPose pose = patch_pose(patch, x);
            CHECK((pose.turn.transpose() * pose.turn - Mat3::Identity()).norm() < 1e-14);
            const Vec3 force = random.vector(), moment = random.vector();
            std::vector<Vec3> d(x.size());
            for (Vec3& v : d)
                v = random.vector();
            Vec3 sum = Vec3::Zero(), about = Vec3::Zero();
            double work = 0;
            spread_on_patch(pose, force, moment, [&](std::int32_t node, const Vec3& f) {
                const auto i = std::size_t(node);
                sum += f;
                about += (x[i] - pose.centre).cross(f);
                work += f.dot(d[i]);
            });
            CHECK((sum - force).norm() < 1e-12);
            CHECK((about - moment).norm() < 1e-12);
            const PatchMotion m =
                patch_motion(pose, [&](std::int32_t node) { return d[std::size_t(node)]; });
            CHECK(work == doctest::Approx(force.dot(m.shift) + moment.dot(m.turn)).epsilon(1e-12));
        }
    }
}

TEST_CASE("a rigid motion of a patch is that of its pose")
{
    test::Random random(5);
    const VolumeMesh mesh = box_of(ElementKind::T10, {2, 2, 1});
    const Patch patch = patch_of_faces(mesh, faces_of(mesh, "y_min"));
    const Mat3 R = random.rotation();
    std::vector<Vec3> x;
    for (const Vec3& X : mesh.nodes)
        x.push_back(R * X + Vec3(1, 2, 3));
    const PatchPose pose = patch_pose(patch, x);
    CHECK((pose.turn - R).norm() < 1e-14);
    CHECK((pose.centre - (R * patch.centre + Vec3(1, 2, 3))).norm() < 1e-14);
}

TEST_CASE(
    "between two poses the mean motion of the nodes is exactly what leads from one to the other")
{
    // R' = cay(w) R: R' - R = w x (R + R') / 2.
    test::Random random(7);
    for (const ElementKind kind : kAllKinds) {
        const VolumeMesh mesh = box_of(kind, {2, 2, 2});
        const Patch patch = patch_of_faces(mesh, faces_of(mesh, "z_max"));
        const std::vector<Vec3> x = moved(mesh, random, 0.2);
        std::vector<Vec3> y = moved(mesh, random, 0.2);
        const Mat3 back = Eigen::AngleAxisd(0.5, random.vector().normalized()) *
                          (patch_pose(patch, x).turn * patch_pose(patch, y).turn.transpose());
        for (Vec3& place : y)
            place = back * place;
        const PatchPose start = patch_pose(patch, x), end = patch_pose(patch, y),
                        mean = pose_between(start, end);
        const PatchMotion m = patch_motion(mean, [&](std::int32_t node) {
            return Vec3(y[std::size_t(node)] - x[std::size_t(node)]);
        });
        CHECK((m.shift - (end.centre - start.centre)).norm() < 1e-13);
        for (int k = 0; k < 3; ++k)
            CHECK((end.turn.col(k) - start.turn.col(k) - m.turn.cross(Vec3(mean.turn.col(k))))
                      .norm() < 1e-13);
    }
}

TEST_CASE("what lies within a radius is the same on every mesh")
{
    // A disc on a face; at an edge the two parts of it; nothing of the other side of a thin plate.
    const double r = 0.15;
    for (const ElementKind kind : kAllKinds)
        for (const std::int32_t n : {1, 3, 8}) {
            CAPTURE(shape_of(kind).name);
            CAPTURE(n);
            const VolumeMesh mesh = box_of(kind, {n, n, 1});
            const ExternalSurface outside = extract_surface(mesh);
            const Vec3 at(0.13, 0.04, 0.1);
            const Patch disc = patch_within(mesh, outside, at, r);
            CHECK(disc.area == doctest::Approx(std::numbers::pi * r * r).epsilon(1e-3));
            CHECK((disc.centre - at).norm() < 1e-4 * r);
            const Vec3 edge(0.5, 0.02, 0.1);
            const Patch bent = patch_within(mesh, outside, edge, r);
            CHECK(bent.area == doctest::Approx(std::numbers::pi * r * r).epsilon(1e-3));
            const double off = 4 * r / (3 * std::numbers::pi) / 2; // of half discs, two of them
            CHECK((bent.centre - edge - Vec3(-off, 0, -off)).norm() < 2e-3 * r);
            CHECK(patch_within(mesh, outside, Vec3(0, 0, 0.3), r).area == 0);
        }
    const VolumeMesh plate = make_solid_box(
        {Vec3(-1, -1, -0.01), Vec3(1, 1, 0.01), {6, 6, 1}, {1, 1, 1}, ElementKind::H8});
    const Patch top = patch_within(plate, extract_surface(plate), Vec3(0.1, 0.2, 0.01), 0.3);
    CHECK(top.area == doctest::Approx(std::numbers::pi * 0.09).epsilon(1e-3));
    CHECK(std::abs(top.centre.z() - 0.01) < 1e-12);
}
