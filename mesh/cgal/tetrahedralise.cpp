// CGAL's Mesh_3 behind plain C: triangles as the surface. This file takes CGAL's templates, 40 s
// and 3 GB of the compiler, and nothing else belongs here.

#include "mesh/cgal/cgal_module.hpp"
#include "mesh/cgal/complex_to_arrays.hpp"
#include "mesh/cgal/implicit.hpp"

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
#include <new>
#include <stdexcept>
#include <vector>

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Polyhedron = CGAL::Mesh_polyhedron_3<Kernel>::type;
using Domain = CGAL::Polyhedral_mesh_domain_with_features_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation, Domain::Corner_index,
                                                        Domain::Curve_index>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

using Size = amontons::SizeField<Kernel, Domain>;

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
        throw std::runtime_error("the surface touches itself at a vertex or an edge");
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
                            p::facet_size = Size{&in, amontons::kFaceRadius},
                            p::facet_distance = in.deviation, p::cell_radius_edge_ratio = 2,
                            p::cell_size = Size{&in, amontons::kCellRadius});
    Complex complex = CGAL::make_mesh_3<Complex>(domain, criteria,
                                                 in.manifold ? p::manifold() : p::non_manifold(),
                                                 p::no_perturb(), p::no_exude());
    // By angle and not by time: a time limit would make the mesh depend on the machine.
    CGAL::perturb_mesh_3(complex, domain, p::sliver_bound = in.sliver_bound);
    CGAL::exude_mesh_3(complex, p::sliver_bound = in.sliver_bound);
    return complex;
}

} // namespace

int amontons_cgal_tetrahedralise(const AmontonsCgalInput* input, AmontonsCgalMesh* mesh,
                                 char* message, int message_size)
{
    *mesh = AmontonsCgalMesh{};
    const auto set_message = [&](const char* text) {
        std::snprintf(message, static_cast<std::size_t>(message_size), "%s", text);
    };
    int code = 1;
    try {
        if (input->outside)
            amontons::fill_implicit(*input, *mesh);
        else
            amontons::to_arrays(mesh_of(*input), *mesh);
        return 0;
    } catch (const std::bad_alloc&) {
        set_message("not enough memory");
        code = 2;
    } catch (const std::exception& error) {
        set_message(error.what());
    } catch (...) {
        set_message("an unknown error of CGAL");
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
