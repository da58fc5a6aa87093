#include "solver/scene/json_text.hpp"
#include "solver/step/plan.hpp"

namespace amontons {

std::string plan_json(const Plan& plan)
{
    JsonText json;
    json.open('{').key("bodies").open('[');
    for (const BodyPlan& b : plan.bodies) {
        json.open('{').member("name", b.name).member("kind", b.kind).member("unknowns", b.unknowns);
        if (!b.sets.empty()) {
            json.key("sets").open('[');
            for (const SetSize& s : b.sets)
                json.open('{')
                    .member("name", s.name)
                    .member("faces", s.faces)
                    .member("nodes", s.nodes)
                    .member("area", s.area)
                    .close('}');
            json.close(']');
        }
        json.close('}');
    }
    json.close(']').key("surfaces").open('[');
    for (const Plan::Surface& s : plan.surfaces) {
        json.open('{').member("name", s.name).member("side", s.facts.side);
        if (s.facts.volume) json.member("volume", *s.facts.volume);
        json.member("holes", s.facts.holes).member("triangles", s.facts.triangles).close('}');
    }
    json.close(']').key("pairs").open('[');
    for (const Plan::Pair& p : plan.pairs) {
        json.open('{').member("a", p.a).member("b", p.b).member("law", p.law);
        json.member("friction", p.friction).close('}');
    }
    json.close(']').key("uses").open('[');
    for (const std::string& u : plan.uses)
        json.value(u);
    json.close(']').key("leaves_out").open('[');
    for (const Plan::LeftOut& l : plan.leaves_out)
        json.open('{').member("what", l.what).member("why", l.why).close('}');
    json.close(']')
        .key("predicted")
        .open('{')
        .member("memory", plan.memory)
        .member("picture_memory", plan.picture)
        .member("path", plan.path);
    const LinearPlan& linear = plan.linear;
    if (!linear.paths.empty()) {
        json.member("available_memory", linear.available).key("linear").open('{');
        json.member("asked", linear.requested)
            .member("taken", linear.taken)
            .member("why", linear.why);
        json.member("refusal", linear.refusal).key("paths").open('[');
        for (const LinearPath& p : linear.paths)
            json.open('{')
                .member("name", p.name)
                .member("possible", p.possible)
                .member("why", p.why)
                .member("memory", p.memory)
                .member("seconds", p.seconds)
                .close('}');
        json.close(']').close('}');
    }
    json.close('}').close('}');
    return json.text() + "\n";
}

} // namespace amontons
