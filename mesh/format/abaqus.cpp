#include "mesh/format/abaqus.hpp"

#include "mesh/format/abaqus_names.hpp"
#include "mesh/format/number_scanner.hpp"

#include <algorithm>
#include <optional>
#include <set>

namespace amontons {
namespace {

char upper(char c)
{
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
}

std::string upper_case(std::string_view text)
{
    std::string out(text);
    std::transform(out.begin(), out.end(), out.begin(), upper);
    return out;
}

std::string_view trimmed(std::string_view text)
{
    const auto blank = [](char c) { return static_cast<unsigned char>(c) <= ' '; };
    while (!text.empty() && blank(text.front()))
        text.remove_prefix(1);
    while (!text.empty() && blank(text.back()))
        text.remove_suffix(1);
    return text;
}

/// The next field of a line, up to a comma; the line then begins after it.
std::string_view next_field(std::string_view& line)
{
    const std::size_t comma = std::min(line.find(','), line.size());
    const std::string_view field = trimmed(line.substr(0, comma));
    line.remove_prefix(std::min(comma + 1, line.size()));
    return field;
}

struct Range {
    VolumeBuilder::Label first = 0, last = 0, step = 1;
};

/// Members as a file gives them, in the order of its lines.
struct RawSet {
    std::string name; // as first spelled
    std::vector<VolumeBuilder::Label> labels;
    std::vector<Range> ranges;
    std::size_t line = 0;
};

struct RawFace {
    std::string set; // of elements, "" if one element
    VolumeBuilder::Label element = 0;
    std::string face; // S1, ...
    std::size_t line = 0;
};

/// Of a file of parts, instances of these and their assembly.
struct Assembly {
    int instances = 0, parts = 0;
    bool open = false; // in the assembly now
};

/// Whether nodes that come now are the assembly's own, beside those of its parts.
bool has_own_nodes(const Assembly& a)
{
    return a.open && a.instances > 0 && a.parts > 0;
}

/// What is noted once of each keyword, type of elements and set.
struct NotedOnce {
    std::set<std::string> keywords, lines;
    std::set<std::size_t> gaps; // lines of sets
    std::string passed_over;    // text of the keywords
};

void note_passed_over(NotedOnce& noted, const std::string& keyword, std::size_t line)
{
    if (!noted.keywords.insert(keyword).second) return;
    noted.passed_over += (noted.passed_over.empty() ? "*" : ", *") + keyword.substr(0, 40) +
                         " (line " + std::to_string(line) + ")";
}

class AbaqusReader {
public:
    AbaqusReader(std::string_view text, FileIssues& issues, VolumeBuilder& builder)
        : rest_(text)
        , issues_(issues)
        , builder_(builder)
    {
    }

    /// @return  whether the last line has no end
    bool read()
    {
        for (std::string_view line; next_line(line);) {
            if (line[0] == '*')
                begin_keyword(line);
            else
                read_data(line);
        }
        if (!record_.empty()) refuse_record();
        finish();
        return cut_;
    }

private:
    using Label = VolumeBuilder::Label;
    using Parameters = std::map<std::string, std::string>;
    enum class Section { skipped, nodes, elements, node_set, element_set, surface, instance };

    std::string place() const { return line_place(line_number_); }

    /// The next line that is neither empty nor a comment, trimmed.
    bool next_line(std::string_view& line)
    {
        while (!rest_.empty()) {
            const std::size_t end = std::min(rest_.find('\n'), rest_.size());
            line = trimmed(rest_.substr(0, end));
            const bool ended = end < rest_.size();
            rest_.remove_prefix(std::min(end + 1, rest_.size()));
            ++line_number_;
            cut_ |= !line.empty() && !ended;
            if (!line.empty() && !line.starts_with("**")) return true;
        }
        return false;
    }

    // ---- keywords

