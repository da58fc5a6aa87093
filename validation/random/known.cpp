#include "validation/random/known.hpp"

namespace amontons::validation {

const std::vector<KnownMistake>& known_mistakes()
{
    static const std::vector<KnownMistake> list{
        {"rod_between_plates", "energy", "", "",
         "a rod that buckles between plates snaps from wave to wave; steps miss more than is "
         "warned of"},
        {"rod_between_plates", "axes", "", "",
         "a rod that buckles has several stable balances, and round-off chooses"},
        {"rod_between_plates", "reordered", "", "",
         "a rod that buckles has several stable balances, and round-off chooses"}};
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
