#pragma once

// The entry points of the run-time module libamontons-cgal.so, as plain C: the program opens it
// with dlopen only when a surface is to be filled with tetrahedra, so that nothing else maps it.
// Never link the module; resolve its names at run time.
//
// The module uses CGAL and contains nothing of files, units or repair: what comes in is closed,
// oriented and does not touch itself, or is a function. It works best on numbers near 1: a ball of
// diameter 1 around the origin holds everything.
//
// No exception leaves the module. What `size` throws passes through CGAL unharmed and is caught.

#pragma GCC visibility push(default)
extern "C" {

/// What is to be meshed, and how finely.
struct AmontonsCgalInput {
    const double* points; ///< 3 x point_count
    long point_count;
    const int* triangles; ///< 3 x triangle_count, counter-clockwise seen from outside
    long triangle_count;
    double feature_angle; ///< edges whose two normals differ by more are kept [degrees]
    /// Longest edge allowed at a place (3 numbers). Called very often; may throw to end the meshing.
    double (*size)(const double* place, void* with);
    void* with;       ///< handed to `size`
    double deviation; ///< largest distance of a boundary triangle from the surface
    /// Not 0: refine until the mesh's surface is a manifold, which can continue without end at a
    /// knife's edge; 0: leave that to the sizes.
    int manifold;
    double sliver_bound; ///< dihedral angle that elements are moved to reach [degrees]
    /// Null: the triangles are the surface. Else the places where this is < 0 are filled, no edge
    /// is kept, `triangles` are not read, `points` are places on the surface to begin with.
    double (*outside)(const double* place, void* with);
};

/// The tetrahedra; arrays of the module, to be given back to amontons_cgal_free.
struct AmontonsCgalMesh {
    double* points; ///< 3 x point_count
    long point_count;
    int* tetrahedra; ///< 4 x tetrahedron_count; the fourth lies where 0 1 2 faces
    long tetrahedron_count;
    int* faces; ///< 4 x face_count: three nodes in no certain order, and the patch
    long face_count;
    int patch_count;         ///< parts of the surface between kept edges, 0 to patch_count - 1
    long feature_edge_count; ///< edges of elements that lie on kept edges
};

/// Fills a closed surface with tetrahedra.
/// @return  0 when it did; else the mesh is null, and `message` holds why (cut to message_size,
///          ends with '\0'): 2 for lack of memory, 1 for all else
int amontons_cgal_tetrahedralise(const AmontonsCgalInput* input, AmontonsCgalMesh* mesh,
                                 char* message, int message_size);

/// Gives back what amontons_cgal_tetrahedralise returned; leaves nulls.
void amontons_cgal_free(AmontonsCgalMesh* mesh);

} // extern "C"
#pragma GCC visibility pop
