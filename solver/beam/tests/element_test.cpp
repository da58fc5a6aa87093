#include "solver/beam/element.hpp"

#include "solver/beam/table_law.hpp"
#include "solver/beam/tests/random_wire.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;
using test::ChainSystem;
using test::RandomNumbers;

namespace {

/// Nodes of a chain, bent and sheared at random, and laws of all six strains.
struct Chain {
    std::vector<BeamNode> nodes;
    std::vector<ElementLaw> laws;
};

Chain random_chain(int elements, unsigned seed, double turn)
{
    RandomNumbers random(seed);
    Chain c;
    for (int i = 0; i <= elements; ++i) {
        BeamNode n;
        n.x[0] = 2.0 * i;
        test::shake(n, random, 0.3, turn);
        c.nodes.push_back(n);
    }
    for (int i = 0; i < elements; ++i) {
        ElementLaw law;
        law.length = 2 + random(0.2);
        const double stiffness[6] = {5, 2, 3, 0.4, 0.5, 0.7},
                     natural[6] = {1, 0, 0, 0.1, 0.2, -0.3};
        for (std::size_t k = 0; k < 6; ++k) {
            law.S[k] = stiffness[k] * law.length;
            law.P[k] = law.S[k] * natural[k];
        }
        law.constant = random();
        law.bowing = {1.2, 0.7};
        c.laws.push_back(law);
    }
    return c;
}

/// Every second element answers by tables, one of them by two of each.
Chain with_tables(Chain c)
{
    const auto law = [](CurvePoints t) {
        return std::make_shared<const TableLaw>(make_table_law(std::move(t)));
    };
    const auto bends = law({{0, 0}, {0.1, 0.05}, {0.4, 0.11}, {0.9, 0.4}}),
               other = law({{0, 0}, {0.05, 0.03}, {0.8, 0.2}}),
               stretches = law({{-0.3, -3}, {-0.1, -0.5}, {0, 0}, {0.1, 0.5}, {0.2, 0.7}});
    for (std::size_t i = 0; i < c.laws.size(); i += 2)
        c.laws[i].beyond = {{0.7 * c.laws[i].length, bends, stretches}};
    c.laws[2].beyond.push_back({0.3 * c.laws[2].length, other, nullptr});
    return c;
}

double energy(const Chain& c)
{
    double sum = 0;
    for (std::size_t i = 0; i < c.laws.size(); ++i)
        sum += element_energy(c.nodes[i], c.nodes[i + 1], c.laws[i]);
    return sum;
}

ChainSystem chain_system(const Chain& c)
{
    ChainSystem s(c.nodes.size());
    add_elements(0, int(c.laws.size()), c.nodes, c.laws, s.tangent, s.gradient);
    return s;
}

Chain moved(const Chain& c, int node, int unknown, double by)
{
    Chain r = c;
    BeamNode& n = r.nodes[std::size_t(node)];
    if (unknown < 3)
        n.move(unknown, by);
    else
        rotate_in_body(n.q, by * Vec3::Unit(unknown - 3));
    return r;
}

} // namespace

TEST_CASE("predicted strains are those of the moved nodes to first order")
{
    const Chain c = random_chain(1, 11, 0.8);
    const double length = c.laws[0].length;
    RandomNumbers random(3);
    double d[2][6];
    for (auto& side : d)
        for (double& v : side)
            v = random();
    const auto at = [&](double t) {
        Chain m = c;
        for (int side = 0; side < 2; ++side) {
            BeamNode& n = m.nodes[std::size_t(side)];
            for (int k = 0; k < 3; ++k)
                n.move(k, t * d[side][k]);
            rotate_in_body(n.q, t * Vec3(d[side][3], d[side][4], d[side][5]));
        }
        return element_strain(m.nodes[0], m.nodes[1], length);
    };
    const double h = 1e-5;
    const std::array<double, 6> own = at(0), more = at(h), less = at(-h),
                                predicted =
                                    predicted_strain(c.nodes[0], c.nodes[1], length, d[0], d[1]);
    for (std::size_t k = 0; k < 6; ++k) {
        CAPTURE(k);
        CHECK(std::abs(predicted[k] - own[k] - (more[k] - less[k]) / (2 * h)) < 1e-9);
    }
}

