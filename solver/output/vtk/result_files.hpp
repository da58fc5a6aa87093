#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace amontons::vtk_module {

/// One file of a .pvd collection.
struct Frame {
    double time = 0;  ///< [s]
    std::string name; ///< of what the file holds; "" if the collection has none
    std::filesystem::path file;
};

/// The frames that a .pvd collection names, in its order; paths are made absolute or
/// relative as the collection's own path is.
/// @param error  what is wrong with the file, or "" (then the result is complete)
std::vector<Frame> read_collection(const std::filesystem::path& pvd, std::string& error);

/// All .pvd files of a folder, sorted by name.
std::vector<std::filesystem::path> collections_in(const std::filesystem::path& folder);

/// One column of a history.csv, found by the start of its name ("depth" finds "depth [m]").
/// @return  row by row; empty if there is no such file or column
std::vector<double> read_history_column(const std::filesystem::path& csv, const std::string& name);

/// What stands before an end in the names of a history's columns: of "NAME_push_force [N]" "NAME_",
/// of "push_force [N]" "".
std::vector<std::string> history_prefixes(const std::filesystem::path& csv, const std::string& end);

} // namespace amontons::vtk_module
