#pragma once

#include "mesh/format/byte_order.hpp"
#include "mesh/format/number_scanner.hpp"
#include "mesh/format/volume_builder.hpp"

#include <limits>
#include <map>

// What the readers of Gmsh's two versions share: numbers in text or bytes, kinds of elements,
// physical groups.

namespace amontons {

/// The numbers of a .msh file, one after the other, whatever their encoding.
class GmshInput {
public:
    GmshInput(std::string_view bytes, FileIssues& issues)
        : text_(bytes)
        , all_(bytes)
        , issues_(issues)
    {
    }

    /// Reads binary numbers of this byte order and size from here on.
    void set_binary(bool big_endian, int size_bytes)
    {
        binary_ = true;
        big_endian_ = big_endian;
        size_bytes_ = size_bytes;
    }
    bool binary() const { return binary_; }

    /// Words and lines of what is text in every file: section marks, names, the header.
    NumberScanner& text() { return text_; }
    /// Binary data begins after the end of this line.
    void begin_data() { at_ = text_.offset(); }
    /// Text continues after the binary data. O(1): lines are not counted within bytes.
    void end_data()
    {
        if (binary_) text_.jump(at_);
    }

    std::int64_t integer() ///< an int
    {
        if (binary_) return take<std::int32_t>();
        std::int64_t value = 0;
        if (!text_.integer(value)) refuse("a whole number");
        return value;
    }
    std::int64_t size() ///< a size_t
    {
        if (!binary_) return integer();
        if (size_bytes_ == 4) return take<std::uint32_t>();
        return static_cast<std::int64_t>(take<std::uint64_t>());
    }
    /// Reads a real number.
    double real()
    {
        if (binary_) return take<double>();
        double value = 0;
        if (!text_.number(value)) refuse("a number");
        return value;
    }
    /// A count of things that take at least `least` numbers each; more than the file can hold is
    /// refused before anything is allocated.
    std::size_t count(std::int64_t value, const char* what, std::size_t least = 1)
    {
        const std::size_t room =
            binary_ ? (all_.size() - at_) / (4 * least) : text_.rest().size() / (2 * least) + 1;
        if (value < 0 || static_cast<std::uint64_t>(value) > room)
            issues_.fatal(place(), std::to_string(value) + " " + what,
                          "0 to " + std::to_string(room) + ", which the file can hold");
        return static_cast<std::size_t>(value);
    }

    /// Line or byte of the last thing read, for messages.
    std::string place() const
    {
        return binary_ ? "byte " + std::to_string(at_) : line_place(text_.line());
    }
    FileIssues& issues() { return issues_; }

    /// Throws an InputError with the place and what is allowed.
    [[noreturn]] void refuse(const char* allowed)
    {
        const std::string_view word = text_.refused();
        issues_.fatal(place(), word.empty() ? "the end of the file" : quoted_text(word), allowed);
    }

private:
    template <class T> T take()
    {
        if (all_.size() - at_ < sizeof(T))
            issues_.fatal(place(), "the end of the file", "a number");
        const T value = read_bytes<T>(all_.data() + at_, big_endian_);
        at_ += sizeof(T);
        return value;
    }

    NumberScanner text_;
    std::string_view all_;
    FileIssues& issues_;
    std::size_t at_ = 0; // of binary data
    bool binary_ = false, big_endian_ = false;
    int size_bytes_ = 8;
};

/// The number of a group without its sign, which reverses the orientation of an entity.
inline std::int64_t group_number(std::int64_t signed_number)
{
    return signed_number < 0 && signed_number != std::numeric_limits<std::int64_t>::min()
               ? -signed_number
               : signed_number;
}

/// One of Gmsh's kinds of elements.
struct GmshKind {
    /// Dimension of the cell; -1: unknown.
    int dimension = -1;
    /// Nodes and corners of the cell.
    int nodes = 0, corners = 0;
    const char* name = "";
    int ours = -1; ///< ElementKind, or -1
};

/// nullptr for a number that stands for no kind known here.
const GmshKind* gmsh_kind(std::int64_t type);

/// Gmsh's type number of an element.
int gmsh_type(ElementKind kind);
/// Gmsh's type number of the faces of an element.
int gmsh_face_type(ElementKind kind);
/// Gmsh's type number of a point.
constexpr int kGmshPoint = 15;

/// From Gmsh's order of nodes to that of VolumeMesh, and back: only a T10's last two differ.
template <class Node> void swap_gmsh_order(std::span<Node> nodes)
{
    if (nodes.size() == 10) std::swap(nodes[8], nodes[9]);
}

/// Names of physical groups, by dimension and number.
using GmshNames = std::map<std::pair<std::int64_t, std::int64_t>, std::string>;

/// Adds one cell to the builder and to its groups. Solids other than T4, T10 and H8 are counted in
/// `unsupported`.
class GmshCells {
public:
    GmshCells(VolumeBuilder& builder, const GmshNames& names) : builder_(builder), names_(names) {}
    /// Number of a physical group, created where it is new.
    std::size_t group(std::int64_t dimension, std::int64_t number);
    /// @param place  called only if it is needed
    template <class Place>
    void add(std::int64_t type, const GmshKind& kind, std::int64_t label,
             std::span<std::int64_t> nodes, std::span<const std::size_t> groups, Place place)
    {
        if (kind.dimension == 3 && kind.ours < 0) {
            auto& [count, first] = unsupported_[type];
            if (count++ == 0) first = place();
            return;
        }
        add_known_(kind, label, nodes, groups);
    }
    /// Makes the groups that have a name but no cell; adds issues for what is unsupported.
    void finish(FileIssues& issues);

private:
    void add_known_(const GmshKind& kind, std::int64_t label, std::span<std::int64_t> nodes,
                    std::span<const std::size_t> groups);

    VolumeBuilder& builder_;
    const GmshNames& names_;
    std::map<std::int64_t, std::pair<std::size_t, std::string>> unsupported_;
};

/// Reads the sections of MSH 2. @throws InputError
void read_gmsh_2(GmshInput& in, VolumeBuilder& builder);
/// Reads the sections of MSH 4. @throws InputError
void read_gmsh_4(GmshInput& in, VolumeBuilder& builder);

/// Parses $PhysicalNames up to its end mark.
void read_gmsh_names(GmshInput& in, GmshNames& names);

/// The mark of the next section without its $, "" at the end; blanks between sections are passed.
std::string next_gmsh_section(GmshInput& in);

/// Expects $End... of a section.
void end_gmsh_section(GmshInput& in, const std::string& section);

/// Passes over a section whose content is not needed.
void skip_gmsh_section(GmshInput& in, const std::string& section, VolumeBuilder& builder);

} // namespace amontons
