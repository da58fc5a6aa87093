#pragma once

#include "solver/output/vtk/render_data.hpp"

// Layout of the page: the field of view of the camera, and the part of the page of each
// panel. Nothing here draws.

namespace amontons::vtk_module {

constexpr int kWidth = 2400, kHeight = 1500; // of the picture [pixels]
constexpr int kLargeText = 34, kText = 26;   // height of letters [pixels]

/// The camera that all panels share: (right, up, towards the eye) is right-handed, of unit
/// vectors. For wires screen axes are coordinate axes.
struct View {
    Vec right{}, up{}, towards_eye{};
    double size = 0;             ///< largest side of the box of walls and wires [m]
    double left = 0, wide = 0;   ///< what must be visible, along `right` [m]
    double bottom = 0, high = 0; ///< along `up` [m]
    double behind = 0, deep = 0; ///< along `towards_eye` [m]
};

/// Properties of all instants that the drawing of contacts needs.
struct Contacts {
    double cluster = 0;                         ///< diameter of what one arrow sums [m]
    double arrow = 0;                           ///< length of the largest force's arrow [m]
    double largest_force = 0;                   ///< of the clusters of all instants [N]
    std::vector<std::vector<Cluster>> clusters; ///< of each instant
};

/// The largest of 1, 2, 5 times a power of ten that is not above `value` > 0.
double round_down(double value);

/// Examines the box of walls and wires along its thinnest side, and joins the contacts so that
/// their arrows fit in.
/// @throws std::runtime_error  if the box is a point
View choose_view(const RenderData& result, Contacts& contacts);

/// A part of the page [pixels of the picture, from its lower left].
struct Rectangle {
    double left = 0, bottom = 0, right = 0, top = 0;
    double width() const { return right - left; }
    double height() const { return top - bottom; }
};

struct Layout {
    std::array<Rectangle, 4> panels{}; ///< the end, then the three earlier instants
    Rectangle legend{};
};

/// Tall, squarish and wide views have each their own layout.
Layout choose_layout(const View& view);

/// How a panel maps the view to its pixels: what is seen fills the rectangle but for a margin
/// and the caption's lines at the top.
struct Fit {
    double pixel = 0;    ///< length of a pixel of the picture [m]
    double x = 0, y = 0; ///< the panel's centre along `right` and `up` [m]
};

/// @param large  the panel has the larger letters and the bar of known length
Fit fit(const View& view, const Rectangle& panel, bool large);

} // namespace amontons::vtk_module
