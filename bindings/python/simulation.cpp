#include "bindings/python/stepper.hpp"

#include <limits>

// The class that Python's Simulation (amontons/simulation.py) is made of.

namespace amontons::python {

using Outcome = StepResult::Outcome;
using Owner = std::shared_ptr<Stepper>;
constexpr auto Read = Stepper::Purpose::read, Change = Stepper::Purpose::change;

namespace {

py::object view_of(const Record& record)
{
    return record ? py::cast(StepView{record}) : py::none();
}

[[noreturn]] void throw_failed(Stepper& s, const std::string& message)
{
    py::dict attributes;
    attributes["record"] = view_of(s.record());
    attributes["time"] = s.simulation().so_far().time;
    attributes["step"] = s.simulation().so_far().steps;
    throw_python("SolveFailed", message, attributes);
}

/// So many steps, or to a time, or the end. With the GIL.
py::object steps(const Owner& s, long count, double not_beyond)
{
    const Stepper::Use use(*s, Change);
    StepResult last;
    {
        const py::gil_scoped_release free;
        last = s->steps(count, not_beyond);
    }
    if (last.outcome == Outcome::failed) throw_failed(*s, last.message);
    return view_of(s->record());
}

py::object step(const Owner& s, long count)
{
    if (count < 1) throw InputError({{"", "count", std::to_string(count), "a whole number >= 1"}});
    return steps(s, count, std::numeric_limits<double>::infinity());
}

py::object advance(const Owner& s, double until)
{
    {
        const Stepper::Use use(*s, Read);
        s->check_until(until);
    }
    return steps(s, std::numeric_limits<long>::max(), until);
}

py::bytes save(const Owner& s)
{
    const Stepper::Use use(*s, Read);
    return py::bytes(s->save());
}

void restore(const Owner& s, const py::bytes& bytes)
{
    const Stepper::Use use(*s, Change);
    const auto text = static_cast<std::string_view>(bytes);
    const py::gil_scoped_release free;
    s->restore(text);
}

std::string branch(const Owner& s)
{
    const Stepper::Use use(*s, Read);
    for (const NamedText& t : s->simulation().so_far().texts)
        if (t.name == "branch" || t.name.ends_with("_branch")) return t.value;
    return "";
}

Owner fork(const Owner& s)
{
    const Stepper::Use use(*s, Read);
    const py::gil_scoped_release free;
    const auto made = std::make_shared<Owner>();
    wait_for(Aside::start([s, made] { *made = s->fork(); }, s->stop()), {&s, 1});
    return *made;
}

} // namespace

void add_simulation(py::module_& module)
{
    py::class_<Stepper, Owner>(module, "Stepper", py::module_local())
        .def(py::init([](const std::shared_ptr<SceneText>& scene, int threads, std::string cache) {
            if (threads < 1 || threads > 1024)
                throw InputError({{"", "threads", std::to_string(threads), "1 to 1024"}});
            const py::gil_scoped_release free;
            SimulationOptions options;
            options.threads = threads;
            options.cache = std::move(cache);
            return done_aside([scene, options] { return std::make_shared<Stepper>(scene, options); });
        }))
        .def(py::init(&fork))
        .def("step", step, py::arg("count") = 1)
        .def("advance", advance, py::arg("until"))
        .def_property_readonly("record",
                               [](const Owner& s) {
                                   const Stepper::Use use(*s, Read);
                                   return view_of(s->record());
                               })
        .def_property_readonly("time",
                               [](const Owner& s) {
                                   const Stepper::Use use(*s, Read);
                                   return s->time();
                               })
        .def_property_readonly("done",
                               [](const Owner& s) {
                                   const Stepper::Use use(*s, Read);
                                   return s->done();
                               })
        .def_property_readonly("branch", branch)
        .def_property_readonly("end", [](const Owner& s) { return s->end(); })
        .def_property_readonly(
            "scene_text",
            [](const Owner& s) { return std::const_pointer_cast<SceneText>(s->scene()); })
        .def_property_readonly("warnings",
                               [](const Owner& s) {
                                   py::list all;
                                   for (const Issue& w : s->warnings())
                                       all.append(std::string(InputError({w}).what()));
                                   return all;
                               })
        .def("save", save)
        .def("restore", restore, py::arg("state"))
        .def("change",
             [](const Owner& s, const std::vector<std::string>& overrides) {
                 const Stepper::Use use(*s, Change);
                 const py::gil_scoped_release free;
                 s->change(overrides);
             })
        .def("input_names",
             [](const Owner& s) {
                 const Stepper::Use use(*s, Read);
                 py::list all;
                 for (const InputInfo& i : s->simulation().inputs())
                     all.append(py::make_tuple(i.name, i.unit, i.lower, i.upper));
                 return all;
             })
        .def("input",
             [](const Owner& s, std::size_t k) {
                 const Stepper::Use use(*s, Read);
                 return s->simulation().input(k);
             })
        .def("set_input",
             [](const Owner& s, std::size_t k, double v) {
                 const Stepper::Use use(*s, Change);
                 s->simulation().set_input(k, v);
             })
        .def("close",
             [](const Owner& s) {
                 if (!s->closed()) s->close();
             })
        .def_property_readonly("closed", [](const Owner& s) { return s->closed(); });
}

} // namespace amontons::python
