#include "mesh/volume_check.hpp"

#include "mesh/tests/sample_surfaces.hpp"
#include "mesh/tests/sample_volumes.hpp"

#include <algorithm>
#include <doctest/doctest.h>
#include <limits>

using namespace amontons;

namespace {

std::string errors(const VolumeMesh& mesh)
{
    const auto all = errors_of(check_volume(mesh), mesh, "f");
    return all.empty() ? "" : InputError(all).what();
}

std::string warnings(const VolumeMesh& mesh)
{
    const auto all = warnings_of(check_volume(mesh), mesh, "f");
    return all.empty() ? "" : InputError(all).what();
}

bool contains(const std::string& text, const char* what)
{
    return text.find(what) != std::string::npos;
}

} // namespace

TEST_CASE("every wrong order of an element's corners is found")
{
    for (const ElementKind kind : kAllKinds) {
        CAPTURE(shape_of(kind).name);
        const VolumeMesh good = sample_box(kind);
        const auto corners = static_cast<std::size_t>(shape_of(kind).corners);
        for (std::size_t i = 0; i < corners; ++i)
            for (std::size_t j = i + 1; j < corners; ++j) {
                VolumeMesh bad = good;
                std::swap(bad.blocks[0].nodes[i], bad.blocks[0].nodes[j]);
                CHECK(contains(errors(bad), "element 1 ("));
                CHECK(contains(errors(bad), "an inverted element"));
            }
    }
}

TEST_CASE("a wrong order of a T10's middle nodes is found and an even turn of a T4 is none")
{
    const VolumeMesh good = sample_box(ElementKind::T10);
    for (std::size_t i = 4; i < 10; ++i)
        for (std::size_t j = i + 1; j < 10; ++j) {
            VolumeMesh bad = good;
            std::swap(bad.blocks[0].nodes[i], bad.blocks[0].nodes[j]);
            CHECK(contains(errors(bad), "an inverted element"));
        }
    VolumeMesh turned = sample_box(ElementKind::T4);
    std::rotate(turned.blocks[0].nodes.begin(), turned.blocks[0].nodes.begin() + 1,
                turned.blocks[0].nodes.begin() + 3);
    CHECK(errors(turned).empty());
}

TEST_CASE("messages use the file's numbers and list the first of many")
{
    VolumeMesh mesh = sample_box(ElementKind::T4);
    for (std::size_t e = 0; e < element_count(mesh); ++e) {
        mesh.element_labels.push_back(static_cast<std::int64_t>(1000 + e));
        std::swap(mesh.blocks[0].nodes[4 * e], mesh.blocks[0].nodes[4 * e + 1]);
    }
    const std::string text = errors(mesh);
    CHECK(contains(text, "f: element 1000 (T4 at ("));
    CHECK(contains(text, "f: found 141 more of this"));
    CHECK(std::count(text.begin(), text.end(), '\n') == 3);
}

TEST_CASE("nodes: not finite or unreferenced or at the same place")
{
    VolumeMesh mesh = sample_box(ElementKind::H8);
    mesh.nodes.emplace_back(7, 8, 9);
    mesh.nodes.push_back(mesh.nodes[3] + Vec3(0, 0, 1e-10));
    mesh.node_labels = {};
    CHECK(errors(mesh).empty());
    CHECK(warnings(mesh) ==
          "f: node 61: found a node of no element at (7, 8, 9), allowed: nodes of elements\n"
          "f: node 62: found a node of no element at (1, 2, 0.5000000001), allowed: nodes of "
          "elements\n"
          "f: node 62: found the place of node 4, (1, 2, 0.5000000001), allowed: one node at a "
          "place, unless bodies may separate there");
    mesh.nodes[5][1] = std::numeric_limits<double>::quiet_NaN();
    CHECK(contains(errors(mesh), "f: node 6: found coordinates ("));
}

