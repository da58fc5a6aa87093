#pragma once

#include "solver/body/solid_matrix.hpp"
#include "solver/solid/corotational.hpp"
#include "solver/solid/hyperelastic.hpp"

// Inner forces of a solid, of elements whose state they leave behind, and stresses.

namespace amontons {

/// Inner forces that were found last: those of one version of the places are found once.
struct KnownForces {
    std::int64_t last_version = 0; ///< of all motions of the solid
    std::int64_t version = -1;     ///< of the places of the forces; -1: none
    Eigen::VectorXd forces;        ///< in the frame [N]
    double energy = 0;             ///< [J]
};

/// Elements that turn with the material.
struct CorotationalPart {
    std::vector<CorotationalElement> elements;
    std::vector<CorotationalState> states; ///< where inner forces were found last
    bool exact_tangent = false;            ///< while it is positive
    bool not_positive = false;             ///< the last one was not
};

/// Elements of a hyperelastic solid.
struct HyperelasticPart {
    std::vector<HyperelasticElement> elements;
    std::vector<HyperelasticState> states;
    std::vector<InternalModes> accepted_modes; ///< of the state: every step starts from them
    Eigen::VectorXd force_size;                ///< sum of the sizes of elements' forces
    Eigen::VectorXd u;                         ///< at which inner forces were found last
    Eigen::VectorXd tangent_u;                 ///< at which the step's last tangent was made
    std::string fault;                         ///< why the iterate is invalid; empty: it is valid
};

/// Elements of the model's mesh. @throws InputError  of a file of fibres
std::vector<CorotationalElement> corotational_elements(const SolidModel& model);
/// Elements of the model's mesh and law. @throws InputError  of a file of fibres
HyperelasticPart hyperelastic_part(const SolidModel& model);

/// Forces of the material at places, in the frame [N]; the energy [J].
double corotational_inner(const SolidModel& model, int threads, const SolidMotion& m,
                          CorotationalPart& corotated, KnownForces& known, Eigen::VectorXd& f);
/// Forces of a hyperelastic material at places, in the frame [N]; the energy [J]. A fault where an
/// element has no force.
double hyperelastic_inner(const SolidModel& model, int threads, const SolidMotion& m,
                          HyperelasticPart& hyper, KnownForces& known, Eigen::VectorXd& f);
/// Newton's method on places and mean pressures together, of which the tangent at places has taken
/// the pressures out: a matrix is made with the pressures that the last one led to, not with those
/// that the places answer with.
void expect_pressures(const SolidModel& model, HyperelasticPart& hyper);
/// Where a law that loses its stiffness under pressure has lost it; "" if nowhere.
std::string unstable_elements(const SolidModel& model, const Eigen::VectorXd& u);

/// K v, of the rate of strain alone where elements turn with the material.
/// @param v  along the frame that the last inner forces were found in [m/s]
Eigen::VectorXd rate_forces(const SolidModel& model, const SolidMatrix& matrix, int threads,
                            const CorotationalPart& corotated, const Eigen::VectorXd& v);
/// Of the damping, along the frame [N].
Eigen::VectorXd damping_forces(const SolidModel& model, const SolidMatrix& matrix, int threads,
                               const CorotationalPart& corotated, const SolidMotion& m);

/// Rotation of the material of an element in the frame.
Mat3 rotation_of_element(const CorotationalPart& corotated, std::int32_t element);
/// Stress at a place of an element (of hyperelastic ones its mean), in space [Pa].
Vec6 element_stress(const SolidModel& model, const CorotationalPart& corotated,
                    const HyperelasticPart& hyper, const SolidMotion& m, std::int32_t element,
                    const Vec3& xi);

} // namespace amontons
