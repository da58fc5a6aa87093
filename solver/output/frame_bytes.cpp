#include "solver/output/frame_bytes.hpp"

#include "mesh/format/vtu.hpp"
#include "solver/output/vtk_writer.hpp"

#include <fmt/format.h>

namespace amontons {
namespace {

/// A number of each contact, as an array.
template <class Value>
std::vector<double> each(const std::vector<ContactRecord>& contacts, int components, Value&& value)
{
    std::vector<double> out;
    out.reserve(contacts.size() * static_cast<std::size_t>(components));
    for (const ContactRecord& c : contacts)
        value(c, out);
    return out;
}

} // namespace

std::string contacts_bytes(const StepRecord& r, const ContactBodies& bodies)
{
    const auto number = [&](auto&& of) {
        return each(r.contacts, 1, [&](const ContactRecord& c, std::vector<double>& out) {
            out.push_back(static_cast<double>(of(c)));
        });
    };
    const auto vector = [&](auto&& of) {
        return each(r.contacts, 3, [&](const ContactRecord& c, std::vector<double>& out) {
            const Vec3 v = of(c);
            out.insert(out.end(), {v.x(), v.y(), v.z()});
        });
    };
    using C = const ContactRecord&;
    std::vector<Vec3> points;
    for (C c : r.contacts)
        points.push_back(c.point);
    const auto force = vector([](C c) { return c.force; });
    const auto normal = vector([](C c) { return c.normal; });
    const auto slip = vector([](C c) { return c.slip; });
    const auto normal_force = number([](C c) { return c.normal_force; });
    const auto tangential_force =
        number([](C c) { return (c.force - c.force.dot(c.normal) * c.normal).norm(); });
    const auto gap = number([](C c) { return c.gap; });
    const auto status = number([](C c) { return static_cast<int>(c.status); });
    const auto a = number([](C c) { return c.body_a; });
    const auto b = number([](C c) { return c.body_b; });
    const auto pressure = number([](C c) { return c.pressure; });
    const auto area = number([](C c) { return c.area; });
    PolyData data;
    data.points = points;
    data.vertices = true;
    data.point_arrays = {{"force", "N", 3, force},
                         {"normal", "", 3, normal},
                         {"slip", "m", 3, slip},
                         {"normal_force", "N", 1, normal_force},
                         {"tangential_force", "N", 1, tangential_force},
                         {"gap", "m", 1, gap},
                         {"status", "", 1, status, Stored::int32},
                         {"body_a", "", 1, a, Stored::int32},
                         {"body_b", "", 1, b, Stored::int32},
                         {"pressure", "Pa", 1, pressure},
                         {"area", "m^2", 1, area}};
    data.texts = {
        {"force_acts_on", {"body_a"}}, {"body_names", bodies.names}, {"body_kinds", bodies.kinds}};
    return vtp_bytes(data, r.time);
}

std::string beam_bytes(const BeamRecord& beam, double time)
{
    PolyData data;
    data.points = beam.points;
    if (beam.points.size() > 1) {
        data.lines.emplace_back();
        for (std::size_t i = 0; i < beam.points.size(); ++i)
            data.lines[0].push_back(static_cast<std::int32_t>(i));
    }
    for (const Field& f : beam.fields)
        data.point_arrays.push_back({f.name, f.unit, f.components, f.values});
    return vtp_bytes(data, time);
}

std::string body_bytes(const BodyRecord& body, double time)
{
    const auto arrays = [](const std::vector<Field>& fields) {
        std::vector<VtkArray> out;
        for (const Field& f : fields)
            out.push_back({f.name, f.unit, f.components, f.values});
        return out;
    };
    if (!body.elements) {
        PolyData data;
        data.points = body.points;
        data.triangles = body.triangles;
        data.point_arrays = arrays(body.point_fields);
        return vtp_bytes(data, time);
    }
    std::vector<std::int32_t> connectivity, offsets;
    std::vector<std::uint8_t> types;
    for_each_element(*body.elements, [&](std::int32_t, ElementKind kind, auto nodes) {
        connectivity.insert(connectivity.end(), nodes.begin(), nodes.end());
        offsets.push_back(static_cast<std::int32_t>(connectivity.size()));
        types.push_back(vtk_type(kind));
    });
    return vtu_bytes({body.points,
                      connectivity,
                      offsets,
                      types,
                      arrays(body.point_fields),
                      arrays(body.cell_fields),
                      {{"stress_round_off", {fmt::format("{:.3g}", body.stress_round_off)}}}},
                     time);
}

std::string tube_bytes(const TubeSurface& tube, double time)
{
    PolyData data;
    data.points = tube.points;
    data.stored = Stored::float32; // for the eye; the numbers are in the polyline
    data.triangles = tube.triangles;
    for (const Field& f : tube.fields)
        data.point_arrays.push_back({f.name, f.unit, f.components, f.values, Stored::float32});
    return vtp_bytes(data, time);
}

} // namespace amontons
