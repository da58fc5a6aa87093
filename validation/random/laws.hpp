#pragma once

#include "validation/random/written_files.hpp"

#include <string>
#include <vector>

// Laws of mechanics, recomputed from the files of a run alone. Their bounds follow from the
// accuracy that is requested of a run and from what the theory grants (docs/theory/certificate.md),
// never from what a run gave.

namespace amontons::validation {

/// A law that a run breaks.
struct Finding {
    std::string law;  ///< "balance", "Coulomb", ...; of a variant "turned: ..."
    std::string text; ///< where, how much, how much is allowed
};

/// Forces of the contacts in the frames against the sums in history.csv.
std::vector<Finding> check_sums(const WrittenRun& run);
/// Forces on every body at rest, moments on free ones; momentum of every rigid body in motion.
std::vector<Finding> check_balance(const WrittenRun& run);
/// Push and torque at the bases of instruments against what acts on them out of their sheaths.
std::vector<Finding> check_sheaths(const WrittenRun& run);
/// No contact pulls; friction is within Coulomb's cone, on it where it slips, and against the slip.
std::vector<Finding> check_coulomb(const WrittenRun& run);
/// Where there is a force there is no gap, and no gap is negative.
std::vector<Finding> check_complementarity(const WrittenRun& run);
/// Bodies that stand in contact do not stand in each other.
std::vector<Finding> check_overlap(const WrittenRun& run);
/// The columns of the energy balance, and what can be recomputed of them.
std::vector<Finding> check_energy(const WrittenRun& run);
/// The momentum of all bodies.
std::vector<Finding> check_momentum(const WrittenRun& run);
/// The places of joints and springs.
std::vector<Finding> check_joints(const WrittenRun& run);

/// All of them.
std::vector<Finding> check_laws(const WrittenRun& run);

// ---- what they share

/// A contact as it stands in contacts.vtp.
struct WrittenContact {
    Vec3 at, force, normal, slip; ///< force on body a [N]
    double gap = 0;
    int status = 0; ///< 0 open, 1 stick, 2 slip
    std::string a, b;
};
std::vector<WrittenContact> contacts_of(const WrittenRun& run, const WrittenFrame& frame);

/// The entry of "contact" that two bodies stand in, or nullptr.
const Json* pair_of(const WrittenRun& run, const std::string& a, const std::string& b);

/// What a coupling exerts on a body.
struct JointLoad {
    Vec3 at = Vec3::Zero(), force = Vec3::Zero(), moment = Vec3::Zero();
    bool placed = false; ///< `at` is known
};
/// Of all couplings that a body is in. @return false: one is not written
bool joint_loads(const WrittenRun& run, const std::string& body, const WrittenFrame& frame,
                 std::size_t row, std::vector<JointLoad>& loads);

/// Sizes of a run that tolerances are measured by.
struct RunScale {
    double force = 0;    ///< largest force on a body [N]
    double length = 0;   ///< of the scene's bodies [m]
    double accuracy = 0; ///< that is requested of contacts [-]
    double rounding = 0; ///< force that the rounding of stiff bodies makes [N]
};
RunScale scale_of(const WrittenRun& run);

/// The value at a time of a number or of [[time, value], ...].
double value_at(const Json& curve, double time);

} // namespace amontons::validation
