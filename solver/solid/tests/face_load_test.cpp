#include "solver/solid/face_load.hpp"

#include "solver/solid/tests/solid_samples.hpp"

#include <doctest/doctest.h>

using namespace amontons;
using test::kAllKinds;

TEST_CASE("an all-round pressure neither pushes nor turns and works on the volume")
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

TEST_CASE("a traction on a flat face sums to its area and a T6 gives it to its middle nodes")
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

TEST_CASE("the tangent of a pressure is its derivative and over a closed surface symmetric")
{
    test::Random random(9);
    for (const ElementKind kind : test::kAllKinds) {
        const ElementPlaces X = test::distorted_element(kind, random);
        Eigen::MatrixXd whole = Eigen::MatrixXd::Zero(X.size(), X.size());
        for (const LocalFace& face : shape_of(kind).faces) {
            FaceForces x(3, face.count);
            for (int i = 0; i < face.count; ++i)
                x.col(i) = X.col(face.node[std::size_t(i)]);
            const FaceTangent K = pressure_tangent(x, 5);
            for (Eigen::Index j = 0; j < x.size(); ++j) { // forces are quadratic: exact
                FaceForces up = x, down = x;
                up.data()[j] += 0.5;
                down.data()[j] -= 0.5;
                const FaceForces d = pressure_forces(up, 5) - pressure_forces(down, 5);
                CHECK((K.col(j) - Eigen::Map<const Eigen::VectorXd>(d.data(), d.size())).norm() <
                      1e-12 * (1 + K.norm()));
            }
            for (int j = 0; j < face.count; ++j)
                for (int i = 0; i < face.count; ++i)
                    whole.block<3, 3>(3 * face.node[std::size_t(i)],
                                      3 * face.node[std::size_t(j)]) += K.block<3, 3>(3 * i, 3 * j);
            CHECK((K - K.transpose()).norm() > 1e-2 * K.norm()); // one face alone is not
        }
        CHECK((whole - whole.transpose()).norm() < 1e-12 * whole.norm());
    }
}
