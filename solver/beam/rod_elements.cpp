#include "solver/beam/rod_elements.hpp"

#include "mesh/base/dense.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

/// The two nodes of an element, as it sees them: turned at rigid corners.
struct ElementEnds {
    BeamNode node[2];
    Mat3 turn[2] = {Mat3::Identity(), Mat3::Identity()};
    bool special = false;
};

ElementEnds ends_of(const RodModel& rod, const std::vector<BeamNode>& nodes, int e)
{
    ElementEnds k;
    k.node[0] = nodes[std::size_t(e)];
    k.node[1] = nodes[std::size_t(rod.second(e))];
    for (const RodCorner& c : rod.corners)
        if (c.element == e) {
            quaternion_product(k.node[c.end].q, c.turn.q, k.node[c.end].q);
            k.turn[c.end] = rotation_matrix(c.turn.q);
            k.special = true;
        }
    return k;
}

void add_corotational(const RodModel& rod, const std::vector<BeamNode>& nodes, int e, RodMatrix& K,
                      std::vector<Node6>& g)
{
    const ElementEnds k = ends_of(rod, nodes, e);
    Vec12 force;
    Mat12 m;
    corotational_element(k.node[0], k.node[1], rod.law[std::size_t(e)], rod.natural[std::size_t(e)],
                         force, m);
    if (k.special) {
        const Mat3 same = Mat3::Identity();
        const Mat3* out[4] = {&same, &k.turn[0], &same, &k.turn[1]};
        for (int i = 0; i < 4; ++i) {
            force.segment<3>(3 * i) = (*out[i] * force.segment<3>(3 * i)).eval();
            for (int j = 0; j < 4; ++j)
                m.block<3, 3>(3 * i, 3 * j) =
                    (*out[i] * m.block<3, 3>(3 * i, 3 * j) * out[j]->transpose()).eval();
        }
    }
    add_element_matrix(rod, e, m, K);
    Map6(g[std::size_t(e)].value) += force.head<6>();
    Map6(g[std::size_t(rod.second(e))].value) += force.tail<6>();
}

void add_special(const RodModel& rod, const std::vector<BeamNode>& nodes, int e, RodMatrix& K,
                 std::vector<Node6>& g)
{
    const ElementEnds k = ends_of(rod, nodes, e);
    BlockTridiagonal own(2);
    own.set_zero();
    std::vector<Node6> force(2, Node6{});
    add_elements(0, 1, {k.node[0], k.node[1]}, {rod.law[std::size_t(e)]}, own, force);
    Mat6 D[2] = {Mat6::Identity(), Mat6::Identity()};
    Eigen::Matrix<double, 12, 12> m;
    for (int i = 0; i < 2; ++i)
        D[i].bottomRightCorner<3, 3>() = k.turn[i];
    m << D[0] * dense(own.diagonal(0)) * D[0].transpose(),
        D[0] * dense(own.upper(0)) * D[1].transpose(),
        D[1] * dense(own.lower(0)) * D[0].transpose(),
        D[1] * dense(own.diagonal(1)) * D[1].transpose();
    add_element_matrix(rod, e, m, K);
    const int node[2] = {e, rod.second(e)};
    for (int i = 0; i < 2; ++i)
        Map6(g[std::size_t(node[i])].value) += D[i] * Map6(force[std::size_t(i)].value);
}

} // namespace

std::array<double, 6> rod_strain(const RodModel& rod, const std::vector<BeamNode>& nodes,
                                 RodElement, int e)
{
    const double length = rod.law[std::size_t(e)].length;
    if (rod.corners.empty())
        return element_strain(nodes[std::size_t(e)], nodes[std::size_t(rod.second(e))], length);
    const ElementEnds k = ends_of(rod, nodes, e);
    return element_strain(k.node[0], k.node[1], length);
}

std::array<double, 6> rod_resultants(const RodModel& rod, const std::vector<BeamNode>& nodes,
                                     RodElement kind, int e)
{
    const ElementLaw& law = rod.law[std::size_t(e)];
    std::array<double, 6> f = element_stress(law, rod_strain(rod, nodes, kind, e));
    for (double& x : f)
        x /= law.length;
    return f;
}

