#pragma once

#include "solver/beam/wire.hpp"

#include <random>

// Wires in no particular shape, the same in every run.

namespace amontons::test {

class RandomNumbers {
public:
    explicit RandomNumbers(unsigned seed) : rng_(seed) {}
    double operator()(double size = 1) { return size * uniform_(rng_); }
    Vec3 vector(double size = 1)
    {
        const double a = (*this)(size), b = (*this)(size), c = (*this)(size);
        return {a, b, c};
    }

private:
    std::mt19937 rng_;
    std::uniform_real_distribution<double> uniform_{-1, 1};
};

inline void shake(BeamNode& n, RandomNumbers& random, double move, double turn)
{
    for (int k = 0; k < 3; ++k)
        n.move(k, random(move));
    rotate_in_body(n.q, random.vector(turn));
}

/// A shaft, a tapered piece and a curved tip, all flattened; lengths of order 1.
inline std::vector<BeamSegment> three_segments(double shear = 0)
{
    BeamSegment shaft;
    shaft.length = 6;
    shaft.radius = 0.05;
    shaft.EI = {2, 2};
    shaft.EI_across = {1.1, 1.1};
    shaft.GJ = {1.5, 1.5};
    shaft.EA = {900, 900};
    shaft.GA = {shear, shear};
    shaft.element = 0.5;
    BeamSegment taper = shaft;
    taper.length = 1.5;
    taper.EI = {2, 0.4};
    taper.EI_across = {1.1, 0.7};
    taper.GJ = {1.5, 0.3};
    taper.EA = {900, 300};
    taper.element = 0.25;
    BeamSegment tip = taper;
    tip.length = 1;
    tip.EI = {0.4, 0.4};
    tip.EI_across = {0.7, 0.7};
    tip.GJ = {0.3, 0.3};
    tip.EA = {300, 300};
    tip.curvature = 0.8;
    tip.curvature_angle = 0.7;
    return {shaft, taper, tip};
}

/// A wire part of which is out of a sheath that points into no special direction; bent,
/// twisted and stretched at random.
/// @param tables  the tip bends by a table, and the shaft by another
inline Wire shaken_wire(double inserted, double fade, unsigned seed, double shear = 0,
                        bool tables = false)
{
    RandomNumbers random(seed);
    Wire w;
    std::vector<BeamSegment> segments = three_segments(shear);
    if (tables) { // of round sections
        for (BeamSegment& g : segments)
            g.EI_across = g.EI;
        segments[0].bending = {{0, 0}, {0.03, 0.06}, {1, 0.5}};
        segments[2].bending = {{0, 0}, {0.05, 0.02}, {0.4, 0.05}, {1, 0.9}};
    }
    w.material = make_material(segments, 0.2);
    Sheath s;
    s.end = {0.3, -0.2, 0.1};
    Quaternion q;
    rotate_in_body(q.q, {0.4, -0.9, 0.3});
    s.frame = rotation_matrix(q.q);
    s.fade = fade;
    s.grip = fade > 0 ? 50 : 0;
    w.sheath = s;
    w.state.reaction.assign(w.material.point.size(), {});
    start_in_sheath(w, inserted, 0.2);
    for (int i = w.state.first + 1; i <= w.last(); ++i)
        shake(w.state.nodes[std::size_t(i)], random, 0.02, 0.1);
    w.state.base_insertion += 0.013;
    w.state.base_twist += 0.4;
    return w;
}

/// A chain's tangent and gradient, nothing added yet.
struct ChainSystem {
    BlockTridiagonal tangent;
    std::vector<Node6> gradient;
    explicit ChainSystem(std::size_t nodes, int first = 0) : tangent(int(nodes)), gradient(nodes)
    {
        tangent.set_first(first);
        tangent.set_zero();
        for (Node6& n : gradient)
            n.column = Column6{};
    }
};

/// Of the first node that is out only the unknowns that the sheath leaves free.
inline bool is_free(const Wire& w, int node, int unknown)
{
    return node > w.state.first || unknown == 0 || unknown == 3;
}

/// A unit change of one unknown.
inline std::vector<Node6> unit_increment(const Wire& w, int node, int unknown)
{
    std::vector<Node6> d(w.material.node.size());
    for (Node6& n : d)
        n.column = Column6{};
    d[std::size_t(node)].value[unknown] = 1;
    return d;
}

/// The wire with one unknown changed.
inline Wire moved_wire(const Wire& w, int node, int unknown, double by)
{
    Wire r = w;
    move_wire(r, unit_increment(w, node, unknown), by);
    return r;
}

} // namespace amontons::test
