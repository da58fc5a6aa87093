#pragma once

#include "solver/solid/element.hpp"

#include <Eigen/SparseCore>
#include <span>
#include <vector>

// From elements to sparse matrices, by columns and with both triangles. Degree of freedom
// 3 node + axis; nodes in the mesh's order. The pattern is found once; matrices made from it are
// filled again and again without allocation.

namespace amontons {

/// Which nodes share an element, and where each element's blocks are in that list.
struct SolidPattern {
    std::vector<std::int32_t> start;     ///< nodes + 1: the neighbours of node j begin here
    std::vector<std::int32_t> neighbour; ///< ascending for each node, itself included
    /// Element by element, n x n by columns: which neighbour of node j node i is.
    std::vector<std::int32_t> rank;
};

/// @throws std::logic_error  if an element names a node that the mesh has not, or the matrix has
///                           more than 2^31 - 1 entries
SolidPattern make_pattern(const VolumeMesh& mesh);

using SparseMatrix = Eigen::SparseMatrix<double>;

/// 3 nodes x 3 nodes, all entries of the pattern present and 0.
SparseMatrix zero_matrix(const SolidPattern& pattern);
/// The same of a matrix that was made by it.
void clear(const SolidPattern& pattern, SparseMatrix& matrix);

/// An element's places in the mesh.
using ElementPlaces = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMostSolidNodes>;
/// Places of an element's nodes [m].
ElementPlaces places_of(const VolumeMesh& mesh, std::span<const std::int32_t> nodes);
/// ... moved by u (3 nodes), as seen from the first node at rest: far from the origin places have a
/// round-off that stiff elements would answer to.
ElementPlaces displaced_places(const VolumeMesh& mesh, std::span<const std::int32_t> nodes,
                               const Eigen::VectorXd& u);

/// Adds an element's matrix.
/// @param at      where the element's ranks begin in pattern.rank; moved on past them
/// @param block   3n x 3n
/// @param values  of a zero_matrix
void add_element(const SolidPattern& pattern, std::size_t& at, std::span<const std::int32_t> nodes,
                 const ElementMatrix& block, double* values);

/// Sets a matrix to the sum over the elements: block(number, kind, nodes, ElementMatrix& 3n x 3n)
/// gives that of one.
/// @param matrix  made by zero_matrix of the same mesh's pattern
template <class Block>
void assemble(const VolumeMesh& mesh, const SolidPattern& pattern, Block block,
              SparseMatrix& matrix)
{
    clear(pattern, matrix);
    ElementMatrix K;
    std::size_t at = 0;
    for_each_element(
        mesh, [&](std::int32_t number, ElementKind kind, std::span<const std::int32_t> nodes) {
            block(number, kind, nodes, K);
            add_element(pattern, at, nodes, K, matrix.valuePtr());
        });
}

/// A x of a symmetric matrix made by zero_matrix: column by column, so that products are of
/// numbers that lie side by side. Here and below: the same to the last bit for any `threads`.
Eigen::VectorXd symmetric_times(const SolidPattern& pattern, const SparseMatrix& A,
                                const Eigen::VectorXd& x, int threads = 1);

/// Stiffness matrix [N/m].
/// @param materials  one for all elements, or one of each
void assemble_stiffness(const VolumeMesh& mesh, const SolidPattern& pattern,
                        std::span<const SolidMaterial> materials, SparseMatrix& K, int threads = 1);

/// Consistent mass matrix [kg].
void assemble_mass(const VolumeMesh& mesh, const SolidPattern& pattern,
                   std::span<const SolidMaterial> materials, SparseMatrix& M, int threads = 1);

/// Lumped masses, one of each degree of freedom: 3 nodes [kg]; 0 at nodes of no element.
Eigen::VectorXd assemble_lumped_mass(const VolumeMesh& mesh,
                                     std::span<const SolidMaterial> materials);

/// Adds density times acceleration: the weight.
/// @param acceleration  [m/s^2]
/// @param f             3 nodes [N]
void add_weight(const VolumeMesh& mesh, std::span<const SolidMaterial> materials,
                const Vec3& acceleration, Eigen::Ref<Eigen::VectorXd> f);

/// Add a pressure (> 0 pushes inwards) or a force per area on faces of the mesh [Pa].
void add_pressure(const VolumeMesh& mesh, std::span<const FaceRef> faces, double pressure,
                  Eigen::Ref<Eigen::VectorXd> f);
/// Adds the nodal forces of a uniform traction [Pa] on faces at rest.
void add_traction(const VolumeMesh& mesh, std::span<const FaceRef> faces, const Vec3& traction,
                  Eigen::Ref<Eigen::VectorXd> f);

/// Adds the stiffness of springs between faces and what stands still; see support_stiffness.
/// @param K  made by zero_matrix of the mesh's pattern
/// @param normal, tangential  stiffness of the springs per area [N/m^3]
void add_support(const VolumeMesh& mesh, std::span<const FaceRef> faces, double normal,
                 double tangential, SparseMatrix& K);

/// Forces of a pressure that follows the faces to where displacements u (3 nodes) take them [N].
Eigen::VectorXd follower_pressure(const VolumeMesh& mesh, std::span<const FaceRef> faces,
                                  const Eigen::VectorXd& u, double pressure);

/// Swept by the faces into the body on the straight way from rest to u [m^3]: the work of 1 Pa that
/// follows them.
double swept_volume(const VolumeMesh& mesh, std::span<const FaceRef> faces,
                    const Eigen::VectorXd& u);

/// Degrees of freedom whose displacement is prescribed, and the others.
struct FreeDofs {
    std::vector<std::int32_t> free, fixed; ///< ascending; together all of the mesh
    std::vector<std::int32_t> number; ///< of each: its place in `free`, or -1 - that in `fixed`
};

/// Nodes of no element have no stiffness: theirs are fixed too.
/// @param fixed  in any order, may repeat
/// @throws std::logic_error  if one is not of the mesh
FreeDofs make_free_dofs(const SolidPattern& pattern, std::span<const std::int32_t> fixed);

/// A matrix without its prescribed rows: A_ff u_f = f_f - A_fc u_c. Reactions are A u - f, with the
/// whole A, at the fixed ones.
struct Elimination {
    SparseMatrix ff, fc;                            ///< free x free, free x fixed
    std::vector<std::int32_t> ff_source, fc_source; ///< each entry's place in the whole matrix
};

/// Finds the patterns and copies the values.
Elimination make_elimination(const SparseMatrix& whole, const FreeDofs& dofs);

/// Copies the values of a matrix of the same pattern; allocates nothing.
void eliminate(const SparseMatrix& whole, Elimination& parts);

} // namespace amontons
