#include "solver/output/vtk/result_files.hpp"

#include <vtkNew.h>
#include <vtkSmartPointer.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLUtilities.h>

#include <algorithm>
#include <fstream>
#include <sstream>

namespace amontons::vtk_module {
namespace {

/// The cells of a CSV line, without quotes and outer blanks.
std::vector<std::string> cells_of(const std::string& line)
{
    std::vector<std::string> cells;
    std::istringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) {
        const std::size_t first = cell.find_first_not_of(" \"\r");
        const std::size_t last = cell.find_last_not_of(" \"\r");
        cells.push_back(first == std::string::npos ? "" : cell.substr(first, last - first + 1));
    }
    return cells;
}

/// "depth" is the name of "depth", "depth [m]" and "depth_m", but not of "depth_rate [m/s]".
bool is_named(const std::string& heading, const std::string& name)
{
    if (heading.compare(0, name.size(), name) != 0) return false;
    const std::string rest = heading.substr(name.size());
    return rest.empty() || rest[0] == ' ' || rest[0] == '[' || rest[0] == '(' || rest == "_m" ||
           rest == "_N" || rest == "_s";
}

} // namespace

std::vector<Frame> read_collection(const std::filesystem::path& pvd, std::string& error)
{
    error.clear();
    const auto root = vtkSmartPointer<vtkXMLDataElement>::Take(
        vtkXMLUtilities::ReadElementFromFile(pvd.string().c_str()));
    vtkXMLDataElement* collection = root ? root->FindNestedElementWithName("Collection") : nullptr;
    if (!collection) {
        error = pvd.string() + ": not a collection of VTK files";
        return {};
    }
    std::vector<Frame> frames;
    for (int i = 0; i < collection->GetNumberOfNestedElements(); ++i) {
        vtkXMLDataElement* entry = collection->GetNestedElement(i);
        const char* file = entry->GetAttribute("file");
        if (!file) {
            error = pvd.string() + ": entry " + std::to_string(i) + " names no file";
            return {};
        }
        Frame frame;
        entry->GetScalarAttribute("timestep", frame.time);
        if (const char* name = entry->GetAttribute("name")) frame.name = name;
        frame.file = pvd.parent_path() / file;
        frames.push_back(frame);
    }
    return frames;
}

std::vector<std::filesystem::path> collections_in(const std::filesystem::path& folder)
{
    std::vector<std::filesystem::path> found;
    std::error_code ignored; // an unreadable folder is an empty one; the caller reports it
    for (const auto& entry : std::filesystem::directory_iterator(folder, ignored))
        if (entry.path().extension() == ".pvd") found.push_back(entry.path());
    std::sort(found.begin(), found.end());
    return found;
}

std::vector<double> read_history_column(const std::filesystem::path& csv, const std::string& name)
{
    std::ifstream stream(csv);
    std::string line;
    if (!std::getline(stream, line)) return {};
    const std::vector<std::string> headings = cells_of(line);
    const auto heading = std::find_if(headings.begin(), headings.end(),
                                      [&](const std::string& h) { return is_named(h, name); });
    if (heading == headings.end()) return {};
    const auto column = static_cast<std::size_t>(heading - headings.begin());
    std::vector<double> values;
    while (std::getline(stream, line)) {
        const std::vector<std::string> cells = cells_of(line);
        if (column >= cells.size()) break; // a torn last line of a killed run
        try {
            values.push_back(std::stod(cells[column]));
        } catch (const std::exception&) {
            break;
        }
    }
    return values;
}

std::vector<std::string> history_prefixes(const std::filesystem::path& csv, const std::string& end)
{
    std::ifstream stream(csv);
    std::string line;
    std::getline(stream, line);
    std::vector<std::string> found;
    for (const std::string& heading : cells_of(line)) {
        const std::string name = heading.substr(0, heading.find(" ["));
        if (name.ends_with(end)) found.push_back(name.substr(0, name.size() - end.size()));
    }
    return found;
}

} // namespace amontons::vtk_module
