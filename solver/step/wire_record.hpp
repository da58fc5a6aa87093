#pragma once

#include "solver/step/coaxial.hpp"

#include <string>
#include <vector>

namespace amontons {

/// Adds a wire's points and fields, its active contacts and its quantities to a record.
/// @param body       number of the wire among the scene's bodies
/// @param walls      numbers of its walls' bodies
/// @param prefix     of the names of its quantities
/// @param cluster    contact forces are summed over this length of wire [m]
void record_wire(const WireBody& b, const std::string& name, int body,
                 const std::vector<int>& walls, const std::string& prefix, double cluster,
                 StepRecord& out);

/// Adds the contacts in a bore and their sums.
/// @param inner, outer  numbers of the two among the scene's bodies
void record_nesting(const Coaxial& c, std::size_t nesting, int inner, int outer,
                    const std::string& prefix, StepRecord& out);

/// Length of wire past the introducer [m].
double wire_depth(const Wire& wire);
/// Position of the tip [m].
Vec3 wire_tip(const Wire& wire);
/// Number of contact points whose centre is beyond a wall: 0 in a correct result.
int count_outside(const WireBody& b);
/// "; error ..., worst: ..." for a message; "" where the error is within the tolerance and nothing
/// of it holds the step back.
std::string describe_worst(const std::vector<WireBody>& wires, const Residual& residual,
                           double tolerance);

} // namespace amontons