TEST_CASE("elements: twice or with a node twice or three at a face or on the same side of a face")
{
    VolumeMesh twice = sample_box(ElementKind::T4);
    auto& nodes = twice.blocks[0].nodes;
    nodes.insert(nodes.end(), nodes.begin(), nodes.begin() + 4);
    CHECK(contains(errors(twice), "allowed: one or two elements at a face"));
    CHECK(contains(errors(twice), "allowed: elements on both sides of it"));

    VolumeMesh collapsed = sample_box(ElementKind::H8);
    collapsed.blocks[0].nodes[1] = collapsed.blocks[0].nodes[0];
    CHECK(contains(errors(collapsed), "a node that is used twice"));
}

TEST_CASE("two cubes that share an edge alone are no manifold and a face in common is fine")
{
    VolumeMesh mesh = make_solid_box({{0, 0, 0}, {2, 2, 1}, {2, 2, 1}, {1, 1, 1}, ElementKind::H8});
    auto& nodes = mesh.blocks[0].nodes;
    nodes.erase(nodes.begin() + 8, nodes.begin() + 24); // the diagonal neighbours stay
    mesh.element_sets.clear();
    mesh.face_sets.clear();
    CHECK(contains(errors(mesh), "edge (1, 1, 0) (1, 1, 1): found 4 faces of the surface"));
}

TEST_CASE("two cubes that share a corner alone are a joint and whole boxes have none")
{
    VolumeMesh mesh = make_solid_box({{0, 0, 0}, {2, 2, 2}, {2, 2, 2}, {1, 1, 1}, ElementKind::H8});
    CHECK(check_volume(mesh).pinched.empty());
    auto& nodes = mesh.blocks[0].nodes;
    nodes.erase(nodes.begin() + 8, nodes.end() - 8); // the ends of a diagonal stay
    mesh.element_sets.clear();
    mesh.face_sets.clear();
    CHECK(check_volume(mesh).pinched == std::vector<std::int32_t>{13});
    CHECK(errors(mesh) == "f: node 14: found elements that share this node only, (1, 1, 1), "
                          "allowed: elements that share an edge or a face");
    for (const ElementKind kind : kAllKinds)
        CHECK(check_volume(sample_box(kind)).pinched.empty());
}

TEST_CASE("a node that one element has for itself tears the surface and is named as the reason")
{
    VolumeMesh mesh = make_solid_box({{0, 0, 0}, {2, 2, 2}, {2, 2, 2}, {1, 1, 1}, ElementKind::H8});
    mesh.element_sets.clear();
    mesh.face_sets.clear();
    mesh.nodes.push_back(mesh.nodes[13]); // the middle
    for (std::size_t i = 56; i < 64; ++i)
        if (mesh.blocks[0].nodes[i] == 13) mesh.blocks[0].nodes[i] = 27;
    CHECK(contains(errors(mesh), "4 faces of the surface"));
    CHECK(contains(errors(mesh),
                   "f: node 28: found the place of node 14, (1, 1, 1), allowed: one node"));
    CHECK(!contains(warnings(mesh), "node 28"));
}

TEST_CASE("slivers are warned of with their shape and the threshold")
{
    VolumeMesh mesh;
    mesh.nodes = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5, 0.5, 1e-3}};
    mesh.blocks = {{ElementKind::T4, {0, 1, 2, 3}}};
    CHECK(errors(mesh).empty());
    CHECK(contains(warnings(mesh), "a sliver of shape 0.0137"));
    CHECK(contains(warnings(mesh), "allowed: shape >= 0.05"));
    VolumeCheckOptions lenient;
    lenient.sliver = 0.001;
    CHECK(check_volume(mesh, lenient).slivers.empty());
}

TEST_CASE(
    "a mesh in millimetres is suspected and its size reported and sets without members or name too")
{
    VolumeMesh mesh = make_solid_ball({{0, 0, 0}, 10, 4, ElementKind::H8});
    CHECK(contains(warnings(mesh), "a size of 20 x 20 x 20 m"));
    CHECK(contains(warnings(mesh), "0.001"));
    for (Vec3& x : mesh.nodes)
        x *= 1e-3;
    CHECK(warnings(mesh).empty());
    mesh.node_sets = {{"", {0}}, {"nothing", {}}};
    CHECK(warnings(mesh) == "f: node set \"nothing\": found nothing in it, allowed: members\n"
                            "f: node set 1: found no name, allowed: a name");
}
