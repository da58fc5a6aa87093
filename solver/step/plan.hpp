#pragma once

#include "solver/obstacle/build.hpp"
#include "solver/step/simulation.hpp"

#include <string>
#include <vector>

namespace amontons {

/// What a run of a scene uses, what it leaves out and why, and what it will cost.
struct Plan {
    /// A pair of bodies and its law.
    struct Pair {
        /// Names of the bodies.
        std::string a, b;
        std::string law; ///< "coulomb" | "frictionless"
        /// Coefficient of friction.
        double friction = 0;
    };
    struct LeftOut {
        /// What is left out, and why.
        std::string what, why;
    };
    /// An obstacle as it will be used.
    struct Surface {
        std::string name;
        SurfaceFacts facts;
    };
    /// The bodies as they will be used.
    std::vector<BodyPlan> bodies;
    std::vector<Surface> surfaces; ///< of the obstacles
    std::vector<Pair> pairs;       ///< that can touch
    std::vector<std::string> uses;
    std::vector<LeftOut> leaves_out;
    double memory = 0; ///< predicted peak of the run's own process [bytes]
    double picture =
        0; ///< of the one that draws the picture, after the run; 0: there is none [bytes]
    LinearPlan linear; ///< of the solids' systems; no paths without solids
    std::string path;  ///< how a step is solved
};

/// @param bodies     Simulation::plan()
/// @param obstacles  Simulation::obstacles(): their size counts for the memory
/// @param linear     Simulation::linear_plan()
Plan make_plan(const Scene& scene, const std::vector<BodyPlan>& bodies,
               const std::vector<Obstacle>& obstacles, const LinearPlan& linear = {});

/// The JSON of `amontons check --json`.
std::string plan_json(const Plan& plan);

} // namespace amontons
