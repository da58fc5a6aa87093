#pragma once

#include "contact/problem.hpp"

#include <optional>

namespace amontons {

/// Of the reactions with the motion of r, the one of least norm, by linear algebra: contacts that
/// slide keep the direction of their friction, those that are open stay without a force. A dense W
/// only.
/// @param r  solves the problem
/// @return   nothing where the least of those violates a contact's law: the least norm then has
///           another active set, which linear algebra alone does not find
std::optional<Eigen::VectorXd> least_norm_of_same_motion(const ContactProblem& problem,
                                                         const Eigen::VectorXd& r);

} // namespace amontons
