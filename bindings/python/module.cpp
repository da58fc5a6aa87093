#include "solver/module.hpp"
#include "bindings/python/aside.hpp"
#include "solver/output/manifest.hpp"

#include <dlfcn.h>
#include <filesystem>

namespace amontons::python {
namespace {

namespace fs = std::filesystem;

/// Where program and modules are beside the package: LIB/python*/*/amontons, as it is built and
/// installed.
void find_home()
{
    Dl_info info{};
    std::error_code error;
    if (::dladdr(reinterpret_cast<const void*>(&find_home), &info) == 0 || !info.dli_fname) return;
    const fs::path lib = fs::weakly_canonical(info.dli_fname, error)
                             .parent_path()
                             .parent_path()
                             .parent_path()
                             .parent_path();
    Host host;
    for (const fs::path& folder : {lib / "amontons", lib / ".." / AMONTONS_LIBDIR / "amontons"})
        if (host.modules.empty() && fs::is_directory(folder, error))
            host.modules = fs::weakly_canonical(folder, error).string();
    // Never the interpreter: it would be started with the words of another program.
    host.program = fs::weakly_canonical(lib / "../bin/amontons", error).string();
    set_host(std::move(host));
}

} // namespace
} // namespace amontons::python

PYBIND11_MODULE(_native, module)
{
    using namespace amontons;
    using namespace amontons::python;
    find_home();
    add_aside(module);
    add_error_types(module);
    add_contacts(module);
    add_certificates(module);
    add_records(module);
    add_scene(module);
    add_simulation(module);
    add_bodies(module);
    add_contact_problem(module);
    add_files(module);
    add_batch(module);
    add_haptic(module);
    add_image(module);
    module.def("version", &program_version);
    module.def("describe", &program_describe);
    module.def("program_path", &program_path);
    module.def("module_folders", &module_folders);
    module.def("find_module", &find_module, py::arg("name"));
    module.def("compiler", [] { return std::string("g++ " __VERSION__); });
}
