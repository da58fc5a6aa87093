#include "mesh/format/obj.hpp"

#include "mesh/base/text.hpp"
#include "mesh/format/polygon.hpp"

#include <limits>

namespace amontons {
namespace {

class ObjReader {
public:
    ObjReader(std::string_view text, double scale, FileIssues& issues)
        : words_(text)
        , scale_(scale)
        , issues_(issues)
    {
    }

    SurfaceMesh read()
    {
        while (!words_.at_end()) {
            const std::string_view word = next();
            if (word == "v")
                vertex();
            else if (word == "f")
                face();
            while (!next().empty()) // to the end of the line, over its continuations
                ;
            words_.rest_of_line();
        }
        append_faces(mesh_, faces_, {"line", 1}, issues_);
        refuse_empty(mesh_, issues_);
        issues_.throw_if_any();
        return std::move(mesh_);
    }

private:
    // The next word of the line; a line continues behind a "\" at its end.
    std::string_view next()
    {
        for (;;) {
            const std::string_view word = words_.next_in_line();
            if (word.starts_with('#')) {
                const std::size_t comment =
                    std::min(words_.rest().find('\n'), words_.rest().size());
                words_.skip(comment);
                return "";
            }
            if (word != "\\") return word;
            words_.rest_of_line();
        }
    }

    void vertex()
    {
        const std::size_t line = words_.line();
        Vec3 x = Vec3::Zero();
        for (int i = 0; i < 3; ++i) {
            const std::string_view word = next();
            const std::optional<double> number = parse_double(word);
            if (!number) {
                issues_.add(line_place(line),
                            word.empty() ? "the end of the line" : quoted_text(word),
                            "a vertex of 3 numbers");
                break;
            }
            x[i] = *number;
        }
        Vec3 scaled = scale_ * x;
        if (!scaled.allFinite()) scaled = finite_point(x, scale_, line_place(line), issues_);
        // Also a vertex with an Issue has its number, which later faces count on.
        mesh_.points.push_back(scaled);
        if (mesh_.points.size() > std::numeric_limits<std::int32_t>::max())
            issues_.fatal(line_place(line), "more vertices", "at most 2^31 - 1");
    }

    void face()
    {
        const std::size_t line = words_.line(), begin = faces_.corners.size();
        for (;;) {
            const std::string_view word = next();
            if (word.empty()) break;
            const auto number = parse_integer(word.substr(0, word.find('/')));
            if (!number || *number == 0) {
                issues_.add(line_place(line), quoted_text(word), "the number of a vertex, from 1");
                faces_.corners.resize(begin);
                return;
            }
            faces_.corners.push_back(
                *number > 0 ? *number - 1
                            : *number + static_cast<std::int64_t>(mesh_.points.size()));
        }
        faces_.ends.push_back(faces_.corners.size());
        faces_.places.push_back(line);
    }

    WordReader words_;
    double scale_;
    FileIssues& issues_;
    SurfaceMesh mesh_;
    PolygonList faces_;
};

} // namespace

SurfaceMesh parse_obj(std::string_view text, const std::string& file, double scale)
{
    FileIssues issues(file);
    return ObjReader(without_byte_order_mark(text), scale, issues).read();
}

std::string obj_text(const SurfaceMesh& mesh)
{
    std::string text = "# amontons\n";
    for (const Vec3& x : mesh.points) {
        text += 'v';
        for (int i = 0; i < 3; ++i) {
            text += ' ';
            append_number(text, x[i]);
        }
        text += '\n';
    }
    for (const auto& triangle : mesh.triangles) {
        text += 'f';
        for (const std::int32_t corner : triangle)
            text.append(" ").append(std::to_string(corner + 1));
        text += '\n';
    }
    return text;
}

} // namespace amontons
