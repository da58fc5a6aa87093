#pragma once

#include "mesh/size_field.hpp"
#include "mesh/volume_mesh.hpp"

#include <numbers>
#include <string>

// What a closed surface encloses as tetrahedra, by the run-time module libamontons-cgal. Nothing
// else maps CGAL.

namespace amontons {

/// Options of filling a surface.
struct TetrahedraliseOptions {
    double size = 0;                 ///< longest edge of an element [m], > 0
    std::vector<SizeSource> sources; ///< where it is to be smaller
    double gradation = 0.3;          ///< growth of the size away from those [-], > 0
    /// Edges whose two normals differ by more are kept as edges of elements [rad].
    double feature_angle = std::numbers::pi / 4;
    double deviation = 0; ///< of boundary triangles from the surface [m]; 0: a twentieth of the
                          ///< size, at most half the least local one
    /// Elements follow features below the size down; otherwise those are an error.
    bool refine_small = false;
    bool close_holes = false; ///< otherwise holes are an error
    /// > 0: what is left of the solid when walls, flaps and gaps thinner than this are lost and
    /// edges are rounded (RoundedSolid); the surface may pass through itself and fold back. No edge
    /// is kept then. 0: such surfaces are an error [m].
    double repair = 0;
    ElementKind kind = ElementKind::T10; ///< or T4; middle nodes lie half-way
    double memory = 0;                   ///< limit [bytes]; 0: half of the machine's
};

/// Tetrahedra of a surface, and messages.
struct Tetrahedralised {
    VolumeMesh mesh; ///< element set "volume", face sets "outer" and "face_1", "face_2", ...: the
                     ///< parts of the surface between kept edges
    /// Predicted number of elements.
    double predicted_elements = 0;
    double predicted_memory = 0;    ///< [bytes]
    double deviation = 0;           ///< of the surface's vertices from the mesh's, the largest [m]
    double face_deviation = 0;      ///< of the middles of the mesh's faces from the surface [m]
    double least_dihedral = 0;      ///< [rad]
    std::int64_t feature_edges = 0; ///< edges of elements on kept edges
    double seconds = 0;             ///< of the mesher [s]
};

/// Whether they are in range; lengths in any unit.
/// @throws InputError  naming them as the options of the program
void check_options(const TetrahedraliseOptions& options);

/// What a mesh may take: that of the options, or half of the machine's [bytes].
double memory_limit(const TetrahedraliseOptions& options);

/// @param surface  repaired here
/// @param file     for messages
/// @param notes    gets every repair, and what was refined; also before it throws
/// @throws InputError  options out of range; a surface that is open, touches itself or has edges of
///                     more than two triangles (repair: may touch itself); features below the size;
///                     more memory than allowed; no module; a surface that CGAL does not mesh, or
///                     whose mesh is not the requested one
/// @throws std::bad_alloc
Tetrahedralised tetrahedralise(SurfaceMesh surface, const TetrahedraliseOptions& options,
                               const std::string& file, std::vector<std::string>& notes);

} // namespace amontons
