#include "solver/scene/haptic_fields.hpp"

#include "solver/scene/declare.hpp"

#include <algorithm>
#include <fmt/format.h>

namespace amontons {
namespace {

using namespace declare;

ObjectDeclaration declare_hand()
{
    using H = HandInput;
    return {"The simulated hand: a mass that a spring and a damper draw along its path",
            {field<&H::mass>("mass", "kg", positive(), "Of hand and arm."),
             field<&H::damping>("damping", "N s/m", at_least(0), "Of the arm."),
             field<&H::stiffness>("stiffness", "N/m", positive(), "Of the arm.")},
            "",
            {},
            defaults_of<H>()};
}

} // namespace

ObjectDeclaration declare_haptic()
{
    using H = HapticInput;
    static const ObjectDeclaration hand = declare_hand();
    ObjectDeclaration d{
        "What a hand holds, for amontons haptic",
        {required(text<&H::handle>("handle", "The body that the device moves. Its drive, if it has "
                                             "one, is the path of the simulated hand.")),
         fallback("that of the body",
                  choice({"rigid", "elastic", "beam"},
                         text<&H::kind>("kind", "What the handle is: a rigid body, a solid, or a "
                                                "beam held at its base."))),
         text<&H::device>("device", "Profile of the device: touch, phantom-desktop, falcon, "
                                    "omega.3 or catheter-2dof."),
         field<&H::rate>("rate", "Hz", between(100, 20000), "Of the haptic loop."),
         field<&H::simulation_rate>("simulation_rate", "Hz", between(1, 1000),
                                    "Steps of the simulation in a second."),
         fallback("chosen for the device",
                  field<&H::stiffness>("stiffness", "N/m", at_least(0),
                                       "Of the spring between device and handle.")),
         fallback("turns are held rigidly",
                  field<&H::turn_stiffness>("turn_stiffness", "N m/rad", at_least(0),
                                            "The same for turns.")),
         field<&H::damping>("damping", "N s/m", at_least(0), "Of the damper beside the spring."),
         field<&H::speed>(
             "speed", "m/s", positive(),
             "Fastest motion that is predicted: contacts that it may close before the next "
             "operator comes are handed over."),
         field<&H::ramp>("ramp", "s", between(0, 10),
                         "Time in which the force is scaled up from zero: at the start, and "
                         "after a fault. Passivity control acts meanwhile, also with "
                         "--no-control: no energy is delivered that the hand has not supplied."),
         field<&H::contacts>("contacts", "", between(1, 2000), "Largest number in an operator."),
         object<&H::hand>("hand", hand, "The simulated hand.")},
        "",
        {},
        defaults_of<H>()};
    d.complete = [](void* haptic, const std::function<bool(const char*)>&) {
        static_cast<HapticInput*>(haptic)->given = true;
    };
    d.given = [](const void* haptic) { return static_cast<const HapticInput*>(haptic)->given; };
    return d;
}

void check_haptic(const Scene& scene, Findings& findings)
{
    const HapticInput& h = scene.haptic;
    if (!h.given) return;
    const auto has = [&](const auto& bodies) {
        return std::any_of(bodies.begin(), bodies.end(),
                           [&](const auto& b) { return b.name == h.handle; });
    };
    const std::string kind = has(scene.rigids)                     ? "rigid"
                             : has(scene.solids)                   ? "elastic"
                             : has(scene.beams) || has(scene.rods) ? "beam"
                                                                   : "";
    if (kind.empty()) {
        const std::string near = nearest_name(h.handle, scene.order);
        findings.add({"/haptic/handle", "/bodies"},
                     quoted_text(h.handle) + (has(scene.obstacles) ? ", an obstacle" : ""),
                     near.empty() || has(scene.obstacles) ? "a body of the scene that moves"
                                                          : quoted_text(near) + " (nearest name)");
        return;
    }
    if (!h.kind.empty() && h.kind != kind)
        findings.add({"/haptic/kind", "/haptic/handle"}, quoted_text(h.kind),
                     fmt::format("\"{}\": that is what {} is", kind, quoted_text(h.handle)));
    for (const SolidInput& s : scene.solids)
        if (s.name == h.handle && s.hold.empty())
            findings.add({"/bodies/" + s.name + "/hold", "/haptic/handle"}, "nothing",
                         "\"hold\" with the sets that are fixed to the handle");
}

} // namespace amontons
