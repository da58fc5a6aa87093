#pragma once

#include "contact/options.hpp"
#include "contact/solution.hpp"

#include <functional>
#include <string>

namespace amontons {

struct Scene; // solver/scene/scene.hpp

/// The scene's contact_solver, as steps ask it (BodyStepOptions::outside); empty if there is none.
/// @throws InputError  a function that nobody has registered
std::function<ContactSolution(const ContactProblem&, const SolverOptions&, const Eigen::VectorXd&,
                              std::string& why)>
outside_of(const Scene& scene);

/// Finds reactions of a problem whose unilateral contacts have three rows each (its W a matrix).
/// @param warm_start  of the step before, or empty
/// @returns  as many numbers as q has; an error is reported by what it throws (std::exception)
using OutsideFunction =
    std::function<Eigen::VectorXd(const ContactProblem&, const Eigen::VectorXd& warm_start)>;

/// Scenes may then name it: `contact_solver.function`. Of this process; an empty one takes the name
/// away. May be called from any thread; the function itself is called by the thread that steps.
void register_outside_function(const std::string& name, OutsideFunction function);

} // namespace amontons
