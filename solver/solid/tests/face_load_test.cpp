#include "solver/solid/face_load.hpp"

#include "solver/solid/tests/solid_samples.hpp"

#include <doctest/doctest.h>

using namespace amontons;
using test::kAllKinds;

TEST_CASE("an all-round pressure neither pushes nor turns, and works on the volume")
{
    test::Random random(1);
    for (const ElementKind kind : kAllKinds) {
        CAPTURE(shape_of(kind).name);
        const ElementPlaces X = test::distorted_element(kind, random);
        Vec3 sum = Vec3::Zero(), torque = Vec3::Zero();
        double work = 0;
        for (const LocalFace& face : shape_of(kind).faces) {
            FaceForces on_face(3, face.count);
            for (int i = 0; i < face.count; ++i)
                on_face.col(i) = X.col(face.node[std::size_t(i)]);
            const FaceForces f = pressure_forces(on_face, 5);
            for (int i = 0; i < face.count; ++i) {
                sum += f.col(i);
                torque += Vec3{on_face.col(i)}.cross(Vec3{f.col(i)});
                work += on_face.col(i).dot(f.col(i));
            }
        }
        CHECK(sum.norm() < 1e-13);
        CHECK(torque.norm() < 1e-12);
        CHECK(work == doctest::Approx(-3 * 5 * solid_volume(kind, X)).epsilon(1e-13));
    }
}

TEST_CASE("a traction on a flat face sums to its area; a T6 gives it to its middle nodes")
{
    FaceForces X(3, 6);
    X << 0, 2, 0, 1, 1, 0, //
        0, 0, 3, 0, 1.5, 1.5, 1, 1, 1, 1, 1, 1;
    const Vec3 t{1, -2, 4};
    const FaceForces f = traction_forces(X, t); // area 3
    CHECK(f.leftCols<3>().norm() < 1e-14);
    CHECK((f.rightCols<3>().colwise() - t).norm() < 1e-14);
    CHECK((traction_forces(X.leftCols<3>(), t).colwise() - t).norm() < 1e-14);
    FaceForces square(3, 4);
    square << 0, 2, 2, 0, 0, 0, 2, 2, 0, 0, 0, 0;
    CHECK((traction_forces(square, t).colwise() - t).norm() < 1e-14);
    CHECK((pressure_forces(square, 1).colwise() + Vec3::UnitZ()).norm() < 1e-14);
}
