#include "mesh/format/gmsh.hpp"
#include "mesh/format/gmsh_input.hpp"
#include "mesh/format/set_combinations.hpp"

#include <bit>
#include <charconv>

namespace amontons {
namespace {

/// The numbers of a .msh file as text or bytes.
class Output {
public:
    explicit Output(bool binary) : binary_(binary) {}
    bool binary() const { return binary_; }

    void line(std::string_view text) { bytes_.append(text).append("\n"); }
    void integer(std::int64_t value)
    {
        if (binary_)
            append_bytes(bytes_, static_cast<std::int32_t>(value), kBig);
        else
            word(value);
    }
    void size(std::int64_t value)
    {
        if (binary_)
            append_bytes(bytes_, static_cast<std::uint64_t>(value), kBig);
        else
            word(value);
    }
    void real(double value)
    {
        if (binary_) {
            append_bytes(bytes_, value, kBig);
            return;
        }
        append_number(bytes_, value);
        bytes_ += ' ';
    }
    /// The end of a record; only text has it.
    void end()
    {
        if (binary_) return;
        if (bytes_.back() == ' ')
            bytes_.back() = '\n';
        else
            bytes_ += '\n';
    }
    void end_section(std::string_view name)
    {
        if (binary_) bytes_ += '\n';
        bytes_.append("$End").append(name).append("\n");
    }
    std::string bytes() && { return std::move(bytes_); }

private:
    static constexpr bool kBig = std::endian::native == std::endian::big;
    void word(std::int64_t value)
    {
        char digits[24];
        const auto [end, error] = std::to_chars(digits, digits + sizeof digits, value);
        *end = ' ';
        bytes_.append(digits, end + 1);
    }

    bool binary_;
    std::string bytes_;
};

void write_header(Output& out, const char* version)
{
    out.line("$MeshFormat");
    out.line(std::string(version) + (out.binary() ? " 1 8" : " 0 8"));
    if (out.binary()) {
        out.integer(1);
        out.line("");
    }
    out.line("$EndMeshFormat");
}

/// Numbers of the groups: element sets first, then face sets, then node sets, from 1.
struct Groups {
    std::size_t elements = 1, faces = 1, nodes = 1;
};

Groups write_names(Output& out, const VolumeMesh& mesh)
{
    const Groups first{1, 1 + mesh.element_sets.size(),
                       1 + mesh.element_sets.size() + mesh.face_sets.size()};
    const std::size_t count =
        mesh.element_sets.size() + mesh.face_sets.size() + mesh.node_sets.size();
    if (count == 0) return first;
    out.line("$PhysicalNames");
    out.line(std::to_string(count));
    std::size_t number = 0;
    const auto write = [&](int dimension, const auto& sets) {
        for (const auto& set : sets) {
            std::string name = set.name;
            for (char& c : name)
                if (c == '"' || static_cast<unsigned char>(c) < ' ') c = '_';
            std::string text = std::to_string(dimension) + " ";
            text.append(std::to_string(++number)).append(" \"").append(name).append("\"");
            out.line(text);
        }
    };
    write(3, mesh.element_sets);
    write(2, mesh.face_sets);
    write(0, mesh.node_sets);
    out.line("$EndPhysicalNames");
    return first;
}

/// A cell to write: its type, and its nodes in Gmsh's order.
struct GmshCell {
    int type = 0;
    std::size_t count = 0;
    std::array<std::int32_t, kMostElementNodes> nodes{};
};

GmshCell gmsh_cell(const ElementView& element)
{
    GmshCell cell{gmsh_type(element.kind), element.nodes.size(), {}};
    std::copy(element.nodes.begin(), element.nodes.end(), cell.nodes.begin());
    swap_gmsh_order(std::span(cell.nodes).first(cell.count));
    return cell;
}

GmshCell gmsh_cell(const VolumeMesh& mesh, const FaceRef& face)
{
    const FaceNodes on = face_nodes(mesh, face);
    GmshCell cell{gmsh_face_type(element_of(mesh, face.element).kind),
                  static_cast<std::size_t>(on.count),
                  {}};
    std::copy(on.nodes().begin(), on.nodes().end(), cell.nodes.begin());
    return cell;
}

GmshCell gmsh_cell(std::int32_t node)
{
    return {kGmshPoint, 1, {node}};
}

// ---- version 2.2 -------------------------------------------------------------------------

void write_2(Output& out, const VolumeMesh& mesh)
{
    write_header(out, "2.2");
    const Groups first = write_names(out, mesh);
    out.line("$Nodes");
    out.line(std::to_string(mesh.nodes.size()));
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
        out.integer(static_cast<std::int64_t>(i) + 1);
        for (int k = 0; k < 3; ++k)
            out.real(mesh.nodes[i][k]);
        out.end();
    }
    out.end_section("Nodes");