TEST_CASE(
    "the tangent of predicted strains is that of their stress and the force is the nodes' own")
{
    const Chain c = random_chain(6, 5, 0.4);
    RandomNumbers random(8);
    std::vector<std::array<double, 6>> predicted;
    Chain same = c; // whose natural strains make that stress its own
    for (std::size_t i = 0; i < c.laws.size(); ++i) {
        predicted.push_back(element_strain(c.nodes[i], c.nodes[i + 1], c.laws[i].length));
        const std::array<double, 6> now = predicted[i];
        for (std::size_t k = 0; k < 6; ++k) {
            const double more = 0.3 * random();
            predicted[i][k] += more;
            same.laws[i].P[k] -= same.laws[i].S[k] * more;
            if (k == 1 || k == 2) // what it stretches to first order
                same.laws[i].P[0] -= same.laws[i].S[0] * c.laws[i].bowing[k - 1] * now[k] * more;
        }
    }
    ChainSystem s(c.nodes.size());
    add_elements(0, int(c.laws.size()), c.nodes, c.laws, s.tangent, s.gradient, &predicted);
    const ChainSystem own = chain_system(c), other = chain_system(same);
    for (int i = 0; i < int(c.nodes.size()); ++i)
        for (int a = 0; a < 6; ++a) {
            const std::size_t n = std::size_t(i);
            CHECK(std::abs(s.gradient[n].value[a] - own.gradient[n].value[a]) < 1e-13);
            for (int b = 0; b < 6; ++b) {
                CHECK(std::abs(s.tangent.diagonal(i)(a, b) - other.tangent.diagonal(i)(a, b)) <
                      1e-12);
                if (n + 1 < c.nodes.size())
                    CHECK(std::abs(s.tangent.upper(i)(a, b) - other.tangent.upper(i)(a, b)) <
                          1e-12);
            }
        }
}

TEST_CASE("the force is the derivative of the energy in random poses bent by up to a radian")
{
    for (double turn : {0.01, 0.3, 1.0})
        for (const bool tables : {false, true}) {
            CAPTURE(turn);
            CAPTURE(tables);
            const Chain linear = random_chain(6, 7, turn),
                        c = tables ? with_tables(linear) : linear;
            const ChainSystem s = chain_system(c);
            double largest = 0, wrong = 0;
            const double h = 1e-5;
            for (int i = 0; i <= 6; ++i)
                for (int k = 0; k < 6; ++k) {
                    const double exact =
                        (energy(moved(c, i, k, h)) - energy(moved(c, i, k, -h))) / (2 * h);
                    largest = std::max(largest, std::abs(exact));
                    wrong = std::max(wrong, std::abs(exact - s.gradient[std::size_t(i)].value[k]));
                }
            CHECK(wrong < 1e-8 * largest);
        }
}

// With g the body-frame gradient, moving along b changes g_a by H_ab + g.(b x a)/2: the
// symmetric Hessian is what is left without the second term.
TEST_CASE("the tangent is the symmetric second derivative of the energy")
{
    for (double turn : {0.01, 0.3, 1.0})
        for (const bool tables : {false, true}) {
            CAPTURE(turn);
            CAPTURE(tables);
            const int n = 6;
            const Chain linear = random_chain(n, 8, turn),
                        c = tables ? with_tables(linear) : linear;
            const ChainSystem s = chain_system(c);
            double largest = 0, wrong = 0, skewness = 0;
            const double h = 1e-5;
            for (int j = 0; j <= n; ++j)
                for (int b = 0; b < 6; ++b) {
                    const ChainSystem up = chain_system(moved(c, j, b, h)),
                                      down = chain_system(moved(c, j, b, -h));
                    for (int i = std::max(0, j - 1); i <= std::min(n, j + 1); ++i)
                        for (int a = 0; a < 6; ++a) {
                            const std::size_t row = std::size_t(i);
                            double exact =
                                (up.gradient[row].value[a] - down.gradient[row].value[a]) / (2 * h);
                            if (i == j && a >= 3 && b >= 3) {
                                const double* g = s.gradient[row].value;
                                exact -= 0.5 * Vec3(g[3], g[4], g[5])
                                                   .dot(Vec3::Unit(b - 3).cross(Vec3::Unit(a - 3)));
                            }
                            const double got = i == j  ? s.tangent.diagonal(i)(a, b)
                                               : i < j ? s.tangent.upper(i)(a, b)
                                                       : s.tangent.lower(j)(a, b);
                            largest = std::max(largest, std::abs(exact));
                            wrong = std::max(wrong, std::abs(exact - got));
                            const double other = i == j  ? s.tangent.diagonal(i)(b, a)
                                                 : i < j ? s.tangent.lower(i)(b, a)
                                                         : s.tangent.upper(j)(b, a);
                            skewness = std::max(skewness, std::abs(got - other));
                        }
                }
            CHECK(wrong < 1e-8 * largest);
            CHECK(skewness < 1e-13 * largest);
        }
}

