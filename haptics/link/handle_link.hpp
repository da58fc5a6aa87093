#pragma once

#include "haptics/link/condensed.hpp"
#include "solver/scene/scene.hpp"
#include "solver/step/simulation.hpp"

#include <memory>

namespace amontons {

/// How the simulation's side is run.
struct LinkOptions {
    HandleSpring spring;
    ReductionOptions condense; ///< its period is the simulation's step
    std::string cache;         ///< folder of factors; "": none
    int threads = 1;
    /// A wire in space that snaps does so over several steps, so that each is in time. Else within
    /// the step in which the snap begins, however long it takes.
    bool snap_in_parts = false;
    double duration = 10; ///< about how long it will run [s]
};

/// A scene with one of its bodies in the hand: steps for device poses, and the reduced operator
/// after each. One derived class for each kind of simulation.
class HandleLink {
public:
    virtual ~HandleLink() = default;

    /// Of the handle when the run begins.
    virtual HandPose start() const = 0;
    /// The motion prescribed by the drive of the handle at time t [s]: shift [m] and turn [rad]
    /// from the start, for every t.
    virtual Vec6 path(double t) const = 0;
    /// Axis along and about which a device of one push and one twist moves the handle, a unit
    /// vector; zero: the handle moves freely in space.
    virtual Vec3 axis() const { return Vec3::Zero(); }
    /// Warnings about the scene's files: values that are valid but probably not intended.
    virtual const std::vector<Issue>& warnings() const = 0;

    /// A step of one period (the first: of none) with the device there at its end. Where it is
    /// refused, it is tried half way to the device, and so on; false if no step is accepted:
    /// nothing has then moved.
    virtual bool step(const HandPose& device) = 0;
    /// The operator of the last step. Allocates; for the simulation's thread.
    /// @param time  when that pose was read [s]
    template <class Real>
    bool publish(ReducedOperator<Real>& op, double time, std::uint64_t sequence);

    /// Continues where another link is, with what its scene specifies now: the same bodies with
    /// other materials, holds or loads.
    /// @return  false if the bodies are not the same; nothing is taken over then
    virtual bool take_over(const HandleLink& before) = 0;

    /// Shapes and fields of all bodies now, and the forces between them.
    virtual std::vector<BeamRecord> beam_records() const { return {}; }
    /// Bodies, as the step records have them.
    virtual std::vector<BodyRecord> body_records() const { return {}; }
    /// Contacts of the last step.
    virtual std::vector<ContactRecord> contact_records() const = 0;

    virtual HandPose device() const = 0;     ///< of the last step
    virtual Wrench force() const = 0;        ///< of the full simulation on the hand
    virtual std::string refusal() const = 0; ///< of the last try that was not accepted
    const Condensed& condensed() const { return condensed_; } ///< what publish() handed over

    void set_most_contacts(int most) { most_contacts_ = most; } ///< of the operators to come
    /// Steps so far.
    int steps() const { return count_.steps; }
    int refused() const { return count_.refused; }        ///< tries that were not accepted
    int most_left_out() const { return count_.left_out; } ///< candidates that are not handed over
    /// Number of steps that reached at most half of the way to the device.
    int not_touched() const { return count_.not_touched; }
    int snapping() const { return count_.snapping; } ///< steps that a snap continued beyond
    /// Of the simulation [s].
    double time() const { return count_.time; }

protected:
    struct Count {
        int steps = 0, refused = 0, not_touched = 0, snapping = 0, left_out = 0;
        double time = 0; ///< [s]
    };
    HandleLink(const ReductionOptions& condense)
        : condense_(condense)
        , most_contacts_(condense.most_contacts)
    {
    }
    /// @param most  contacts to hand over
    virtual Condensed condense_step(int most) = 0;

    ReductionOptions condense_;
    Count count_;

private:
    Condensed condensed_;
    int most_contacts_;
};

/// The link for the body that a scene names.
/// @throws InputError  if the scene has no handle, or one that cannot be held; as the simulations
std::unique_ptr<HandleLink> make_link(const Scene& scene, const std::vector<Obstacle>& obstacles,
                                      const LinkOptions& options);

/// A share of the way from one pose to another.
HandPose between(const HandPose& a, const HandPose& b, double share);

extern template bool HandleLink::publish(ReducedOperator<float>&, double, std::uint64_t);
extern template bool HandleLink::publish(ReducedOperator<double>&, double, std::uint64_t);

} // namespace amontons
