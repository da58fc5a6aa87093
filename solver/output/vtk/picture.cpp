#include "solver/output/vtk/drawn_result.hpp"
#include "solver/output/vtk/page.hpp"
#include "solver/output/vtk/virtual_display.hpp"
#include "solver/output/vtk/vtk_module.hpp"

#include <vtkActor.h>
#include <vtkArrowSource.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkColorTransferFunction.h>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkGlyph3D.h>
#include <vtkImageShrink3D.h>
#include <vtkLogger.h>
#include <vtkLookupTable.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPNGWriter.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkPolyDataNormals.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkScalarBarActor.h>
#include <vtkSmartPointer.h>
#include <vtkSphereSource.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkTubeFilter.h>
#include <vtkUnsignedCharArray.h>
#include <vtkWindowToImageFilter.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <unistd.h>

// A page of four panels: the end of the run large, three earlier instants small beside it, and
// a legend. All panels share the camera, along the thinnest axis of the walls' box, and the
// colour scales: blue is the wire's curvature, yellow to red the force of its contacts.

namespace {

using namespace amontons::vtk_module;

constexpr int kOversampling = 2;    // drawn larger, then averaged: smooth edges
constexpr double kThinnestWire = 7; // drawn at least this wide, large panel [pixels]
constexpr Vec kInk = {0.1, 0.1, 0.1};

// ---- colours

/// A scale from 0 to `largest`, rounded up so that it has up to six round steps.
struct Scale {
    vtkSmartPointer<vtkLookupTable> table;
    int steps = 5;
};

Scale make_scale(const std::vector<Vec>& stops, double largest)
{
    Scale scale;
    double step = 0.2;
    if (largest > 0)
        for (const double round : {0.1, 0.2, 0.25, 0.5, 1.0, 2.0}) {
            step = round * std::pow(10.0, std::floor(std::log10(largest)));
            if (step * 6 > largest * (1 - 1e-9)) break;
        }
    scale.steps = std::max(1, static_cast<int>(std::ceil(largest / step * (1 - 1e-9))));

    vtkNew<vtkColorTransferFunction> ramp;
    for (std::size_t i = 0; i < stops.size(); ++i)
        ramp->AddRGBPoint(static_cast<double>(i) / static_cast<double>(stops.size() - 1),
                          stops[i][0], stops[i][1], stops[i][2]);
    scale.table = vtkSmartPointer<vtkLookupTable>::New();
    scale.table->SetNumberOfTableValues(256);
    for (int i = 0; i < 256; ++i) {
        const double* colour = ramp->GetColor(i / 255.0);
        scale.table->SetTableValue(i, colour[0], colour[1], colour[2], 1);
    }
    scale.table->SetRange(0, scale.steps * step);
    return scale;
}

struct Scales {
    Scale curvature, force;
};

// ---- parts of a panel

/// Glass: nearly clear where one looks straight at it, denser towards its outline. Its colour
/// is the same everywhere, so the order in which layers are blended does not matter and no
/// depth peeling is needed.
vtkSmartPointer<vtkActor> wall_actor(const Poly& wall, const View& view)
{
    vtkNew<vtkPolyDataNormals> normals;
    normals->SetInputData(wall);
    normals->SplittingOff();
    normals->ConsistencyOff();
    normals->Update();
    vtkNew<vtkPolyData> glass;
    glass->ShallowCopy(normals->GetOutput());
    vtkDataArray* normal = glass->GetPointData()->GetNormals();
    vtkNew<vtkUnsignedCharArray> rgba;
    rgba->SetNumberOfComponents(4);
    rgba->SetNumberOfTuples(glass->GetNumberOfPoints());
    for (vtkIdType i = 0; i < glass->GetNumberOfPoints(); ++i) {
        Vec n = view.towards_eye;
        if (normal) normal->GetTuple(i, n.data());
        const double grazing = 1 - std::min(1.0, std::abs(dot(n, view.towards_eye)));
        rgba->SetTuple4(i, 176, 88, 80, 255 * (0.04 + 0.40 * std::pow(grazing, 1.8)));
    }
    glass->GetPointData()->SetScalars(rgba);

    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(glass);
    mapper->SetColorModeToDirectScalars();
    auto actor = vtkSmartPointer<vtkActor>::New();
    actor->SetMapper(mapper);
    actor->GetProperty()->LightingOff();
    actor->ForceTranslucentOn();
    return actor;
}

/// @param thinnest  smallest radius to draw [m]
vtkSmartPointer<vtkActor> wire_actor(const Poly& wire, double thinnest, const Scales& scales)
{
    vtkNew<vtkPolyData> line;
    line->ShallowCopy(wire);
    vtkDataArray* own = wire->GetPointData()->GetArray("radius");
    vtkNew<vtkDoubleArray> radius;
    radius->SetName("drawn_radius");
    radius->SetNumberOfTuples(line->GetNumberOfPoints());
    for (vtkIdType i = 0; i < line->GetNumberOfPoints(); ++i)
        radius->SetValue(i, std::max(thinnest, own ? own->GetTuple1(i) : 0.0));
    line->GetPointData()->AddArray(radius);
    line->GetPointData()->SetActiveScalars("drawn_radius");

    vtkNew<vtkTubeFilter> tube;
    tube->SetInputData(line);
    tube->SetVaryRadiusToVaryRadiusByAbsoluteScalar();
    tube->SetNumberOfSides(20);
    tube->CappingOn();
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputConnection(tube->GetOutputPort());
    if (wire->GetPointData()->HasArray("curvature")) {
        mapper->SetScalarModeToUsePointFieldData();
        mapper->SelectColorArray("curvature");
        mapper->SetLookupTable(scales.curvature.table);
        mapper->UseLookupTableScalarRangeOn();
    } else {
        mapper->ScalarVisibilityOff();
    }
    auto actor = vtkSmartPointer<vtkActor>::New();
    actor->SetMapper(mapper);
    actor->GetProperty()->SetColor(0.1, 0.2, 0.4);
    actor->GetProperty()->SetAmbient(0.5);
    actor->GetProperty()->SetDiffuse(0.5);
    return actor;
}

/// A ball at each cluster and an arrow along its force, both coloured by it.
void add_contacts(vtkRenderer* renderer, const std::vector<Cluster>& clusters, double ball,
                  double arrow_per_newton, const Scales& scales)
{
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    vtkNew<vtkDoubleArray> force, magnitude;
    force->SetName("force");
    force->SetNumberOfComponents(3);
    magnitude->SetName("magnitude");
    for (const Cluster& cluster : clusters) {
        points->InsertNextPoint(cluster.point.data());
        force->InsertNextTuple(cluster.force.data());
        magnitude->InsertNextValue(cluster.magnitude);
    }
    vtkNew<vtkPolyData> centres;
    centres->SetPoints(points);
    centres->GetPointData()->SetVectors(force);
    centres->GetPointData()->SetScalars(magnitude);

    const auto add = [&](vtkAlgorithm* shape, bool by_force, double factor) {
        vtkNew<vtkGlyph3D> glyph;
        glyph->SetInputData(centres);
        glyph->SetSourceConnection(shape->GetOutputPort());
        glyph->SetColorModeToColorByScalar();
        glyph->SetVectorModeToUseVector();
        if (by_force)
            glyph->SetScaleModeToScaleByVector();
        else
            glyph->SetScaleModeToDataScalingOff();
        glyph->SetScaleFactor(factor);
        vtkNew<vtkPolyDataMapper> mapper;
        mapper->SetInputConnection(glyph->GetOutputPort());
        mapper->SetLookupTable(scales.force.table);
        mapper->UseLookupTableScalarRangeOn();
        vtkNew<vtkActor> actor;
        actor->SetMapper(mapper);
        actor->GetProperty()->SetAmbient(0.5);
        actor->GetProperty()->SetDiffuse(0.5);
        renderer->AddActor(actor);
    };
    vtkNew<vtkSphereSource> sphere;
    sphere->SetRadius(1);
    sphere->SetThetaResolution(24);
    sphere->SetPhiResolution(16);
    add(sphere, false, ball);
    vtkNew<vtkArrowSource> arrow;
    arrow->SetShaftRadius(0.03);
    arrow->SetTipRadius(0.09);
    arrow->SetTipLength(0.28);
    arrow->SetShaftResolution(24);
    arrow->SetTipResolution(32);
    add(arrow, true, arrow_per_newton);
}

/// @param x, y  of the text's upper left corner in the panel [pixels of the picture]
vtkSmartPointer<vtkTextActor> text_actor(const std::string& text, int size, double x, double y)
{
    auto actor = vtkSmartPointer<vtkTextActor>::New();
    actor->SetInput(text.c_str());
    actor->GetTextProperty()->SetFontSize(size * kOversampling);
    actor->GetTextProperty()->SetColor(kInk[0], kInk[1], kInk[2]);
    actor->GetTextProperty()->SetVerticalJustificationToTop();
    actor->GetTextProperty()->SetLineSpacing(1.2);
    actor->SetPosition(x * kOversampling, y * kOversampling);
    return actor;
}

/// A bar of known length in the lower left corner of a panel.
void add_length_bar(vtkRenderer* renderer, const View& view, const Rectangle& panel, const Fit& map)
{
    const double length = round_down(0.25 * panel.width() * map.pixel);
    const double x = map.x + (30 - 0.5 * panel.width()) * map.pixel;
    const double y = map.y + (30 - 0.5 * panel.height()) * map.pixel;
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    vtkNew<vtkCellArray> cells;
    cells->InsertNextCell(4);
    const double thick = 5 * map.pixel;
    for (const auto& [right, up] : {std::array{0.0, 0.0}, std::array{length, 0.0},
                                    std::array{length, thick}, std::array{0.0, thick}}) {
        Vec p{};
        for (std::size_t i = 0; i < 3; ++i)
            p[i] = view.right[i] * (x + right) + view.up[i] * (y + up) +
                   view.towards_eye[i] * (view.behind + view.deep);
        cells->InsertCellPoint(points->InsertNextPoint(p.data()));
    }
    vtkNew<vtkPolyData> bar;
    bar->SetPoints(points);
    bar->SetPolys(cells);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(bar);
    vtkNew<vtkActor> actor;
    actor->SetMapper(mapper);
    actor->GetProperty()->SetColor(kInk[0], kInk[1], kInk[2]);
    actor->GetProperty()->LightingOff();
    renderer->AddActor(actor);
    renderer->AddViewProp(text_actor(length_text(length), kText, 30, 42 + 1.2 * kText));
}

vtkSmartPointer<vtkRenderer> renderer_of(const Rectangle& rectangle)
{
    auto renderer = vtkSmartPointer<vtkRenderer>::New();
    renderer->SetViewport(rectangle.left / kWidth, rectangle.bottom / kHeight,
                          rectangle.right / kWidth, rectangle.top / kHeight);
    renderer->SetBackground(1, 1, 1);
    return renderer;
}

vtkSmartPointer<vtkRenderer> panel(const Rectangle& rectangle, const DrawnResult& result,
                                   std::size_t which, const View& view, const Contacts& contacts,
                                   const Scales& scales)
{
    const bool large = which == 0;
    const int letters = large ? kLargeText : kText;
    const Fit map = fit(view, rectangle, large);
    const Instant& instant = result.instants[which];
    auto renderer = renderer_of(rectangle);
    for (const Poly& wall : result.walls)
        renderer->AddActor(wall_actor(wall, view));
    const double thinnest = 0.5 * kThinnestWire * (large ? 1 : 0.7) * map.pixel;
    for (const Poly& wire : instant.wires)
        if (wire->GetNumberOfPoints() > 1) renderer->AddActor(wire_actor(wire, thinnest, scales));
    if (!contacts.clusters[which].empty())
        add_contacts(renderer, contacts.clusters[which], 1.8 * thinnest,
                     contacts.arrow / contacts.largest_force, scales);
    if (large) add_length_bar(renderer, view, rectangle, map);
    renderer->AddViewProp(
        text_actor(instant.caption, letters, 30, rectangle.height() - 0.6 * letters));

    Vec centre{}, eye{};
    for (std::size_t i = 0; i < 3; ++i) {
        centre[i] = view.right[i] * map.x + view.up[i] * map.y +
                    view.towards_eye[i] * (view.behind + 0.5 * view.deep);
        eye[i] = centre[i] + 4 * view.size * view.towards_eye[i];
    }
    vtkCamera* camera = renderer->GetActiveCamera();
    camera->ParallelProjectionOn();
    camera->SetFocalPoint(centre.data());
    camera->SetPosition(eye.data());
    camera->SetViewUp(view.up.data());
    camera->SetParallelScale(0.5 * rectangle.height() * map.pixel);
    renderer->ResetCameraClippingRange();
    return renderer;
}

/// @param top  of the title in the legend, as a part of its height
void add_scale(vtkRenderer* renderer, const Rectangle& legend, const Scale& scale,
               const std::string& title, double top)
{
    vtkNew<vtkScalarBarActor> bar;
    bar->SetLookupTable(scale.table);
    bar->SetOrientationToHorizontal();
    bar->SetNumberOfLabels(scale.steps + 1);
    bar->SetLabelFormat("%.3g");
    bar->SetUnconstrainedFontSize(true);
    bar->SetMaximumNumberOfColors(256);
    bar->SetTextPositionToPrecedeScalarBar();
    bar->SetPosition(0.07, top - 0.24);
    bar->SetWidth(0.82);
    bar->SetHeight(0.14);
    bar->SetBarRatio(0.45);
    bar->SetTextPad(5 * kOversampling);
    vtkTextProperty* labels = bar->GetLabelTextProperty();
    labels->SetFontSize(kText * kOversampling);
    labels->SetColor(kInk[0], kInk[1], kInk[2]);
    labels->BoldOff();
    labels->ItalicOff();
    labels->ShadowOff();
    renderer->AddViewProp(bar);
    renderer->AddViewProp(text_actor(title, kText, 0.07 * legend.width(), top * legend.height()));
}

/// How many times too thick the large panel draws the thinnest wire; 1 if none is.
double thickening(const DrawnResult& result, double thinnest)
{
    double factor = 1;
    for (const Poly& wire : result.instants.front().wires)
        if (vtkDataArray* radius = wire->GetPointData()->GetArray("radius"))
            if (radius->GetNumberOfTuples() > 0 && radius->GetRange()[0] > 0)
                factor = std::max(factor, thinnest / radius->GetRange()[0]);
    return factor;
}

vtkSmartPointer<vtkRenderer> legend(const Layout& layout, const DrawnResult& result,
                                    const View& view, const Contacts& contacts,
                                    const Scales& scales)
{
    auto renderer = renderer_of(layout.legend);
    add_scale(renderer, layout.legend, scales.force, "Contact force on the wall [N]", 0.90);
    add_scale(renderer, layout.legend, scales.curvature, "Curvature of the wire [1/m]", 0.56);
    std::string note =
        "An arrow is the sum of the contacts within " + length_text(contacts.cluster) + ".";
    const double pixel = fit(view, layout.panels[0], true).pixel;
    const double thicker = thickening(result, 0.5 * kThinnestWire * pixel);
    if (thicker > 1.05)
        note += "\nThe wire is drawn " + number("%.2g", thicker) + " times as thick as it is.";
    renderer->AddViewProp(
        text_actor(note, kText, 0.07 * layout.legend.width(), 0.24 * layout.legend.height()));
    return renderer;
}

void write_png(vtkRenderWindow* window, const std::filesystem::path& png)
{
    vtkNew<vtkWindowToImageFilter> grab;
    grab->SetInput(window);
    grab->SetInputBufferTypeToRGB();
    grab->ReadFrontBufferOff();
    grab->ShouldRerenderOff();
    vtkNew<vtkImageShrink3D> shrink;
    shrink->SetInputConnection(grab->GetOutputPort());
    shrink->SetShrinkFactors(kOversampling, kOversampling, 1);
    shrink->MeanOn();
    vtkNew<vtkPNGWriter> writer;
    writer->SetInputConnection(shrink->GetOutputPort());
    const std::filesystem::path part = png.string() + ".part" + std::to_string(getpid());
    writer->SetFileName(part.string().c_str());
    writer->Write();
    std::error_code failed;
    if (writer->GetErrorCode() == 0 && std::filesystem::exists(part))
        std::filesystem::rename(part, png, failed);
    else
        failed = std::make_error_code(std::errc::io_error);
    if (failed) {
        std::error_code ignored;
        std::filesystem::remove(part, ignored);
        throw std::runtime_error(png.string() + ": cannot be written");
    }
}

void write_picture(const std::filesystem::path& folder, const std::filesystem::path& png)
{
    const DrawnResult result = read_result(folder);
    Contacts contacts;
    const View view = choose_view(result, contacts);
    const Layout layout = choose_layout(view);
    double largest_curvature = 0;
    for (const Instant& instant : result.instants)
        for (const Poly& wire : instant.wires)
            if (vtkDataArray* curvature = wire->GetPointData()->GetArray("curvature"))
                if (curvature->GetNumberOfTuples() > 0)
                    largest_curvature = std::max(largest_curvature, curvature->GetRange(-1)[1]);
    const Scales scales{
        make_scale({{0.56, 0.76, 0.88}, {0.26, 0.57, 0.78}, {0.13, 0.32, 0.62}, {0.03, 0.1, 0.3}},
                   largest_curvature),
        make_scale({{0.99, 0.75, 0.35}, {0.95, 0.45, 0.15}, {0.8, 0.12, 0.1}, {0.45, 0.0, 0.05}},
                   contacts.largest_force)};

    VirtualDisplay display; // outlives the window
    vtkNew<vtkRenderWindow> window;
    window->SetDisplayId(display.connection());
    window->SetOffScreenRendering(true);
    window->SetShowWindow(false);
    window->SetMultiSamples(0);
    window->SetAlphaBitPlanes(true);
    window->SetSize(kWidth * kOversampling, kHeight * kOversampling);
    for (std::size_t i = 0; i < layout.panels.size(); ++i)
        window->AddRenderer(panel(layout.panels[i], result, i, view, contacts, scales));
    window->AddRenderer(legend(layout, result, view, contacts, scales));
    window->Render();
    write_png(window, png);
    window->Finalize();
}

/// While it lives, VTK's complaints go nowhere: what matters is thrown with a text of ours.
class Silence {
public:
    Silence()
    {
        vtkOutputWindow::SetInstance(vtkNew<NoWindow>());
        vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
    }
    ~Silence()
    {
        vtkOutputWindow::SetInstance(window_);
        vtkLogger::SetStderrVerbosity(verbosity_);
    }
    Silence(const Silence&) = delete;
    Silence& operator=(const Silence&) = delete;

private:
    class NoWindow : public vtkOutputWindow {
    public:
        static NoWindow* New();
        vtkTypeMacro(NoWindow, vtkOutputWindow);
        void DisplayText(const char*) override {}
    };
    vtkSmartPointer<vtkOutputWindow> window_ = vtkOutputWindow::GetInstance();
    vtkLogger::Verbosity verbosity_ = vtkLogger::GetCurrentVerbosityCutoff();
};
vtkStandardNewMacro(Silence::NoWindow);

} // namespace

int amontons_vtk_render(const char* result_directory, const char* png, char* message,
                        int message_size)
{
    try {
        const Silence silence;
        write_picture(result_directory, png);
        return 0;
    } catch (const std::exception& error) {
        if (message && message_size > 0)
            std::snprintf(message, static_cast<std::size_t>(message_size), "%s", error.what());
        return 1;
    }
}
