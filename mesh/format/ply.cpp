#include "mesh/format/ply.hpp"

#include "mesh/base/text.hpp"
#include "mesh/format/byte_order.hpp"
#include "mesh/format/polygon.hpp"

#include <cmath>
#include <limits>

namespace amontons {
namespace {

enum class Type { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

struct TypeName {
    const char* name;
    Type type;
};
constexpr TypeName kPlyTypes[] = {
    {"char", Type::int8},      {"uchar", Type::uint8},    {"short", Type::int16},
    {"ushort", Type::uint16},  {"int", Type::int32},      {"uint", Type::uint32},
    {"float", Type::float32},  {"double", Type::float64}, {"int8", Type::int8},
    {"uint8", Type::uint8},    {"int16", Type::int16},    {"uint16", Type::uint16},
    {"int32", Type::int32},    {"uint32", Type::uint32},  {"float32", Type::float32},
    {"float64", Type::float64}};

std::size_t size_of(Type type)
{
    switch (type) {
    case Type::int8:
    case Type::uint8:
        return 1;
    case Type::int16:
    case Type::uint16:
        return 2;
    case Type::int32:
    case Type::uint32:
    case Type::float32:
        return 4;
    case Type::float64:
        return 8;
    }
    return 8;
}

struct Property {
    std::string name;
    Type type = Type::float64; ///< of the value, or of a list's values
    bool list = false;
    Type count_type = Type::uint8; ///< of a list's length
};

struct Element {
    std::string name;
    std::uint64_t count = 0;
    std::vector<Property> properties;
};

struct Header {
    PlyEncoding encoding = PlyEncoding::ascii;
    std::vector<Element> elements;
};

// ---- header ------------------------------------------------------------------------------

Type parse_type(std::string_view word, std::size_t line, FileIssues& issues)
{
    std::string names;
    for (const TypeName& t : kPlyTypes) {
        if (word == t.name) return t.type;
        names.append(names.empty() ? "" : " ").append(t.name);
    }
    issues.fatal(line_place(line), "type " + quoted_text(word), "one of " + names);
}

PlyEncoding parse_encoding(std::string_view word, std::size_t line, FileIssues& issues)
{
    if (word == "ascii") return PlyEncoding::ascii;
    if (word == "binary_little_endian") return PlyEncoding::little_endian;
    if (word == "binary_big_endian") return PlyEncoding::big_endian;
    issues.fatal(line_place(line), "format " + quoted_text(word),
                 "ascii, binary_little_endian or binary_big_endian");
}

Property parse_property(WordReader& words, FileIssues& issues)
{
    Property property;
    std::string_view word = words.next_in_line();
    property.list = word == "list";
    if (property.list) {
        property.count_type = parse_type(words.next_in_line(), words.line(), issues);
        if (property.count_type == Type::float32 || property.count_type == Type::float64)
            issues.fatal(line_place(words.line()), "a list whose length is no whole number",
                         "a whole-number type, such as uchar");
        word = words.next_in_line();
    }
    property.type = parse_type(word, words.line(), issues);
    property.name = words.next_in_line();
    if (property.name.empty())
        issues.fatal(line_place(words.line()), "a property without name", "property TYPE NAME");
    return property;
}

Element parse_element(WordReader& words, FileIssues& issues)
{
    Element element;
    element.name = words.next_in_line();
    const std::string_view word = words.next_in_line();
    const auto count = parse_integer(word);
    if (!count || *count < 0)
        issues.fatal(line_place(words.line()),
                     "element " + quoted_text(element.name) + " with count " + quoted_text(word),
                     "a whole number >= 0");
    element.count = static_cast<std::uint64_t>(*count);
    return element;
}

/// Reads up to and with the line "end_header"; the words then stand at the data.
Header parse_header(WordReader& words, FileIssues& issues)
{
    const std::string_view magic = words.next_in_line();
    if (magic != "ply") issues.fatal("line 1", quoted_text(magic), "\"ply\"");
    words.rest_of_line();
    Header header;
    bool has_format = false;
    for (;;) {
        if (words.at_end())
            issues.fatal(line_place(words.line()), "the end of the file", "\"end_header\"");
        const std::string_view word = words.next_in_line();
        const std::size_t line = words.line();
        if (word == "format") {
            header.encoding = parse_encoding(words.next_in_line(), line, issues);
            has_format = true;
        } else if (word == "element") {
            header.elements.push_back(parse_element(words, issues));
        } else if (word == "property") {
            if (header.elements.empty())
                issues.fatal(line_place(line), "a property of no element", "\"element\" before it");
            header.elements.back().properties.push_back(parse_property(words, issues));
        } else if (word != "comment" && word != "obj_info" && word != "end_header" &&
                   !word.empty()) {
            issues.fatal(line_place(line), quoted_text(word),
                         "format, element, property, comment, obj_info or end_header");
        }
        words.rest_of_line();
        if (word == "end_header") break;
    }
    if (!has_format)
        issues.fatal("", "a header without format", "\"format ascii 1.0\" or a binary format");
    return header;
}

// ---- data --------------------------------------------------------------------------------

/// The numbers behind the header, one after the other, whatever their encoding.
class NumberReader {
public:
    NumberReader(WordReader words, std::size_t header_bytes, PlyEncoding encoding,
                 FileIssues& issues)
        : words_(words)
        , bytes_(words.rest())
        , offset_(header_bytes)
        , encoding_(encoding)
        , issues_(issues)
    {
    }

