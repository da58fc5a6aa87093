#include "solver/solid/factor_cache.hpp"

#include "mesh/generate/solid_box.hpp"
#include "mesh/tests/temporary_folder.hpp"
#include "solver/linear/backward_error.hpp"
#include "solver/solid/compliance.hpp"

#include <doctest/doctest.h>

using namespace amontons;
namespace fs = std::filesystem;

namespace {

/// The files of a cache.
struct Folder {
    TemporaryFolder folder;
    std::string path = folder.path().string();

    std::string file(const char* ending) const
    {
        std::string found;
        for (const auto& entry : fs::directory_iterator(path))
            if (entry.path().extension() == ending) found = entry.path().string();
        return found;
    }
    std::ptrdiff_t count(const char* ending) const
    {
        std::ptrdiff_t n = 0;
        for (const auto& entry : fs::directory_iterator(path))
            n += entry.path().extension() == ending;
        return n;
    }
};

struct Brick {
    VolumeMesh mesh;
    SolidMaterial material{1e9, 0.3, 1000};
    const char* held = "z_min";
    SolidMatrixKind kind;

    SparseMatrix free;
    FreeDofs dofs;

    Brick()
    {
        SolidBoxOptions box;
        box.cells = {3, 3, 4};
        mesh = make_solid_box(box);
    }
    void assemble()
    {
        const SolidPattern pattern = make_pattern(mesh);
        SparseMatrix A = zero_matrix(pattern), M = A;
        assemble_stiffness(mesh, pattern, {&material, 1}, A);
        assemble_mass(mesh, pattern, {&material, 1}, M);
        A.coeffs() = kind.stiffness * A.coeffs() + kind.mass * M.coeffs();
        std::vector<std::int32_t> fixed;
        for (const std::int32_t node : nodes_of(mesh, *find_set(mesh.face_sets, held)))
            for (int a = 0; a < 3; ++a)
                fixed.push_back(3 * node + a);
        dofs = make_free_dofs(pattern, fixed);
        free = make_elimination(A, dofs).ff;
    }
    SolidFactor factor(const std::string& folder)
    {
        assemble();
        SolidFactor f = cached_factor(folder, mesh, {&material, 1}, dofs, kind, free);
        REQUIRE(f.result);
        // Whatever happened on disk, it is the factor of this matrix.
        const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(free.rows(), -1, 2);
        CHECK(backward_error(free, f.factor.solved(b) / f.scale, b) < 1e-15);
        return f;
    }
};

} // namespace

TEST_CASE("a second start reads the factor and has the bits of the first")
{
    const Folder folder;
    Brick brick;
    const SolidFactor first = brick.factor(folder.path), second = brick.factor(folder.path),
                      without = brick.factor("");
    CHECK(!first.factor_read);
    CHECK(second.factor_read);
    CHECK(!without.factor_read);
    CHECK(first.messages.empty());
    CHECK(second.messages.empty());
    const Eigen::VectorXd b = Eigen::VectorXd::LinSpaced(brick.free.rows(), -1, 2);
    CHECK(second.factor.solved(b) == first.factor.solved(b));
    CHECK(without.factor.solved(b) == first.factor.solved(b));
    CHECK(folder.count(".factor") == 1);
    CHECK(folder.count(".order") == 1);
}

