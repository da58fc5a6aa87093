#include "solver/beam/corotational.hpp"

#include "solver/beam/rotation.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace amontons {
namespace {

Vec3 rotation_vector_of(const Mat3& R)
{
    const Quaternion q = quaternion_of(R);
    const Vec3 v(q.q[1], q.q[2], q.q[3]);
    const double s = v.norm(), w = q.q[0];
    const double factor = s > 1e-8 ? 2 * std::atan2(s, std::abs(w)) / s : 2 / std::abs(w);
    return (w < 0 ? -factor : factor) * v;
}

/// The element's frame, and what its derivative needs.
struct Frame {
    Mat3 R[2]; // of the nodes
    Mat3 axes; // of the element, columns
    double chord = 0;
    // of the second axes of the ends and their mean, in the element's frame, over the mean's second
    double mean = 0, first[2] = {0, 0}, second[2] = {0, 0};
    Vec3 end[2];       // second axes of the ends in the element's frame
    double across = 0; // of the mean along the element's second axis
};

Frame element_frame(const BeamNode& a, const BeamNode& b)
{
    Frame f;
    f.R[0] = rotation_matrix(a.q);
    f.R[1] = rotation_matrix(b.q);
    const Vec3 e(b.difference(a, 0), b.difference(a, 1), b.difference(a, 2));
    f.chord = e.norm();
    const Vec3 q = 0.5 * (f.R[0].col(1) + f.R[1].col(1));
    f.axes.col(0) = e / f.chord;
    f.axes.col(2) = f.axes.col(0).cross(q).normalized();
    f.axes.col(1) = f.axes.col(2).cross(f.axes.col(0));
    const Vec3 own = f.axes.transpose() * q;
    f.mean = own[0] / own[1];
    for (int i = 0; i < 2; ++i) {
        f.end[i] = f.axes.transpose() * f.R[i].col(1);
        f.first[i] = f.end[i][0] / own[1];
        f.second[i] = f.end[i][1] / own[1];
    }
    f.across = own[1];
    return f;
}

CorotationalStrain strain_in(const Frame& f, double length)
{
    CorotationalStrain s;
    s.stretch = f.chord - length;
    for (int i = 0; i < 2; ++i)
        s.turn[i] = rotation_vector_of(f.axes.transpose() * f.R[i]);
    return s;
}

using Vec7 = Eigen::Matrix<double, 7, 1>;
using Mat7 = Eigen::Matrix<double, 7, 7>;

Vec7 deformation(const CorotationalStrain& s, const CorotationalStrain& natural)
{
    Vec7 d;
    d << s.stretch - natural.stretch, s.turn[0] - natural.turn[0], s.turn[1] - natural.turn[1];
    return d;
}

/// The linear beam: the difference of the ends' turns bends and twists it, their mean shears it
/// (the law's shear flexibility holds the cubic beam's bending too).
Mat7 stiffness(const ElementLaw& law)
{
    const double L2 = law.length * law.length;
    Mat7 k = Mat7::Zero();
    k(0, 0) = law.S[0] / L2;
    const double bend[3] = {law.S[3] / L2, law.S[4] / L2, law.S[5] / L2};
    const double shear[3] = {0, 0.25 * law.S[2], 0.25 * law.S[1]};
    for (int i = 0; i < 3; ++i) {
        k(1 + i, 1 + i) = k(4 + i, 4 + i) = bend[i] + shear[i];
        k(1 + i, 4 + i) = k(4 + i, 1 + i) = shear[i] - bend[i];
    }
    return k;
}

/// d(rotation vector) = T d(spin), spin on the left.
Mat3 spin_to_vector(const Vec3& v)
{
    const double t = v.norm();
    const double half = 0.5 * t;
    const double c = t > 1e-4 ? half / std::tan(half) : 1 - half * half / 3;
    const double along = t > 1e-4 ? (1 - c) / (t * t) : 1.0 / 12;
    return c * Mat3::Identity() + along * v * v.transpose() - 0.5 * skew_matrix(v);
}

/// Derivative of T^T m by the spin, m constant.
Mat3 turned_moment(const Vec3& v, const Vec3& m, const Mat3& T)
{
    const double t = v.norm();
    double eta = 1.0 / 12, mu = 1.0 / 360;
    if (t > 0.02) {
        const double s = std::sin(0.5 * t);
        eta = (2 * std::sin(t) - t * (1 + std::cos(t))) / (2 * t * t * std::sin(t));
        mu = (t * (t + std::sin(t)) - 8 * s * s) / (4 * t * t * t * t * s * s);
    } else {
        eta += t * t / 720;
        mu += t * t / 7560;
    }
    const Mat3 V = skew_matrix(v);
    return (eta * (v * m.transpose() - 2 * m * v.transpose() + v.dot(m) * Mat3::Identity()) +
            mu * V * V * m * v.transpose() - 0.5 * skew_matrix(m)) *
           T;
}

} // namespace

CorotationalStrain corotational_strain(const BeamNode& a, const BeamNode& b, double length)
{
    return strain_in(element_frame(a, b), length);
}

CorotationalStrain corotational_natural(const ElementLaw& law)
{
    // The pose of the exact element with its natural strains.
    BeamNode a, b;
    move_along(b, natural_strain(law), law.length);
    return corotational_strain(a, b, law.length);
}

