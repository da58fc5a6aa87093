#include "validation/random/variants.hpp"

#include "validation/random/change_scene.hpp"
#include "validation/random/geometry.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fmt/format.h>
#include <map>

namespace amontons::validation {
namespace {

constexpr double kSameTime = 1e-9; ///< of the run

bool ends_with(const std::string& text, const std::string& tail)
{
    return text.size() >= tail.size() &&
           text.compare(text.size() - tail.size(), tail.size(), tail) == 0;
}

bool is_clock(const std::string& column)
{
    return column.find("seconds") != std::string::npos || column == "remark";
}

/// Columns that state how an answer was found, or sizes of rounding errors.
bool is_of_the_way(const std::string& name)
{
    static const char* const words[] = {
        "certificate",      "worst_", "contacts",     "iterations",    "factorisations",
        "retries",          "step",   "energy_error", "work_absolute", "released",
        "angular_momentum", "time",   "max_pressure", "negative"};
    return is_clock(name) || std::any_of(std::begin(words), std::end(words), [&](const char* w) {
               return name.find(w) != std::string::npos;
           });
}

/// The longest of the names that a text has at a place, before an underscore; nullptr: none. Names
/// may begin with one another: "rod" and "rod_head".
template <class List, class NameOf>
auto longest_name(const List& list, NameOf name_of, const std::string& text, std::size_t at)
{
    decltype(&*list.begin()) best = nullptr;
    for (const auto& entry : list) {
        const std::string& name = name_of(entry);
        if (text.compare(at, name.size() + 1, name + "_") == 0 &&
            (!best || name.size() > name_of(*best).size()))
            best = &entry;
    }
    return best;
}

/// The name of a column after its bodies got other names.
std::string renamed_column(const std::string& column, const Variant& v)
{
    const auto former = [](const auto& names) -> const std::string& { return names.first; };
    const auto* first = longest_name(v.names, former, column, 0);
    if (!first) return column;
    const std::string rest = column.substr(first->first.size());
    for (const std::string joint : {"_on_", "_over_"}) {
        if (rest.rfind(joint, 0) != 0) continue;
        if (const auto* other = longest_name(v.names, former, rest, joint.size()))
            return first->second + joint + other->second +
                   rest.substr(joint.size() + other->first.size());
    }
    return first->second + rest;
}

/// "a_on_b_force_x" as "b_on_a_force_x", or "".
std::string swapped_pair(const std::string& column, const WrittenRun& run)
{
    const std::size_t on = column.find("_on_");
    if (on == std::string::npos) return "";
    const auto itself = [](const std::string& name) -> const std::string& { return name; };
    const std::string* b = longest_name(run.bodies, itself, column, on + 4);
    return b ? *b + "_on_" + column.substr(0, on) + column.substr(on + 4 + b->size()) : "";
}

/// Whether the three columns are a place and not a displacement, a velocity or a force.
bool is_place(const std::string& stem, const std::string& unit)
{
    return unit == "m" && stem.find("displacement") == std::string::npos;
}

std::vector<Finding> compare_bits(const WrittenRun& run, const WrittenRun& other,
                                  const std::string& name)
{
    const WrittenHistory &a = run.history, &b = other.history;
    if (a.names != b.names || a.rows.size() != b.rows.size())
        return {{name, fmt::format("{} steps instead of {}, or other columns", b.rows.size() - 1,
                                   a.rows.size() - 1)}};
    for (std::size_t i = 0; i < a.rows.size(); ++i)
        for (std::size_t c = 0; c < a.names.size(); ++c)
            if (!is_clock(a.names[c]) && a.rows[i][c] != b.rows[i][c] &&
                !(std::isnan(a.rows[i][c]) && std::isnan(b.rows[i][c])))
                return {{name, fmt::format("step {}: {} is {:.17g}, was {:.17g}", i, a.names[c],
                                           b.rows[i][c], a.rows[i][c])}};
    for (const auto& [part, file] : run.frames.back().parts) {
        const auto at = other.frames.back().parts.find(part);
        if (at == other.frames.back().parts.end()) return {{name, "the last frame has no " + part}};
        for (const auto& [array, values] : file.arrays)
            if (const WrittenArray* there = at->second.find(array);
                !there || there->values != values.values)
                return {{name, fmt::format("the last frame of {} has another {}", part, array)}};
    }
    return {};
}

/// What a run states itself that its forces may be off by: contacts that jump at a step's end leave
/// up to 1 %, or several balances, between which it has measured the difference, of which up to 5 %
/// is allowed (docs/theory/certificate.md, "Contacts that jump").
double reported_difference(const WrittenRun& run)
{
    const std::string jump = "contacts jump at its end", several = "were found differ by ";
    constexpr double kMostAllowed = 0.05;
    double most = 0;
    for (const Json& w : run.manifest.value("warnings", Json::array())) {
        const std::string text = w.get<std::string>();
        if (text.find(jump) != std::string::npos) most = std::max(most, 0.01);
        if (const std::size_t at = text.find(several); at != std::string::npos)
            most = std::max(most, std::strtod(text.c_str() + at + several.size(), nullptr));
    }
    return std::min(most, kMostAllowed);
}

/// Of two turns, by their vectors: half a turn has two of them [rad].
double angle_between(const Vec3& a, const Vec3& b)
{
    return Eigen::AngleAxisd(Mat3(turn_by(a).transpose() * turn_by(b))).angle();
}

/// Number of equal steps of a scene.
int steps_of(const Json& scene)
{
    return std::max(1, static_cast<int>(std::lround(scene.at("time").at("end").get<double>() /
                                                    scene.at("time").at("step").get<double>())));
}

} // namespace

std::vector<Variant> variants_of(const RandomScene& s, std::uint64_t seed, int number)
{
    Draw draw(seed, (std::uint64_t(1) << 32) + static_cast<std::uint64_t>(number));
    std::vector<Variant> list;
    const double size = draw.ratio(0.01, 1);
    const Vec3 rotation = draw.rotation(), shift = draw.shift(size);
    // Solids that are held along the world's axes are turned by whole axes; blocks of hexahedra by
    // their meshes.
    const bool along = holds_along_axes(s.scene);
    const Mat3 q = along ? axes_moved_on() : turn_by(rotation);
    if (const std::optional<Json> turned = turned_scene(s.scene, q, shift)) {
        Variant v{along && meshes_move_with_axes(s.scene) ? "axes" : "turned", *turned};
        v.tolerance = s.same;
        v.turn = q;
        v.shift = shift;
        list.push_back(v);
    }
    {
        std::map<std::string, std::string> names;
        Variant v{"renamed", {}};
        int k = static_cast<int>(s.scene.at("bodies").size());
        for (const auto& [name, body] : s.scene.at("bodies").items())
            names[name] = fmt::format("z{}", k--);
        v.scene = renamed_scene(s.scene, names);
        v.names.assign(names.begin(), names.end());
        v.tolerance = s.same;
        list.push_back(v);
    }
    int instruments = 0; // the first of them has columns without its name
    for (const auto& [name, body] : s.scene.at("bodies").items())
        instruments += body.at("kind") == "beam";
    if (s.scene.at("bodies").size() > 1 && instruments < 2) {
        Variant v{"reordered", reordered_scene(s.scene)};
        v.tolerance = std::max(s.same, s.order);
        list.push_back(v);
    }
    const auto power = [&](int most) { return std::ldexp(1.0, draw.whole(-most, most)); };
    OtherUnits units;
    units.length = power(8);
    units.force = power(10);
    units.time = s.scene.at("time").value("kind", "") == "dynamic" ? power(6) : 1;
    if (const std::optional<Json> other = scene_in_units(s.scene, units)) {
        Variant v{"units", *other};
        v.tolerance = s.units;
        v.length = units.length;
        v.force = units.force;
        v.time = units.time;
        list.push_back(v);
    }
    {
        Variant v{"threads", s.scene};
        v.threads = 2;
        list.push_back(v);
    }
    const int now = steps_of(s.scene);
    int other = now;
    while (other == now)
        other = draw.one_of({1, 2, 3, 4, 6, 8, 12});
    if (s.steps > 0) {
        Variant v{"steps", s.scene};
        v.scene["time"]["step"] = s.scene.at("time").at("end").get<double>() / other;
        v.tolerance = s.steps;
        v.forces_only = true;
        list.push_back(v);
    }
    {
        Variant v{"resumed", s.scene};
        v.killed_after = draw.real(0.3, 0.9);
        list.push_back(v);
    }
    for (const Twin& twin : s.twins) {
        Variant v{twin.name, twin.scene};
        v.tolerance = twin.tolerance;
        v.forces_only = true;
        list.push_back(v);
    }
    return list;
}

namespace {

/// Sums over the steps, of which each has an error of quadrature.
bool is_sum_over_steps(const std::string& name)
{
    return name == "work" || name == "friction";
}

/// What two runs state that they missed of the energy where their steps are not the same: the sum
/// of both over the intervals between times that they share.
double missed_in_other_steps(const WrittenRun& run, const WrittenRun& other,
                             const OtherUnits& units)
{
    const std::vector<double> t = run.history.values("time"), s = other.history.values("time"),
                              e = run.history.values("energy_error"),
                              f = other.history.values("energy_error");
    if (e.size() != t.size() || f.size() != s.size()) return 0;
    const double per_energy = factor_of("J", units);
    double missed = 0;
    for (std::size_t i = 1, j = 1, i0 = 0, j0 = 0; i < t.size() && j < s.size();) {
        const double apart = s[j] / units.time - t[i];
        if (std::abs(apart) > kSameTime * t.back()) {
            ++(apart < 0 ? j : i);
            continue;
        }
        if (i - i0 > 1 || j - j0 > 1)
            missed += std::abs(e[i] - e[i0]) + std::abs(f[j] - f[j0]) / per_energy;
        i0 = i++;
        j0 = j++;
    }
    return missed;
}

} // namespace

bool took_other_steps(const WrittenRun& run, const WrittenRun& other, double units)
{
    const std::vector<double> a = run.history.values("time"), b = other.history.values("time");
    if (a.size() != b.size()) return true;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (std::abs(b[i] / units - a[i]) > kSameTime * a.back()) return true;
    return false;
}

StepError step_error(const WrittenRun& run, const std::vector<WrittenRun>& others)
{
    constexpr double kSafety = 2; // the error of first order is twice what half the step changes
    const WrittenHistory& a = run.history;
    StepError left;
    for (const WrittenRun& f : others) {
        const WrittenHistory& b = f.history;
        for (const std::string& name : a.names) {
            if (is_of_the_way(name) || b.column(name) < 0) continue;
            const std::string stem = name.substr(0, name.size() - 2);
            double& most = left[a.has_vector(stem) ? stem : name];
            double apart = 0;
            if (!a.has_vector(stem)) {
                apart = std::abs(b.last(name) - a.last(name));
            } else {
                const Vec3 here = a.vector(stem, a.rows.size() - 1),
                           there = b.vector(stem, b.rows.size() - 1);
                apart =
                    ends_with(stem, "_turn") ? angle_between(here, there) : (there - here).norm();
            }
            most = std::max(most, kSafety * apart);
        }
    }
    return left;
}

std::vector<Finding> compare_runs(const WrittenRun& run, const WrittenRun& other, const Variant& v,
                                  const StepError& left)
{
    if (v.tolerance == 0) return compare_bits(run, other, v.name);
    const WrittenHistory &a = run.history, &b = other.history;
    const OtherUnits units{v.length, v.force, v.time};
    const auto moved_column = [](std::string name) { // of a block whose axes moved on
        for (const char* set : {"_x_min_", "_x_max_", "_y_min_", "_y_max_", "_z_min_", "_z_max_"})
            if (const std::size_t at = name.find(set); at != std::string::npos) {
                name.replace(at + 1, 5, moved_set(name.substr(at + 1, 5)));
                break;
            }
        return name;
    };
    // ---- Scales and tolerances by unit
    std::map<std::string, double> scale; // largest value of a unit
    for (std::size_t c = 0; c < a.names.size(); ++c)
        if (!is_of_the_way(a.names[c]))
            for (const std::vector<double>& row : a.rows)
                scale[a.units[c]] = std::max(scale[a.units[c]], std::abs(row[c]));
    scale["m"] = std::max(scale["m"], scale_of(run).length);
    scale["N"] = std::max(scale["N"], scale_of(run).force);
    scale["J"] = std::max(scale["J"], a.last("work_absolute"));
    scale[""] = scale["rad"] = 1;
    // Negligible moments are compared with the scale that they could have.
    scale["N m"] = std::max(scale["N m"], scale["N"] * scale["m"]);
    if (scale["m"] > 0) scale["rad/s"] = std::max(scale["rad/s"], scale["m/s"] / scale["m"]);

    const double rounding = 10 * scale_of(run).rounding;
    const double least_energy = scale_of(run).accuracy * scale["N"] * scale["m"];
    const double tolerance =
        std::max({v.tolerance, reported_difference(run), reported_difference(other)});
    const double missed = missed_in_other_steps(run, other, units);
    // ---- Comparison of one number; the worst is kept
    double worst = tolerance;
    std::vector<Finding> found;
    const auto judge = [&](const std::string& name, double value, double there,
                           const std::string& unit, const std::string& column) {
        const double difference = std::abs(value - there);
        if (const auto of = left.find(column); of != left.end() && difference <= of->second) return;
        if (unit == "N" && difference <= rounding) return;
        if (unit == "N m" && difference <= rounding * scale["m"]) return;
        if (is_sum_over_steps(name) && difference <= missed) return;
        if (unit == "J" && difference <= least_energy + rounding * scale["m"]) return;
        if (scale[unit] == 0) return;
        const double off = difference / scale[unit];
        if (off <= worst) return;
        worst = off;
        found = {
            {v.name, fmt::format("{} is {:.9g}, was {:.9g} (of {:.3g} {}: {:.2g}, allowed {:.2g})",
                                 name, there, value, scale[unit], unit, off, tolerance)}};
    };
    // ---- The column of the other run
    const auto column_of = [&](const std::string& name, double& sign) {
        sign = 1;
        if (v.length != 1)
            return b.names.size() == a.names.size() ? a.column(name) : -1; // names have arc lengths
        const std::string here = renamed_column(name, v);
        // Where all blocks are moved, a set's own name stands for another one there.
        int c = b.column(v.name == "axes" ? moved_column(here) : here);
        if (c < 0)
            c = b.column(v.name == "axes" || v.turn.isIdentity() ? here : moved_column(here));
        if (c < 0) {
            c = b.column(swapped_pair(here, other));
            sign = -1;
        }
        return c;
    };
    // ---- Columns, vectors as a whole
    for (std::size_t c = 0; c < a.names.size(); ++c) {
        const std::string& name = a.names[c];
        const std::string& unit = a.units[c];
        const double factor = factor_of(unit, units);
        if (is_of_the_way(name) || factor == 0 ||
            (v.length != 1 && ends_with(name, "clustered_force")) || (v.forces_only && unit != "N"))
            continue;
        double sign = 1;
        const int there = column_of(name, sign);
        if (there < 0) {
            found = {{v.name, "no column " + name + " in history.csv"}};
            return found;
        }
        const std::string stem = name.substr(0, name.size() - 2);
        const bool vector =
            ends_with(name, "_x") && a.has_vector(stem) && a.column(stem + "_z") >= 0;
        const bool part = (ends_with(name, "_y") || ends_with(name, "_z")) && a.has_vector(stem);
        if (part) continue;
        if (!vector) {
            judge(name, a.rows.back()[c], b.rows.back()[std::size_t(there)] / factor, unit, name);
            continue;
        }
        Vec3 value = v.turn * a.vector(stem, a.rows.size() - 1), now;
        if (is_place(stem, unit)) value += v.shift;
        for (int k = 0; k < 3; ++k) {
            const int axis = column_of(stem + "_" + "xyz"[k], sign);
            now[k] = axis < 0 ? std::nan("") : sign * b.rows.back()[std::size_t(axis)] / factor;
        }
        if (ends_with(stem, "_turn")) {
            judge(stem, 0, angle_between(value, now), unit, stem);
            continue;
        }
        // A pair's force is reported on the first of the two, whichever of the names comes first.
        for (int k = 0; k < 3; ++k)
            judge(stem + "_" + "xyz"[k], value[k], now[k], unit, stem);
    }
    return found;
}

} // namespace amontons::validation
