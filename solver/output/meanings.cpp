#include "solver/output/meanings.hpp"

#include <array>
#include <cctype>
#include <fmt/format.h>

namespace amontons {
namespace {

using enum Meaning::Form;

// Tables whose rows are quantities come first: meaning_of searches there.
constexpr std::size_t kQuantityTables = 3;

std::vector<MeaningTable> make_tables()
{
    return {
        {"Quantities of wires",
         "Scenes with a `beam` (those that are solved as rods beside other bodies have depth, "
         "push_force, tip and the sums of contact forces): columns of `history.csv`, and what `run "
         "--json` reports at the end. "
         "With "
         "several wires each name has the wire's before it: `NAME_depth`.",
         {{"A_over_B_normal_force_sum", "N",
           "Sum of the normal forces in the bore of A, which slides over B."},
          {"A_over_B_friction_force_sum", "N", "Sum of the sizes of the friction forces there."},
          {"A_over_B_contacts", "", "Number of places in the bore that touch."},
          {"NAME_centreline_depth", "m",
           "Distance from the introducer to the tip's place along the introducer's centreline."},
          {"max_depth", "m", "Largest depth so far.", of_wire},
          {"max_push_force", "N", "Largest push force so far.", of_wire},
          {"max_torque", "N m", "Largest size of the torque so far.", of_wire},
          {"max_clustered_force", "N", "Largest clustered force so far.", of_wire},
          {"passed_through", "",
           "Number of the wire's points that are outside of every wall; 0 unless something "
           "failed.",
           of_wire},
          {"branch", "",
           "Name of the branch or opening that the tip was in when it was deepest; \"\": none.",
           of_wire},
          {"depth", "m", "Length of wire beyond the introducer's end.", of_wire},
          {"insertion", "m",
           "How far the base has been moved in: what the drive prescribes, or an opening stopped.",
           of_wire},
          {"base_twist", "rad", "Turn of the base about the wire, as prescribed.", of_wire},
          {"tip_rotation", "rad", "Turn of the tip about the wire since the start.", of_wire},
          {"tip_hold_force_x", "N", "Of a held tip: the force that the hold exerts on the wire."},
          {"tip_hold_force_y", "N", "The same along y."},
          {"tip_hold_force_z", "N", "The same along z."},
          {"tip_hold_moment_x", "N m",
           "Of a held tip whose turns are held, too: the hold's moment on the wire, about the "
           "tip."},
          {"tip_hold_moment_y", "N m", "The same about y."},
          {"tip_hold_moment_z", "N m", "The same about z."},
          {"push_force", "N",
           "Force along the sheath that the hand exerts on the base of the wire or rod; > 0 pushes "
           "in.",
           of_wire},
          {"torque", "N m",
           "Moment about the sheath that the hand exerts on the base; > 0 turns as `twist`.",
           of_wire},
          {"normal_force_sum", "N", "Sum of the normal forces between the wire and walls.",
           of_wire},
          {"friction_force_sum", "N",
           "Sum of the sizes of the friction forces between the wire and walls.", of_wire},
          {"clustered_force", "N", "Largest sum of normal forces within 5 mm of wire.", of_wire},
          {"smallest_gap", "m",
           "Smallest distance of the wire's surface from a wall; < 0: an overlap by "
           "round-off.",
           of_wire},
          {"nodes", "", "Number of nodes that are out of the sheath.", of_wire},
          {"tip", "m", "Place of the tip.", vector_of_wire},
          {"wall_balances", "", "Balances of hyperelastic walls that the step examined."},
          {"wall_tangents", "", "Tangents of hyperelastic walls that the step made."}}},
        {"Quantities of solids, rigid bodies and rods",
         "Scenes without a `beam`. `A_on_B` is what A exerts on B.",
         {{"A_on_B_coupling_N_force", "N",
           "Force that A exerts on B by the joint or spring `couplings[N]`; B may be `world`.",
           vector},
          {"A_on_B_coupling_N_moment", "N m",
           "Moment that A exerts on B by `couplings[N]`: a spring against turning, or a joint that "
           "stops turns, about the joint's place (of a slider on its second body).",
           vector},
          {"A_on_B_normal_force", "N",
           "Sum of the normal forces between A and B, all towards B; of a body and itself, of all "
           "sides."},
          {"A_on_B_contacts", "", "Number of contacts of A and B that carry a force."},
          {"A_on_B_max_pressure", "Pa",
           "Largest contact pressure of A on B; where faces are larger than what they touch, of "
           "the forces on their nodes over the area there."},
          {"A_on_B_force", "N",
           "Contact force that A exerts on B, in all; of a body and itself, on one of the two "
           "sides.",
           vector},
          {"NAME_contact_force", "N", "Force that all contacts exert on the body.", vector},
          {"NAME_max_displacement", "m",
           "Largest displacement of a node since the start; of a condensed solid, of those that "
           "may touch."},
          {"NAME_negative", "",
           "Negative eigenvalues of the rod's matrix: directions in which its balance is not "
           "stable."},
          {"NAME_end_tangent", "", "Unit tangent of the rod at its end.", vector},
          {"NAME_velocity", "m/s", "Velocity of the centre of mass.", vector},
          {"NAME_turn", "rad",
           "Turn of a rigid body since the start, of a solid the one nearest to how the nodes "
           "moved "
           "that may touch (of all, if fewer than three may): a rotation vector of at most pi.",
           vector},
          {"NAME_spin", "rad/s", "Angular velocity.", vector},
          {"NAME_PROBE_displacement", "m",
           "Displacement since the start of the probe's place; of a set the mean.", vector},
          {"NAME_PROBE_stress_xx", "Pa",
           "Stress in space at the probe's place, in its element (of corotational and hyperelastic "
           "ones the element's mean); of a set of faces the mean of the elements behind them."},
          {"NAME_PROBE_stress_yy", "Pa", "As stress_xx."},
          {"NAME_PROBE_stress_zz", "Pa", "As stress_xx."},
          {"NAME_PROBE_stress_xy", "Pa", "As stress_xx."},
          {"NAME_PROBE_stress_yz", "Pa", "As stress_xx."},
          {"NAME_PROBE_stress_zx", "Pa", "As stress_xx."},
          {"NAME_PROBE_von_mises", "Pa", "Of that stress."},
          {"NAME_PROBE_FIELD_error", "",
           "Of a line: the field's error against the reference, root mean square along the line "
           "over that of the reference."},
          {"NAME_PROBE_contact_pressure", "Pa",
           "Contact pressure, > 0 presses: over a set of faces the normal forces on its nodes by "
           "its "
           "area; at a place between its element's nodes, as `contact_pressure` of the files, and "
           "on "
           "a side that carries no contacts' functions by the area that faces each node's force."},
          {"NAME_SET_support_force", "N", "Force that the support exerts on the body.", vector},
          {"NAME_support_energy", "J", "In the body's supports; part of `elastic`."},
          {"NAME_SET_pressure", "Pa", "Pressure that was found for a load by `volume`."},
          {"NAME_SET_moment", "N m",
           "Moment that the hold exerts on the body: on a rod at the held place, on a solid about "
           "`about` where the hold turns its set or gives it a gradient, else about the mean place "
           "of the set's nodes (a linear solid's at rest).",
           vector},
          {"NAME_SET_force", "N", "Force that the hold exerts on the body.", vector},
          {"momentum", "kg m/s", "Of all bodies.", vector},
          {"angular_momentum", "kg m^2/s", "Of all bodies, about the origin.", vector},
          {"NAME_SET", "m", "Place of a rod's end, or of its cross-section at the arc length SET.",
           vector},
          {"NAME", "m", "Place of a rigid body's centre of mass.", vector}}},
        {"Every row of history.csv",
         "One row for each accepted step, the first for the initial state; the heading has the "
         "unit in "
         "brackets. Quantities stand between `time` and `contacts`.",
         {{"step", "", "Number of the step; 0 is the initial state."},
          {"time", "s", "At the step's end."},
          {"contacts", "", "Number of contacts that carry a force."},
          {"certificate_error", "",
           "Error of forces and gaps at the end of the step, recomputed, relative ([what it "
           "covers](theory/certificate.md))."},
          {"certificate_tolerance", "", "The requested tolerance, or what round-off allows."},
          {"worst_penetration", "m", "Largest negative gap of a contact, as a positive number."},
          {"worst_overlap", "m",
           "Largest overlap of surfaces, measured on them; empty or nan: not measured."},
          {"worst_cone_violation", "N", "Largest friction force beyond the cone, 0 if none."},
          {"work", "J", "Of drives, loads, holds and weight since the start."},
          {"work_absolute", "J", "Sum of the sizes of the steps' works."},
          {"elastic", "J", "Elastic energy now."},
          {"kinetic", "J", "Kinetic energy now."},
          {"friction", "J", "Work lost in friction since the start."},
          {"released", "J",
           "Energy lost in snaps and blows and by damping since the start; at rest also what "
           "contacts smaller than a face take, and give back as they open."},
          {"energy_error", "J",
           "work - (elastic - elastic at the start) - (kinetic - kinetic at the start) - friction "
           "- released."},
          {"step_length", "s", "Length of the step."},
          {"iterations", "", "Of the step's method."},
          {"factorisations", "", "Factors of matrices that the step made."},
          {"retries", "", "Shorter steps that were tried before."},
          {"seconds", "s", "Wall time of the step."},
          {"free_motion_seconds", "s", "Wall time since the start in motions without contact."},
          {"detection_seconds", "s", "... in finding contacts."},
          {"compliance_seconds", "s", "... in making the contact problem's matrix."},
          {"contact_solve_seconds", "s", "... in solving contact problems."},
          {"correction_seconds", "s", "... in corrections after them."},
          {"remark", "", "What happened in the step: a snap, why it was halved; else empty."}}},
        {"contacts.pvd",
         "`frames/contacts.STEP.vtp`: a point for each contact that carries a force.",
         {{"force", "N", "Force on `body_a`.", plain},
          {"normal", "", "Unit normal, from `body_b` towards `body_a`."},
          {"slip", "m", "Motion of `body_a` relative to `body_b` along the surface in this step."},
          {"normal_force", "N", "Part of the force along the normal; >= 0."},
          {"tangential_force", "N", "Size of the friction force."},
          {"gap", "m", "Distance of the two surfaces there; < 0: they overlap."},
          {"status", "", "0 open, 1 stick, 2 slip."},
          {"body_a", "", "Number of the body that the force acts on: its place in `body_names`."},
          {"body_b", "", "Number of the other body."},
          {"pressure", "Pa", "normal_force over area; 0 where a contact has no area."},
          {"area", "m^2", "That the contact stands for; 0 of points."},
          {"force_acts_on", "", "Field data: `body_a`."},
          {"body_names", "", "Field data: names of all bodies, obstacles first."},
          {"body_kinds", "", "Field data: obstacle, beam, solid, rigid or rod."},
          {"TimeValue", "s", "Field data of every file: its time."}}},
        {"Wires and rods: frames/NAME.STEP.vtp",
         "The middle line as a polyline; `NAME.tube.STEP.vtp` is the surface around it, for "
         "display, in single precision.",
         {{"radius", "m", "Of the round surface."},
          {"curvature", "1/m", "Size of the curvature."},
          {"twist", "1/m", "Turn about the middle line per length."},
          {"axial_force", "N", "> 0: tension."},
          {"torque", "N m",
           "About the middle line; > 0: the part towards the end turns by the right hand."},
          {"moment", "N m", "Size of the bending moment."},
          {"arc_length", "m", "From the start; of a wire from its base."}}},
        {"Solids: frames/NAME.STEP.vtu",
         "Elements on their places now. Components of a stress: xx, yy, zz, xy, yz, xz along the "
         "world's "
         "axes; tension is > 0.",
         {{"displacement", "m", "Of a node since the start."},
          {"velocity", "m/s", "Of a node; of dynamic runs."},
          {"stress", "Pa", "Cauchy's stress in the middle of an element."},
          {"von_mises", "Pa", "Von Mises' stress there."},
          {"strain_energy_density", "J/m^3", "There."},
          {"stress_averaged", "Pa", "At a node: the mean of its elements."},
          {"von_mises_averaged", "Pa", "Von Mises' stress of that mean."},
          {"contact_pressure", "Pa", "On a node of the outside; > 0 presses."},
          {"stress_round_off", "Pa",
           "Field data: a smaller stress is the round-off of places; pictures draw a body without "
           "a "
           "larger one plain."},
          {"contact_traction", "Pa", "What contacts exert on the body there, per area."},
          {"contact_force", "N", "Of the wall of a vessel: what the wire exerts on the node."}}},
        {"Rigid bodies and obstacles",
         "`frames/NAME.STEP.vtp`; of obstacles `NAME.start.vtp` and `NAME.end.vtp`.",
         {{"velocity", "m/s", "Of a point of a rigid body."},
          {"max_contact_force", "N",
           "On an obstacle's vertex, in scenes with a `beam`: the largest clustered force near it "
           "in the run."}}},
        {"manifest.json, and run --json",
         "`run --json` prints the keys from `status` to `quantities`, `unknowns`, `iterations` and "
         "`output`; the manifest has them all but those three.",
         {{"program.KEY", "", "Name, version, `describe` of the sources, build type and compiler."},
          {"libraries.KEY", "", "Versions."},
          {"machine.KEY", "", "System, processor, number of cores."},
          {"command", "", "The command line."},
          {"threads", "", "Threads that the run was allowed."},
          {"resumed", "", "true: it continued from a checkpoint."},
          {"checkpoint", "", "true: the folder has one."},
          {"started", "", "When, UTC."},
          {"written", "", "When the manifest was written, UTC."},
          {"status", "", "`running`, `done`, `failed` or `interrupted`."},
          {"message", "", "Why the run is not done; else empty."},
          {"warnings", "", "Sentences."},
          {"steps", "", "Accepted steps."},
          {"time", "s", "That was reached."},
          {"seconds.KEY", "s",
           "Wall time: total, read, offline, free_motion, detection, compliance, contact_solve, "
           "correction, output."},
          {"contacts.max", "", "Most contacts with a force in a step."},
          {"contacts.mean", "", "Mean of the steps that have any."},
          {"certificate.worst_error", "", "Largest certificate_error of a step."},
          {"certificate.worst_penetration", "m", "Largest of a step."},
          {"certificate.worst_overlap", "m", "Largest of a step; null: not measured."},
          {"certificate.worst_overlap_at.KEY", "", "Bodies a and b, point [m], step."},
          {"certificate.overlap_not_measured", "",
           "What was left out of worst_overlap, sentences."},
          {"certificate.worst_cone_violation", "N", "Largest of a step."},
          {"certificate.uncertified_steps", "", "Steps whose error is above the tolerance."},
          {"undetermined", "",
           "Pairs whose forces the laws leave open at the end: pair, directions (normal, "
           "tangential), normal_force [least, most] in N; most is null: without a bound."},
          {"undetermined_not_examined", "", "What was not examined for that, sentences."},
          {"energy.KEY", "J",
           "As the columns of history.csv at the end; elastic_start and kinetic_start at the "
           "start."},
          {"snaps", "",
           "Of each jump of the equilibrium: step, time [s], depth [m], released [J]."},
          {"peak_memory", "bytes", "Of the process."},
          {"peak_memory_after.KEY", "bytes",
           "Up to the end of each phase: read, bodies, offline, steps; all_ranks with mpirun."},
          {"modules", "",
           "That are mapped into the process: vtk, fclib, petsc. (The picture is "
           "drawn by a process of its own.)"},
          {"linear.taken", "",
           "How the linear systems of solids were solved: direct, iterative, distributed."},
          {"linear.why", "", "The reason for that choice."},
          {"linear.predicted_seconds", "s", "Of the way taken, as `check` shows it."},
          {"linear.seconds", "s",
           "Making the bodies, free motion, W, contact and correction: what it took."},
          {"minima.KEY", "", "The least value of each quantity over all steps."},
          {"maxima.KEY", "", "The largest."},
          {"quantities.KEY", "",
           "The quantities of the last step, and those that wires report at the end (above)."},
          {"unknowns", "", "Of all bodies."},
          {"iterations", "", "Of all steps."},
          {"output", "", "The folder."},
          {"view.KEY", "", "Of `--view`: frames that were drawn, seconds."},
          {"exit_code", "", "Of the run."},
          {"files", "", "For people, in the folder."},
          {"scene.file", "", "As it was given."},
          {"scene.hash", "", "Of the scene with its values and files."},
          {"scene.resolved", "", "The scene with every default."}}}};
}

bool is_placeholder(std::string_view word)
{
    for (const std::string_view known : {"NAME", "A", "B", "SET", "PROBE", "FIELD", "N", "KEY"})
        if (word == known) return true;
    return false;
}

/// A pattern as pieces of plain text between placeholders, which stand for one character or more.
std::vector<std::string> pieces_of(std::string_view pattern)
{
    std::vector<std::string> pieces{""};
    for (std::size_t at = 0; at < pattern.size();) {
        std::size_t end = at;
        while (end < pattern.size() && std::isupper(static_cast<unsigned char>(pattern[end])))
            ++end;
        if (end > at && is_placeholder(pattern.substr(at, end - at))) {
            pieces.emplace_back();
            at = end;
        } else {
            pieces.back() += pattern[at++];
        }
    }
    return pieces;
}

bool fits(std::string_view name, const std::vector<std::string>& pieces, std::size_t piece = 0)
{
    const std::string& p = pieces[piece];
    if (!name.starts_with(p)) return false;
    if (piece + 1 == pieces.size()) return name.size() == p.size();
    for (std::size_t rest = p.size() + 1; rest <= name.size(); ++rest)
        if (fits(name.substr(rest), pieces, piece + 1)) return true;
    return false;
}

bool fits(std::string_view name, const Meaning& m)
{
    if (m.form == vector || m.form == vector_of_wire) {
        if (!name.ends_with("_x") && !name.ends_with("_y") && !name.ends_with("_z")) return false;
        name.remove_suffix(2);
    }
    if (fits(name, pieces_of(m.name))) return true;
    if (m.form != of_wire && m.form != vector_of_wire) return false;
    return name.ends_with(m.name) && name.size() > m.name.size() + 1 &&
           name[name.size() - m.name.size() - 1] == '_';
}

std::string shown_name(const Meaning& m)
{
    if (m.form != vector && m.form != vector_of_wire) return fmt::format("`{}`", m.name);
    return fmt::format("`{0}_x`, `{0}_y`, `{0}_z`", m.name);
}

} // namespace

std::span<const MeaningTable> meanings()
{
    static const std::vector<MeaningTable> tables = make_tables();
    return tables;
}

const Meaning* meaning_of(std::string_view quantity)
{
    for (std::size_t t : {2, 0, 1}) { // whole names before those of a form
        static_assert(kQuantityTables == 3);
        for (const Meaning& m : meanings()[t].rows)
            if (fits(quantity, m)) return &m;
    }
    return nullptr;
}

std::string outputs_page()
{
    std::string page =
        "# What a run writes\n\n"
        "Generated by `amontons schema --outputs`; do not edit. All values are SI. Words in "
        "capitals "
        "stand for names of the scene. `amontons check SCENE --quantities` prints the names that a "
        "scene has.\n\n";
    for (const MeaningTable& t : meanings()) {
        page += fmt::format("## {}\n{}\n\n| name | unit | meaning |\n|---|---|---|\n", t.title,
                            t.about);
        for (const Meaning& m : t.rows)
            page += fmt::format("| {} | {} | {} |\n", shown_name(m), m.unit, m.text);
        page += "\n";
    }
    page += "## Files\n\n"
            "| file | what it is |\n|---|---|\n"
            "| `NAME.pvd` | all bodies over time, for ParaView |\n"
            "| `contacts.pvd` | all contacts over time |\n"
            "| `frames/` | the files that the two name |\n"
            "| `history.csv` | numbers of every step |\n"
            "| `manifest.json` | everything about the run |\n"
            "| `checkpoint` | what `--resume` continues from |\n"
            "| `*.gp`, `*.svg` | plots, and gnuplot's scripts that draw them |\n"
            "| `NAME.png` | a picture |\n"
            "| `record/` | with `--record`: a contact problem a step, in FCLib's files |\n";
    return page;
}

} // namespace amontons
