#pragma once

#include <string>
#include <vector>

namespace amontons::validation {

/// A mistake that is known and waits for a cure.
struct KnownMistake {
    const char* kind;   ///< of scene
    const char* law;    ///< how the finding's law begins; "refused": an answer that is not there
    const char* words;  ///< that stand in the finding's text, or ""
    const char* drawn;  ///< words of what was drawn, or ""
    const char* reason; ///< what is known of it, and what cures it
};

const std::vector<KnownMistake>& known_mistakes();

/// The reason of a finding that is known, or "".
std::string known_reason(const std::string& kind, const std::string& drawn, const std::string& law,
                         const std::string& text);

} // namespace amontons::validation
