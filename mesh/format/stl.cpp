#include "mesh/format/stl.hpp"

#include "mesh/base/text.hpp"
#include "mesh/format/byte_order.hpp"
#include "mesh/format/polygon.hpp"
#include "mesh/orient_surface.hpp"
#include "mesh/weld.hpp"

#include <limits>

namespace amontons {
namespace {

constexpr std::size_t kHeader = 84;   // 80 bytes of any content, then the number of triangles
constexpr std::size_t kTriangle = 50; // normal, three corners (12 floats), 2 bytes of attributes
constexpr std::size_t kNormal = 12;

std::uint64_t binary_size(std::string_view bytes)
{
    return kHeader + std::uint64_t{kTriangle} * read_bytes<std::uint32_t>(&bytes[80], false);
}

void add_triangle(SurfaceMesh& mesh)
{
    const auto n = static_cast<std::int32_t>(mesh.points.size());
    mesh.triangles.push_back({n - 3, n - 2, n - 1});
}

void parse_binary(std::string_view bytes, double scale, SurfaceMesh& mesh, FileIssues& issues)
{
    const std::size_t count = (bytes.size() - kHeader) / kTriangle;
    if (count > std::numeric_limits<std::int32_t>::max() / 3)
        issues.fatal("", std::to_string(count) + " triangles", "at most 2^31 / 3");
    mesh.points.reserve(3 * count);
    mesh.triangles.reserve(count);
    for (std::size_t t = 0; t < count; ++t) {
        const std::size_t start = kHeader + t * kTriangle + kNormal;
        for (std::size_t corner = 0; corner < 3; ++corner) {
            Vec3 x;
            for (std::size_t i = 0; i < 3; ++i)
                x[static_cast<int>(i)] = static_cast<double>(
                    read_bytes<float>(&bytes[start + 12 * corner + 4 * i], false));
            Vec3 scaled = scale * x;
            if (!scaled.allFinite()) // the place costs time only where it is needed
                scaled = finite_point(x, scale,
                                      "triangle " + std::to_string(t) + " (byte " +
                                          std::to_string(start + 12 * corner) + ")",
                                      issues);
            mesh.points.push_back(scaled);
        }
        add_triangle(mesh);
    }
}

class AsciiReader {
public:
    AsciiReader(std::string_view text, double scale, SurfaceMesh& mesh, FileIssues& issues)
        : words_(text)
        , scale_(scale)
        , mesh_(mesh)
        , issues_(issues)
    {
    }

    void read()
    {
        for (;;) {
            const std::string_view word = words_.next();
            if (word.empty()) return;
            if (same_word(word, "solid") || same_word(word, "endsolid"))
                words_.rest_of_line(); // a name of any form
            else if (same_word(word, "facet"))
                facet();
            else
                unexpected(word, "\"facet\", \"solid\" or \"endsolid\"");
        }
    }

private:
    [[noreturn]] void unexpected(std::string_view word, const std::string& allowed)
    {
        issues_.fatal(line_place(words_.line()),
                      word.empty() ? "the end of the file" : quoted_text(word), allowed);
    }

    void expect(const char* allowed)
    {
        const std::string_view word = words_.next();
        if (!same_word(word, allowed)) unexpected(word, quoted_text(allowed));
    }

    void facet()
    {
        expect("normal");
        for (int i = 0; i < 3; ++i) // not used; "nan" is common for triangles without area
            if (words_.next().empty()) unexpected("", "a normal of 3 numbers");
        expect("outer");
        expect("loop");
        for (int corner = 0; corner < 3; ++corner) {
            expect("vertex");
            vertex();
        }
        expect("endloop");
        expect("endfacet");
        add_triangle(mesh_);
    }

    void vertex()
    {
        Vec3 x;
        for (int i = 0; i < 3; ++i) {
            const std::string_view word = words_.next();
            const std::optional<double> number = parse_double(word);
            if (!number) unexpected(word, "a number");
            x[i] = *number;
        }
        Vec3 scaled = scale_ * x;
        if (!scaled.allFinite())
            scaled = finite_point(x, scale_, line_place(words_.line()), issues_);
        mesh_.points.push_back(scaled);
    }

    WordReader words_;
    double scale_;
    SurfaceMesh& mesh_;
    FileIssues& issues_;
};

} // namespace

SurfaceMesh parse_stl(std::string_view bytes, const std::string& file, double scale)
{
    FileIssues issues(file);
    SurfaceMesh mesh;
    const std::string_view text = without_byte_order_mark(bytes);
    // Some programs begin binary files with "solid" too: text has no zeros.
    if (bytes.size() >= kHeader && binary_size(bytes) == bytes.size())
        parse_binary(bytes, scale, mesh, issues);
    else if (same_word(WordReader(text).next(), "solid") && text.find('\0') == text.npos)
        AsciiReader(text, scale, mesh, issues).read();
    else if (bytes.size() >= kHeader)
        issues.fatal("byte 80",
                     std::to_string((binary_size(bytes) - kHeader) / kTriangle) +
                         " triangles in the header, in a file of " + std::to_string(bytes.size()) +
                         " bytes",
                     "a file of " + std::to_string(binary_size(bytes)) +
                         " bytes, or ASCII that begins with \"solid\"");
    else
        issues.fatal("", std::to_string(bytes.size()) + " bytes",
                     "binary STL (84 bytes and more), or ASCII that begins with \"solid\"");
    refuse_empty(mesh, issues);
    issues.throw_if_any();
    weld(mesh);
    return mesh;
}

std::string stl_bytes(const SurfaceMesh& mesh)
{
    std::string bytes = "amontons"; // must not be "solid"
    bytes.resize(80, ' ');
    bytes.reserve(kHeader + kTriangle * mesh.triangles.size());
    append_bytes(bytes, static_cast<std::uint32_t>(mesh.triangles.size()), false);
    const auto append = [&](const Vec3& x) {
        for (int i = 0; i < 3; ++i)
            append_bytes(bytes, static_cast<float>(x[i]), false);
    };
    for (const auto& triangle : mesh.triangles) {
        append(unit_normal(mesh, triangle));
        for (const std::int32_t corner : triangle)
            append(mesh.points[static_cast<std::size_t>(corner)]);
        append_bytes(bytes, std::uint16_t{0}, false);
    }
    return bytes;
}

std::string stl_text(const SurfaceMesh& mesh)
{
    std::string text = "solid amontons\n";
    const auto append = [&](const char* words, const Vec3& x) {
        text += words;
        for (int i = 0; i < 3; ++i) {
            text += ' ';
            append_number(text, x[i]);
        }
        text += '\n';
    };
    for (const auto& triangle : mesh.triangles) {
        append("facet normal", unit_normal(mesh, triangle));
        text += "outer loop\n";
        for (const std::int32_t corner : triangle)
            append("vertex", mesh.points[static_cast<std::size_t>(corner)]);
        text += "endloop\nendfacet\n";
    }
    return text + "endsolid amontons\n";
}

} // namespace amontons
