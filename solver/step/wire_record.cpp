#include "solver/step/wire_record.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace amontons {
namespace {

/// Section forces of an element: axial force [N], torque, bending moment [N m], strains.
struct SectionForce {
    double axial = 0, torque = 0, moment = 0, curvature = 0, twist = 0;
};

SectionForce section_force(const Wire& w, int element)
{
    const std::size_t n = std::size_t(element);
    const ElementLaw law =
        element == w.state.first ? held_element_law(w, w.state) : w.material.law[n];
    const auto e = element_strain(w.state.nodes[n], w.state.nodes[n + 1], law.length);
    std::array<double, 6> f = element_stress(law, e);
    for (double& x : f)
        x /= law.length;
    return {f[0], f[3], std::hypot(f[4], f[5]), std::hypot(e[4], e[5]), e[3]};
}

} // namespace

double wire_depth(const Wire& w)
{
    return w.state.inserted - (w.sheath ? w.sheath->fade : 0);
}

Vec3 wire_tip(const Wire& w)
{
    if (w.outside()) return w.state.nodes[std::size_t(w.last())].position();
    return held_point(w, w.state, w.material.length);
}

int count_outside(const WireBody& b)
{
    int count = 0;
    for (std::size_t p = 0; p < b.wire.material.point.size(); ++p) {
        const MaterialPoint& m = b.wire.material.point[p];
        const auto place = place_of(b.wire, b.wire.state, m.s, m.element, m.xi);
        if (!place) break;
        const Vec3 x = centreline_point(b.wire.state, *place);
        for (std::size_t k = 0; k < b.walls.size(); ++k) {
            const WireWall& w = b.walls[k];
            if (w.foundation > 0) continue; // springs have no other side
            const Proximity& near = b.work->proximity[p * b.walls.size() + k];
            if (!w.soft && near.distance > kSteepestWall * (x - near.at).norm()) continue;
            WallHint hint = near.hint;
            if (w.wall->distance(pulled_back(w, x, hint), hint) < 0) ++count;
        }
    }
    return count;
}

std::string describe_worst(const std::vector<WireBody>& wires, const Residual& residual,
                           double tolerance)
{
    if (residual.scale > 0 && residual.error() <= tolerance) return "";
    char text[160];
    std::snprintf(text, sizeof text, "; error %.2e, equilibrium %.2e N, contact %.2e N",
                  residual.scale > 0 ? residual.error() : 0.0, residual.equilibrium,
                  residual.contact);
    std::string all = text;
    if (residual.worst < 0 || wires.size() != 1) return all;
    const auto& candidates = wires[0].work->candidates;
    if (std::size_t(residual.worst) >= candidates.size()) return all;
    const Candidate& c = candidates[std::size_t(residual.worst)];
    std::snprintf(text, sizeof text,
                  "; worst: contact point %d at (%.5g, %.5g, %.5g) m, penetration %.2e m", c.point,
                  c.x.x(), c.x.y(), c.x.z(), std::max(0.0, -c.gap));
    return all + text;
}

