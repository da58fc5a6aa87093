#pragma once

#include "mesh/surface_mesh.hpp"

#include <string>
#include <string_view>
#include <vector>

// The data of one finished step for the writers: plain data, no pointers into the simulation.

namespace amontons {

/// Values at the points of a body or the contacts, row by row.
struct Field {
    std::string name;           ///< snake_case, as it stands in the files
    std::string unit;           ///< SI, "" if none
    int components = 1;         ///< 1, 3 or 6
    std::vector<double> values; ///< components x points
};

/// The field of a name, or nullptr.
inline const Field* find_field(const std::vector<Field>& fields, std::string_view name)
{
    for (const Field& f : fields)
        if (f.name == name) return &f;
    return nullptr;
}

/// A beam as a polyline, from the sheath's end to the tip.
struct BeamRecord {
    std::string name;
    std::vector<Vec3> points;  ///< [m]
    std::vector<Field> fields; ///< radius, curvature, twist, axial_force, moment, arc_length
};

/// State of a contact: open, stick, slip.
enum class ContactStatus { open = 0, stick = 1, slip = 2 };

/// A contact at the end of a step, as contacts.pvd shows it.
struct ContactRecord {
    Vec3 point = Vec3::Zero();     ///< on the wall [m]
    Vec3 force = Vec3::Zero();     ///< on body a [N]
    Vec3 normal = Vec3::Zero();    ///< from b to a
    Vec3 slip = Vec3::Zero();      ///< over the step [m]
    double normal_force = 0;       ///< [N]
    double clustered_force = 0;    ///< normal forces summed over the neighbourhood [N]
    double gap = 0;                ///< [m]
    double pressure = 0, area = 0; ///< normal force over the area it stands for; 0: none [Pa, m^2]
    ContactStatus status = ContactStatus::open;
    int body_a = 0, body_b = 0; ///< obstacles first, then others, in the scene's order
};

/// The place where two bodies stand deepest in each other, measured on their surfaces.
struct OverlapRecord {
    double depth = 0; ///< [m]; 0: nowhere, not a number: not measured
    std::string a, b; ///< names of the bodies
    /// Where it is deepest [m].
    Vec3 point = Vec3::Zero();
    /// Step of the overlap.
    int step = 0;
};

/// Errors of an accepted state, recomputed from the state alone.
struct StepCertificate {
    double error = 0;             ///< natural map and equilibrium, relative [-]
    double tolerance = 0;         ///< [-]
    double worst_penetration = 0; ///< of the contacts' gaps [m], >= 0
    OverlapRecord worst_overlap;
    double worst_cone_violation = 0; ///< [N], >= 0
    int worst_contact = -1;          ///< index into StepRecord::contacts
    bool certified = true;           ///< error <= tolerance
};

/// One number of the history, e.g. {"push_force", "N", 0.3}.
struct Quantity {
    std::string name;
    /// Its unit, "" for none.
    std::string unit;
    /// Value in that unit.
    double value = 0;
};

/// A result in words, e.g. {"branch", "left_carotid"}; "" if there is none.
struct NamedText {
    /// Name and value, as the manifest has them.
    std::string name, value;
};

/// Wall time spent in each phase since the start of the run.
struct PhaseSeconds {
    /// Phases before the contact problem [s].
    double read = 0, offline = 0, free_motion = 0, detection = 0, compliance = 0;
    /// Contact problem and later phases; `total` is all of the run [s].
    double contact_solve = 0, correction = 0, output = 0, total = 0;
};

/// Peaks of memory up to the end of each phase [bytes].
struct PhaseMemory {
    /// Peak memory after each phase [bytes].
    double read = 0, bodies = 0, offline = 0, steps = 0;
    double all_ranks = 0; ///< of mpirun, the sum of their own peaks; 0 without [bytes]
};

/// Energy [J]: work and losses since the start of the run, what is stored now and what was then.
struct EnergyRecord {
    /// Work of loads and drives (and of its absolute value), dissipation by friction and energy
    /// released, since the start of the run; elastic and kinetic energy now [J].
    double work = 0, work_absolute = 0, elastic = 0, kinetic = 0, friction = 0, released = 0;
    /// At the start of the run [J].
    double elastic_start = 0, kinetic_start = 0;
    double most_elastic = 0, most_kinetic = 0; ///< largest changes since the start [J]
    double largest_force = 0;                  ///< of a contact so far [N]

