#include "mesh/format/vtu.hpp"

#include "mesh/format/vtk_xml.hpp"

#include <algorithm>

namespace amontons {
namespace {

struct CellType {
    int number;
    int dimension;
    int nodes;   // 0: any number
    int corners; // of faces
    int ours = -1;
    const char* name = "";
};

constexpr CellType kVtuTypes[] = {
    {1, 0, 1, 0, -1, "vertex"},
    {2, 0, 0, 0, -1, "poly vertex"},
    {3, 1, 2, 0, -1, "line"},
    {4, 1, 0, 0, -1, "polyline"},
    {5, 2, 3, 3, -1, "triangle"},
    {9, 2, 4, 4, -1, "quad"},
    {10, 3, 4, 0, static_cast<int>(ElementKind::T4), "tetra"},
    {11, 3, 8, 0, static_cast<int>(ElementKind::H8), "voxel"},
    {12, 3, 8, 0, static_cast<int>(ElementKind::H8), "hexahedron"},
    {13, 3, 6, 0, -1, "wedge"},
    {14, 3, 5, 0, -1, "pyramid"},
    {21, 1, 3, 0, -1, "quadratic edge"},
    {22, 2, 6, 3, -1, "quadratic triangle"},
    {23, 2, 8, 4, -1, "quadratic quad"},
    {24, 3, 10, 0, static_cast<int>(ElementKind::T10), "quadratic tetra"},
    {25, 3, 20, 0, -1, "quadratic hexahedron"},
    {26, 3, 15, 0, -1, "quadratic wedge"},
    {27, 3, 13, 0, -1, "quadratic pyramid"},
    {28, 2, 9, 4, -1, "biquadratic quad"},
    {29, 3, 27, 0, -1, "triquadratic hexahedron"},
    {42, 3, 0, 0, -1, "polyhedron"},
    {71, 3, 0, 0, -1, "Lagrange tetrahedron"},
    {72, 3, 0, 0, -1, "Lagrange hexahedron"},
};

const CellType* cell_type(std::int64_t number)
{
    for (const CellType& t : kVtuTypes)
        if (t.number == number) return &t;
    return nullptr;
}

constexpr const char* kRegionArrays[] = {"gmsh:physical", "medit:ref", "ElementBlockIds",
                                         "MaterialIDs", "CellEntityIds"};

class VtuReader {
public:
    VtuReader(const VtkXmlFile& file, FileIssues& issues, VolumeBuilder& builder)
        : file_(file)
        , issues_(issues)
        , builder_(builder)
    {
    }

    void read()
    {
        if (file_.pieces.empty()) issues_.fatal("", "no piece", "a Piece with Points and Cells");
        for (const VtkXmlPiece& piece : file_.pieces)
            read_piece(piece);
        for (const auto& [type, found] : unsupported_)
            issues_.add(
                "cell " + std::to_string(found.second),
                std::to_string(found.first) + " cells of type " + std::to_string(type) +
                    (cell_type(type) ? " (" + std::string(cell_type(type)->name) + ")" : ""),
                "tetra (10, 24), hexahedron (12) or voxel (11)");
    }

private:
    const VtkXmlArray& needed(const VtkXmlPiece& piece, const char* parent, const char* name)
    {
        const VtkXmlArray* const array = piece.find(parent, name);
        if (!array)
            issues_.fatal(piece.place,
                          "a piece without the array " + std::string(*name ? name : parent),
                          "Points; Cells with connectivity, offsets and types");
        return *array;
    }

    void read_piece(const VtkXmlPiece& piece)
    {
        constexpr std::uint64_t kMost = std::uint64_t{1} << 40;
        if (piece.points > kMost || piece.cells > kMost)
            issues_.fatal(piece.place,
                          std::to_string(std::max(piece.points, piece.cells)) + " points or cells",
                          "fewer");
        if (piece.points == 0 && piece.cells == 0) return; // of a part without anything
        const VtkXmlArray& points = needed(piece, "Points", "");
        if (points.components != 3)
            issues_.fatal(points.place, std::to_string(points.components) + " coordinates", "3");
        const std::vector<double> x = vtk_doubles(file_, points, 3 * piece.points, issues_);
        const auto first = static_cast<std::int64_t>(builder_.node_count());
        builder_.reserve_nodes(builder_.node_count() + static_cast<std::size_t>(piece.points));
        for (std::size_t i = 0; i < static_cast<std::size_t>(piece.points); ++i)
            builder_.add_node(first + static_cast<std::int64_t>(i),
                              {x[3 * i], x[3 * i + 1], x[3 * i + 2]});
        read_node_sets(piece, first);
        read_cells(piece, first);
    }

    void read_node_sets(const VtkXmlPiece& piece, std::int64_t first)
    {
        for (const VtkXmlArray& array : piece.arrays) {
            if (array.parent != "PointData" || !array.name.starts_with(kVtuNodeSet)) continue;
            const std::size_t set =
                builder_.node_set(array.name.substr(std::string_view(kVtuNodeSet).size()));
            const auto in = vtk_integers(file_, array, array.components * piece.points, issues_);
            for (std::size_t i = 0; i < static_cast<std::size_t>(piece.points); ++i)
                if (in[i * static_cast<std::size_t>(array.components)] != 0)
                    builder_.add_to_node_set(set, first + static_cast<std::int64_t>(i));
        }
    }

