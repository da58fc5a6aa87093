#include "solver/output/vtk/polydata.hpp"

#include <vtkCallbackCommand.h>
#include <vtkCellArray.h>
#include <vtkCommand.h>
#include <vtkDataArray.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

namespace amontons::vtk_module {
namespace {

/// VTK's readers take any numbers for offsets and point indices; using them then crashes.
bool are_sound(vtkCellArray* cells, vtkIdType points)
{
    if (!cells || cells->GetNumberOfCells() == 0) return true;
    if (!cells->IsValid()) return false;
    const double* range = cells->GetConnectivityArray()->GetRange();
    return cells->GetNumberOfConnectivityIds() == 0 ||
           (range[0] >= 0 && range[1] < static_cast<double>(points));
}

bool refers_to_own_points(vtkPolyData& data)
{
    for (vtkCellArray* cells :
         {data.GetVerts(), data.GetLines(), data.GetPolys(), data.GetStrips()})
        if (!are_sound(cells, data.GetNumberOfPoints())) return false;
    return true;
}

bool refers_to_own_points(vtkUnstructuredGrid& data)
{
    return are_sound(data.GetCells(), data.GetNumberOfPoints());
}

/// "ERROR: In F.cxx, line 3\nvtkReader (0x55..): Cannot open X\n\n" -> "Cannot open X; "
std::string plain(const std::string& complaint)
{
    const std::size_t object = complaint.find("): ");
    std::string text = complaint.substr(object == std::string::npos ? 0 : object + 3);
    return text.substr(0, text.find('\n')) + "; ";
}

template <class Reader, class Data>
Data* read_data(const std::filesystem::path& file, const char* kind, std::string& error)
{
    error.clear();
    if (!std::filesystem::is_regular_file(file)) {
        error = file.string() + ": no such file";
        return nullptr;
    }
    // An observer receives VTK's error messages, which otherwise would be written to stderr alone.
    vtkNew<vtkCallbackCommand> observer;
    observer->SetClientData(&error);
    observer->SetCallback([](vtkObject*, unsigned long, void* text, void* complaint) {
        *static_cast<std::string*>(text) += plain(static_cast<const char*>(complaint));
    });
    vtkNew<Reader> reader;
    reader->AddObserver(vtkCommand::ErrorEvent, observer);
    reader->AddObserver(vtkCommand::WarningEvent, observer);
    if (reader->CanReadFile(file.string().c_str()) == 0) {
        error = file.string() + ": not a VTK " + kind + " file";
        return nullptr;
    }
    reader->SetFileName(file.string().c_str());
    reader->SetReaderErrorObserver(observer);
    reader->SetParserErrorObserver(observer);
    reader->Update();
    if (!error.empty()) error = file.string() + ": " + error.substr(0, error.size() - 2);
    Data* result = reader->GetErrorCode() == 0 ? reader->GetOutput() : nullptr;
    if (!result) {
        if (error.empty()) error = file.string() + ": not a readable VTK " + kind + " file";
        return nullptr;
    }
    if (!refers_to_own_points(*result)) {
        error = file.string() + ": its cells refer to points that do not exist";
        return nullptr;
    }
    result->Register(nullptr);
    return result;
}

} // namespace

vtkPolyData* read_polydata(const std::filesystem::path& vtp, std::string& error)
{
    return read_data<vtkXMLPolyDataReader, vtkPolyData>(vtp, "polydata", error);
}

vtkUnstructuredGrid* read_grid(const std::filesystem::path& vtu, std::string& error)
{
    return read_data<vtkXMLUnstructuredGridReader, vtkUnstructuredGrid>(vtu, "grid", error);
}

} // namespace amontons::vtk_module
