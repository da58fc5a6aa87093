#pragma once

#include "solver/beam/rod.hpp"
#include "solver/beam/rod_matrix.hpp"

// Forces, stiffness and masses of all elements of a rod.

namespace amontons {

/// The elements that a rod can have.
enum class RodElement { exact, corotational };

/// Strains of an element: see element_strain.
std::array<double, 6> rod_strain(const RodModel& rod, const std::vector<BeamNode>& nodes,
                                 RodElement kind, int element);
/// Forces and moments of its section, in the order of its strains [N], [N m].
std::array<double, 6> rod_resultants(const RodModel& rod, const std::vector<BeamNode>& nodes,
                                     RodElement kind, int element);
/// Elastic energy [J], of elements from this one on.
double rod_energy(const RodModel& rod, const std::vector<BeamNode>& nodes, RodElement kind,
                  int from = 0);

/// Adds gradients and Hessians of all elements from this one on.
void add_rod_elements(const RodModel& rod, const std::vector<BeamNode>& nodes, RodElement kind,
                      RodMatrix& K, std::vector<Node6>& gradient, int from = 0);

/// A point of the smooth (cubic) middle line of an element, and its derivative by the displacements
/// of the element's two nodes (places, turns in the body frames).
struct RodPlace {
    /// The place [m].
    Vec3 x;
    /// Derivative of x by the twelve unknowns of the element's nodes.
    Eigen::Matrix<double, 3, 12> J;
};
/// A place on the middle line of an element and its derivative; xi of 0 to 1.
RodPlace rod_place(const RodModel& rod, const std::vector<BeamNode>& nodes, int element, double xi);
/// The same with another rest length of the element [m], as of one that grows out of a sheath.
RodPlace rod_place(const RodModel& rod, const std::vector<BeamNode>& nodes, int element, double xi,
                   double length);
/// The place alone [m].
Vec3 rod_point(const RodModel& rod, const std::vector<BeamNode>& nodes, int element, double xi);

/// Calls visit(element, mass [kg], xi) for the integration points of the mass, of elements from
/// this one on: exact for squares of cubic displacements.
template <class Visit> void for_mass_points(const RodModel& rod, Visit visit, int from = 0)
{
    constexpr double kAt[4] = {0.06943184420297371, 0.33000947820757187, 0.6699905217924281,
                               0.9305681557970263};
    constexpr double kWeight[4] = {0.17392742256872693, 0.32607257743127307, 0.32607257743127307,
                                   0.17392742256872693};
    for (int e = from; e < rod.element_count(); ++e) {
        const double m = rod.mass[std::size_t(e)].per_length * rod.law[std::size_t(e)].length;
        for (int g = 0; g < 4; ++g)
            visit(e, kWeight[g] * m, kAt[g]);
    }
}

/// Rotary inertia of a node about its section's axes, of elements from this one on [kg m^2].
Vec3 rod_inertia(const RodModel& rod, int node, int from = 0);

/// Adds `scale` times the mass matrix at these places of the nodes.
void add_rod_mass(const RodModel& rod, const std::vector<BeamNode>& nodes, double scale,
                  RodMatrix& M);

/// Adds a 12 x 12 matrix of an element's two nodes.
void add_element_matrix(const RodModel& rod, int element, const Eigen::Matrix<double, 12, 12>& m,
                        RodMatrix& K);

/// The lowest frequencies of small free vibration [rad/s], lowest first, by iteration on a
/// subspace.
/// @param K  stiffness with holds, factored; M  mass with holds
std::vector<double> rod_frequencies(const RodMatrix& K, const RodMatrix& M, int nodes, int count);

} // namespace amontons
