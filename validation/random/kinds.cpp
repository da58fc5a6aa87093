#include "validation/random/kinds.hpp"

#include <limits>

namespace amontons::validation {

namespace {

std::vector<SceneKind> single_kinds()
{
    return {
        {"box_on_plane", "an elastic box driven onto a plane", draw_box_on_plane},
        {"rigid_box_in_block", "a rigid box pressed into a block", draw_rigid_box_in_block},
        {"rigid_cylinder_in_block", "a rigid cylinder, upright or lying, pressed into a block",
         draw_rigid_cylinder_in_block},
        {"paddle", "a rigid paddle turned against a block", draw_paddle},
        {"small_reach", "two bodies whose pair has a reach of its own", draw_small_reach},
        {"starts_inside", "a body that starts in another", draw_starts_inside},
        {"ball_through_sheet", "a rigid ball pressed against a thin sheet",
         draw_ball_through_sheet},
        {"crossing_bars", "two bars pressed crosswise", draw_crossing_bars},
        {"edge_through_edge", "two bars of one element pressed crosswise", draw_edge_through_edge},
        {"two_plates", "a plate pressed onto another", draw_two_plates},
        {"round_solid_on_block", "an elastic ball or roller on a coarse block",
         draw_round_solid_on_block},
        {"rigid_ball_on_block", "a rigid ball on a block of any element", draw_rigid_ball_on_block},
        {"disc_on_bed", "a rigid disc or box pressed into a bed, then slid", draw_disc_on_bed},
        {"die_slides", "an elastic die pressed and slid over a block", draw_die_slides},
        {"free_block", "an elastic block that contacts alone hold", draw_free_block},
        {"rigid_stack", "rigid bodies at rest on each other", draw_rigid_stack},
        {"weld_on_solid", "a rigid arm welded to an elastic pad", draw_weld_on_solid},
        {"turned_holds", "a turned solid, held along the world's axes", draw_turned_holds},
        {"loaded_solid", "an elastic beam under traction, pressure and weight", draw_loaded_solid},
        {"named_sets", "a mesh from a file whose sets have odd names", draw_named_sets},
        {"pendulum", "a rigid body that swings about a joint", draw_pendulum},
        {"bowl", "a ball that rolls or slides in a bowl", draw_bowl},
        {"spring_mass", "a mass on a spring", draw_spring_mass},
        {"struck_ball", "a light ball struck by a heavy one", draw_struck_ball},
        {"bed_in_motion",
         "an elastic bed in motion, turned, with or without a body that falls on it",
         draw_bed_in_motion},
        {"solid_drop", "an elastic body that falls", draw_solid_drop},
        {"thrown_bodies", "rigid bodies that are thrown and collide", draw_thrown_bodies},
        {"rope", "a rope or a rod between two supports", draw_rope},
        {"rod_in_sheath", "a rod that is fed through a sheath", draw_rod_in_sheath},
        {"rod_between_plates", "a rod that is shortened between plates", draw_rod_between_plates},
        {"bent_rod", "a rod with a curvature of its own", draw_bent_rod},
        {"wire_in_tube", "an instrument pushed through a tube", draw_wire_in_tube},
        {"coaxial", "a catheter over a wire in a tube", draw_coaxial}};
}

std::vector<SceneKind> mixed_kinds()
{
    return {
        {"wire_pushes_body", "an instrument that pushes a free body over a floor",
         draw_wire_pushes_body},
        {"clot_in_tube", "an instrument that pushes a free ball through a tube", draw_clot_in_tube},
        {"wire_on_solid", "an instrument pressed against a solid or bent along it",
         draw_wire_on_solid},
        {"wire_among_rods", "an instrument that bends between rods", draw_wire_among_rods},
        {"wires_side_by_side", "instruments of different introducers in one tube",
         draw_wires_side_by_side},
        {"wire_loops", "an instrument that loops in a ball and touches itself", draw_wire_loops},
        {"body_at_tip", "a rigid body coupled to an instrument's tip, over something",
         draw_body_at_tip},
        {"wire_in_crowd", "instruments among bodies of all kinds", draw_wire_in_crowd},
        {"net_crimped", "a net of coupled rods between rigid walls", draw_net_crimped},
        {"net_dropped", "a net of coupled rods that falls", draw_net_dropped},
        {"layers_at_rest", "rods and rigid bodies pressed onto a solid", draw_layers_at_rest},
        {"coupled_at_rest", "bodies of different kinds in couplings and contact",
         draw_coupled_at_rest},
        {"coupled_in_motion", "the same, in motion", draw_coupled_in_motion},
        {"crowd_dropped", "three to six bodies of any kind that fall on each other",
         draw_crowd_dropped},
        {"crowd_pressed", "three to five bodies of any kind pressed into one another",
         draw_crowd_pressed},
        {"crowd_dragged", "a driven body dragged through others", draw_crowd_dragged}};
}

} // namespace

const std::vector<SceneSuite>& scene_suites()
{
    static const std::vector<SceneSuite> suites{{"random", 300, single_kinds()},
                                                {"mixed", 200, mixed_kinds()}};
    return suites;
}

const SceneSuite* find_suite(const std::string& name)
{
    for (const SceneSuite& suite : scene_suites())
        if (suite.name == name) return &suite;
    return nullptr;
}

const SceneKind& kind_of_scene(const SceneSuite& suite, std::uint64_t seed, int number)
{
    const std::vector<SceneKind>& kinds = suite.kinds;
    const int count = static_cast<int>(kinds.size()), round = number / count;
    Draw draw(seed, std::numeric_limits<std::uint64_t>::max() - static_cast<std::uint64_t>(round));
    return kinds[static_cast<std::size_t>(
        draw.order(count)[static_cast<std::size_t>(number % count)])];
}

RandomScene draw_scene(const SceneSuite& suite, std::uint64_t seed, int number)
{
    Draw draw(seed, static_cast<std::uint64_t>(number));
    RandomScene scene = kind_of_scene(suite, seed, number).draw(draw);
    scene.scene["title"] = std::string(kind_of_scene(suite, seed, number).name) + " " +
                           std::to_string(number) + " of seed " + std::to_string(seed) + ": " +
                           scene.drawn;
    return scene;
}

} // namespace amontons::validation
