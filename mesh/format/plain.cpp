#include "mesh/format/plain.hpp"

#include "mesh/format/number_scanner.hpp"

#include <algorithm>

namespace amontons {
namespace {

/// Calls visit(line number, words) for each line with content; commas are blanks.
template <class Visit> void for_each_line(std::string_view text, Visit visit)
{
    std::string copy;
    if (text.find(',') != std::string_view::npos) {
        copy = text;
        std::replace(copy.begin(), copy.end(), ',', ' ');
        text = copy;
    }
    NumberScanner lines(text);
    while (!lines.at_end()) {
        const std::size_t number = lines.line();
        const std::string_view line = lines.rest_of_line();
        NumberScanner words(line.substr(0, line.find('#')), number);
        if (!words.at_end()) visit(number, words);
    }
}

std::vector<Vec3> read_nodes(std::string_view text, const std::string& file)
{
    FileIssues issues(file);
    std::vector<Vec3> nodes;
    for_each_line(text, [&](std::size_t line, NumberScanner& words) {
        Vec3 x = Vec3::Zero();
        for (int k = 0; k < 3; ++k)
            if (!words.number(x[k])) {
                issues.add(line_place(line),
                           words.refused().empty() ? "the end of the line"
                                                   : quoted_text(words.refused()),
                           "three coordinates");
                return;
            }
        if (!words.at_end())
            issues.add(line_place(line), quoted_text(words.word()) + " after three coordinates",
                       "one node a line");
        if (!x.allFinite())
            issues.add(line_place(line),
                       "coordinates " + number_text(x[0]) + " " + number_text(x[1]) + " " +
                           number_text(x[2]),
                       "finite numbers");
        nodes.push_back(x);
    });
    if (nodes.empty() && issues.empty()) issues.add("", "no node", "lines of x y z");
    issues.throw_if_any();
    return nodes;
}

class ElementReader {
public:
    explicit ElementReader(FileIssues& issues) : issues_(issues) {}

    void read(std::string_view text)
    {
        for_each_line(text, [&](std::size_t line, NumberScanner& words) {
            const char first = words.rest()[0];
            const bool number = (first >= '0' && first <= '9') || first == '-' || first == '+';
            if (number)
                read_numbers(line, words);
            else
                read_keyword(line, words);
        });
    }

    void build(const std::vector<Vec3>& nodes, VolumeBuilder& builder)
    {
        const Label first = first_label(static_cast<Label>(nodes.size()));
        builder.set_first_label(first);
        builder.reserve_nodes(nodes.size());
        for (std::size_t i = 0; i < nodes.size(); ++i)
            builder.add_node(first + static_cast<Label>(i), nodes[i]);
        std::size_t start = 0;
        Label label = first;
        for (const std::size_t end : ends_) {
            const auto count = end - start;
            const auto of = std::span(nodes_).subspan(start, count);
            if (count == 10 && gmsh_order_) std::swap(of[8], of[9]);
            builder.add_element(count == 4    ? ElementKind::T4
                                : count == 10 ? ElementKind::T10
                                              : ElementKind::H8,
                                label++, of);
            start = end;
        }
        for (const Set& set : sets_) {
            const std::size_t to = set.kind == 'n'   ? builder.node_set(set.name)
                                   : set.kind == 'e' ? builder.group(set.name, 3)
                                                     : builder.face_set(set.name);
            for (std::size_t i = 0; i < set.members.size(); ++i)
                if (set.kind == 'n')
                    builder.add_to_node_set(to, set.members[i]);
                else if (set.kind == 'e')
                    builder.add_label_to_group(to, set.members[i]);
                else if (i % 2 == 1) // a face out of range is none of the element
                    builder.add_to_face_set(
                        to, set.members[i - 1],
                        static_cast<std::int32_t>(std::clamp<Label>(set.members[i], -1, 99)));
        }
    }

private:
    using Label = VolumeBuilder::Label;
    struct Set {
        char kind; // n, e, f
        std::string name;
        std::vector<Label> members;
    };

    void read_keyword(std::size_t line, NumberScanner& words)
    {
        const std::string_view word = words.word();
        if (word == "index_from") {
            Label value = -1;
            if (!words.integer(value) || (value != 0 && value != 1))
                issues_.add(line_place(line), "index_from " + quoted_text(words.refused()),
                            "0 or 1");
            else
                first_ = value;
        } else if (word == "t10_order") {
            const std::string_view order = words.word();
            if (order != "vtk" && order != "gmsh")
                issues_.add(line_place(line), "t10_order " + quoted_text(order), "vtk or gmsh");
            gmsh_order_ = order == "gmsh";
        } else if (word == "node_set" || word == "element_set" || word == "face_set") {
            std::string_view name = words.rest();
            while (!name.empty() && static_cast<unsigned char>(name.back()) <= ' ')
                name.remove_suffix(1);
            while (!name.empty() && static_cast<unsigned char>(name.front()) <= ' ')
                name.remove_prefix(1);
            if (name.empty()) issues_.add(line_place(line), "a set without a name", "a name");
            sets_.push_back({word[0], std::string(name), {}});
        } else {
            issues_.add(line_place(line), quoted_text(word),
                        "numbers, index_from, t10_order, node_set, element_set or face_set");
        }
    }

