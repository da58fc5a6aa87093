#pragma once

#include "mesh/generate/solid_box.hpp"
#include "mesh/tests/sample_volumes.hpp"
#include "mesh/volume_check.hpp"

#include <doctest/doctest.h>

// What every format of solids must keep.

namespace amontons {

/// Two bodies of three kinds with sets of every type that overlap, are empty, or lie inside.
inline VolumeMesh mesh_with_sets()
{
    VolumeMesh mesh = sample_box(ElementKind::H8);
    const auto append = [&](VolumeMesh other, double x) {
        const auto n = static_cast<std::int32_t>(mesh.nodes.size());
        for (Vec3& p : other.nodes)
            mesh.nodes.push_back(p + Vec3(x, 0, 0));
        for (std::int32_t& i : other.blocks[0].nodes)
            i += n;
        mesh.blocks.insert(mesh.blocks.begin(), other.blocks[0]);
    };
    append(sample_box(ElementKind::T10), 5);
    append(sample_box(ElementKind::T4), 10);
    const auto e = static_cast<std::int32_t>(element_count(mesh));
    mesh.element_sets = {{"volume", {}}, {"soft part", {1, 2, 3, 200, e - 1}}, {"7", {2, 3, 160}}};
    for (std::int32_t i = 0; i < e; i += 2)
        mesh.element_sets[0].members.push_back(i);
    const ExternalSurface surface = extract_surface(mesh);
    mesh.face_sets = {{"skin", surface.faces}, {"spot", {}}, {"inner", {}}};
    for (std::size_t f = 0; f < surface.faces.size(); f += 7)
        mesh.face_sets[1].members.push_back(surface.faces[f]);
    // Faces inside a body, of one element or of both.
    for (std::int32_t i = 0; i < e; i += 5)
        for (std::int32_t f = 0; f < 2; ++f)
            mesh.face_sets[2].members.push_back({i, f});
    mesh.node_sets = {{"fixed", {0, 5, 6, 7, 59}}, {"8", {1, 5, 70}}};
    return mesh;
}

inline void check_same(const VolumeMesh& a, const VolumeMesh& b)
{
    CHECK(a.nodes == b.nodes);
    REQUIRE(a.blocks.size() == b.blocks.size());
    for (std::size_t k = 0; k < a.blocks.size(); ++k) {
        CHECK(a.blocks[k].kind == b.blocks[k].kind);
        CHECK(a.blocks[k].nodes == b.blocks[k].nodes);
    }
    const auto by_name = [](auto sets) {
        std::sort(sets.begin(), sets.end(), [](auto& x, auto& y) { return x.name < y.name; });
        return sets;
    };
    CHECK(by_name(a.node_sets) == by_name(b.node_sets));
    CHECK(by_name(a.element_sets) == by_name(b.element_sets));
    CHECK(by_name(a.face_sets) == by_name(b.face_sets));
}

} // namespace amontons
