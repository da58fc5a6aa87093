#pragma once

#include "contact/global_problem.hpp"

#include <Eigen/Geometry>

// Bodies and contacts, put together row by row. For tests and comparisons of contact solvers.

namespace amontons {

/// n and two tangents, as columns; a fixed choice for each n.
inline Mat3 contact_frame(const Vec3& n)
{
    Mat3 frame;
    const Vec3 away = std::abs(n[0]) < 0.7 ? Vec3::UnitX() : Vec3::UnitY();
    frame.col(0) = n;
    frame.col(1) = (away - away.dot(n) * n).normalized();
    frame.col(2) = n.cross(frame.col(1));
    return frame;
}

/// Collects M, H, f, w of bodies with 6 unknowns a node (displacement or velocity, and rotation)
/// or 3.
class ProblemBuilder {
public:
    /// @return  the first of `count` new unknowns
    int add_unknowns(int count)
    {
        dofs_ += count;
        f_.resize(static_cast<std::size_t>(dofs_), 0);
        return dofs_ - count;
    }
    void add_stiffness(int row, int column, double value) { M_.emplace_back(row, column, value); }
    void add_force(int row, double value) { f_[static_cast<std::size_t>(row)] += value; }

    /// A point that a contact acts on: of a node with a rotation (arm: from the node to it), of
    /// one without (turns = false), or of the ground (dof = -1).
    struct Place {
        int dof = -1;
        Vec3 arm = Vec3::Zero();
        bool turns = true;
    };
    /// Contact of a on b. @param n  from b to a  @param gap  part of u_n without any motion
    void add_contact(const Place& a, const Place& b, const Vec3& n, double gap, double mu)
    {
        const Mat3 frame = contact_frame(n);
        for (int k = 0; k < 3; ++k) {
            put(a, frame.col(k), 1);
            put(b, frame.col(k), -1);
            w_.push_back(k == 0 ? gap : 0);
        }
        mu_.push_back(mu);
    }
    int contacts() const { return static_cast<int>(mu_.size()); }

    GlobalProblem finish(ContactLevel level) const
    {
        GlobalProblem p;
        p.M.resize(dofs_, dofs_);
        p.M.setFromTriplets(M_.begin(), M_.end());
        p.H.resize(dofs_, static_cast<Eigen::Index>(w_.size()));
        p.H.setFromTriplets(H_.begin(), H_.end());
        p.f = Eigen::Map<const Eigen::VectorXd>(f_.data(), dofs_);
        p.w = Eigen::Map<const Eigen::VectorXd>(w_.data(), static_cast<Eigen::Index>(w_.size()));
        p.mu = Eigen::Map<const Eigen::VectorXd>(mu_.data(), contacts());
        p.level = level;
        return p;
    }

private:
    void put(const Place& at, const Vec3& direction, double sign)
    {
        if (at.dof < 0) return;
        const int row = static_cast<int>(w_.size());
        const Vec3 moment = at.arm.cross(direction);
        for (int i = 0; i < 3; ++i) {
            if (direction[i] != 0) H_.emplace_back(at.dof + i, row, sign * direction[i]);
            if (at.turns && moment[i] != 0) H_.emplace_back(at.dof + 3 + i, row, sign * moment[i]);
        }
    }

    int dofs_ = 0;
    std::vector<Eigen::Triplet<double>> M_, H_;
    std::vector<double> f_, w_, mu_;
};

} // namespace amontons
