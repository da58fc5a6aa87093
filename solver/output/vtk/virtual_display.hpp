#pragma once

#include <string>
#include <sys/types.h>

namespace amontons::vtk_module {

/// An X display to draw on without a screen: an Xvfb of this process where that program is
/// installed (the same software picture on every machine, no window shown), else $DISPLAY.
/// The Xvfb ends with this object, and with this process however that ends.
class VirtualDisplay {
public:
    /// @throws std::runtime_error  if there is neither; its text specifies what to install
    VirtualDisplay();
    ~VirtualDisplay();
    VirtualDisplay(const VirtualDisplay&) = delete;
    VirtualDisplay& operator=(const VirtualDisplay&) = delete;

    /// The connection, an Xlib `Display*`.
    void* connection() const { return connection_; }

private:
    void stop_server();

    pid_t server_ = -1;
    void* connection_ = nullptr;
};

} // namespace amontons::vtk_module