TEST_CASE("Young's modulus alone needs no new factor but all else does")
{
    const Folder folder;
    Brick brick;
    brick.kind.mass = 1e8;
    brick.factor(folder.path);
    const auto change = [&](auto what) {
        Brick other = brick;
        what(other);
        return other.factor(folder.path).factor_read;
    };
    CHECK(change([](Brick&) {}));
    // K scales with E, M does not: the ratio must stay.
    CHECK(change([](Brick& b) { b.material.youngs_modulus *= 4, b.material.density *= 4; }));
    CHECK(change([](Brick& b) { b.material.youngs_modulus *= 2, b.kind.mass *= 2; }));
    CHECK(change([](Brick& b) { b.kind.stiffness *= 2, b.kind.mass *= 2; }));
    CHECK(!change([](Brick& b) { b.material.youngs_modulus *= 4; }));
    CHECK(!change([](Brick& b) { b.material.poissons_ratio = 0.31; }));
    CHECK(!change([](Brick& b) { b.material.density = 1001; }));
    CHECK(!change([](Brick& b) { b.kind.mass = 2e8; }));
    CHECK(!change([](Brick& b) { b.held = "x_max"; }));
    CHECK(!change([](Brick& b) { b.kind.scheme = "other"; }));
    CHECK(!change([](Brick& b) { b.mesh.nodes[20] *= 1 + 1e-15; }));
    CHECK(!change([](Brick& b) { // the same brick, numbered from another corner
        std::vector<std::int32_t>& n = b.mesh.blocks[0].nodes;
        for (const std::size_t k : {0, 1, 4, 5})
            std::swap(n[k], n[k + 2]);
    }));
    brick.kind.mass = 0;
    brick.factor(folder.path);
    CHECK(change([](Brick& b) { b.material.youngs_modulus = 2.1e11; }));
    CHECK(change([](Brick& b) { b.material.density = 7; }));
}

TEST_CASE("the order serves other prescribed dofs and places and materials of the same elements")
{
    const Folder folder;
    Brick brick;
    CHECK(!brick.factor(folder.path).order_read);
    brick.held = "x_min";
    brick.material.poissons_ratio = 0.4;
    for (Vec3& x : brick.mesh.nodes)
        x *= 1.5;
    const SolidFactor other = brick.factor(folder.path);
    CHECK(!other.factor_read);
    CHECK(other.order_read);
    CHECK(folder.count(".order") == 1);
    CHECK(folder.count(".factor") == 2);
}

TEST_CASE("damaged and foreign files are ignored with a message and replaced")
{
    const Folder folder;
    Brick brick;
    brick.factor(folder.path);
    const std::string factor = folder.file(".factor"), order = folder.file(".order");
    const std::string good = read_file(factor);
    const auto spoil = [&](std::string bytes) {
        write_file(factor, bytes);
        const SolidFactor f = brick.factor(folder.path);
        CHECK(!f.factor_read);
        REQUIRE(f.messages.size() == 1);
        CHECK(f.messages[0].find(factor + ": ignored: ") == 0);
        CHECK(read_file(factor) == good);
    };
    spoil("");
    spoil(good.substr(0, good.size() - 8));
    std::string other = good;
    other[good.size() / 2] ^= 1;
    spoil(other);
    spoil("solid nonsense");

    // A factor of another matrix, under our name.
    const Folder second;
    Brick softer = brick;
    softer.material.poissons_ratio = 0.1;
    softer.factor(second.path);
    spoil(read_file(second.file(".factor")));

    fs::remove(factor);
    std::string bytes = read_file(order);
    bytes[20] ^= 1;
    write_file(order, bytes);
    const SolidFactor f = brick.factor(folder.path);
    CHECK(!f.order_read);
    REQUIRE(f.messages.size() == 1);
    CHECK(brick.factor(folder.path).factor_read);
}

TEST_CASE("a folder that cannot be written costs no answer")
{
    Brick brick;
    const SolidFactor f = brick.factor("/dev/null/cache");
    CHECK(!f.messages.empty());
    CHECK(!f.factor_read);
}

TEST_CASE("an order read back is the one written or none")
{
    const std::vector<std::int32_t> order{3, 0, 2, 1};
    const std::string bytes = order_bytes(order);
    CHECK(read_order(bytes) == order);
    for (std::size_t k = 0; k < bytes.size(); ++k) {
        std::string other = bytes;
        other[k] = char(other[k] + 1);
        CHECK(read_order(other).empty());
        CHECK(read_order(bytes.substr(0, k)).empty());
    }
    CHECK(read_order(order_bytes(std::vector<std::int32_t>{0, 0, 1})).empty());
    CHECK(read_order(order_bytes(std::vector<std::int32_t>{0, 3, 1})).empty());
}
