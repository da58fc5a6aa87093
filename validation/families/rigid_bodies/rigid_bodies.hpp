#pragma once

#include "validation/measure.hpp"

// Rigid bodies with Coulomb friction and impacts: group B of the published cases.

namespace amontons::validation {

std::vector<Measured> incline();
std::vector<Measured> sliding_block();
std::vector<Measured> thrown_block();
std::vector<Measured> bowling_ball();
std::vector<Measured> rolling_down();
std::vector<Measured> spinning_disc();
std::vector<Measured> bouncing_ball();
std::vector<Measured> balls_in_line();
std::vector<Measured> rocking_block();
std::vector<Measured> masonry_arch();
std::vector<Measured> leaning_planks();
std::vector<Measured> jammed_ball();
std::vector<Measured> table_legs();
std::vector<Measured> painleve_rod();
std::vector<Measured> klarbring();
std::vector<Measured> heavy_on_light();

} // namespace amontons::validation
