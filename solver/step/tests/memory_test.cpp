// What a run keeps of its matrices.

#include "mesh/generate/solid_box.hpp"
#include "mesh/tests/test_program.hpp"
#include "solver/linear/supernodal.hpp"
#include "solver/scene/read.hpp"
#include "solver/solid/assembly.hpp"
#include "solver/step/tests/keep.hpp"

#include <malloc.h>

using namespace amontons;

namespace {

/// Bytes of the heap that are in use; 0 where a sanitizer keeps the heap.
double in_use()
{
    const struct mallinfo2 heap = mallinfo2();
    return double(heap.uordblks) + double(heap.hblkhd);
}

} // namespace

TEST_CASE(
    "a linear solid keeps its stiffness and its factor and not what the factor was made from" *
    doctest::test_suite("slow"))
{
    if (in_use() == 0) {
        skip_test("a sanitizer keeps the heap: it does not state how much is in use");
        return;
    }
    const Scene scene = parse_scene(R"({"schema": 1, "bodies": {"block": {"kind": "solid",
        "mesh": {"generate": "box", "size": [1, 1, 1], "cells": [16, 16, 16], "element": "T4"},
        "youngs_modulus": 1e6, "poisson_ratio": 0.3,
        "hold": [{"set": "z_min"}, {"set": "z_max", "z": [[0, 0], [1, 0.01]]}]}},
        "time": {"step": 1, "end": 1}, "output": {"picture": false, "plots": false}})",
                                    "test.json", {});
    SolidBoxOptions box;
    box.cells = {16, 16, 16};
    const VolumeMesh mesh = make_solid_box(box);
    const SparseMatrix K = zero_matrix(make_pattern(mesh));
    std::vector<std::int32_t> node(std::size_t(K.rows()));
    for (std::size_t dof = 0; dof < node.size(); ++dof)
        node[dof] = std::int32_t(dof / 3);
    SupernodalFactor whole; // the solid's has a few rows less
    whole.analyse(K, node);
    const double before = in_use();
    const std::unique_ptr<Simulation> simulation = make_simulation(scene, {});
    Keep keep;
    const std::atomic<bool> never{false};
    REQUIRE(simulation->run(keep, never).status == "done");
    const double factor = 8 * double(whole.stored_entries()), matrix = 12 * double(K.nonZeros()),
                 held = in_use() - before;
    CHECK(held > factor / 2);
    CHECK(held < factor + matrix); // whole: with held rows; what it was made from: twice the matrix
}
