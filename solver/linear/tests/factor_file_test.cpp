#include "solver/linear/factor_file.hpp"

#include "mesh/tests/temporary_folder.hpp"

#include <doctest/doctest.h>
#include <fstream>
#include <random>
#include <sstream>

using namespace amontons;

namespace {

using Matrix = Eigen::SparseMatrix<double>;

/// 5-point Laplacian on a square, two unknowns at each node.
Matrix laplacian(int side, double shift)
{
    std::vector<Eigen::Triplet<double>> entries;
    for (int i = 0; i < side; ++i)
        for (int j = 0; j < side; ++j)
            for (int c = 0; c < 2; ++c) {
                const int k = 2 * (side * i + j) + c;
                entries.emplace_back(k, k, 4 + shift + 0.1 * c);
                if (j + 1 < side) {
                    entries.emplace_back(k, k + 2, -1);
                    entries.emplace_back(k + 2, k, -1);
                }
                if (i + 1 < side) {
                    entries.emplace_back(k, k + 2 * side, -1);
                    entries.emplace_back(k + 2 * side, k, -1);
                }
            }
    Matrix A(2 * side * side, 2 * side * side);
    A.setFromTriplets(entries.begin(), entries.end());
    return A;
}

SupernodalFactor factor_of(const Matrix& A)
{
    std::vector<std::int32_t> nodes;
    for (std::int32_t k = 0; k < A.rows(); ++k)
        nodes.push_back(k / 2);
    SupernodalFactor factor;
    factor.analyse(A, nodes);
    REQUIRE(factor.factor(A));
    return factor;
}

std::string refusal(const std::string& bytes, Checksums checksums = Checksums::verify)
{
    std::istringstream in(bytes);
    FactorLabel label;
    SupernodalFactor factor;
    const std::string why = read_factor(in, label, factor, {}, checksums);
    CHECK(factor.is_factored() == why.empty());
    return why;
}

} // namespace

TEST_CASE("a factor that was written is the same bit by bit and can be used in every way")
{
    const Matrix A = laplacian(17, 0.01), B = laplacian(17, 2);
    const SupernodalFactor written = factor_of(A);
    const FactorLabel label{{0x1234, 0xfedc}, 2.5};
    const TemporaryFolder folder;
    const std::string path = folder / "a.factor";
    write_factor(path, label, written);

    std::ifstream in(path, std::ios::binary);
    FactorLabel found;
    SupernodalFactor read;
    REQUIRE(read_factor(in, found, read) == "");
    CHECK(found == label);
    CHECK(factor_bytes(found, read) == factor_bytes(label, written));
    CHECK(read_file(path) == factor_bytes(label, written));

    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(A.rows(), -1, 2);
    CHECK(read.solved(b) == written.solved(b));
    Matrix C(A.rows(), 3);
    C.insert(5, 0) = 1;
    C.insert(90, 1) = -2;
    C.insert(200, 2) = 1;
    C.makeCompressed();
    Eigen::MatrixXd W, V;
    read.compliance(C, W);
    written.compliance(C, V);
    CHECK(W == V);
    CHECK(read.pivot_ratio() == written.pivot_ratio());

    REQUIRE(read.factor(B)); // the same pattern, other numbers
    CHECK(read.solved(b) == factor_of(B).solved(b));
    REQUIRE(read.factor(A));
    CHECK(read.solved(b) == written.solved(b));
}

TEST_CASE("every changed byte and every missing end is detected")
{
    const SupernodalFactor factor = factor_of(laplacian(4, 1));
    const std::string bytes = factor_bytes({{1, 2}, 3}, factor);
    REQUIRE(refusal(bytes) == "");
    for (std::size_t k = 0; k < bytes.size(); ++k) {
        std::string other = bytes;
        other[k] = char(other[k] ^ (1 << (k % 8)));
        CHECK(refusal(other) != "");
    }
    for (std::size_t k = 0; k < bytes.size(); k += 7)
        CHECK(refusal(bytes.substr(0, k)) != "");
    CHECK(refusal(bytes + '\0') != "");
    CHECK(refusal("amontons checkpoint\n" + bytes) == "no factor");
    CHECK(refusal("") == "cut off");
}

TEST_CASE("with right hashes what is no factor is refused and the rest does no harm")
{
    const SupernodalFactor factor = factor_of(laplacian(5, 1));
    const std::string bytes = factor_bytes({{1, 2}, 3}, factor);
    REQUIRE(refusal(bytes, Checksums::ignore) == "");
    std::mt19937 engine(1);
    int used = 0;
    for (int k = 0; k < 3000; ++k) {
        std::string other = bytes;
        for (std::size_t changes = 1 + engine() % 3; changes > 0; --changes)
            other[engine() % other.size()] = char(engine() % 256);
        std::istringstream in(other);
        FactorLabel label;
        SupernodalFactor read;
        if (read_factor(in, label, read, {}, Checksums::ignore) != "") continue;
        ++used;
        Eigen::MatrixXd W, X = Eigen::MatrixXd::Ones(read.size(), 3);
        Matrix C(read.size(), read.size());
        C.setIdentity();
        read.solve(X);
        read.compliance(C, W);
    }
    CHECK(used > 100); // most bytes are values
    CHECK(used < 3000);
}
