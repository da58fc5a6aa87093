#pragma once

#include "contact/surface/mortar.hpp"
#include "mesh/generate/solid_box.hpp"
#include "mesh/generate/solid_round.hpp"

#include <Eigen/Geometry>
#include <random>

// Bodies whose surfaces touch, for tests.

namespace amontons::test {

constexpr ElementKind kKinds[] = {ElementKind::T4, ElementKind::T10, ElementKind::H8};

struct TouchingBody {
    VolumeMesh mesh;
    ExternalSurface surface;

    void move(const Eigen::Isometry3d& motion)
    {
        for (Vec3& x : mesh.nodes)
            x = motion * x;
    }
};

inline TouchingBody with_surface(VolumeMesh mesh)
{
    TouchingBody body{std::move(mesh), {}};
    body.surface = extract_surface(body.mesh);
    return body;
}

inline TouchingBody box_body(ElementKind kind, const Vec3& low, const Vec3& high,
                             std::array<std::int32_t, 3> cells)
{
    SolidBoxOptions box;
    box.lowest = low;
    box.highest = high;
    box.cells = cells;
    box.grading = {1.7, 0.6, 1};
    box.kind = kind;
    return with_surface(make_solid_box(box));
}

inline SurfaceContacts contacts_of(const TouchingBody& slave, const TouchingBody& master,
                                   double reach)
{
    return mortar_contacts(slave.surface, slave.mesh.nodes, master.surface, master.mesh.nodes,
                           {reach});
}

inline Eigen::Isometry3d turn(double angle, const Vec3& axis, const Vec3& shift = Vec3::Zero())
{
    return Eigen::Translation3d(shift) * Eigen::AngleAxisd(angle, axis.normalized());
}

/// Somewhere far from the axes and the origin.
inline Eigen::Isometry3d anywhere()
{
    return turn(0.7, {0.3, -0.8, 0.5}, {1.5, -0.7, 2.2});
}

inline double total_area(const SurfaceContacts& contacts)
{
    double sum = 0;
    for (const SurfaceContact& c : contacts.contact)
        sum += c.area;
    return sum;
}

} // namespace amontons::test