double rod_energy(const RodModel& rod, const std::vector<BeamNode>& nodes, RodElement kind,
                  int from)
{
    double sum = 0;
    for (int e = from; e < rod.element_count(); ++e) {
        const ElementEnds k = ends_of(rod, nodes, e);
        const ElementLaw& law = rod.law[std::size_t(e)];
        sum += kind == RodElement::exact
                   ? element_energy(k.node[0], k.node[1], law)
                   : corotational_energy(k.node[0], k.node[1], law, rod.natural[std::size_t(e)]);
    }
    return sum;
}

void add_rod_elements(const RodModel& rod, const std::vector<BeamNode>& nodes, RodElement kind,
                      RodMatrix& K, std::vector<Node6>& g, int from)
{
    if (kind == RodElement::corotational) {
        for (int e = from; e < rod.element_count(); ++e)
            add_corotational(rod, nodes, e, K, g);
        return;
    }
    // Runs of plain elements, four at once; what is special between them.
    int first = from;
    const auto special = [&](int e) {
        if (rod.second(e) != e + 1) return true;
        for (const RodCorner& c : rod.corners)
            if (c.element == e) return true;
        return false;
    };
    for (int e = from; e < rod.element_count(); ++e) {
        if (!special(e)) continue;
        add_elements(first, e, nodes, rod.law, K.chain, g);
        add_special(rod, nodes, e, K, g);
        first = e + 1;
    }
    add_elements(first, rod.element_count(), nodes, rod.law, K.chain, g);
}

RodPlace rod_place(const RodModel& rod, const std::vector<BeamNode>& nodes, int e, double t)
{
    return rod_place(rod, nodes, e, t, rod.law[std::size_t(e)].length);
}

RodPlace rod_place(const RodModel& rod, const std::vector<BeamNode>& nodes, int e, double t,
                   double L)
{
    const double h[4] = {1 - t * t * (3 - 2 * t), t * t * (3 - 2 * t), L * t * (1 - t) * (1 - t),
                         -L * t * t * (1 - t)};
    const BeamNode* n[2] = {&nodes[std::size_t(e)], &nodes[std::size_t(rod.second(e))]};
    const Vec3 axis[2] = {rod.axis(e, 0), rod.axis(e, 1)};
    RodPlace p;
    p.x.setZero();
    for (int i = 0; i < 2; ++i) {
        const Mat3 R = rotation_matrix(n[i]->q);
        p.x += h[i] * n[i]->position() + h[2 + i] * (R * axis[i]);
        p.J.block<3, 3>(0, 6 * i) = h[i] * Mat3::Identity();
        p.J.block<3, 3>(0, 6 * i + 3) = -h[2 + i] * (R * skew_matrix(axis[i]));
    }
    return p;
}

Vec3 rod_point(const RodModel& rod, const std::vector<BeamNode>& nodes, int e, double xi)
{
    return rod_place(rod, nodes, e, xi).x;
}

Vec3 rod_inertia(const RodModel& rod, int node, int from)
{
    Vec3 sum = Vec3::Zero();
    const int before = node > 0 ? node - 1 : rod.closed ? rod.element_count() - 1 : -1;
    for (const int e : {before, node}) {
        if (e < from || e >= rod.element_count()) continue;
        const ElementMass& m = rod.mass[std::size_t(e)];
        sum += 0.5 * rod.law[std::size_t(e)].length * Vec3(m.spin, m.bend, m.bend);
    }
    return sum;
}

void add_element_matrix(const RodModel& rod, int e, const Eigen::Matrix<double, 12, 12>& m,
                        RodMatrix& K)
{
    const int b = rod.second(e);
    const bool joins = b != e + 1;
    add_to_block(K.chain.diagonal(e), m.topLeftCorner<6, 6>());
    add_to_block(K.chain.diagonal(b), m.bottomRightCorner<6, 6>());
    add_to_block(joins ? K.last_with_first : K.chain.upper(e), m.topRightCorner<6, 6>());
    add_to_block(joins ? K.first_with_last : K.chain.lower(e), m.bottomLeftCorner<6, 6>());
}

