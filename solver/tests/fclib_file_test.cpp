#include "solver/fclib_file.hpp"

#include "contact/tests/contact_problems.hpp"
#include "mesh/base/file.hpp"
#include "mesh/tests/temporary_folder.hpp"

#include <doctest/doctest.h>
#include <hdf5.h>

extern "C" { // fclib.h is C
#include <fclib.h>
}

// libfclib is the reference: it must read what is written here, and what it writes must be read
// here.

using namespace amontons;

namespace {

Eigen::MatrixXd full(const Delassus& W)
{
    return W.is_dense() ? W.dense() : Eigen::MatrixXd(W.sparse());
}

Eigen::MatrixXd full(const fclib_matrix& A)
{
    Eigen::MatrixXd W = Eigen::MatrixXd::Zero(A.m, A.n);
    REQUIRE(A.nz == -1);
    for (int j = 0; j < A.n; ++j)
        for (int k = A.p[j]; k < A.p[j + 1]; ++k)
            W(A.i[k], j) += A.x[k];
    return W;
}

/// A matrix as libfclib takes it, in one of the three forms.
struct Stored {
    std::vector<int> p, i;
    std::vector<double> x;
    fclib_matrix matrix{};

    Stored(const Eigen::MatrixXd& A, int form)
    {
        matrix.m = int(A.rows());
        matrix.n = int(A.cols());
        const bool rows = form == -2;
        for (int a = 0; a < (rows ? A.rows() : A.cols()); ++a) {
            if (form < 0) p.push_back(int(x.size()));
            for (int b = 0; b < (rows ? A.cols() : A.rows()); ++b) {
                const double value = rows ? A(a, b) : A(b, a);
                if (value == 0) continue;
                i.push_back(b);
                if (form >= 0) p.push_back(a);
                x.push_back(value);
            }
        }
        if (form < 0) p.push_back(int(x.size()));
        matrix.nzmax = int(x.size());
        matrix.nz = form < 0 ? form : int(x.size());
        matrix.p = p.data();
        matrix.i = i.data();
        matrix.x = x.data();
    }
};

/// Reads a file, and returns what is wrong with it ("" if nothing).
std::string refusal(std::string_view bytes)
{
    try {
        parse_fclib(bytes, "bad.hdf5");
    } catch (const InputError& e) {
        CHECK(e.issues().front().file == "bad.hdf5");
        return e.what();
    }
    return "";
}

FclibProblem a_problem()
{
    FclibProblem p;
    p.local = test::tower({1, 2, 3, 4, 5, 6, 7, 8}, 0.2, 0.7);
    p.title = "tower";
    p.description = "eight blocks";
    p.math_info = "W positive definite";
    return p;
}

} // namespace

TEST_CASE("what libfclib writes in its three forms of matrix is read")
{
    const TemporaryFolder folder;
    std::mt19937 rng{1};
    ContactProblem p = test::random_problem(rng, 4, 8, 0.4);
    p.W.dense()(0, 5) = p.W.dense()(5, 0) = 0;
    for (const int form : {-1, -2, 0}) {
        const std::string path = folder / ("libfclib" + std::to_string(form) + ".hdf5");
        Stored W(p.W.dense(), form);
        char title[] = "title", description[] = "by libfclib", math[] = "nothing";
        fclib_info info{title, description, math};
        fclib_local local{};
        local.W = &W.matrix;
        local.q = p.q.data();
        local.mu = p.mu.data();
        local.spacedim = 3;
        local.info = &info;
        REQUIRE(fclib_write_local(&local, path.c_str()) == 1);
        Eigen::VectorXd r = Eigen::VectorXd::LinSpaced(12, 0, 1), u = -r;
        fclib_solution solution{nullptr, u.data(), r.data(), nullptr};
        REQUIRE(fclib_write_solution(&solution, path.c_str()) == 1);
        fclib_solution guesses[] = {solution, solution, solution};
        REQUIRE(fclib_write_guesses(3, guesses, path.c_str()) == 1);

        const FclibProblem read = read_fclib(path);
        REQUIRE(read.local);
        CHECK((full(read.local->W) - p.W.dense()).norm() == 0);
        CHECK(read.local->q == p.q);
        CHECK(read.local->mu == p.mu);
        CHECK(read.description == "by libfclib");
        REQUIRE(read.solution);
        CHECK(read.solution->r == r);
        CHECK(read.solution->u == u);
        CHECK(read.guesses.size() == 3);
        CHECK(read.guesses.back().r == r);
    }
}

