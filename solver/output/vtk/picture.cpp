#include "solver/output/vtk/polydata.hpp"
#include "solver/output/vtk/result_files.hpp"
#include "solver/output/vtk/virtual_display.hpp"
#include "solver/output/vtk/vtk_module.hpp"

#include <vtkActor.h>
#include <vtkActor2D.h>
#include <vtkArrowSource.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkColorTransferFunction.h>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkGlyph3D.h>
#include <vtkImageShrink3D.h>
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
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <unistd.h>
#include <vector>

// A page of four panels: the end of the run large, three earlier instants small beside it, and
// a legend. All panels share the camera, along the thinnest axis of the walls' box, and the
// colour scales: blue is the wire's curvature, red the force of its contacts.

namespace {

using namespace amontons::vtk_module;
using Poly = vtkSmartPointer<vtkPolyData>;
using Vec = std::array<double, 3>;

constexpr int kWidth = 2400, kHeight = 1500; // of the picture [pixels]
constexpr int kOversampling = 2;             // drawn larger, then averaged: smooth edges
constexpr double kThinnestWire = 5.0;        // drawn at least this wide in the large panel [pixels]
constexpr double kClusterOfHeight = 1.0 / 50; // contacts this near are drawn as one arrow
constexpr double kArrowOfHeight = 0.11;       // the largest force's arrow
constexpr double kMargin = 1.10;              // free space around the walls

double dot(const Vec& a, const Vec& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// ---- what is drawn

/// Contacts that lie close together, as one force on the wall.
struct Cluster {
    Vec point{}; ///< [m]
    Vec force{}; ///< of the wire on the wall [N]
    double magnitude() const { return std::sqrt(dot(force, force)); }
};

struct Instant {
    double time = 0; ///< [s]
    std::vector<Poly> wires;
    std::vector<Poly> contacts;
    std::vector<Cluster> clusters;
    std::string caption;
};

struct Result {
    std::vector<Poly> walls;
    std::vector<Instant> instants; ///< the end first, then the earlier ones in their order
};

Poly read_or_throw(const std::filesystem::path& file)
{
    std::string error;
    Poly data = Poly::Take(read_polydata(file, error));
    if (!data) throw std::runtime_error(error);
    return data;
}

/// All that the collections hold at one instant: of each, the last frame not after it.
Instant read_instant(const std::vector<std::vector<Frame>>& collections, double time,
                     std::vector<Poly>& walls)
{
    Instant instant;
    instant.time = time;
    for (const std::vector<Frame>& frames : collections) {
        double shown = -std::numeric_limits<double>::infinity();
        for (const Frame& frame : frames)
            if (frame.time <= time) shown = std::max(shown, frame.time);
        for (const Frame& frame : frames) {
            if (frame.time != shown) continue;
            const Poly data = read_or_throw(frame.file);
            if (data->GetPointData()->HasArray("force"))
                instant.contacts.push_back(data);
            else if (data->GetNumberOfLines() > 0)
                instant.wires.push_back(data);
            else if (data->GetNumberOfPolys() + data->GetNumberOfStrips() > 0)
                walls.push_back(data);
        }
    }
    return instant;
}

/// The row of a history at a time: the last one not after it.
double value_at(const std::vector<double>& times, const std::vector<double>& values, double time)
{
    const std::size_t rows = std::min(times.size(), values.size());
    double value = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t row = 0; row < rows && times[row] <= time * (1 + 1e-12); ++row)
        value = values[row];
    return value;
}

std::string number(const char* format, double value)
{
    char text[64];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

/// A length as a paper writes it: "300 mm", "1.2 m", "40 um".
std::string length_text(double metres)
{
    const double size = std::abs(metres);
    if (size >= 1 || size == 0) return number("%.3g m", metres);
    return size >= 1e-3 ? number("%.3g mm", metres * 1e3) : number("%.3g \xC2\xB5m", metres * 1e6);
}

Result read_result(const std::filesystem::path& folder)
{
    std::vector<std::vector<Frame>> collections;
    std::set<std::filesystem::path> named;
    double begin = std::numeric_limits<double>::infinity(), end = -begin;
    for (const auto& pvd : collections_in(folder)) {
        std::string error;
        collections.push_back(read_collection(pvd, error));
        if (!error.empty()) throw std::runtime_error(error);
        for (const Frame& frame : collections.back()) {
            named.insert(frame.file.lexically_normal());
            begin = std::min(begin, frame.time);
            end = std::max(end, frame.time);
        }
    }
    if (named.empty())
        throw std::runtime_error(folder.string() + ": no .pvd file with frames of a run");

    Result result;
    std::vector<Poly> walls;
    result.instants.push_back(read_instant(collections, end, walls));
    std::vector<Poly> ignored; // the walls of earlier instants: the last ones serve all panels
    for (int quarter = 1; quarter <= 3; ++quarter)
        result.instants.push_back(
            read_instant(collections, begin + 0.25 * quarter * (end - begin), ignored));
    if (result.instants.front().wires.empty())
        throw std::runtime_error(folder.string() + ": no wire (a polyline) in any .pvd file");

    std::vector<std::filesystem::path> loose;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().extension() == ".vtp" && !named.count(entry.path().lexically_normal()))
            loose.push_back(entry.path());
    std::sort(loose.begin(), loose.end());
    for (const auto& file : loose) {
        const Poly data = read_or_throw(file);
        if (data->GetNumberOfPolys() + data->GetNumberOfStrips() > 0) walls.push_back(data);
    }
    // A run may write a wall twice, at its start and with the forces at its end: draw it once.
    const auto has_force = [](const Poly& wall) {
        return wall->GetPointData()->HasArray("max_contact_force") != 0;
    };
    const bool any = std::any_of(walls.begin(), walls.end(), has_force);
    for (const Poly& wall : walls)
        if (!any || has_force(wall)) result.walls.push_back(wall);

    const std::filesystem::path history = folder / "history.csv";
    const std::vector<double> times = read_history_column(history, "time");
    const std::vector<double> depths = read_history_column(history, "depth");
    const std::vector<double> pushes = read_history_column(history, "push_force");
    for (Instant& instant : result.instants) {
        const double depth = value_at(times, depths, instant.time);
        const double push = value_at(times, pushes, instant.time);
        instant.caption = number("t = %.3g s", instant.time);
        if (std::isfinite(depth)) instant.caption += ",  depth " + length_text(depth);
        if (std::isfinite(push)) instant.caption += "\npush force " + number("%.3g N", push);
    }
    return result;
}

// ---- the view

/// The camera that all panels share. Screen axes are coordinate axes: (right, up, towards the
/// eye) is right-handed; the eye looks along the thinnest side of the box.
struct View {
    Vec centre{}, right{}, up{}, towards_eye{};
    double width = 0, height = 0, depth = 0; ///< of what is seen [m]
};

View choose_view(const Result& result)
{
    std::array<double, 6> box{};
    const double huge = std::numeric_limits<double>::max();
    for (int axis = 0; axis < 3; ++axis) {
        box[2 * axis] = huge;
        box[2 * axis + 1] = -huge;
    }
    const auto include = [&](const Poly& data) {
        if (data->GetNumberOfPoints() == 0) return;
        const double* own = data->GetBounds();
        for (int axis = 0; axis < 3; ++axis) {
            box[2 * axis] = std::min(box[2 * axis], own[2 * axis]);
            box[2 * axis + 1] = std::max(box[2 * axis + 1], own[2 * axis + 1]);
        }
    };
    for (const Poly& wall : result.walls)
        include(wall);
    for (const Instant& instant : result.instants)
        for (const Poly& wire : instant.wires)
            include(wire);
    Vec size{};
    View view;
    for (int axis = 0; axis < 3; ++axis) {
        size[axis] = std::max(0.0, box[2 * axis + 1] - box[2 * axis]);
        view.centre[axis] = 0.5 * (box[2 * axis + 1] + box[2 * axis]);
    }
    // Equal to within a hundredth: prefer to look along y, then z, so that z is up where it can be.
    int thin = 1;
    for (const int axis : {2, 0})
        if (size[axis] < 0.99 * size[thin]) thin = axis;
    const int up = thin == 2 ? 1 : 2;
    const int right = 3 - thin - up;
    view.right[right] = 1;
    view.up[up] = 1;
    for (int i = 0; i < 3; ++i)
        view.towards_eye[i] = view.right[(i + 1) % 3] * view.up[(i + 2) % 3] -
                              view.right[(i + 2) % 3] * view.up[(i + 1) % 3];
    const double largest = std::max({size[0], size[1], size[2]});
    if (!(largest > 0)) throw std::runtime_error("nothing to draw: all points coincide");
    view.width = std::max(size[right], 0.05 * largest);
    view.height = std::max(size[up], 0.05 * largest);
    view.depth = size[thin];
    return view;
}

/// Left, bottom, right, top as parts of the page.
using Viewport = std::array<double, 4>;

struct Layout {
    std::array<Viewport, 4> panels{}; ///< the end, then the three earlier instants
    Viewport legend{};
};

Layout choose_layout(const View& view)
{
    Layout layout;
    const double aspect = view.width / view.height;
    if (aspect < 1.3) { // tall: the end on the left, the rest on the right above the legend
        const double split = std::clamp(aspect * kHeight / kWidth * 1.02, 0.34, 0.52);
        layout.panels[0] = {0, 0, split, 1};
        for (int i = 0; i < 3; ++i)
            layout.panels[1 + i] = {split + (1 - split) * i / 3, 0.40,
                                    split + (1 - split) * (i + 1) / 3, 1};
        layout.legend = {split, 0, 1, 0.38};
    } else { // wide: the end above, the rest below beside the legend
        layout.panels[0] = {0, 0.40, 1, 1};
        for (int i = 0; i < 3; ++i)
            layout.panels[1 + i] = {0.24 * i, 0, 0.24 * (i + 1), 0.38};
        layout.legend = {0.72, 0, 1, 0.38};
    }
    return layout;
}

double pixels_wide(const Viewport& v)
{
    return (v[2] - v[0]) * kWidth;
}
double pixels_high(const Viewport& v)
{
    return (v[3] - v[1]) * kHeight;
}

/// Half the height that a panel shows [m].
double parallel_scale(const View& view, const Viewport& viewport)
{
    const double aspect = pixels_wide(viewport) / pixels_high(viewport);
    return 0.5 * kMargin * std::max(view.height, view.width / aspect);
}

// ---- colours

vtkSmartPointer<vtkLookupTable> colours(const std::vector<Vec>& stops, double largest)
{
    vtkNew<vtkColorTransferFunction> ramp;
    for (std::size_t i = 0; i < stops.size(); ++i)
        ramp->AddRGBPoint(static_cast<double>(i) / static_cast<double>(stops.size() - 1),
                          stops[i][0], stops[i][1], stops[i][2]);
    auto table = vtkSmartPointer<vtkLookupTable>::New();
    table->SetNumberOfTableValues(256);
    for (int i = 0; i < 256; ++i) {
        const double* colour = ramp->GetColor(i / 255.0);
        table->SetTableValue(i, colour[0], colour[1], colour[2], 1);
    }
    table->SetRange(0, largest > 0 ? largest : 1);
    return table;
}

struct Scales {
    vtkSmartPointer<vtkLookupTable> curvature, force;
    double largest_force = 0;
};

// ---- parts of a panel

/// Greedy: the largest force first takes in all within `radius`. The point is the mean, weighted
/// by force.
std::vector<Cluster> cluster_contacts(const std::vector<Poly>& files, double radius)
{
    std::vector<Cluster> single;
    for (const Poly& data : files) {
        vtkDataArray* force = data->GetPointData()->GetArray("force");
        for (vtkIdType i = 0; force && i < data->GetNumberOfPoints(); ++i) {
            Cluster contact;
            data->GetPoint(i, contact.point.data());
            force->GetTuple(i, contact.force.data());
            for (double& f : contact.force)
                f = -f; // the files hold the force on the wire
            if (contact.magnitude() > 0) single.push_back(contact);
        }
    }
    std::stable_sort(single.begin(), single.end(), [](const Cluster& a, const Cluster& b) {
        return a.magnitude() > b.magnitude();
    });
    std::vector<bool> taken(single.size(), false);
    std::vector<Cluster> clusters;
    for (std::size_t i = 0; i < single.size(); ++i) {
        if (taken[i]) continue;
        Cluster sum;
        double weight = 0;
        for (std::size_t j = i; j < single.size(); ++j) {
            Vec apart{};
            for (int k = 0; k < 3; ++k)
                apart[k] = single[j].point[k] - single[i].point[k];
            if (taken[j] || dot(apart, apart) > radius * radius) continue;
            taken[j] = true;
            const double w = single[j].magnitude();
            weight += w;
            for (int k = 0; k < 3; ++k) {
                sum.point[k] += w * single[j].point[k];
                sum.force[k] += single[j].force[k];
            }
        }
        for (double& x : sum.point)
            x /= weight;
        clusters.push_back(sum);
    }
    return clusters;
}

/// Glass: nearly clear where one looks straight at it, denser towards its outline.
vtkSmartPointer<vtkActor> wall_actor(const Poly& wall, const View& view)
{
    vtkNew<vtkPolyDataNormals> normals;
    normals->SetInputData(wall);
    normals->SplittingOff();
    normals->ConsistencyOff();
    normals->ComputePointNormalsOn();
    normals->Update();
    vtkNew<vtkPolyData> glass;
    glass->ShallowCopy(normals->GetOutput());
    vtkDataArray* normal = glass->GetPointData()->GetNormals();
    vtkNew<vtkUnsignedCharArray> rgba;
    rgba->SetName("glass");
    rgba->SetNumberOfComponents(4);
    rgba->SetNumberOfTuples(glass->GetNumberOfPoints());
    for (vtkIdType i = 0; i < glass->GetNumberOfPoints(); ++i) {
        Vec n{0, 0, 1};
        if (normal) normal->GetTuple(i, n.data());
        const double grazing = 1 - std::min(1.0, std::abs(dot(n, view.towards_eye)));
        const double opacity = 0.05 + 0.42 * std::pow(grazing, 1.6);
        rgba->SetTuple4(i, 205 - 45 * grazing, 140 - 60 * grazing, 130 - 55 * grazing,
                        255 * opacity);
    }
    glass->GetPointData()->SetScalars(rgba);

    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(glass);
    mapper->SetColorModeToDirectScalars();
    auto actor = vtkSmartPointer<vtkActor>::New();
    actor->SetMapper(mapper);
    actor->GetProperty()->SetAmbient(0.75);
    actor->GetProperty()->SetDiffuse(0.35);
    actor->GetProperty()->SetSpecular(0);
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
        mapper->SetLookupTable(scales.curvature);
        mapper->UseLookupTableScalarRangeOn();
    } else {
        mapper->ScalarVisibilityOff();
    }
    auto actor = vtkSmartPointer<vtkActor>::New();
    actor->SetMapper(mapper);
    actor->GetProperty()->SetColor(0.1, 0.2, 0.4);
    actor->GetProperty()->SetAmbient(0.35);
    actor->GetProperty()->SetDiffuse(0.65);
    actor->GetProperty()->SetSpecular(0.15);
    return actor;
}

