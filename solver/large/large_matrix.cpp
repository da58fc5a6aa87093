#include "solver/large/large_matrix.hpp"

#include "solver/large/petsc/petsc_module.hpp"
#include "solver/module.hpp"

#include <cstdlib>
#include <fmt/format.h>
#include <memory>
#include <mutex>
#include <stdexcept>

namespace amontons {
namespace {

constexpr int kMessage = 400;

/// The open module's functions.
struct Petsc {
    Module module;
    AmontonsPetscNumber* ranks;
    AmontonsPetscCall* serve;
    AmontonsPetscCall* finish;
    AmontonsPetscMake* make;
    AmontonsPetscBlocks* blocks;
    AmontonsPetscSolve* solve;
    AmontonsPetscDrop* drop;
    AmontonsPetscPeak* peak;

    Petsc()
        : module("petsc")
        , ranks(module.function<AmontonsPetscNumber>("amontons_petsc_ranks"))
        , serve(module.function<AmontonsPetscCall>("amontons_petsc_serve"))
        , finish(module.function<AmontonsPetscCall>("amontons_petsc_finish"))
        , make(module.function<AmontonsPetscMake>("amontons_petsc_make"))
        , blocks(module.function<AmontonsPetscBlocks>("amontons_petsc_blocks"))
        , solve(module.function<AmontonsPetscSolve>("amontons_petsc_solve"))
        , drop(module.function<AmontonsPetscDrop>("amontons_petsc_drop"))
        , peak(module.function<AmontonsPetscPeak>("amontons_petsc_peak"))
    {
        char message[kMessage] = "";
        if (module.function<AmontonsPetscStart>("amontons_petsc_start")(message, kMessage))
            throw std::runtime_error(std::string("MPI and PETSc do not start: ") + message);
    }
};

// MPI begins once in a process and ends once: its one owner outlives every matrix. Both it and
// PETSc are for one thread at a time, matrices may be of many.
std::unique_ptr<Petsc> petsc;
std::mutex petsc_in_use;

Petsc& opened()
{
    const std::lock_guard lock(petsc_in_use);
    if (petsc) return *petsc;
    try {
        petsc = std::make_unique<Petsc>();
    } catch (const std::runtime_error& error) { // not there, or PETSc or MPI that it needs is not
        const int rank = mpirun_rank();
        throw InputError({{"libamontons-petsc.so", rank > 0 ? "rank " + std::to_string(rank) : "",
                           error.what(), "solver.linear \"direct\", without mpirun"}});
    }
    return *petsc;
}

int number(const char* name)
{
    const char* text = std::getenv(name);
    return text ? std::atoi(text) : -1;
}

void check(int failed, const char* message)
{
    if (failed) throw std::runtime_error(message);
}

std::string fault_of(const AmontonsLargeSolve& how)
{
    if (how.ending == kLargeNoMultigrid)
        return "the linear solver's multigrid preconditioner cannot be made";
    return fmt::format("the linear solver {} after {} iterations with a residual of {:.1e}",
                       how.ending == kLargeIterations ? "stops" : "breaks down", how.iterations,
                       how.reached);
}

/// MPI must end before the program does, whatever ends it.
struct AtExit {
    ~AtExit()
    {
        if (petsc) petsc->finish();
    }
} at_exit;

} // namespace

bool started_by_mpirun()
{
    return number("OMPI_COMM_WORLD_SIZE") > 1 || number("PMI_SIZE") > 1 ||
           (std::getenv("PMIX_RANK") && number("SLURM_NTASKS") > 1);
}

int mpirun_rank()
{
    for (const char* name : {"OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK"})
        if (number(name) >= 0) return number(name);
    return 0;
}

std::string parallel_fault()
{
    if (petsc) return "";
    try {
        const Module tried("petsc");
        return "";
    } catch (const std::runtime_error& error) {
        return error.what();
    }
}

ParallelRun::ParallelRun()
{
    if (started_by_mpirun()) opened();
}

ParallelRun::~ParallelRun()
{
    if (petsc) petsc->finish();
}

bool ParallelRun::served()
{
    if (!started_by_mpirun() || mpirun_rank() == 0) return false;
    petsc->serve();
    return true;
}

int parallel_ranks()
{
    const std::lock_guard lock(petsc_in_use);
    return petsc ? petsc->ranks() : 1;
}

double parallel_peak_memory()
{
    const std::lock_guard lock(petsc_in_use);
    return petsc ? petsc->peak() : 0;
}

LargeMatrix::LargeMatrix(const VolumeMesh& mesh, const SolidPattern& pattern,
                         const SolidMaterial& material, double of_mass, double of_stiffness,
                         std::span<const std::int32_t> held, bool on_all_ranks)
    : held_(held.begin(), held.end())
{
    static_assert(sizeof(Vec3) == 3 * sizeof(double));
    std::vector<AmontonsElements> blocks;
    for (const ElementBlock& b : mesh.blocks)
        blocks.push_back({int(b.kind), std::int64_t(b.size()), b.nodes.data()});
    AmontonsLargeMesh in{};
    in.nodes = std::int64_t(mesh.nodes.size());
    in.places = mesh.nodes.empty() ? nullptr : mesh.nodes.front().data();
    in.blocks = int(blocks.size());
    in.block = blocks.data();
    in.youngs_modulus = material.youngs_modulus;
    in.poisson_ratio = material.poissons_ratio;
    in.density = material.density;
    in.of_mass = of_mass;
    in.of_stiffness = of_stiffness;
    in.held_count = std::int64_t(held.size());
    in.held = held.data();
    in.ranks = on_all_ranks ? opened().ranks() : 1;
    in.graph_start = pattern.start.data();
    in.graph = pattern.neighbour.data();
    char message[kMessage] = "";
    const Petsc& module = opened();
    {
        const std::lock_guard lock(petsc_in_use);
        check(module.make(&in, &id_, message, kMessage), message);
    }
    set_blocks({}, true, true);
}

LargeMatrix::~LargeMatrix()
{
    if (id_ < 0 || !petsc) return;
    const std::lock_guard lock(petsc_in_use);
    petsc->drop(id_);
}

void LargeMatrix::set_blocks(const std::vector<Block>& blocks, bool symmetric, bool renew)
{
    if (blocks.empty() && plain_) return;
    plain_ = blocks.empty() && renew;
    std::vector<std::int32_t> node;
    std::vector<double> value;
    node.reserve(2 * blocks.size());
    value.reserve(9 * blocks.size());
    for (const Block& b : blocks) {
        node.insert(node.end(), {b.row, b.column});
        for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c)
                value.push_back(b.value(r, c));
    }
    const AmontonsLargeBlocks in{std::int64_t(blocks.size()), node.data(), value.data(), symmetric,
                                 renew};
    char message[kMessage] = "";
    const std::lock_guard lock(petsc_in_use);
    check(petsc->blocks(id_, &in, message, kMessage), message);
}

LargeMatrix::Result LargeMatrix::solve(Eigen::VectorXd& f, double tolerance, int most_iterations)
{
    // Before the ranks are called: all of them would end.
    if (!f.allFinite()) throw LinearFault("a linear system whose right-hand side is not finite");
    AmontonsLargeSolve how{tolerance, most_iterations, 0, 0, 0};
    char message[kMessage] = "";
    {
        const std::lock_guard lock(petsc_in_use);
        check(petsc->solve(id_, f.data(), &how, message, kMessage), message);
    }
    iterations_ += how.iterations;
    // Multigrid moves held ones by a rounding of the others.
    for (const std::int32_t dof : held_)
        f[dof] = 0;
    return {how.iterations, how.reached, how.ending == kLargeReached ? "" : fault_of(how)};
}

} // namespace amontons
