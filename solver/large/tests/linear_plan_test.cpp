#include "solver/large/linear_plan.hpp"

#include "mesh/generate/solid_box.hpp"
#include "mesh/tests/test_program.hpp"
#include "solver/linear/supernodal.hpp"
#include "solver/solid/assembly.hpp"

#include <doctest/doctest.h>
#include <numeric>

using namespace amontons;

namespace {

VolumeMesh box(std::array<std::int32_t, 3> cells)
{
    SolidBoxOptions options;
    options.cells = cells;
    options.kind = ElementKind::T4;
    return make_solid_box(options);
}

} // namespace

TEST_CASE("entries and operations of a factor are predicted from the graph of nodes" *
          doctest::test_suite("slow"))
{
    // Flat, so that a formula for cubes would be far off.
    const VolumeMesh mesh = box({100, 100, 2});
    REQUIRE(mesh.nodes.size() > 30000);
    const SolidPattern pattern = make_pattern(mesh);
    const SparseMatrix K = zero_matrix(pattern);
    std::vector<std::int32_t> node(std::size_t(K.cols()));
    for (std::size_t i = 0; i < node.size(); ++i)
        node[i] = std::int32_t(i / 3);
    SupernodalFactor factor;
    factor.analyse(K, node);
    const FactorCost cost = factor_cost(mesh, true);
    CHECK(cost.entries == doctest::Approx(double(factor.stored_entries()))
                              .epsilon(0.3)); // [regression] of our formula
    CHECK(cost.flops ==
          doctest::Approx(factor.flops()).epsilon(0.4)); // [regression] of our formula
    CHECK(cost.couplings == double(pattern.neighbour.size()));
    CHECK(factor_cost(mesh, false).flops > 3 * cost.flops); // [regression] of our formula
}

namespace {

/// A block of two sizes whose bottom is held.
struct PlannedBlock {
    VolumeMesh small = box({3, 3, 3}), large = box({36, 36, 36});
    std::vector<SolidSize> solids = std::vector<SolidSize>(1);

    PlannedBlock()
    {
        solids[0].name = "block";
        solids[0].mesh = &small;
        solids[0].rows = 30;
    }
    PlannedBlock(const PlannedBlock&) = delete;
    void take_large()
    {
        solids[0].mesh = &large;
        solids[0].material = {1e6, 0.3, 0};
        solids[0].held = [this] {
            std::vector<std::int32_t> dofs;
            for (std::size_t i = 0; i < large.nodes.size(); ++i)
                if (large.nodes[i].z() < 1e-9)
                    for (int axis = 0; axis < 3; ++axis)
                        dofs.push_back(std::int32_t(3 * i) + axis);
            return dofs;
        };
    }
    LinearPlan plan(const char* requested = "auto", bool dynamic = false, int steps = 1) const
    {
        return plan_linear(solids, requested, dynamic, steps, 1, false);
    }
};

} // namespace

TEST_CASE("the method that is chosen is possible and fits into memory or is refused with numbers" *
          doctest::test_suite("slow"))
{
    PlannedBlock block;
    LinearPlan plan = block.plan("auto", false, 10);
    CHECK(plan.taken == "direct");
    CHECK(plan.refusal.empty());
    CHECK_FALSE(plan.path("distributed")->possible);
    CHECK(plan.tried_iterations == 0); // not worth a trial
    block.take_large();
    plan = block.plan();
    CHECK(plan.path("direct")->memory > plan.path("iterative")->memory);
    block.solids[0].only_direct = "block is held by its contacts alone";
    CHECK(block.plan().taken == "direct");
    plan = block.plan("iterative");
    CHECK(plan.refusal.find("held by its contacts alone") != std::string::npos);
    plan = block.plan("distributed");
    CHECK_FALSE(plan.refusal.empty());
    block.solids[0].rows = 3e6; // W alone would take 2e14 bytes
    plan = block.plan("direct");
    CHECK(plan.refusal.find("GB") != std::string::npos);
    CHECK(plan.path("direct")->memory > plan.available);
}

TEST_CASE("a trial shows which method is the fastest" * doctest::test_suite("slow"))
{
    PlannedBlock block;
    block.take_large();
    LinearPlan plan = block.plan();
    if (!plan.path("iterative")->possible) {
        skip_test("the module petsc is not built (petsc-dev)");
        return;
    }
    CHECK(plan.tried_iterations > 0);
    CHECK(plan.taken == "iterative");
    // Multigrid crawls where a solid hardly changes its volume: a trial shows it.
    block.solids[0].material.poissons_ratio = 0.499;
    plan = block.plan();
    CHECK(plan.taken == "direct");
    CHECK(plan.tried_enough);
    // A trial that fails leaves the factor, and gives the reason.
    block.solids[0].held = []() -> std::vector<std::int32_t> {
        throw std::runtime_error("no sets");
    };
    plan = block.plan();
    CHECK(plan.taken == "direct");
    CHECK(plan.refusal.empty());
    CHECK(plan.path("iterative")->why == "a trial failed: no sets");
    // What nothing holds has its mass in a dynamic step's matrix: a trial shows that it helps.
    const double h = 1e-3;
    block.solids[0].held = [] { return std::vector<std::int32_t>(); };
    block.solids[0].material = {1e6, 0.3, 1000};
    block.solids[0].of_mass = 1;
    block.solids[0].of_stiffness = h * h;
    plan = block.plan("auto", true);
    CHECK(plan.taken == "iterative");
    CHECK(plan.tried_iterations > 0);
    CHECK(plan.tried_iterations < 20); // [regression] of our own multigrid options
    CHECK_FALSE(plan.tried_enough);
}

TEST_CASE("where a factor leads by little, a trial is made, of counted work" *
          doctest::test_suite("slow"))
{
    PlannedBlock block;
    block.take_large();
    block.solids[0].rows = 1000;
    // The more steps, the more a factor pays.
    bool tried = false;
    for (const int steps : {4, 8}) {
        const LinearPlan plan = block.plan("auto", false, steps);
        if (!plan.path("iterative")->possible) {
            skip_test("the module petsc is not built (petsc-dev)");
            return;
        }
        CAPTURE(steps);
        // A factor that leads by what iterations were found was tried against: they are no more
        // than what is assumed without a trial.
        const bool leads = plan.path("direct")->seconds < plan.path("iterative")->seconds;
        tried |= plan.taken == "direct" && leads && plan.tried_iterations > 0 &&
                 plan.tried_iterations <= 11;
        const LinearPlan again = block.plan("auto", false, steps);
        CHECK(again.taken == plan.taken);
        CHECK(again.tried_iterations == plan.tried_iterations);
    }
    CHECK(tried);
}
