#pragma once

#include "contact/options.hpp"
#include "contact/solution.hpp"

#include <functional>
#include <string>

namespace amontons {

struct Scene; // solver/scene/scene.hpp

/// The scene's contact_solver for BodyStepOptions::outside; empty if there is none.
/// @throws InputError  if it names a function that is not registered
std::function<ContactSolution(const ContactProblem&, const SolverOptions&, const Eigen::VectorXd&,
                              std::string& why)>
outside_of(const Scene& scene);

/// Finds reactions of a problem whose unilateral contacts have three rows each (its W a matrix).
/// @param warm_start  of the step before, or empty
/// @returns  as many numbers as q has
/// @throws std::exception  if it finds none; what() is the reason
using OutsideFunction =
    std::function<Eigen::VectorXd(const ContactProblem&, const Eigen::VectorXd& warm_start)>;

/// Registers a function that scenes may name as `contact_solver.function`, in this process; an
/// empty one removes the name. May be called from any thread; the function itself is called by the
/// thread that computes the step.
void register_outside_function(const std::string& name, OutsideFunction function);

} // namespace amontons
