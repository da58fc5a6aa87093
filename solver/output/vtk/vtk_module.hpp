#pragma once

// The entry points of the run-time module libamontons-vtk.so, as plain C: the program opens
// it with dlopen only when a scene requests a picture or names a VTK surface, so that no other
// run maps VTK. Never link the module; resolve its names at run time (they are the functions' own names).
//
// Every function returns 0 when it did what it specifies. Otherwise it returns 1, has changed
// nothing, and `message` holds a sentence for the user (cut to message_size, ends with '\0').
// No exception leaves the module.

#pragma GCC visibility push(default)
extern "C" {

/// Writes a picture of a finished run: the vessel as glass, the wire at its end, the contact
/// forces on it with their scale in N, and three earlier instants. Where there is no wire: solids
/// coloured by their stress, rigid bodies, and planes as plates below and behind them.
///
/// Reads every .pvd in `result_directory` and every .vtp there that no .pvd names, and reports
/// what they are by what they hold: polylines are wires, points with `force` are contacts,
/// .vtu files are solids, triangles with `velocity` rigid bodies, other triangles without `radius`
/// are walls (those with `max_contact_force`, if any has it). Draws on an Xvfb of its own, or on
/// $DISPLAY where Xvfb is not installed.
/// @param result_directory  what `amontons run --output` wrote
/// @param png               the picture's path; written whole or not at all
int amontons_vtk_render(const char* result_directory, const char* png, char* message,
                        int message_size);

/// Reads the triangles of a .vtp file (strips and polygons are cut into triangles).
///
/// @param points     3 * point_count coordinates, in the file's unit
/// @param triangles  3 * triangle_count indices into the points, in the file's orientation
/// Both arrays are the caller's to give back to amontons_vtk_free; null on failure.
int amontons_vtk_read_surface(const char* path, double** points, long* point_count, int** triangles,
                              long* triangle_count, char* message, int message_size);

/// Gives back an array of amontons_vtk_read_surface; null is allowed.
void amontons_vtk_free(void* array);

/// A window that shows what comes down `stream` (a socket; frames as view_frame.hpp states) until
/// it is closed, or the stream ends and `stay` is 0. Sends "R" up the stream when it is there, and
/// at its end "F frames seconds". On $DISPLAY.
int amontons_vtk_view(int stream, const char* title, int stay, char* message, int message_size);

} // extern "C"
#pragma GCC visibility pop
