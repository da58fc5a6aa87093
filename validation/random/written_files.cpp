#include "validation/random/written_files.hpp"

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace fs = std::filesystem;

namespace amontons::validation {
namespace {

std::string bytes_of(const std::string& path)
{
    std::ifstream in(path, std::ios::binary);
    if (!in) throw std::runtime_error(path + " is not there");
    std::ostringstream out;
    out << in.rdbuf();
    return out.str();
}

/// The value of an XML attribute in the text of a tag.
std::string attribute(const std::string& tag, const std::string& name)
{
    const std::size_t at = tag.find(" " + name + "=\"");
    if (at == std::string::npos) return "";
    const std::size_t begin = at + name.size() + 3;
    return tag.substr(begin, tag.find('"', begin) - begin);
}

std::string plain_text(std::string s)
{
    const std::pair<const char*, const char*> codes[] = {
        {"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}, {"&apos;", "'"}, {"&amp;", "&"}};
    for (const auto& [code, plain] : codes)
        for (std::size_t at = 0; (at = s.find(code, at)) != std::string::npos; ++at)
            s.replace(at, std::strlen(code), plain);
    return s;
}

template <class Number>
void append_numbers(const std::string& bytes, std::size_t at, std::size_t size,
                    std::vector<double>& out)
{
    for (std::size_t i = 0; i + sizeof(Number) <= size; i += sizeof(Number)) {
        Number value;
        std::memcpy(&value, &bytes[at + i], sizeof value);
        out.push_back(static_cast<double>(value));
    }
}

/// Cells of a line of CSV; quoted ones may have commas.
std::vector<std::string> cells_of(const std::string& line)
{
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
        const char c = line[i];
        if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
            cells.back() += '"';
            ++i;
        } else if (c == '"') {
            quoted = !quoted;
        } else if (c == ',' && !quoted) {
            cells.emplace_back();
        } else {
            cells.back() += c;
        }
    }
    return cells;
}

WrittenHistory read_history(const std::string& path)
{
    const std::string text = bytes_of(path);
    if (text.empty() || text.back() != '\n') throw std::runtime_error(path + " ends within a line");
    WrittenHistory h;
    std::istringstream lines(text);
    std::string line;
    std::getline(lines, line);
    for (const std::string& head : cells_of(line)) {
        const std::size_t at = head.find(" [");
        h.names.push_back(head.substr(0, at));
        h.units.push_back(at == std::string::npos ? "" : head.substr(at + 2, head.size() - at - 3));
    }
    while (std::getline(lines, line)) {
        const std::vector<std::string> cells = cells_of(line);
        if (cells.size() != h.names.size())
            throw std::runtime_error(fmt::format("{}: {} columns in the heading, {} in a row", path,
                                                 h.names.size(), cells.size()));
        std::vector<double> row;
        for (const std::string& c : cells) {
            char* end = nullptr;
            const double value = std::strtod(c.c_str(), &end);
            const bool number = !c.empty() && end == c.c_str() + c.size();
            row.push_back(number ? value : std::numeric_limits<double>::quiet_NaN());
        }
        h.rows.push_back(std::move(row));
    }
    if (h.rows.empty()) throw std::runtime_error(path + " has no step");
    return h;
}

std::vector<WrittenFrame> read_frames(const std::string& folder, const std::string& collection)
{
    const std::string text = bytes_of(collection);
    std::vector<WrittenFrame> frames;
    for (std::size_t at = 0; (at = text.find("<DataSet ", at)) != std::string::npos; ++at) {
        const std::string tag = text.substr(at, text.find("/>", at) - at);
        const double time = std::strtod(attribute(tag, "timestep").c_str(), nullptr);
        if (frames.empty() || frames.back().time != time) {
            if (!frames.empty() && time < frames.back().time)
                throw std::runtime_error(collection + ": times return");
            frames.push_back({time, {}});
        }
        const std::string file = folder + "/" + plain_text(attribute(tag, "file"));
        frames.back().parts[plain_text(attribute(tag, "name"))] = read_vtk(file);
    }
    return frames;
}

} // namespace

Vec3 vector_of(const Json& list)
{
    return {list.at(0).get<double>(), list.at(1).get<double>(), list.at(2).get<double>()};
}

const WrittenArray* VtkText::find(const std::string& name) const
{
    const auto at = arrays.find(name);
    return at == arrays.end() ? nullptr : &at->second;
}

const WrittenArray& VtkText::get(const std::string& name) const
{
    const WrittenArray* array = find(name);
    if (!array) throw std::runtime_error("a frame has no " + name);
    return *array;
}

std::size_t VtkText::points() const
{
    const WrittenArray* p = find("Points/points");
    return p ? p->values.size() / 3 : 0;
}

VtkText read_vtk(const std::string& path)
{
    const std::string bytes = bytes_of(path);
    const std::size_t appended = bytes.find("<AppendedData");
    const std::string tail = "</VTKFile>";
    if (appended == std::string::npos || bytes.rfind(tail) == std::string::npos ||
        bytes.rfind(tail) + tail.size() + 2 < bytes.size())
        throw std::runtime_error(path + " is not whole");
    const std::size_t data = bytes.find('_', appended) + 1;
    VtkText out;
    std::string section;
    for (std::size_t at = 0; (at = bytes.find('<', at)) < appended; ++at) {
        const std::string tag = bytes.substr(at, bytes.find('>', at) - at);
        const std::string word = tag.substr(1, tag.find_first_of(" >/", 1) - 1);
        if (word != "DataArray") {
            if (!word.empty() && word[0] != '/' && word != "InformationKey") section = word;
            continue;
        }
        const std::string name = plain_text(attribute(tag, "Name"));
        if (attribute(tag, "format") != "appended") {
            if (name == "TimeValue")
                out.time = std::strtod(&bytes[bytes.find('>', at) + 1], nullptr);
            continue;
        }
        WrittenArray array;
        array.type = attribute(tag, "type");
        array.components = std::max(1, std::atoi(attribute(tag, "NumberOfComponents").c_str()));
        const std::size_t begin =
            data + std::strtoull(attribute(tag, "offset").c_str(), nullptr, 10);
        std::uint64_t size = 0;
        if (begin + 8 > bytes.size())
            throw std::runtime_error(path + ": " + name + " lies beyond its end");
        std::memcpy(&size, &bytes[begin], 8);
        if (begin + 8 + size > bytes.size())
            throw std::runtime_error(path + ": " + name + " lies beyond its end");
        const std::size_t from = begin + 8;
        if (array.type == "Float64")
            append_numbers<double>(bytes, from, size, array.values);
        else if (array.type == "Float32")
            append_numbers<float>(bytes, from, size, array.values);
        else if (array.type == "Int32")
            append_numbers<std::int32_t>(bytes, from, size, array.values);
        else
            append_numbers<std::uint8_t>(bytes, from, size, array.values);
        for (const double v : array.values)
            if (!std::isfinite(v))
                throw std::runtime_error(path + ": " + name + " has a value that is no number");
        out.arrays[section + "/" + name] = std::move(array);
    }
    return out;
}

int WrittenHistory::column(const std::string& name) const
{
    for (std::size_t i = 0; i < names.size(); ++i)
        if (names[i] == name) return static_cast<int>(i);
    return -1;
}

std::vector<double> WrittenHistory::values(const std::string& name) const
{
    const int c = column(name);
    if (c < 0) throw std::runtime_error("history.csv has no column " + name);
    std::vector<double> out;
    for (const std::vector<double>& row : rows)
        out.push_back(row[static_cast<std::size_t>(c)]);
    return out;
}

double WrittenHistory::last(const std::string& name) const
{
    return values(name).back();
}

Vec3 WrittenHistory::vector(const std::string& name, std::size_t row) const
{
    Vec3 v;
    for (int k = 0; k < 3; ++k) {
        const int c = column(name + "_" + "xyz"[k]);
        if (c < 0) throw std::runtime_error("history.csv has no column " + name + "_" + "xyz"[k]);
        v[k] = rows[row][static_cast<std::size_t>(c)];
    }
    return v;
}

int WrittenHistory::row_at(double time) const
{
    const int c = column("time");
    for (std::size_t i = 0; c >= 0 && i < rows.size(); ++i)
        if (rows[i][static_cast<std::size_t>(c)] == time) return static_cast<int>(i);
    return -1;
}

std::size_t WrittenRun::warnings() const
{
    const auto w = manifest.find("warnings");
    return w == manifest.end() ? 0 : w->size();
}

WrittenRun read_run(const std::string& folder)
{
    WrittenRun run;
    try {
        run.manifest = Json::parse(bytes_of(folder + "/manifest.json"));
        for (const bool obstacles : {true, false})
            for (const auto& [name, body] : run.scene().at("bodies").items())
                if ((body.at("kind") == "obstacle") == obstacles) {
                    run.bodies.push_back(name);
                    run.body[name] = body;
                }
    } catch (const Json::exception& error) {
        throw std::runtime_error(folder + "/manifest.json: " + error.what());
    }
    run.history = read_history(folder + "/history.csv");
    std::string collection; // of all bodies, by the scene's name
    for (const auto& entry : fs::directory_iterator(folder))
        if (entry.path().extension() == ".pvd" && entry.path().filename() != "contacts.pvd")
            collection = entry.path().string();
    run.frames = read_frames(folder, collection.empty() ? folder + "/*.pvd" : collection);
    if (run.frames.empty()) throw std::runtime_error(folder + " has no frame");
    return run;
}

} // namespace amontons::validation
