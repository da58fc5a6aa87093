#pragma once

#include <string>
#include <vector>

// What a study varies: "PATH=a,b,c", once or several times, and all combinations of it.

namespace amontons::study {

/// One thing that is varied. Several paths get the same value at a time.
struct Sweep {
    std::string text; ///< as the user wrote it
    std::vector<std::string> paths;
    std::vector<std::string> values; ///< JSON, or plain text as after --set
    std::string name() const;        ///< the paths as they were written
};

/// One combination of the values.
struct Point {
    int index = 0;                   ///< counted with the last sweep running fastest
    std::vector<std::string> values; ///< one a sweep
};

/// Reads "PATH=a,b,c" or "PATH,PATH=a,b,c". Commas within brackets, braces and quotes do not
/// separate: cells=[2,2,1],[4,4,1].
/// @throws InputError
Sweep parse_sweep(const std::string& text);

/// All combinations. @throws InputError  if there are more than 100000, or a path stands twice
std::vector<Point> all_points(const std::vector<Sweep>& sweeps);

/// "PATH=VALUE" of a point, as --set takes them.
std::vector<std::string> overrides(const std::vector<Sweep>& sweeps, const Point& point);

/// Size of a value: a number itself; of a list the geometric mean of the entries at which the
/// sweep's values differ; NaN if it has none.
double size_of(const Sweep& sweep, const std::string& value);

/// The share of work "i/n", 1 <= i <= n. @throws InputError
struct Shard {
    int i = 1, n = 1;
    bool has(const Point& point) const { return point.index % n == i - 1; }
};
Shard parse_shard(const std::string& text);

} // namespace amontons::study
