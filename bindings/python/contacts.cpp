#include "bindings/python/records.hpp"
#include "mesh/base/error.hpp"

#include <algorithm>

// Contacts of a step: views into the vector of records, without a copy.

namespace amontons::python {
namespace {

using Rows = std::vector<ContactRecord>;
constexpr auto kStride = py::ssize_t(sizeof(ContactRecord));

const Rows& rows(const ContactsView& v)
{
    return v.record->step.contacts;
}

template <Vec3 ContactRecord::*member> py::array vectors(const ContactsView& v)
{
    const Rows& c = rows(v);
    return view<double>(v.record, c.empty() ? nullptr : (c[0].*member).data(),
                        {{py::ssize_t(c.size()), 3}, {kStride, sizeof(double)}});
}

template <double ContactRecord::*member> py::array numbers(const ContactsView& v)
{
    const Rows& c = rows(v);
    return view<double>(v.record, c.empty() ? nullptr : &(c[0].*member),
                        {{py::ssize_t(c.size())}, {kStride}});
}

template <auto member> py::array integers(const ContactsView& v)
{
    static_assert(sizeof(ContactRecord{}.*member) == sizeof(std::int32_t));
    const Rows& c = rows(v);
    return view<std::int32_t>(
        v.record, c.empty() ? nullptr : reinterpret_cast<const std::int32_t*>(&(c[0].*member)),
        {{py::ssize_t(c.size())}, {kStride}});
}

int number_of(const ContactsView& v, const std::string& body)
{
    const std::vector<std::string>& names = *v.record->bodies;
    const auto at = std::ranges::find(names, body);
    if (at != names.end()) return int(at - names.begin());
    const std::string near = nearest_name(body, names);
    std::string allowed = near.empty() ? "" : "did you mean \"" + near + "\"; ";
    allowed += "one of";
    for (const std::string& n : names)
        allowed += " \"" + n + "\"";
    throw InputError({{"", "body", quoted_text(body), allowed}});
}

py::array_t<bool> of(const ContactsView& v, const std::string& a,
                     const std::optional<std::string>& b)
{
    const Rows& c = rows(v);
    const int first = number_of(v, a), second = b ? number_of(v, *b) : -1;
    py::array_t<bool> mask{py::ssize_t(c.size())};
    bool* out = mask.mutable_data();
    for (const ContactRecord& r : c) {
        const bool involved = r.body_a == first || r.body_b == first;
        *out++ = b ? (r.body_a == first && r.body_b == second) ||
                         (r.body_a == second && r.body_b == first)
                   : involved;
    }
    return mask;
}

py::dict to_dict(const ContactsView& v)
{
    py::dict all;
    const py::object self = py::cast(v);
    for (const char* name : {"point", "force", "normal", "slip", "normal_force", "gap",
                             "clustered_force", "pressure", "area", "status", "body_a", "body_b"})
        all[name] = self.attr(name).attr("copy")();
    return all;
}

} // namespace

void add_contacts(py::module_& module)
{
    using C = ContactRecord;
    py::class_<ContactsView>(
        module, "Contacts", py::module_local(),
        "The closed contacts of a step. Arrays are read-only and keep the step's record alive. "
        "`force` acts on body a; `normal` points from body b to body a.")
        .def("__len__", [](const ContactsView& v) { return rows(v).size(); })
        .def_property_readonly("point", vectors<&C::point>, "(n, 3) on the wall [m]")
        .def_property_readonly("force", vectors<&C::force>, "(n, 3) on body a [N]")
        .def_property_readonly("normal", vectors<&C::normal>, "(n, 3) from b to a")
        .def_property_readonly("slip", vectors<&C::slip>, "(n, 3) over the step [m]")
        .def_property_readonly("normal_force", numbers<&C::normal_force>, "(n,) [N]")
        .def_property_readonly("gap", numbers<&C::gap>, "(n,) [m]")
        .def_property_readonly("clustered_force", numbers<&C::clustered_force>,
                               "(n,) normal forces summed over the neighbourhood [N]")
        .def_property_readonly("pressure", numbers<&C::pressure>,
                               "(n,) normal force over the area it stands for; 0: none [Pa]")
        .def_property_readonly("area", numbers<&C::area>, "(n,) [m^2]; 0: none")
        .def_property_readonly("status", integers<&C::status>,
                               "(n,) int32: 0 open, 1 sticks, 2 slips")
        .def_property_readonly("body_a", integers<&C::body_a>, "(n,) int32, into `names`")
        .def_property_readonly("body_b", integers<&C::body_b>, "(n,) int32, into `names`")
        .def_property_readonly(
            "names", [](const ContactsView& v) { return py::tuple(py::cast(*v.record->bodies)); },
            "of the bodies, by number")
        .def("of", of, py::arg("a"), py::arg("b") = py::none(),
             "(n,) bool: contacts of body a, or of the pair a and b in either order. InputError if "
             "there is no such body.")
        .def("to_dict", to_dict, "name to a copy of each array")
        .def("__repr__", [](const ContactsView& v) {
            return "<Contacts: " + std::to_string(rows(v).size()) + ">";
        });
}

} // namespace amontons::python
