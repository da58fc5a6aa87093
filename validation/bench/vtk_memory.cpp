// What VTK itself takes to draw off-screen: a sphere in a window of the given size, read back in
// bands as `amontons render` does. Build the target `vtk_memory`, and run
//
//     /usr/bin/time -v xvfb-run -a build/release/bin/vtk_memory 2000 1600
//
// "Maximum resident set size" is that of the largest process, which is the program printed below.

#include <vtkActor.h>
#include <vtkNew.h>
#include <vtkPolyDataMapper.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSphereSource.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <sys/resource.h>

namespace {

double peak() // [MB]
{
    rusage use{};
    getrusage(RUSAGE_SELF, &use);
    return double(use.ru_maxrss) / 1e3 * 1.024;
}

} // namespace

int main(int count, char** words)
{
    const int wide = count > 1 ? std::atoi(words[1]) : 0,
              high = count > 2 ? std::atoi(words[2]) : 0;
    if (wide < 1 || high < 1) {
        std::fprintf(stderr, "vtk_memory WIDTH HEIGHT\n");
        return 2;
    }
    std::printf("loaded: %.0f MB\n", peak());
    vtkNew<vtkSphereSource> sphere;
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputConnection(sphere->GetOutputPort());
    vtkNew<vtkActor> actor;
    actor->SetMapper(mapper);
    vtkNew<vtkRenderer> renderer;
    renderer->AddActor(actor);
    vtkNew<vtkRenderWindow> window;
    window->SetOffScreenRendering(true);
    window->SetShowWindow(false);
    window->SetMultiSamples(0);
    window->SetAlphaBitPlanes(true);
    window->AddRenderer(renderer);
    window->SetSize(wide, high);
    window->Render();
    std::printf("drawn: %.0f MB\n", peak());
    vtkNew<vtkUnsignedCharArray> drawn;
    constexpr int kBand = 128;
    for (int from = 0; from < high; from += kBand)
        window->GetPixelData(0, from, wide - 1, std::min(from + kBand, high) - 1, 0, drawn);
    std::printf("read: %.0f MB\n", peak());
}
