#pragma once

#include "validation/measure.hpp"

// Cases of solids and rigid bodies.

namespace amontons::validation {

std::vector<Measured> contact_patch();
std::vector<Measured> raous_block();
std::vector<Measured> dragged_block();
std::vector<Measured> thick_cylinder();
std::vector<Measured> turned_solid();
std::vector<Measured> contrast_in_series();
std::vector<Measured> hertz_sphere();
std::vector<Measured> hertz_approach();
std::vector<Measured> roller();
std::vector<Measured> cattaneo_mindlin();
std::vector<Measured> flat_punch();
std::vector<Measured> stuck_punch();
std::vector<Measured> rough_punch();
std::vector<Measured> shrink_fit();
std::vector<Measured> bar_impact();
std::vector<Measured> ball_impact();
std::vector<Measured> wedge();
std::vector<Measured> friction_limits();
std::vector<Measured> redundant_contacts();
std::vector<Measured> units_changed();
std::vector<Measured> order_and_frame();
std::vector<Measured> stiff_blocks();
std::vector<Measured> gaps_and_overlaps();
std::vector<Measured> floating_blocks();
std::vector<Measured> prescribed_faces();
std::vector<Measured> newton_steps();
std::vector<Measured> wedge_jamming();

} // namespace amontons::validation
