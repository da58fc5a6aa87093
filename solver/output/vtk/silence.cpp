#include "solver/output/vtk/silence.hpp"

#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkSmartPointer.h>

namespace amontons::vtk_module {
namespace {

class NoWindow : public vtkOutputWindow {
public:
    static NoWindow* New();
    vtkTypeMacro(NoWindow, vtkOutputWindow);
    void DisplayText(const char*) override {}
};
vtkStandardNewMacro(NoWindow);

} // namespace

struct Silence::Before {
    vtkSmartPointer<vtkOutputWindow> window = vtkOutputWindow::GetInstance();
    vtkLogger::Verbosity verbosity = vtkLogger::GetCurrentVerbosityCutoff();
};

Silence::Silence() : before_(std::make_unique<Before>())
{
    vtkOutputWindow::SetInstance(vtkNew<NoWindow>());
    vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
}

Silence::~Silence()
{
    vtkOutputWindow::SetInstance(before_->window);
    vtkLogger::SetStderrVerbosity(before_->verbosity);
}

} // namespace amontons::vtk_module
