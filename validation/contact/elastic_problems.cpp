#include "validation/contact/elastic_problems.hpp"

#include "validation/contact/problem_builder.hpp"

#include <Eigen/LU>
#include <array>
#include <cmath>

namespace amontons {
namespace {

using Mat12 = Eigen::Matrix<double, 12, 12>;

constexpr double kPi = 3.14159265358979323846;

/// Stiffness of a linear tetrahedron: V B^T D B.
Mat12 tetrahedron(const std::array<Vec3, 4>& x, double E, double nu)
{
    Mat3 edges;
    for (int k = 0; k < 3; ++k)
        edges.col(k) = x[static_cast<std::size_t>(k) + 1] - x[0];
    const double volume = edges.determinant() / 6;
    const Mat3 inverse = edges.inverse(); // rows: gradients of the last three shape functions
    Eigen::Matrix<double, 6, 12> B = Eigen::Matrix<double, 6, 12>::Zero();
    for (int a = 0; a < 4; ++a) {
        const Vec3 g = a == 0 ? Vec3(-inverse.colwise().sum().transpose())
                              : Vec3(inverse.row(a - 1).transpose());
        B.block<3, 3>(0, 3 * a) = g.asDiagonal();
        B.block<3, 3>(3, 3 * a) << g[1], g[0], 0, 0, g[2], g[1], g[2], 0, g[0];
    }
    const double mu = E / (2 * (1 + nu)), lambda = E * nu / ((1 + nu) * (1 - 2 * nu));
    Eigen::Matrix<double, 6, 6> D = Eigen::Matrix<double, 6, 6>::Zero();
    D.topLeftCorner<3, 3>().setConstant(lambda);
    D.diagonal() << lambda + 2 * mu, lambda + 2 * mu, lambda + 2 * mu, mu, mu, mu;
    return std::abs(volume) * B.transpose() * D * B;
}

/// A meshed block whose nodes are free, or moved as `held` states.
struct Block {
    std::vector<Vec3> node;
    std::vector<int> dof; ///< first unknown, -1 if held
    int per[3];           ///< nodes along each axis
    int index(int i, int j, int k) const { return (k * per[1] + j) * per[0] + i; }
};

/// @param moved  displacement of the held nodes: those at the top, or none
Block add_block(ProblemBuilder& p, const ElasticBlock& b, const Vec3& corner, double E_low,
                double E_high, bool held, const Vec3& moved)
{
    Block block;
    for (int k = 0; k < 3; ++k)
        block.per[k] = b.cells[k] + 1;
    for (int k = 0; k < block.per[2]; ++k)
        for (int j = 0; j < block.per[1]; ++j)
            for (int i = 0; i < block.per[0]; ++i) {
                block.node.push_back(corner + Vec3(i * b.size[0] / b.cells[0],
                                                   j * b.size[1] / b.cells[1],
                                                   k * b.size[2] / b.cells[2]));
                block.dof.push_back(held && k == b.cells[2] ? -1 : p.add_unknowns(3));
            }
    // Six tetrahedra around the cell's diagonal.
    constexpr int kPaths[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    for (int k = 0; k < b.cells[2]; ++k)
        for (int j = 0; j < b.cells[1]; ++j)
            for (int i = 0; i < b.cells[0]; ++i)
                for (const auto& path : kPaths) {
                    int at[3] = {i, j, k};
                    std::array<int, 4> corners;
                    corners[0] = block.index(at[0], at[1], at[2]);
                    for (std::size_t step = 0; step < 3; ++step) {
                        ++at[path[step]];
                        corners[step + 1] = block.index(at[0], at[1], at[2]);
                    }
                    std::array<Vec3, 4> x;
                    for (std::size_t a = 0; a < 4; ++a)
                        x[a] = block.node[static_cast<std::size_t>(corners[a])];
                    const bool low = 2 * k < b.cells[2];
                    const Mat12 K = tetrahedron(x, low ? E_low : E_high, b.poisson_ratio);
                    for (int r = 0; r < 12; ++r)
                        for (int c = 0; c < 12; ++c) {
                            const int row = block.dof[static_cast<std::size_t>(
                                corners[static_cast<std::size_t>(r / 3)])];
                            const int column = block.dof[static_cast<std::size_t>(
                                corners[static_cast<std::size_t>(c / 3)])];
                            if (row < 0) continue;
                            if (column >= 0)
                                p.add_stiffness(row + r % 3, column + c % 3, K(r, c));
                            else
                                p.add_force(row + r % 3, -K(r, c) * moved[c % 3]);
                        }
                }
    return block;
}

/// 12 unknowns of two nodes on the x axis: stretch, twist, and bending in two planes.
Mat12 beam_element(double h, double E, double radius)
{
    const double area = kPi * radius * radius, I = area * radius * radius / 4;
    const double EA = E * area, EI = E * I, GJ = E / 2.6 * 2 * I;
    Mat12 K = Mat12::Zero();
    const auto pair = [&](int a, double k) {
        K(a, a) += k;
        K(a + 6, a + 6) += k;
        K(a, a + 6) -= k;
        K(a + 6, a) -= k;
    };
    pair(0, EA / h);
    pair(3, GJ / h);
    // Deflection along y with rotation about z; along z with rotation about -y.
    for (const auto& [v, t, s] : {std::tuple{1, 5, 1.0}, {2, 4, -1.0}}) {
        Eigen::Matrix4d bend;
        bend << 12, 6 * h, -12, 6 * h, 6 * h, 4 * h * h, -6 * h, 2 * h * h, -12, -6 * h, 12, -6 * h,
            6 * h, 2 * h * h, -6 * h, 4 * h * h;
        bend *= EI / (h * h * h);
        const int at[4] = {v, t, v + 6, t + 6};
        const double sign[4] = {1, s, 1, s};
        for (int i = 0; i < 4; ++i)
            for (int j = 0; j < 4; ++j)
                K(at[i], at[j]) += sign[i] * sign[j] * bend(i, j);
    }
    return K;
}

/// A beam along x, held at its first node, which is moved along x.
/// @return  first unknown of each node, -1 for the held one
std::vector<int> add_beam(ProblemBuilder& p, int nodes, double length, double radius, double E,
                          double tip_ratio, double push)
{
    std::vector<int> dof{-1};
    for (int i = 1; i < nodes; ++i)
        dof.push_back(p.add_unknowns(6));
    const double h = length / (nodes - 1);
    for (int e = 0; e + 1 < nodes; ++e) {
        const double at = (e + 0.5) / (nodes - 1);
        const Mat12 K = beam_element(h, E * std::pow(tip_ratio, at), radius);
        for (int r = 0; r < 12; ++r)
            for (int c = 0; c < 12; ++c) {
                const int row = dof[static_cast<std::size_t>(e + r / 6)];
                const int column = dof[static_cast<std::size_t>(e + c / 6)];
                if (row < 0) continue;
                if (column >= 0)
                    p.add_stiffness(row + r % 6, column + c % 6, K(r, c));
                else if (c == 0)
                    p.add_force(row + r % 6, -K(r, c) * push);
            }
    }
    return dof;
}

/// Where the tube's centre is, in y and z.
Vec3 tube_centre(const Catheter& c, double s)
{
    const double t = s / c.length;
    return c.wave * Vec3(0, t * t * std::sin(2 * kPi * t), 0.5 * t * t * (1 - std::cos(kPi * t)));
}

constexpr double kSides[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};

/// 4 contacts a node with the tube; normals point to the tube's axis.
void add_tube_contacts(ProblemBuilder& p, const Catheter& c, const std::vector<int>& dof)
{
    for (int i = 1; i < c.nodes; ++i) {
        const Vec3 centre = tube_centre(c, c.length * i / (c.nodes - 1));
        for (const auto& side : kSides) {
            const Vec3 n(0, side[0], side[1]);
            p.add_contact({dof[static_cast<std::size_t>(i)], -c.radius * n}, {}, n,
                          c.clearance - n.dot(centre), c.mu);
        }
    }
}

} // namespace

GlobalProblem elastic_block(const ElasticBlock& b)
{
    ProblemBuilder p;
    const double E = b.youngs_modulus;
    const Block block =
        add_block(p, b, Vec3::Zero(), b.contrast * E, E, true, Vec3(b.shear, 0, -b.press));
    for (int j = 0; j < block.per[1]; ++j)
        for (int i = 0; i < block.per[0]; ++i) {
            const auto at = static_cast<std::size_t>(block.index(i, j, 0));
            const double x = 2 * block.node[at][0] / b.size[0] - 1;
            const double y = 2 * block.node[at][1] / b.size[1] - 1;
            p.add_contact({block.dof[at], Vec3::Zero(), false}, {}, Vec3::UnitZ(),
                          b.crown * 0.5 * (x * x + y * y), b.mu);
        }
    return p.finish(ContactLevel::position);
}

GlobalProblem elastic_stack(const ElasticBlock& b)
{
    ProblemBuilder p;
    const double E = b.youngs_modulus;
    // The lower block stands on soft ground of its own: a spring at each of its lowest nodes.
    const Block low = add_block(p, b, Vec3(0, 0, -b.size[2]), b.contrast * E, b.contrast * E, false,
                                Vec3::Zero());
    const Block high = add_block(p, b, Vec3::Zero(), E, E, true, Vec3(b.shear, 0, -b.press));
    const double spring = 1e-2 * b.contrast * E * b.size[0] / b.cells[0];
    for (int j = 0; j < low.per[1]; ++j)
        for (int i = 0; i < low.per[0]; ++i) {
            const int ground = low.dof[static_cast<std::size_t>(low.index(i, j, 0))];
            for (int k = 0; k < 3; ++k)
                p.add_stiffness(ground + k, ground + k, spring);
            const int top = low.dof[static_cast<std::size_t>(low.index(i, j, b.cells[2]))];
            const int bottom = high.dof[static_cast<std::size_t>(high.index(i, j, 0))];
            p.add_contact({bottom, Vec3::Zero(), false}, {top, Vec3::Zero(), false}, Vec3::UnitZ(),
                          0, b.mu);
        }
    return p.finish(ContactLevel::position);
}

GlobalProblem catheter(const Catheter& c)
{
    ProblemBuilder p;
    const std::vector<int> dof =
        add_beam(p, c.nodes, c.length, c.radius, c.youngs_modulus, c.tip_ratio, c.push);
    add_tube_contacts(p, c, dof);
    return p.finish(ContactLevel::position);
}

GlobalProblem coaxial_wires(const CoaxialWires& c)
{
    ProblemBuilder p;
    const Catheter& o = c.outer;
    const std::vector<int> outer =
        add_beam(p, o.nodes, o.length, o.radius, o.youngs_modulus, o.tip_ratio, o.push);
    const std::vector<int> inner =
        add_beam(p, o.nodes, o.length, c.inner_radius, c.inner_youngs_modulus, 1, 2 * o.push);
    add_tube_contacts(p, o, outer);
    const double room = 0.25 * o.radius;
    for (int i = 1; i < o.nodes; ++i)
        for (const auto& side : kSides) {
            const Vec3 n(0, side[0], side[1]);
            const auto k = static_cast<std::size_t>(i);
            p.add_contact({inner[k], -c.inner_radius * n}, {outer[k], -(c.inner_radius + room) * n},
                          n, room, o.mu);
        }
    return p.finish(ContactLevel::position);
}

GlobalProblem fibre_bundle(const FibreBundle& b)
{
    ProblemBuilder p;
    std::vector<std::vector<int>> dof;
    for (int k = 0; k < b.side * b.side; ++k)
        dof.push_back(add_beam(p, b.nodes, b.length, b.radius, b.youngs_modulus, 1, 0));
    const auto fibre = [&](int i, int j) -> const std::vector<int>& {
        return dof[static_cast<std::size_t>(i * b.side + j)];
    };
    for (int i = 0; i < b.side; ++i)
        for (int j = 0; j < b.side; ++j)
            for (int k = 1; k < b.nodes; ++k) {
                const auto node = static_cast<std::size_t>(k);
                const int here = fibre(i, j)[node];
                const auto join = [&](int other, const Vec3& n) {
                    p.add_contact({other, -b.radius * n}, {here, b.radius * n}, n, b.gap, b.mu);
                };
                if (i + 1 < b.side) join(fibre(i + 1, j)[node], Vec3::UnitY());
                if (j + 1 < b.side) join(fibre(i, j + 1)[node], Vec3::UnitZ());
                const double load = b.load / (b.nodes - 1);
                if (i == 0) p.add_force(here + 1, load);
                if (i + 1 == b.side) p.add_force(here + 1, -load);
                if (j == 0) p.add_force(here + 2, load);
                if (j + 1 == b.side) p.add_force(here + 2, -load);
                p.add_force(here,
                            0.3 * load * ((i + j) % 2 ? 1 : -1)); // and pulled past each other
            }
    return p.finish(ContactLevel::position);
}

} // namespace amontons
