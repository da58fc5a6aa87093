#pragma once

#include "haptics/link/condense.hpp"
#include "solver/step/simulation.hpp"

namespace amontons {

/// How the simulation's side is run.
struct LinkOptions {
    HandleSpring spring;
    CondenseOptions condense; ///< its period is the simulation's step
    std::string cache;        ///< folder of factors; "": none
    int threads = 1;
    double duration = 10; ///< about how long it will run [s]
};

/// A scene of solids and rigid bodies with one of them in the hand: steps for device poses, and
/// the reduced operator after each.
class BodyLink {
public:
    /// @throws InputError  if the scene has no handle, or one that cannot be held; as build_bodies
    BodyLink(const Scene& scene, const std::vector<Obstacle>& obstacles,
             const LinkOptions& options);
    ~BodyLink();

    /// Of the handle when the run begins.
    HandPose start() const;
    /// What the handle's drive asks for: shift [m] and turn [rad] from the start, endless.
    Vec6 path(double t) const;
    /// What may be meant otherwise in the scene's files.
    const std::vector<Issue>& warnings() const;

    /// A step of one period (the first: of none) with the device there at its end. Where it is
    /// refused, the device is met half way, and so on; false if it cannot be met at all: nothing
    /// has then moved.
    bool step(const HandPose& device);
    /// The operator of the last step. Allocates; for the simulation's thread.
    /// @param time  when that pose was read [s]
    template <class Real>
    bool publish(ReducedOperator<Real>& op, double time, std::uint64_t sequence);

    void set_most_contacts(int most); ///< of the operators to come

    /// Goes on where another link is, with what its scene says now: the same bodies with other
    /// materials, holds or loads.
    /// @return  false if the bodies are not the same; nothing is taken over then
    bool take_over(const BodyLink& before);

    /// What all bodies look like now, and the forces between them.
    std::vector<BodyRecord> body_records() const;
    std::vector<ContactRecord> contact_records() const;

    const HeldBody& held() const;         ///< pose and force of the full simulation
    const BodyStepReport& report() const; ///< of the last step
    const Condensed& condensed() const;   ///< what publish() handed over
    int steps() const;
    int refused() const;       ///< tries that were not accepted
    int most_left_out() const; ///< candidates beyond the most that are handed over
    int not_met() const;       ///< steps that met the device half way at most, or not at all
    double time() const;

private:
    struct State;
    std::unique_ptr<State> state_;
};

extern template bool BodyLink::publish(ReducedOperator<float>&, double, std::uint64_t);
extern template bool BodyLink::publish(ReducedOperator<double>&, double, std::uint64_t);

} // namespace amontons
