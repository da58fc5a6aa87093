#pragma once

#include "haptics/link/handle_link.hpp"
#include "haptics/link/held_body.hpp"
#include "solver/step/body_step.hpp"

namespace amontons {

/// A scene of solids and rigid bodies with one of them in the hand.
class BodyLink final : public HandleLink {
public:
    /// @throws InputError  if the scene has no handle, or one that cannot be held; as build_bodies
    BodyLink(const Scene& scene, const std::vector<Obstacle>& obstacles,
             const LinkOptions& options);
    ~BodyLink() override;

    HandPose start() const override;
    Vec6 path(double t) const override;
    const std::vector<Issue>& warnings() const override;
    bool step(const HandPose& device) override;
    bool take_over(const HandleLink& before) override;
    std::vector<BeamRecord> beam_records() const override;
    std::vector<BodyRecord> body_records() const override;
    std::vector<ContactRecord> contact_records() const override;
    HandPose device() const override;
    Wrench force() const override;
    std::string refusal() const override;

    const HeldBody& held() const;         ///< pose and force of the full simulation
    const BodyStepReport& report() const; ///< of the last step

private:
    Condensed condense_step(int most) override;

    struct State;
    std::unique_ptr<State> state_;
};

} // namespace amontons
