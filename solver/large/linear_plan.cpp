#include "solver/large/linear_plan.hpp"

#include "mesh/base/metis_lock.hpp"
#include "mesh/volume_mesh.hpp"
#include "solver/large/large_matrix.hpp"
#include "solver/linear/supernodal.hpp"
#include "solver/module.hpp"
#include "solver/solid/assembly.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fmt/format.h>
#include <memory>
#include <metis.h>
#include <new>
#include <numeric>
#include <sys/resource.h>

namespace amontons {
namespace {

// Measured on two cores of a server, one thread: docs/theory/large.md.
constexpr double kProgram = 20e6;                 // [bytes]
constexpr double kPerNode = 1500;                 // states, fields, detection [bytes]
constexpr double kPerElement = 350;               // mesh, pattern [bytes]
constexpr double kEntry = 12;                     // of a sparse matrix: number and column [bytes]
constexpr double kDirectMatrices = 3;             // K, its free part, what CHOLMOD takes
constexpr double kIterativeMatrices = 3.3;        // K, A, its copy while it is made, multigrid
constexpr double kDense = 3, kDenseInMotion = 20; // W, its parts and factors
constexpr double kVectors = 30;                   // of all unknowns
constexpr double kKrylovVectors = 60;             // more with friction: GMRES
constexpr double kOneRank = 38e6;                 // MPI and PETSc themselves [bytes]
constexpr double kFactorRate = 30e9;              // operations of a factor [1/s]
constexpr double kSolveRate = 1.2e9;              // entries of L in one solve [1/s]
constexpr double kDenseRate = 4.5e9;              // of W and its Newton steps [1/s]
constexpr double kAssembly = 4e-6;                // of an element [s]
// Of a quasi-static step with contact: of a coupling of nodes, and of an iteration that one solve
// takes (of some 5 Newton steps, and the certificate's solves) [s].
constexpr double kIterativeStep = 5.4e-7;
constexpr double kColumnShare = 0.15;    // of that: a solve for a column of W
constexpr double kIterations = 11;       // of one solve, where it was not tried
constexpr double kDynamicIterations = 3; // the same: better conditioned
/// Steps in motion solve more often than quasi-static ones (measured: 0.9 and 3.6 times).
constexpr double kDynamicSolves = 2.5;
/// In motion contacts appear and disappear, and a step begins with the forces of the last one: W
/// and its Newton steps take less than at rest (measured: 0.2 to 0.5).
constexpr double kDenseShareInMotion = 1.0 / 3;
/// In doubt a factor is taken: iterations vary more from what is predicted.
constexpr double kDoubt = 1.25;
constexpr double kTrialTolerance = 1e-3; // a Newton step's
/// A trial is also made where the factor is predicted to be faster by less than this, and the trial
/// costs little beside it.
constexpr double kCloseCall = 3;
constexpr double kTrial = 2.7e-6; // of a coupling: MPI, PETSc, matrix, hierarchy, iterations [s]
constexpr double kTrialShare = 1. / 8; // of what the factor's way takes
constexpr double kParallel = 0.85;     // of each rank beyond the first
constexpr double kKibi = 1024;
constexpr double kMemoryShare = 0.95; // of what is free: a process needs room to breathe
/// Below, the cost of factors is negligible, and so must be that of their prediction.
constexpr std::size_t kFewNodes = 30000, kVeryFewNodes = 4000;

/// The number after `key` in a file; -1 if it is not there.
double line_of(const char* file, const char* key)
{
    const std::unique_ptr<FILE, int (*)(FILE*)> in(std::fopen(file, "r"), std::fclose);
    char line[256];
    while (in && std::fgets(line, sizeof line, in.get()))
        if (std::strncmp(line, key, std::strlen(key)) == 0)
            return std::strtod(line + std::strlen(key), nullptr);
    return -1;
}

double number_in(const char* file)
{
    const std::unique_ptr<FILE, int (*)(FILE*)> in(std::fopen(file, "r"), std::fclose);
    char line[64];
    if (!in || !std::fgets(line, sizeof line, in.get())) return -1;
    char* end = nullptr;
    const double value = std::strtod(line, &end);
    return end == line ? -1 : value; // "max": none
}

std::string gigabytes(double bytes)
{
    return fmt::format("{:.3g} GB", bytes / 1e9);
}

/// METIS's order of the nodes, by one seed: a factor's own is the best of some.
std::vector<std::int32_t> one_dissection(const SolidPattern& pattern)
{
    std::vector<idx_t> start{0}, graph;
    graph.reserve(pattern.neighbour.size());
    for (std::size_t i = 0; i + 1 < pattern.start.size(); ++i) {
        for (std::int32_t k = pattern.start[i]; k < pattern.start[i + 1]; ++k)
            if (pattern.neighbour[std::size_t(k)] != std::int32_t(i))
                graph.push_back(pattern.neighbour[std::size_t(k)]);
        start.push_back(idx_t(graph.size()));
    }
    idx_t nodes = idx_t(start.size()) - 1;
    std::vector<idx_t> order(std::size_t(nodes), 0), place(std::size_t(nodes), 0);
    idx_t options[METIS_NOPTIONS];
    METIS_SetDefaultOptions(options);
    options[METIS_OPTION_SEED] = 1;
    const std::lock_guard lock(metis_mutex());
    if (METIS_NodeND(&nodes, start.data(), graph.data(), nullptr, options, order.data(),
                     place.data()) != METIS_OK)
        throw std::bad_alloc();
    return {order.begin(), order.end()};
}

/// Iterations of one solve with multigrid: they depend on the mesh's grading, on its elements and
/// on Poisson's ratio, from 8 to hundreds, and no formula predicts them.
/// @param most  larger numbers are not counted: then this one is returned
/// @throws std::runtime_error  if it breaks down
int tried_iterations(const SolidSize& s, int most, bool on_all_ranks)
{
    const std::vector<std::int32_t> held = s.held();
    LargeMatrix A(*s.mesh, make_pattern(*s.mesh), s.material, s.of_mass, s.of_stiffness, held,
                  on_all_ranks);
    Eigen::VectorXd f = Eigen::VectorXd::Ones(3 * Eigen::Index(s.mesh->nodes.size()));
    for (const std::int32_t dof : held)
        f[dof] = 0;
    const LargeMatrix::Result done = A.solve(f, kTrialTolerance, most);
    if (!done.fault.empty() && done.iterations < most) throw std::runtime_error(done.fault);
    return done.iterations;
}

/// @param few  nodes below which it is that of a cube
FactorCost cost_from(const VolumeMesh& mesh, bool analyse, std::size_t few)
{
    FactorCost cost;
    const double n = double(mesh.nodes.size());
    if (!analyse || mesh.nodes.size() < few) { // what cubes need, about
        double per_node = 15;
        for (const ElementBlock& b : mesh.blocks)
            per_node = std::max(per_node, b.kind == ElementKind::T4 ? 15.0 : 28.0);
        cost.couplings = per_node * n;
        cost.entries = 9 * 11 * std::pow(n, 4.0 / 3);
        cost.flops = 27 * 6 * n * n;
        return cost;
    }
    // The graph of nodes as a matrix: each entry of its factor is a block of 3 x 3.
    const SolidPattern pattern = make_pattern(mesh);
    const auto nodes = Eigen::Index(mesh.nodes.size());
    const std::vector<double> ones(pattern.neighbour.size(), 1);
    const Eigen::Map<const Eigen::SparseMatrix<double>> graph(
        nodes, nodes, Eigen::Index(pattern.neighbour.size()), pattern.start.data(),
        pattern.neighbour.data(), ones.data());
    std::vector<std::int32_t> node(mesh.nodes.size());
    std::iota(node.begin(), node.end(), 0);
    SupernodalOptions options;
    options.relax = {5, 21, 64};
    options.widest = 170;
    options.node_order = one_dissection(pattern);
    SupernodalFactor factor;
    factor.analyse(Eigen::SparseMatrix<double>(graph), node, options);
    cost.couplings = double(pattern.neighbour.size());
    cost.entries = 9 * double(factor.stored_entries());
    cost.flops = 27 * factor.flops();
    return cost;
}

int ranks_on_this_machine(int ranks)
{
    const char* local = std::getenv("OMPI_COMM_WORLD_LOCAL_SIZE");
    return local && std::atoi(local) > 0 ? std::min(std::atoi(local), ranks) : ranks;
}

} // namespace

const LinearPath* LinearPlan::path(const std::string& name) const
{
    const auto at = std::ranges::find(paths, name, &LinearPath::name);
    return at == paths.end() ? nullptr : &*at;
}

double available_memory()
{
    double least = std::numeric_limits<double>::infinity();
    const auto limit = [&](double value) {
        if (value >= 0) least = std::min(least, value);
    };
    limit(kKibi * line_of("/proc/meminfo", "MemAvailable:"));
    const double most = number_in("/sys/fs/cgroup/memory.max"),
                 now = number_in("/sys/fs/cgroup/memory.current");
    // What files have left in the cache is freed on demand.
    const double cache = std::max(0.0, line_of("/sys/fs/cgroup/memory.stat", "inactive_file "));
    if (most >= 0 && now >= 0) limit(std::max(0.0, most - std::max(0.0, now - cache)));
    rlimit own{};
    if (getrlimit(RLIMIT_AS, &own) == 0 && own.rlim_cur != RLIM_INFINITY)
        limit(
            std::max(0.0, double(own.rlim_cur) - kKibi * line_of("/proc/self/status", "VmSize:")));
    return least;
}

double mesh_memory(double nodes, double elements)
{
    return kProgram + kPerNode * nodes + kPerElement * elements;
}

FactorCost factor_cost(const VolumeMesh& mesh, bool analyse)
{
    return cost_from(mesh, analyse, kFewNodes);
}

LinearPlan plan_linear(const std::vector<SolidSize>& solids, const std::string& requested,
                       bool dynamic, double steps, int ranks, bool analyse)
{
    LinearPlan plan;
    plan.requested = requested;
    plan.available = available_memory();
    LinearPath direct, iterative, distributed;
    direct.name = "direct";
    iterative.name = "iterative";
    distributed.name = "distributed";
    const auto impossible = [](LinearPath& path, const std::string& why) {
        if (path.possible) path.why = why;
        path.possible = false;
    };
    direct.memory = iterative.memory = kProgram;

    // ---- Memory and operations of each solid
    double trial = 0;     // seconds that one takes
    double largest = 0;   // memory while the largest factor is made counts once
    double iterating = 0; // of `iterative.seconds`: a single iteration in each solve
    for (const SolidSize& s : solids) {
        const double nodes = double(s.mesh->nodes.size()),
                     elements = double(element_count(*s.mesh));
        const FactorCost cost =
            factor_cost(*s.mesh, analyse || requested == "auto" || requested == "direct");
        const double matrix = 9 * kEntry * cost.couplings;
        const double mesh = kPerNode * nodes + kPerElement * elements;
        const double dense = (dynamic ? kDenseInMotion : kDense) * 8 * s.rows * s.rows;
        // `check` has the time for a closer analysis, the choice does not.
        const double entries =
            analyse ? cost_from(*s.mesh, true, kVeryFewNodes).entries : cost.entries;
        direct.memory += mesh + matrix + 8 * entries + dense;
        largest = std::max(largest, (kDirectMatrices - 1) * matrix);
        direct.seconds += kAssembly * elements + cost.flops / kFactorRate +
                          (steps + 1) * (4 * cost.entries / kSolveRate +
                                         (dynamic ? kDenseShareInMotion : 1) *
                                             (s.rows * s.rows * s.rows) / kDenseRate);
        if (cost.entries > 2147483647.0)
            impossible(direct, fmt::format("the factor of {} has {:.2g} entries, more than 2^31",
                                           s.name, cost.entries));
        iterative.memory += mesh + kIterativeMatrices * matrix +
                            24 * nodes * (kVectors + (s.friction ? kKrylovVectors : 0));
        const double step = kIterativeStep * (dynamic ? kDynamicSolves : 1) * cost.couplings;
        iterative.seconds += 2 * kAssembly * elements;
        trial += kTrial * cost.couplings;
        iterating += (steps + 1) * step;
        if (s.columns) {
            iterative.memory += dense;
            iterating += (steps + 1) * s.rows * kColumnShare * step;
        }
        if (!s.only_direct.empty()) {
            impossible(iterative, s.only_direct);
            impossible(distributed, s.only_direct);
        }
    }

    // ---- Times, and the quickest method that fits
    direct.memory += largest;
    if (find_module("petsc").empty())
        for (LinearPath* path : {&iterative, &distributed})
            impossible(*path, "the module libamontons-petsc.so is not installed");
    if (ranks < 2) impossible(distributed, "not started by mpirun");
    direct.memory_here = direct.memory;
    iterative.memory += kOneRank;
    iterative.memory_here = iterative.memory;
    const int all = std::max(ranks, 1), here = ranks_on_this_machine(all);
    distributed.memory = iterative.memory + (all - 1) * kOneRank;
    distributed.memory_here = distributed.memory * double(here) / all;
    if (direct.why.empty()) direct.why = "CHOLMOD's factor, W by its tree";
    if (iterative.why.empty())
        iterative.why = "Krylov's methods with algebraic multigrid, contact without W";
    if (distributed.why.empty()) distributed.why = fmt::format("the same on {} ranks", all);
    const double at_once = 1 + kParallel * (all - 1), assembling = iterative.seconds;
    const auto take_time = [&](double iterations) {
        iterative.seconds = assembling + iterations * iterating;
        distributed.seconds = iterative.seconds / at_once;
        plan.paths = {direct, iterative, distributed};
    };
    take_time(dynamic ? kDynamicIterations : kIterations);

    const double room = kMemoryShare * plan.available;
    const auto fits = [&](const LinearPath& p) { return p.memory_here <= room; };
    const auto choose = [&] {
        plan.taken = requested;
        plan.why = "requested";
        if (requested != "auto") return;
        const LinearPath* best = nullptr;
        int could = 0;
        for (const LinearPath& p : plan.paths) {
            could += p.possible;
            const double doubt = best && best->name == "direct" ? kDoubt : 1;
            if (p.possible && fits(p) && (!best || doubt * p.seconds < best->seconds)) best = &p;
        }
        plan.taken = best ? best->name : "direct";
        plan.why = !best                       ? "no path fits"
                   : could == 1                ? "the only one that is possible"
                   : !fits(plan.paths.front()) ? "the quickest that fits into the memory"
                   : plan.tried_iterations > 0
                       ? fmt::format("the quickest by a trial: a solve takes {}{} iterations",
                                     plan.tried_enough ? "more than " : "", plan.tried_iterations)
                       : "the quickest by prediction";
    };
    choose();

    // ---- Modules; one solve where the choice is close
    // Whether the module can be loaded is tested only where it would be used.
    if (plan.taken != "direct" && plan.path(plan.taken)->possible)
        if (const std::string fault = parallel_fault(); !fault.empty()) {
            for (LinearPath& p : plan.paths)
                if (p.name != "direct") impossible(p, fault);
            choose();
        }
    // Where a factor is the other choice, one solve is tried before it is turned down; and where
    // the two are close, before it is taken. It is ended when it has taken the iterations that
    // would make it the slower way: counted, not timed, so that a run that is repeated or resumed
    // passes the same way.
    const std::string other = ranks < 2 ? "iterative" : "distributed";
    const LinearPath& way = *plan.path(other);
    const bool close_call = plan.taken == "direct" && way.possible && fits(way) &&
                            way.seconds < kCloseCall * direct.seconds &&
                            trial < kTrialShare * direct.seconds && parallel_fault().empty();
    if (requested == "auto" && direct.possible && fits(direct) &&
        (plan.taken != "direct" || close_call)) {
        const std::string tried = plan.taken != "direct" ? plan.taken : other;
        const double enough =
            (direct.seconds * (tried == "distributed" ? at_once : 1) - assembling) /
            iterating; // for a factor to be quicker
        const int most = int(std::clamp(enough, 1.0, 1e6)) + 1;
        const std::size_t most_nodes = std::ranges::max(solids, {}, [](const SolidSize& s) {
                                           return s.mesh->nodes.size();
                                       }).mesh->nodes.size();
        try {
            for (const SolidSize& s : solids)
                if (2 * s.mesh->nodes.size() > most_nodes && plan.tried_iterations < most)
                    plan.tried_iterations = std::max(
                        plan.tried_iterations, tried_iterations(s, most, tried == "distributed"));
            plan.tried_enough = plan.tried_iterations >= most;
            take_time(plan.tried_iterations);
        } catch (const std::exception& fault) { // the factor is there, and may specify more
            for (LinearPath& p : plan.paths)
                if (p.name != "direct")
                    impossible(p, std::string("a trial failed: ") + fault.what());
        }
        choose();
    }

    // ---- Refusal
    const LinearPath& taken = *plan.path(plan.taken);
    if (!taken.possible)
        plan.refusal = fmt::format("{}: {}", taken.name, taken.why);
    else if (!fits(taken)) {
        for (const LinearPath& p : plan.paths)
            if (p.possible && (requested == "auto" || p.name == requested))
                plan.refusal += fmt::format("{}{} needs {}", plan.refusal.empty() ? "" : ", ",
                                            p.name, gigabytes(p.memory_here));
        plan.refusal +=
            fmt::format(" of memory by prediction, {} are free", gigabytes(plan.available));
    }
    return plan;
}

} // namespace amontons
