#pragma once

#include "solver/body/rod_body.hpp"
#include "validation/measure.hpp"

// Cases of rods.

namespace amontons::validation {

std::vector<Measured> rod_rollup();
std::vector<Measured> rod_elastica();
std::vector<Measured> rod_bend();
std::vector<Measured> rod_refined();
std::vector<Measured> lee_frame();
std::vector<Measured> euler_columns();
std::vector<Measured> twisted_ring();
std::vector<Measured> rod_frequencies_case();
std::vector<Measured> rod_capstan();
std::vector<Measured> rod_bent_tube();
std::vector<Measured> rod_helix();
std::vector<Measured> rod_in_tube();
std::vector<Measured> rod_helical();
std::vector<Measured> rod_plies();
std::vector<Measured> rod_knot();
std::vector<Measured> rod_nest();
std::vector<Measured> rod10_statics();
std::vector<Measured> rod10_sizes();
std::vector<Measured> rod10_turning();
std::vector<Measured> rod10_contact();

/// Deflection and shortening of a cantilever of length 1 and EI 1 under a dead end load, without
/// extension: elliptic integrals.
struct Elastica {
    double w, u;
};
Elastica elastica_of(double load);

/// Least distance of two segments.
double segment_distance(const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1);
/// Places half-way between those of a smooth line come in: cubics through four neighbours.
std::vector<Vec3> refined(const std::vector<Vec3>& line);
/// Least distance of a wire's middle line from itself where the way along it is more than three
/// diameters; at most that way.
double least_distance(const std::vector<Vec3>& line, double radius);

/// A uniform rod along x from the origin, clamped there unless its holds are changed.
RodInput uniform_rod(double length, double EI, double GJ, double EA, double GA, int elements);
/// A load on its end, multiplied by the time.
RodLoad end_load(const Vec3& force);
/// Brings a rod to its balance at a time by Newton's method, in steps of time; where one fails, in
/// shorter ones.
/// @throws std::runtime_error  if it does not converge
void bring_to(RodBody& rod, double& t, double to, int steps);

} // namespace amontons::validation
