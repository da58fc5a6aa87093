#pragma once

#include "solver/rod10/rod10.hpp"

#include <numbers>
#include <vector>

namespace amontons::validation {

constexpr int kTurnFrames = 90;                                     // of a quarter of a turn
constexpr double kTurnOfFrame = std::numbers::pi / 2 / kTurnFrames; // [rad]

/// A load on one node. @param own  the force in the rod's axes [N]
std::vector<Rod10Node> loaded(const Rod10& rod, const Mat3& to_rod, int node, const Vec3& own);

/// Frame k of the turn about z. Rows: the rod's axes.
Mat3 turned_to(int frame);

struct TurningErrors {
    double deflection = 0; ///< of the end under a force across it, over the deflection
    double length = 0;     ///< change of the polyline's, over the length
};

/// The worst over a quarter of a turn with a factor every so many frames (D03).
TurningErrors turning_errors(const Rod10& rod, int every);

} // namespace amontons::validation
