#pragma once

#include "validation/random/draw.hpp"
#include "validation/random/written_files.hpp"

#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace amontons::validation {

/// What is right for a scene.
enum class Answer {
    done,             ///< an answer
    done_or_refused,  ///< an answer, or exit code 3: a motion through another body
    bad_input,        ///< exit code 2: a start inside another body
    done_or_bad_input ///< an answer, or a field that is not allowed here
};

/// The same problem specified otherwise.
struct Twin {
    std::string name;
    Json scene;
    double tolerance = 1e-6; ///< of forces and places, relative to the largest
};

/// A scene that was drawn, and what is right for it.
struct RandomScene {
    Json scene;
    std::string drawn = ""; ///< in a few words
    Answer answer = Answer::done;
    /// Tolerances between scenes that are one problem, relative to the largest value of a unit. The
    /// default is a hundredfold of the requested accuracy (1e-8).
    double same = 1e-6;  ///< turned, renamed, reordered
    double units = 1e-8; ///< in other units by powers of two; above `same` is `same`
    /// Reordered, where it may be more: of two meshes that are as fine either may carry the
    /// multipliers, and the answers differ by what the meshes leave.
    double order = 0;
    double steps = 0; ///< other numbers of steps; 0: the answer depends on them
    std::vector<Twin> twins = {};
    std::vector<std::pair<std::string, std::string>> files = {}; ///< beside the scene: name, text
    /// What must hold beside the laws: "" or what is wrong.
    std::function<std::string(const WrittenRun&)> right = {};
};

/// A kind of scenes.
struct SceneKind {
    const char* name;
    const char* about;
    RandomScene (*draw)(Draw&);
};

/// Kinds that are drawn together. The scenes of one suite do not depend on the kinds of another.
struct SceneSuite {
    const char* name;
    int count;                    ///< scenes, where nothing else is specified
    std::vector<SceneKind> kinds; ///< in the order of the table
};

/// "random": kinds that try one thing each; "mixed": kinds that put all bodies together.
const std::vector<SceneSuite>& scene_suites();
/// nullptr: there is none of that name.
const SceneSuite* find_suite(const std::string& name);

/// The kind of a scene by its number: every kind comes once in as many scenes as there are kinds.
const SceneKind& kind_of_scene(const SceneSuite& suite, std::uint64_t seed, int number);
/// A scene depends on suite, seed and number alone.
RandomScene draw_scene(const SceneSuite& suite, std::uint64_t seed, int number);

// ---- the kinds, by what they try

// kinds_pressed.cpp: contacts at rest that are easily lost
RandomScene draw_box_on_plane(Draw&);
RandomScene draw_rigid_box_in_block(Draw&);
RandomScene draw_rigid_cylinder_in_block(Draw&);
RandomScene draw_paddle(Draw&);
RandomScene draw_small_reach(Draw&);
RandomScene draw_starts_inside(Draw&);
RandomScene draw_ball_through_sheet(Draw&);
RandomScene draw_crossing_bars(Draw&);
RandomScene draw_edge_through_edge(Draw&);
RandomScene draw_two_plates(Draw&);
RandomScene draw_round_solid_on_block(Draw&);
RandomScene draw_rigid_ball_on_block(Draw&);
// kinds_rest.cpp: solids and rigid bodies at rest
RandomScene draw_disc_on_bed(Draw&);
RandomScene draw_die_slides(Draw&);
RandomScene draw_free_block(Draw&);
RandomScene draw_rigid_stack(Draw&);
RandomScene draw_weld_on_solid(Draw&);
RandomScene draw_turned_holds(Draw&);
RandomScene draw_loaded_solid(Draw&);
RandomScene draw_named_sets(Draw&);
// kinds_motion.cpp
RandomScene draw_pendulum(Draw&);
RandomScene draw_bowl(Draw&);
RandomScene draw_spring_mass(Draw&);
RandomScene draw_struck_ball(Draw&);
RandomScene draw_bed_in_motion(Draw&);
RandomScene draw_solid_drop(Draw&);
RandomScene draw_thrown_bodies(Draw&);
// kinds_rods.cpp
RandomScene draw_rope(Draw&);
RandomScene draw_rod_in_sheath(Draw&);
RandomScene draw_rod_between_plates(Draw&);
RandomScene draw_bent_rod(Draw&);
RandomScene draw_wire_in_tube(Draw&);
RandomScene draw_coaxial(Draw&);

// ---- kinds that mix bodies

// kinds_instruments.cpp: instruments beside bodies, at rest
RandomScene draw_wire_pushes_body(Draw&);
RandomScene draw_clot_in_tube(Draw&);
RandomScene draw_wire_on_solid(Draw&);
RandomScene draw_wire_among_rods(Draw&);
RandomScene draw_wires_side_by_side(Draw&);
RandomScene draw_wire_loops(Draw&);
RandomScene draw_body_at_tip(Draw&);
RandomScene draw_wire_in_crowd(Draw&);
// kinds_mixed.cpp: solids, rigid bodies, rods and obstacles in one scene
RandomScene draw_net_crimped(Draw&);
RandomScene draw_net_dropped(Draw&);
RandomScene draw_layers_at_rest(Draw&);
RandomScene draw_coupled_at_rest(Draw&);
RandomScene draw_coupled_in_motion(Draw&);
// kinds_crowd.cpp: three to six bodies of any kind
RandomScene draw_crowd_dropped(Draw&);
RandomScene draw_crowd_pressed(Draw&);
RandomScene draw_crowd_dragged(Draw&);

} // namespace amontons::validation
