// fclib_samples FOLDER: small FCLib files, for the tests of the program and as seeds of the fuzz
// targets (FOLDER/packed: the same datasets, packed).

#include "contact/tests/contact_problems.hpp"
#include "mesh/base/file.hpp"
#include "solver/fclib_file.hpp"

#include <cstdio>

using namespace amontons;

namespace {

/// One body of mass 1 between two floors: there is room for it, or 1e-6 too little.
ContactProblem between_walls(double room)
{
    ContactProblem p;
    Eigen::MatrixXd W = Eigen::MatrixXd::Zero(6, 6);
    for (int i : {0, 1})
        for (int j : {0, 1})
            W.block<3, 3>(3 * i, 3 * j) = Vec3{i == j ? 1.0 : -1.0, 1, 1}.asDiagonal();
    p.W = W;
    p.q.resize(6);
    p.q << -1, 0.1, 0, 1 + room, 0.1, 0;
    p.mu.setConstant(2, 0.5);
    return p;
}

/// Two masses, glued along t2 if requested, on the ground.
GlobalProblem two_masses(bool glued)
{
    GlobalProblem p;
    p.level = ContactLevel::velocity;
    const Eigen::Index rows = glued ? 7 : 6;
    p.M = Eigen::SparseMatrix<double>(6, 6);
    p.H = Eigen::SparseMatrix<double>(6, rows);
    for (int i = 0; i < 6; ++i) {
        p.M.insert(i, i) = i < 3 ? 1 : 10;
        p.H.insert(i, i) = 1;
    }
    p.f.resize(6);
    p.f << -1, 0.3, 0, -10, 8, 0;
    p.w = Eigen::VectorXd::Zero(rows);
    p.mu = Eigen::VectorXd::Constant(2, 0.5);
    if (!glued) return p;
    p.H.insert(1, 6) = 1;
    p.H.insert(4, 6) = -1;
    p.mu.conservativeResize(3);
    p.mu[2] = 0;
    p.kind = {ContactKind::frictional, ContactKind::frictional, ContactKind::bilateral};
    return p;
}

FclibProblem of(ContactProblem p, const char* title)
{
    FclibProblem file;
    file.local = std::move(p);
    file.title = title;
    return file;
}

} // namespace

int main(int argc, char** argv)
try {
    if (argc != 2) return 2;
    const std::string folder = argv[1];
    make_folder(folder);
    make_folder(folder + "/packed");
    const auto save = [&](const std::string& name, const std::vector<NamedArray>& arrays,
                          const FclibProblem* problem) {
        write_file(folder + "/packed/" + name, pack_arrays(arrays));
        if (problem) write_fclib(folder + "/" + name + ".hdf5", *problem);
    };
    const auto good = [&](const std::string& name, const FclibProblem& p) {
        save(name, fclib_arrays(p), &p);
    };
    FclibProblem tower = of(test::tower({1, 2, 3, 1}, 0.6, 0.5), "four blocks on an incline");
    tower.identity = {4, 3, 2, 1};
    good("tower", tower);
    tower.solution = FclibSolution{Eigen::VectorXd::Ones(12), Eigen::VectorXd::Zero(12), {}};
    tower.guesses = {*tower.solution, *tower.solution};
    good("solved", tower);
    // Keeps Gauss-Seidel busy for seconds.
    good("slow", of(test::tower(std::vector<double>(800, 1.0), 0.6, 0.5), "eight hundred blocks"));
    good("room", of(between_walls(1e-6), "a body between two walls"));
    good("infeasible", of(between_walls(-1e-6), "a body squeezed by two walls"));
    good("empty", of(ContactProblem{}, "no contact"));
    FclibProblem global;
    global.global = two_masses(false);
    good("global", global);
    global.global = two_masses(true);
    good("glued", global);

    // Wrong ones: the datasets of a good one with a mistake, past our own checks.
    const auto bad = [&](const std::string& name, const char* dataset, auto value) {
        std::vector<NamedArray> arrays = fclib_arrays(of(test::tower({1, 2}, 0.6, 0.5), ""));
        for (NamedArray& a : arrays)
            if (a.name == dataset) a.value = value;
        save(name, arrays, nullptr);
        write_file(folder + "/" + name + ".hdf5", fclib_file_of(arrays));
    };
    bad("plane", "fclib_local/spacedim", std::vector<std::int32_t>{2});
    bad("negative_mu", "fclib_local/vectors/mu", std::vector<double>{0.5, -0.1});
    bad("short", "fclib_local/vectors/q", std::vector<double>{1, 2, 3});
    bad("text", "fclib_local/vectors/q", std::string("one, two"));
    return 0;
} catch (const std::exception& error) {
    std::fprintf(stderr, "fclib_samples: %s\n", error.what());
    return 1;
}
