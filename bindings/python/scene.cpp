#include "bindings/python/aside.hpp"

#include "mesh/base/file.hpp"
#include "solver/scene/read.hpp"
#include "solver/step/stepped_scene.hpp"

namespace amontons::python {

namespace {

/// Files that the scene names by where it stands.
std::vector<std::string> relative_files(const SceneText& s)
{
    std::vector<std::string> all;
    for (const NamedFile& f : named_files(s.scene))
        if (f.name != f.path || f.name.empty() || f.name.front() != '/') all.push_back(f.name);
    return all;
}

} // namespace

void add_scene(py::module_& module)
{
    // Python's Scene (amontons/scene.py) stands on this.
    py::class_<SceneText, std::shared_ptr<SceneText>>(module, "SceneText", py::module_local())
        .def(py::init([](std::string text, std::string file, std::vector<std::string> overrides) {
            const py::gil_scoped_release free;
            return std::const_pointer_cast<SceneText>(
                read_scene_text(std::move(text), std::move(file), std::move(overrides)));
        }))
        .def("changed",
             [](const SceneText& s, const std::vector<std::string>& more) {
                 const py::gil_scoped_release free;
                 return std::const_pointer_cast<SceneText>(change_scene(s, more));
             })
        .def("check",
             [](const std::shared_ptr<SceneText>& s) {
                 std::string text;
                 {
                     const py::gil_scoped_release free;
                     text = done_aside([s] { return check_scene(*s); });
                 }
                 return from_json(text);
             })
        .def("resolved", [](const SceneText& s) { return resolved_scene(s.scene); })
        .def("relative_files", relative_files)
        .def("save", [](const SceneText& s,
                        const std::string& path) { write_file(path, resolved_scene(s.scene)); })
        .def("state",
             [](const SceneText& s) { return py::make_tuple(s.text, s.file, s.overrides); })
        .def_readonly("file", &SceneText::file);
}

} // namespace amontons::python
