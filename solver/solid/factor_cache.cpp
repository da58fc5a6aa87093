#include "solver/solid/factor_cache.hpp"

#include "mesh/neighbours.hpp"
#include "solver/linear/backward_error.hpp"
#include "solver/linear/factor_file.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

namespace fs = std::filesystem;

namespace amontons {
namespace {

/// Part of every name: changes with the elements' formulas, or with what a name is made of.
constexpr std::uint64_t kVersion = 1;
constexpr std::string_view kOrderMagic = "amontons order 1";
/// A factor that is A's solves it to a few roundings; what is not A's does not come near.
constexpr double kFits = 1e-12;

/// Collects what a name depends on; each piece enters with its length, so that none can be taken
/// for another.
class Fingerprint {
public:
    void add(std::string_view bytes)
    {
        add(bytes.size());
        const Hash128 hash = hash128_bytes(bytes);
        add(hash.high);
        add(hash.low);
    }
    void add(std::uint64_t value)
    {
        bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
    void add(double value) { add(std::bit_cast<std::uint64_t>(value + 0.0)); } // -0 is 0
    template <class T> void add(std::span<const T> values)
    {
        add(std::string_view(reinterpret_cast<const char*>(values.data()), values.size_bytes()));
    }
    Hash128 hash() const { return hash128_bytes(bytes_); }

private:
    std::string bytes_;
};

void add_elements(const VolumeMesh& mesh, Fingerprint& print)
{
    print.add(std::uint64_t(mesh.nodes.size()));
    print.add(std::uint64_t(mesh.blocks.size()));
    for (const ElementBlock& block : mesh.blocks) {
        print.add(std::uint64_t(block.kind));
        print.add(std::span<const std::int32_t>(block.nodes));
    }
}

Hash128 factor_key(const VolumeMesh& mesh, std::span<const SolidMaterial> materials,
                   const FreeDofs& dofs, const SolidMatrixKind& kind,
                   const SupernodalOptions& options)
{
    Fingerprint print;
    print.add(kVersion);
    add_elements(mesh, print);
    static_assert(sizeof(Vec3) == 3 * sizeof(double));
    print.add(std::span<const Vec3>(mesh.nodes));
    const double unit = materials[0].youngs_modulus * kind.stiffness;
    for (const SolidMaterial& m : materials) {
        print.add(m.youngs_modulus / materials[0].youngs_modulus);
        print.add(m.poissons_ratio);
        print.add(m.density * kind.mass / unit);
    }
    print.add(std::span<const std::int32_t>(dofs.fixed));
    print.add(kind.scheme);
    print.add(std::uint64_t(options.ordering));
    for (const std::int32_t relax : options.relax)
        print.add(std::uint64_t(relax));
    print.add(std::uint64_t(options.widest));
    return print.hash();
}

std::string name_of(const Hash128& hash, const char* ending)
{
    constexpr char digits[] = "0123456789abcdef";
    std::string name;
    for (const std::uint64_t word : {hash.high, hash.low})
        for (int shift = 60; shift >= 0; shift -= 4)
            name += digits[word >> shift & 15];
    return name + ending;
}

/// Whether the factor of `scale` x A solves A.
bool fits(const SupernodalFactor& factor, double scale, const SparseMatrix& A)
{
    if (factor.size() != A.rows()) return false;
    // No symmetry of a mesh keeps these to a part of the unknowns.
    const Eigen::VectorXd b = Eigen::VectorXd::NullaryExpr(
        A.rows(), [](Eigen::Index i) { return std::sin(double(i) + 0.5); });
    const Eigen::VectorXd x = factor.solved(b) / scale;
    return backward_error(A, x, b) < kFits;
}

/// @returns whether the answer now has the factor
bool read_cached(const std::string& path, const Hash128& key, double unit, const SparseMatrix& A,
                 const SupernodalOptions& options, SolidFactor& answer)
{
    std::ifstream in(path, std::ios::binary);
    if (!in) return false; // not there: no reason for a message
    FactorLabel label;
    std::string why = read_factor(in, label, answer.factor, options);
    if (why.empty() && label.key != key) why = "of something else";
    if (why.empty() && !(label.scale > 0)) why = "damaged";
    answer.scale = unit / label.scale;
    if (why.empty() && !fits(answer.factor, answer.scale, A))
        why = "it does not solve this body's matrix";
    if (why.empty()) {
        answer.result = {true, -1};
        answer.factor_read = true;
        return true;
    }
    answer.factor = SupernodalFactor();
    answer.scale = 1;
    answer.messages.push_back(path + ": ignored: " + why);
    return false;
}

void find_order(const std::string& path, const VolumeMesh& mesh, SupernodalOptions& options,
                SolidFactor& answer)
{
    options.node_order.clear();
    if (std::error_code error; !path.empty() && fs::exists(path, error)) {
        try {
            options.node_order = read_order(read_file(path));
            if (options.node_order.size() == mesh.nodes.size()) {
                answer.order_read = true;
                return;
            }
            options.node_order.clear();
            answer.messages.push_back(path + ": ignored: damaged");
        } catch (const InputError& e) {
            answer.messages.push_back(e.what());
        }
    }
    options.node_order = elimination_order(nodes_at_nodes(mesh), options.ordering);
}

template <class Write> void try_to_write(SolidFactor& answer, Write write)
{
    try {
        write();
    } catch (const WriteError& e) {
        answer.messages.push_back(e.what());
    }
}

} // namespace

std::string factor_file_name(const VolumeMesh& mesh, std::span<const SolidMaterial> materials,
                             const FreeDofs& dofs, const SolidMatrixKind& kind,
                             const SupernodalOptions& options)
{
    return name_of(factor_key(mesh, materials, dofs, kind, options), ".factor");
}

std::string order_file_name(const VolumeMesh& mesh, Ordering method)
{
    Fingerprint print;
    print.add(kVersion);
    add_elements(mesh, print);
    print.add(std::uint64_t(method));
    return name_of(print.hash(), ".order");
}

std::string order_bytes(std::span<const std::int32_t> order)
{
    std::string bytes(kOrderMagic);
    bytes.append(reinterpret_cast<const char*>(order.data()), order.size_bytes());
    const std::uint64_t hash = hash_bytes(bytes);
    bytes.append(reinterpret_cast<const char*>(&hash), sizeof hash);
    return bytes;
}

std::vector<std::int32_t> read_order(std::string_view bytes)
{
    std::uint64_t hash = 0;
    constexpr std::size_t least = kOrderMagic.size() + sizeof hash;
    if (bytes.size() < least || bytes.substr(0, kOrderMagic.size()) != kOrderMagic ||
        (bytes.size() - least) % sizeof(std::int32_t) != 0)
        return {};
    std::memcpy(&hash, bytes.data() + bytes.size() - sizeof hash, sizeof hash);
    bytes.remove_suffix(sizeof hash);
    if (hash != hash_bytes(bytes)) return {};
    bytes.remove_prefix(kOrderMagic.size());
    std::vector<std::int32_t> order(bytes.size() / sizeof(std::int32_t));
    std::memcpy(order.data(), bytes.data(), bytes.size());
    std::vector<char> seen(order.size(), 0);
    for (const std::int32_t node : order)
        if (node < 0 || std::size_t(node) >= order.size() ||
            std::exchange(seen[std::size_t(node)], 1))
            return {};
    return order;
}

SolidFactor cached_factor(const std::string& folder, const VolumeMesh& mesh,
                          std::span<const SolidMaterial> materials, const FreeDofs& dofs,
                          const SolidMatrixKind& kind, const SparseMatrix& free,
                          SupernodalOptions options)
{
    AMONTONS_ASSERT(!materials.empty() && kind.stiffness > 0 && kind.mass >= 0);
    SolidFactor answer;
    const double unit = materials[0].youngs_modulus * kind.stiffness;
    std::string factor_path, order_path;
    FactorLabel label;
    label.scale = unit;
    if (!folder.empty()) {
        label.key = factor_key(mesh, materials, dofs, kind, options);
        factor_path = (fs::path(folder) / name_of(label.key, ".factor")).string();
        order_path = (fs::path(folder) / order_file_name(mesh, options.ordering)).string();
        if (read_cached(factor_path, label.key, unit, free, options, answer)) return answer;
    }

    find_order(order_path, mesh, options, answer);
    std::vector<std::int32_t> node_of_dof;
    node_of_dof.reserve(dofs.free.size());
    for (const std::int32_t dof : dofs.free)
        node_of_dof.push_back(dof / 3);
    answer.factor.analyse(free, node_of_dof, options);
    answer.result = answer.factor.factor(free);
    if (folder.empty() || !answer.result || free.rows() == 0) return answer;
    try_to_write(answer, [&] {
        make_folder(folder);
        if (!answer.order_read) write_file(order_path, order_bytes(options.node_order));
    });
    try_to_write(answer, [&] { write_factor(factor_path, label, answer.factor); });
    return answer;
}

} // namespace amontons