/// A ball at each cluster and an arrow along its force, both coloured by it.
void add_contacts(vtkRenderer* renderer, const std::vector<Cluster>& clusters, double ball,
                  double longest_arrow, const Scales& scales)
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
        magnitude->InsertNextValue(cluster.magnitude());
    }
    vtkNew<vtkPolyData> centres;
    centres->SetPoints(points);
    centres->GetPointData()->SetVectors(force);
    centres->GetPointData()->SetScalars(magnitude);

    const auto add = [&](vtkAlgorithm* shape, bool scaled, double factor) {
        vtkNew<vtkGlyph3D> glyph;
        glyph->SetInputData(centres);
        glyph->SetSourceConnection(shape->GetOutputPort());
        glyph->SetColorModeToColorByScalar();
        glyph->SetVectorModeToUseVector();
        if (scaled)
            glyph->SetScaleModeToScaleByVector();
        else
            glyph->SetScaleModeToDataScalingOff();
        glyph->SetScaleFactor(factor);
        vtkNew<vtkPolyDataMapper> mapper;
        mapper->SetInputConnection(glyph->GetOutputPort());
        mapper->SetLookupTable(scales.force);
        mapper->UseLookupTableScalarRangeOn();
        vtkNew<vtkActor> actor;
        actor->SetMapper(mapper);
        actor->GetProperty()->SetAmbient(0.4);
        actor->GetProperty()->SetDiffuse(0.6);
        renderer->AddActor(actor);
    };
    vtkNew<vtkSphereSource> sphere;
    sphere->SetRadius(1);
    sphere->SetThetaResolution(24);
    sphere->SetPhiResolution(16);
    add(sphere, false, ball);
    if (scales.largest_force > 0) {
        vtkNew<vtkArrowSource> arrow;
        arrow->SetShaftRadius(0.035);
        arrow->SetTipRadius(0.10);
        arrow->SetTipLength(0.30);
        arrow->SetShaftResolution(24);
        arrow->SetTipResolution(32);
        add(arrow, true, longest_arrow / scales.largest_force);
    }
}

