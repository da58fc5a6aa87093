#include "mesh/format/gmsh_input.hpp"

// $Nodes:    n, then (number x y z) n times
// $Elements: n, then in ASCII  (number type tags tag... node...) n times, in binary
//            blocks of        type count tags, then (number tag... node...) count times
// The first tag is the physical group, 0 for none.

namespace amontons {
namespace {

constexpr std::int64_t kMostTags = 1000;

class Gmsh2Reader {
public:
    Gmsh2Reader(GmshInput& in, VolumeBuilder& builder)
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
            } else if (section == "Nodes" || section == "NOD") {
                read_nodes();
                end_gmsh_section(in_, section);
                has_nodes = true;
            } else if (section == "Elements" || section == "ELM") {
                read_elements();
                end_gmsh_section(in_, section);
                has_elements = true;
            } else {
                skip_gmsh_section(in_, section, builder_);
            }
        }
        if (!has_nodes || !has_elements)
            in_.issues().fatal("", has_nodes ? "no section $Elements" : "no section $Nodes",
                               "sections $Nodes and $Elements");
        cells_.finish(in_.issues());
        if (solid_groups_ > 1) builder_.merge_equal_elements();
    }

private:
    std::size_t text_count(const char* what, std::size_t least)
    {
        std::int64_t count = 0; // text, also in a binary file
        if (!in_.text().integer(count)) in_.refuse(what);
        if (in_.binary()) in_.text().rest_of_line();
        in_.begin_data();
        return in_.count(count, what, least);
    }

    void read_nodes()
    {
        const std::size_t n = text_count("nodes", 4);
        builder_.reserve_nodes(builder_.node_count() + n);
        for (std::size_t i = 0; i < n; ++i) {
            const std::int64_t label = in_.integer();
            const double x = in_.real(), y = in_.real(), z = in_.real();
            builder_.add_node(label, {x, y, z});
        }
    }

    const GmshKind& known_kind(std::int64_t type)
    {
        const GmshKind* const kind = gmsh_kind(type);
        if (!kind)
            in_.issues().fatal(in_.place(), "an element of type " + std::to_string(type),
                               "a type of Gmsh's first two orders: 1 to 21, 26 to 30");
        return *kind;
    }

    void read_element(std::int64_t label, std::int64_t type, const GmshKind& kind,
                      std::int64_t tags)
    {
        std::int64_t physical = 0;
        for (std::int64_t t = 0; t < tags; ++t)
            if (const std::int64_t tag = in_.integer(); t == 0) physical = tag;
        std::array<std::int64_t, 64> nodes{};
        for (int k = 0; k < kind.nodes; ++k)
            nodes[static_cast<std::size_t>(k)] = in_.integer();
        std::span<const std::size_t> groups;
        if (physical != 0) {
            const std::pair key{kind.dimension, group_number(physical)};
            if (key != last_key_) {
                last_key_ = key;
                last_group_ = cells_.group(key.first, key.second);
                if (kind.dimension == 3) ++solid_groups_;
            }
            groups = {&last_group_, 1};
        }
        cells_.add(type, kind, label, std::span(nodes).first(static_cast<std::size_t>(kind.nodes)),
                   groups, [&] { return in_.place(); });
    }

    void read_elements()
    {
        const std::size_t n = text_count("elements", 3);
        const auto read_tags = [&] {
            const std::int64_t tags = in_.integer();
            if (tags < 0 || tags > kMostTags)
                in_.issues().fatal(in_.place(), std::to_string(tags) + " tags",
                                   "0 to " + std::to_string(kMostTags));
            return tags;
        };
        for (std::size_t i = 0; i < n;) {
            if (!in_.binary()) {
                const std::int64_t label = in_.integer(), type = in_.integer();
                const GmshKind& kind = known_kind(type);
                const std::int64_t tags = read_tags();
                read_element(label, type, kind, tags);
                ++i;
                continue;
            }
            const std::int64_t type = in_.integer();
            const GmshKind& kind = known_kind(type);
            const std::size_t block = in_.count(in_.integer(), "elements of a block");
            if (block == 0 || block > n - i)
                in_.issues().fatal(in_.place(), std::to_string(block) + " elements in a block",
                                   "1 to " + std::to_string(n - i) + ", those that are left");
            const std::int64_t tags = read_tags();
            for (std::size_t k = 0; k < block; ++k) {
                const std::int64_t label = in_.integer();
                read_element(label, type, kind, tags);
            }
            i += block;
        }
    }

    GmshInput& in_;
    VolumeBuilder& builder_;
    GmshNames names_;
    GmshCells cells_;
    std::pair<int, std::int64_t> last_key_{-1, 0}; // of the last group that was searched for
    std::size_t last_group_ = 0;
    int solid_groups_ = 0; // changes of it: more than one group if above 1
};

} // namespace

void read_gmsh_2(GmshInput& in, VolumeBuilder& builder)
{
    Gmsh2Reader(in, builder).read();
}

} // namespace amontons