void add_rod_mass(const RodModel& rod, const std::vector<BeamNode>& nodes, double scale,
                  RodMatrix& M)
{
    for_mass_points(rod, [&](int e, double mass, double xi) {
        const RodPlace p = rod_place(rod, nodes, e, xi);
        add_element_matrix(rod, e, scale * mass * p.J.transpose() * p.J, M);
    });
    for (int e = 0; e < rod.element_count(); ++e) {
        const ElementMass& m = rod.mass[std::size_t(e)];
        const double half = 0.5 * scale * rod.law[std::size_t(e)].length;
        for (const int node : {e, rod.second(e)}) {
            Block6& d = M.chain.diagonal(node);
            d(3, 3) += half * m.spin;
            d(4, 4) += half * m.bend;
            d(5, 5) += half * m.bend;
        }
    }
}

std::vector<double> rod_frequencies(const RodMatrix& K, const RodMatrix& M, int nodes, int count)
{
    // Inverse iteration on more vectors than are requested; Rayleigh and Ritz in each round.
    const int size = std::min(2 * count + 4, 6 * nodes);
    const std::vector<Node6> empty(std::size_t(nodes), Node6{});
    std::vector<std::vector<Node6>> x(std::size_t(size), empty);
    unsigned seed = 1;
    for (auto& v : x)
        for (Node6& n : v) {
            n = Node6{};
            for (int k = 0; k < 6; ++k) {
                seed = seed * 1664525u + 1013904223u;
                n.value[k] = double(seed) / 4294967296.0 - 0.5;
            }
        }
    const auto dot = [](const std::vector<Node6>& a, const std::vector<Node6>& b) {
        double sum = 0;
        for (std::size_t i = 0; i < a.size(); ++i)
            for (int k = 0; k < 6; ++k)
                sum += a[i].value[k] * b[i].value[k];
        return sum;
    };
    Eigen::VectorXd values = Eigen::VectorXd::Zero(size);
    for (int round = 0; round < 200; ++round) {
        std::vector<std::vector<Node6>> Mx(x.size()), y(x.size());
        for (std::size_t i = 0; i < x.size(); ++i) {
            M.multiply(x[i], Mx[i]);
            y[i] = Mx[i];
            K.solve(y[i]);
        }
        Eigen::MatrixXd k(size, size), m(size, size);
        std::vector<std::vector<Node6>> My(x.size());
        for (std::size_t i = 0; i < x.size(); ++i)
            M.multiply(y[i], My[i]);
        for (int i = 0; i < size; ++i)
            for (int j = 0; j < size; ++j) {
                k(i, j) = dot(y[std::size_t(i)], Mx[std::size_t(j)]); // y^T K y
                m(i, j) = dot(y[std::size_t(i)], My[std::size_t(j)]);
            }
        k = 0.5 * (k + k.transpose()).eval();
        m = 0.5 * (m + m.transpose()).eval();
        const SymmetricEigen eigen = generalised_eigen(m, k); // 1/omega^2
        Eigen::VectorXd now = eigen.values.reverse();
        for (int i = 0; i < size; ++i) {
            std::vector<Node6> sum = empty;
            double largest = 0;
            for (int j = 0; j < size; ++j)
                for (std::size_t n = 0; n < sum.size(); ++n)
                    sum[n].column +=
                        splat6(eigen.vectors(j, size - 1 - i)) * y[std::size_t(j)][n].column;
            for (const Node6& n : sum)
                for (int c = 0; c < 6; ++c)
                    largest = std::max(largest, std::abs(n.value[c]));
            for (Node6& n : sum)
                n.column /= splat6(largest > 0 ? largest : 1);
            x[std::size_t(i)] = std::move(sum);
        }
        const double change = (now.head(count) - values.head(count))
                                  .cwiseQuotient(now.head(count))
                                  .cwiseAbs()
                                  .maxCoeff();
        values = now;
        if (change < 1e-13) break;
    }
    std::vector<double> omega;
    for (int i = 0; i < count; ++i)
        omega.push_back(1 / std::sqrt(values[i]));
    return omega;
}

} // namespace amontons