    /// The least room that a value takes: a word and a blank, or its bytes.
    std::uint64_t smallest(Type type) const { return ascii() ? 2 : size_of(type); }

    /// The room that is left; the last word needs no blank.
    std::uint64_t left() const { return ascii() ? words_.rest().size() + 1 : bytes_.size(); }

    std::string place() const
    {
        return ascii() ? line_place(words_.line()) : "byte " + std::to_string(offset_);
    }

    double read(Type type)
    {
        if (ascii()) {
            const std::string_view word = words_.next();
            const auto number = parse_double(word);
            if (!number)
                issues_.fatal(place(), word.empty() ? "the end of the file" : quoted_text(word),
                              "a number");
            return *number;
        }
        const std::size_t size = size_of(type);
        if (bytes_.size() < size) issues_.fatal(place(), "the end of the file", "a number");
        const double value = binary(type);
        bytes_.remove_prefix(size);
        offset_ += size;
        return value;
    }

    /// The length of a list, which the rest of the file can hold.
    std::size_t read_length(const Property& list)
    {
        const std::string where = ascii() ? "" : place();
        const double length = read(list.count_type);
        const auto room = static_cast<double>(left() / smallest(list.type));
        if (!(length >= 0) || length > room || length != std::floor(length))
            issues_.fatal(ascii() ? place() : where, "a list of length " + number_text(length),
                          "a whole number >= 0 that the rest of the file can hold");
        return static_cast<std::size_t>(length);
    }

    void refuse_rest()
    {
        if (ascii()) {
            const std::string_view word = words_.next();
            if (!word.empty())
                issues_.add(place(), quoted_text(word) + " after the last element",
                            "the end of the file");
        } else if (!WordReader(bytes_).next().empty()) { // a line end is often left
            issues_.add(place(), std::to_string(bytes_.size()) + " bytes after the last element",
                        "the end of the file");
        }
    }

private:
    bool ascii() const { return encoding_ == PlyEncoding::ascii; }

    double binary(Type type) const
    {
        const bool big = encoding_ == PlyEncoding::big_endian;
        const char* const at = bytes_.data();
        switch (type) {
        case Type::int8:
            return read_bytes<std::int8_t>(at, big);
        case Type::uint8:
            return read_bytes<std::uint8_t>(at, big);
        case Type::int16:
            return read_bytes<std::int16_t>(at, big);
        case Type::uint16:
            return read_bytes<std::uint16_t>(at, big);
        case Type::int32:
            return read_bytes<std::int32_t>(at, big);
        case Type::uint32:
            return read_bytes<std::uint32_t>(at, big);
        case Type::float32:
            return static_cast<double>(read_bytes<float>(at, big));
        case Type::float64:
            return read_bytes<double>(at, big);
        }
        return 0;
    }