    void begin_keyword(std::string_view first)
    {
        if (!record_.empty()) refuse_record();
        keyword_line_ = line_number_;
        std::string whole(first);
        for (std::string_view more; whole.ends_with(',') && next_line(more);)
            whole.append(more);
        std::string_view line = whole;
        std::string keyword;
        for (const char c : next_field(line).substr(1))
            if (c != ' ' && c != '\t') keyword += upper(c);
        Parameters parameters;
        while (!line.empty()) {
            std::string_view field = next_field(line);
            const std::size_t equals = std::min(field.find('='), field.size());
            std::string_view value = trimmed(field.substr(std::min(equals + 1, field.size())));
            if (value.size() >= 2 && value.front() == '"' && value.back() == '"')
                value = value.substr(1, value.size() - 2);
            parameters[upper_case(trimmed(field.substr(0, equals)))] = value;
        }
        section_ = Section::skipped;
        // Without the other file's nodes all that follows would be refused, too.
        if (keyword == "INCLUDE" ||
            (parameters.contains("INPUT") && (keyword == "NODE" || keyword == "ELEMENT" ||
                                              keyword == "NSET" || keyword == "ELSET")))
            issues_.fatal(line_place(keyword_line_),
                          "*" + keyword + " from the file " + quoted_text(parameters["INPUT"]),
                          "a file that is whole: put the content of the other in its place");
        begin_section(keyword, parameters);
    }

    void begin_section(const std::string& keyword, const Parameters& p)
    {
        const bool in_step = step_line_ > 0;
        if (keyword == "NODE" && !in_step) {
            begin_nodes(p);
        } else if (keyword == "ELEMENT" && !in_step) {
            begin_elements(p);
        } else if (keyword == "NSET") {
            begin_set(p, "NSET", Section::node_set);
        } else if (keyword == "ELSET") {
            begin_set(p, "ELSET", Section::element_set);
        } else if (keyword == "SURFACE") {
            begin_surface(p);
        } else if (keyword == "INSTANCE") {
            section_ = Section::instance;
            if (++assembly_.instances > 1)
                refuse_keyword(keyword, "one instance: a mesh of one part");
        } else if (keyword == "PART") {
            if (++assembly_.parts > 1) refuse_keyword(keyword, "one part");
        } else if (keyword == "ASSEMBLY") {
            assembly_.open = true;
        } else if (keyword == "ENDASSEMBLY") {
            assembly_.open = false;
        } else if (keyword == "STEP") {
            step_line_ = keyword_line_;
        } else if (keyword == "NGEN" || keyword == "NFILL" || keyword == "NCOPY" ||
                   keyword == "NMAP" || keyword == "ELGEN" || keyword == "ELCOPY" ||
                   keyword == "SYSTEM") {
            refuse_keyword(keyword, "nodes and elements written out");
        } else if (keyword != "HEADING" && keyword != "ENDPART" && keyword != "ENDINSTANCE" &&
                   keyword != "PREPRINT" && keyword != "ENDSTEP") {
            note_passed_over(noted_, keyword, keyword_line_);
        }
    }

    void refuse_keyword(const std::string& keyword, const char* allowed)
    {
        issues_.add(line_place(keyword_line_), "*" + keyword, allowed);
    }

    void begin_nodes(const Parameters& p)
    {
        if (has_own_nodes(assembly_)) {
            builder_.note("line " + std::to_string(keyword_line_) +
                          ": nodes of the assembly are passed over");
            return;
        }
        if (const auto at = p.find("SYSTEM"); at != p.end() && upper_case(at->second) != "R")
            issues_.add(line_place(keyword_line_), "*NODE, SYSTEM=" + at->second,
                        "rectangular coordinates");
        section_ = Section::nodes;
        current_node_set_ = set_of(p, "NSET", node_sets_);
    }

    void begin_elements(const Parameters& p)
    {
        const auto at = p.find("TYPE");
        if (at == p.end()) {
            issues_.add(line_place(keyword_line_), "*ELEMENT without TYPE", "TYPE=C3D4, ...");
            return;
        }
        type_name_ = upper_case(at->second);
        type_ = abaqus_type(type_name_);
        current_element_set_ = set_of(p, "ELSET", element_sets_);
        section_ = Section::elements;
        if (type_.use == AbaqusType::Use::other_solid)
            issues_.add(line_place(keyword_line_), "elements of type " + quoted_text(type_name_),
                        "C3D4, C3D10, C3D8 and their variants");
        else if (type_.use == AbaqusType::Use::line && noted_.lines.insert(type_name_).second)
            builder_.note("line " + std::to_string(keyword_line_) + ": of elements of type " +
                          quoted_text(type_name_) + " only the nodes count, in sets");
    }

    /// The set that a parameter names, made if it is new; nullptr without that parameter.
    RawSet* set_of(const Parameters& p, const char* parameter, std::map<std::string, RawSet>& sets)
    {
        const auto at = p.find(parameter);
        if (at == p.end()) return nullptr;
        if (at->second.empty())
            issues_.add(line_place(keyword_line_), std::string(parameter) + " without a name",
                        "a name");
        RawSet& set = sets[upper_case(at->second)];
        if (set.line == 0) {
            set.name = at->second;
            set.line = keyword_line_;
        }
        return &set;
    }

