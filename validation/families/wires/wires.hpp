#pragma once

#include "validation/measure.hpp"

// Cases of wires in sheaths and tubes.

namespace amontons::validation {

std::vector<Measured> elastica();
std::vector<Measured> bend45();
std::vector<Measured> rollup();
std::vector<Measured> capstan_cable();
std::vector<Measured> capstan_beam();
std::vector<Measured> torus();
std::vector<Measured> torus_friction();
std::vector<Measured> double_u();
std::vector<Measured> double_u_rigid_end();
std::vector<Measured> cantilever_frequency();
std::vector<Measured> double_u_dynamic();
std::vector<Measured> stiffness_doubled();
std::vector<Measured> lengths_scaled();
std::vector<Measured> retrace();
std::vector<Measured> millimetres();
std::vector<Measured> frame_turned();
std::vector<Measured> refinement();
std::vector<Measured> double_u_curved();
std::vector<Measured> double_u_unheld();
std::vector<Measured> j_tip_twist();
std::vector<Measured> whip();
std::vector<Measured> torque_lag();
std::vector<Measured> belt_friction();
std::vector<Measured> coaxial_concentric();
std::vector<Measured> coaxial_torus();
std::vector<Measured> coaxial_units();

} // namespace amontons::validation