    WordReader words_;       // of ASCII
    std::string_view bytes_; // of binary
    std::size_t offset_;     // of bytes_ in the file
    PlyEncoding encoding_;
    FileIssues& issues_;
};

/// Refuses a count that the file cannot hold, before anything of that size is allocated.
void check_count(const Element& element, const NumberReader& numbers, FileIssues& issues)
{
    std::uint64_t smallest = 0;
    for (const Property& p : element.properties)
        smallest += numbers.smallest(p.list ? p.count_type : p.type);
    if (smallest > 0 && element.count > numbers.left() / smallest)
        issues.fatal(numbers.place(),
                     std::to_string(element.count) + " of element " + quoted_text(element.name) +
                         " in the header",
                     "at most " + std::to_string(numbers.left() / smallest) +
                         ", which the file can hold");
}

int coordinate_of(const Property& property)
{
    const bool named = property.name == "x" || property.name == "y" || property.name == "z";
    return named && !property.list ? property.name[0] - 'x' : -1;
}

bool is_corner_list(const Property& property)
{
    return property.list && (property.name == "vertex_indices" || property.name == "vertex_index");
}

void pass_over(const Property& property, NumberReader& numbers)
{
    for (std::size_t n = property.list ? numbers.read_length(property) : 1; n > 0; --n)
        numbers.read(property.type);
}

void read_vertices(const Element& element, double scale, NumberReader& numbers, SurfaceMesh& mesh,
                   FileIssues& issues)
{
    int found = 0;
    for (const Property& p : element.properties)
        if (const int i = coordinate_of(p); i >= 0) found |= 1 << i;
    if (found != 7)
        issues.fatal("header", "element \"vertex\" without x, y and z", "properties x, y, z");
    if (element.count > std::numeric_limits<std::int32_t>::max())
        issues.fatal("header", std::to_string(element.count) + " vertices", "at most 2^31 - 1");
    mesh.points.reserve(mesh.points.size() + element.count);
    for (std::uint64_t v = 0; v < element.count; ++v) {
        Vec3 x = Vec3::Zero();
        for (const Property& p : element.properties) {
            if (const int i = coordinate_of(p); i >= 0)
                x[i] = numbers.read(p.type);
            else
                pass_over(p, numbers);
        }
        Vec3 scaled = scale * x;
        if (!scaled.allFinite())
            scaled = finite_point(x, scale, "vertex " + std::to_string(v), issues);
        mesh.points.push_back(scaled);
    }
}

void read_faces(const Element& element, NumberReader& numbers, PolygonList& faces,
                FileIssues& issues)
{
    faces.ends.reserve(element.count);
    faces.places.reserve(element.count);
    for (std::uint64_t f = 0; f < element.count; ++f) {
        bool has_corners = false;
        for (const Property& p : element.properties) {
            if (has_corners || !is_corner_list(p)) {
                pass_over(p, numbers);
                continue;
            }
            has_corners = true;
            for (std::size_t n = numbers.read_length(p); n > 0; --n) {
                const double corner = numbers.read(p.type);
                const bool whole = std::abs(corner) <= 4294967296.0 && corner == std::floor(corner);
                if (!whole)
                    issues.fatal(numbers.place(), "vertex " + number_text(corner),
                                 "a whole number");
                faces.corners.push_back(static_cast<std::int64_t>(corner));
            }
        }
        faces.ends.push_back(faces.corners.size());
        faces.places.push_back(f);
    }
}

void pass_over(const Element& element, NumberReader& numbers)
{
    if (element.properties.empty()) return; // whatever its count: it takes no room
    for (std::uint64_t i = 0; i < element.count; ++i)
        for (const Property& p : element.properties)
            pass_over(p, numbers);
}

bool has_corner_list(const Element& element)
{
    return std::any_of(element.properties.begin(), element.properties.end(), is_corner_list);
}

} // namespace

SurfaceMesh parse_ply(std::string_view bytes, const std::string& file, double scale)
{
    FileIssues issues(file);
    WordReader words(bytes);
    const Header header = parse_header(words, issues);
    NumberReader numbers(words, bytes.size() - words.rest().size(), header.encoding, issues);
    SurfaceMesh mesh;
    PolygonList faces;
    bool has_vertices = false, has_faces = false;
    for (const Element& element : header.elements) {
        check_count(element, numbers, issues);
        if (element.name == "vertex" && !has_vertices) {
            has_vertices = true;
            read_vertices(element, scale, numbers, mesh, issues);
        } else if (element.name == "face" && !has_faces && has_corner_list(element)) {
            has_faces = true;
            read_faces(element, numbers, faces, issues);
        } else {
            pass_over(element, numbers);
        }
    }
    if (!has_vertices || !has_faces)
        issues.fatal("header", has_vertices ? "no faces" : "no vertices",
                     "elements \"vertex\" with x, y, z and \"face\" with the list vertex_indices");
    numbers.refuse_rest();
    append_faces(mesh, faces, {"face", 0}, issues);
    refuse_empty(mesh, issues);
    issues.throw_if_any();
    return mesh;
}

std::string ply_bytes(const SurfaceMesh& mesh, PlyEncoding encoding)
{
    const char* const format = encoding == PlyEncoding::ascii           ? "ascii"
                               : encoding == PlyEncoding::little_endian ? "binary_little_endian"
                                                                        : "binary_big_endian";
    std::string bytes = std::string("ply\nformat ") + format + " 1.0\nelement vertex " +
                        std::to_string(mesh.points.size()) +
                        "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
                        std::to_string(mesh.triangles.size()) +
                        "\nproperty list uchar int vertex_indices\nend_header\n";
    const bool big = encoding == PlyEncoding::big_endian;
    const bool ascii = encoding == PlyEncoding::ascii;
    for (const Vec3& x : mesh.points) {
        for (int i = 0; i < 3; ++i) {
            if (ascii) {
                append_number(bytes, x[i]);
                bytes += i < 2 ? ' ' : '\n';
            } else {
                append_bytes(bytes, x[i], big);
            }
        }
    }
    for (const auto& triangle : mesh.triangles) {
        if (ascii)
            bytes += '3';
        else
            append_bytes(bytes, std::uint8_t{3}, big);
        for (const std::int32_t corner : triangle) {
            if (ascii)
                bytes.append(" ").append(std::to_string(corner));
            else
                append_bytes(bytes, corner, big);
        }
        if (ascii) bytes += '\n';
    }
    return bytes;
}

} // namespace amontons
