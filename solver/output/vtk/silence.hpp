#pragma once

#include <memory>

namespace amontons::vtk_module {

/// While it lives, VTK's complaints are discarded: what matters is thrown with a text of ours.
class Silence {
public:
    Silence();
    ~Silence();
    Silence(const Silence&) = delete;
    Silence& operator=(const Silence&) = delete;

private:
    struct Before; ///< what VTK did with them
    std::unique_ptr<Before> before_;
};

} // namespace amontons::vtk_module
