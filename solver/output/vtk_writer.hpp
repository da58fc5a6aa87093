#pragma once

#include "mesh/base/types.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

// VTK's XML files as ParaView reads them: VTP, VTU (raw appended data) and PVD. The bytes are
// made in memory; the caller writes them (write_file does so atomically).
// Source: VTK's "XML File Formats" page; each file is checked against VTK's reader in a test.

namespace amontons {

/// How numbers are stored in the file.
enum class Stored { float64, float32, int32 };

/// An array with a name: one value, or 3 or 6 components, for each point or cell.
struct VtkArray {
    std::string name; ///< snake_case
    std::string unit; ///< SI, "" if none; stored as UNITS_LABEL
    int components = 1;
    std::span<const double> values; ///< components x points, not copied
    Stored stored = Stored::float64;
};

/// Words that hold for all of a file, in its field data.
struct VtkTexts {
    std::string name;
    /// Texts of each point or cell.
    std::vector<std::string> values;
};

/// Points with polylines, vertices and triangles among them.
struct PolyData {
    /// Places [m].
    std::span<const Vec3> points;
    Stored stored = Stored::float64;              ///< the points
    std::vector<std::vector<std::int32_t>> lines; ///< each a polyline
    std::span<const std::array<std::int32_t, 3>> triangles;
    bool vertices = false; ///< each point is a vertex cell as well
    std::vector<VtkArray> point_arrays;
    std::vector<VtkTexts> texts;
};

/// Cells of any of VTK's types.
struct UnstructuredGrid {
    /// Places [m].
    std::span<const Vec3> points;
    /// Nodes of the cells, one after another.
    std::span<const std::int32_t> connectivity;
    std::span<const std::int32_t> offsets; ///< where each cell's points end in `connectivity`
    std::span<const std::uint8_t> types;   ///< VTK's cell types
    std::vector<VtkArray> point_arrays, cell_arrays;
    std::vector<VtkTexts> texts = {};
};

/// The bytes of a .vtp file. @param time  [s], as TimeValue
std::string vtp_bytes(const PolyData& data, double time);

/// The bytes of a .vtu file. @param time  [s], as TimeValue
std::string vtu_bytes(const UnstructuredGrid& grid, double time);

/// One file of a collection over time.
struct PvdEntry {
    double time = 0; ///< [s]
    int part = 0;
    std::string name; ///< of the part
    std::string file; ///< relative to the collection
};

/// A .pvd file that grows: adding a frame costs the frame, not the collection.
class Collection {
public:
    /// Adds a file at its time.
    void add(const PvdEntry& entry);
    /// The .pvd file.
    std::string bytes() const;

private:
    std::string entries_;
};

} // namespace amontons