TEST_CASE("strains do not change when all is moved and turned together nor when a quaternion "
          "changes its sign")
{
    RandomNumbers random(3);
    const Chain c = random_chain(1, 9, 0.6);
    const auto before = element_strain(c.nodes[0], c.nodes[1], 2);
    for (int k = 0; k < 20; ++k) {
        Quaternion q;
        rotate_in_body(q.q, random.vector(3));
        const Mat3 R = rotation_matrix(q.q);
        const Vec3 shift = random.vector(10);
        BeamNode n[2];
        for (int i = 0; i < 2; ++i) {
            const BeamNode& o = c.nodes[std::size_t(i)];
            const Vec3 x = R * o.position() + shift;
            for (int a = 0; a < 3; ++a)
                n[i].x[a] = x[a];
            quaternion_product(q.q, o.q, n[i].q);
        }
        if (k % 2)
            for (double& v : n[1].q)
                v = -v;
        const auto after = element_strain(n[0], n[1], 2);
        for (std::size_t i = 0; i < 6; ++i)
            CHECK(std::abs(after[i] - before[i]) < 3e-14);
    }
}

TEST_CASE("four elements at once have the results of each alone")
{
    const int n = 11;
    const Chain c = random_chain(n, 11, 0.5);
    const ChainSystem all = chain_system(c);
    ChainSystem sum(c.nodes.size());
    for (int i = 0; i < n; ++i)
        add_elements(i, i + 1, c.nodes, c.laws, sum.tangent, sum.gradient);
    double wrong = 0, largest = 0;
    for (int i = 0; i <= n; ++i)
        for (int a = 0; a < 6; ++a) {
            const std::size_t k = std::size_t(i);
            wrong = std::max(wrong, std::abs(all.gradient[k].value[a] - sum.gradient[k].value[a]));
            for (int b = 0; b < 6; ++b) {
                largest = std::max(largest, std::abs(all.tangent.diagonal(i)(a, b)));
                wrong = std::max(
                    wrong, std::abs(all.tangent.diagonal(i)(a, b) - sum.tangent.diagonal(i)(a, b)));
                if (i < n)
                    wrong = std::max(
                        wrong, std::abs(all.tangent.upper(i)(a, b) - sum.tangent.upper(i)(a, b)));
            }
        }
    CHECK(wrong < 1e-14 * largest);
}

TEST_CASE("an element on a circle or a helix has exactly its curvature and twist however long")
{
    // Constant strains (1, 0, 0, twist, k2, k3): the section turns by exp(s strain).
    for (double angle : {1e-6, 0.1, 0.7, 1.3, 2.0}) {
        CAPTURE(angle);
        const Vec3 k = angle / 2 * Vec3(0.3, -0.5, 0.812403840463596).normalized();
        const double length = 2;
        BeamNode a, b;
        a.x[0] = 4;
        rotate_in_body(a.q, {0.2, 0.5, -1});
        // x2 - x1 = R1 (integral of exp(s [k]) ds) e1, by Rodrigues' formula.
        const double t = k.norm(), phi = t * length;
        const Vec3 u = k / t, e = Vec3::UnitX();
        const double half = std::sin(0.5 * phi); // 1 - cos loses digits
        const Vec3 chord = u * u.dot(e) * length + std::sin(phi) / t * (e - u * u.dot(e)) +
                           2 * half * half / t * u.cross(e);
        const Vec3 x = a.position() + rotation_matrix(a.q) * chord;
        for (int i = 0; i < 3; ++i)
            b.x[i] = x[i];
        std::copy(a.q, a.q + 4, b.q);
        rotate_in_body(b.q, length * k);
        const auto strain = element_strain(a, b, length);
        const double exact[6] = {1, 0, 0, k.x(), k.y(), k.z()};
        for (std::size_t i = 0; i < 6; ++i)
            CHECK(std::abs(strain[i] - exact[i]) < 3e-15 * (1 + 4 / length));
    }
}

TEST_CASE("a strain is not lost to the distance from the origin")
{
    // Stretch 1e-12 a million lengths away: only the positions' rests can hold it.
    BeamNode a, b;
    const double far = 1e6, stretch = 1e-12;
    a.x[0] = far;
    b.x[0] = far;
    b.move(0, 1.0);
    b.move(0, stretch);
    const auto strain = element_strain(a, b, 1);
    CHECK(std::abs(strain[0] - 1 - stretch) < 3e-16);
}
