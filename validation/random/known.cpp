#include "validation/random/known.hpp"

namespace amontons::validation {

const std::vector<KnownMistake>& known_mistakes()
{
    static const char* const kWeld =
        "a weld on a solid holds its nearest face alone (joints_weld_on_solid)";
    static const std::vector<KnownMistake> list{
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
        {"coaxial", "units", "", "",
         "instruments in one another depend on the units (rods_coaxial_units)"}};
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
