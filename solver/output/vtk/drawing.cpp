#include "solver/output/vtk/drawing.hpp"

#include <vtkActor.h>
#include <vtkActor2D.h>
#include <vtkArrowSource.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkColorTransferFunction.h>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkGlyph3D.h>
#include <vtkImageData.h>
#include <vtkLookupTable.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkPolyDataNormals.h>
#include <vtkProp.h>
#include <vtkPropCollection.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkRendererCollection.h>
#include <vtkScalarBarActor.h>
#include <vtkSmartPointer.h>
#include <vtkSphereSource.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkTubeFilter.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <unistd.h>
#include <vector>

namespace amontons::vtk_module {

Scale make_scale(const std::vector<Vec>& stops, double largest)
{
    Scale scale{stops};
    double step = 0.2;
    if (largest > 0)
        for (const double round : {0.1, 0.2, 0.25, 0.5, 1.0, 2.0}) {
            step = round * std::pow(10.0, std::floor(std::log10(largest)));
            if (step * 6 > largest * (1 - 1e-9)) break;
        }
    scale.steps = std::max(1, static_cast<int>(std::ceil(largest / step * (1 - 1e-9))));
    scale.end = scale.steps * step;
    return scale;
}

vtkSmartPointer<vtkLookupTable> table_of(const Scale& scale)
{
    const std::vector<Vec>& stops = scale.stops;
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
    table->SetRange(0, scale.end);
    return table;
}

Scale make_force_scale(double largest)
{
    return make_scale({{0.99, 0.75, 0.35}, {0.95, 0.45, 0.15}, {0.8, 0.12, 0.1}, {0.45, 0.0, 0.05}},
                      largest);
}

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

vtkSmartPointer<vtkActor> wire_actor(const Poly& wire, double thinnest, const Vec& colour,
                                     const Scale* curvature)
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
    if (curvature && wire->GetPointData()->HasArray("curvature")) {
        mapper->SetScalarModeToUsePointFieldData();
        mapper->SelectColorArray("curvature");
        mapper->SetLookupTable(table_of(*curvature));
        mapper->UseLookupTableScalarRangeOn();
    } else {
        mapper->ScalarVisibilityOff();
    }
    auto actor = vtkSmartPointer<vtkActor>::New();
    actor->SetMapper(mapper);
    actor->GetProperty()->SetColor(colour[0], colour[1], colour[2]);
    actor->GetProperty()->SetAmbient(0.5);
    actor->GetProperty()->SetDiffuse(0.5);
    return actor;
}

void add_contacts(vtkRenderer* renderer, const std::vector<Cluster>& clusters, double ball,
                  double arrow_per_newton, const Scale& scale)
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
        mapper->SetLookupTable(table_of(scale));
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

ForceWords force_words(const RenderData& result, const Contacts& contacts)
{
    constexpr std::size_t kMostPairs = 4; // that the legend names
    const std::vector<std::string> pairs = pair_names(result, contacts.clusters);
    // By the names of history.csv: A_on_B is what A exerts on B.
    const bool named = !pairs.empty() && pairs.size() <= kMostPairs;
    ForceWords words;
    words.title = pairs.size() == 1 ? "Contact force " + pairs[0] + " [N]"
                  : named           ? "Contact force [N]"
                                    : "Contact force on the first body [N]";
    for (const std::string& pair : pairs)
        if (named && pairs.size() > 1)
            words.note += (&pair == &pairs.front() ? "Forces: " : ", ") + pair;
    if (!words.note.empty()) words.note += ".\n";
    words.note +=
        "An arrow is the sum of the contacts within " + length_text(contacts.cluster) + ".";
    return words;
}

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

void aim(vtkRenderer* renderer, const View& view, const Rectangle& panel, const Fit& map)
{
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
    camera->SetParallelScale(0.5 * panel.height() * map.pixel);
    renderer->ResetCameraClippingRange();
}