vtkSmartPointer<vtkTextActor> text_actor(const std::string& text, int pixels, double x, double y)
{
    auto actor = vtkSmartPointer<vtkTextActor>::New();
    actor->SetInput(text.c_str());
    actor->GetTextProperty()->SetFontSize(pixels * kOversampling);
    actor->GetTextProperty()->SetColor(0.1, 0.1, 0.1);
    actor->GetTextProperty()->SetVerticalJustificationToTop();
    actor->GetTextProperty()->SetLineSpacing(1.15);
    actor->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
    actor->SetPosition(x, y);
    return actor;
}

/// The largest of 1, 2, 5 times a power of ten that is not above `length`.
double round_length(double length)
{
    const double power = std::pow(10.0, std::floor(std::log10(length)));
    const double digits = length / power;
    return power * (digits >= 5 ? 5 : digits >= 2 ? 2 : 1);
}

/// A bar of known length in the lower left corner, in the plane of the view's centre.
void add_length_bar(vtkRenderer* renderer, const View& view, double half_height, double aspect)
{
    const double length = round_length(0.3 * std::min(view.width, 2 * half_height * aspect));
    const double thick = 0.004 * half_height;
    Vec start{};
    for (int i = 0; i < 3; ++i)
        start[i] = view.centre[i] - view.right[i] * 0.93 * half_height * aspect -
                   view.up[i] * 0.95 * half_height + view.towards_eye[i] * view.depth;
    vtkNew<vtkPoints> points;
    vtkNew<vtkCellArray> cells;
    const std::array<std::array<double, 2>, 4> corners{
        {{0, -thick}, {length, -thick}, {length, thick}, {0, thick}}};
    cells->InsertNextCell(4);
    for (const auto& corner : corners) {
        Vec p{};
        for (int i = 0; i < 3; ++i)
            p[i] = start[i] + view.right[i] * corner[0] + view.up[i] * corner[1];
        cells->InsertCellPoint(points->InsertNextPoint(p.data()));
    }
    vtkNew<vtkPolyData> bar;
    bar->SetPoints(points);
    bar->SetPolys(cells);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(bar);
    vtkNew<vtkActor> actor;
    actor->SetMapper(mapper);
    actor->GetProperty()->SetColor(0.1, 0.1, 0.1);
    actor->GetProperty()->LightingOff();
    renderer->AddActor(actor);
    renderer->AddViewProp(text_actor(length_text(length), 26, 0.035, 0.055));
}

