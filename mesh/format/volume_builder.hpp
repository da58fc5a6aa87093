#pragma once

#include "mesh/base/text.hpp"
#include "mesh/volume_mesh.hpp"

#include <map>
#include <optional>
#include <utility>

namespace amontons {

/// A mesh from a file, and what the reader passed over or changed: one sentence each.
struct VolumeFile {
    VolumeMesh mesh;
    /// Sentences for the user on what was passed over or changed.
    std::vector<std::string> notes;
    std::string cut; ///< a file whose last line has no end, perhaps not the whole; in `notes`, too
};

/// From a file's numbers to 0, 1, 2, ... A table where they are dense, else sorted pairs.
class LabelMap {
public:
    /// @param labels  of things 0, 1, 2, ...
    explicit LabelMap(std::span<const std::int64_t> labels);
    /// @return  -1 if no thing has this label
    std::int32_t find(std::int64_t label) const;
    /// The second of two things with the same label, or -1.
    std::int32_t duplicate() const { return duplicate_; }

private:
    std::int64_t first_ = 0;
    std::vector<std::int32_t> table_;
    std::vector<std::pair<std::int64_t, std::int32_t>> sorted_;
    std::int32_t duplicate_ = -1;
};

/// What readers of all formats share: nodes and cells as a file gives them, in any order and by
/// any numbers, become a VolumeMesh. Cells of two dimensions are faces of elements, found by
/// their corners; of cells of one or no dimension the nodes count.
class VolumeBuilder {
public:
    /// The number that a file gives to a node or an element.
    using Label = std::int64_t;

    /// @param scale  of coordinates [m per unit]
    VolumeBuilder(FileIssues& issues, double scale) : issues_(issues), scale_(scale) {}

    /// Reserves memory for n nodes.
    void reserve_nodes(std::size_t n);
    /// Adds a node at `scale` times x; x is in the unit of the file. A place that is not finite is
    /// an Issue.
    void add_node(Label label, const Vec3& x);
    /// Nodes so far.
    std::size_t node_count() const { return nodes_.size(); }

    /// A cell of the builder, to put it into groups.
    enum class Cell : std::int64_t {};
    /// @param nodes  labels in the order of VolumeMesh
    Cell add_element(ElementKind kind, Label label, std::span<const Label> nodes);
    /// @param corners  3 or 4, labels, in either direction
    Cell add_facet(Label label, std::span<const Label> corners);
    /// Adds a cell of dimension 0 or 1, which only its group uses.
    Cell add_line_or_point(Label label, std::span<const Label> nodes);

    /// A named group of cells; made if it is new. Its elements become an element set, its facets a
    /// face set, the nodes of its lines and points a node set. Without any cell it becomes an empty
    /// set of that dimension: 3 elements, 2 faces, 0 nodes.
    std::size_t group(const std::string& name, int dimension);
    /// Adds a cell to a group.
    void add_to_group(std::size_t group, Cell cell);
    /// Adds a cell to a group by its label.
    void add_label_to_group(std::size_t group, Label cell);

    /// Number of the node set of a name, created where it is new.
    std::size_t node_set(const std::string& name);
    /// Adds a node to a set by its label.
    void add_to_node_set(std::size_t set, Label node);
    /// Number of the face set of a name, created where it is new.
    std::size_t face_set(const std::string& name);
    /// Adds a face of an element to a set by its label.
    void add_to_face_set(std::size_t set, Label element, std::int32_t face);

    /// Elements with the same nodes in the same order become one element, which is in the groups of
    /// all of them.
    void merge_equal_elements() { merge_equal_ = true; }
    /// Adds a message for the user.
    void note(std::string text) { notes_.push_back(std::move(text)); }
    /// Records, for formats without an end mark, that the last line of a file has no line end.
    void note_cut(const std::string& file)
    {
        cut_ = file;
        note(file + ": the last line has no end: is the file whole?");
    }
    /// The label that the file gives to its first node and element; 1 by default.
    void set_first_label(Label first) { first_label_ = first; }
    /// Words for "allowed" if there is no element: what the format calls them.
    void set_element_words(std::string words) { element_words_ = std::move(words); }

    /// @throws InputError  with all issues, also those that were there before
    VolumeFile finish();

private:
    struct Cells {
        std::vector<Label> labels, nodes;
        std::vector<std::size_t> ends; // of lines and points only
    };
    struct Group {
        std::string name;
        int dimension = 3;
        std::vector<Cell> cells;
        std::vector<Label> labels;
    };
    struct Facet {
        std::array<std::int32_t, 4> corners{-1, -1, -1, -1}; // as given
        std::size_t set = 0;
    };

    static constexpr int kFacets = kElementKinds, kLines = kElementKinds + 1;
    Cell add_(int type, Label label, std::span<const Label> nodes);
    void resolve_labels_();
    void merge_();
    void build_elements_(VolumeMesh& mesh, const LabelMap& nodes);
    void build_sets_(VolumeMesh& mesh, const LabelMap& nodes);
    void match_facets_(VolumeMesh& mesh, const std::vector<Facet>& facets,
                       const std::vector<std::string>& names);
    std::int32_t known_node_(const LabelMap& nodes, Label node, const std::string& place);

    FileIssues& issues_;
    double scale_;
    std::vector<Vec3> nodes_;
    std::vector<Label> node_labels_;
    std::array<Cells, kElementKinds + 2> cells_;
    std::vector<Group> groups_;
    std::map<std::string, std::size_t> group_names_, node_set_names_, face_set_names_;
    std::vector<std::pair<std::string, std::vector<Label>>> node_sets_;
    std::vector<std::pair<std::string, std::vector<std::pair<Label, std::int32_t>>>> face_sets_;
    std::vector<std::string> notes_;
    std::string cut_;
    Label first_label_ = 1;
    bool merge_equal_ = false;
    std::string element_words_ = "elements T4, T10 or H8";
};

} // namespace amontons
