#pragma once

#include "mesh/base/text.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

// VTK's XML files: elements with attributes, and arrays of numbers as text, base64 or raw bytes,
// possibly compressed by zlib. Only what data files use of XML: no DTD, no CDATA.

namespace amontons {

/// An array as the file holds it. Views are into the file's bytes.
struct VtkXmlArray {
    std::string name;
    std::string type;   ///< Float64, Int32, ...
    std::string format; ///< ascii, binary, appended
    std::string parent; ///< Points, Cells, PointData, CellData, ...
    std::string place;  ///< line of its beginning
    std::uint64_t components = 1;
    std::uint64_t offset = 0; ///< of appended data
    std::string_view text;    ///< of data that stands in it
};

/// A piece of a VTK file.
struct VtkXmlPiece {
    /// Numbers of points and cells.
    std::uint64_t points = 0, cells = 0;
    /// Where it is in the file, for messages.
    std::string place;
    std::vector<VtkXmlArray> arrays;

    /// @return  nullptr if there is none; `name` "": any
    const VtkXmlArray* find(std::string_view parent, std::string_view name) const;
};

/// A VTK file in XML.
struct VtkXmlFile {
    std::vector<VtkXmlPiece> pieces;
    std::string_view appended; ///< behind the _
    bool appended_raw = false;
    bool big_endian = false;
    int header_bytes = 4; ///< of each size in front of binary data
    bool compressed = false;
};

/// Reads the elements; arrays stay as they are.
/// @param type  of the VTKFile, e.g. "UnstructuredGrid"
VtkXmlFile parse_vtk_xml(std::string_view bytes, std::string_view type, FileIssues& issues);

/// The numbers of an array: count of them, no more and no fewer.
std::vector<double> vtk_doubles(const VtkXmlFile& file, const VtkXmlArray& array,
                                std::uint64_t count, FileIssues& issues);
/// The same of an array of integers.
/// @throws InputError  also if the array's type is none of integers
std::vector<std::int64_t> vtk_integers(const VtkXmlFile& file, const VtkXmlArray& array,
                                       std::uint64_t count, FileIssues& issues);
/// True if the array's type is one of integers.
bool is_whole_number(const VtkXmlArray& array);

} // namespace amontons
