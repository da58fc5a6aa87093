#pragma once

#include <sstream>
#include <string>

// How messages write numbers; for .cpp files alone.

namespace amontons {

/// The shortest text that reads back as the same double.
inline std::string number_text(double value)
{
    std::ostringstream out;
    out << value;
    return out.str();
}

} // namespace amontons
