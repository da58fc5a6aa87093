#include "mesh/format/gmsh_input.hpp"

// Nodes and elements stand in blocks, one for each entity of the geometry; physical groups belong
// to entities. Counts and numbers of nodes and elements are size_t, all else is int or double:
//
// $Entities  points curves surfaces volumes, then
//            point: tag x y z groups group...
//            other: tag box(6) groups group... bounds bound...
// $PartitionedEntities  partitions ghosts (tag partition)..., then as above, with
//            parent dimension, parent tag, partitions partition... after the tag
// $Nodes     blocks nodes least greatest, then
//            dimension tag parametric n, n numbers, n times x y z [u [v [w]]]
// $Elements  blocks elements least greatest, then
//            dimension tag type n, n times number node...

namespace amontons {
namespace {

class Gmsh4Reader {
public:
    Gmsh4Reader(GmshInput& in, VolumeBuilder& builder)
        : in_(in)
        , builder_(builder)
        , cells_(builder, names_)
    {
    }

    void read()
    {
        bool has_nodes = false, has_elements = false;
        for (std::string section; !(section = next_gmsh_section(in_)).empty();) {
            if (section == "PhysicalNames") {
                read_gmsh_names(in_, names_);
                continue;
            }
            if (section == "Entities") {
                read_entities(false);
            } else if (section == "PartitionedEntities") {
                read_entities(true);
            } else if (section == "Nodes") {
                read_nodes();
                has_nodes = true;
            } else if (section == "Elements") {
                read_elements();
                has_elements = true;
            } else {
                skip_gmsh_section(in_, section, builder_);
                continue;
            }
            end_gmsh_section(in_, section);
        }
        if (!has_nodes || !has_elements)
            in_.issues().fatal("", has_nodes ? "no section $Elements" : "no section $Nodes",
                               "sections $Nodes and $Elements");
        cells_.finish(in_.issues());
    }

private:
    std::int64_t dimension()
    {
        const std::int64_t d = in_.integer();
        if (d < 0 || d > 3)
            in_.issues().fatal(in_.place(), "dimension " + std::to_string(d), "0 to 3");
        return d;
    }

    void pass_integers(const char* what)
    {
        for (std::size_t n = in_.count(in_.size(), what); n > 0; --n)
            in_.integer();
    }

    void read_entities(bool partitioned)
    {
        if (partitioned) {
            in_.size(); // partitions
            for (std::size_t n = in_.count(in_.size(), "ghost entities"); n > 0; --n) {
                in_.integer();
                in_.integer();
            }
        }
        std::array<std::size_t, 4> counts{};
        for (std::size_t& n : counts)
            n = in_.count(in_.size(), "entities", 4);
        for (std::int64_t d = 0; d < 4; ++d)
            for (std::size_t i = 0; i < counts[static_cast<std::size_t>(d)]; ++i) {
                const std::int64_t tag = in_.integer();
                if (partitioned) {
                    in_.integer();
                    in_.integer();
                    pass_integers("partitions");
                }
                for (int k = 0; k < (d == 0 ? 3 : 6); ++k)
                    in_.real();
                std::vector<std::int64_t>& groups = groups_[{d, tag}];
                for (std::size_t n = in_.count(in_.size(), "groups"); n > 0; --n)
                    groups.push_back(group_number(in_.integer()));
                if (d > 0) pass_integers("bounds");
            }
    }

    void read_nodes()
    {
        const std::size_t blocks = in_.count(in_.size(), "blocks", 2);
        const std::size_t n = in_.count(in_.size(), "nodes", 4);
        in_.size();
        in_.size();
        builder_.reserve_nodes(builder_.node_count() + n);
        std::size_t seen = 0;
        std::vector<std::int64_t> labels;
        for (std::size_t b = 0; b < blocks; ++b) {
            const std::int64_t d = dimension();
            in_.integer();
            const std::int64_t parametric = in_.integer();
            if (parametric < 0 || parametric > 1)
                in_.issues().fatal(in_.place(), "parametric " + std::to_string(parametric),
                                   "0 or 1");
            labels.resize(in_.count(in_.size(), "nodes of a block", 4));
            for (std::int64_t& label : labels)
                label = in_.size();
            for (const std::int64_t label : labels) {
                const double x = in_.real(), y = in_.real(), z = in_.real();
                for (std::int64_t k = 0; k < (parametric == 1 ? d : 0); ++k)
                    in_.real();
                builder_.add_node(label, {x, y, z});
            }
            seen += labels.size();
        }
        if (seen != n)
            in_.issues().fatal(in_.place(), std::to_string(seen) + " nodes in the blocks",
                               std::to_string(n) + ", as the section specifies");
    }

    void read_elements()
    {
        const std::size_t blocks = in_.count(in_.size(), "blocks", 2);
        const std::size_t n = in_.count(in_.size(), "elements", 2);
        in_.size();
        in_.size();
        std::size_t seen = 0;
        for (std::size_t b = 0; b < blocks; ++b) {
            const std::int64_t d = dimension(), tag = in_.integer(), type = in_.integer();
            const std::string where = in_.place();
            const GmshKind* const kind = gmsh_kind(type);
            if (!kind || kind->dimension != d)
                in_.issues().fatal(where,
                                   "elements of type " + std::to_string(type) + " in dimension " +
                                       std::to_string(d),
                                   "a type of Gmsh's first two orders: 1 to 21, 26 to 30");
            std::vector<std::size_t> groups;
            if (const auto at = groups_.find({d, tag}); at != groups_.end())
                for (const std::int64_t g : at->second)
                    groups.push_back(cells_.group(d, g));
            const std::size_t count = in_.count(in_.size(), "elements of a block", 2);
            std::array<std::int64_t, 64> nodes{};
            const auto of_element = std::span(nodes).first(static_cast<std::size_t>(kind->nodes));
            for (std::size_t i = 0; i < count; ++i) {
                const std::int64_t label = in_.size();
                for (std::int64_t& node : of_element)
                    node = in_.size();
                cells_.add(type, *kind, label, of_element, groups, [&] { return where; });
            }
            seen += count;
        }
        if (seen != n)
            in_.issues().fatal(in_.place(), std::to_string(seen) + " elements in the blocks",
                               std::to_string(n) + ", as the section specifies");
    }

    GmshInput& in_;
    VolumeBuilder& builder_;
    GmshNames names_;
    GmshCells cells_;
    std::map<std::pair<std::int64_t, std::int64_t>, std::vector<std::int64_t>> groups_;
};

} // namespace

void read_gmsh_4(GmshInput& in, VolumeBuilder& builder)
{
    Gmsh4Reader(in, builder).read();
}

} // namespace amontons