TEST_CASE("libfclib's global problems with bilateral equations are read")
{
    const TemporaryFolder folder;
    const std::string path = folder / "global.hdf5";
    Eigen::MatrixXd M = Eigen::MatrixXd::Identity(5, 5) * 3, H = Eigen::MatrixXd::Random(5, 3),
                    G = Eigen::MatrixXd::Random(5, 2);
    Stored m(M, 0), h(H, 0), g(G, -1);
    Eigen::VectorXd mu = Eigen::VectorXd::Constant(1, 0.2), f = Eigen::VectorXd::Random(5),
                    b = Eigen::VectorXd::Random(2), w = Eigen::VectorXd::Random(3);
    char text[] = "text";
    fclib_info info{text, text, text};
    fclib_global global{&m.matrix, &h.matrix, &g.matrix, mu.data(), f.data(),
                        b.data(),  w.data(),  3,         &info};
    REQUIRE(fclib_write_global(&global, path.c_str()) == 1);
    const FclibProblem read = read_fclib(path);
    REQUIRE(read.global);
    CHECK((Eigen::MatrixXd(read.global->M) - M).norm() == 0);
    CHECK((Eigen::MatrixXd(read.global->H).leftCols(3) - H).norm() == 0);
    CHECK((Eigen::MatrixXd(read.global->H).rightCols(2) - G).norm() == 0);
    CHECK(read.global->f == f);
    CHECK(read.global->w.head(3) == w);
    CHECK(read.global->w.tail(2) == b);
    CHECK(read.global->kind.back() == ContactKind::bilateral);
}

TEST_CASE("libfclib reads the files that are written")
{
    const TemporaryFolder folder;
    const std::string path = folder / "ours.hdf5";
    FclibProblem p = a_problem();
    const Eigen::Index rows = p.local->q.size();
    p.solution = FclibSolution{
        Eigen::VectorXd::LinSpaced(rows, 0, 1), Eigen::VectorXd::LinSpaced(rows, 1, 2), {}};
    p.guesses = {*p.solution, *p.solution};
    write_fclib(path, p);
    fclib_local* local = fclib_read_local(path.c_str());
    REQUIRE(local);
    CHECK(local->spacedim == 3);
    CHECK((full(*local->W) - full(p.local->W)).norm() == 0);
    CHECK(Eigen::Map<Eigen::VectorXd>(local->q, rows) == p.local->q);
    CHECK(Eigen::Map<Eigen::VectorXd>(local->mu, 8) == p.local->mu);
    REQUIRE(local->info);
    CHECK(std::string(local->info->title) == "tower");
    fclib_delete_local(local);
    std::free(local);
    fclib_solution* solution = fclib_read_solution(path.c_str());
    REQUIRE(solution);
    CHECK(Eigen::Map<Eigen::VectorXd>(solution->r, rows) == p.solution->r);
    CHECK(Eigen::Map<Eigen::VectorXd>(solution->u, rows) == p.solution->u);
    fclib_delete_solutions(solution, 1);
    int count = 0;
    fclib_solution* guesses = fclib_read_guesses(path.c_str(), &count);
    REQUIRE(guesses);
    CHECK(count == 2);
    fclib_delete_solutions(guesses, count);

    // a larger one: its arrays are compressed
    FclibProblem large;
    large.local = test::tower(std::vector<double>(400, 2.0), 0.1, 0.4);
    write_fclib((folder / "large.hdf5"), large);
    CHECK((full(read_fclib((folder / "large.hdf5")).local->W) - full(large.local->W)).norm() == 0);
    local = fclib_read_local((folder / "large.hdf5").c_str());
    REQUIRE(local);
    CHECK((full(*local->W) - full(large.local->W)).norm() == 0);
    fclib_delete_local(local);
    std::free(local);
}

TEST_CASE("a problem without contacts passes through a file")
{
    FclibProblem none;
    none.local = ContactProblem{};
    const FclibProblem read = parse_fclib(fclib_bytes(none), "none.hdf5");
    REQUIRE(read.local);
    CHECK(contact_count(*read.local) == 0);
}

