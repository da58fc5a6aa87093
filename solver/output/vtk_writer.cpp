#include "solver/output/vtk_writer.hpp"

#include <bit>
#include <cstring>
#include <fmt/format.h>
#include <utility>

namespace amontons {
namespace {

const char* const kByteOrder =
    std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian";

/// An XML head that describes arrays, and the raw bytes that follow it.
class Document {
public:
    Document(const char* type, double time, const std::vector<VtkTexts>& texts = {})
    {
        add("<?xml version=\"1.0\"?>\n<VTKFile type=\"{0}\" version=\"1.0\" "
            "byte_order=\"{1}\" header_type=\"UInt64\">\n<{0}>\n<FieldData>\n<DataArray "
            "type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" "
            "format=\"ascii\">{2}</DataArray>\n",
            type, kByteOrder, time);
        // VTK's texts are the numbers of their bytes, each text with a 0 at its end.
        for (const VtkTexts& t : texts) {
            add("<Array type=\"String\" Name=\"{}\" NumberOfTuples=\"{}\" "
                "format=\"ascii\">",
                t.name, t.values.size());
            for (const std::string& value : t.values) {
                for (const char c : value)
                    add("{} ", static_cast<unsigned char>(c));
                head_ += "0 ";
            }
            head_ += "</Array>\n";
        }
        head_ += "</FieldData>\n";
        type_ = type;
    }

    void line(std::string_view text)
    {
        head_ += text;
        head_ += '\n';
    }

    template <class... Values> void format(fmt::string_view text, const Values&... values)
    {
        head_ += fmt::format(fmt::runtime(text), values...);
        head_ += '\n';
    }

    void points(std::span<const Vec3> points, Stored stored)
    {
        static_assert(sizeof(Vec3) == 3 * sizeof(double));
        line("<Points>");
        const double* first = points.empty() ? nullptr : points[0].data();
        array({"points", "m", 3, {first, 3 * points.size()}, stored});
        line("</Points>");
    }

    void array(const VtkArray& a)
    {
        const char* type = a.stored == Stored::float64   ? "Float64"
                           : a.stored == Stored::float32 ? "Float32"
                                                         : "Int32";
        describe(type, a.name, a.components, a.unit);
        switch (a.stored) {
        case Stored::float64:
            append(a.values.data(), a.values.size_bytes());
            break;
        case Stored::float32:
            append_as<float>(a.values);
            break;
        case Stored::int32:
            append_as<std::int32_t>(a.values);
            break;
        }
    }

    void arrays(const char* element, const std::vector<VtkArray>& arrays)
    {
        format("<{}>", element);
        for (const VtkArray& a : arrays)
            array(a);
        format("</{}>", element);
    }

    template <class Integer> void integers(const char* name, std::span<const Integer> values)
    {
        describe(sizeof(Integer) == 1 ? "UInt8" : "Int32", name, 1, "");
        append(values.data(), values.size_bytes());
    }

    std::string finish() &&
    {
        add("</{}>\n<AppendedData encoding=\"raw\">\n_", type_);
        head_ += raw_;
        head_ += "\n</AppendedData>\n</VTKFile>\n";
        return std::move(head_);
    }

private:
    template <class... Values> void add(fmt::format_string<Values...> text, Values&&... values)
    {
        head_ += fmt::format(text, std::forward<Values>(values)...);
    }

    void describe(const char* type, std::string_view name, int components, std::string_view unit)
    {
        add("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" "
            "format=\"appended\" offset=\"{}\"",
            type, name, components, raw_.size());
        if (unit.empty())
            line("/>");
        else
            format("><InformationKey name=\"UNITS_LABEL\" location=\"vtkDataArray\">{}"
                   "</InformationKey></DataArray>",
                   unit);
    }

    char* grow(std::size_t size)
    {
        const std::uint64_t count = size;
        const std::size_t start = raw_.size();
        raw_.resize(start + sizeof count + size);
        std::memcpy(raw_.data() + start, &count, sizeof count);
        return raw_.data() + start + sizeof count;
    }

    void append(const void* bytes, std::size_t size)
    {
        char* to = grow(size);
        if (size > 0) std::memcpy(to, bytes, size);
    }

    template <class Number> void append_as(std::span<const double> values)
    {
        char* to = grow(values.size() * sizeof(Number));
        for (const double v : values) {
            const Number n = static_cast<Number>(v);
            std::memcpy(to, &n, sizeof n);
            to += sizeof n;
        }
    }

    std::string type_, head_, raw_;
};

} // namespace

std::string vtp_bytes(const PolyData& data, double time)
{
    Document d("PolyData", time, data.texts);
    const std::size_t vertices = data.vertices ? data.points.size() : 0;
    d.format("<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"{}\" NumberOfLines=\"{}\" "
             "NumberOfStrips=\"0\" NumberOfPolys=\"{}\">",
             data.points.size(), vertices, data.lines.size(), data.triangles.size());
    d.points(data.points, data.stored);
    d.arrays("PointData", data.point_arrays);

    std::vector<std::int32_t> connectivity, offsets;
    const auto cells = [&](const char* element) {
        d.format("<{}>", element);
        d.integers<std::int32_t>("connectivity", connectivity);
        d.integers<std::int32_t>("offsets", offsets);
        d.format("</{}>", element);
        connectivity.clear();
        offsets.clear();
    };
    for (std::size_t i = 0; i < vertices; ++i) {
        connectivity.push_back(static_cast<std::int32_t>(i));
        offsets.push_back(static_cast<std::int32_t>(i + 1));
    }
    cells("Verts");
    for (const std::vector<std::int32_t>& line : data.lines) {
        connectivity.insert(connectivity.end(), line.begin(), line.end());
        offsets.push_back(static_cast<std::int32_t>(connectivity.size()));
    }
    cells("Lines");
    connectivity.reserve(3 * data.triangles.size());
    offsets.reserve(data.triangles.size());
    for (const auto& t : data.triangles) {
        connectivity.insert(connectivity.end(), t.begin(), t.end());
        offsets.push_back(static_cast<std::int32_t>(connectivity.size()));
    }
    cells("Polys");
    d.line("</Piece>");
    return std::move(d).finish();
}

std::string vtu_bytes(const UnstructuredGrid& grid, double time)
{
    Document d("UnstructuredGrid", time, grid.texts);
    d.format("<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">", grid.points.size(),
             grid.types.size());
    d.points(grid.points, Stored::float64);
    d.arrays("PointData", grid.point_arrays);
    d.arrays("CellData", grid.cell_arrays);
    d.line("<Cells>");
    d.integers("connectivity", grid.connectivity);
    d.integers("offsets", grid.offsets);
    d.integers("types", grid.types);
    d.line("</Cells>");
    d.line("</Piece>");
    return std::move(d).finish();
}

void Collection::add(const PvdEntry& e)
{
    entries_ += fmt::format("<DataSet timestep=\"{}\" part=\"{}\" name=\"{}\" file=\"{}\"/>\n",
                            e.time, e.part, e.name, e.file);
}

std::string Collection::bytes() const
{
    return fmt::format("<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" "
                       "byte_order=\"{}\">\n<Collection>\n{}</Collection>\n</VTKFile>\n",
                       kByteOrder, entries_);
}

} // namespace amontons
