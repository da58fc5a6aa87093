#include "mesh/format/volume_builder.hpp"

#include "mesh/neighbours.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

namespace amontons {
namespace {

using Cell = VolumeBuilder::Cell;

constexpr int kIndexBits = 40; // of a Cell: its type above, its index below

int type_of(Cell cell)
{
    return static_cast<int>(static_cast<std::int64_t>(cell) >> kIndexBits);
}

std::size_t index_of(Cell cell)
{
    return static_cast<std::size_t>(static_cast<std::int64_t>(cell) &
                                    ((std::int64_t{1} << kIndexBits) - 1));
}

Cell cell_of(int type, std::size_t index)
{
    return static_cast<Cell>(std::int64_t{type} << kIndexBits | static_cast<std::int64_t>(index));
}

template <class T> void sort_once(std::vector<T>& values)
{
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
}

/// The set of a name; made at the end if it is new.
template <class Member>
std::vector<Member>& members_of(std::vector<NamedSet<Member>>& sets,
                                std::map<std::string, std::size_t>& names, const std::string& name)
{
    const auto [at, fresh] = names.try_emplace(name, sets.size());
    if (fresh) sets.push_back({name, {}});
    return sets[at->second].members;
}

/// Labels that only count on are not kept.
std::vector<std::int64_t> kept(std::vector<std::int64_t> labels, std::int64_t first)
{
    for (std::size_t i = 0; i < labels.size(); ++i)
        if (labels[i] != first + static_cast<std::int64_t>(i)) return labels;
    return {};
}

std::array<std::int32_t, 4> sorted_corners(std::array<std::int32_t, 4> c)
{
    sort_few(std::span(c).first(c[3] < 0 ? 3 : 4));
    return c;
}

/// True if the corners are run through in the order of the face.
bool same_direction(const std::array<std::int32_t, 4>& corners, const FaceNodes& face)
{
    const auto n = static_cast<std::size_t>(face.corners);
    const auto at = std::find(face.node.begin(), face.node.begin() + face.corners, corners[0]);
    return face.node[(static_cast<std::size_t>(at - face.node.begin()) + 1) % n] == corners[1];
}

} // namespace

// ---- labels ------------------------------------------------------------------------------

LabelMap::LabelMap(std::span<const std::int64_t> labels)
{
    if (labels.empty()) return;
    const auto [low, high] = std::minmax_element(labels.begin(), labels.end());
    first_ = *low;
    const auto range = static_cast<std::uint64_t>(*high) - static_cast<std::uint64_t>(*low);
    if (range < 4 * static_cast<std::uint64_t>(labels.size()) + 1024) {
        table_.assign(range + 1, -1);
        for (std::size_t i = 0; i < labels.size(); ++i) {
            std::int32_t& slot = table_[static_cast<std::size_t>(labels[i] - first_)];
            if (slot >= 0 && duplicate_ < 0) duplicate_ = static_cast<std::int32_t>(i);
            slot = static_cast<std::int32_t>(i);
        }
        return;
    }
    sorted_.reserve(labels.size());
    for (std::size_t i = 0; i < labels.size(); ++i)
        sorted_.emplace_back(labels[i], static_cast<std::int32_t>(i));
    std::sort(sorted_.begin(), sorted_.end());
    for (std::size_t i = 1; i < sorted_.size() && duplicate_ < 0; ++i)
        if (sorted_[i].first == sorted_[i - 1].first) duplicate_ = sorted_[i].second;
}

std::int32_t LabelMap::find(std::int64_t label) const
{
    if (!table_.empty()) {
        const auto slot = static_cast<std::uint64_t>(label) - static_cast<std::uint64_t>(first_);
        return slot < table_.size() ? table_[slot] : -1;
    }
    const auto at =
        std::lower_bound(sorted_.begin(), sorted_.end(), std::pair{label, std::int32_t{-1}});
    return at != sorted_.end() && at->first == label ? at->second : -1;
}

// ---- collecting --------------------------------------------------------------------------

void VolumeBuilder::reserve_nodes(std::size_t n)
{
    nodes_.reserve(n);
    node_labels_.reserve(n);
}

void VolumeBuilder::add_node(Label label, const Vec3& x)
{
    const Vec3 scaled = scale_ * x;
    if (!scaled.allFinite())
        issues_.add("node " + std::to_string(label),
                    "coordinates " + number_text(x[0]) + " " + number_text(x[1]) + " " +
                        number_text(x[2]) + (scale_ == 1 ? "" : " times " + number_text(scale_)),
                    "finite numbers");
    nodes_.push_back(scaled);
    node_labels_.push_back(label);
}

Cell VolumeBuilder::add_(int type, Label label, std::span<const Label> nodes)
{
    Cells& cells = cells_[static_cast<std::size_t>(type)];
    cells.labels.push_back(label);
    cells.nodes.insert(cells.nodes.end(), nodes.begin(), nodes.end());
    return cell_of(type, cells.labels.size() - 1);
}

Cell VolumeBuilder::add_element(ElementKind kind, Label label, std::span<const Label> nodes)
{
    return add_(static_cast<int>(kind), label, nodes);
}

Cell VolumeBuilder::add_facet(Label label, std::span<const Label> corners)
{
    // The fourth of a triangle is the first again, which no quadrilateral has.
    const std::array<Label, 4> four{corners[0], corners[1], corners[2],
                                    corners.size() > 3 ? corners[3] : corners[0]};
    return add_(kFacets, label, four);
}

Cell VolumeBuilder::add_line_or_point(Label label, std::span<const Label> nodes)
{
    const Cell cell = add_(kLines, label, nodes);
    cells_[kLines].ends.push_back(cells_[kLines].nodes.size());
    return cell;
}

std::size_t VolumeBuilder::group(const std::string& name, int dimension)
{
    const auto [at, fresh] = group_names_.try_emplace(name, groups_.size());
    if (fresh) groups_.push_back({name, dimension, {}, {}});
    return at->second;
}

void VolumeBuilder::add_to_group(std::size_t group, Cell cell)
{
    groups_[group].cells.push_back(cell);
}

void VolumeBuilder::add_label_to_group(std::size_t group, Label cell)
{
    groups_[group].labels.push_back(cell);
}

std::size_t VolumeBuilder::node_set(const std::string& name)
{
    const auto [at, fresh] = node_set_names_.try_emplace(name, node_sets_.size());
    if (fresh) node_sets_.emplace_back(name, std::vector<Label>{});
    return at->second;
}

void VolumeBuilder::add_to_node_set(std::size_t set, Label node)
{
    node_sets_[set].second.push_back(node);
}

std::size_t VolumeBuilder::face_set(const std::string& name)
{
    const auto [at, fresh] = face_set_names_.try_emplace(name, face_sets_.size());
    if (fresh) face_sets_.push_back({name, {}});
    return at->second;
}

void VolumeBuilder::add_to_face_set(std::size_t set, Label element, std::int32_t face)
{
    face_sets_[set].second.emplace_back(element, face);
}

// ---- building ----------------------------------------------------------------------------

std::int32_t VolumeBuilder::known_node_(const LabelMap& nodes, Label node, const std::string& place)
{
    const std::int32_t i = nodes.find(node);
    if (i < 0) issues_.add(place, "node " + std::to_string(node), "a node of the file");
    return i;
}

/// Groups that name cells by number get the cells.
void VolumeBuilder::resolve_labels_()
{
    if (std::all_of(groups_.begin(), groups_.end(),
                    [](const Group& g) { return g.labels.empty(); }))
        return;
    std::vector<Label> labels;
    std::vector<Cell> cells;
    for (int type = 0; type <= kLines; ++type)
        for (const Label label : cells_[static_cast<std::size_t>(type)].labels) {
            const std::size_t before =
                cells.empty() || type_of(cells.back()) != type ? 0 : index_of(cells.back()) + 1;
            labels.push_back(label);
            cells.push_back(cell_of(type, before));
        }
    const LabelMap map(labels);
    if (map.duplicate() >= 0)
        issues_.add("element " + std::to_string(labels[static_cast<std::size_t>(map.duplicate())]),
                    "two elements with this number", "a number of its own for each element");
    for (Group& g : groups_)
        for (const Label label : g.labels) {
            const std::int32_t i = map.find(label);
            if (i < 0)
                issues_.add("element set " + quoted_text(g.name),
                            "element " + std::to_string(label), "an element of the file");
            else
                g.cells.push_back(cells[static_cast<std::size_t>(i)]);
        }
}

void VolumeBuilder::merge_()
{
    std::size_t merged = 0;
    for (int kind = 0; kind < kElementKinds; ++kind) {
        Cells& cells = cells_[static_cast<std::size_t>(kind)];
        const auto n = static_cast<std::size_t>(shape_of(static_cast<ElementKind>(kind)).nodes);
        const auto nodes_of_cell = [&](std::size_t i) {
            return std::span<const Label>(cells.nodes).subspan(i * n, n);
        };
        std::vector<std::size_t> order(cells.labels.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        const auto compare = [&](std::size_t a, std::size_t b) {
            const auto x = nodes_of_cell(a), y = nodes_of_cell(b);
            const auto [p, q] = std::mismatch(x.begin(), x.end(), y.begin());
            return p == x.end() ? a < b : *p < *q;
        };
        std::sort(order.begin(), order.end(), compare);
        std::vector<std::size_t> first(order.size());
        bool any = false;
        for (std::size_t k = 0; k < order.size(); ++k) {
            const bool again =
                k > 0 && std::ranges::equal(nodes_of_cell(order[k]), nodes_of_cell(order[k - 1]));
            first[order[k]] = again ? first[order[k - 1]] : order[k];
            any = any || again;
        }
        if (!any) continue;
        std::vector<std::size_t> place(order.size());
        Cells once;
        for (std::size_t i = 0; i < order.size(); ++i) {
            if (first[i] != i) {
                place[i] = place[first[i]];
                ++merged;
                continue;
            }
            place[i] = once.labels.size();
            once.labels.push_back(cells.labels[i]);
            const auto of = nodes_of_cell(i);
            once.nodes.insert(once.nodes.end(), of.begin(), of.end());
        }
        cells = std::move(once);
        for (Group& g : groups_)
            for (Cell& cell : g.cells)
                if (type_of(cell) == kind) cell = cell_of(kind, place[index_of(cell)]);
    }
    if (merged > 0)
        note(std::to_string(merged) + " elements are repeated in the file, for another group");
}

void VolumeBuilder::build_elements_(VolumeMesh& mesh, const LabelMap& nodes)
{
    for (int kind = 0; kind < kElementKinds; ++kind) {
        Cells& cells = cells_[static_cast<std::size_t>(kind)];
        if (cells.labels.empty()) continue;
        ElementBlock block{static_cast<ElementKind>(kind), {}};
        const auto n = static_cast<std::size_t>(shape_of(block.kind).nodes);
        block.nodes.resize(cells.nodes.size());
        for (std::size_t i = 0; i < cells.nodes.size(); ++i) {
            const std::int32_t node = nodes.find(cells.nodes[i]);
            block.nodes[i] = node;
            if (node < 0)
                known_node_(nodes, cells.nodes[i],
                            "element " + std::to_string(cells.labels[i / n]));
        }
        mesh.element_labels.insert(mesh.element_labels.end(), cells.labels.begin(),
                                   cells.labels.end());
        mesh.blocks.push_back(std::move(block));
        cells.nodes = {};
    }
}

/// @param names  of the face sets that facets belong to
void VolumeBuilder::match_facets_(VolumeMesh& mesh, const std::vector<Facet>& facets,
                                  const std::vector<std::string>& names)
{
    struct SearchedFace {
        std::array<std::int32_t, 4> corners;
        std::array<FaceRef, 2> faces;
        int count;
    };
    std::vector<SearchedFace> searched;
    std::vector<bool> near(mesh.nodes.size()); // nodes of facets: most faces have others
    for (const Facet& f : facets) {
        searched.push_back({sorted_corners(f.corners), {}, 0});
        for (const std::int32_t c : f.corners)
            if (c >= 0) near[static_cast<std::size_t>(c)] = true;
    }
    const auto by_corners = [](const SearchedFace& a, const SearchedFace& b) {
        return a.corners < b.corners;
    };
    std::sort(searched.begin(), searched.end(), by_corners);
    searched.erase(std::unique(searched.begin(), searched.end(),
                               [](const SearchedFace& a, const SearchedFace& b) {
                                   return a.corners == b.corners;
                               }),
                   searched.end());
    const auto find = [&](const std::array<std::int32_t, 4>& sorted) -> SearchedFace* {
        const auto at = std::lower_bound(searched.begin(), searched.end(),
                                         SearchedFace{sorted, {}, 0}, by_corners);
        return at != searched.end() && at->corners == sorted ? &*at : nullptr;
    };
    for_each_element(mesh, [&](std::int32_t e, ElementKind kind, auto nodes) {
        for (std::size_t f = 0; f < shape_of(kind).faces.size(); ++f) {
            const LocalFace& local = shape_of(kind).faces[f];
            std::array<std::int32_t, 4> corners{-1, -1, -1, -1};
            bool all_near = true;
            for (std::size_t i = 0; i < static_cast<std::size_t>(local.corners) && all_near; ++i) {
                corners[i] = nodes[static_cast<std::size_t>(local.node[i])];
                all_near = near[static_cast<std::size_t>(corners[i])];
            }
            if (!all_near) continue;
            SearchedFace* const w = find(sorted_corners(corners));
            if (w && w->count < 2)
                w->faces[static_cast<std::size_t>(w->count++)] = {e, static_cast<std::int32_t>(f)};
        }
    });
    std::map<std::string, std::size_t> set_names;
    for (std::size_t s = 0; s < mesh.face_sets.size(); ++s)
        set_names[mesh.face_sets[s].name] = s;
    std::vector<std::size_t> missing(names.size());
    for (const Facet& f : facets) {
        auto& members = members_of(mesh.face_sets, set_names, names[f.set]);
        const SearchedFace* const w = find(sorted_corners(f.corners));
        if (w->count == 0)
            ++missing[f.set];
        else // between two elements: of the one from which it points outwards
            members.push_back(
                w->faces[w->count == 2 && !same_direction(f.corners, face_nodes(mesh, w->faces[0]))
                             ? 1
                             : 0]);
    }
    for (std::size_t s = 0; s < names.size(); ++s)
        if (missing[s] > 0)
            note("face set " + quoted_text(names[s]) + ": " + std::to_string(missing[s]) +
                 " faces belong to no element and are left out");
}

void VolumeBuilder::build_sets_(VolumeMesh& mesh, const LabelMap& nodes)
{
    std::array<std::int64_t, kElementKinds> start{};
    for (int kind = 1; kind < kElementKinds; ++kind)
        start[static_cast<std::size_t>(kind)] =
            start[static_cast<std::size_t>(kind - 1)] +
            static_cast<std::int64_t>(cells_[static_cast<std::size_t>(kind - 1)].labels.size());

    std::map<std::string, std::size_t> node_names, element_names, face_names;
    for (const auto& [name, labels] : node_sets_) {
        auto& members = members_of(mesh.node_sets, node_names, name);
        for (const Label label : labels)
            members.push_back(known_node_(nodes, label, "node set " + quoted_text(name)));
    }
    if (!face_sets_.empty()) {
        const LabelMap elements(mesh.element_labels);
        for (const auto& [name, faces] : face_sets_) {
            auto& members = members_of(mesh.face_sets, face_names, name);
            for (const auto& [label, face] : faces) {
                const std::int32_t e = elements.find(label);
                const std::string place = "face set " + quoted_text(name);
                if (e < 0)
                    issues_.add(place, "element " + std::to_string(label),
                                "an element of the file");
                else if (const auto count = shape_of(element_of(mesh, e).kind).faces.size();
                         face < 0 || static_cast<std::size_t>(face) >= count)
                    issues_.add(place, "a face that element " + std::to_string(label) + " has not",
                                std::to_string(count) + " faces");
                else
                    members.push_back({e, face});
            }
        }
    }
    std::vector<Facet> facets;
    std::vector<std::string> facet_sets;
    for (const Group& g : groups_) {
        const std::string place = "group " + quoted_text(g.name);
        bool has[3] = {g.cells.empty() && g.dimension == 3, g.cells.empty() && g.dimension == 2,
                       g.cells.empty() && g.dimension < 2};
        for (const Cell cell : g.cells)
            has[type_of(cell) < kElementKinds ? 0 : type_of(cell) == kFacets ? 1 : 2] = true;
        auto* const in_elements =
            has[0] ? &members_of(mesh.element_sets, element_names, g.name) : nullptr;
        auto* const in_nodes = has[2] ? &members_of(mesh.node_sets, node_names, g.name) : nullptr;
        if (has[1]) {
            members_of(mesh.face_sets, face_names, g.name);
            facet_sets.push_back(g.name);
        }
        for (const Cell cell : g.cells) {
            const int type = type_of(cell);
            const std::size_t i = index_of(cell);
            if (type < kElementKinds) {
                in_elements->push_back(static_cast<std::int32_t>(
                    start[static_cast<std::size_t>(type)] + static_cast<std::int64_t>(i)));
            } else if (type == kFacets) {
                Facet facet;
                facet.set = facet_sets.size() - 1;
                const Label* const c = &cells_[kFacets].nodes[4 * i];
                for (std::size_t k = 0; k < (c[3] == c[0] ? 3U : 4U); ++k)
                    facet.corners[k] = known_node_(nodes, c[k], place);
                facets.push_back(facet);
            } else {
                const Cells& lines = cells_[kLines];
                for (std::size_t k = i > 0 ? lines.ends[i - 1] : 0; k < lines.ends[i]; ++k)
                    in_nodes->push_back(known_node_(nodes, lines.nodes[k], place));
            }
        }
    }
    issues_.throw_if_any(); // indices are right from here on
    if (!facets.empty()) match_facets_(mesh, facets, facet_sets);
    for (NodeSet& set : mesh.node_sets)
        sort_once(set.members);
    for (ElementSet& set : mesh.element_sets)
        sort_once(set.members);
    for (FaceSet& set : mesh.face_sets)
        sort_once(set.members);
}

VolumeFile VolumeBuilder::finish()
{
    constexpr auto kMost = static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max());
    resolve_labels_();
    if (merge_equal_) merge_();
    std::size_t elements = 0;
    for (int kind = 0; kind < kElementKinds; ++kind)
        elements += cells_[static_cast<std::size_t>(kind)].labels.size();
    if (nodes_.size() > kMost || elements > kMost)
        issues_.fatal("", std::to_string(std::max(nodes_.size(), elements)) + " nodes or elements",
                      "at most 2^31 - 1");
    const LabelMap nodes(node_labels_);
    if (nodes.duplicate() >= 0) {
        const Label label = node_labels_[static_cast<std::size_t>(nodes.duplicate())];
        issues_.add("node " + std::to_string(label), "two nodes with this number",
                    "a number of its own for each node");
    }
    if (elements == 0 && issues_.empty())
        issues_.add("",
                    "no solid element (" + std::to_string(nodes_.size()) + " nodes, " +
                        std::to_string(cells_[kFacets].labels.size()) + " faces)",
                    element_words_);
    VolumeFile out;
    build_elements_(out.mesh, nodes);
    issues_.throw_if_any();
    out.mesh.nodes = std::move(nodes_);
    build_sets_(out.mesh, nodes);
    out.mesh.first_label = first_label_;
    out.mesh.node_labels = kept(std::move(node_labels_), first_label_);
    out.mesh.element_labels = kept(std::move(out.mesh.element_labels), first_label_);
    out.notes = std::move(notes_);
    out.cut = std::move(cut_);
    return out;
}

} // namespace amontons
