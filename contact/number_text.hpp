#pragma once

#include <sstream>
#include <string>

// How messages write numbers; for .cpp files alone.

namespace amontons {

/// A number with six significant digits, as messages print it.
inline std::string number_text(double value)
{
    std::ostringstream out;
    out << value;
    return out.str();
}

} // namespace amontons
