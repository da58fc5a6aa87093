#include "solver/output/vtk/polydata.hpp"

#include <vtkCallbackCommand.h>
#include <vtkCommand.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkXMLPolyDataReader.h>

namespace amontons::vtk_module {

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
        *static_cast<std::string*>(text) += static_cast<const char*>(complaint);
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
    vtkPolyData* result = reader->GetErrorCode() == 0 ? reader->GetOutput() : nullptr;
    if (!result) {
        if (error.empty()) error = vtp.string() + ": not a readable VTK polydata file";
        return nullptr;
    }
    result->Register(nullptr);
    return result;
}

} // namespace amontons::vtk_module