    void begin_set(const Parameters& p, const char* parameter, Section section)
    {
        auto& sets = section == Section::node_set ? node_sets_ : element_sets_;
        RawSet* const set = set_of(p, parameter, sets);
        if (!set) {
            issues_.add(line_place(keyword_line_), "a set without a name",
                        std::string(parameter) + "=NAME");
            return;
        }
        (section == Section::node_set ? current_node_set_ : current_element_set_) = set;
        generate_ = p.contains("GENERATE");
        section_ = section;
    }

    void begin_surface(const Parameters& p)
    {
        const auto name = p.find("NAME"), type = p.find("TYPE");
        if (name == p.end() || name->second.empty()) {
            issues_.add(line_place(keyword_line_), "a surface without a name", "NAME=...");
            return;
        }
        const std::string kind = type == p.end() ? "ELEMENT" : upper_case(type->second);
        if (kind == "NODE") {
            generate_ = false;
            RawSet& set = node_sets_[upper_case(name->second)];
            if (set.line == 0) {
                set.name = name->second;
                set.line = keyword_line_;
            }
            current_node_set_ = &set;
            section_ = Section::node_set;
        } else if (kind == "ELEMENT") {
            surface_ = &surfaces_[upper_case(name->second)];
            if (surface_->first.empty()) surface_->first = name->second;
            section_ = Section::surface;
        } else {
            builder_.note("line " + std::to_string(keyword_line_) + ": the surface " +
                          quoted_text(name->second) + " of type " + quoted_text(kind) +
                          " is passed over");
        }
    }

    // ---- data lines

    void read_data(std::string_view line)
    {
        switch (section_) {
        case Section::skipped:
            break;
        case Section::nodes:
            read_node(line);
            break;
        case Section::elements:
            read_element(line);
            break;
        case Section::node_set:
            read_members(line, *current_node_set_, node_sets_);
            break;
        case Section::element_set:
            read_members(line, *current_element_set_, element_sets_);
            break;
        case Section::surface:
            read_surface(line);
            break;
        case Section::instance:
            issues_.add(place(), "an instance that is moved", "a part in its place");
            section_ = Section::skipped;
            break;
        }
    }

    bool read_label(std::string_view field, Label& value, const char* what)
    {
        const auto [stop, error] =
            std::from_chars(field.data(), field.data() + field.size(), value);
        if (error == std::errc{} && stop == field.data() + field.size()) return true;
        issues_.add(place(), field.empty() ? "an empty field" : quoted_text(field), what);
        return false;
    }

    void read_node(std::string_view line)
    {
        Label label = 0;
        if (!read_label(next_field(line), label, "the number of a node")) return;
        Vec3 x = Vec3::Zero();
        for (int k = 0; k < 3 && !line.empty(); ++k) {
            const std::string_view field = next_field(line);
            double value = 0;
            const char* const end = field.data() + field.size();
            const auto [stop, error] = std::from_chars(field.data(), end, value);
            if (error != std::errc{} || stop != end) {
                std::string word(field); // 1.D0 is Fortran's, an empty field 0
                std::replace_if(
                    word.begin(), word.end(), [](char c) { return c == 'D' || c == 'd'; }, 'e');
                const auto slow = word.empty() ? std::optional<double>(0) : parse_double(word);
                if (!slow) {
                    issues_.add(place(), quoted_text(field), "a coordinate");
                    return;
                }
                value = *slow;
            }
            x[k] = value;
        }
        builder_.add_node(label, x);
        node_labels_.push_back(label);
        if (current_node_set_) current_node_set_->labels.push_back(label);
    }

    void read_element(std::string_view line)
    {
        const bool continues = line.back() == ',';
        if (record_.empty()) record_line_ = line_number_;
        while (!line.empty()) {
            const std::string_view field = next_field(line);
            if (field.empty() && line.empty()) break;
            Label value = 0;
            if (!read_label(field, value, "the number of an element or a node")) {
                record_.clear();
                return;
            }
            record_.push_back(value);
            if (record_.size() > 100) refuse_record();
        }
        if (continues && (type_.nodes == 0 || record_.size() < type_.nodes + 1)) return;
        if (record_.size() < 2 || (type_.nodes > 0 && record_.size() != type_.nodes + 1))
            refuse_record();
        const Label label = record_[0];
        const auto nodes = std::span<const Label>(record_).subspan(1);
        if (type_.use == AbaqusType::Use::solid)
            builder_.add_element(type_.kind, label, nodes);
        else if (type_.use == AbaqusType::Use::facet)
            builder_.add_facet(label, nodes.first(type_.corners));
        else
            builder_.add_line_or_point(label, nodes);
        element_labels_.push_back(label);
        element_types_.push_back(type_);
        if (current_element_set_) current_element_set_->labels.push_back(label);
        record_.clear();
    }

