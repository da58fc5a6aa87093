#include "contact/fclib.hpp"

#include <cstdint>
#include <stdexcept>

using namespace amontons;

namespace {

Eigen::MatrixXd full(const Delassus& W)
{
    return W.is_dense() ? W.dense() : Eigen::MatrixXd(W.sparse());
}

} // namespace

// Packed datasets: whatever is accepted makes sense, and survives being written and read.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    FclibProblem p;
    try {
        p = fclib_problem(unpack_arrays({reinterpret_cast<const char*>(data), size}), "fuzz");
    } catch (const InputError&) {
        return 0;
    } catch (const std::runtime_error&) { // not packed arrays at all
        return 0;
    }
    const FclibProblem q = fclib_problem(fclib_arrays(p), "again");
    if (p.local) {
        AMONTONS_ASSERT(issues(*p.local).empty());
        AMONTONS_ASSERT(p.local->q.size() > 300 || full(p.local->W) == full(q.local->W));
        AMONTONS_ASSERT(p.local->q == q.local->q && p.local->mu == q.local->mu);
    } else {
        AMONTONS_ASSERT(issues(*p.global).empty());
        AMONTONS_ASSERT(p.global->f == q.global->f && p.global->w == q.global->w);
        AMONTONS_ASSERT((Eigen::SparseMatrix<double>(p.global->H - q.global->H)).norm() == 0);
    }
    AMONTONS_ASSERT(p.solution.has_value() == q.solution.has_value());
    AMONTONS_ASSERT(p.guesses.size() == q.guesses.size());
    return 0;
}
