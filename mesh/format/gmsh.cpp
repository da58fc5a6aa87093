#include "mesh/format/gmsh.hpp"

#include "mesh/format/gmsh_input.hpp"

namespace amontons {
namespace {

// Number, dimension, nodes, corners, name. Of those without elements here the number of nodes is
// needed to pass over them.
constexpr std::pair<int, GmshKind> kKinds[] = {
    {1, {1, 2, 2, "line"}},
    {2, {2, 3, 3, "triangle"}},
    {3, {2, 4, 4, "quadrangle"}},
    {4, {3, 4, 4, "tetrahedron", static_cast<int>(ElementKind::T4)}},
    {5, {3, 8, 8, "hexahedron", static_cast<int>(ElementKind::H8)}},
    {6, {3, 6, 6, "prism"}},
    {7, {3, 5, 5, "pyramid"}},
    {8, {1, 3, 2, "line of 3 nodes"}},
    {9, {2, 6, 3, "triangle of 6 nodes"}},
    {10, {2, 9, 4, "quadrangle of 9 nodes"}},
    {11, {3, 10, 4, "tetrahedron of 10 nodes", static_cast<int>(ElementKind::T10)}},
    {12, {3, 27, 8, "hexahedron of 27 nodes"}},
    {13, {3, 18, 6, "prism of 18 nodes"}},
    {14, {3, 14, 5, "pyramid of 14 nodes"}},
    {15, {0, 1, 1, "point"}},
    {16, {2, 8, 4, "quadrangle of 8 nodes"}},
    {17, {3, 20, 8, "hexahedron of 20 nodes"}},
    {18, {3, 15, 6, "prism of 15 nodes"}},
    {19, {3, 13, 5, "pyramid of 13 nodes"}},
    {20, {2, 9, 3, "triangle of 9 nodes"}},
    {21, {2, 10, 3, "triangle of 10 nodes"}},
    {26, {1, 4, 2, "line of 4 nodes"}},
    {27, {1, 5, 2, "line of 5 nodes"}},
    {29, {3, 20, 4, "tetrahedron of 20 nodes"}},
    {30, {3, 35, 4, "tetrahedron of 35 nodes"}},
};

constexpr const char* kVersions = "version 2.2 or 4.1 (gmsh -save -format msh41 FILE converts)";

} // namespace

const GmshKind* gmsh_kind(std::int64_t type)
{
    for (const auto& [number, kind] : kKinds)
        if (number == type) return &kind;
    return nullptr;
}

int gmsh_type(ElementKind kind)
{
    return kind == ElementKind::T4 ? 4 : kind == ElementKind::T10 ? 11 : 5;
}

int gmsh_face_type(ElementKind kind)
{
    return kind == ElementKind::T4 ? 2 : kind == ElementKind::T10 ? 9 : 3;
}

std::size_t GmshCells::group(std::int64_t dimension, std::int64_t number)
{
    const auto at = names_.find({dimension, number});
    const bool named = at != names_.end() && !at->second.empty();
    return builder_.group(named ? at->second : std::to_string(number), static_cast<int>(dimension));
}

void GmshCells::add_known_(const GmshKind& kind, std::int64_t label, std::span<std::int64_t> nodes,
                           std::span<const std::size_t> groups)
{
    VolumeBuilder::Cell cell{};
    if (kind.dimension == 3) {
        swap_gmsh_order(nodes);
        cell = builder_.add_element(static_cast<ElementKind>(kind.ours), label, nodes);
    } else if (groups.empty()) {
        return; // of no use to a solid
    } else if (kind.dimension == 2) {
        cell = builder_.add_facet(label, nodes.first(static_cast<std::size_t>(kind.corners)));
    } else {
        cell = builder_.add_line_or_point(label, nodes);
    }
    for (const std::size_t g : groups)
        builder_.add_to_group(g, cell);
}

void GmshCells::finish(FileIssues& issues)
{
    for (const auto& [key, name] : names_)
        group(key.first, key.second);
    for (const auto& [type, found] : unsupported_)
        issues.add(found.second,
                   std::to_string(found.first) + " elements of type " + std::to_string(type) +
                       " (" + gmsh_kind(type)->name + ")",
                   "tetrahedra of 4 or 10 nodes (types 4, 11), hexahedra of 8 (type 5)");
}

std::string next_gmsh_section(GmshInput& in)
{
    const std::string_view word = in.text().word();
    if (word.empty()) return "";
    if (word[0] != '$' || word.size() == 1)
        in.issues().fatal(in.place(), quoted_text(word), "$ and the name of a section");
    std::string section(word.substr(1));
    if (const std::string_view rest = in.text().rest_of_line();
        rest.find_first_not_of(" \t\r") != std::string_view::npos)
        in.issues().fatal(in.place(), quoted_text(rest), "the end of the line after $" + section);
    in.begin_data();
    return section;
}

void end_gmsh_section(GmshInput& in, const std::string& section)
{
    in.end_data();
    const std::string_view word = in.text().word();
    if (word != "$End" + section)
        in.issues().fatal(in.place(), word.empty() ? "the end of the file" : quoted_text(word),
                          "$End" + section);
}

void skip_gmsh_section(GmshInput& in, const std::string& section, VolumeBuilder& builder)
{
    const std::string mark = "$End" + section;
    const std::size_t at = in.text().rest().find(mark);
    if (at == std::string_view::npos) in.issues().fatal(in.place(), "the end of the file", mark);
    in.text().skip(at + mark.size());
    builder.note("section $" + section + " is passed over");
}

void read_gmsh_names(GmshInput& in, GmshNames& names)
{
    NumberScanner& text = in.text(); // in every encoding
    const auto whole = [&](const char* what) {
        std::int64_t value = 0;
        if (!text.integer(value)) in.refuse(what);
        return value;
    };
    const std::int64_t count = whole("the number of names");
    for (std::int64_t i = 0; i < count; ++i) {
        const std::int64_t dimension = whole("the dimension of a group"),
                           number = whole("the number of a group");
        const std::string_view line = text.rest_of_line();
        const std::size_t open = line.find('"'), close = line.rfind('"');
        if (open == std::string_view::npos || open == close)
            in.issues().fatal(in.place(), quoted_text(line), "a name in quotes");
        if (dimension < 0 || dimension > 3)
            in.issues().fatal(in.place(), "dimension " + std::to_string(dimension), "0 to 3");
        names[{dimension, number}] = std::string(line.substr(open + 1, close - open - 1));
    }
    in.begin_data();
    const std::string_view word = text.word();
    if (word != "$EndPhysicalNames")
        in.issues().fatal(line_place(text.line()),
                          word.empty() ? "the end of the file" : quoted_text(word),
                          "$EndPhysicalNames");
}

VolumeFile parse_gmsh(std::string_view bytes, const std::string& file, double scale)
{
    FileIssues issues(file);
    VolumeBuilder builder(issues, scale);
    builder.set_element_words("tetrahedra or hexahedra (gmsh -3 makes them; with physical groups "
                              "only those in a group are saved)");
    GmshInput in(without_byte_order_mark(bytes), issues);
    NumberScanner& text = in.text();
    if (text.word() != "$MeshFormat")
        issues.fatal("line 1", quoted_text(text.refused()), "$MeshFormat");
    double version = 0;
    std::int64_t binary = 0, size_bytes = 0;
    if (!text.number(version)) in.refuse(kVersions);
    if (!text.integer(binary)) in.refuse("0 (ASCII) or 1 (binary)");
    if (!text.integer(size_bytes)) in.refuse("the bytes of a number, 8 or 4");
    const bool version_2 = version >= 2 && version < 3;
    if (!version_2 && version != 4.1)
        issues.fatal("line 2", "version " + number_text(version), kVersions);
    if (binary < 0 || binary > 1)
        issues.fatal("line 2", "file type " + std::to_string(binary), "0 (ASCII) or 1 (binary)");
    if (size_bytes != 8 && !(size_bytes == 4 && !version_2))
        issues.fatal("line 2", "data size " + std::to_string(size_bytes), "8 bytes");
    text.rest_of_line();
    if (binary == 1) {
        in.begin_data();
        in.set_binary(false, static_cast<int>(size_bytes));
        const std::int64_t one = in.integer();
        if (one == 16777216)
            in.set_binary(true, static_cast<int>(size_bytes));
        else if (one != 1)
            issues.fatal(in.place(), std::to_string(one), "1, in the byte order of the file");
    }
    end_gmsh_section(in, "MeshFormat");
    if (version_2)
        read_gmsh_2(in, builder);
    else
        read_gmsh_4(in, builder);
    return builder.finish();
}

} // namespace amontons
