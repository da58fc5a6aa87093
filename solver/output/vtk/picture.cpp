#include "solver/output/vtk/bodies_picture.hpp"
#include "solver/output/vtk/drawing.hpp"
#include "solver/output/vtk/silence.hpp"
#include "solver/output/vtk/virtual_display.hpp"
#include "solver/output/vtk/vtk_module.hpp"

#include <vtkActor.h>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkLookupTable.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkTextActor.h>
#include <vtkTubeFilter.h>

#include <algorithm>
#include <cstdio>
#include <stdexcept>

// A page of four panels: the end of the run large, three earlier instants small beside it, and
// a legend. All panels share the camera, along the thinnest axis of the walls' box, and the
// colour scales: blue is the wire's curvature, yellow to red the force of its contacts.

namespace {

using namespace amontons::vtk_module;

constexpr double kThinnestWire = 7; // drawn at least this wide, large panel [pixels]

struct Scales {
    Scale curvature, force;
};

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
        mapper->SetLookupTable(table_of(scales.curvature));
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

vtkSmartPointer<vtkRenderer> panel(const Rectangle& rectangle, const RenderData& result,
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
    for (const Poly& solid : instant.solids) { // a wall that is compliant
        const auto faces = vtkSmartPointer<vtkPolyData>::New();
        faces->ShallowCopy(solid);
        faces->SetLines(nullptr);
        renderer->AddActor(wall_actor(faces, view));
    }
    for (const Poly& body : instant.rigids) {
        vtkNew<vtkPolyDataMapper> mapper;
        mapper->SetInputData(body);
        mapper->ScalarVisibilityOff();
        vtkNew<vtkActor> actor;
        actor->SetMapper(mapper);
        actor->GetProperty()->SetColor(0.62, 0.62, 0.58);
        renderer->AddActor(actor);
    }
    const double thinnest = 0.5 * kThinnestWire * (large ? 1 : 0.7) * map.pixel;
    for (const Poly& wire : instant.wires)
        if (wire->GetNumberOfPoints() > 1) renderer->AddActor(wire_actor(wire, thinnest, scales));
    if (!contacts.clusters[which].empty())
        add_contacts(renderer, contacts.clusters[which], 1.8 * thinnest,
                     contacts.arrow / contacts.largest_force, scales.force);
    if (large) add_length_bar(renderer, view, rectangle, map);
    renderer->AddViewProp(
        text_actor(instant.caption, letters, 30, rectangle.height() - 0.6 * letters));
    aim(renderer, view, rectangle, map);
    return renderer;
}

/// How many times too thick the large panel draws the thinnest wire; 1 if none is.
double thickening(const RenderData& result, double thinnest)
{
    double factor = 1;
    for (const Poly& wire : result.instants.front().wires)
        if (vtkDataArray* radius = wire->GetPointData()->GetArray("radius"))
            if (radius->GetNumberOfTuples() > 0 && radius->GetRange()[0] > 0)
                factor = std::max(factor, thinnest / radius->GetRange()[0]);
    return factor;
}

vtkSmartPointer<vtkRenderer> wires_legend(const Layout& layout, const RenderData& result,
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

void add_wires_page(vtkRenderWindow* window, const RenderData& result)
{
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
        make_force_scale(contacts.largest_force)};
    for (std::size_t i = 0; i < layout.panels.size(); ++i)
        window->AddRenderer(panel(layout.panels[i], result, i, view, contacts, scales));
    window->AddRenderer(wires_legend(layout, result, view, contacts, scales));
}

void write_picture(const std::filesystem::path& folder, const std::filesystem::path& png)
{
    const RenderData result = read_result(folder);
    VirtualDisplay display; // outlives the window
    vtkNew<vtkRenderWindow> window;
    window->SetDisplayId(display.connection());
    window->SetOffScreenRendering(true);
    window->SetShowWindow(false);
    window->SetMultiSamples(0);
    window->SetAlphaBitPlanes(true);
    if (result.instants.front().wires.empty())
        add_bodies_page(window, result);
    else
        add_wires_page(window, result);
    write_page(window, png);
}

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
