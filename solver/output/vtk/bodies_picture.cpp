#include "solver/output/vtk/bodies_picture.hpp"

#include "solver/output/vtk/drawing.hpp"

#include <vtkActor.h>
#include <vtkCellArray.h>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkFeatureEdges.h>
#include <vtkIdList.h>
#include <vtkLookupTable.h>
#include <vtkMapper.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkPolyDataNormals.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkSmartPointer.h>
#include <vtkTextActor.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

// Solids are coloured by their stress, rigid bodies and wires each by a colour of its own. Arrows
// of contact forces lie in a layer above, or the bodies would hide them. A plane has no end: a
// plate of it is drawn, a little larger than the bodies, and of one that stands between them and
// the eye the outline alone.

namespace amontons::vtk_module {
namespace {

constexpr Vec kTowardsEye = {1, -1.6, 0.8};
constexpr double kPlateMargin = 0.15;   // of the bodies' size, around them
constexpr double kFarPlane = 0.5;       // of the bodies' size: not drawn beyond
constexpr double kShownEdge = 9;        // shorter edges of elements are not drawn [pixels]
constexpr double kCreases = 30;         // edges sharper than this are drawn [degrees]
constexpr double kBall = 5;             // radius of a contact [pixels]
constexpr double kScaleHolds = 0.99;    // of the nodes: single peaks would darken the rest
constexpr int kMostArrows = 120;        // more would hide the bodies
constexpr double kLargestCluster = 0.1; // of the bodies' size
constexpr double kLargestWall = 3;      // of the bodies' size: walls that are drawn whole
constexpr Vec kPlate = {0.88, 0.88, 0.86};
constexpr std::array<Vec, 8> kColours = {{{0.45, 0.60, 0.78},
                                          {0.87, 0.67, 0.42},
                                          {0.55, 0.72, 0.55},
                                          {0.78, 0.53, 0.53},
                                          {0.62, 0.56, 0.74},
                                          {0.70, 0.66, 0.55},
                                          {0.50, 0.70, 0.74},
                                          {0.80, 0.76, 0.45}}};

constexpr std::array<Vec, 4> kWireColours = {
    {{0.10, 0.20, 0.40}, {0.06, 0.34, 0.14}, {0.30, 0.14, 0.50}, {0.25, 0.22, 0.18}}};

Vec cross(const Vec& a, const Vec& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// a + s b
Vec sum(const Vec& a, double s, const Vec& b)
{
    return {a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]};
}

Vec unit(const Vec& a)
{
    const double length = std::sqrt(dot(a, a));
    return {a[0] / length, a[1] / length, a[2] / length};
}

/// Smallest and largest value of something over points.
struct Interval {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    void include(double value)
    {
        low = std::min(low, value);
        high = std::max(high, value);
    }
    double length() const { return std::max(0.0, high - low); }
    double middle() const { return 0.5 * (low + high); }
};

struct Box {
    std::array<Interval, 3> side;
    void include(const Vec& point)
    {
        for (std::size_t i = 0; i < 3; ++i)
            side[i].include(point[i]);
    }
    double size() const { return std::max({side[0].length(), side[1].length(), side[2].length()}); }
    Vec middle() const { return {side[0].middle(), side[1].middle(), side[2].middle()}; }
    Vec corner(int i) const
    {
        return {i & 1 ? side[0].high : side[0].low, i & 2 ? side[1].high : side[1].low,
                i & 4 ? side[2].high : side[2].low};
    }
};

Vec point_of(const Poly& data, vtkIdType i)
{
    Vec p{};
    data->GetPoint(i, p.data());
    return p;
}

template <class Action> void for_each_body(const RenderData& result, Action&& action)
{
    for (const Instant& instant : result.instants) {
        for (const Poly& body : instant.solids)
            action(body);
        for (const Poly& body : instant.rigids)
            action(body);
        for (const Poly& wire : instant.wires)
            action(wire);
    }
}

// ---- planes

struct Plane {
    Vec point{}, normal{}; ///< towards the bodies
};

std::optional<Plane> plane_of(const Poly& wall, const Box& bodies)
{
    vtkNew<vtkIdList> ids;
    wall->GetPolys()->InitTraversal();
    if (!wall->GetPolys()->GetNextCell(ids) || ids->GetNumberOfIds() < 3) return {};
    const Vec a = point_of(wall, ids->GetId(0));
    const Vec n =
        cross(sum(point_of(wall, ids->GetId(1)), -1, a), sum(point_of(wall, ids->GetId(2)), -1, a));
    if (!(dot(n, n) > 0)) return {};
    Plane plane{a, unit(n)};
    Interval off;
    for (vtkIdType i = 0; i < wall->GetNumberOfPoints(); ++i)
        off.include(dot(plane.normal, sum(point_of(wall, i), -1, a)));
    const double* b = wall->GetBounds();
    const double size = std::max({b[1] - b[0], b[3] - b[2], b[5] - b[4]});
    if (std::max(-off.low, off.high) > 1e-6 * size) return {};
    if (dot(plane.normal, sum(bodies.middle(), -1, a)) < 0)
        for (double& x : plane.normal)
            x = -x;
    return plane;
}

/// The plane's part near the bodies, as a polygon; empty if it is far from them.
std::vector<Vec> plate_of(const Plane& plane, const Box& bodies, const std::vector<Plane>& others)
{
    Interval away;
    for (int i = 0; i < 8; ++i)
        away.include(dot(plane.normal, sum(bodies.corner(i), -1, plane.point)));
    if (away.low > kFarPlane * bodies.size()) return {};

    // Sides along the axes where the plane allows it.
    std::size_t axis = 0;
    for (std::size_t i = 1; i < 3; ++i)
        if (std::abs(plane.normal[i]) < std::abs(plane.normal[axis]) - 1e-9) axis = i;
    Vec along{};
    along[axis] = 1;
    const Vec u = unit(sum(along, -dot(along, plane.normal), plane.normal));
    const Vec v = cross(plane.normal, u);
    Interval at_u, at_v;
    for (int i = 0; i < 8; ++i) {
        const Vec from = sum(bodies.corner(i), -1, plane.point);
        at_u.include(dot(u, from));
        at_v.include(dot(v, from));
    }
    const double margin = kPlateMargin * bodies.size();
    std::vector<Vec> polygon;
    for (const auto& [a, b] : {std::array{at_u.low - margin, at_v.low - margin},
                               std::array{at_u.high + margin, at_v.low - margin},
                               std::array{at_u.high + margin, at_v.high + margin},
                               std::array{at_u.low - margin, at_v.high + margin}})
        polygon.push_back(sum(sum(plane.point, a, u), b, v));

    // It ends where another plane does: a floor at the walls around it.
    for (const Plane& other : others) {
        if (std::abs(dot(other.normal, plane.normal)) > 1 - 1e-9) continue;
        std::vector<Vec> kept;
        for (std::size_t i = 0; i < polygon.size(); ++i) {
            const Vec &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
            const double at_a = dot(other.normal, sum(a, -1, other.point));
            const double at_b = dot(other.normal, sum(b, -1, other.point));
            if (at_a >= 0) kept.push_back(a);
            if (at_a * at_b < 0) kept.push_back(sum(a, at_a / (at_a - at_b), sum(b, -1, a)));
        }
        polygon = std::move(kept);
    }
    return polygon;
}

struct Plate {
    std::vector<Vec> polygon;
    bool before = false; ///< it would hide the bodies
};

/// @param walls  set to those that are no planes
std::vector<Plate> plates_of(const RenderData& result, const Box& bodies, const Vec& towards_eye,
                             std::vector<Poly>& walls)
{
    std::vector<Plane> planes;
    for (const Poly& wall : result.walls) {
        if (const auto plane = plane_of(wall, bodies)) {
            planes.push_back(*plane);
        } else {
            const double* b = wall->GetBounds();
            if (std::max({b[1] - b[0], b[3] - b[2], b[5] - b[4]}) < kLargestWall * bodies.size())
                walls.push_back(wall);
        }
    }
    std::vector<Plate> plates;
    for (const Plane& plane : planes) {
        Plate plate{plate_of(plane, bodies, planes), dot(plane.normal, towards_eye) <= 0};
        if (plate.polygon.size() > 2) plates.push_back(std::move(plate));
    }
    return plates;
}

// ---- the page

struct Page {
    View view;
    Box bodies;
    Contacts contacts;
    std::vector<Plate> plates;
    std::vector<Poly> walls;
    Scale stress, force;
    double stress_unit = 1; ///< [Pa]
    double highest_stress = 0;
    bool solids = false;
};

/// Joins contacts until there are few enough to be seen; none if that joins too much.
void choose_contacts(const RenderData& result, double size, Contacts& contacts)
{
    contacts.arrow = 0.16 * size;
    for (double cluster = size / 45; cluster < kLargestCluster * size; cluster *= 1.5) {
        contacts.cluster = round_down(cluster);
        contacts.clusters.clear();
        contacts.largest_force = 0;
        std::size_t most = 0;
        for (const Instant& instant : result.instants) {
            contacts.clusters.push_back(
                cluster_contacts(instant.contacts, 0.5 * contacts.cluster, true));
            most = std::max(most, contacts.clusters.back().size());
            for (const Cluster& c : contacts.clusters.back())
                contacts.largest_force = std::max(contacts.largest_force, c.magnitude);
        }
        if (most <= kMostArrows) return;
    }
    contacts.clusters.assign(result.instants.size(), {});
    contacts.cluster = contacts.largest_force = 0;
}

void choose_stress_scale(const RenderData& result, Page& page)
{
    std::vector<double> all;
    for (const Instant& instant : result.instants)
        for (const Poly& solid : instant.solids) {
            vtkDataArray* stress = solid->GetPointData()->GetArray("von_mises_averaged");
            page.solids = page.solids || stress;
            if (stress)
                for (vtkIdType i = 0; i < stress->GetNumberOfTuples(); ++i)
                    all.push_back(stress->GetTuple1(i));
        }
    double largest = 0;
    if (!all.empty()) {
        page.highest_stress = *std::max_element(all.begin(), all.end());
        const auto at = all.begin() + static_cast<std::ptrdiff_t>(
                                          kScaleHolds * static_cast<double>(all.size() - 1));
        std::nth_element(all.begin(), at, all.end());
        largest = *at > 0.01 * page.highest_stress ? *at : page.highest_stress;
    }
    for (const double unit : {1e3, 1e6, 1e9})
        if (largest >= unit) page.stress_unit = unit;
    page.stress =
        make_scale({{0.90, 0.94, 0.97}, {0.60, 0.80, 0.90}, {0.26, 0.57, 0.78}, {0.10, 0.27, 0.55}},
                   largest / page.stress_unit);
}

std::string unit_name(double pascals)
{
    return pascals == 1 ? "Pa" : pascals == 1e3 ? "kPa" : pascals == 1e6 ? "MPa" : "GPa";
}

Page make_page(const RenderData& result)
{
    Page page;
    for_each_body(result, [&](const Poly& body) {
        for (vtkIdType i = 0; i < body->GetNumberOfPoints(); ++i)
            page.bodies.include(point_of(body, i));
    });
    View& view = page.view;
    if (!(page.bodies.size() > 0)) throw std::runtime_error("nothing to draw: all points coincide");
    view.towards_eye = unit(kTowardsEye);
    view.right = unit(cross({0, 0, 1}, view.towards_eye));
    view.up = cross(view.towards_eye, view.right);
    page.plates = plates_of(result, page.bodies, view.towards_eye, page.walls);
    choose_contacts(result, page.bodies.size(), page.contacts);
    choose_stress_scale(result, page);
    page.force = make_force_scale(page.contacts.largest_force);

    Interval right, up, deep;
    Box all = page.bodies;
    const auto show = [&](const Vec& p) {
        right.include(dot(view.right, p));
        up.include(dot(view.up, p));
        deep.include(dot(view.towards_eye, p));
        all.include(p);
    };
    for_each_body(result, [&](const Poly& body) {
        for (vtkIdType i = 0; i < body->GetNumberOfPoints(); ++i)
            show(point_of(body, i));
    });
    for (const Plate& plate : page.plates)
        for (const Vec& p : plate.polygon)
            show(p);
    for (const Poly& wall : page.walls)
        for (vtkIdType i = 0; i < wall->GetNumberOfPoints(); ++i)
            show(point_of(wall, i));
    for (const std::vector<Cluster>& clusters : page.contacts.clusters)
        for (const Cluster& c : clusters)
            show(sum(c.point, page.contacts.arrow / page.contacts.largest_force, c.force));
    const double least = 0.05 * all.size();
    view.size = all.size();
    view.wide = std::max(right.length(), least);
    view.high = std::max(up.length(), least);
    view.deep = std::max(deep.length(), least);
    view.left = right.middle() - 0.5 * view.wide;
    view.bottom = up.middle() - 0.5 * view.high;
    view.behind = deep.middle() - 0.5 * view.deep;
    return page;
}

// ---- parts of a panel

vtkSmartPointer<vtkActor> actor_of(vtkPolyDataMapper* mapper, const Vec& colour)
{
    auto actor = vtkSmartPointer<vtkActor>::New();
    actor->SetMapper(mapper);
    actor->GetProperty()->SetColor(colour[0], colour[1], colour[2]);
    actor->GetProperty()->SetAmbient(0.5);
    actor->GetProperty()->SetDiffuse(0.6);
    return actor;
}

/// Normals that do not smooth creases away; without lines.
vtkSmartPointer<vtkPolyData> shaded(vtkPolyData* surface)
{
    vtkNew<vtkPolyData> faces;
    faces->ShallowCopy(surface);
    faces->SetLines(nullptr);
    faces->SetVerts(nullptr);
    vtkNew<vtkPolyDataNormals> normals;
    normals->SetInputData(faces);
    normals->SetFeatureAngle(kCreases);
    normals->Update();
    return normals->GetOutput();
}

void add_lines(vtkRenderer* renderer, vtkPolyData* lines, double width, double grey)
{
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(lines);
    mapper->ScalarVisibilityOff();
    const auto actor = actor_of(mapper, {grey, grey, grey});
    actor->GetProperty()->LightingOff();
    actor->GetProperty()->SetLineWidth(static_cast<float>(width * kOversampling));
    renderer->AddActor(actor);
}

double mean_length(vtkPolyData* lines)
{
    vtkNew<vtkIdList> ids;
    double length = 0;
    vtkIdType count = 0;
    for (lines->GetLines()->InitTraversal(); lines->GetLines()->GetNextCell(ids); ++count)
        for (vtkIdType i = 1; i < ids->GetNumberOfIds(); ++i) {
            const Vec d =
                sum(point_of(lines, ids->GetId(i)), -1, point_of(lines, ids->GetId(i - 1)));
            length += std::sqrt(dot(d, d));
        }
    return count > 0 ? length / static_cast<double>(count) : 0;
}

void add_solid(vtkRenderer* renderer, const Poly& solid, const Page& page, double pixel)
{
    vtkNew<vtkPolyData> surface;
    surface->ShallowCopy(solid);
    vtkNew<vtkPolyDataMapper> mapper;
    if (vtkDataArray* stress = solid->GetPointData()->GetArray("von_mises_averaged")) {
        vtkNew<vtkDoubleArray> drawn;
        drawn->SetName("drawn_stress");
        for (vtkIdType i = 0; i < stress->GetNumberOfTuples(); ++i)
            drawn->InsertNextValue(stress->GetTuple1(i) / page.stress_unit);
        surface->GetPointData()->AddArray(drawn);
        mapper->SetScalarModeToUsePointFieldData();
        mapper->SelectColorArray("drawn_stress");
        mapper->SetLookupTable(table_of(page.stress));
        mapper->UseLookupTableScalarRangeOn();
        mapper->InterpolateScalarsBeforeMappingOn();
    } else {
        mapper->ScalarVisibilityOff();
    }
    mapper->SetInputData(shaded(surface));
    renderer->AddActor(actor_of(mapper, kColours[0]));
    if (mean_length(surface) < kShownEdge * pixel) return;
    vtkNew<vtkPolyData> edges;
    edges->SetPoints(surface->GetPoints());
    edges->SetLines(surface->GetLines());
    add_lines(renderer, edges, 0.6, 0.3);
}

void add_rigid(vtkRenderer* renderer, const Poly& body, const Vec& colour)
{
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(shaded(body));
    mapper->ScalarVisibilityOff();
    renderer->AddActor(actor_of(mapper, colour));
    vtkNew<vtkFeatureEdges> edges;
    edges->SetInputData(body);
    edges->SetFeatureAngle(kCreases);
    edges->BoundaryEdgesOff();
    edges->NonManifoldEdgesOff();
    edges->ColoringOff();
    edges->Update();
    add_lines(renderer, edges->GetOutput(), 1.0, 0.2);
}

void add_plate(vtkRenderer* renderer, const Plate& plate)
{
    vtkNew<vtkPoints> points;
    points->SetDataTypeToDouble();
    vtkNew<vtkCellArray> face, outline;
    const auto n = static_cast<int>(plate.polygon.size());
    face->InsertNextCell(n);
    outline->InsertNextCell(n + 1);
    for (const Vec& p : plate.polygon) {
        const vtkIdType id = points->InsertNextPoint(p.data());
        face->InsertCellPoint(id);
        outline->InsertCellPoint(id);
    }
    outline->InsertCellPoint(0);
    vtkNew<vtkPolyData> edges;
    edges->SetPoints(points);
    edges->SetLines(outline);
    add_lines(renderer, edges, 0.8, 0.6);
    if (plate.before) return;
    vtkNew<vtkPolyData> data;
    data->SetPoints(points);
    data->SetPolys(face);
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(data);
    const auto actor = actor_of(mapper, kPlate);
    actor->GetProperty()->SetAmbient(0.75); // a floor that is seen at a slant is not dark
    actor->GetProperty()->SetDiffuse(0.3);
    renderer->AddActor(actor);
}

void add_panel(vtkRenderWindow* window, const Rectangle& rectangle, const RenderData& result,
               std::size_t which, const Page& page)
{
    const bool large = which == 0;
    const int letters = large ? kLargeText : kText;
    const Fit map = fit(page.view, rectangle, large);
    const Instant& instant = result.instants[which];
    const auto renderer = renderer_of(rectangle);
    for (const Plate& plate : page.plates)
        add_plate(renderer, plate);
    for (const Poly& wall : page.walls)
        renderer->AddActor(wall_actor(wall, page.view));
    for (const Poly& solid : instant.solids)
        add_solid(renderer, solid, page, map.pixel);
    for (std::size_t b = 0; b < instant.rigids.size(); ++b)
        add_rigid(renderer, instant.rigids[b], kColours[b % kColours.size()]);
    const double thinnest = 0.5 * kThinnestWire * (large ? 1 : 0.7) * map.pixel;
    for (std::size_t w = 0; w < instant.wires.size(); ++w)
        if (instant.wires[w]->GetNumberOfPoints() > 1)
            renderer->AddActor(wire_actor(instant.wires[w], thinnest,
                                          kWireColours[w % kWireColours.size()], nullptr));
    if (large) add_length_bar(renderer, page.view, rectangle, map);
    renderer->AddViewProp(
        text_actor(instant.caption, letters, 30, rectangle.height() - 0.6 * letters));
    aim(renderer, page.view, rectangle, map);
    window->AddRenderer(renderer);

    if (page.contacts.clusters[which].empty()) return;
    const auto above = renderer_of(rectangle);
    above->SetLayer(1);
    above->InteractiveOff();
    add_contacts(above, page.contacts.clusters[which], kBall * (large ? 1 : 0.7) * map.pixel,
                 page.contacts.arrow / page.contacts.largest_force, page.force);
    aim(above, page.view, rectangle, map);
    window->AddRenderer(above);
}

vtkSmartPointer<vtkRenderer> bodies_legend(const Rectangle& rectangle, const RenderData& result,
                                           const Page& page)
{
    const auto renderer = renderer_of(rectangle);
    double top = 0.90;
    std::string note;
    if (page.solids) {
        const std::string unit = unit_name(page.stress_unit);
        add_scale(renderer, rectangle, page.stress, "Von Mises stress [" + unit + "]", top);
        top -= 0.34;
        if (page.highest_stress / page.stress_unit > page.stress.end * 1.0001)
            note = "Largest stress: " + number("%.3g ", page.highest_stress / page.stress_unit) +
                   unit + ".\n";
    }
    if (page.contacts.largest_force > 0) {
        const ForceWords words = force_words(result, page.contacts);
        add_scale(renderer, rectangle, page.force, words.title, top);
        top -= 0.32;
        note += words.note;
    } else {
        vtkIdType most = 0;
        for (const Instant& instant : result.instants) {
            vtkIdType contacts = 0;
            for (const Poly& data : instant.contacts)
                contacts += data->GetNumberOfPoints();
            most = std::max(most, contacts);
        }
        if (most > kMostArrows)
            note += "Up to " + std::to_string(most) + " contacts; too many for arrows.";
    }
    renderer->AddViewProp(
        text_actor(note, kText, 0.07 * rectangle.width(), top * rectangle.height()));
    return renderer;
}

} // namespace

void add_bodies_page(vtkRenderWindow* window, const RenderData& result)
{
    // Lines lie on the faces they belong to; they win there.
    vtkMapper::SetResolveCoincidentTopologyToPolygonOffset();
    const Page page = make_page(result);
    const Layout layout = choose_layout(page.view);
    window->SetNumberOfLayers(2);
    for (std::size_t i = 0; i < layout.panels.size(); ++i) {
        if (is_repeated(result, i)) {
            window->AddRenderer(renderer_of(layout.panels[i])); // or it would be black
            continue;
        }
        add_panel(window, layout.panels[i], result, i, page);
    }
    window->AddRenderer(bodies_legend(layout.legend, result, page));
}

} // namespace amontons::vtk_module
