#include "solver/solid/assembly.hpp"

#include "mesh/base/threads.hpp"
#include "solver/solid/face_load.hpp"

#include <algorithm>
#include <limits>

namespace amontons {
namespace {

constexpr std::size_t kManyNodes = 5000; // from here on threads pay in a product
constexpr std::size_t kAtATime = 1024;   // elements whose matrices wait to be added: 7 MB

const SolidMaterial& material_of(std::span<const SolidMaterial> materials, std::int32_t element)
{
    return materials[materials.size() == 1 ? 0 : std::size_t(element)];
}

void check_materials(const VolumeMesh& mesh, std::span<const SolidMaterial> materials)
{
    AMONTONS_ASSERT(materials.size() == 1 || materials.size() == element_count(mesh));
}

template <class Forces>
void add_face_forces(const VolumeMesh& mesh, std::span<const FaceRef> faces,
                     Eigen::Ref<Eigen::VectorXd> f, Forces forces)
{
    AMONTONS_ASSERT(std::size_t(f.size()) == 3 * mesh.nodes.size());
    for (const FaceRef& face : faces) {
        const FaceNodes on = face_nodes(mesh, face);
        const FaceForces on_nodes = forces(places_of(mesh, on.nodes()));
        for (int i = 0; i < on.count; ++i)
            f.segment<3>(3 * on.node[std::size_t(i)]) += on_nodes.col(i);
    }
}

} // namespace

SolidPattern make_pattern(const VolumeMesh& mesh)
{
    const auto count = static_cast<std::int32_t>(mesh.nodes.size());
    // Elements of each node first: its neighbours are then found one node at a time.
    struct Place {
        std::int32_t element, corner;
    };
    std::vector<std::int32_t> begin(mesh.nodes.size() + 1, 0);
    std::vector<std::span<const std::int32_t>> elements;
    std::vector<std::size_t> first_rank;
    std::size_t ranks = 0;
    for_each_element(mesh, [&](std::int32_t, ElementKind, std::span<const std::int32_t> nodes) {
        elements.push_back(nodes);
        first_rank.push_back(ranks);
        ranks += nodes.size() * nodes.size();
        for (const std::int32_t node : nodes) {
            AMONTONS_ASSERT(node >= 0 && node < count);
            ++begin[std::size_t(node) + 1];
        }
    });
    for (std::size_t i = 1; i < begin.size(); ++i)
        begin[i] += begin[i - 1];
    std::vector<Place> of_node(std::size_t(begin.back()));
    std::vector<std::int32_t> next(begin.begin(), begin.end() - 1);
    for (std::size_t e = 0; e < elements.size(); ++e)
        for (std::size_t c = 0; c < elements[e].size(); ++c)
            of_node[std::size_t(next[std::size_t(elements[e][c])]++)] = {std::int32_t(e),
                                                                         std::int32_t(c)};

    SolidPattern pattern;
    pattern.start.push_back(0);
    pattern.rank.resize(ranks);
    std::vector<std::int32_t> around, rank(mesh.nodes.size(), -1);
    for (std::int32_t j = 0; j < count; ++j) {
        const std::span<const Place> places(of_node.data() + begin[std::size_t(j)],
                                            of_node.data() + begin[std::size_t(j) + 1]);
        around.clear();
        for (const Place& p : places)
            for (const std::int32_t node : elements[std::size_t(p.element)])
                if (rank[std::size_t(node)] < 0) {
                    rank[std::size_t(node)] = 0;
                    around.push_back(node);
                }
        std::sort(around.begin(), around.end());
        for (std::size_t k = 0; k < around.size(); ++k)
            rank[std::size_t(around[k])] = std::int32_t(k);
        for (const Place& p : places) {
            const std::span<const std::int32_t> nodes = elements[std::size_t(p.element)];
            std::size_t at =
                first_rank[std::size_t(p.element)] + std::size_t(p.corner) * nodes.size();
            for (const std::int32_t node : nodes)
                pattern.rank[at++] = rank[std::size_t(node)];
        }
        for (const std::int32_t node : around)
            rank[std::size_t(node)] = -1;
        pattern.neighbour.insert(pattern.neighbour.end(), around.begin(), around.end());
        AMONTONS_ASSERT(pattern.neighbour.size() <=
                        std::size_t(std::numeric_limits<std::int32_t>::max()) / 9);
        pattern.start.push_back(std::int32_t(pattern.neighbour.size()));
    }
    return pattern;
}

SparseMatrix zero_matrix(const SolidPattern& pattern)
{
    const auto nodes = static_cast<std::int32_t>(pattern.start.size()) - 1;
    SparseMatrix A(3 * nodes, 3 * nodes);
    A.resizeNonZeros(9 * Eigen::Index(pattern.neighbour.size()));
    std::int32_t* row = A.innerIndexPtr();
    std::int32_t entries = 0;
    for (std::int32_t j = 0; j < nodes; ++j)
        for (std::int32_t c = 0; c < 3; ++c) {
            A.outerIndexPtr()[3 * j + c] = entries;
            for (std::int32_t k = pattern.start[std::size_t(j)];
                 k < pattern.start[std::size_t(j) + 1]; ++k, entries += 3)
                for (std::int32_t r = 0; r < 3; ++r)
                    *row++ = 3 * pattern.neighbour[std::size_t(k)] + r;
        }
    A.outerIndexPtr()[3 * nodes] = entries;
    A.coeffs().setZero();
    return A;
}

void clear(const SolidPattern& pattern, SparseMatrix& matrix)
{
    AMONTONS_ASSERT(matrix.isCompressed() &&
                    std::size_t(matrix.nonZeros()) == 9 * pattern.neighbour.size());
    matrix.coeffs().setZero();
}

ElementPlaces places_of(const VolumeMesh& mesh, std::span<const std::int32_t> nodes)
{
    ElementPlaces X(3, Eigen::Index(nodes.size()));
    for (std::size_t i = 0; i < nodes.size(); ++i)
        X.col(Eigen::Index(i)) = mesh.nodes[std::size_t(nodes[i])];
    return X;
}

ElementPlaces displaced_places(const VolumeMesh& mesh, std::span<const std::int32_t> nodes,
                               const Eigen::VectorXd& u)
{
    ElementPlaces x = places_of(mesh, nodes);
    const Vec3 first = x.col(0);
    for (std::size_t i = 0; i < nodes.size(); ++i)
        x.col(Eigen::Index(i)) = x.col(Eigen::Index(i)) - first + u.segment<3>(3 * nodes[i]);
    return x;
}

void add_element(const SolidPattern& pattern, std::size_t& at, std::span<const std::int32_t> nodes,
                 const ElementMatrix& block, double* values)
{
    const auto n = std::ptrdiff_t(nodes.size());
    AMONTONS_ASSERT(block.rows() == 3 * n && block.cols() == 3 * n);
    const double* from = block.data(); // three columns of a node at a time
    for (std::ptrdiff_t j = 0; j < n; ++j, from += 9 * n) {
        const auto node = std::size_t(nodes[std::size_t(j)]);
        const std::ptrdiff_t first = pattern.start[node],
                             height = 3 * (pattern.start[node + 1] - first);
        double* const column = values + 9 * first;
        for (std::ptrdiff_t i = 0; i < n; ++i) {
            double* to = column + 3 * std::ptrdiff_t(pattern.rank[at++]);
            const double* b = from + 3 * i;
            for (int c = 0; c < 3; ++c, to += height, b += 3 * n) {
                to[0] += b[0];
                to[1] += b[1];
                to[2] += b[2];
            }
        }
    }
}

Eigen::VectorXd symmetric_times(const SolidPattern& pattern, const SparseMatrix& A,
                                const Eigen::VectorXd& x, int threads)
{
    AMONTONS_ASSERT(std::size_t(A.nonZeros()) == 9 * pattern.neighbour.size() &&
                    A.cols() == x.size());
    Eigen::VectorXd y(x.size());
    const std::size_t nodes = pattern.start.size() - 1;
    share_out(nodes < kManyNodes ? 1 : threads, nodes, [&](std::size_t begin, std::size_t end) {
        std::vector<double> near; // x of a node's neighbours
        const double* value = A.valuePtr() + 9 * std::ptrdiff_t(pattern.start[begin]);
        for (std::size_t node = begin; node < end; ++node) {
            const std::int32_t first = pattern.start[node], last = pattern.start[node + 1];
            const Eigen::Index height = 3 * Eigen::Index(last - first);
            if (near.size() < std::size_t(height)) near.resize(std::size_t(height));
            double* to = near.data();
            for (std::int32_t k = first; k < last; ++k, to += 3) {
                const double* from =
                    x.data() + 3 * std::ptrdiff_t(pattern.neighbour[std::size_t(k)]);
                to[0] = from[0]; // copy_n would call memmove for each
                to[1] = from[1];
                to[2] = from[2];
            }
            Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 3>> block(value, height, 3);
            y.segment<3>(3 * Eigen::Index(node)).noalias() =
                block.transpose() * Eigen::Map<const Eigen::VectorXd>(near.data(), height);
            value += 3 * height;
        }
    });
    return y;
}

namespace {

/// assemble() with the elements' matrices made by several threads, some at a time, and added in the
/// elements' order: the same to the last bit for any number of threads.
/// @param block  may be called by several threads at once
template <class Block>
void assemble_side_by_side(const VolumeMesh& mesh, const SolidPattern& pattern, Block block,
                           SparseMatrix& matrix, int threads)
{
    if (threads <= 1) return assemble(mesh, pattern, block, matrix);
    clear(pattern, matrix);
    std::vector<ElementMatrix> made(kAtATime);
    std::size_t at = 0;
    std::int32_t number = 0;
    for (const ElementBlock& b : mesh.blocks)
        for (std::size_t first = 0; first < b.size(); first += kAtATime) {
            const std::size_t count = std::min(kAtATime, b.size() - first);
            share_out(threads, count, [&](std::size_t begin, std::size_t end) {
                for (std::size_t i = begin; i < end; ++i)
                    block(number + std::int32_t(i), b.kind, b.element(first + i), made[i]);
            });
            for (std::size_t i = 0; i < count; ++i)
                add_element(pattern, at, b.element(first + i), made[i], matrix.valuePtr());
            number += std::int32_t(count);
        }
}

} // namespace

void assemble_stiffness(const VolumeMesh& mesh, const SolidPattern& pattern,
                        std::span<const SolidMaterial> materials, SparseMatrix& K, int threads)
{
    check_materials(mesh, materials);
    assemble_side_by_side(
        mesh, pattern,
        [&](std::int32_t number, ElementKind kind, std::span<const std::int32_t> nodes,
            ElementMatrix& block) {
            solid_stiffness(kind, places_of(mesh, nodes),
                            elasticity_matrix(material_of(materials, number)), block);
        },
        K, threads);
}

void assemble_mass(const VolumeMesh& mesh, const SolidPattern& pattern,
                   std::span<const SolidMaterial> materials, SparseMatrix& M, int threads)
{
    check_materials(mesh, materials);
    assemble_side_by_side(
        mesh, pattern,
        [&](std::int32_t number, ElementKind kind, std::span<const std::int32_t> nodes,
            ElementMatrix& block) {
            ElementMatrix scalar;
            solid_mass(kind, places_of(mesh, nodes), material_of(materials, number).density,
                       scalar);
            block.setZero(3 * scalar.rows(), 3 * scalar.cols());
            for (Eigen::Index j = 0; j < scalar.cols(); ++j)
                for (Eigen::Index i = 0; i < scalar.rows(); ++i)
                    block.block<3, 3>(3 * i, 3 * j).diagonal().setConstant(scalar(i, j));
        },
        M, threads);
}

Eigen::VectorXd assemble_lumped_mass(const VolumeMesh& mesh,
                                     std::span<const SolidMaterial> materials)
{
    check_materials(mesh, materials);
    Eigen::VectorXd mass = Eigen::VectorXd::Zero(3 * Eigen::Index(mesh.nodes.size()));
    for_each_element(mesh, [&](std::int32_t number, ElementKind kind,
                               std::span<const std::int32_t> nodes) {
        const ShapeValues of =
            solid_lumped_mass(kind, places_of(mesh, nodes), material_of(materials, number).density);
        for (std::size_t i = 0; i < nodes.size(); ++i)
            mass.segment<3>(3 * nodes[i]).array() += of[Eigen::Index(i)];
    });
    return mass;
}

void add_weight(const VolumeMesh& mesh, std::span<const SolidMaterial> materials,
                const Vec3& acceleration, Eigen::Ref<Eigen::VectorXd> f)
{
    check_materials(mesh, materials);
    AMONTONS_ASSERT(std::size_t(f.size()) == 3 * mesh.nodes.size());
    for_each_element(
        mesh, [&](std::int32_t number, ElementKind kind, std::span<const std::int32_t> nodes) {
            const Vec3 force = material_of(materials, number).density * acceleration;
            const ElementVector on_nodes = solid_body_force(kind, places_of(mesh, nodes), force);
            for (std::size_t i = 0; i < nodes.size(); ++i)
                f.segment<3>(3 * nodes[i]) += on_nodes.segment<3>(3 * Eigen::Index(i));
        });
}

void add_pressure(const VolumeMesh& mesh, std::span<const FaceRef> faces, double pressure,
                  Eigen::Ref<Eigen::VectorXd> f)
{
    add_face_forces(mesh, faces, f,
                    [&](const ElementPlaces& X) { return pressure_forces(X, pressure); });
}

void add_traction(const VolumeMesh& mesh, std::span<const FaceRef> faces, const Vec3& traction,
                  Eigen::Ref<Eigen::VectorXd> f)
{
    add_face_forces(mesh, faces, f,
                    [&](const ElementPlaces& X) { return traction_forces(X, traction); });
}

void add_support(const VolumeMesh& mesh, std::span<const FaceRef> faces, double normal,
                 double tangential, SparseMatrix& K)
{
    Eigen::Matrix3Xd X;
    for (const FaceRef& face : faces) {
        const FaceNodes nodes = face_nodes(mesh, face);
        X.resize(3, nodes.count);
        for (int k = 0; k < nodes.count; ++k)
            X.col(k) = mesh.nodes[std::size_t(nodes.node[std::size_t(k)])];
        const FaceTangent S = support_stiffness(X, normal, tangential);
        for (int j = 0; j < nodes.count; ++j)
            for (int i = 0; i < nodes.count; ++i)
                for (int c = 0; c < 3; ++c)
                    for (int r = 0; r < 3; ++r)
                        K.coeffRef(3 * nodes.node[std::size_t(i)] + r,
                                   3 * nodes.node[std::size_t(j)] + c) += S(3 * i + r, 3 * j + c);
    }
}

Eigen::VectorXd follower_pressure(const VolumeMesh& mesh, std::span<const FaceRef> faces,
                                  const Eigen::VectorXd& u, double pressure)
{
    Eigen::VectorXd f = Eigen::VectorXd::Zero(3 * Eigen::Index(mesh.nodes.size()));
    if (pressure == 0) return f;
    Eigen::Matrix3Xd x;
    for (const FaceRef& face : faces) {
        const FaceNodes nodes = face_nodes(mesh, face);
        x.resize(3, nodes.count);
        for (int k = 0; k < nodes.count; ++k) {
            const std::int32_t node = nodes.node[std::size_t(k)];
            x.col(k) = mesh.nodes[std::size_t(node)] + u.segment<3>(3 * node);
        }
        const FaceForces forces = pressure_forces(x, pressure);
        for (int k = 0; k < nodes.count; ++k)
            f.segment<3>(3 * nodes.node[std::size_t(k)]) += forces.col(k);
    }
    return f;
}

// The integral of the force of 1 Pa over the way, by Simpson's rule, which is exact.
double swept_volume(const VolumeMesh& mesh, std::span<const FaceRef> faces,
                    const Eigen::VectorXd& u)
{
    double sum = 0;
    for (const auto& [share, weight] : {std::pair(0.0, 1.0), {0.5, 4.0}, {1.0, 1.0}})
        sum += weight / 6 * follower_pressure(mesh, faces, share * u, 1).dot(u);
    return sum;
}

FreeDofs make_free_dofs(const SolidPattern& pattern, std::span<const std::int32_t> fixed)
{
    const std::size_t nodes = pattern.start.size() - 1;
    std::vector<bool> held(3 * nodes, false);
    for (const std::int32_t dof : fixed) {
        AMONTONS_ASSERT(dof >= 0 && std::size_t(dof) < held.size());
        held[std::size_t(dof)] = true;
    }
    FreeDofs dofs;
    dofs.number.reserve(held.size());
    for (std::size_t dof = 0; dof < held.size(); ++dof) {
        const bool alone = pattern.start[dof / 3] == pattern.start[dof / 3 + 1];
        std::vector<std::int32_t>& list = held[dof] || alone ? dofs.fixed : dofs.free;
        const auto place = static_cast<std::int32_t>(list.size());
        dofs.number.push_back(held[dof] || alone ? -1 - place : place);
        list.push_back(std::int32_t(dof));
    }
    return dofs;
}

Elimination make_elimination(const SparseMatrix& whole, const FreeDofs& dofs)
{
    AMONTONS_ASSERT(whole.isCompressed() && std::size_t(whole.cols()) == dofs.number.size());
    const auto part = [&](const std::vector<std::int32_t>& columns, SparseMatrix& A,
                          std::vector<std::int32_t>& source) {
        std::vector<std::int32_t> start{0}, row;
        for (const std::int32_t column : columns) {
            for (std::int32_t k = whole.outerIndexPtr()[column];
                 k < whole.outerIndexPtr()[column + 1]; ++k)
                if (const std::int32_t i = dofs.number[std::size_t(whole.innerIndexPtr()[k])];
                    i >= 0) {
                    row.push_back(i);
                    source.push_back(k);
                }
            start.push_back(std::int32_t(row.size()));
        }
        A.resize(Eigen::Index(dofs.free.size()), Eigen::Index(columns.size()));
        A.resizeNonZeros(Eigen::Index(row.size()));
        std::copy(start.begin(), start.end(), A.outerIndexPtr());
        std::copy(row.begin(), row.end(), A.innerIndexPtr());
    };
    Elimination parts;
    part(dofs.free, parts.ff, parts.ff_source);
    part(dofs.fixed, parts.fc, parts.fc_source);
    eliminate(whole, parts);
    return parts;
}

void eliminate(const SparseMatrix& whole, Elimination& parts)
{
    const auto copy = [&](const std::vector<std::int32_t>& source, SparseMatrix& A) {
        double* value = A.valuePtr();
        for (const std::int32_t k : source) {
            AMONTONS_ASSERT(k < whole.nonZeros());
            *value++ = whole.valuePtr()[k];
        }
    };
    copy(parts.ff_source, parts.ff);
    copy(parts.fc_source, parts.fc);
}

} // namespace amontons
