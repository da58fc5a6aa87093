#pragma once

#include "validation/solid_meshes.hpp"
#include "validation/solid_run.hpp"

namespace amontons::validation {

/// A09: an elastic block pressed on a rigid plane and pushed along it, in plane strain.
struct RaousOptions {
    ElementKind element = ElementKind::H8;
    int cells = 32, steps = 1;
    double mu = 1, push = 15e7;
    double length = 1, stiffness = 1; ///< units: factors on all lengths and all stresses
    double accuracy = 1e-8;
    unsigned shuffle = 0; ///< seed of another order of nodes and elements; 0: as made
    Vec3 turn = Vec3::Zero(), place = Vec3::Zero(); ///< of the whole scene [rad], [m]
};

/// In SI and along the block's axes, whatever the options.
struct Raous {
    std::vector<Vec3> u;               ///< of points A to E [m]
    std::vector<double> x, u_x;        ///< of the nodes along the edge on the plane [m]
    double normal = 0, tangential = 0; ///< [N/m]
    double open_to = 1, slip_to = 0;   ///< [m]
    int certificates = 0, steps = 0, iterations = 0;
};

/// The quarter x, y >= 0 of a ring about z. Sets x_min inside, x_max outside, y_min and y_max the
/// cuts, z_min and z_max the sides.
VolumeMesh quarter_ring(double inner, double outer, double thick, int through, int around,
                        ElementKind kind);

void raous_scene(SolidScene& s, const RaousOptions& o);
Raous raous(const RaousOptions& o);

} // namespace amontons::validation