vtkSmartPointer<vtkRenderer> panel(const Viewport& viewport, const Instant& instant,
                                   const Result& result, const View& view, const Scales& scales,
                                   bool large)
{
    const double half_height = parallel_scale(view, viewport);
    const double pixel = 2 * half_height / pixels_high(viewport);
    auto renderer = vtkSmartPointer<vtkRenderer>::New();
    renderer->SetViewport(viewport[0], viewport[1], viewport[2], viewport[3]);
    renderer->SetBackground(1, 1, 1);
    renderer->SetUseDepthPeeling(true);
    renderer->SetMaximumNumberOfPeels(8);
    renderer->SetOcclusionRatio(0);

    for (const Poly& wall : result.walls)
        renderer->AddActor(wall_actor(wall, view));
    for (const Poly& wire : instant.wires)
        if (wire->GetNumberOfPoints() > 1)
            renderer->AddActor(wire_actor(
                wire, 0.5 * (large ? kThinnestWire : 0.7 * kThinnestWire) * pixel, scales));
    if (!instant.clusters.empty())
        add_contacts(renderer, instant.clusters, (large ? 6 : 4) * pixel,
                     kArrowOfHeight * 2 * half_height, scales);
    if (large)
        add_length_bar(renderer, view, half_height, pixels_wide(viewport) / pixels_high(viewport));
    renderer->AddViewProp(text_actor(instant.caption, large ? 34 : 24, 0.035, 0.985));

    vtkCamera* camera = renderer->GetActiveCamera();
    camera->ParallelProjectionOn();
    camera->SetFocalPoint(view.centre.data());
    Vec eye{};
    for (int i = 0; i < 3; ++i)
        eye[i] = view.centre[i] + view.towards_eye[i] * 4 * (view.width + view.height + view.depth);
    camera->SetPosition(eye.data());
    camera->SetViewUp(view.up.data());
    camera->SetParallelScale(half_height);
    renderer->ResetCameraClippingRange();
    return renderer;
}