double corotational_energy(const BeamNode& a, const BeamNode& b, const ElementLaw& law,
                           const CorotationalStrain& natural)
{
    const Vec7 d = deformation(corotational_strain(a, b, law.length), natural);
    return 0.5 * d.dot(stiffness(law) * d);
}

void corotational_element(const BeamNode& a, const BeamNode& b, const ElementLaw& law,
                          const CorotationalStrain& natural, Vec12& gradient, Mat12& hessian)
{
    const Frame f = element_frame(a, b);
    const CorotationalStrain s = strain_in(f, law.length);
    const Mat7 k = stiffness(law);
    const Vec7 force = k * deformation(s, natural);

    // ---- Gradient and Hessian in the element's frame
    // By spins of the ends in the element's frame.
    Mat7 T = Mat7::Identity();
    T.block<3, 3>(1, 1) = spin_to_vector(s.turn[0]);
    T.block<3, 3>(4, 4) = spin_to_vector(s.turn[1]);
    const Vec7 g = T.transpose() * force;
    Mat7 h = T.transpose() * k * T;
    for (int i = 0; i < 2; ++i)
        h.block<3, 3>(1 + 3 * i, 1 + 3 * i) += turned_moment(s.turn[i], force.segment<3>(1 + 3 * i),
                                                             T.block<3, 3>(1 + 3 * i, 1 + 3 * i));

    // ---- Derivative of the frame
    // The spin of the element's frame: G^T times the displacements in that frame.
    const double l = f.chord;
    Eigen::Matrix<double, 3, 12> G = Eigen::Matrix<double, 3, 12>::Zero();
    G(0, 2) = f.mean / l;
    G(0, 3) = 0.5 * f.second[0];
    G(0, 4) = -0.5 * f.first[0];
    G(0, 8) = -f.mean / l;
    G(0, 9) = 0.5 * f.second[1];
    G(0, 10) = -0.5 * f.first[1];
    G(1, 2) = 1 / l;
    G(1, 8) = -1 / l;
    G(2, 1) = -1 / l;
    G(2, 7) = 1 / l;
    Eigen::Matrix<double, 7, 12> B = Eigen::Matrix<double, 7, 12>::Zero();
    B(0, 0) = -1;
    B(0, 6) = 1;
    B.block<3, 3>(1, 3).setIdentity();
    B.block<3, 3>(4, 9).setIdentity();
    B.block<3, 12>(1, 0) -= G;
    B.block<3, 12>(4, 0) -= G;
    const Vec12 own = B.transpose() * g; // along the element's axes
    Mat12 K = B.transpose() * h * B;
    for (int i = 1; i < 3; ++i) { // the chord turns
        K(i, i) += g[0] / l;
        K(6 + i, 6 + i) += g[0] / l;
        K(i, 6 + i) -= g[0] / l;
        K(6 + i, i) -= g[0] / l;
    }

    // ---- Rotation of forces and moments
    // The forces turn with the frame; those of the moments alone.
    Vec7 moments = g;
    moments[0] = 0;
    const Vec12 by_moments = B.transpose() * moments;
    Eigen::Matrix<double, 12, 3> Q;
    for (int i = 0; i < 4; ++i)
        Q.block<3, 3>(3 * i, 0) = skew_matrix(by_moments.segment<3>(3 * i));
    K -= Q * G;
    const Vec3 sum = g.segment<3>(1) + g.segment<3>(4);
    const Vec3 arm(0, (f.mean * sum[0] + sum[1]) / l, sum[2] / l);
    K += G.transpose() * arm * B.row(0);
    // And the coefficients of the frame's first spin change (with a torque only).
    Eigen::Matrix<double, 3, 12> change[2];
    for (int i = 0; i < 2; ++i) {
        change[i] = skew_matrix(f.end[i]) * G;
        change[i].block<3, 3>(0, 3 + 6 * i) -= skew_matrix(f.end[i]);
    }
    using Row12 = Eigen::Matrix<double, 1, 12>;
    const Eigen::Matrix<double, 3, 12> mean = 0.5 * (change[0] + change[1]);
    const Row12 slope = (mean.row(0) - f.mean * mean.row(1)) / f.across;
    K.row(2) -= sum[0] / l * slope;
    K.row(8) += sum[0] / l * slope;
    for (int i = 0; i < 2; ++i) {
        const Row12 first = (change[i].row(0) - f.first[i] * mean.row(1)) / f.across,
                    second = (change[i].row(1) - f.second[i] * mean.row(1)) / f.across;
        K.row(3 + 6 * i) -= 0.5 * sum[0] * second;
        K.row(4 + 6 * i) += 0.5 * sum[0] * first;
    }

    // ---- In space and in the bodies' frames
    // To places in space and turns in the bodies' frames; the symmetric Hessian of turns at 0.
    const Mat3 out[4] = {f.axes, f.R[0].transpose() * f.axes, f.axes, f.R[1].transpose() * f.axes};
    for (int i = 0; i < 4; ++i) {
        gradient.segment<3>(3 * i) = out[i] * own.segment<3>(3 * i);
        for (int j = 0; j < 4; ++j)
            hessian.block<3, 3>(3 * i, 3 * j) =
                out[i] * K.block<3, 3>(3 * i, 3 * j) * out[j].transpose();
    }
    for (int i = 0; i < 2; ++i)
        hessian.block<3, 3>(6 * i + 3, 6 * i + 3) +=
            0.5 * skew_matrix(gradient.segment<3>(6 * i + 3));
    hessian = 0.5 * (hessian + hessian.transpose()).eval();
}

} // namespace amontons
