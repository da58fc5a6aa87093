#pragma once

#include "mesh/base/types.hpp"

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

// What a run has written, read by a reader of its own: nothing here includes the writers.

namespace amontons::validation {

using Json = nlohmann::ordered_json;

/// An array of a VTK file.
struct WrittenArray {
    int components = 1;
    std::string type; ///< "Float64", "Float32", "Int32" or "UInt8"
    std::vector<double> values;

    Vec3 vector(std::size_t i) const
    {
        return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
    }
};

/// A VTK file: its arrays under "SECTION/name", for example "PointData/force", "Cells/offsets".
struct VtkText {
    std::map<std::string, WrittenArray> arrays;
    double time = 0; ///< [s]

    const WrittenArray* find(const std::string& name) const;
    /// @throws std::runtime_error  if there is no such array
    const WrittenArray& get(const std::string& name) const;
    std::size_t points() const;
};

/// @throws std::runtime_error  if the file is not whole
VtkText read_vtk(const std::string& path);

/// All that was written of one moment.
struct WrittenFrame {
    double time = 0;                      ///< [s]
    std::map<std::string, VtkText> parts; ///< by body; "contacts" beside them
};

/// Columns of history.csv.
struct WrittenHistory {
    std::vector<std::string> names, units;
    std::vector<std::vector<double>> rows; ///< [step][column]; a remark is NaN

    int column(const std::string& name) const; ///< -1: none
    /// Values over the steps. @throws std::runtime_error  if there is no such column
    std::vector<double> values(const std::string& name) const;
    double last(const std::string& name) const;
    /// Of the columns name_x, name_y, name_z in a row.
    Vec3 vector(const std::string& name, std::size_t row) const;
    bool has_vector(const std::string& name) const { return column(name + "_x") >= 0; }
    int row_at(double time) const; ///< -1: none
};

/// The folder of a run.
struct WrittenRun {
    Json manifest;
    WrittenHistory history;
    std::vector<WrittenFrame> frames;
    std::vector<std::string> bodies;  ///< by the number that contacts give them
    std::map<std::string, Json> body; ///< of the resolved scene

    const Json& scene() const { return manifest.at("scene").at("resolved"); }
    bool dynamic() const { return scene().at("time").value("kind", "") == "dynamic"; }
    std::string text(const std::string& key) const { return manifest.value(key, std::string()); }
    std::size_t warnings() const;
};

/// @throws std::runtime_error  states which file is not whole, or at odds with another
WrittenRun read_run(const std::string& folder);

/// Places or directions of a JSON list of three numbers.
Vec3 vector_of(const Json& list);

} // namespace amontons::validation
