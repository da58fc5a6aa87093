#include "mesh/format/abaqus.hpp"

#include <algorithm>
#include <set>

namespace amontons {
namespace {

constexpr std::size_t kNumbersInLine = 8;

/// Names for the sets of one type: letters, digits, _ - and ., beginning with a letter.
class Names {
public:
    Names(const char* kind, std::vector<std::string>* notes) : kind_(kind), notes_(notes) {}

    std::string name_for(const std::string& name)
    {
        std::string safe;
        for (const char c : name) {
            const bool fine = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                              (c >= '0' && c <= '9') || c == '_' || c == '-';
            safe += fine ? c : '_';
        }
        if (safe.empty() ||
            !((safe[0] >= 'a' && safe[0] <= 'z') || (safe[0] >= 'A' && safe[0] <= 'Z')))
            safe.insert(0, "set_");
        std::string unique = safe;
        for (int k = 2; !used_.insert(lower_case(unique)).second; ++k)
            unique = safe + "_" + std::to_string(k);
        if (notes_ && unique != name)
            notes_->push_back(std::string(kind_) + " " + quoted_text(name) + " is written as " +
                              quoted_text(unique));
        return unique;
    }

private:
    const char* kind_;
    std::vector<std::string>* notes_;
    std::set<std::string> used_;
};

void append_list(std::string& text, const std::vector<std::int32_t>& members)
{
    for (std::size_t i = 0; i < members.size(); ++i) {
        text += std::to_string(members[i] + 1);
        text += i % kNumbersInLine == kNumbersInLine - 1 || i + 1 == members.size() ? "\n" : ", ";
    }
}

/// The number of a local face: the inverse of the table of the reader.
int face_number(ElementKind kind, std::int32_t face)
{
    constexpr std::array<int, 4> tetra{2, 3, 4, 1};
    constexpr std::array<int, 6> hexa{6, 4, 3, 5, 1, 2};
    return kind == ElementKind::H8 ? hexa[static_cast<std::size_t>(face)]
                                   : tetra[static_cast<std::size_t>(face)];
}

} // namespace

std::string abaqus_text(const VolumeMesh& mesh, std::vector<std::string>* notes)
{
    std::string text = "*HEADING\nwritten by amontons\n*NODE\n";
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
        text += std::to_string(i + 1);
        for (int k = 0; k < 3; ++k) {
            text += ", ";
            append_number(text, mesh.nodes[i][k]);
        }
        text += '\n';
    }
    std::size_t label = 0;
    for (const ElementBlock& block : mesh.blocks) {
        text += "*ELEMENT, TYPE=C3D" + std::to_string(shape_of(block.kind).nodes) + "\n";
        for (std::size_t e = 0; e < block.size(); ++e) {
            text += std::to_string(++label);
            for (const std::int32_t n : block.element(e)) {
                text += ", ";
                text += std::to_string(n + 1);
            }
            text += '\n';
        }
    }
    Names node_names("node set", notes), element_names("element set", notes),
        face_names("face set", notes);
    for (const NodeSet& set : mesh.node_sets) {
        text.append("*NSET, NSET=").append(node_names.name_for(set.name)).append("\n");
        append_list(text, set.members);
    }
    for (const ElementSet& set : mesh.element_sets) {
        text.append("*ELSET, ELSET=").append(element_names.name_for(set.name)).append("\n");
        append_list(text, set.members);
    }
    for (const FaceSet& set : mesh.face_sets) {
        text.append("*SURFACE, TYPE=ELEMENT, NAME=")
            .append(face_names.name_for(set.name))
            .append("\n");
        for (const FaceRef& face : set.members) {
            const ElementKind kind = element_of(mesh, face.element).kind;
            text += std::to_string(face.element + 1);
            text.append(", S").append(std::to_string(face_number(kind, face.face))).append("\n");
        }
    }
    return text;
}

} // namespace amontons
