#include "bindings/python/common.hpp"
#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"

#include <typeinfo>

// The engine's exceptions as those of amontons/errors.py, and small helpers.

namespace amontons::python {

py::object from_package(const char* file, const char* name)
{
    return py::module_::import((std::string("amontons.") + file).c_str()).attr(name);
}

py::object from_json(const std::string& text)
{
    return py::module_::import("json").attr("loads")(text);
}

py::object read_only(const py::dict& values)
{
    return py::reinterpret_steal<py::object>(PyDictProxy_New(values.ptr()));
}

py::object values_of(const std::vector<Quantity>& quantities)
{
    py::dict all;
    for (const Quantity& q : quantities)
        all[py::str(q.name)] = q.value;
    return read_only(all);
}

py::object units_of(const std::vector<Quantity>& quantities)
{
    py::dict all;
    for (const Quantity& q : quantities)
        all[py::str(q.name)] = q.unit;
    return read_only(all);
}

void throw_python(const char* name, const std::string& message, const py::dict& attributes)
{
    const py::object type = from_package("errors", name);
    const py::object error = type(message);
    for (const auto& [key, value] : attributes)
        py::setattr(error, key, value);
    PyErr_SetObject(type.ptr(), error.ptr());
    throw py::error_already_set();
}

void throw_runtime(const std::string& message)
{
    PyErr_SetString(PyExc_RuntimeError, message.c_str());
    throw py::error_already_set();
}

namespace {

py::list list_of(const std::vector<Issue>& issues)
{
    py::list all;
    for (const Issue& i : issues) {
        py::dict one;
        one["file"] = i.file;
        one["place"] = i.place;
        one["found"] = i.found;
        one["allowed"] = i.allowed;
        all.append(one);
    }
    return all;
}

void set_python(const char* name, const char* message, const char* attribute, py::object value)
{
    try {
        py::dict attributes;
        attributes[attribute] = std::move(value);
        throw_python(name, message, attributes);
    } catch (py::error_already_set& error) {
        error.restore();
    }
}

} // namespace

void add_error_types(py::module_&)
{
    py::register_exception_translator([](std::exception_ptr error) {
        try {
            std::rethrow_exception(error);
        } catch (const InputError& e) {
            set_python("InputError", e.what(), "issues", list_of(e.issues()));
        } catch (const WriteError& e) {
            set_python("WriteError", e.what(), "filename", py::str(e.file()));
        } catch (const std::logic_error& e) {
            if (typeid(e) != typeid(std::logic_error)) throw; // Python's own names for the others
            set_python("InternalError", e.what(), "where", py::str(e.what()));
        }
    });
}

} // namespace amontons::python
