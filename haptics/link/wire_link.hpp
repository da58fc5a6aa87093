#pragma once

#include "haptics/link/handle_link.hpp"

namespace amontons {

/// The scene's handle is a beam or a rod.
bool holds_wire(const Scene& scene);

/// A scene of walls and one wire with its base in the hand: a beam, pushed and twisted at its
/// introducer, endless; or a rod, its start moved in space. A spring between the two is part of the
/// wire.
class WireLink final : public HandleLink {
public:
    /// @throws InputError  if the wire cannot be held
    WireLink(const Scene& scene, const std::vector<Obstacle>& obstacles,
             const LinkOptions& options);
    ~WireLink() override;

    HandPose start() const override;
    Vec6 path(double t) const override;
    Vec3 axis() const override;
    const std::vector<Issue>& warnings() const override;
    bool step(const HandPose& device) override;
    bool take_over(const HandleLink& before) override;
    std::vector<BeamRecord> beam_records() const override;
    std::vector<ContactRecord> contact_records() const override;
    HandPose device() const override;
    Wrench force() const override;
    std::string refusal() const override;

private:
    Condensed condense_step(int most) override;
    StepRecord record() const;

    struct State;
    std::unique_ptr<State> state_;
};

} // namespace amontons
