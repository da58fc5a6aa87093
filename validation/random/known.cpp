#include "validation/random/known.hpp"

namespace amontons::validation {

const std::vector<KnownMistake>& known_mistakes()
{
    static const char* const kHolds =
        "a solid's holds follow its start.turn, not the world's axes (solids_hold_axes)";
    static const char* const kJoints = "joints and curved contact are integrated to first order "
                                       "(motion_pendulum, motion_bowl, motion_spring)";
    static const char* const kAlpha = "generalised alpha of hyperelastic solids depends on turns "
                                      "(motion_alpha_turned, motion_alpha_falls)";
    static const char* const kWeld =
        "a weld on a solid holds its nearest face alone (joints_weld_on_solid)";
    static const std::vector<KnownMistake> list{
        {"box_on_plane", "turned", "", "", kHolds},
        {"small_reach", "turned", "", "", kHolds},
        {"crossing_bars", "turned", "", "", kHolds},
        {"two_plates", "turned", "", "", kHolds},
        {"round_solid_on_block", "turned", "", "", kHolds},
        {"die_slides", "turned", "", "", kHolds},
        {"named_sets", "turned", "", "", kHolds},
        {"turned_holds", "turned", "", "", kHolds},
        {"turned_holds", "reference", "a held node moved", "", kHolds},
        {"turned_holds", "energy", "the holds do", "", kHolds},
        {"pendulum", "reference", "", "", kJoints},
        {"pendulum", "energy", "", "", kJoints},
        {"pendulum", "joints", "", "", kJoints},
        {"pendulum", "refused", "makes energy", "", kJoints},
        {"bowl", "reference", "", "", kJoints},
        {"bowl", "energy", "", "", kJoints},
        {"bowl", "refused", "makes energy", "", kJoints},
        {"spring_mass", "reference", "", "", kJoints},
        {"bed_in_motion", "turned", "", "generalised alpha", kAlpha},
        {"bed_in_motion", "reference", "steps where", "generalised alpha", kAlpha},
        {"solid_drop", "turned", "", "neo_hooke, generalised alpha", kAlpha},
        {"weld_on_solid", "turned", "", "", kWeld},
        {"weld_on_solid", "reference", "", "", kWeld},
        {"rope", "reference", "the pull", "", "rods at high tension lock (rods_taut_rope)"},
        {"rod_in_sheath", "reference", "the push force", "",
         "a sheath's push is that of its end alone (rods_sheath_push)"},
        {"rod_in_sheath", "reference", "did not turn", "",
         "a turn of a fed rod's start is ignored (rods_fed_twist)"},
        {"rod_between_plates", "reference", "negative modes", "",
         "a rod that is pressed beyond a branch stays straight (rods_sleeve_buckling)"},
        {"rod_between_plates", "energy", "", "",
         "a rod that leaves a branch in a jump loses energy untold (rods_sleeve_buckling)"},
        {"rod_between_plates", "reordered", "", "",
         "a rod that is pressed beyond a branch leaves it by chance (rods_sleeve_buckling)"},
        {"bent_rod", "reference", "", "placed along a line",
         "curvature beside shape.points is ignored (rods_curvature_ignored)"},
        {"coaxial", "units", "", "",
         "instruments in one another depend on the units (rods_coaxial_units)"},
        {"loaded_solid", "reference", "without a warning", "linear",
         "a linear solid bends by any length without a warning (solids_linear_cantilever)"},
        {"named_sets", "files", "columns", "",
         "names of sets are not quoted in history.csv (files_comma)"}};
    return list;
}

std::string known_reason(const std::string& kind, const std::string& drawn, const std::string& law,
                         const std::string& text)
{
    for (const KnownMistake& k : known_mistakes())
        if (kind == k.kind && law.rfind(k.law, 0) == 0 && text.find(k.words) != std::string::npos &&
            drawn.find(k.drawn) != std::string::npos)
            return k.reason;
    return "";
}

} // namespace amontons::validation
