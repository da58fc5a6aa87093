#include "solver/output/vtk/bodies_picture.hpp"
#include "solver/output/vtk/drawing.hpp"
#include "solver/output/vtk/silence.hpp"
#include "solver/output/vtk/virtual_display.hpp"
#include "solver/output/vtk/vtk_module.hpp"

#include <vtkActor.h>
#include <vtkDataArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkSphereSource.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <stdexcept>

// A page of four panels: the end of the run large, three earlier instants small beside it, and
// a legend. All panels share the camera, along the thinnest axis of the walls' box, and the
// colour scales: a wire is the darker the more it is bent, each of a few has a hue of its own;
// yellow to red is the force of contacts.

namespace {

using namespace amontons::vtk_module;

constexpr double kTip = 1.5;         // radius of the ball at an instrument's tip, in the wire's
constexpr std::size_t kMostHues = 4; // more wires have all the same
using Ramp = std::vector<Vec>;
const std::array<Ramp, kMostHues> kHues = {
    {{{0.56, 0.76, 0.88}, {0.26, 0.57, 0.78}, {0.13, 0.32, 0.62}, {0.03, 0.10, 0.30}},
     {{0.68, 0.86, 0.60}, {0.40, 0.70, 0.36}, {0.17, 0.48, 0.20}, {0.04, 0.26, 0.10}},
     {{0.80, 0.74, 0.90}, {0.61, 0.48, 0.78}, {0.42, 0.25, 0.62}, {0.20, 0.08, 0.38}},
     {{0.82, 0.80, 0.74}, {0.62, 0.59, 0.52}, {0.42, 0.39, 0.33}, {0.22, 0.20, 0.16}}}};
const Ramp kGrey = {{0.86, 0.86, 0.86}, {0.64, 0.64, 0.64}, {0.40, 0.40, 0.40}, {0.16, 0.16, 0.16}};

struct Scales {
    std::vector<Scale> curvature; ///< of each wire: its own hue, one length of all
    Scale force;
    bool hues = false; ///< each wire has its own
    bool tips = false; ///< wires are instruments, which have one
};

/// A ball at the last point of a wire.
vtkSmartPointer<vtkActor> tip_actor(const Poly& wire, double thinnest, const Vec& colour)
{
    const vtkIdType last = wire->GetNumberOfPoints() - 1;
    vtkDataArray* own = wire->GetPointData()->GetArray("radius");
    vtkNew<vtkSphereSource> ball;
    ball->SetCenter(wire->GetPoint(last));
    ball->SetRadius(kTip * std::max(thinnest, own ? own->GetTuple1(last) : 0.0));
    ball->SetThetaResolution(24);
    ball->SetPhiResolution(16);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputConnection(ball->GetOutputPort());
    auto actor = vtkSmartPointer<vtkActor>::New();
    actor->SetMapper(mapper);
    actor->GetProperty()->SetColor(colour[0], colour[1], colour[2]);
    actor->GetProperty()->SetAmbient(0.6);
    actor->GetProperty()->SetDiffuse(0.4);
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
    const double thinnest = 0.5 * kThinnestWire * (large ? 1 : 0.7) * map.pixel;
    for (std::size_t w = 0; w < instant.wires.size(); ++w) {
        const Poly& wire = instant.wires[w];
        if (wire->GetNumberOfPoints() < 2) continue;
        const Scale& curvature = scales.curvature[std::min(w, scales.curvature.size() - 1)];
        renderer->AddActor(wire_actor(wire, thinnest, curvature.stops.back(), &curvature));
        if (scales.tips) renderer->AddActor(tip_actor(wire, thinnest, curvature.stops.back()));
    }
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
    ForceWords words = force_words(result, contacts);
    if (touch_walls_alone(result)) words.title = "Contact force on the wall [N]";
    add_scale(renderer, layout.legend, scales.force, words.title, 0.90);
    std::string note = words.note;
    double below = 0.24;
    if (scales.hues) {
        Scale grey = scales.curvature.front();
        grey.stops = kGrey;
        add_scale(renderer, layout.legend, grey, "Curvature [1/m]", 0.56);
        double x = 0.07 * layout.legend.width();
        const std::vector<std::string>& names = result.instants.front().wire_names;
        for (std::size_t w = 0; w < names.size(); ++w) {
            const auto text = text_actor(names[w], kText, x, below * layout.legend.height());
            const Vec& colour = scales.curvature[w].stops[2];
            text->GetTextProperty()->SetColor(colour[0], colour[1], colour[2]);
            text->GetTextProperty()->BoldOn();
            renderer->AddViewProp(text);
            x += 0.65 * kText * static_cast<double>(names[w].size() + 2);
        }
        below -= 1.3 * kText / layout.legend.height();
    } else {
        add_scale(renderer, layout.legend, scales.curvature.front(), "Curvature of the wire [1/m]",
                  0.56);
    }
    if (scales.tips) note += " A ball is a tip.";
    const double pixel = fit(view, layout.panels[0], true).pixel;
    const double thicker = thickening(result, 0.5 * kThinnestWire * pixel);
    if (thicker > 1.05)
        note += "\nThe wire is drawn " + number("%.2g", thicker) + " times as thick as it is.";
    renderer->AddViewProp(
        text_actor(note, kText, 0.07 * layout.legend.width(), below * layout.legend.height()));
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
    const std::size_t wires = result.instants.front().wires.size();
    Scales scales;
    scales.hues = wires > 1 && wires <= kMostHues;
    scales.tips = touch_walls_alone(result);
    scales.force = make_force_scale(contacts.largest_force);
    for (std::size_t w = 0; w < (scales.hues ? wires : 1); ++w)
        scales.curvature.push_back(make_scale(kHues[w], largest_curvature));
    for (std::size_t i = 0; i < layout.panels.size(); ++i) {
        if (is_repeated(result, i)) {
            window->AddRenderer(renderer_of(layout.panels[i])); // or it would be black
            continue;
        }
        window->AddRenderer(panel(layout.panels[i], result, i, view, contacts, scales));
    }
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
    if (holds_wires_alone(result))
        add_wires_page(window, result);
    else
        add_bodies_page(window, result);
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
