#include "bindings/python/stepper.hpp"

#include <algorithm>

// Bodies as they are after the last step: points, cells and fields of solids, rigid bodies,
// obstacles.

namespace amontons::python {
namespace {

/// Of a body, with what its cells live in.
struct Body {
    std::string name, kind;
    std::shared_ptr<Simulation> simulation;
    BodyRecord record;
    const SurfaceMesh* surface = nullptr; ///< of an obstacle, which does not move
};
using SharedBody = std::shared_ptr<Body>;

std::vector<std::pair<std::string, std::string>> names_and_kinds(const std::shared_ptr<Stepper>& s)
{
    std::vector<std::pair<std::string, std::string>> all;
    for (const BodyPlan& b : s->simulation().plan())
        all.emplace_back(b.name, b.kind);
    return all;
}

SharedBody body_of(const std::shared_ptr<Stepper>& s, const std::string& name)
{
    const auto all = names_and_kinds(s);
    const auto at = std::ranges::find(all, name, [](const auto& b) { return b.first; });
    if (at == all.end()) return nullptr;
    auto body = std::make_shared<Body>();
    body->name = name;
    body->kind = at->second;
    body->simulation = s->shared();
    for (const Obstacle& o : s->simulation().obstacles())
        if (o.name == name) body->surface = &*o.model.surface;
    if (body->surface) return body;
    for (BodyRecord& r : s->simulation().body_records())
        if (r.name == name) {
            body->record = std::move(r);
            return body;
        }
    return nullptr;
}

py::object fields(const SharedBody& b, const std::vector<Field>& of)
{
    py::dict all;
    for (const Field& f : of)
        all[py::str(f.name)] = view_field(b, f);
    return read_only(all);
}

py::array triangles(const SharedBody& b)
{
    const auto& t = b->surface ? b->surface->triangles : b->record.triangles;
    return view<std::int32_t>(b, t.empty() ? nullptr : t[0].data(),
                              {{py::ssize_t(t.size()), 3}, {12, 4}});
}

py::object cells(const SharedBody& b)
{
    py::dict all;
    if (b->record.elements)
        for (const ElementBlock& block : b->record.elements->blocks) {
            const auto n = py::ssize_t(shape_of(block.kind).nodes);
            all[shape_of(block.kind).name] = view<std::int32_t>(
                b, block.nodes.data(), {{py::ssize_t(block.nodes.size()) / n, n}, {4 * n, 4}});
        }
    return read_only(all);
}

py::object units(const SharedBody& b)
{
    py::dict all;
    for (const auto* of : {&b->record.point_fields, &b->record.cell_fields})
        for (const Field& f : *of)
            all[py::str(f.name)] = f.unit;
    return read_only(all);
}

} // namespace

void add_bodies(py::module_& module)
{
    py::class_<Body, SharedBody>(
        module, "Body", py::module_local(),
        "A solid, a rigid body or an obstacle in its state at the time of access. "
        "Arrays are read-only and keep it alive.")
        .def_readonly("name", &Body::name)
        .def_readonly("kind", &Body::kind, "'solid', 'rigid' or 'obstacle'")
        .def_property_readonly(
            "points",
            [](const SharedBody& b) {
                return view_points(b, b->surface ? b->surface->points : b->record.points);
            },
            "(n, 3) now [m]")
        .def_property_readonly("triangles", triangles,
                               "(m, 3) int32, of the surface; of a solid (0, 3): it has cells")
        .def_property_readonly(
            "cells", cells, "of a solid: 'T4', 'T10' or 'H8' to (m, nodes) int32, in VTK's order")
        .def_property_readonly(
            "fields", [](const SharedBody& b) { return fields(b, b->record.point_fields); },
            "at the points: name to (n,) or (n, components)")
        .def_property_readonly(
            "cell_fields", [](const SharedBody& b) { return fields(b, b->record.cell_fields); },
            "of the cells: name to (m,) or (m, components)")
        .def_property_readonly("units", units, "of the fields")
        .def("to_pyvista", to_pyvista, kToPyvista)
        .def("to_meshio", to_meshio, kToMeshio)
        .def("__repr__", [](const Body& b) { return "<Body " + b.name + ": " + b.kind + ">"; });
    module.def("body_names", [](const std::shared_ptr<Stepper>& s) {
        const Stepper::Use use(*s, Stepper::Purpose::read);
        return names_and_kinds(s);
    });
    module.def("body", [](const std::shared_ptr<Stepper>& s, const std::string& name) {
        const Stepper::Use use(*s, Stepper::Purpose::read);
        const auto body = std::make_shared<SharedBody>();
        const py::gil_scoped_release free;
        wait_for(Aside::start([s, body, name] { *body = body_of(s, name); }, s->stop()), {&s, 1});
        return *body;
    });
}

} // namespace amontons::python
