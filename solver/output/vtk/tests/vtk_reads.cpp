// vtk_reads FILE...: opens .vtp, .vtu and all that a .pvd names with VTK's own readers, as
// ParaView does. Prints what each holds; exit code 1 on any error or warning.

#include "solver/output/vtk/result_files.hpp"

#include <vtkCallbackCommand.h>
#include <vtkCommand.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <cstdio>
#include <string>

namespace {

using namespace amontons::vtk_module;

template <typename Reader> std::string read_as(const std::filesystem::path& file)
{
    std::string complaints;
    vtkNew<vtkCallbackCommand> observer;
    observer->SetClientData(&complaints);
    observer->SetCallback([](vtkObject*, unsigned long, void* text, void* complaint) {
        *static_cast<std::string*>(text) += static_cast<const char*>(complaint);
    });
    vtkNew<Reader> reader;
    reader->AddObserver(vtkCommand::ErrorEvent, observer);
    reader->AddObserver(vtkCommand::WarningEvent, observer);
    reader->SetReaderErrorObserver(observer);
    reader->SetParserErrorObserver(observer);
    if (!reader->CanReadFile(file.string().c_str())) return "not a file of this kind";
    reader->SetFileName(file.string().c_str());
    reader->Update();
    if (!complaints.empty() || reader->GetErrorCode() != 0)
        return complaints.empty() ? "unreadable" : complaints;

    vtkDataSet* data = reader->GetOutput();
    std::printf("%s: %lld points, %lld cells;", file.c_str(),
                static_cast<long long>(data->GetNumberOfPoints()),
                static_cast<long long>(data->GetNumberOfCells()));
    if (vtkDataArray* time = data->GetFieldData()->GetArray("TimeValue"))
        std::printf(" t = %.9g s;", time->GetTuple1(0));
    vtkPointData* fields = data->GetPointData();
    for (int i = 0; i < fields->GetNumberOfArrays(); ++i) {
        if (fields->GetAbstractArray(i)->GetNumberOfTuples() != data->GetNumberOfPoints())
            return std::string(fields->GetArrayName(i)) + ": not one value per point";
        std::printf(" %s", fields->GetArrayName(i));
    }
    std::printf("\n");
    return "";
}

int failures_in(const std::filesystem::path& file)
{
    std::string error;
    if (file.extension() == ".pvd") {
        int failures = 0;
        for (const Frame& frame : read_collection(file, error))
            failures += failures_in(frame.file);
        if (error.empty()) return failures;
    } else if (file.extension() == ".vtp") {
        error = read_as<vtkXMLPolyDataReader>(file);
    } else if (file.extension() == ".vtu") {
        error = read_as<vtkXMLUnstructuredGridReader>(file);
    } else {
        error = "neither .pvd nor .vtp nor .vtu";
    }
    if (!error.empty()) std::fprintf(stderr, "%s: %s\n", file.c_str(), error.c_str());
    return error.empty() ? 0 : 1;
}

} // namespace

int main(int argc, char** argv)
{
    int failures = argc > 1 ? 0 : 1;
    for (int i = 1; i < argc; ++i)
        failures += failures_in(argv[i]);
    return failures == 0 ? 0 : 1;
}
