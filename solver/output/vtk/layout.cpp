#include "solver/output/vtk/layout.hpp"

#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace amontons::vtk_module {
namespace {

constexpr double kClusterOfSize = 1.0 / 45; // contacts this near are drawn as one arrow
constexpr double kArrowOfSize = 0.11;       // the largest force's arrow, of the walls' box
constexpr double kFreeMargin = 0.03;        // of a panel, around what it shows

struct Extent {
    Vec low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
    void include(const Vec& point)
    {
        for (std::size_t i = 0; i < 3; ++i) {
            low[i] = std::min(low[i], point[i]);
            high[i] = std::max(high[i], point[i]);
        }
    }
    void include(const Poly& data)
    {
        if (data->GetNumberOfPoints() == 0) return;
        const double* b = data->GetBounds();
        include(Vec{b[0], b[2], b[4]});
        include(Vec{b[1], b[3], b[5]});
    }
};

} // namespace

double round_down(double value)
{
    const double power = std::pow(10.0, std::floor(std::log10(value)));
    const double digits = value / power;
    return power * (digits >= 5 ? 5 : digits >= 2 ? 2 : 1);
}

View choose_view(const RenderData& result, Contacts& contacts)
{
    Extent box;
    for (const Poly& wall : result.walls)
        box.include(wall);
    for (const Instant& instant : result.instants)
        for (const std::vector<Poly>* bodies : {&instant.wires, &instant.solids})
            for (const Poly& body : *bodies)
                box.include(body);
    Vec size{};
    for (std::size_t i = 0; i < 3; ++i)
        size[i] = std::max(0.0, box.high[i] - box.low[i]);

    View view;
    view.size = std::max({size[0], size[1], size[2]});
    if (!(view.size > 0)) throw std::runtime_error("nothing to draw: all points coincide");
    // Equal to within a hundredth: rather point along y, then z, so that z is up where it can be.
    std::size_t thin = 1;
    for (const std::size_t axis : {2, 0})
        if (size[axis] < 0.99 * size[thin]) thin = axis;
    const std::size_t up = thin == 2 ? 1 : 2;
    const std::size_t right = 3 - thin - up;
    view.right[right] = 1;
    view.up[up] = 1;
    for (std::size_t i = 0; i < 3; ++i)
        view.towards_eye[i] = view.right[(i + 1) % 3] * view.up[(i + 2) % 3] -
                              view.right[(i + 2) % 3] * view.up[(i + 1) % 3];

    contacts.cluster = round_down(kClusterOfSize * view.size);
    contacts.arrow = kArrowOfSize * view.size;
    const bool by_pair = !touch_walls_alone(result);
    for (const Instant& instant : result.instants) {
        contacts.clusters.push_back(
            cluster_contacts(instant.contacts, 0.5 * contacts.cluster, by_pair));
        for (const Cluster& cluster : contacts.clusters.back())
            contacts.largest_force = std::max(contacts.largest_force, cluster.magnitude);
    }
    for (const std::vector<Cluster>& clusters : contacts.clusters)
        for (const Cluster& cluster : clusters) {
            Vec tip = cluster.point;
            for (std::size_t i = 0; i < 3; ++i)
                tip[i] += cluster.force[i] * contacts.arrow / contacts.largest_force;
            box.include(tip);
        }
    const double least = 0.05 * view.size; // a straight wire alone has no width
    const auto side = [&](const Vec& axis, double& low, double& length) {
        const double a = dot(axis, box.low), b = dot(axis, box.high);
        length = std::max(std::abs(b - a), least);
        low = 0.5 * (a + b - length);
    };
    side(view.right, view.left, view.wide);
    side(view.up, view.bottom, view.high);
    side(view.towards_eye, view.behind, view.deep);
    return view;
}

Layout choose_layout(const View& view)
{
    Layout layout;
    constexpr double w = kWidth, h = kHeight;
    const double aspect = view.wide / view.high;
    const auto row = [&](double left, double bottom, double right, double top) {
        for (std::size_t i = 0; i < 3; ++i) {
            const double step = (right - left) / 3;
            layout.panels[1 + i] = {left + step * double(i), bottom, left + step * double(i + 1),
                                    top};
        }
    };
    if (aspect < 0.9) { // tall: the end on the left; on the right a row above the legend
        const double split = std::round(std::max(aspect * h, 0.30 * w));
        layout.panels[0] = {0, 0, split, h};
        row(split, 0.38 * h, w, h);
        layout.legend = {split, 0, w, 0.38 * h};
    } else if (aspect < 2.2) { // the end above the legend; on the right a column
        const double split = 0.67 * w;
        layout.panels[0] = {0, 0.30 * h, split, h};
        for (std::size_t i = 0; i < 3; ++i)
            layout.panels[1 + i] = {split, h * double(2 - i) / 3, w, h * double(3 - i) / 3};
        layout.legend = {0, 0, split, 0.30 * h};
    } else { // wide: the end above; below a row beside the legend
        layout.panels[0] = {0, 0.38 * h, w, h};
        row(0, 0, 0.66 * w, 0.38 * h);
        layout.legend = {0.66 * w, 0, w, 0.38 * h};
    }
    return layout;
}

Fit fit(const View& view, const Rectangle& panel, bool large)
{
    const double above = 3.0 * (large ? kLargeText : kText); // two lines of caption
    const double below = large ? 2.5 * kText : 0;            // the bar of known length
    const double margin = kFreeMargin * std::min(panel.width(), panel.height());
    Fit result;
    result.pixel = std::max(view.wide / (panel.width() - 2 * margin),
                            view.high / (panel.height() - 2 * margin - above - below));
    result.x = view.left + 0.5 * view.wide;
    result.y = view.bottom + 0.5 * view.high + 0.5 * (above - below) * result.pixel;
    return result;
}

} // namespace amontons::vtk_module