    void read_cells(const VtkXmlPiece& piece, std::int64_t first)
    {
        const auto types =
                       vtk_integers(file_, needed(piece, "Cells", "types"), piece.cells, issues_),
                   ends =
                       vtk_integers(file_, needed(piece, "Cells", "offsets"), piece.cells, issues_);
        std::int64_t last = 0;
        for (const std::int64_t end : ends) {
            if (end < last)
                issues_.fatal(piece.place, "offsets that decrease", "ascending offsets");
            last = end;
        }
        auto nodes = vtk_integers(file_, needed(piece, "Cells", "connectivity"),
                                  static_cast<std::uint64_t>(last), issues_);
        for (std::int64_t& n : nodes) { // a piece counts its own points
            if (n < 0 || n >= static_cast<std::int64_t>(piece.points)) {
                issues_.add(piece.place, "a cell with point " + std::to_string(n),
                            "a point of the piece, 0 to " +
                                std::to_string(static_cast<std::int64_t>(piece.points) - 1));
                n = 0;
            }
            n += first;
        }

        std::vector<VolumeBuilder::Cell> cells(types.size());
        std::vector<int> dimensions(types.size(), -1);
        std::size_t begin = 0;
        for (std::size_t c = 0; c < types.size(); ++c, ++cell_) {
            const auto end = static_cast<std::size_t>(ends[c]);
            const auto of = std::span(nodes).subspan(begin, end - begin);
            begin = end;
            add_cell(types[c], of, cells[c], dimensions[c]);
        }
        read_cell_sets(piece, cells, dimensions);
    }

    void add_cell(std::int64_t number, std::span<std::int64_t> nodes, VolumeBuilder::Cell& cell,
                  int& dimension)
    {
        const CellType* const type = cell_type(number);
        if (!type || (type->dimension == 3 && type->ours < 0)) {
            auto& [count, first] = unsupported_[number];
            if (count++ == 0) first = cell_;
            return;
        }
        if (type->nodes > 0 && nodes.size() != static_cast<std::size_t>(type->nodes)) {
            issues_.add("cell " + std::to_string(cell_),
                        std::to_string(nodes.size()) + " nodes of a " + type->name,
                        std::to_string(type->nodes) + " nodes");
            return;
        }
        dimension = type->dimension;
        if (dimension == 3) {
            if (number == 11) { // a voxel counts along x, then y
                std::swap(nodes[2], nodes[3]);
                std::swap(nodes[6], nodes[7]);
            }
            cell = builder_.add_element(static_cast<ElementKind>(type->ours), cell_, nodes);
        } else if (dimension == 2) {
            cell = builder_.add_facet(cell_, nodes.first(static_cast<std::size_t>(type->corners)));
        } else {
            cell = builder_.add_line_or_point(cell_, nodes);
        }
    }

    void read_cell_sets(const VtkXmlPiece& piece, const std::vector<VolumeBuilder::Cell>& cells,
                        const std::vector<int>& dimensions)
    {
        const auto values_of = [&](const VtkXmlArray& array) {
            auto all = vtk_integers(file_, array, array.components * piece.cells, issues_);
            for (std::size_t c = 0; c < cells.size(); ++c)
                all[c] = all[c * static_cast<std::size_t>(array.components)];
            return all;
        };
        bool own = false;
        for (const VtkXmlArray& array : piece.arrays) {
            const bool elements = array.name.starts_with(kVtuElementSet),
                       faces = array.name.starts_with(kVtuFaceSet);
            if (array.parent != "CellData" || (!elements && !faces)) continue;
            own = true;
            const std::size_t group =
                builder_.group(array.name.substr(array.name.find(':') + 1), elements ? 3 : 2);
            // Also the empty set keeps its type when another has its name.
            if (faces) builder_.face_set(array.name.substr(array.name.find(':') + 1));
            const auto in = values_of(array);
            for (std::size_t c = 0; c < cells.size(); ++c)
                if (in[c] != 0 && dimensions[c] == (elements ? 3 : 2))
                    builder_.add_to_group(group, cells[c]);
        }
        if (own) return;
        for (const char* const name : kRegionArrays) {
            const VtkXmlArray* const array = piece.find("CellData", name);
            if (!array || !is_whole_number(*array)) continue;
            const auto region = values_of(*array);
            for (std::size_t c = 0; c < cells.size(); ++c)
                if (region[c] != 0 && dimensions[c] >= 0)
                    builder_.add_to_group(builder_.group(std::to_string(region[c]), dimensions[c]),
                                          cells[c]);
            return;
        }
    }

    const VtkXmlFile& file_;
    FileIssues& issues_;
    VolumeBuilder& builder_;
    std::int64_t cell_ = 0; // through all pieces
    std::map<std::int64_t, std::pair<std::size_t, std::int64_t>> unsupported_;
};

} // namespace

std::uint8_t vtk_type(ElementKind kind)
{
    return kind == ElementKind::T4 ? 10 : kind == ElementKind::T10 ? 24 : 12;
}

std::uint8_t vtk_face_type(ElementKind kind)
{
    return kind == ElementKind::T4 ? 5 : kind == ElementKind::T10 ? 22 : 9;
}

VolumeFile parse_vtu(std::string_view bytes, const std::string& file, double scale)
{
    FileIssues issues(file);
    VolumeBuilder builder(issues, scale);
    builder.set_first_label(0);
    builder.set_element_words("cells of type tetra (10, 24) or hexahedron (12)");
    const VtkXmlFile xml = parse_vtk_xml(bytes, "UnstructuredGrid", issues);
    VtuReader(xml, issues, builder).read();
    return builder.finish();
}

} // namespace amontons
