#include "bindings/python/records.hpp"

// What one step reported, as read-only views.

namespace amontons::python {
namespace {

py::object beams_of(const Record& r)
{
    py::dict all;
    for (std::size_t i = 0; i < r->step.beams.size(); ++i)
        all[py::str(r->step.beams[i].name)] = py::cast(BeamView{r, i});
    return read_only(all);
}

py::object fields_of(const BeamView& v)
{
    py::dict all;
    for (const Field& f : v.beam().fields)
        all[py::str(f.name)] = view_field(v.record, f);
    return read_only(all);
}

} // namespace

void add_records(py::module_& module)
{
    py::class_<BeamView>(module, "Beam", py::module_local(),
                         "A beam as a polyline, from the sheath's end to the tip.")
        .def_property_readonly(
            "name", [](const BeamView& v) { return v.beam().name; }, "of the body")
        .def_property_readonly(
            "points", [](const BeamView& v) { return view_points(v.record, v.beam().points); },
            "(n, 3) [m], read-only")
        .def_property_readonly("fields", fields_of,
                               "radius, curvature, twist, axial_force, moment, arc_length: name to "
                               "(n,) or (n, components), read-only")
        .def_property_readonly(
            "units",
            [](const BeamView& v) {
                py::dict all;
                for (const Field& f : v.beam().fields)
                    all[py::str(f.name)] = f.unit;
                return read_only(all);
            },
            "of the fields")
        .def("to_pyvista", to_pyvista, kToPyvista)
        .def("to_meshio", to_meshio, kToMeshio)
        .def("__len__", [](const BeamView& v) { return v.beam().points.size(); })
        .def("__repr__", [](const BeamView& v) {
            return "<Beam " + v.beam().name + ": " + std::to_string(v.beam().points.size()) +
                   " points>";
        });

    py::class_<EnergyRecord>(module, "Energy", py::module_local(),
                             "Energy [J]: work and losses since the start of the run, what is "
                             "stored now and what was then.")
        .def_readonly("work", &EnergyRecord::work, "of drives and loads")
        .def_readonly("elastic", &EnergyRecord::elastic)
        .def_readonly("kinetic", &EnergyRecord::kinetic)
        .def_readonly("friction", &EnergyRecord::friction, "lost in it")
        .def_readonly("released", &EnergyRecord::released, "lost in snaps and damping")
        .def_readonly("elastic_start", &EnergyRecord::elastic_start)
        .def_readonly("kinetic_start", &EnergyRecord::kinetic_start)
        .def_property_readonly("error", &EnergyRecord::error, "work that is nowhere")
        .def_property_readonly("scale", &EnergyRecord::scale, "what the run turned over")
        .def("__repr__", [](const EnergyRecord& e) {
            return "<Energy: work " + std::to_string(e.work) + " J, error " +
                   std::to_string(e.error()) + " J>";
        });

    py::class_<StepView>(module, "StepRecord", py::module_local(),
                         "One finished step. Nothing in it changes; arrays keep it alive.")
        .def_property_readonly(
            "step", [](const StepView& v) { return v.step().step; }, "0 is the initial state")
        .def_property_readonly(
            "time", [](const StepView& v) { return v.step().time; }, "[s]")
        .def_property_readonly(
            "step_length", [](const StepView& v) { return v.step().step_length; }, "[s]")
        .def_property_readonly(
            "iterations", [](const StepView& v) { return v.step().iterations; },
            "of Newton's method; of rods alone factors, also of trials")
        .def_property_readonly(
            "retries", [](const StepView& v) { return v.step().retries; },
            "shorter steps that were tried")
        .def_property_readonly(
            "remark", [](const StepView& v) { return v.step().remark; },
            "'', or what happened: 'snap', 'halved: ' and why")
        .def_property_readonly(
            "seconds", [](const StepView& v) { return v.step().seconds; }, "wall time of the step")
        .def_property_readonly(
            "contacts", [](const StepView& v) { return ContactsView{v.record}; },
            "those that are closed")
        .def_property_readonly(
            "certificate", [](const StepView& v) { return v.step().certificate; },
            "errors, recomputed from the state alone")
        .def_property_readonly("energy", [](const StepView& v) { return v.step().energy; })
        .def_property_readonly(
            "quantities",
            [](StepView& v) {
                if (!v.quantities) v.quantities = values_of(v.step().quantities);
                return v.quantities;
            },
            "name to value: the columns of history.csv")
        .def_property_readonly(
            "units", [](const StepView& v) { return units_of(v.step().quantities); },
            "of the quantities")
        .def_property_readonly(
            "beams", [](const StepView& v) { return beams_of(v.record); }, "name to Beam")
        .def("__repr__", [](const StepView& v) {
            return "<StepRecord " + std::to_string(v.step().step) +
                   ": t = " + std::to_string(v.step().time) + " s, " +
                   std::to_string(v.step().contacts.size()) + " contacts>";
        });
}

} // namespace amontons::python