TEST_CASE("a copy with a solution keeps all else, also foreign data")
{
    const TemporaryFolder folder;
    const std::string path = folder / "a.hdf5";
    write_fclib(path, a_problem());
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    const hid_t other = H5Gcreate2(file, "of_somebody_else", 0, 0, 0);
    H5Gclose(other);
    H5Fclose(file);
    FclibSolution s{Eigen::VectorXd::LinSpaced(24, 0, 1), Eigen::VectorXd::Zero(24), {}};
    std::string bytes = with_solution(read_file(path), s, 0);
    s.r *= 2;
    bytes = with_solution(bytes, s, 0); // replaced, not refused
    write_file((folder / "b.hdf5"), bytes);
    const FclibProblem read = read_fclib((folder / "b.hdf5"));
    CHECK(read.solution->r == s.r);
    CHECK(read.title == "tower");
    CHECK((full(read.local->W) - full(a_problem().local->W)).norm() == 0);
    const hid_t copy = H5Fopen((folder / "b.hdf5").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    CHECK(H5Lexists(copy, "of_somebody_else", H5P_DEFAULT) > 0);
    H5Fclose(copy);
}

TEST_CASE("a file cut anywhere is refused and ends no process" * doctest::test_suite("slow"))
{
    const std::string whole = fclib_bytes(a_problem());
    REQUIRE(refusal(whole).empty());
    int refused = 0, n = 0;
    for (std::size_t size = 0; size < whole.size(); size += 97, ++n)
        refused += refusal(whole.substr(0, size)).empty() ? 0 : 1;
    CHECK(refused == n);
}

TEST_CASE("bytes turned at random end in a problem that makes sense or in a refusal" *
          doctest::test_suite("slow"))
{
    const std::string whole = fclib_bytes(a_problem());
    std::mt19937 rng{2};
    int refused = 0, crashed = 0;
    for (int k = 0; k < 150; ++k) {
        std::string bytes = whole;
        for (int j = 0; j < 1 + k % 8; ++j)
            bytes[rng() % bytes.size()] = static_cast<char>(rng());
        try {
            const FclibProblem p = parse_fclib(bytes, "bad.hdf5");
            CHECK(issues(*p.local).empty());
        } catch (const InputError& e) {
            ++refused;
            if (std::string(e.what()).find("crashes") != std::string::npos) ++crashed;
        }
    }
    MESSAGE(refused << " of 150 refused, the HDF5 library crashed on " << crashed);
    CHECK(refused > 10);
}

TEST_CASE("foreign files and plane problems and promised terabytes are refused by name")
{
    const TemporaryFolder folder;
    CHECK(refusal("").find("empty") != std::string::npos);
    CHECK(refusal("solid stl\n").find("no HDF5 file") != std::string::npos);
    CHECK(refusal(std::string("\x89HDF\r\n\x1a\n") + std::string(1000, 'x')).find("HDF5") !=
          std::string::npos);
    CHECK_THROWS_AS(read_fclib((folder / "missing.hdf5")), InputError);

    const auto made = [&](const auto& fill) {
        const std::string path = folder / "made.hdf5";
        const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
        fill(file);
        H5Fclose(file);
        return read_file(path);
    };
    CHECK(refusal(made([](hid_t) {})).find("no contact problem") != std::string::npos);

    // q claims 10^12 values of which none is stored, in a file of some kilobytes.
    const std::string promise = made([](hid_t file) {
        const hid_t group = H5Gcreate2(file, "fclib_local", 0, 0, 0);
        const hsize_t size = 1'000'000'000'000, chunk = 1 << 20;
        const hid_t space = H5Screate_simple(1, &size, nullptr),
                    plan = H5Pcreate(H5P_DATASET_CREATE);
        H5Pset_chunk(plan, 1, &chunk);
        const hid_t set = H5Dcreate2(group, "q", H5T_NATIVE_DOUBLE, space, 0, plan, 0);
        H5Dclose(set);
        H5Pclose(plan);
        H5Sclose(space);
        H5Gclose(group);
    });
    CHECK(promise.size() < 100'000);
    CHECK(refusal(promise).find("memory") != std::string::npos);

    // A group that contains itself, and a link out of the file.
    const std::string knot = made([](hid_t file) {
        const hid_t group = H5Gcreate2(file, "fclib_local", 0, 0, 0);
        H5Lcreate_hard(file, "fclib_local", group, "W", 0, 0);
        H5Gclose(group);
    });
    CHECK(refusal(knot).find("without an end") != std::string::npos);
    const std::string link = made([](hid_t file) {
        const hid_t group = H5Gcreate2(file, "fclib_local", 0, 0, 0);
        H5Lcreate_external("/etc/passwd", "/", group, "spacedim", 0, 0);
        H5Gclose(group);
    });
    CHECK(refusal(link).find("/fclib_local/spacedim: found a link to another place") !=
          std::string::npos);
}
