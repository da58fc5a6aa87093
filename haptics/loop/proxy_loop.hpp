#pragma once

#include "haptics/loop/proxy_contacts.hpp"
#include "haptics/loop/sweep_history.hpp"
#include "haptics/reduced_operator.hpp"

#include <cstdint>
#include <vector>

// One tick of the haptic loop: from the device's pose to the force on the hand.

namespace amontons {

/// Options of a tick's solution.
struct ProxyOptions {
    /// Natural-map error at which a tick ends, relative to the acting rows of q [-].
    double tolerance = 8e-4;
    int max_sweeps = 30; ///< >= 1
    /// Time of a tick, take() included, after which no further sweep begins [s]; 0: none, and no
    /// clock is read, so that the same input gives the same force.
    double budget = 0;
    double (*now)() = nullptr; ///< the clock of the budget [s]; null: the wall's
    /// Time over which the force passes to a new operator, in periods of the simulation; 0: at once
    /// [-].
    double blend = 1;
    bool extrapolate = true;            ///< start a tick from the trend of the last two reactions
    SimdLevel simd = SimdLevel::avx512; ///< or the best that there is
};

/// What a tick did.
struct ProxyTick {
    Wrench wrench;    ///< F = J^T r: on the hand [N, N m]
    double error = 0; ///< natural map at the end of the tick, relative [-]
    int sweeps = 0;
    long products = 0;      ///< columns of contacts times forces, take() included: the work done
    int contacts = 0;       ///< of the operator
    int closed = 0;         ///< those with r != 0
    int matched = 0;        ///< contacts known from the operator before, if it is new
    bool converged = false; ///< error <= tolerance
    bool new_operator = false;
    double distance = 0; ///< handle motion since the operator's pose: translation [m]
    bool valid = true;   ///< distance <= the operator's validity, if that is set
};

/// The transition from an operator to the next.
struct OperatorHandover {
    double start = 0, time = 0; ///< of what fades [s]
    Wrench jump;                ///< that the hand-over would make: fades
};
/// What outlives the operator of the contacts, by their identity.
struct ReactionMemory {
    /// Of a contact, in world axes.
    struct OfContact {
        std::int64_t id = 0;  ///< its identity
        Vec3 r{0, 0, 0};      ///< [N]
        Vec3 before{0, 0, 0}; ///< a tick earlier [N]
        double slip_time = 0; ///< [s]
    };
    std::vector<OfContact> of; ///< of fixed capacity: `count` in use, ascending by identity
    int count = 0;
    int matched = 0; ///< contacts of the present operator that were known
};

/// Solves u = W r + q(d) for the device pose d, tick after tick.
///
/// Law: Signorini and Coulomb at every contact, with u_t the slip since the tick before, which
/// is not recovered. q(d) = q + J (d - d0), for points on a rigid handle with their exact turn;
/// frames of the tool turn with it. Method: block Gauss-Seidel with the exact local solution of
/// `contact`, from the last tick's reaction; a contact whose law is satisfied costs one evaluation.
/// The transition to a new operator has no jump: see operator_update.cpp. No lock, no allocation,
/// no exception, no system call (but the clock, if there is a budget).
template <class Real> class ProxyLoop {
public:
    /// @param most_contacts  >= contacts of every operator taken; all memory is taken here
    explicit ProxyLoop(int most_contacts, const ProxyOptions& options = {});

    /// A tick begins: what take() and tick() do from here on shares its budget. Without it, the
    /// first of them begins.
    void begin();

    /// Continues with another operator, which must stay as it is until the next call.
    /// @param time  on the loop's clock [s]: when the blend starts
    /// @returns false, and keeps the old one, if it has more contacts than there is room for
    bool take(const ReducedOperator<Real>& op, double time);

    /// The force for this pose; zero until an operator was taken.
    /// @param time  on the loop's clock [s]
    ProxyTick tick(const HandPose& device, double time);

    /// Discards all reactions, as before the first contact; reactions of contacts that overlap at
    /// this pose are phased in over the blend time.
    /// @param time  on the loop's clock [s]
    void release(const HandPose& device, double time);

    /// The operator in use; nullptr before the first.
    const ReducedOperator<Real>* current() const { return contacts_.op; }
    long products() const { return contacts_.products; } ///< of this tick, so far
    /// Reaction of a contact, (n, t1, t2) of its frame in the operator [N].
    Vec3 reaction(int i) const
    {
        return contacts_.r[at(i)] * (contacts_.op->length / contacts_.op->compliance);
    }
    /// Gap and slip of a contact at the end of the last tick [m].
    Vec3 u(int i) const { return contacts_.op->length * slip_of(contacts_, i); }

private:
    static std::size_t at(int i) { return static_cast<std::size_t>(i); }
    const CandidateContact& contact(int i) const { return contacts_.op->contact[at(i)]; }
    Vec3 residual(int i) const;

    bool in_time() const;

    // proxy_loop.cpp: one pose
    void begin_operator(const ReducedOperator<Real>& op);
    bool has_jumped_by(const HandPose& device) const;
    void set_pose(const HandPose& device);
    void prepare_blocks();
    void extrapolate();
    void free_motion(double fading);
    bool is_on_cone(int i) const;
    double visit(int i, double content);
    void anchor_slip(double time);
    double error();
    double sweep();
    Wrench wrench(double fading) const;
    void clear();

    // operator_update.cpp: from one operator to the next
    void store_tick();
    void adopt(double time, bool anew);
    bool has_jumped() const;
    void start_anew();
    double fading_at(double time) const; // 1 at the hand-over, 0 after the blend

    ProxyOptions options_;
    int capacity_;
    ProxyContacts<Real> contacts_;
    SweepHistory<Real> history_;
    ClosedContacts closed_;
    double size_ = 0; // of the acting rows of q

    HandPose device_;
    Wrench last_; // of the tick before
    Vec6 moved_ = Vec6::Zero();
    std::array<PathBlend, kMostPaths> blend_; // of the operator's ways, at this pose
    Mat3 turn_ = Mat3::Identity(), prepared_turn_ = Mat3::Identity();

    OperatorHandover handover_;
    ReactionMemory memory_;
    bool taken_ = false;     // since the last tick
    bool unsettled_ = false; // an operator that start_anew() had no time for
    bool converged_ = true;  // the tick before
    bool begun_ = false;     // this tick
    double start_ = 0;       // of it, on the budget's clock [s]
};

extern template class ProxyLoop<float>;
extern template class ProxyLoop<double>;

} // namespace amontons
