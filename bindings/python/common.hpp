#pragma once

// Python's objects from the engine's, for the files of this folder alone.

#include "mesh/base/error.hpp"
#include "solver/step/stepped_scene.hpp"

#include <algorithm>
#include <memory>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <string>
#include <vector>

namespace amontons::python {

namespace py = pybind11;

/// Strides of an array inside other data [bytes].
struct Layout {
    std::vector<py::ssize_t> shape, strides;
};

/// A read-only array of numbers that are the engine's own; `owner` lives as long as it.
template <class T, class Owner>
py::array view(const std::shared_ptr<Owner>& owner, const T* first, Layout layout)
{
    static const T none{};
    auto* keep = new std::shared_ptr<Owner>(owner);
    const py::capsule capsule(keep,
                              [](void* p) { delete static_cast<std::shared_ptr<Owner>*>(p); });
    py::array a(py::dtype::of<T>(), layout.shape, layout.strides, first ? first : &none, capsule);
    py::detail::array_proxy(a.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
    return a;
}

/// (n, 3) of points, (n, k) of rows of equal length.
template <class Owner>
py::array view_points(const std::shared_ptr<Owner>& owner, const std::vector<Vec3>& points)
{
    return view<double>(owner, points.empty() ? nullptr : points[0].data(),
                        {{py::ssize_t(points.size()), 3}, {sizeof(Vec3), sizeof(double)}});
}
/// (n,) of a field of one component, else (n, components).
template <class Owner> py::array view_field(const std::shared_ptr<Owner>& owner, const Field& f)
{
    const auto k = py::ssize_t(f.components), n = py::ssize_t(f.values.size()) / k;
    constexpr auto size = py::ssize_t(sizeof(double));
    return k == 1 ? view<double>(owner, f.values.data(), {{n}, {size}})
                  : view<double>(owner, f.values.data(), {{n, k}, {k * size, size}});
}

/// `out` where a caller gave an array to write to, else a new one. @throws InputError  it does not
/// fit
template <class T>
py::array_t<T> out_array(const py::object& out, const char* numbers, std::vector<py::ssize_t> shape)
{
    if (out.is_none()) return py::array_t<T>(shape);
    auto array = py::array_t<T, py::array::c_style>::ensure(out);
    if (!py::isinstance<py::array_t<T>>(out) || !array || array.ptr() != out.ptr() ||
        !array.writeable() ||
        !std::equal(shape.begin(), shape.end(), array.shape(), array.shape() + array.ndim())) {
        PyErr_Clear();
        throw InputError({{"", "out", std::string(py::str(py::repr(out))).substr(0, 60),
                           std::string("a writable array of ") + numbers +
                               ", row by row, of shape " + std::string(py::str(py::cast(shape)))}});
    }
    return array;
}

/// A dict that cannot be changed.
py::object read_only(const py::dict& values);
/// {"name": value}, {"name": "unit"} of quantities and fields.
py::object values_of(const std::vector<Quantity>& quantities);
py::object units_of(const std::vector<Quantity>& quantities);

/// What json.loads gives for a text.
py::object from_json(const std::string& text);
/// The attribute of one of the package's own Python files.
py::object from_package(const char* file, const char* name);

/// A Body or a Beam as a mesh of another package (amontons/convert.py).
inline py::object to_pyvista(const py::object& body)
{
    return from_package("convert", "to_pyvista")(body);
}
inline py::object to_meshio(const py::object& body)
{
    return from_package("convert", "to_meshio")(body);
}
constexpr const char* kToPyvista =
    "Of a solid a pyvista.UnstructuredGrid, else a pyvista.PolyData: "
    "a copy, with all fields. ModuleMissing without pyvista.";
constexpr const char* kToMeshio =
    "A meshio.Mesh: a copy, with all fields. ModuleMissing without meshio.";

/// An error of the package, with its attributes: class, message, then pairs of names and values.
[[noreturn]] void throw_python(const char* name, const std::string& message,
                               const py::dict& attributes);
[[noreturn]] void throw_runtime(const std::string& message);

void add_error_types(py::module_& module);
void add_records(py::module_& module);
void add_contacts(py::module_& module);
void add_certificates(py::module_& module);
void add_bodies(py::module_& module);
void add_scene(py::module_& module);
void add_simulation(py::module_& module);
void add_contact_problem(py::module_& module);
void add_files(py::module_& module);
void add_batch(py::module_& module);
void add_haptic(py::module_& module);
void add_image(py::module_& module);

} // namespace amontons::python
