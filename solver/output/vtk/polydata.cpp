#include "solver/output/vtk/polydata.hpp"

#include <vtkCallbackCommand.h>
#include <vtkCellArray.h>
#include <vtkCommand.h>
#include <vtkDataArray.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkXMLPolyDataReader.h>

namespace amontons::vtk_module {
namespace {

/// VTK's reader takes any numbers for offsets and point indices; using them then crashes.
bool refers_to_own_points(vtkPolyData& data)
{
    for (vtkCellArray* cells :
         {data.GetVerts(), data.GetLines(), data.GetPolys(), data.GetStrips()}) {
        if (cells->GetNumberOfCells() == 0) continue;
        if (!cells->IsValid()) return false;
        const double* range = cells->GetConnectivityArray()->GetRange();
        if (cells->GetNumberOfConnectivityIds() > 0 &&
            (range[0] < 0 || range[1] >= static_cast<double>(data.GetNumberOfPoints())))
            return false;
    }
    return true;
}

/// "ERROR: In F.cxx, line 3\nvtkReader (0x55..): Cannot open X\n\n" -> "Cannot open X; "
std::string plain(const std::string& complaint)
{
    const std::size_t object = complaint.find("): ");
    std::string text = complaint.substr(object == std::string::npos ? 0 : object + 3);
    return text.substr(0, text.find('\n')) + "; ";
}

} // namespace

vtkPolyData* read_polydata(const std::filesystem::path& vtp, std::string& error)
{
    error.clear();
    if (!std::filesystem::is_regular_file(vtp)) {
        error = vtp.string() + ": no such file";
        return nullptr;
    }
    // An observer takes VTK's complaints; without one they go to stderr and are lost.
    vtkNew<vtkCallbackCommand> observer;
    observer->SetClientData(&error);
    observer->SetCallback([](vtkObject*, unsigned long, void* text, void* complaint) {
        *static_cast<std::string*>(text) += plain(static_cast<const char*>(complaint));
    });
    vtkNew<vtkXMLPolyDataReader> reader;
    reader->AddObserver(vtkCommand::ErrorEvent, observer);
    reader->AddObserver(vtkCommand::WarningEvent, observer);
    if (reader->CanReadFile(vtp.string().c_str()) == 0) {
        error = vtp.string() + ": not a VTK polydata file";
        return nullptr;
    }
    reader->SetFileName(vtp.string().c_str());
    reader->SetReaderErrorObserver(observer);
    reader->SetParserErrorObserver(observer);
    reader->Update();
    if (!error.empty()) error = vtp.string() + ": " + error.substr(0, error.size() - 2);
    vtkPolyData* result = reader->GetErrorCode() == 0 ? reader->GetOutput() : nullptr;
    if (!result) {
        if (error.empty()) error = vtp.string() + ": not a readable VTK polydata file";
        return nullptr;
    }
    if (!refers_to_own_points(*result)) {
        error = vtp.string() + ": its cells refer to points that do not exist";
        return nullptr;
    }
    result->Register(nullptr);
    return result;
}

} // namespace amontons::vtk_module
