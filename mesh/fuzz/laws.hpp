#pragma once

#include "mesh/base/error.hpp"
#include "mesh/polyline.hpp"
#include "mesh/surface_check.hpp"

#include <cstdint>
#include <string_view>

// What must hold for whatever a reader accepts. A law that is broken ends the fuzzer (a
// std::logic_error that no one catches), as does every exception but InputError.

namespace amontons {

inline std::string_view as_text(const std::uint8_t* data, std::size_t size)
{
    return {reinterpret_cast<const char*>(data), size};
}

/// Checks an accepted surface, and that it reads back as it was written.
/// @param reread  what the reader makes of the written surface
template <class Reread> void obey_laws(const SurfaceMesh& mesh, Reread reread)
{
    AMONTONS_ASSERT(!mesh.triangles.empty());
    for (const Vec3& x : mesh.points)
        AMONTONS_ASSERT(x.allFinite());
    const SurfaceReport report = check_surface(mesh); // asserts that indices are in range
    issues(report, mesh, {}, "file");
    const SurfaceMesh again = reread(mesh);
    AMONTONS_ASSERT(again.points == mesh.points && again.triangles == mesh.triangles);
}

inline void obey_laws(const Polyline& line)
{
    AMONTONS_ASSERT(line.points.size() >= 2);
    AMONTONS_ASSERT(line.radius.empty() || line.radius.size() == line.points.size());
    for (std::size_t i = 0; i < line.points.size(); ++i) {
        AMONTONS_ASSERT(line.points[i].allFinite());
        AMONTONS_ASSERT(i == 0 || line.points[i] != line.points[i - 1]);
        AMONTONS_ASSERT(line.radius.empty() || line.radius[i] > 0);
    }
}

} // namespace amontons
