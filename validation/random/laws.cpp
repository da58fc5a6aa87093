#include "validation/random/laws.hpp"

#include <algorithm>
#include <cmath>
#include <exception>

namespace amontons::validation {

double value_at(const Json& curve, double time)
{
    if (curve.is_number()) return curve.get<double>();
    const auto at = [&](std::size_t i, std::size_t k) { return curve.at(i).at(k).get<double>(); };
    if (time <= at(0, 0)) return at(0, 1);
    for (std::size_t i = 1; i < curve.size(); ++i)
        if (time <= at(i, 0))
            return at(i - 1, 1) +
                   (at(i, 1) - at(i - 1, 1)) * (time - at(i - 1, 0)) / (at(i, 0) - at(i - 1, 0));
    return at(curve.size() - 1, 1);
}

std::vector<WrittenContact> contacts_of(const WrittenRun& run, const WrittenFrame& frame)
{
    std::vector<WrittenContact> list;
    const auto part = frame.parts.find("contacts");
    if (part == frame.parts.end()) return list;
    const VtkText& c = part->second;
    for (std::size_t i = 0; i < c.points(); ++i) {
        const auto body = [&](const char* which) {
            return run.bodies.at(static_cast<std::size_t>(c.get(which).values[i]));
        };
        list.push_back({c.get("Points/points").vector(i), c.get("PointData/force").vector(i),
                        c.get("PointData/normal").vector(i), c.get("PointData/slip").vector(i),
                        c.get("PointData/gap").values[i],
                        static_cast<int>(c.get("PointData/status").values[i]),
                        body("PointData/body_a"), body("PointData/body_b")});
    }
    return list;
}

const Json* pair_of(const WrittenRun& run, const std::string& a, const std::string& b)
{
    const Json* other = nullptr;
    for (const Json& pair : run.scene().at("contact")) {
        const std::string x = pair.at("between").at(0), y = pair.at("between").at(1);
        if ((x == a && y == b) || (x == b && y == a)) return &pair;
        const auto fits = [](const std::string& word, const std::string& name) {
            return word == "*" || word == name;
        };
        if ((fits(x, a) && fits(y, b)) || (fits(x, b) && fits(y, a))) other = &pair;
    }
    return other;
}

RunScale scale_of(const WrittenRun& run)
{
    RunScale scale;
    scale.accuracy = run.scene().at("accuracy").value("contact", 1e-8);
    const WrittenHistory& h = run.history;
    for (std::size_t c = 0; c < h.names.size(); ++c)
        if (h.units[c] == "N" && h.names[c].find("violation") == std::string::npos)
            for (const std::vector<double>& row : h.rows)
                scale.force = std::max(scale.force, std::abs(row[c]));
    Vec3 low = Vec3::Constant(1e300), high = -low;
    for (const WrittenFrame& frame : run.frames)
        for (const WrittenContact& c : contacts_of(run, frame))
            scale.force = std::max(scale.force, c.force.norm());
    for (const WrittenFrame* frame : {&run.frames.front(), &run.frames.back()})
        for (const auto& [name, part] : frame->parts) {
            const auto body = run.body.find(name);
            if (body == run.body.end() || body->second.at("kind") == "obstacle") continue;
            for (std::size_t i = 0; i < part.points(); ++i) {
                low = low.cwiseMin(part.get("Points/points").vector(i));
                high = high.cwiseMax(part.get("Points/points").vector(i));
            }
        }
    scale.length = high.x() >= low.x() ? (high - low).norm() : 0;
    // Displacements are differences of places: their rounding strains a solid by 1e-16 of its size
    // over an element.
    constexpr double kRounding = 1e-13;
    for (const auto& [name, body] : run.body) {
        if (body.at("kind") == "solid") {
            double e = body.value("youngs_modulus", 0.0);
            if (body.contains("material"))
                e = body.at("material")
                        .value("youngs_modulus", 1e3 * body.at("material").value("c1", 0.0));
            scale.rounding = std::max(scale.rounding, kRounding * e * scale.length * scale.length);
        }
        for (const Json& s : body.value("segments", Json::array())) {
            const Json ei = s.value("EI", Json(0.0));
            const double bending = ei.is_array() ? ei.at(0).get<double>() : ei.get<double>();
            const double r = s.at("radius"), stretching = s.contains("EA") && s.at("EA").is_number()
                                                              ? s.at("EA").get<double>()
                                                              : 4 * bending / (r * r);
            scale.rounding = std::max(scale.rounding, kRounding * stretching);
        }
    }
    return scale;
}

std::vector<Finding> check_laws(const WrittenRun& run)
{
    std::vector<Finding> all;
    const std::pair<const char*, std::vector<Finding> (*)(const WrittenRun&)> laws[] = {
        {"sums", check_sums},
        {"balance", check_balance},
        {"balance", check_sheaths},
        {"Coulomb", check_coulomb},
        {"complementarity", check_complementarity},
        {"overlap", check_overlap},
        {"energy", check_energy},
        {"momentum", check_momentum},
        {"joints", check_joints}};
    for (const auto& [name, law] : laws)
        try {
            const std::vector<Finding> found = law(run);
            all.insert(all.end(), found.begin(), found.end());
        } catch (const std::exception& error) { // files that a law cannot read are at fault, too
            all.push_back({"files", std::string(name) + ": " + error.what()});
        }
    return all;
}

} // namespace amontons::validation
