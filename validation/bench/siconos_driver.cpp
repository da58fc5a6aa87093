// siconos_driver list                              names of the solvers
// siconos_driver PROBLEM ANSWER SOLVER TOLERANCE CAP
//
// Solves one local problem by one of Siconos' solvers, for contact_profile, which judges the
// answer. PROBLEM: int32 rows, entries, then W by columns (p, i, x), q, mu. ANSWER: processor
// seconds, iterations (doubles), r. A process of its own: some of the solvers end theirs.
// A short solve is repeated from the start, matrix and all, and the quickest counts.
// The options are those that make each solver run until its own criterion holds.

#include <CSparseMatrix_internal.h>
#include <FrictionContactProblem.h>
#include <Friction_cst.h>
#include <NonSmoothDrivers.h>
#include <NumericsMatrix.h>
#include <NumericsSparseMatrix.h>
#include <SiconosNumerics_Solvers.h>
#include <SolverOptions.h>
#include <SparseBlockMatrix.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fcntl.h>
#include <sys/time.h>
#include <unistd.h>
#include <vector>

namespace {

enum class Form { blocks, any }; ///< W as 3 x 3 blocks, or dense or sparse according to its density

struct Solver {
    const char* name;
    int id;
    Form form;
    int local = 0; ///< of NSGS: Siconos' solver of one contact
    void (*adjust)(SolverOptions*) = nullptr;
};

void balanced(SolverOptions* o)
{
    o->iparam[SICONOS_FRICTION_3D_ADMM_IPARAM_RHO_STRATEGY] =
        SICONOS_FRICTION_3D_ADMM_RHO_STRATEGY_SCALED_RESIDUAL_BALANCING;
    o->iparam[SICONOS_FRICTION_3D_ADMM_IPARAM_INITIAL_RHO] =
        SICONOS_FRICTION_3D_ADMM_INITIAL_RHO_NORM_INF;
}
void jean_moreau(SolverOptions* o)
{
    o->iparam[SICONOS_FRICTION_3D_NSN_FORMULATION] =
        SICONOS_FRICTION_3D_NSN_FORMULATION_JEANMOREAU_GENERATED;
}
void extragradient_first(SolverOptions* o)
{
    o->iparam[SICONOS_FRICTION_3D_NSN_HYBRID_STRATEGY] =
        SICONOS_FRICTION_3D_NSN_HYBRID_STRATEGY_VI_EG_NSN;
}

// All that were the quickest on some problem of a trial of 26 of them.
constexpr Solver kSolvers[] = {
    {"NSGS-P", SICONOS_FRICTION_3D_NSGS, Form::blocks,
     SICONOS_FRICTION_3D_ONECONTACT_ProjectionOnCone},
    {"NSGS-PLI", SICONOS_FRICTION_3D_NSGS, Form::blocks,
     SICONOS_FRICTION_3D_ONECONTACT_ProjectionOnConeWithLocalIteration},
    {"NSGS-NSN", SICONOS_FRICTION_3D_NSGS, Form::blocks, SICONOS_FRICTION_3D_ONECONTACT_NSN},
    {"NSGS-HYBRID", SICONOS_FRICTION_3D_NSGS, Form::blocks,
     SICONOS_FRICTION_3D_ONECONTACT_NSN_GP_HYBRID},
    {"NSGS-QUARTIC", SICONOS_FRICTION_3D_NSGS, Form::blocks,
     SICONOS_FRICTION_3D_ONECONTACT_QUARTIC},
    {"NSN_AC", SICONOS_FRICTION_3D_NSN_AC, Form::any},
    {"NSN_AC-JM", SICONOS_FRICTION_3D_NSN_AC, Form::any, 0, jean_moreau},
    {"NSN_AC-VI_EG", SICONOS_FRICTION_3D_NSN_AC, Form::any, 0, extragradient_first},
    {"NSN_FB", SICONOS_FRICTION_3D_NSN_FB, Form::any},
    {"NSN_NM", SICONOS_FRICTION_3D_NSN_NM, Form::any},
    {"PROX-NSN_AC", SICONOS_FRICTION_3D_PROX, Form::any},
    {"ADMM", SICONOS_FRICTION_3D_ADMM, Form::any},
    {"ADMM-balanced", SICONOS_FRICTION_3D_ADMM, Form::any, 0, balanced},
    {"TFP-NSGS", SICONOS_FRICTION_3D_TFP, Form::blocks},
    {"DSFP", SICONOS_FRICTION_3D_DSFP, Form::blocks},
    {"EG", SICONOS_FRICTION_3D_EG, Form::blocks},
    {"VI_EG", SICONOS_FRICTION_3D_VI_EG, Form::blocks},
};

constexpr double kShort = 0.05; // solves below this are repeated, and the best counts [s]
constexpr int kRepeats = 5;

struct Problem {
    std::vector<std::int32_t> p, i;
    std::vector<double> x, q, mu;
    int rows = 0;
};

template <class T> bool read(std::FILE* file, std::vector<T>& to, int count)
{
    to.resize(static_cast<std::size_t>(count));
    return std::fread(to.data(), sizeof(T), to.size(), file) == to.size();
}

bool read(const char* path, Problem& problem)
{
    std::FILE* file = std::fopen(path, "rb");
    if (!file) return false;
    std::int32_t size[2] = {};
    const bool ok = std::fread(size, sizeof size, 1, file) == 1 &&
                    read(file, problem.p, size[0] + 1) && read(file, problem.i, size[1]) &&
                    read(file, problem.x, size[1]) && read(file, problem.q, size[0]) &&
                    read(file, problem.mu, size[0] / 3);
    problem.rows = size[0];
    std::fclose(file);
    return ok;
}

template <class Take> void each_entry(const Problem& problem, Take take)
{
    for (int j = 0; j < problem.rows; ++j)
        for (int k = problem.p[static_cast<std::size_t>(j)];
             k < problem.p[static_cast<std::size_t>(j) + 1]; ++k)
            take(problem.i[static_cast<std::size_t>(k)], j, problem.x[static_cast<std::size_t>(k)]);
}

NumericsMatrix* matrix(const Problem& problem, bool blocks)
{
    const int n = problem.rows;
    const auto entries = static_cast<CS_INT>(problem.x.size());
    if (blocks) {
        CSparseMatrix* triplets = cs_spalloc(n, n, entries + 1, 1, 1);
        each_entry(problem, [&](int i, int j, double x) { cs_entry(triplets, i, j, x); });
        SparseBlockStructuredMatrix* made = SBM_new();
        SBM_from_csparse(3, cs_compress(triplets), made);
        NumericsMatrix* W = NM_new();
        W->storageType = NM_SPARSE_BLOCK;
        W->size0 = W->size1 = n;
        W->matrix1 = made;
        return W;
    }
    if (n < 60 || static_cast<double>(entries) > 0.3 * n * n) {
        auto* full = static_cast<double*>(
            std::calloc(static_cast<std::size_t>(n) * static_cast<std::size_t>(n), sizeof(double)));
        each_entry(problem, [&](int i, int j, double x) {
            full[static_cast<std::size_t>(j) * static_cast<std::size_t>(n) +
                 static_cast<std::size_t>(i)] = x;
        });
        return NM_create_from_data(NM_DENSE, n, n, full);
    }
    NumericsMatrix* W = NM_create(NM_SPARSE, n, n);
    NM_triplet_alloc(W, entries + 1);
    W->matrix2->origin = NSM_TRIPLET;
    each_entry(problem, [&](int i, int j, double x) { NM_entry(W, i, j, x); });
    return W;
}

/// Largest eigenvalue of W, by the power iteration.
double largest_eigenvalue(const Problem& problem)
{
    const auto n = static_cast<std::size_t>(problem.rows);
    std::vector<double> x(n), y(n);
    for (std::size_t i = 0; i < n; ++i)
        x[i] = 1 + 0.3 * std::sin(1.7 * static_cast<double>(i));
    double size = 0;
    for (int k = 0; k < 60; ++k) {
        y.assign(n, 0);
        each_entry(problem, [&](int i, int j, double w) {
            y[static_cast<std::size_t>(i)] += w * x[static_cast<std::size_t>(j)];
        });
        size = 0;
        for (const double v : y)
            size += v * v;
        size = std::sqrt(size);
        for (std::size_t i = 0; i < n; ++i)
            x[i] = y[i] / size;
    }
    return size;
}

SolverOptions* options(const Solver& s, double tolerance, const Problem& problem)
{
    constexpr int kForEver = 10'000'000, kNewtonSteps = 1000, kLocalSteps = 100;
    SolverOptions* o = solver_options_create(s.id);
    o->dparam[SICONOS_DPARAM_TOL] = tolerance;
    o->iparam[SICONOS_IPARAM_MAX_ITER] = kForEver;
    const auto inner_steps = [&](int most) {
        if (o->numberOfInternalSolvers > 0 && o->internalSolvers[0])
            o->internalSolvers[0]->iparam[SICONOS_IPARAM_MAX_ITER] = most;
    };
    switch (s.id) {
    case SICONOS_FRICTION_3D_NSGS:
        o->iparam[SICONOS_FRICTION_3D_IPARAM_ERROR_EVALUATION] =
            SICONOS_FRICTION_3D_NSGS_ERROR_EVALUATION_LIGHT_WITH_FULL_FINAL;
        solver_options_update_internal(o, 0, static_cast<std::size_t>(s.local));
        o->internalSolvers[0]->dparam[SICONOS_DPARAM_TOL] = 1e-14;
        inner_steps(s.local == SICONOS_FRICTION_3D_ONECONTACT_ProjectionOnCone ? 1 : kLocalSteps);
        break;
    case SICONOS_FRICTION_3D_NSN_AC:
    case SICONOS_FRICTION_3D_NSN_FB:
    case SICONOS_FRICTION_3D_NSN_NM:
        o->iparam[SICONOS_IPARAM_MAX_ITER] = kNewtonSteps;
        break;
    case SICONOS_FRICTION_3D_TFP:
        inner_steps(100'000);
        break;
    case SICONOS_FRICTION_3D_DSFP:
        o->dparam[SICONOS_FRICTION_3D_NSN_RHO] = 1 / largest_eigenvalue(problem);
        break;
    default:
        break;
    }
    if (s.adjust) s.adjust(o);
    return o;
}

// Of the thread: the clock of the process moves by ticks while ITIMER_PROF runs.
double processor_seconds()
{
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

} // namespace

int main(int argc, char** argv)
{
    if (argc == 2 && std::strcmp(argv[1], "list") == 0) {
        for (const Solver& s : kSolvers)
            std::printf("%s\n", s.name);
        return 0;
    }
    if (argc != 6) return 2;
    const Solver* solver = nullptr;
    for (const Solver& s : kSolvers)
        if (std::strcmp(s.name, argv[3]) == 0) solver = &s;
    Problem problem;
    if (!solver || !read(argv[1], problem)) return 2;
    const int null = open("/dev/null", O_WRONLY);
    dup2(null, 1); // they talk
    dup2(null, 2);
    const double cap = std::atof(argv[5]);

    const double tolerance = std::atof(argv[4]);
    itimerval limit{};
    limit.it_value.tv_sec = static_cast<time_t>(cap);
    limit.it_value.tv_usec = static_cast<suseconds_t>(1e6 * (cap - std::floor(cap)));
    double best = INFINITY;
    for (int k = 0; k < kRepeats && (k == 0 || best < kShort); ++k) {
        std::vector<double> r(static_cast<std::size_t>(problem.rows), 0), u = r;
        std::vector<double> q = problem.q, mu = problem.mu;
        FrictionContactProblem* p = frictionContactProblem_new_with_data(
            3, problem.rows / 3, matrix(problem, solver->form == Form::blocks), q.data(),
            mu.data());
        SolverOptions* o = options(*solver, tolerance, problem);
        setitimer(ITIMER_PROF, &limit, nullptr);
        const double start = processor_seconds();
        fc3d_driver(p, r.data(), u.data(), o);
        const double seconds = processor_seconds() - start;
        if (seconds >= best) continue;
        best = seconds;
        const double head[2] = {seconds, static_cast<double>(o->iparam[SICONOS_IPARAM_ITER_DONE])};
        std::FILE* file = std::fopen(argv[2], "wb");
        if (!file) return 2;
        std::fwrite(head, sizeof head, 1, file);
        std::fwrite(r.data(), sizeof(double), r.size(), file);
        std::fclose(file);
    }
    std::_Exit(0);
}
