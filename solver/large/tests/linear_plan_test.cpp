#include "solver/large/linear_plan.hpp"

#include "mesh/generate/solid_box.hpp"
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

TEST_CASE("entries and operations of a factor are foretold from the graph of nodes")
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
    CHECK(cost.entries == doctest::Approx(double(factor.stored_entries())).epsilon(0.3));
    CHECK(cost.flops == doctest::Approx(factor.flops()).epsilon(0.4));
    CHECK(cost.couplings == double(pattern.neighbour.size()));
    CHECK(factor_cost(mesh, false).flops > 3 * cost.flops);
}

TEST_CASE("the way that is taken is possible and fits and is the quickest or else is refused with "
          "numbers")
{
    const VolumeMesh small = box({3, 3, 3}), large = box({36, 36, 36});
    std::vector<SolidSize> solids(1);
    solids[0].name = "block";
    solids[0].mesh = &small;
    solids[0].rows = 30;
    LinearPlan plan = plan_linear(solids, "auto", false, 10, 1, false);
    CHECK(plan.taken == "direct");
    CHECK(plan.refusal.empty());
    CHECK_FALSE(plan.path("distributed")->possible);
    CHECK(plan.tried_iterations == 0); // not worth a trial
    solids[0].mesh = &large;
    solids[0].material = {1e6, 0.3, 0};
    solids[0].held = [&] {
        std::vector<std::int32_t> dofs;
        for (std::size_t i = 0; i < large.nodes.size(); ++i)
            if (large.nodes[i].z() < 1e-9)
                for (int axis = 0; axis < 3; ++axis)
                    dofs.push_back(std::int32_t(3 * i) + axis);
        return dofs;
    };
    plan = plan_linear(solids, "auto", false, 1, 1, false);
    CHECK(plan.path("direct")->memory > plan.path("iterative")->memory);
    if (plan.path("iterative")->possible) { // the module is there
        CHECK(plan.tried_iterations > 0);
        CHECK(plan.taken == "iterative");
        // Multigrid crawls where a solid hardly changes its volume: a trial shows it.
        solids[0].material.poissons_ratio = 0.499;
        plan = plan_linear(solids, "auto", false, 1, 1, false);
        CHECK(plan.taken == "direct");
        CHECK(plan.tried_enough);
        // A trial that fails leaves the factor, and says why.
        solids[0].held = []() -> std::vector<std::int32_t> { throw std::runtime_error("no sets"); };
        plan = plan_linear(solids, "auto", false, 1, 1, false);
        CHECK(plan.taken == "direct");
        CHECK(plan.refusal.empty());
        CHECK(plan.path("iterative")->why == "a trial failed: no sets");
    }
    if (plan.path("iterative")->why.starts_with("a trial")) {
        // What nothing holds has its mass in a dynamic step's matrix: a trial shows that it helps.
        const double h = 1e-3;
        solids[0].held = [] { return std::vector<std::int32_t>(); };
        solids[0].material = {1e6, 0.3, 1000};
        solids[0].of_mass = 1;
        solids[0].of_stiffness = h * h;
        plan = plan_linear(solids, "auto", true, 1, 1, false);
        CHECK(plan.taken == "iterative");
        CHECK(plan.tried_iterations > 0);
        CHECK(plan.tried_iterations < 20);
        CHECK_FALSE(plan.tried_enough);
    }
    solids[0].only_direct = "block is held by its contacts alone";
    CHECK(plan_linear(solids, "auto", false, 1, 1, false).taken == "direct");
    plan = plan_linear(solids, "iterative", false, 1, 1, false);
    CHECK(plan.refusal.find("held by its contacts alone") != std::string::npos);
    plan = plan_linear(solids, "distributed", false, 1, 1, false);
    CHECK_FALSE(plan.refusal.empty());
    solids[0].rows = 3e6; // W alone would take 2e14 bytes
    plan = plan_linear(solids, "direct", false, 1, 1, false);
    CHECK(plan.refusal.find("GB") != std::string::npos);
    CHECK(plan.path("direct")->memory > plan.available);
}
