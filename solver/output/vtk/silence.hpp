#pragma once

#include <memory>

namespace amontons::vtk_module {

/// During its lifetime VTK's messages are discarded: errors that matter are thrown with a message
/// of this module.
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