void add_scale(vtkRenderer* renderer, const Rectangle& legend, const Scale& scale,
               const std::string& title, double top)
{
    vtkNew<vtkScalarBarActor> bar;
    bar->SetLookupTable(table_of(scale));
    bar->SetOrientationToHorizontal();
    bar->SetNumberOfLabels(scale.steps + 1);
    bar->SetLabelFormat(scale.end >= 1000 && scale.end < 1e5 ? "%.5g" : "%.3g"); // 2000, not 2e+03
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

namespace {

/// Pixels of the page that are drawn at once: what is drawn takes 32 bytes for each of four, a
/// panel of half a page would take 300 MB.
constexpr int kMostAtOnce = 400'000;

/// A part of the page, in its pixels.
struct Part {
    std::array<int, 4> box{}; ///< left, bottom, right, top
    std::vector<vtkSmartPointer<vtkRenderer>> renderers;

    int wide() const { return box[2] - box[0]; }
    int high() const { return box[3] - box[1]; }
};

std::vector<Part> parts_of(vtkRenderWindow* window)
{
    std::vector<Part> parts;
    vtkRendererCollection* all = window->GetRenderers();
    all->InitTraversal();
    while (vtkRenderer* renderer = all->GetNextItem()) {
        double v[4];
        renderer->GetViewport(v);
        std::array<int, 4> box{};
        for (std::size_t i = 0; i < 4; ++i)
            box[i] = static_cast<int>(std::lround(v[i] * (i % 2 == 0 ? kWidth : kHeight)));
        auto at =
            std::find_if(parts.begin(), parts.end(), [&](const Part& p) { return p.box == box; });
        if (at == parts.end()) at = parts.insert(parts.end(), Part{box, {}});
        at->renderers.emplace_back(renderer);
    }
    return parts;
}

/// What lies flat on a part, and its height there: of texts in pixels, of scales in shares of it.
struct FlatProp {
    vtkActor2D* prop;
    double bottom, high;
    bool shares;
};

std::vector<FlatProp> flat_props(const Part& part)
{
    std::vector<FlatProp> found;
    for (const auto& renderer : part.renderers) {
        vtkPropCollection* props = renderer->GetViewProps();
        props->InitTraversal();
        while (vtkProp* prop = props->GetNextProp())
            if (auto* flat = vtkActor2D::SafeDownCast(prop))
                found.push_back({flat, flat->GetPosition()[1], flat->GetHeight(),
                                 vtkScalarBarActor::SafeDownCast(prop) != nullptr});
    }
    return found;
}

/// What shows all of a part shows `rows` of its pixels from `from` on.
void aim_at_rows(const Part& part, const std::vector<double>& scales,
                 const std::vector<FlatProp>& flat, int from, int rows)
{
    const double high = part.high();
    for (std::size_t i = 0; i < scales.size(); ++i) {
        vtkCamera* camera = part.renderers[i]->GetActiveCamera();
        camera->SetParallelScale(scales[i] * rows / high);
        camera->SetWindowCenter(0, (2.0 * from + rows - high) / rows);
    }
    for (const FlatProp& f : flat) {
        const double x = f.prop->GetPosition()[0];
        if (f.shares) {
            f.prop->SetPosition(x, (f.bottom * high - from) / rows);
            f.prop->SetHeight(f.high * high / rows);
        } else {
            f.prop->SetPosition(x, f.bottom - from * kOversampling);
        }
    }
}

/// The means of what is drawn in a window, from the pixel x, y of the page on.
void add_to_page(vtkRenderWindow* window, int wide, int high, int x0, int y0, unsigned char* pixels)
{
    vtkNew<vtkUnsignedCharArray> drawn;
    // A band at a time: of the drawing there is no second copy.
    constexpr int kBand = 64;
    for (int from = 0; from < high; from += kBand) {
        const int rows = std::min(kBand, high - from);
        window->GetPixelData(0, from * kOversampling, wide * kOversampling - 1,
                             (from + rows) * kOversampling - 1, 0, drawn);
        const unsigned char* const all = drawn->GetPointer(0);
        for (int y = 0; y < rows; ++y)
            for (int x = 0; x < wide; ++x)
                for (int c = 0; c < 3; ++c) {
                    int sum = 0;
                    for (int j = 0; j < kOversampling; ++j)
                        for (int i = 0; i < kOversampling; ++i)
                            sum += all[3 * ((y * kOversampling + j) * wide * kOversampling +
                                            x * kOversampling + i) +
                                       c];
                    pixels[3 * ((y0 + from + y) * kWidth + x0 + x) + c] =
                        static_cast<unsigned char>(sum / (kOversampling * kOversampling));
                }
    }
}

} // namespace

// A window of the whole page at twice its size would take half a gigabyte in its buffers: parts are
// drawn one after the other, and large ones in strips of as many rows each.
void write_page(vtkRenderWindow* window, const std::filesystem::path& png)
{
    const std::vector<Part> parts = parts_of(window);
    for (const Part& p : parts)
        for (const auto& renderer : p.renderers)
            window->RemoveRenderer(renderer);
    vtkNew<vtkImageData> page;
    page->SetDimensions(kWidth, kHeight, 1);
    page->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
    auto* const pixels = static_cast<unsigned char*>(page->GetScalarPointer());
    std::fill_n(pixels, std::size_t(3) * kWidth * kHeight, static_cast<unsigned char>(255));
    for (const Part& p : parts) {
        const int wide = p.wide(), high = p.high();
        if (wide < 1 || high < 1) continue;
        const int strips = (wide * high + kMostAtOnce - 1) / kMostAtOnce,
                  rows = (high + strips - 1) / strips;
        window->SetSize(wide * kOversampling, rows * kOversampling);
        std::vector<double> scales;
        for (const auto& renderer : p.renderers) {
            renderer->SetViewport(0, 0, 1, 1);
            window->AddRenderer(renderer);
            scales.push_back(renderer->GetActiveCamera()->GetParallelScale());
        }
        const std::vector<FlatProp> flat = flat_props(p);
        for (int k = 0; k < strips; ++k) {
            // The last strip repeats rows: another size would take other buffers.
            const int from = std::min(k * rows, high - rows);
            aim_at_rows(p, scales, flat, from, rows);
            window->Render();
            add_to_page(window, wide, rows, p.box[0], p.box[1] + from, pixels);
        }
        for (const auto& renderer : p.renderers)
            window->RemoveRenderer(renderer);
    }
    window->Finalize(); // its memory, before the picture is packed
    vtkNew<vtkPNGWriter> writer;
    writer->SetInputData(page);
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

} // namespace amontons::vtk_module