    const SetCombinations<std::int32_t> elements = combinations_of(mesh.element_sets);
    std::vector<std::int32_t> combination(element_count(mesh), -1);
    std::size_t count = combination.size();
    for (std::size_t c = 0; c < elements.sets.size(); ++c)
        for (const std::int32_t e : elements.members[c]) {
            combination[static_cast<std::size_t>(e)] = static_cast<std::int32_t>(c);
            count += elements.sets[c].size() - 1;
        }
    for (const FaceSet& set : mesh.face_sets)
        count += set.members.size();
    for (const NodeSet& set : mesh.node_sets)
        count += set.members.size();

    out.line("$Elements");
    out.line(std::to_string(count));
    std::int64_t label = 0;
    const auto write = [&](const GmshCell& cell, std::size_t group) {
        ++label;
        if (out.binary()) { // a block of one
            out.integer(cell.type);
            out.integer(1);
            out.integer(2);
            out.integer(label);
        } else {
            out.integer(label);
            out.integer(cell.type);
            out.integer(2);
        }
        out.integer(static_cast<std::int64_t>(group));
        out.integer(group == 0 ? 1 : static_cast<std::int64_t>(group)); // entity
        for (std::size_t k = 0; k < cell.count; ++k)
            out.integer(std::int64_t{cell.nodes[k]} + 1);
        out.end();
    };
    for_each_element(mesh, [&](std::int32_t e, ElementKind kind, auto nodes) {
        const GmshCell cell = gmsh_cell({kind, nodes});
        const std::int32_t c = combination[static_cast<std::size_t>(e)];
        if (c < 0) write(cell, 0);
        if (c >= 0)
            for (const std::size_t set : elements.sets[static_cast<std::size_t>(c)])
                write(cell, first.elements + set);
    });
    for (std::size_t s = 0; s < mesh.face_sets.size(); ++s)
        for (const FaceRef& face : mesh.face_sets[s].members)
            write(gmsh_cell(mesh, face), first.faces + s);
    for (std::size_t s = 0; s < mesh.node_sets.size(); ++s)
        for (const std::int32_t node : mesh.node_sets[s].members)
            write(gmsh_cell(node), first.nodes + s);
    out.end_section("Elements");
}

// ---- version 4.1 -------------------------------------------------------------------------

/// Cells of one combination of sets.
struct Entity {
    int dimension = 3;
    std::int64_t tag = 0; // counts up in each dimension
    std::vector<std::size_t> groups;
    Vec3 low = Vec3::Zero(), high = Vec3::Zero();
};

/// All entities, and all cells with theirs: points, faces, then elements in their order.
class Model {
public:
    Model(const VolumeMesh& mesh, const Groups& first)
        : mesh_(mesh)
        , nodes_(combinations_of(mesh.node_sets))
        , faces_(combinations_of(mesh.face_sets))
        , entity_of_(element_count(mesh), 0)
    {
        if (!mesh.nodes.empty()) low_ = high_ = mesh.nodes[0];
        for (const Vec3& x : mesh.nodes) {
            low_ = low_.cwiseMin(x);
            high_ = high_.cwiseMax(x);
        }
        add_(0, nodes_.sets, first.nodes);
        for (std::size_t c = 0; c < nodes_.sets.size(); ++c)
            entities[c].low = entities[c].high =
                mesh.nodes[static_cast<std::size_t>(nodes_.members[c][0])];
        first_face_ = entities.size();
        add_(2, faces_.sets, first.faces);
        const SetCombinations<std::int32_t> elements = combinations_of(mesh.element_sets);
        const std::size_t first_element = entities.size();
        add_(3, elements.sets, first.elements);
        for (std::size_t c = 0; c < elements.sets.size(); ++c)
            for (const std::int32_t e : elements.members[c])
                entity_of_[static_cast<std::size_t>(e)] = first_element + c + 1; // 0: of no set
        if (std::find(entity_of_.begin(), entity_of_.end(), 0U) != entity_of_.end()) {
            add_(3, {{}}, 0);
            std::replace(entity_of_.begin(), entity_of_.end(), std::size_t{0}, entities.size());
        }
    }

    /// Calls visit(const Entity&, const Cell&) for each cell.
    template <class Visit> void for_each_cell(Visit visit) const
    {
        for (std::size_t c = 0; c < nodes_.sets.size(); ++c)
            for (const std::int32_t node : nodes_.members[c])
                visit(entities[c], gmsh_cell(node));
        for (std::size_t c = 0; c < faces_.sets.size(); ++c)
            for (const FaceRef& face : faces_.members[c])
                visit(entities[first_face_ + c], gmsh_cell(mesh_, face));
        for_each_element(mesh_, [&](std::int32_t e, ElementKind kind, auto of) {
            visit(entities[entity_of_[static_cast<std::size_t>(e)] - 1], gmsh_cell({kind, of}));
        });
    }

