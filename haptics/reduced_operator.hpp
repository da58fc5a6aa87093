#pragma once

#include "contact/problem.hpp"
#include "contact/solvers/local.hpp"
#include "haptics/pose.hpp"

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

// What the simulation hands to the haptic loop after each step.

namespace amontons {

constexpr int kMostPathSamples = 24; ///< samples on a path
constexpr int kMostPaths = 6;        ///< paths of an operator

/// Linear interpolation between the samples of a path: between sample `sample` - 1 (for 0: the pose
/// itself) and sample `sample`, with these weights.
struct PathBlend {
    /// Number of the sample beyond the displacement.
    int sample = 0;
    /// Weights of sample `sample` - 1 and of sample `sample`.
    double before = 0, there = 0;
};

/// Parts of q(d) and of `rest` beyond first order along a path that the hand may follow, at samples
/// of s = ahead . x, x the displacement; linear between samples.
struct SampledPath {
    Vec6 ahead = Vec6::Zero();                 ///< [1/m], [1/rad]
    bool backwards = false;                    ///< s < 0 counts, too: as on a circle
    int samples = 0;                           ///< number of samples; 0: none
    std::array<double, kMostPathSamples> at{}; ///< s of them, rising, > 0 [-]
    std::array<Wrench, kMostPathSamples> rest;
    std::vector<Vec3> bend; ///< of q: kMostPathSamples of each contact [m]
};

/// A contact that is closed, or may close before the next operator comes.
struct CandidateContact {
    std::int64_t id = 0;           ///< the same for the same contact in every operator
    Mat3 frame = Mat3::Identity(); ///< columns n, t1, t2 in world axes, at the operator's pose
    double mu = 0;                 ///< [-], >= 0
    Vec3 q{0, 0, 0};               ///< gap and slip of the free motion at the pose [m]
    Vec3 r{0, 0, 0};               ///< reaction at the pose: the warm start [N]
    /// du / d(handle): 3 x 6, translation [-] and rotation vector [m/rad] about the handle's
    /// origin.
    Eigen::Matrix<double, 3, 6> J = Eigen::Matrix<double, 3, 6>::Zero();
    /// The handle is a rigid body that carries the point: q(d) is then taken by the exact turn of
    /// `arm`, and J is that of the pose, frame^T [1, -[arm]x].
    bool rigid = false;
    Vec3 arm{0, 0, 0};  ///< from the handle's origin to the point, at the pose, world axes [m]
    bool turns = false; ///< the frame belongs to the tool, and turns with the handle
};

/// u = W r + q(d) over the candidate contacts, for handle poses d near the one it was made for.
///
/// A plain record of fixed capacity: memory is taken by the constructor, copying one of the same
/// capacity takes none. The loop works without dimensions: W / compliance, q / length and
/// r compliance / length are near one, so that single precision neither over- nor underflows and
/// the unit of length does not matter.
template <class Real> struct ReducedOperator {
    explicit ReducedOperator(int most_contacts = 0);

    int capacity = 0;                      ///< most contacts
    int contacts = 0;                      ///< those in use, n
    std::vector<CandidateContact> contact; ///< capacity; the first n count
    /// W / compliance by columns, 3n columns of `stride` numbers: 3n of them used, the rest 0.
    /// Lines of 64 bytes, so that each column starts on one.
    struct alignas(64) Line {
        Real number[64 / sizeof(Real)];
    };
    /// W by columns, in the order of memory.
    std::vector<Line> W;
    int stride = 0;                ///< a multiple of 64 bytes
    std::vector<Mat3> own;         ///< W_ii / compliance in single precision; the first n count
    std::vector<LocalBlock> block; ///< the same prepared: a tick has no time for it

    double compliance = 1; ///< trace(W) / 3n [m/N]
    double length = 1;     ///< [m]

    /// Force on the handle besides the contacts' J^T r: at the pose, and the stiffness by which it
    /// decreases with the handle's displacement. Zero for a handle on which only contacts act.
    Wrench rest;
    Mat6 stiffness = Mat6::Zero(); ///< [N/m], [N], [N m/rad]
    /// Paths that the hand may follow, the present direction first: the number in use, and memory
    /// for as many as were needed so far.
    int ways = 0;
    std::vector<SampledPath> way;
    /// The s of way[0] at which the body in the hand loses its stability; from then on after[0] is
    /// used, whatever s is later. Infinite: it stays stable.
    double jump_at = std::numeric_limits<double>::infinity();
    std::vector<ReducedOperator> after; ///< none until one was needed, then one, of this capacity

    HandPose handle;            ///< the pose that q, J, frames and r belong to
    double validity = 0;        ///< handle motion within which the set of contacts is complete [m]
    double period = 0;          ///< of the simulation: when the next one is due [s]
    double time = 0;            ///< when `handle` was read, on the loop's clock [s]
    std::uint64_t sequence = 0; ///< counts publications; 0: none yet

    /// A column of W, 3n numbers.
    Real* column(int j) { return W.data()->number + std::ptrdiff_t{j} * stride; }
    const Real* column(int j) const { return W.data()->number + std::ptrdiff_t{j} * stride; }
};

/// Puts W over n contacts in place and chooses the scales. Set the contacts first: their q and the
/// validity give the length. Allocates nothing.
/// @param W  3n x 3n [m/N], symmetric PSD, rows in the order (n, t1, t2) of each contact
/// @returns  false, with no contacts left, if n exceeds the capacity or W has no positive trace
template <class Real>
bool set_delassus(ReducedOperator<Real>& op, const Eigen::Ref<const Eigen::MatrixXd>& W);

/// @param s  ahead . x [-]. Up to the first sample the bend is that of a circle.
PathBlend blend_of_samples(const SampledPath& way, double s);

/// J of a point that a rigid handle carries: frame^T [1, -[arm]x].
Eigen::Matrix<double, 3, 6> rigid_jacobian(const Mat3& frame, const Vec3& arm);

/// The spring between device and virtual tool (virtual coupling) as part of W: adds J C J^T with
/// C = diag(1/k, 1/k, 1/k, 1/k_turn, ...). The tool is then where the contacts permit, and the
/// device feels k times its distance from there: the proxy.
/// @param J  3n x 6
/// @param k  [N/m];  @param k_turn  [N m/rad]; infinite: held rigidly
void add_coupling(Eigen::Ref<Eigen::MatrixXd> W,
                  const Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, 6>>& J, double k,
                  double k_turn);

/// The same as a problem of `contact`, in double and with dimensions, at the operator's pose.
template <class Real> ContactProblem contact_problem(const ReducedOperator<Real>& op);

extern template struct ReducedOperator<float>;
extern template struct ReducedOperator<double>;

} // namespace amontons