vtkSmartPointer<vtkScalarBarActor> scale_bar(vtkLookupTable* table, const std::string& title,
                                             double y)
{
    auto bar = vtkSmartPointer<vtkScalarBarActor>::New();
    bar->SetLookupTable(table);
    bar->SetTitle(title.c_str());
    bar->SetOrientationToHorizontal();
    bar->SetNumberOfLabels(5);
    bar->SetLabelFormat("%.3g");
    bar->SetUnconstrainedFontSize(true);
    bar->SetPosition(0.08, y);
    bar->SetWidth(0.84);
    bar->SetHeight(0.26);
    bar->SetBarRatio(0.3);
    bar->SetTextPositionToPrecedeScalarBar();
    for (vtkTextProperty* property : {bar->GetTitleTextProperty(), bar->GetLabelTextProperty()}) {
        property->SetFontSize(26 * kOversampling);
        property->SetColor(0.1, 0.1, 0.1);
        property->BoldOff();
        property->ItalicOff();
        property->ShadowOff();
    }
    return bar;
}

void write_picture(const std::filesystem::path& folder, const std::filesystem::path& png)
{
    Result result = read_result(folder);
    const View view = choose_view(result);
    const Layout layout = choose_layout(view);

    const double cluster = kClusterOfHeight * std::max(view.width, view.height);
    Scales scales;
    double largest_curvature = 0;
    double thinned = 1;
    const double thinnest = 0.5 * kThinnestWire * 2 * parallel_scale(view, layout.panels[0]) /
                            pixels_high(layout.panels[0]);
    for (Instant& instant : result.instants) {
        instant.clusters = cluster_contacts(instant.contacts, 0.5 * cluster);
        for (const Cluster& c : instant.clusters)
            scales.largest_force = std::max(scales.largest_force, c.magnitude());
        for (const Poly& wire : instant.wires) {
            if (vtkDataArray* curvature = wire->GetPointData()->GetArray("curvature"))
                largest_curvature = std::max(largest_curvature, curvature->GetRange(-1)[1]);
            if (vtkDataArray* radius = wire->GetPointData()->GetArray("radius"))
                if (radius->GetRange()[0] > 0)
                    thinned = std::max(thinned, thinnest / radius->GetRange()[0]);
        }
    }
    scales.curvature =
        colours({{0.62, 0.79, 0.88}, {0.26, 0.57, 0.78}, {0.13, 0.32, 0.62}, {0.03, 0.10, 0.30}},
                largest_curvature);
    scales.force =
        colours({{0.99, 0.75, 0.35}, {0.95, 0.45, 0.15}, {0.80, 0.12, 0.10}, {0.45, 0.0, 0.05}},
                scales.largest_force);

    VirtualDisplay display;
    vtkNew<vtkRenderWindow> window;
    window->SetDisplayId(display.connection());
    window->SetOffScreenRendering(true);
    window->SetShowWindow(false);
    window->SetMultiSamples(0);
    window->SetAlphaBitPlanes(true);
    window->SetSize(kWidth * kOversampling, kHeight * kOversampling);
    for (std::size_t i = 0; i < layout.panels.size(); ++i)
        window->AddRenderer(
            panel(layout.panels[i], result.instants[i], result, view, scales, i == 0));

    vtkNew<vtkRenderer> legend;
    legend->SetViewport(layout.legend[0], layout.legend[1], layout.legend[2], layout.legend[3]);
    legend->SetBackground(1, 1, 1);
    legend->AddViewProp(scale_bar(scales.force, "contact force on the wall [N]", 0.66));
    legend->AddViewProp(scale_bar(scales.curvature, "curvature of the wire [1/m]", 0.30));
    std::string note = "An arrow sums the contacts within " + length_text(cluster) + ".";
    if (thinned > 1.05)
        note += "\nThe wire is drawn " + number("%.2g", thinned) + " times as thick as it is.";
    legend->AddViewProp(text_actor(note, 22, 0.08, 0.20));
    window->AddRenderer(legend);
    window->Render();

    vtkNew<vtkWindowToImageFilter> grab;
    grab->SetInput(window);
    grab->SetInputBufferTypeToRGB();
    grab->ReadFrontBufferOff();
    vtkNew<vtkImageShrink3D> shrink;
    shrink->SetInputConnection(grab->GetOutputPort());
    shrink->SetShrinkFactors(kOversampling, kOversampling, 1);
    shrink->MeanOn();
    vtkNew<vtkPNGWriter> writer;
    writer->SetInputConnection(shrink->GetOutputPort());
    const std::filesystem::path part = png.string() + ".part" + std::to_string(getpid());
    writer->SetFileName(part.string().c_str());
    writer->Write();
    window->Finalize();
    std::error_code failed;
    if (writer->GetErrorCode() == 0 && std::filesystem::exists(part))
        std::filesystem::rename(part, png, failed);
    else
        failed = std::make_error_code(std::errc::io_error);
    if (failed) {
        std::filesystem::remove(part, failed);
        throw std::runtime_error(png.string() + ": cannot be written");
    }
}

/// Keeps what VTK says, which else goes to stderr.
class Complaints : public vtkOutputWindow {
public:
    static Complaints* New();
    vtkTypeMacro(Complaints, vtkOutputWindow);
    void DisplayText(const char* text) override { text_ += text; }
    const std::string& text() const { return text_; }

private:
    std::string text_;
};
vtkStandardNewMacro(Complaints);

} // namespace

int amontons_vtk_render(const char* result_directory, const char* png, char* message,
                        int message_size)
{
    const vtkSmartPointer<vtkOutputWindow> before = vtkOutputWindow::GetInstance();
    vtkNew<Complaints> complaints;
    vtkOutputWindow::SetInstance(complaints);
    std::string error;
    try {
        write_picture(result_directory, png);
    } catch (const std::exception& failure) {
        error = failure.what();
        if (!complaints->text().empty()) error += " (VTK: " + complaints->text() + ")";
    }
    vtkOutputWindow::SetInstance(before);
    if (error.empty()) return 0;
    if (message && message_size > 0)
        std::snprintf(message, static_cast<std::size_t>(message_size), "%s", error.c_str());
    return 1;
}
