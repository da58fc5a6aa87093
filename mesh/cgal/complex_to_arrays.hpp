#pragma once

#include "mesh/cgal/cgal_module.hpp"

#include <cstdlib>
#include <map>
#include <new>
#include <unordered_map>
#include <vector>

// What Mesh_3 takes and gives, whatever its domain is: sizes, and the mesh as the module's arrays.

namespace amontons {

// Of a regular tetrahedron of edge 1: radii of the circles through its faces and of its sphere.
constexpr double kFaceRadius = 0.57735026918962576, kCellRadius = 0.61237243569579452;

/// A criterion of CGAL's: `factor` times the size that is requested at a place.
template <class Kernel, class Domain> struct SizeField {
    using FT = typename Kernel::FT;
    using Point_3 = typename Kernel::Point_3;
    using Index = typename Domain::Index;

    const AmontonsCgalInput* input;
    double factor;

    FT operator()(const Point_3& p, int, const Index&) const
    {
        const double place[3] = {p.x(), p.y(), p.z()};
        return factor * input->size(place, input->with);
    }
};

template <class T> T* array_of(std::size_t count)
{
    T* all = static_cast<T*>(std::malloc(count * sizeof(T) + 1));
    if (!all) throw std::bad_alloc();
    return all;
}

/// @param complex  CGAL's Mesh_complex_3_in_triangulation_3
/// @throws std::bad_alloc  what `out` holds by then is to be freed
template <class Complex> void to_arrays(const Complex& complex, AmontonsCgalMesh& out)
{
    using Vertex = typename Complex::Triangulation::Vertex_handle;
    std::unordered_map<const void*, int> number;
    std::vector<Vertex> vertices;
    const auto number_of = [&](Vertex v) {
        const auto [at, is_new] = number.try_emplace(&*v, static_cast<int>(vertices.size()));
        if (is_new) vertices.push_back(v);
        return at->second;
    };
    out.tetrahedra = array_of<int>(4 * complex.number_of_cells_in_complex());
    for (auto c = complex.cells_in_complex_begin(); c != complex.cells_in_complex_end(); ++c) {
        for (int k = 0; k < 4; ++k)
            out.tetrahedra[4 * out.tetrahedron_count + k] = number_of(c->vertex(k));
        ++out.tetrahedron_count;
    }
    out.points = array_of<double>(3 * vertices.size());
    for (const Vertex v : vertices) {
        for (int k = 0; k < 3; ++k)
            out.points[3 * out.point_count + k] = v->point().point()[k];
        ++out.point_count;
    }
    std::map<typename Complex::Surface_patch_index, int> patches;
    for (auto f = complex.facets_in_complex_begin(); f != complex.facets_in_complex_end(); ++f)
        patches.try_emplace(complex.surface_patch_index(*f), 0);
    for (auto& [patch, at] : patches)
        at = out.patch_count++;
    out.faces = array_of<int>(4 * complex.number_of_facets_in_complex());
    for (auto f = complex.facets_in_complex_begin(); f != complex.facets_in_complex_end(); ++f) {
        int* face = out.faces + 4 * out.face_count++;
        for (int k = 0, n = 0; k < 4; ++k)
            if (k != f->second) face[n++] = number_of(f->first->vertex(k));
        face[3] = patches.at(complex.surface_patch_index(*f));
    }
    out.feature_edge_count = static_cast<long>(complex.number_of_edges_in_complex());
}

} // namespace amontons
