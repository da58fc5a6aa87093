#pragma once

#include "solver/output/vtk/layout.hpp"

template <class T> class vtkSmartPointer;
class vtkActor;
class vtkLookupTable;
class vtkRenderWindow;
class vtkRenderer;
class vtkTextActor;

// The parts that pictures of wires and of bodies share.

namespace amontons::vtk_module {

constexpr int kOversampling = 2;    // drawn larger, then averaged: smooth edges
constexpr double kThinnestWire = 7; // drawn at least this wide, large panel [pixels]
constexpr Vec kInk = {0.1, 0.1, 0.1};

/// A scale from 0 to `largest`, rounded up so that it has up to six round steps.
struct Scale {
    std::vector<Vec> stops; ///< colours, evenly spaced from 0 to the end
    double end = 1;
    int steps = 5;
};

Scale make_scale(const std::vector<Vec>& stops, double largest);

vtkSmartPointer<vtkLookupTable> table_of(const Scale& scale);

/// Yellow to red, for the force of contacts.
Scale make_force_scale(double largest);

/// Glass: nearly clear where one points straight at it, denser towards its outline. Its colour
/// is the same everywhere, so the order in which layers are blended does not matter and no
/// depth peeling is needed.
vtkSmartPointer<vtkActor> wall_actor(const Poly& wall, const View& view);

/// A tube as thick as the wire, or as `thinnest` [m] where that is more.
/// @param curvature  colours it by its curvature, in place of `colour`; null: does not
vtkSmartPointer<vtkActor> wire_actor(const Poly& wire, double thinnest, const Vec& colour,
                                     const Scale* curvature);

/// What the legend writes of contacts that are drawn by pair.
struct ForceWords {
    std::string title, note;
};

ForceWords force_words(const RenderData& result, const Contacts& contacts);

/// A ball at each cluster and an arrow along its force, both coloured by it.
void add_contacts(vtkRenderer* renderer, const std::vector<Cluster>& clusters, double ball,
                  double arrow_per_newton, const Scale& scale);

/// @param x, y  of the text's upper left corner in the panel [pixels of the picture]
vtkSmartPointer<vtkTextActor> text_actor(const std::string& text, int size, double x, double y);

/// A bar of known length in the lower left corner of a panel.
void add_length_bar(vtkRenderer* renderer, const View& view, const Rectangle& panel,
                    const Fit& map);

/// An empty white part of the page.
vtkSmartPointer<vtkRenderer> renderer_of(const Rectangle& rectangle);

/// Sets the camera of a panel; call it when the panel holds all it shows.
void aim(vtkRenderer* renderer, const View& view, const Rectangle& panel, const Fit& map);

/// @param top  of the title in the legend, as a part of its height
void add_scale(vtkRenderer* renderer, const Rectangle& legend, const Scale& scale,
               const std::string& title, double top);

/// Draws a window's renderers one part of the page after the other, each in a window of its own
/// size, and writes the page. The window holds nothing then.
/// @throws std::runtime_error  if the file cannot be written; nothing is left of it then
void write_page(vtkRenderWindow* window, const std::filesystem::path& png);

} // namespace amontons::vtk_module