void record_wire(const WireBody& b, const std::string& name, int body,
                 const std::vector<int>& walls, const std::string& prefix, double cluster,
                 StepRecord& out)
{
    // ---- Shape and fields along the wire
    const Wire& w = b.wire;
    BeamRecord beam;
    beam.name = name;
    Field radius{"radius", "m", 1, {}}, curvature{"curvature", "1/m", 1, {}},
        twist{"twist", "1/m", 1, {}}, axial{"axial_force", "N", 1, {}},
        torque{"torque", "N m", 1, {}}, moment{"moment", "N m", 1, {}},
        arc{"arc_length", "m", 1, {}};
    double tip_rotation = w.state.rotation;
    if (w.outside()) {
        const double end = w.material.length - w.state.inserted;
        SectionForce before;
        for (int i = w.state.first; i <= w.last(); ++i) {
            const std::size_t n = std::size_t(i);
            beam.points.push_back(w.state.nodes[n].position());
            const bool tip = i == w.last();
            const SectionForce here = tip ? before : section_force(w, i);
            if (i == w.state.first) before = here;
            // Strains are constant in an element: a node shows the mean of its two.
            const auto mean = [&](double SectionForce::*f) { return 0.5 * (before.*f + here.*f); };
            const double s = i == w.state.first ? end : w.material.node[n];
            std::size_t g = w.material.segments.size() - 1;
            while (g > 0 && w.material.segment_start[g] > s)
                --g;
            radius.values.push_back(w.material.segments[g].radius);
            curvature.values.push_back(mean(&SectionForce::curvature));
            twist.values.push_back(mean(&SectionForce::twist));
            axial.values.push_back(mean(&SectionForce::axial));
            torque.values.push_back(mean(&SectionForce::torque));
            moment.values.push_back(mean(&SectionForce::moment));
            arc.values.push_back(s - end);
            if (!tip)
                tip_rotation +=
                    here.twist * (w.material.node[n + 1] - (i == w.state.first ? end : s));
            before = here;
        }
    } else {
        beam.points.push_back(wire_tip(w));
        radius.values.push_back(w.material.segments.back().radius);
        for (Field* f : {&curvature, &twist, &axial, &torque, &moment, &arc})
            f->values.push_back(0);
    }
    for (Field* f : {&radius, &curvature, &twist, &axial, &torque, &moment, &arc})
        beam.fields.push_back(std::move(*f));
    out.beams.push_back(std::move(beam));

    // ---- Contacts
    // The candidates are of the accepted state; their reactions are the state's.
    const std::size_t first = out.contacts.size();
    std::vector<double> place;
    double sum = 0, friction = 0, gap = std::numeric_limits<double>::infinity();
    if (w.outside())
        for (const Candidate& c : b.work->candidates) {
            gap = std::min(gap, c.gap);
            if (!(c.normal > 0)) continue;
            ContactRecord r;
            r.point = c.x - (c.radius + c.gap) * c.n;
            r.normal = c.n;
            const Vec3 t = c.tangential[0] * c.t1 + c.tangential[1] * c.t2;
            r.force = c.normal * c.n + t;
            r.slip = c.slip[0] * c.t1 + c.slip[1] * c.t2;
            r.normal_force = c.normal;
            r.gap = c.gap;
            // Sticks where the friction force is inside the cone.
            const bool sticks = c.mu > 0 && t.norm() < c.mu * c.normal * (1 - 1e-6);
            r.status = sticks ? ContactStatus::stick : ContactStatus::slip;
            r.body_a = body;
            r.body_b = walls[std::size_t(c.wall)];
            out.contacts.push_back(r);
            place.push_back(w.material.point[std::size_t(c.point)].s);
            sum += c.normal;
            friction += t.norm();
        }
    double largest = 0;
    for (std::size_t i = 0; i < place.size(); ++i) {
        double here = 0;
        for (std::size_t j = 0; j < place.size(); ++j)
            if (std::abs(place[i] - place[j]) <= 0.5 * cluster)
                here += out.contacts[first + j].normal_force;
        out.contacts[first + i].clustered_force = here;
        largest = std::max(largest, here);
    }

    // ---- Quantities
    const Vec3 tip = wire_tip(w);
    const BaseLoad load = base_load(w);
    const auto quantity = [&](const char* what, const char* unit, double value) {
        out.quantities.push_back({prefix + what, unit, value});
    };
    quantity("depth", "m", wire_depth(w));
    quantity("insertion", "m", w.state.base_insertion - (w.sheath ? w.sheath->fade : 0));
    quantity("base_twist", "rad", w.state.base_twist);
    quantity("tip_rotation", "rad", tip_rotation);
    quantity("push_force", "N", load.push);
    quantity("torque", "N m", load.torque);
    if (w.tip) {
        const char* axes = "xyz";
        for (int k = 0; k < 3; ++k)
            quantity((std::string("tip_hold_force_") + axes[k]).c_str(), "N", w.state.tip_force[k]);
        for (int k = 0; w.tip->turns && k < 3; ++k)
            quantity((std::string("tip_hold_moment_") + axes[k]).c_str(), "N m",
                     w.state.tip_moment[k]);
    }
    quantity("normal_force_sum", "N", sum);
    quantity("friction_force_sum", "N", friction);
    quantity("clustered_force", "N", largest);
    quantity("smallest_gap", "m", std::isfinite(gap) ? gap : 0);
    quantity("tip_x", "m", tip.x());
    quantity("tip_y", "m", tip.y());
    quantity("tip_z", "m", tip.z());
    quantity("nodes", "", double(w.last() - w.state.first + 1));
}

void record_nesting(const Coaxial& c, std::size_t nesting, int inner, int outer,
                    const std::string& prefix, StepRecord& out)
{
    double sum = 0, friction = 0;
    int count = 0;
    for (const NestedContact& k : c.contacts[nesting]) {
        const Candidate& a = k.on_inner;
        if (!(a.normal > 0)) continue;
        ContactRecord r;
        r.point = a.x - a.radius * a.n;
        r.normal = a.n;
        const Vec3 t = a.tangential[0] * a.t1 + a.tangential[1] * a.t2;
        r.force = a.normal * a.n + t;
        r.slip = a.slip[0] * a.t1 + a.slip[1] * a.t2;
        r.normal_force = r.clustered_force = a.normal;
        r.gap = a.gap;
        const bool sticks = a.mu > 0 && t.norm() < a.mu * a.normal * (1 - 1e-6);
        r.status = sticks ? ContactStatus::stick : ContactStatus::slip;
        r.body_a = inner;
        r.body_b = outer;
        out.contacts.push_back(r);
        sum += a.normal;
        friction += t.norm();
        ++count;
    }
    out.quantities.push_back({prefix + "normal_force_sum", "N", sum});
    out.quantities.push_back({prefix + "friction_force_sum", "N", friction});
    out.quantities.push_back({prefix + "contacts", "", double(count)});
}

} // namespace amontons
