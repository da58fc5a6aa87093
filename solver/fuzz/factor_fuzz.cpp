#include "mesh/base/error.hpp"
#include "solver/linear/factor_file.hpp"
#include "solver/solid/factor_cache.hpp"

#include <sstream>

using namespace amontons;

// A factor that is read can be used; with hashes that are right, it is written as it was read. The
// order of elimination, the cache's other kind of file, likewise.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const std::string bytes(reinterpret_cast<const char*>(data), size);
    for (const Checksums checksums : {Checksums::verify, Checksums::ignore}) {
        std::istringstream in(bytes);
        FactorLabel label;
        SupernodalFactor factor;
        const bool read = read_factor(in, label, factor, {}, checksums).empty();
        AMONTONS_ASSERT(factor.is_factored() == read);
        if (!read || factor.size() > 300) continue;
        if (checksums == Checksums::verify) AMONTONS_ASSERT(factor_bytes(label, factor) == bytes);
        Eigen::MatrixXd X = Eigen::MatrixXd::Ones(factor.size(), 2), W;
        factor.solve(X);
        Eigen::SparseMatrix<double> C(factor.size(), factor.size());
        C.setIdentity();
        factor.compliance(C, W);
        AMONTONS_ASSERT(W.rows() == factor.size());
        const std::vector<std::int32_t> all(factor.permutation().begin(),
                                            factor.permutation().end());
        factor.inverse_part(all, all, W);
    }
    const std::vector<std::int32_t> order = read_order(bytes);
    AMONTONS_ASSERT(order.empty() || order_bytes(order) == bytes);
    return 0;
}