    [[noreturn]] void refuse_record()
    {
        const std::string count = record_.empty() ? "0" : std::to_string(record_.size() - 1);
        issues_.fatal(line_place(record_line_),
                      "an element of type " + type_name_ + " with " + count + " nodes",
                      type_.nodes > 0 ? std::to_string(type_.nodes) + " nodes" : "its nodes");
    }

    void read_members(std::string_view line, RawSet& set, std::map<std::string, RawSet>& sets)
    {
        if (generate_) {
            Range range;
            if (!read_label(next_field(line), range.first, "the first number of a range")) return;
            range.last = range.first;
            if (!line.empty() && !read_label(next_field(line), range.last, "the last number"))
                return;
            if (const std::string_view field = next_field(line);
                !field.empty() && !read_label(field, range.step, "the step of a range"))
                return;
            if (range.step <= 0 || range.last < range.first)
                issues_.add(place(), "a range that does not increase", "first, last, step > 0");
            else
                set.ranges.push_back(range);
            return;
        }
        while (!line.empty()) {
            const std::string_view field = next_field(line);
            if (field.empty()) continue;
            if (std::isdigit(static_cast<unsigned char>(field[0])) || field[0] == '-') {
                Label label = 0;
                if (read_label(field, label, "a number or the name of a set"))
                    set.labels.push_back(label);
                continue;
            }
            const RawSet* const other = find(sets, field);
            const std::string_view tail = field.substr(field.rfind('.') + 1);
            Label label = 0;
            if (const auto [stop, error] =
                    std::from_chars(tail.data(), tail.data() + tail.size(), label);
                !other && error == std::errc{} && stop == tail.data() + tail.size() &&
                tail.size() < field.size()) { // INSTANCE.7
                set.labels.push_back(label);
                continue;
            }
            if (!other) {
                issues_.add(place(), "set " + quoted_text(field), "a set that was defined before");
            } else if (other != &set) {
                if (set.labels.size() + other->labels.size() > kMostMembers)
                    issues_.fatal(place(), "a set that grows without bound", "fewer members");
                set.labels.insert(set.labels.end(), other->labels.begin(), other->labels.end());
                set.ranges.insert(set.ranges.end(), other->ranges.begin(), other->ranges.end());
            }
        }
    }

    /// By name, also with the name of an instance in front.
    static const RawSet* find(const std::map<std::string, RawSet>& sets, std::string_view name)
    {
        std::string key = upper_case(name);
        auto at = sets.find(key);
        if (const std::size_t dot = key.rfind('.'); at == sets.end() && dot != std::string::npos)
            at = sets.find(key.substr(dot + 1));
        return at == sets.end() ? nullptr : &at->second;
    }

    void read_surface(std::string_view line)
    {
        const std::string_view who = next_field(line), face = next_field(line);
        if (face.empty()) {
            builder_.note("line " + std::to_string(line_number_) + ": a part of the surface " +
                          quoted_text(surface_->first) +
                          " without a face (S1, ...) is passed over");
            return;
        }
        RawFace raw{"", 0, std::string(face), line_number_};
        if (!who.empty() && std::isdigit(static_cast<unsigned char>(who[0]))) {
            if (!read_label(who, raw.element, "an element or a set")) return;
        } else {
            raw.set = who;
        }
        surface_->second.push_back(std::move(raw));
    }

    // ---- the end

