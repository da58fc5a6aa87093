#pragma once

#include "contact/surface/facets.hpp"

namespace amontons {

/// A facet in a plane, counter-clockwise; seen from its back the order is reversed.
/// @param heights  gets the lowest and the highest of its corners over the plane [m]
ConvexPolygon outline(const Facet& facet, const FacetPlane& plane, bool from_back,
                      double heights[2]);

/// The same, in place of what `p` was.
void outline_to(const Facet& facet, const FacetPlane& plane, bool from_back, double heights[2],
                ConvexPolygon& p);

/// Whether no corner turns inwards, seen along the normal; degenerate corners count as straight.
bool is_convex_polygon(const ConvexPolygon& p);

/// Calls visit with the convex parts of a facet's outline: that of a quadrilateral seen from the
/// side may be concave, and is divided into two triangles then.
template <class Visit> void for_convex_parts(const ConvexPolygon& p, Visit visit)
{
    if (p.count == 3 || is_convex_polygon(p)) {
        visit(p);
        return;
    }
    // The diagonal from the corner that points inwards, or from the one opposite.
    const bool first = twice_area(p[3], p[0], p[1]) < 0 || twice_area(p[1], p[2], p[3]) < 0;
    const int a = first ? 0 : 1;
    for (const int b : {a, a + 2}) {
        ConvexPolygon triangle;
        for (const int i : {b, b + 1, b + 2})
            triangle.add(p[i % 4]);
        visit(triangle);
    }
}

} // namespace amontons
