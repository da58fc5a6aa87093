#pragma once

#include <doctest/doctest.h>

namespace amontons::test {

/// A number to compare with, within a relative `.epsilon()`. doctest's own Approx adds 1 to the
/// size of what is compared: at 1 % it takes 0.005 N for 0.001 N.
inline doctest::Approx relative(double number)
{
    return doctest::Approx(number).scale(0);
}

} // namespace amontons::test
