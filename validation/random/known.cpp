#include "validation/random/known.hpp"

namespace amontons::validation {

const std::vector<KnownMistake>& known_mistakes()
{
    static const std::vector<KnownMistake> list{};
    return list;
}

std::string known_reason(const std::string& kind, const std::string& law, const std::string& text)
{
    for (const KnownMistake& k : known_mistakes())
        if (kind == k.kind && law.rfind(k.law, 0) == 0 && text.find(k.words) != std::string::npos) return k.reason;
    return "";
}

} // namespace amontons::validation