    /// What the balance misses [J]: docs/theory/certificate.md.
    double error() const
    {
        return work - (elastic - elastic_start) - (kinetic - kinetic_start) - friction - released;
    }
    /// What the run turned over [J].
    double scale() const
    {
        return work_absolute + kinetic_start + elastic_start + most_elastic + most_kinetic;
    }
};

/// A finished step, as all writers receive it.
struct StepRecord {
    int step = 0;           ///< 0 is the initial state
    double time = 0;        ///< [s]
    double step_length = 0; ///< [s]
    double seconds = 0;     ///< wall time of this step [s]
    int iterations = 0;     ///< of Newton's method; of rods alone factors, also of trials
    int factorisations = 0;
    std::vector<double> errors; ///< of each iteration on forces and geometry; [] if one is enough
    int retries = 0;            ///< halved steps before this one was accepted
    std::string remark;         ///< "", or what happened: "snap", "halved: " and why
    std::vector<BeamRecord> beams;
    std::vector<ContactRecord> contacts; ///< active contacts
    StepCertificate certificate;
    EnergyRecord energy;
    PhaseSeconds phases;              ///< wall times since the start of the run; for history.csv
    std::vector<Quantity> quantities; ///< of each step, same names in the same order: history.csv
};

/// A jump of the equilibrium, crossed by a damped relaxation.
struct SnapRecord {
    /// Step in which it occurred.
    int step = 0;
    double time = 0;     ///< [s]
    double depth = 0;    ///< of the wire's insertion [m]
    double released = 0; ///< energy [J]
};

/// A pair of bodies whose contact forces the laws leave open at the requested accuracy.
struct UndeterminedForce {
    std::string a, b;                        ///< names
    bool normal = false, tangential = false; ///< which directions of its force
    double min = 0, max = 0;                 ///< of its normal force [N]; not finite: without bound
};

/// The least and the largest value of a quantity over the steps of a run.
struct Extremes {
    std::string name;
    /// Range over the run, in the unit of the quantity.
    double least = 0, largest = 0;
};

/// How the linear systems of solids were solved, and the time that took.
struct LinearRecord {
    std::string taken; ///< "direct" | "iterative" | "distributed"; "": there are no such solids
    std::string why;
    double predicted = 0; ///< of the way taken, all of the run [s]
    double seconds = 0;   ///< bodies, free motion, W, contact and correction [s]
};

/// Quantities of a whole run, for the manifest.
struct RunSummary {
    std::string status = "running"; ///< "done" | "failed" | "interrupted"
    std::string message;            ///< why it ended, in a sentence; "" if nothing to report
    int steps = 0;
    double time = 0; ///< reached [s]
    PhaseSeconds seconds;
    PhaseMemory memory;
    int contacts_max = 0;
    double contacts_mean = 0;
    double worst_error = 0, worst_penetration = 0, worst_cone_violation = 0;
    OverlapRecord worst_overlap;
    std::vector<std::string> not_measured;       ///< what worst_overlap leaves out, a sentence each
    std::vector<UndeterminedForce> undetermined; ///< at the end of the last step
    std::vector<std::string> undetermined_not_examined; ///< what that leaves out, a sentence each
    std::vector<std::string> warnings;                  ///< of the steps, a sentence each
    int uncertified_steps = 0;
    EnergyRecord energy;
    std::vector<SnapRecord> snaps;
    std::vector<Quantity> quantities; ///< depth, max_push_force, max_torque, passed_through, ...
    std::vector<Extremes> extremes;   ///< of the quantities of steps, by history.csv
    LinearRecord linear;
    std::vector<NamedText> texts;     ///< results in words: the branch that a wire entered
    std::vector<double> step_seconds; ///< wall time of each step
};

} // namespace amontons
