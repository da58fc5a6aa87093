// libamontons-petsc.so: see petsc_module.hpp.

#include "solver/large/petsc/petsc_module.hpp"

#include "solver/large/petsc/part.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <exception>
#include <limits>
#include <memory>
#include <petscksp.h>
#include <stdexcept>
#include <string>
#include <sys/resource.h>
#include <unistd.h>

#define EXPORT extern "C" __attribute__((visibility("default")))

namespace amontons {
namespace {

constexpr int kRestart = 60;           // of GMRES: its vectors are the largest part of its memory
constexpr useconds_t kIdleSleep = 200; // of a rank that waits [us]: rank 0 may need the core
constexpr PetscInt kReached = 20;      // residuals below this times the smallest double are 0

enum class Work : int { make, blocks, solve, drop, peak, finish };

/// Orders of rank 0 to all.
struct Order {
    int work = 0, id = 0, flags = 0, most = 0;
    std::int64_t count = 0;
    double tolerance = 0;
};

struct LargeSolid {
    std::int32_t first = 0, own = 0;
    Mat A = nullptr;
    Vec f = nullptr, y = nullptr;
    KSP solver = nullptr;
    bool relaxed = false;
    std::vector<std::int32_t> added_node; // to what blocks of own rows blocks() has added
    std::vector<double> before;           // and what was there, 9 of each
    // Rank 0:
    std::vector<std::int32_t> number; ///< new number of each node
    std::vector<int> counts, starts;  ///< of each rank, in doubles
    std::vector<double> whole;        ///< of all ranks, in the new order
};

struct World {
    int rank = 0, ranks = 1;
    bool started = false;
    std::vector<std::unique_ptr<LargeSolid>> solids;
};
/// Never destroyed: the program's statics, which end MPI, outlive this module's.
World& world = *new World;

/// PETSc's code as an exception.
void check(PetscErrorCode code)
{
    if (!code) return;
    const char* text = nullptr;
    PetscErrorMessage(code, &text, nullptr);
    if (code == PETSC_ERR_MEM) throw std::bad_alloc();
    throw std::runtime_error(std::string("PETSc: ") + (text ? text : "unknown error"));
}

void check_size(std::int64_t count)
{
    if (count > 2147483647) throw std::runtime_error("a message of more than 2^31 numbers");
}

template <class T> MPI_Datatype type_of();
template <> MPI_Datatype type_of<std::int32_t>()
{
    return MPI_INT32_T;
}
template <> MPI_Datatype type_of<double>()
{
    return MPI_DOUBLE;
}

template <class T> void send(const std::vector<T>& v, int rank)
{
    const std::int64_t size = std::int64_t(v.size());
    check_size(size);
    MPI_Send(&size, 1, MPI_INT64_T, rank, 0, MPI_COMM_WORLD);
    MPI_Send(v.data(), int(size), type_of<T>(), rank, 0, MPI_COMM_WORLD);
}

template <class T> void receive(std::vector<T>& v)
{
    std::int64_t size = 0;
    MPI_Recv(&size, 1, MPI_INT64_T, 0, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    v.resize(std::size_t(size));
    MPI_Recv(v.data(), int(size), type_of<T>(), 0, 0, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
}

void send(const Part& p, int rank)
{
    send(std::vector<std::int32_t>{p.all_nodes, p.first, p.own}, rank);
    for (const auto* v : {&p.number, &p.held, &p.kind, &p.count, &p.nodes})
        send(*v, rank);
    send(p.places, rank);
    send(p.material, rank);
}

Part receive_part()
{
    Part p;
    std::vector<std::int32_t> sizes;
    receive(sizes);
    p.all_nodes = sizes[0];
    p.first = sizes[1];
    p.own = sizes[2];
    for (auto* v : {&p.number, &p.held, &p.kind, &p.count, &p.nodes})
        receive(*v);
    receive(p.places);
    receive(p.material);
    return p;
}

double own_peak()
{
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return 1024.0 * double(usage.ru_maxrss);
}

/// Rank 0 sends the others the next command.
void announce(Work work, Order order = {})
{
    if (world.ranks == 1) return;
    order.work = int(work);
    MPI_Request request;
    MPI_Ibcast(&order, sizeof order, MPI_BYTE, 0, MPI_COMM_WORLD, &request);
    MPI_Wait(&request, MPI_STATUS_IGNORE);
}

/// The others wait for it without taking the core.
Order listen()
{
    Order order;
    MPI_Request request;
    MPI_Ibcast(&order, sizeof order, MPI_BYTE, 0, MPI_COMM_WORLD, &request);
    for (int done = 0;;) {
        MPI_Test(&request, &done, MPI_STATUS_IGNORE);
        if (done) return order;
        ::usleep(kIdleSleep);
    }
}

// ---- what all ranks do together

void set_up_solver(LargeSolid& s)
{
    check(KSPCreate(PETSC_COMM_WORLD, &s.solver));
    check(KSPSetOptionsPrefix(s.solver, "amontons_"));
    check(KSPSetNormType(s.solver, KSP_NORM_DEFAULT));
    PC pc = nullptr;
    check(KSPGetPC(s.solver, &pc));
    check(PCSetType(pc, PCGAMG));
    check(PCGAMGSetNSmooths(pc, 1));
    // Contacts change the matrix near them only: interpolation stays, coarse matrices follow.
    check(PCGAMGSetReuseInterpolation(pc, PETSC_TRUE));
    // So do the bounds of eigenvalues that relaxation needs: GAMG's own are of the first matrix,
    // and with the stiff blocks of contacts a cycle by them is indefinite.
    check(PCGAMGSetUseSAEstEig(pc, PETSC_FALSE));
    check(PCSetFromOptions(pc));
}

/// Destroyed with its scope, whatever ends it.
struct Places {
    Vec vector = nullptr;
    ~Places() { VecDestroy(&vector); }
};
struct RigidModes {
    MatNullSpace space = nullptr;
    ~RigidModes() { MatNullSpaceDestroy(&space); }
};

void make(const Part& part, LargeSolid& s)
{
    s.first = part.first;
    s.own = part.own;
    const PetscInt own = 3 * part.own, all = 3 * part.all_nodes;
    check(MatCreate(PETSC_COMM_WORLD, &s.A));
    check(MatSetSizes(s.A, own, own, all, all));
    check(MatSetBlockSize(s.A, 3));
    check(MatSetType(s.A, MATAIJ));
    {
        OwnRows rows = assemble_rows(part);
        check(MatSeqAIJSetPreallocationCSR(s.A, rows.start.data(), rows.column.data(),
                                           rows.value.data()));
        check(MatMPIAIJSetPreallocationCSR(s.A, rows.start.data(), rows.column.data(),
                                           rows.value.data()));
    }
    check(MatSetOption(s.A, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
    check(MatCreateVecs(s.A, &s.y, &s.f));

    Places places;
    check(VecDuplicate(s.f, &places.vector));
    double* x = nullptr;
    check(VecGetArray(places.vector, &x));
    const auto begin = std::size_t(
        std::lower_bound(part.number.begin(), part.number.end(), part.first) - part.number.begin());
    std::copy_n(part.places.begin() + std::ptrdiff_t(3 * begin), own, x);
    check(VecRestoreArray(places.vector, &x));
    RigidModes rigid;
    check(MatNullSpaceCreateRigidBody(places.vector, &rigid.space));
    check(MatSetNearNullSpace(s.A, rigid.space));
    set_up_solver(s);
}

/// CG, or GMRES.
void set_method(LargeSolid& s, bool symmetric)
{
    check(KSPSetType(s.solver, symmetric ? KSPCG : KSPGMRES));
    if (!symmetric) {
        check(KSPGMRESSetRestart(s.solver, kRestart));
        check(KSPSetPCSide(s.solver, PC_RIGHT)); // its residual is that of the equation
    } else {
        check(KSPSetPCSide(s.solver, PC_LEFT));
    }
    check(KSPSetNormType(s.solver, KSP_NORM_UNPRECONDITIONED));
}

/// On the finest level the three rows of a node are relaxed together: contact directions are not
/// the axes. Coarser levels, where an aggregate of few nodes may lack a rotation and its block is
/// singular, keep their diagonal.
void relax_by_nodes(LargeSolid& s)
{
    if (s.relaxed) return;
    s.relaxed = true;
    check(KSPSetUp(s.solver));
    PC pc = nullptr, relaxation = nullptr;
    KSP finest = nullptr;
    PetscInt levels = 0;
    check(KSPGetPC(s.solver, &pc));
    check(PCMGGetLevels(pc, &levels));
    if (levels < 2) return;
    check(PCMGGetSmoother(pc, levels - 1, &finest));
    check(KSPReset(finest)); // bounds of eigenvalues are those of the other relaxation
    check(KSPGetPC(finest, &relaxation));
    check(PCSetType(relaxation, PCPBJACOBI));
    check(KSPSetOperators(finest, s.A, s.A));
}

/// @param node   2 new numbers of each block, of all ranks
void add_blocks(LargeSolid& s, const std::vector<std::int32_t>& node,
                const std::vector<double>& value, bool symmetric, bool renew)
{
    // What was there before is put back, to the bit: taking off again what was added would leave
    // roundings, and a step that is repeated would have others.
    for (std::size_t k = 0; 2 * k < s.added_node.size(); ++k)
        check(MatSetValuesBlocked(s.A, 1, &s.added_node[2 * k], 1, &s.added_node[2 * k + 1],
                                  &s.before[9 * k], INSERT_VALUES));
    check(MatAssemblyBegin(s.A, MAT_FINAL_ASSEMBLY));
    check(MatAssemblyEnd(s.A, MAT_FINAL_ASSEMBLY));
    s.before.clear();
    s.added_node.clear();
    std::vector<std::size_t> own;
    for (std::size_t k = 0; 9 * k < value.size(); ++k) {
        if (node[2 * k] < s.first || node[2 * k] >= s.first + s.own) continue;
        own.push_back(k);
        s.added_node.insert(s.added_node.end(), {node[2 * k], node[2 * k + 1]});
        s.before.resize(s.before.size() + 9);
        const PetscInt row = 3 * node[2 * k], column = 3 * node[2 * k + 1];
        const PetscInt rows[] = {row, row + 1, row + 2},
                       columns[] = {column, column + 1, column + 2};
        check(MatGetValues(s.A, 3, rows, 3, columns, &s.before[s.before.size() - 9]));
    }
    for (const std::size_t k : own)
        check(MatSetValuesBlocked(s.A, 1, &node[2 * k], 1, &node[2 * k + 1], &value[9 * k],
                                  ADD_VALUES));
    check(MatAssemblyBegin(s.A, MAT_FINAL_ASSEMBLY));
    check(MatAssemblyEnd(s.A, MAT_FINAL_ASSEMBLY));
    check(MatSetOption(s.A, MAT_SYMMETRIC, symmetric ? PETSC_TRUE : PETSC_FALSE));
    check(MatSetOption(s.A, MAT_SPD, symmetric ? PETSC_TRUE : PETSC_FALSE));
    check(KSPSetOperators(s.solver, s.A, s.A));
    set_method(s, symmetric);
    check(KSPSetReusePreconditioner(s.solver, renew ? PETSC_FALSE : PETSC_TRUE));
    check(KSPSetFromOptions(s.solver));
    // Multigrid's interpolation is kept: that of the solid alone, whatever is solved first.
    relax_by_nodes(s);
}

/// The requested outputs of a solve are filled: iterations, reached, ending.
void solve(LargeSolid& s, AmontonsLargeSolve& how)
{
    double size = 0;
    check(VecNorm(s.f, NORM_2, &size));
    how.iterations = 0;
    how.reached = 0;
    how.ending = kLargeReached;
    if (!std::isfinite(size)) // the same on all ranks
        throw std::runtime_error("a right-hand side with a number that is not finite");
    if (!(size > kReached * PETSC_MACHINE_EPSILON * 1e-280)) {
        check(VecSet(s.y, 0));
        return;
    }
    check(KSPSetTolerances(s.solver, how.tolerance, 0, 1e8, how.most_iterations));
    KSPConvergedReason reason{};
    const auto run = [&] {
        check(KSPSolve(s.solver, s.f, s.y));
        PetscInt count = 0;
        check(KSPGetIterationNumber(s.solver, &count));
        how.iterations += int(count);
        double left = 0;
        check(KSPGetResidualNorm(s.solver, &left));
        how.reached = left / size;
        check(KSPGetConvergedReason(s.solver, &reason));
    };
    run();
    // CG ends where a cycle of multigrid is not positive definite; GMRES does not require that.
    if (reason == KSP_DIVERGED_INDEFINITE_PC || reason == KSP_DIVERGED_INDEFINITE_MAT) {
        set_method(s, false);
        run();
        set_method(s, true);
    }
    if (reason > 0 && std::isfinite(how.reached)) return;
    how.ending = reason == KSP_DIVERGED_ITS         ? kLargeIterations
                 : reason == KSP_DIVERGED_PC_FAILED ? kLargeNoMultigrid
                                                    : kLargeBrokeDown;
    if (!std::isfinite(how.reached)) {
        how.reached = std::numeric_limits<double>::infinity();
        check(VecSet(s.y, 0));
    }
}

void drop(LargeSolid& s)
{
    KSPDestroy(&s.solver);
    VecDestroy(&s.f);
    VecDestroy(&s.y);
    MatDestroy(&s.A);
}

/// Under the next number, which is the same on all ranks.
LargeSolid& add_solid(const Part& part)
{
    auto solid = std::make_unique<LargeSolid>();
    try {
        make(part, *solid);
    } catch (...) {
        drop(*solid);
        throw;
    }
    world.solids.push_back(std::move(solid));
    return *world.solids.back();
}

void drop(int id)
{
    std::unique_ptr<LargeSolid>& solid = world.solids[std::size_t(id)];
    if (solid) drop(*solid);
    solid.reset();
}

/// MPI and PETSc end on this rank, after what is theirs.
void end()
{
    world.started = false;
    for (std::size_t id = 0; id < world.solids.size(); ++id)
        drop(int(id));
    PetscFinalize();
    MPI_Finalize();
}

/// From rank 0's `whole` to each rank's part of f, and from y back.
void scatter(LargeSolid& s)
{
    double* x = nullptr;
    check(VecGetArray(s.f, &x));
    MPI_Scatterv(s.whole.data(), s.counts.data(), s.starts.data(), MPI_DOUBLE, x, 3 * s.own,
                 MPI_DOUBLE, 0, MPI_COMM_WORLD);
    check(VecRestoreArray(s.f, &x));
}

void gather(LargeSolid& s)
{
    const double* x = nullptr;
    check(VecGetArrayRead(s.y, &x));
    MPI_Gatherv(x, 3 * s.own, MPI_DOUBLE, s.whole.data(), s.counts.data(), s.starts.data(),
                MPI_DOUBLE, 0, MPI_COMM_WORLD);
    check(VecRestoreArrayRead(s.y, &x));
}

void share_blocks(std::vector<std::int32_t>& node, std::vector<double>& value, std::int64_t count)
{
    check_size(9 * count);
    node.resize(2 * std::size_t(count));
    value.resize(9 * std::size_t(count));
    MPI_Bcast(node.data(), int(node.size()), MPI_INT32_T, 0, MPI_COMM_WORLD);
    MPI_Bcast(value.data(), int(value.size()), MPI_DOUBLE, 0, MPI_COMM_WORLD);
}

/// On the other ranks: executes an order of rank 0. @return  false after the last order
bool obey(const Order& o)
{
    switch (Work(o.work)) {
    case Work::make: {
        add_solid(receive_part());
        return true;
    }
    case Work::blocks: {
        std::vector<std::int32_t> node;
        std::vector<double> value;
        share_blocks(node, value, o.count);
        add_blocks(*world.solids[std::size_t(o.id)], node, value, (o.flags & 1) != 0,
                   (o.flags & 2) != 0);
        return true;
    }
    case Work::solve: {
        LargeSolid& s = *world.solids[std::size_t(o.id)];
        AmontonsLargeSolve how{o.tolerance, o.most, 0, 0, 0};
        scatter(s);
        solve(s, how);
        gather(s);
        return true;
    }
    case Work::drop:
        drop(o.id);
        return true;
    case Work::peak: {
        double peak = own_peak(), sum = 0;
        MPI_Reduce(&peak, &sum, 1, MPI_DOUBLE, MPI_SUM, 0, MPI_COMM_WORLD);
        return true;
    }
    case Work::finish:
        return false;
    }
    return false;
}

/// Failure of one rank while others wait in the same call: ends all of them.
[[noreturn]] void end_all(const char* what)
{
    std::fprintf(stderr, "amontons: rank %d of %d: %s; all ranks end\n", world.rank, world.ranks,
                 what);
    std::fflush(stderr);
    MPI_Abort(MPI_COMM_WORLD, 3);
    std::abort();
}

/// Runs what may fail; with other ranks a failure ends all.
template <class F> int guarded(char* message, int size, F&& work)
{
    std::string what;
    try {
        work();
        return 0;
    } catch (const std::bad_alloc&) {
        what = "not enough memory";
    } catch (const std::exception& error) {
        what = error.what();
    }
    if (world.ranks > 1) end_all(what.c_str());
    std::snprintf(message, std::size_t(size), "%s", what.c_str());
    return 1;
}

void default_option(const char* name, const char* value)
{
    PetscBool there = PETSC_FALSE;
    PetscOptionsHasName(nullptr, nullptr, name, &there);
    if (!there) PetscOptionsSetValue(nullptr, name, value);
}

} // namespace
} // namespace amontons

using namespace amontons;

EXPORT int amontons_petsc_start(char* message, int size)
{
    if (world.started) return 0;
    // Open MPI opens parts of itself that search for its symbols among the global ones.
    for (const char* name : {"libmpi.so.40", "libmpi.so"})
        if (::dlopen(name, RTLD_NOW | RTLD_GLOBAL | RTLD_NOLOAD)) break;
    return guarded(message, size, [] {
        int running = 0;
        MPI_Initialized(&running);
        if (!running) MPI_Init(nullptr, nullptr);
        MPI_Comm_rank(MPI_COMM_WORLD, &world.rank);
        MPI_Comm_size(MPI_COMM_WORLD, &world.ranks);
        PetscOptionsSetValue(nullptr, "-no_signal_handler", "1"); // signals are the program's
        check(PetscInitializeNoArguments());
        check(PetscPushErrorHandler(PetscReturnErrorHandler, nullptr));
        default_option("-amontons_mg_levels_pc_type", "jacobi");
        world.started = true;
    });
}

EXPORT int amontons_petsc_ranks()
{
    return world.ranks;
}

EXPORT void amontons_petsc_serve()
{
    try {
        while (obey(listen())) {
        }
    } catch (const std::bad_alloc&) {
        end_all("not enough memory");
    } catch (const std::exception& error) {
        end_all(error.what());
    }
    end();
}

EXPORT void amontons_petsc_finish()
{
    if (!world.started) return;
    announce(Work::finish);
    end();
}

EXPORT int amontons_petsc_make(const AmontonsLargeMesh* mesh, int* id, char* message, int size)
{
    return guarded(message, size, [&] {
        const Partition partition = make_partition(*mesh, world.ranks);
        announce(Work::make);
        std::vector<Part> parts = make_parts(*mesh, partition);
        for (int r = 1; r < world.ranks; ++r) {
            send(parts[std::size_t(r)], r);
            parts[std::size_t(r)] = {};
        }
        LargeSolid& s = add_solid(parts[0]);
        *id = int(world.solids.size()) - 1;
        s.number = partition.number;
        s.whole.resize(3 * std::size_t(mesh->nodes));
        for (int r = 0; r < world.ranks; ++r) {
            s.starts.push_back(3 * partition.first[std::size_t(r)]);
            s.counts.push_back(
                3 * (partition.first[std::size_t(r) + 1] - partition.first[std::size_t(r)]));
        }
    });
}

EXPORT int amontons_petsc_blocks(int id, const AmontonsLargeBlocks* blocks, char* message, int size)
{
    return guarded(message, size, [&] {
        Order o;
        o.id = id;
        o.count = blocks->count;
        o.flags = (blocks->symmetric ? 1 : 0) | (blocks->renew ? 2 : 0);
        announce(Work::blocks, o);
        LargeSolid& s = *world.solids[std::size_t(id)];
        std::vector<std::int32_t> node(2 * std::size_t(blocks->count));
        for (std::size_t k = 0; k < node.size(); ++k)
            node[k] = s.number[std::size_t(blocks->node[k])];
        std::vector<double> value(blocks->value, blocks->value + 9 * blocks->count);
        share_blocks(node, value, blocks->count);
        add_blocks(s, node, value, blocks->symmetric != 0, blocks->renew != 0);
    });
}

EXPORT int amontons_petsc_solve(int id, double* f_then_y, AmontonsLargeSolve* how, char* message,
                                int size)
{
    return guarded(message, size, [&] {
        Order o;
        o.id = id;
        o.tolerance = how->tolerance;
        o.most = how->most_iterations;
        announce(Work::solve, o);
        LargeSolid& s = *world.solids[std::size_t(id)];
        for (std::size_t i = 0; i < s.number.size(); ++i)
            std::copy_n(f_then_y + 3 * i, 3, &s.whole[3 * std::size_t(s.number[i])]);
        scatter(s);
        solve(s, *how);
        gather(s);
        for (std::size_t i = 0; i < s.number.size(); ++i)
            std::copy_n(&s.whole[3 * std::size_t(s.number[i])], 3, f_then_y + 3 * i);
    });
}

EXPORT void amontons_petsc_drop(int id)
{
    if (!world.started) return;
    Order o;
    o.id = id;
    announce(Work::drop, o);
    drop(id);
}

EXPORT double amontons_petsc_peak()
{
    announce(Work::peak);
    double peak = own_peak(), sum = 0;
    MPI_Reduce(&peak, &sum, 1, MPI_DOUBLE, MPI_SUM, 0, MPI_COMM_WORLD);
    return sum;
}
