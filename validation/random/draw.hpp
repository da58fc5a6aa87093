#pragma once

#include "mesh/base/types.hpp"

#include <cstdint>
#include <initializer_list>
#include <vector>

namespace amontons::validation {

/// SplitMix64. Source: Steele, Lea, Flood 2014, "Fast splittable pseudorandom number generators",
/// fig. 13.
struct SplitMix {
    std::uint64_t state = 0;
    std::uint64_t next();
};

/// Random numbers that are the same on every machine, rounded to four digits as a person would
/// write them.
class Draw {
public:
    /// @param stream  numbers of different streams of a seed have nothing to do with each other
    Draw(std::uint64_t seed, std::uint64_t stream);

    std::uint64_t bits() { return numbers_.next(); }
    double real(double low, double high);  ///< evenly between
    double ratio(double low, double high); ///< evenly in the logarithm; low > 0
    int whole(int low, int high);          ///< both may come
    bool chance(double share) { return unit() < share; }
    Vec3 direction();                    ///< of length 1 but for the rounding
    Vec3 rotation(double largest = 3.0); ///< rotation vector [rad]
    Vec3 shift(double size);             ///< each component within +-size
    template <class T> T one_of(std::initializer_list<T> list)
    {
        return list.begin()[static_cast<std::size_t>(whole(0, static_cast<int>(list.size()) - 1))];
    }
    /// 0 ... count - 1 in random order.
    std::vector<int> order(int count);

private:
    double unit(); ///< in [0, 1)
    SplitMix numbers_;
};

/// The number with four significant digits that is nearest.
double four_digits(double value);

} // namespace amontons::validation
