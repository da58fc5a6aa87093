#include "solver/solid/place_in.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

std::vector<BoundingBox> boxes_of(const VolumeMesh& mesh, std::span<const Vec3> places)
{
    std::vector<BoundingBox> boxes;
    for_each_element(mesh, [&](std::int32_t, ElementKind, auto nodes) {
        BoundingBox& box = boxes.emplace_back();
        for (const std::int32_t n : nodes)
            box.add(places[std::size_t(n)]);
    });
    return boxes;
}

} // namespace

PlaceIn place_in(ElementKind kind, const ElementPlaces& X, const Vec3& x)
{
    PlaceIn p;
    const bool brick = kind == ElementKind::H8;
    p.xi = brick ? Vec3(Vec3::Zero()) : Vec3(Vec3::Constant(0.25));
    for (int step = 0; step < 30; ++step) { // one step finds it where sides are straight
        const Vec3 missing = x - X * shape_values(kind, p.xi);
        const Mat3 J = X * shape_gradients(kind, p.xi).transpose();
        if (std::abs(J.determinant()) <= std::numeric_limits<double>::min()) return {};
        const Vec3 change = J.inverse() * missing;
        p.xi += change;
        if (!p.xi.allFinite() || p.xi.cwiseAbs().maxCoeff() > 10) return {};
        if (change.cwiseAbs().maxCoeff() < 1e-14) break;
    }
    p.outside = brick ? p.xi.cwiseAbs().maxCoeff() - 1 : std::max(-p.xi.minCoeff(), p.xi.sum() - 1);
    return p;
}

PlacedElements::PlacedElements(const VolumeMesh& mesh, std::span<const Vec3> places)
    : places_(places)
    , tree_(boxes_of(mesh, places))
{
    for_each_element(mesh, [&](std::int32_t, ElementKind kind, auto nodes) {
        elements_.push_back({kind, nodes});
    });
}

bool PlacedElements::hold_without(const Vec3& x, std::span<const std::int32_t> nodes) const
{
    constexpr double kOnBorder = 1e-9; // in the element's own coordinates

    bool found = false;
    tree_.visit({x.array(), x.array()}, [&](std::int32_t e) {
        const Element& element = elements_[std::size_t(e)];
        if (found || std::ranges::any_of(nodes, [&](std::int32_t n) {
                return std::ranges::find(element.nodes, n) != element.nodes.end();
            }))
            return;
        ElementPlaces X(3, Eigen::Index(element.nodes.size()));
        for (std::size_t k = 0; k < element.nodes.size(); ++k)
            X.col(Eigen::Index(k)) = places_[std::size_t(element.nodes[k])];
        found = place_in(element.kind, X, x).outside <= kOnBorder;
    });
    return found;
}

} // namespace amontons