    void read_numbers(std::size_t line, NumberScanner& words)
    {
        std::vector<Label>& to = sets_.empty() ? nodes_ : sets_.back().members;
        const std::size_t before = to.size(); // a line is taken whole or not at all
        std::size_t count = 0;
        for (; !words.at_end(); ++count) {
            Label value = 0;
            if (!words.integer(value)) {
                to.resize(before);
                issues_.add(line_place(line), quoted_text(words.refused()), "a whole number");
                return;
            }
            to.push_back(value);
        }
        if (sets_.empty()) {
            if (count != 4 && count != 8 && count != 10) {
                issues_.add(line_place(line), std::to_string(count) + " numbers",
                            "4, 8 or 10 nodes (T4, H8, T10)");
                to.resize(before);
                return;
            }
            ends_.push_back(nodes_.size());
        } else if (sets_.back().kind == 'f' && count % 2 != 0) {
            to.resize(before);
            issues_.add(line_place(line), std::to_string(count) + " numbers",
                        "pairs of element and face");
        }
    }

    Label first_label(Label count)
    {
        if (first_ >= 0 || nodes_.empty()) return first_ < 0 ? 0 : first_;
        const auto [low, high] = std::minmax_element(nodes_.begin(), nodes_.end());
        if (*low == 0) return 0;
        if (*high == count) return 1;
        issues_.add("",
                    "nodes " + std::to_string(*low) + " to " + std::to_string(*high) + " of " +
                        std::to_string(count) + " in use",
                    "node 0, or node " + std::to_string(count) + ", or a line index_from 0 or 1");
        return 0;
    }

    FileIssues& issues_;
    std::vector<Label> nodes_; // of all elements
    std::vector<std::size_t> ends_;
    std::vector<Set> sets_;
    Label first_ = -1;
    bool gmsh_order_ = false;
};

} // namespace

namespace {

bool ends_within_a_line(std::string_view text)
{
    return !text.empty() && static_cast<unsigned char>(text.back()) > ' ';
}

} // namespace

VolumeFile parse_plain(std::string_view nodes, std::string_view elements,
                       const std::string& nodes_file, const std::string& elements_file,
                       double scale)
{
    const std::vector<Vec3> points = read_nodes(without_byte_order_mark(nodes), nodes_file);
    FileIssues issues(elements_file);
    VolumeBuilder builder(issues, scale);
    builder.set_element_words("lines of 4, 8 or 10 nodes");
    ElementReader reader(issues);
    reader.read(without_byte_order_mark(elements));
    issues.throw_if_any();
    if (ends_within_a_line(nodes)) builder.note_cut(nodes_file);
    if (ends_within_a_line(elements)) builder.note_cut(elements_file);
    reader.build(points, builder);
    return builder.finish();
}

PlainText plain_text(const VolumeMesh& mesh)
{
    PlainText text;
    for (const Vec3& x : mesh.nodes)
        for (int k = 0; k < 3; ++k) {
            append_number(text.nodes, x[k]);
            text.nodes += k < 2 ? ' ' : '\n';
        }
    std::string& out = text.elements;
    out = "index_from 0\n";
    const auto append = [&](std::span<const std::int32_t> numbers) {
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            out += std::to_string(numbers[i]);
            out += i + 1 < numbers.size() ? ' ' : '\n';
        }
    };
    for_each_element(mesh, [&](std::int32_t, ElementKind, auto nodes) { append(nodes); });
    const auto head = [&](const char* kind, const std::string& name) {
        std::string safe = name;
        for (char& c : safe)
            if (static_cast<unsigned char>(c) < ' ' || c == '#' || c == ',') c = '_';
        out.append(kind).append(" ").append(safe).append("\n");
    };
    const auto append_each = [&](const std::vector<std::int32_t>& members) {
        for (const std::int32_t m : members)
            append(std::array{m});
    };
    for (const NodeSet& set : mesh.node_sets) {
        head("node_set", set.name);
        append_each(set.members);
    }
    for (const ElementSet& set : mesh.element_sets) {
        head("element_set", set.name);
        append_each(set.members);
    }
    for (const FaceSet& set : mesh.face_sets) {
        head("face_set", set.name);
        for (const FaceRef& face : set.members)
            append(std::array{face.element, face.face});
    }
    return text;
}

} // namespace amontons
