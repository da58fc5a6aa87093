// CGAL's Mesh_3 of what a function encloses. As tetrahedralise.cpp, this file takes CGAL's
// templates, and nothing else belongs here.

#include "mesh/cgal/implicit.hpp"

#include "mesh/cgal/complex_to_arrays.hpp"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Random.h>
#include <CGAL/exude_mesh_3.h>
#include <CGAL/make_mesh_3.h>
#include <CGAL/perturb_mesh_3.h>

#include <utility>

namespace amontons {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Labels = CGAL::Labeled_mesh_domain_3<Kernel>;

constexpr double kBall = 1.1;   // of diameter 1, with room for what rounding adds
constexpr double kError = 1e-5; // of a place on the surface / the ball's radius

/// CGAL begins with rays from the middle, which miss branches: places on every part are given.
struct Domain : Labels {
    const AmontonsCgalInput* input;

    Domain(const AmontonsCgalInput& in, CGAL::Random& random)
        : Labels(
              [&in](const Kernel::Point_3& p) {
                  const double place[3] = {p.x(), p.y(), p.z()};
                  return in.outside(place, in.with) < 0 ? 1 : 0;
              },
              Kernel::Sphere_3(CGAL::ORIGIN, 0.25 * kBall * kBall),
              CGAL::parameters::relative_error_bound = kError, CGAL::parameters::p_rng = &random)
        , input(&in)
    {
    }

    struct Construct_initial_points {
        const AmontonsCgalInput* input;

        template <class Out> Out operator()(Out out, int = 0) const
        {
            const Index surface(std::pair<int, int>(0, 1));
            for (long i = 0; i < input->point_count; ++i) {
                const double* x = input->points + 3 * i;
                *out++ = std::make_pair(Kernel::Point_3(x[0], x[1], x[2]), surface);
            }
            return out;
        }
    };
    Construct_initial_points construct_initial_points_object() const { return {input}; }
};

using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;

using Size = amontons::SizeField<Kernel, Domain>;

} // namespace

void fill_implicit(const AmontonsCgalInput& in, AmontonsCgalMesh& mesh)
{
    namespace p = CGAL::parameters;
    CGAL::Random random(0); // the same mesh every time
    Domain domain(in, random);
    const Criteria criteria(p::facet_angle = 25, p::facet_size = Size{&in, kFaceRadius},
                            p::facet_distance = in.deviation, p::cell_radius_edge_ratio = 2,
                            p::cell_size = Size{&in, kCellRadius});
    Complex complex = CGAL::make_mesh_3<Complex>(domain, criteria,
                                                 in.manifold ? p::manifold() : p::non_manifold(),
                                                 p::no_perturb(), p::no_exude());
    CGAL::perturb_mesh_3(complex, domain, p::sliver_bound = in.sliver_bound);
    CGAL::exude_mesh_3(complex, p::sliver_bound = in.sliver_bound);
    to_arrays(complex, mesh);
}

} // namespace amontons