    std::vector<Entity> entities;

private:
    void add_(int dimension, const std::vector<std::vector<std::size_t>>& sets, std::size_t first)
    {
        std::int64_t tag = 0;
        for (const Entity& e : entities)
            tag += e.dimension == dimension ? 1 : 0;
        for (std::vector<std::size_t> groups : sets) {
            for (std::size_t& g : groups)
                g += first;
            entities.push_back({dimension, ++tag, std::move(groups), low_, high_});
        }
    }

    const VolumeMesh& mesh_;
    SetCombinations<std::int32_t> nodes_;
    SetCombinations<FaceRef> faces_;
    std::vector<std::size_t> entity_of_; // of each element: its entity + 1
    std::size_t first_face_ = 0;
    Vec3 low_ = Vec3::Zero(), high_ = Vec3::Zero();
};

void write_entities(Output& out, const Model& model)
{
    out.line("$Entities");
    for (const int dimension : {0, 1, 2, 3})
        out.size(std::count_if(model.entities.begin(), model.entities.end(),
                               [&](const Entity& e) { return e.dimension == dimension; }));
    out.end();
    for (const Entity& e : model.entities) {
        out.integer(e.tag);
        for (int k = 0; k < 3; ++k)
            out.real(e.low[k]);
        for (int k = 0; k < 3 && e.dimension > 0; ++k)
            out.real(e.high[k]);
        out.size(static_cast<std::int64_t>(e.groups.size()));
        for (const std::size_t g : e.groups)
            out.integer(static_cast<std::int64_t>(g));
        if (e.dimension > 0) out.size(0);
        out.end();
    }
    out.end_section("Entities");
}

void write_nodes(Output& out, const VolumeMesh& mesh)
{
    const auto n = static_cast<std::int64_t>(mesh.nodes.size());
    const std::int64_t any = n > 0 ? 1 : 0;
    out.line("$Nodes"); // all of them in one block, of the first volume
    for (const std::int64_t value : {any, n, any, n})
        out.size(value);
    out.end();
    if (n > 0) {
        for (const int value : {3, 1, 0})
            out.integer(value);
        out.size(n);
        out.end();
    }
    for (std::int64_t i = 1; i <= n; ++i) {
        out.size(i);
        out.end();
    }
    for (const Vec3& x : mesh.nodes) {
        for (int k = 0; k < 3; ++k)
            out.real(x[k]);
        out.end();
    }
    out.end_section("Nodes");
}

/// A new block wherever the entity or the type changes: the order of elements stays.
void write_elements(Output& out, const Model& model)
{
    std::vector<std::int64_t> blocks;
    std::int64_t cells = 0;
    const Entity* entity = nullptr;
    int type = 0;
    const auto begins_block = [&](const Entity& e, const GmshCell& cell) {
        const bool begins = &e != entity || cell.type != type;
        entity = &e;
        type = cell.type;
        return begins;
    };
    model.for_each_cell([&](const Entity& e, const GmshCell& cell) {
        if (begins_block(e, cell)) blocks.push_back(0);
        ++blocks.back();
        ++cells;
    });
    out.line("$Elements");
    for (const std::int64_t value :
         {static_cast<std::int64_t>(blocks.size()), cells, std::int64_t{cells > 0 ? 1 : 0}, cells})
        out.size(value);
    out.end();
    entity = nullptr;
    auto block = blocks.begin();
    std::int64_t label = 0;
    model.for_each_cell([&](const Entity& e, const GmshCell& cell) {
        if (begins_block(e, cell)) {
            for (const std::int64_t value :
                 {std::int64_t{e.dimension}, e.tag, std::int64_t{cell.type}})
                out.integer(value);
            out.size(*block++);
            out.end();
        }
        out.size(++label);
        for (std::size_t k = 0; k < cell.count; ++k)
            out.size(std::int64_t{cell.nodes[k]} + 1);
        out.end();
    });
    out.end_section("Elements");
}

void write_4(Output& out, const VolumeMesh& mesh)
{
    write_header(out, "4.1");
    const Model model(mesh, write_names(out, mesh));
    write_entities(out, model);
    write_nodes(out, mesh);
    write_elements(out, model);
}

} // namespace

std::string gmsh_bytes(const VolumeMesh& mesh, const GmshOptions& options)
{
    Output out(options.binary);
    if (options.version_2)
        write_2(out, mesh);
    else
        write_4(out, mesh);
    return std::move(out).bytes();
}

} // namespace amontons
