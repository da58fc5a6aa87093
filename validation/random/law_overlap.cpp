// How deep bodies stand in each other, on their written surfaces.

#include "validation/random/geometry.hpp"
#include "validation/random/laws.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>
#include <optional>

namespace amontons::validation {
namespace {

constexpr int kFrames = 6; ///< that are measured, spread over the run

/// What is allowed where two bodies stand deepest in each other [m]: without a warning, and ever.
/// The table of docs/theory/certificate.md, with 5 % for the places that are measured.
struct Allowed {
    double silent = 0, ever = 0;
};

Allowed allowed_depth(const PlacedBody& a, const PlacedBody& b, double face, double rounding)
{
    const auto thin = [](const PlacedBody& p) { return p.thickness > 0 ? p.thickness : 1e300; };
    const double thinner = std::min(thin(a), thin(b));
    const auto slender = [](const PlacedBody& p) { return p.kind == "rod" || p.kind == "beam"; };
    Allowed allowed;
    if (slender(a) || slender(b)) {
        const double radius =
            0.5 * std::min(slender(a) ? a.thickness : 1e300, slender(b) ? b.thickness : 1e300);
        allowed = {0.01 * radius, 0.5 * radius};
    } else if (face > 0) {
        // A flat side takes the other's curvature where they touch.
        const double curvature =
            std::max(a.curvature + b.curvature, 2 * std::min(a.curvature, b.curvature));
        allowed = {std::max(0.125 * face * face * curvature, 0.01 * face),
                   0.1 * std::min(thinner, face)};
        allowed.silent = std::min(allowed.silent, allowed.ever);
    } else {
        allowed = {0.001 * thinner, 0.1 * thinner};
    }
    return {1.05 * allowed.silent + rounding, 1.05 * allowed.ever + rounding};
}

/// Pairs of bodies that are measured.
bool measured(const WrittenRun& run, const std::string& a, const std::string& b)
{
    const Json* pair = pair_of(run, a, b);
    if (!pair || pair->contains("foundation") || pair->value("sliding", "") == "small")
        return false;
    if (pair->contains("surfaces")) // parts of bodies have sides only over their faces
        for (const Json& s : pair->at("surfaces"))
            if (!s.get<std::string>().empty()) return false;
    const auto kind = [&](const std::string& name) {
        return run.body.at(name).at("kind").get<std::string>();
    };
    const bool lines =
        (kind(a) == "rod" || kind(a) == "beam") && (kind(b) == "rod" || kind(b) == "beam");
    if (lines || (kind(a) == "obstacle" && kind(b) == "obstacle")) return false;
    if (run.scene().contains("couplings"))
        for (const Json& c : run.scene().at("couplings"))
            if ((c.at("between").at(0) == a && c.at("between").at(1) == b) ||
                (c.at("between").at(0) == b && c.at("between").at(1) == a))
                return false;
    return true;
}

} // namespace

std::vector<Finding> check_overlap(const WrittenRun& run)
{
    const RunScale scale = scale_of(run);
    std::optional<Finding> worst;
    double share = 1;
    const std::size_t every = std::max<std::size_t>(1, run.frames.size() / kFrames);
    for (std::size_t k = run.frames.size(); k-- > 0;) {
        if (k > 0 && (run.frames.size() - 1 - k) % every != 0) continue;
        std::vector<PlacedBody> bodies;
        for (const std::string& name : run.bodies)
            if (run.body.at(name).at("kind") == "obstacle" || run.frames[k].parts.count(name))
                bodies.push_back(place_body(run, name, run.frames[k]));
        for (std::size_t i = 0; i < bodies.size(); ++i)
            for (std::size_t j = i + 1; j < bodies.size(); ++j) {
                if (!measured(run, bodies[i].name, bodies[j].name)) continue;
                const DeepestPlace d = deepest_place(bodies[i], bodies[j]);
                const Allowed allowed =
                    allowed_depth(bodies[i], bodies[j], d.face, 1e-7 * scale.length);
                const double limit = run.warnings() > 0 ? allowed.ever : allowed.silent;
                if (d.depth <= share * limit) continue;
                share = d.depth / limit;
                worst = Finding{"overlap",
                                fmt::format("{} and {} stand {:.3g} m in each other at t = {:g} s, "
                                            "at ({:.4g}, {:.4g}, {:.4g}), {:.3g} m is allowed{}",
                                            bodies[i].name, bodies[j].name, d.depth,
                                            run.frames[k].time, d.at.x(), d.at.y(), d.at.z(), limit,
                                            run.warnings() > 0 ? "" : " without a warning")};
            }
    }
    if (!worst) return {};
    return {*worst};
}

} // namespace amontons::validation