    /// All labels of a set; those of a range that no thing has are left out.
    std::vector<Label> members(const RawSet& set, const LabelMap& map, std::size_t things)
    {
        std::vector<Label> all = set.labels;
        std::size_t missing = 0;
        for (const Range& r : set.ranges) {
            const auto count =
                (static_cast<std::uint64_t>(r.last) - static_cast<std::uint64_t>(r.first)) /
                    static_cast<std::uint64_t>(r.step) +
                1;
            if (count > 4 * things + 10000 || all.size() > kMostMembers) {
                issues_.add("set " + quoted_text(set.name),
                            "a range of " + std::to_string(count) + " numbers",
                            "no more than there are nodes or elements");
                continue;
            }
            Label label = r.first;
            for (std::uint64_t k = 0; k < count; ++k, label += k < count ? r.step : 0) {
                if (map.find(label) >= 0)
                    all.push_back(label);
                else
                    ++missing;
            }
        }
        if (missing > 0 && noted_.gaps.insert(set.line).second)
            builder_.note("set " + quoted_text(set.name) + ": " + std::to_string(missing) +
                          " numbers of a range belong to nothing");
        return all;
    }

    void finish()
    {
        if (!noted_.passed_over.empty()) builder_.note("passed over: " + noted_.passed_over);
        const LabelMap nodes(node_labels_), elements(element_labels_);
        for (const auto& [key, set] : node_sets_) {
            const std::size_t to = builder_.node_set(set.name);
            for (const Label label : members(set, nodes, node_labels_.size()))
                builder_.add_to_node_set(to, label);
        }
        for (const auto& [key, set] : element_sets_) {
            const std::size_t to = builder_.group(set.name, 3);
            for (const Label label : members(set, elements, element_labels_.size()))
                builder_.add_label_to_group(to, label);
        }
        std::size_t added = 0;
        for (const auto& [key, surface] : surfaces_) {
            const std::size_t to = builder_.face_set(surface.first);
            for (const RawFace& raw : surface.second) {
                const RawSet* const set = raw.set.empty() ? nullptr : find(element_sets_, raw.set);
                if (!raw.set.empty() && !set) {
                    issues_.add(line_place(raw.line), "set " + quoted_text(raw.set),
                                "a set of elements");
                    continue;
                }
                const std::vector<Label> of = set ? members(*set, elements, element_labels_.size())
                                                  : std::vector<Label>{raw.element};
                if ((added += of.size()) > kMostMembers)
                    issues_.fatal(line_place(raw.line), "surfaces that grow without bound",
                                  "fewer faces");
                for (const Label label : of)
                    add_face(to, label, raw, elements);
            }
        }
    }

    void add_face(std::size_t set, Label label, const RawFace& raw, const LabelMap& elements)
    {
        const std::int32_t e = elements.find(label);
        if (e < 0) {
            issues_.add(line_place(raw.line), "element " + std::to_string(label),
                        "an element of the file");
            return;
        }
        const AbaqusType& type = element_types_[static_cast<std::size_t>(e)];
        const std::int32_t face =
            type.use == AbaqusType::Use::solid ? abaqus_face(type.kind, raw.face) : -1;
        if (face < 0)
            issues_.add(line_place(raw.line),
                        "face " + quoted_text(raw.face) + " of element " + std::to_string(label),
                        "S1 to S4 of a tetrahedron, S1 to S6 of a hexahedron");
        else
            builder_.add_to_face_set(set, label, face);
    }

    static constexpr std::size_t kMostMembers = 200'000'000; // sets of sets can double each line

    std::string_view rest_;
    bool cut_ = false;
    FileIssues& issues_;
    VolumeBuilder& builder_;
    std::size_t line_number_ = 0, keyword_line_ = 0, step_line_ = 0;
    Assembly assembly_;
    bool generate_ = false;
    Section section_ = Section::skipped;
    AbaqusType type_;
    std::string type_name_;
    std::vector<Label> record_; // of an element that continues in the next line
    std::size_t record_line_ = 0;
    std::vector<Label> node_labels_, element_labels_;
    std::vector<AbaqusType> element_types_;
    std::map<std::string, RawSet> node_sets_, element_sets_; // by upper case name
    RawSet* current_node_set_ = nullptr;
    RawSet* current_element_set_ = nullptr;
    std::map<std::string, std::pair<std::string, std::vector<RawFace>>> surfaces_;
    std::pair<std::string, std::vector<RawFace>>* surface_ = nullptr;
    NotedOnce noted_;
};

} // namespace

VolumeFile parse_abaqus(std::string_view text, const std::string& file, double scale)
{
    FileIssues issues(file);
    VolumeBuilder builder(issues, scale);
    builder.set_element_words("elements C3D4, C3D10 or C3D8");
    if (AbaqusReader(without_byte_order_mark(text), issues, builder).read()) builder.note_cut(file);
    return builder.finish();
}

} // namespace amontons
