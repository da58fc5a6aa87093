// CGAL's Mesh_3 behind plain C. This file takes CGAL's templates, 40 s and 3 GB of the compiler,
// and nothing else belongs here.

#include "mesh/cgal/cgal_module.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polyhedral_mesh_domain_with_features_3.h>
#include <CGAL/Random.h>
#include <CGAL/exude_mesh_3.h>
#include <CGAL/make_mesh_3.h>
#include <CGAL/perturb_mesh_3.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <new>
#include <stdexcept>
#include <unordered_map>
#include <vector>

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Polyhedron = CGAL::Mesh_polyhedron_3<Kernel>::type;
using Domain = CGAL::Polyhedral_mesh_domain_with_features_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation, Domain::Corner_index,
                                                        Domain::Curve_index>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

// Of a regular tetrahedron of edge 1: radii of the circles through its faces and of its sphere.
constexpr double kFaceRadius = 0.57735026918962576, kCellRadius = 0.61237243569579452;

struct Size {
    using FT = Kernel::FT;
    using Point_3 = Kernel::Point_3;
    using Index = Domain::Index;

    const AmontonsCgalInput* input;
    double factor;

    FT operator()(const Point_3& p, int, const Index&) const
    {
        const double place[3] = {p.x(), p.y(), p.z()};
        return factor * input->size(place, input->with);
    }
};

Polyhedron polyhedron_of(const AmontonsCgalInput& in)
{
    std::vector<Kernel::Point_3> points;
    for (long i = 0; i < in.point_count; ++i)
        points.emplace_back(in.points[3 * i], in.points[3 * i + 1], in.points[3 * i + 2]);
    std::vector<std::array<std::size_t, 3>> triangles;
    for (long i = 0; i < in.triangle_count; ++i) {
        const int* t = in.triangles + 3 * i;
        triangles.push_back({static_cast<std::size_t>(t[0]), static_cast<std::size_t>(t[1]),
                             static_cast<std::size_t>(t[2])});
    }
    namespace pmp = CGAL::Polygon_mesh_processing;
    if (!pmp::is_polygon_soup_a_polygon_mesh(triangles))
        throw std::runtime_error("the surface meets itself at a vertex or an edge");
    Polyhedron polyhedron;
    pmp::polygon_soup_to_polygon_mesh(points, triangles, polyhedron);
    if (!CGAL::is_closed(polyhedron)) throw std::runtime_error("the surface is open");
    return polyhedron;
}

Complex mesh_of(const AmontonsCgalInput& in)
{
    namespace p = CGAL::parameters;
    CGAL::Random random(0); // the same mesh every time
    const Polyhedron polyhedron = polyhedron_of(in);
    Domain domain(polyhedron, &random);
    domain.detect_features(in.feature_angle);
    const Criteria criteria(p::edge_size = Size{&in, 1}, p::facet_angle = 25,
                            p::facet_size = Size{&in, kFaceRadius},
                            p::facet_distance = in.deviation, p::cell_radius_edge_ratio = 2,
                            p::cell_size = Size{&in, kCellRadius});
    Complex complex = CGAL::make_mesh_3<Complex>(domain, criteria,
                                                 in.manifold ? p::manifold() : p::non_manifold(),
                                                 p::no_perturb(), p::no_exude());
    // By angle and not by time: a time limit would make the mesh depend on the machine.
    CGAL::perturb_mesh_3(complex, domain, p::sliver_bound = in.sliver_bound);
    CGAL::exude_mesh_3(complex, p::sliver_bound = in.sliver_bound);
    return complex;
}

template <class T> T* array_of(std::size_t count)
{
    T* all = static_cast<T*>(std::malloc(count * sizeof(T) + 1));
    if (!all) throw std::bad_alloc();
    return all;
}

void hand_out(const Complex& complex, AmontonsCgalMesh& out)
{
    std::unordered_map<Triangulation::Vertex_handle, int, CGAL::Handle_hash_function> number;
    std::vector<Triangulation::Vertex_handle> vertices;
    const auto number_of = [&](Triangulation::Vertex_handle v) {
        const auto [at, is_new] = number.try_emplace(v, static_cast<int>(vertices.size()));
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
    for (const Triangulation::Vertex_handle v : vertices) {
        for (int k = 0; k < 3; ++k)
            out.points[3 * out.point_count + k] = v->point().point()[k];
        ++out.point_count;
    }
    std::map<Complex::Surface_patch_index, int> patches;
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

} // namespace

int amontons_cgal_tetrahedralise(const AmontonsCgalInput* input, AmontonsCgalMesh* mesh,
                                 char* message, int message_size)
{
    *mesh = AmontonsCgalMesh{};
    const auto say = [&](const char* text) {
        std::snprintf(message, static_cast<std::size_t>(message_size), "%s", text);
    };
    int code = 1;
    try {
        hand_out(mesh_of(*input), *mesh);
        return 0;
    } catch (const std::bad_alloc&) {
        say("not enough memory");
        code = 2;
    } catch (const std::exception& error) {
        say(error.what());
    } catch (...) {
        say("an unknown error of CGAL");
    }
    amontons_cgal_free(mesh);
    return code;
}

void amontons_cgal_free(AmontonsCgalMesh* mesh)
{
    std::free(mesh->points);
    std::free(mesh->tetrahedra);
    std::free(mesh->faces);
    *mesh = AmontonsCgalMesh{};
}
