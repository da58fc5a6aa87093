#pragma once

#include "solver/step/simulation.hpp"
#include "validation/measure.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace amontons::validation {

/// A scene of an example or a case, built into the program: "torus", "double-u", "j-tip-twist".
/// @param overrides  as on the command line, "PATH=VALUE"
Scene scene(std::string_view name, const std::vector<std::string>& overrides = {});

/// What cases need of a step.
struct Step {
    double time = 0;
    double insertion = 0;  ///< of the base past the sheath's end [m]
    double twist = 0;      ///< of the base [rad]
    double push = 0;       ///< [N]
    double torque = 0;     ///< [N m]
    double normal_sum = 0; ///< of the contact forces [N]
    Vec3 tip = Vec3::Zero();
    double out_of_plane = 0; ///< largest |z| of the wire [m]
    int contacts = 0;
    int retries = 0;
    EnergyRecord energy;
};

struct Run {
    RunSummary summary;
    std::vector<Step> steps; ///< from the initial state on
    int halved = 0;          ///< steps that were tried longer first
};

/// Runs a scene with one wire to its end.
/// @throws std::runtime_error  if it does not reach it
Run run(const Scene& scene);

/// Mean of a step's value over the insertions [from, to], each step weighted with its length.
double mean(const Run& run, double Step::*value, double from, double to);
/// Half the distance of largest and smallest value there.
double ripple(const Run& run, double Step::*value, double from, double to);
double largest(const Run& run, double Step::*value);
/// Value at an insertion, linear between steps.
/// @param back  on the way back from the deepest insertion
double value_at(const Run& run, double Step::*value, double insertion, bool back = false);

/// |energy error| over the sum of |work|; and that every step is certified.
void add_energy_and_certificates(std::vector<Measured>& rows, const Run& run, double tolerance,
                                 const std::string& of = "");
/// Steps, retries and snaps in a sentence.
std::string story(const Run& run);

/// All lengths times `length` and all forces times `force`; time stays.
Scene scaled(Scene scene, double length, double force);

} // namespace amontons::validation
