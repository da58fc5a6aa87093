#include "solver/step/instrument_record.hpp"

#include <algorithm>
#include <limits>

namespace amontons {
namespace {

/// Arc length of the place of a line that is nearest to x [m].
double nearest_arc(const BeamRecord& beam, const std::vector<double>& arc, const Vec3& x)
{
    double best = std::numeric_limits<double>::infinity(), at = 0;
    for (std::size_t i = 0; i + 1 < beam.points.size(); ++i) {
        const Vec3 a = beam.points[i], along = beam.points[i + 1] - a;
        const double t = std::clamp((x - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
        const double away = (a + t * along - x).squaredNorm();
        if (away >= best) continue;
        best = away;
        at = arc[i] + t * (arc[i + 1] - arc[i]);
    }
    return at;
}

bool is_beyond(const Opening& opening, const Vec3& x)
{
    return (x - opening.centre).dot(opening.outward) > 0;
}

} // namespace

void record_instrument(const BeamRecord& beam, int body, double depth, double cluster,
                       StepRecord& out)
{
    const auto arc = std::ranges::find(beam.fields, "arc_length", &Field::name);
    std::vector<ContactRecord*> own;
    std::vector<double> place;
    double normal = 0, friction = 0;
    for (ContactRecord& c : out.contacts) {
        if (c.body_a != body && c.body_b != body) continue;
        own.push_back(&c);
        place.push_back(nearest_arc(beam, arc->values, c.point));
        normal += c.normal_force;
        friction += (c.force - c.normal_force * c.normal).norm();
    }
    double largest = 0;
    for (std::size_t i = 0; i < own.size(); ++i) {
        double here = 0;
        for (std::size_t j = 0; j < own.size(); ++j)
            if (std::abs(place[i] - place[j]) <= 0.5 * cluster) here += own[j]->normal_force;
        own[i]->clustered_force = std::max(own[i]->clustered_force, here); // of two instruments
        largest = std::max(largest, here);
    }
    const auto quantity = [&](const char* what, const char* unit, double value) {
        out.quantities.push_back({beam.name + "_" + what, unit, value});
    };
    quantity("depth", "m", depth);
    quantity("normal_force_sum", "N", normal);
    quantity("friction_force_sum", "N", friction);
    quantity("clustered_force", "N", largest);
    for (int k = 0; k < 3; ++k)
        quantity((std::string("tip_") + "xyz"[k]).c_str(), "m", beam.points.back()[k]);
}

void InstrumentLog::note(const StepRecord& record, const BeamRecord& beam,
                         const std::vector<Obstacle>& obstacles, std::span<const int> walls)
{
    const auto value = [&](const char* what) {
        const auto q = std::ranges::find(record.quantities, beam.name + what, &Quantity::name);
        return q == record.quantities.end() ? 0 : q->value;
    };
    const Vec3 before = Vec3::Map(tip), now = beam.points.back();
    // Pulled back into the vessel: it may continue another way.
    if (opening >= 0 && !is_beyond(passed(obstacles), now)) opening = -1;
    const double depth_now = value("_depth");
    // An inlet that it is drawn out of does not count.
    const bool is_inserted = depth >= 0 && depth_now > depth;
    for (const int o : walls) {
        if (opening >= 0 || !is_inserted || std::size_t(o) >= obstacles.size()) continue;
        const WallModel& m = obstacles[std::size_t(o)].model;
        if (const Opening* p = opening_passed(m, before, now)) {
            opening = int(p - m.openings.data());
            opening_wall = o;
        }
    }
    Vec3::Map(tip) = now;
    depth = depth_now;
    const bool is_most = depth >= max_depth;
    branch.note(obstacles, walls, beam.points.back(), depth, is_most);
    if (is_most) max_depth = depth;
    max_push = std::max(max_push, value("_push_force"));
    max_torque = std::max(max_torque, std::abs(value("_torque")));
    max_clustered = std::max(max_clustered, value("_clustered_force"));
}

std::string InstrumentLog::place(const std::vector<Obstacle>& obstacles) const
{
    return opening >= 0 ? passed(obstacles).name : branch.name(obstacles);
}

void InstrumentLog::add_quantities(const std::string& name, std::vector<Quantity>& out) const
{
    out.push_back({name + "_max_depth", "m", max_depth});
    out.push_back({name + "_max_push_force", "N", max_push});
    out.push_back({name + "_max_torque", "N m", max_torque});
    out.push_back({name + "_max_clustered_force", "N", max_clustered});
}

} // namespace amontons
