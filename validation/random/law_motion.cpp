// Energy, momentum and joints.

#include "validation/random/geometry.hpp"
#include "validation/random/laws.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

constexpr double kReported = 0.01,
                 kNever = 0.1;       ///< of what a run turned over: with a warning, and never
constexpr double kJoint = 1e-6;      ///< of the scene's size
constexpr double kRecomputed = 1e-6; ///< the same energy in two ways, of what the run turned over

double largest(const std::vector<double>& values)
{
    double most = 0;
    for (const double v : values)
        most = std::max(most, std::abs(v - values.front()));
    return most;
}

/// What a run turned over, S of docs/theory/certificate.md [J].
double turned_over(const WrittenRun& run)
{
    const WrittenHistory& h = run.history;
    return h.last("work_absolute") + std::abs(h.values("kinetic").front()) +
           std::abs(h.values("elastic").front()) + largest(h.values("kinetic")) +
           largest(h.values("elastic"));
}

bool has_kind(const WrittenRun& run, std::initializer_list<const char*> kinds)
{
    for (const auto& [name, body] : run.body)
        for (const char* kind : kinds)
            if (body.at("kind") == kind) return true;
    return false;
}

bool has_couplings(const WrittenRun& run)
{
    return run.scene().contains("couplings") && !run.scene().at("couplings").empty();
}

/// Kinetic energy of all rigid bodies at a step [J]. @return false: not all is known
bool kinetic_of_rigid(const WrittenRun& run, std::size_t row, const WrittenFrame& frame,
                      double& energy)
{
    energy = 0;
    for (const auto& [name, body] : run.body) {
        if (body.at("kind") != "rigid") continue;
        double mass = 0;
        Vec3 inertia;
        if (body.contains("drive") || !rigid_mass(body, mass, inertia)) return false;
        const Vec3 v = run.history.vector(name + "_velocity", row);
        const Vec3 spin =
            pose_in(run, name, frame).turn.transpose() * run.history.vector(name + "_spin", row);
        energy += 0.5 * mass * v.squaredNorm() + 0.5 * spin.dot(inertia.cwiseProduct(spin));
    }
    return true;
}

/// Work of loads that stay, on rigid bodies since the start [J]: what they have lost of potential
/// energy.
bool potential_of_rigid(const WrittenRun& run, std::size_t row, double& lost)
{
    lost = 0;
    const Vec3 gravity = vector_of(run.scene().at("gravity"));
    for (const auto& [name, body] : run.body) {
        if (body.at("kind") != "rigid") continue;
        double mass = 0;
        Vec3 inertia;
        if (body.contains("over") || body.contains("torque") || !rigid_mass(body, mass, inertia))
            return false;
        const Vec3 force = body.contains("force") ? vector_of(body.at("force")) : Vec3::Zero();
        lost += (mass * gravity + force)
                    .dot(run.history.vector(name, row) - run.history.vector(name, 0));
    }
    return true;
}

/// Forces of what is held, times how it was moved: the work of a run whose solids are driven by
/// holds alone [J].
bool work_of_holds(const WrittenRun& run, double& work)
{
    work = 0;
    const std::vector<double> times = run.history.values("time");
    for (const auto& [name, body] : run.body) {
        const std::string kind = body.at("kind");
        if (kind == "obstacle") continue;
        if (kind != "solid" || body.contains("loads") || body.contains("drive")) return false;
        if (vector_of(run.scene().at("gravity")).norm() > 0 && body.contains("density"))
            return false;
        std::string first;
        for (const Json& hold : body.value("hold", Json::array())) {
            const std::string set = hold.at("set");
            if (!first.empty() && (set == "all" || first == "all" || set[0] != first[0]))
                return false;
            first = set;
            for (std::size_t i = 1; i < times.size(); ++i)
                for (int k = 0; k < 3; ++k) {
                    const std::string axis(1, "xyz"[k]);
                    if (!hold.contains(axis)) continue;
                    const double way =
                        value_at(hold.at(axis), times[i]) - value_at(hold.at(axis), times[i - 1]);
                    work += 0.5 * way *
                            (run.history.vector(name + "_" + set + "_force", i)[k] +
                             run.history.vector(name + "_" + set + "_force", i - 1)[k]);
                }
        }
    }
    return true;
}

void check_columns(const WrittenRun& run, double floor, std::vector<Finding>& found)
{
    const WrittenHistory& h = run.history;
    const std::vector<double> work = h.values("work"), elastic = h.values("elastic"),
                              kinetic = h.values("kinetic"), friction = h.values("friction"),
                              released = h.values("released"), error = h.values("energy_error");
    const double all = turned_over(run);
    for (std::size_t i = 1; i < h.rows.size(); ++i) {
        const double here = work[i] - (elastic[i] - elastic[0]) - (kinetic[i] - kinetic[0]) -
                            friction[i] - released[i];
        if (!(std::abs(here - error[i]) <= 1e-9 * all + 1e-300 + 1e-12 * std::abs(elastic[0])))
            return found.push_back(
                {"energy", fmt::format("step {}: the columns leave {:.3g} J, reported are {:.3g} J",
                                       i, here, error[i])});
        const double bad = run.dynamic() ? std::max(-here, -released[i]) : std::abs(here);
        const bool reported = run.warnings() > 0 || i + 1 < h.rows.size(); // at the end of the run
        const double limit = (reported ? kNever : kReported) * all + floor;
        if (!(bad <= limit))
            return found.push_back(
                {"energy",
                 fmt::format(
                     "step {}: error {:.3g} J, released {:.3g} J, of {:.3g} J turned over{}", i,
                     here, released[i], all, reported ? "" : ", without a warning")});
        if (!(friction[i] - friction[i - 1] >= -kReported * all - floor))
            return found.push_back({"energy", fmt::format("step {}: friction gives {:.3g} J back",
                                                          i, friction[i - 1] - friction[i])});
    }
}

} // namespace

std::vector<Finding> check_energy(const WrittenRun& run)
{
    std::vector<Finding> found;
    const WrittenHistory& h = run.history;
    const RunScale scale = scale_of(run);
    const double all = turned_over(run), floor = scale.accuracy * scale.force * scale.length;
    check_columns(run, floor, found);

    // ---- Elastic energy, summed over the cells
    if (!has_kind(run, {"rod", "beam"}) && has_kind(run, {"solid"}) && !has_couplings(run))
        for (const WrittenFrame& frame : run.frames) {
            const int row = h.row_at(frame.time);
            double stored = 0, start = 0;
            bool straight = true;
            for (const auto& [name, body] : run.body) {
                if (body.at("kind") != "solid") continue;
                const auto energy_of = [&](const VtkText& solid) {
                    const std::vector<double> volumes = cell_volumes(solid, true);
                    const std::vector<double>& density =
                        solid.get("CellData/strain_energy_density").values;
                    double sum = 0;
                    for (std::size_t i = 0; i < volumes.size(); ++i)
                        sum += volumes[i] * density[i];
                    return sum;
                };
                straight = straight && body.at("mesh").value("element", "") ==
                                           "T4"; // strains are the same all over a cell
                stored += energy_of(frame.parts.at(name));
                start += energy_of(run.frames.front().parts.at(name));
            }
            if (row < 0 || !straight) continue;
            const std::vector<double> elastic = h.values("elastic");
            const double reported = elastic[static_cast<std::size_t>(row)] - elastic[0];
            if (!(std::abs(stored - start - reported) <= kRecomputed * all + floor)) {
                found.push_back(
                    {"energy",
                     fmt::format("t = {:g} s: the cells store {:.6g} J, reported are {:.6g} J",
                                 frame.time, stored - start, reported)});
                break;
            }
        }

    // ---- Work of holds
    double work = 0;
    if (!run.dynamic() && !has_couplings(run) && work_of_holds(run, work) &&
        !(std::abs(work - h.last("work")) <= kRecomputed * all + floor))
        found.push_back({"energy", fmt::format("the holds do {:.6g} J, reported are {:.6g} J", work,
                                               h.last("work"))});

    // ---- Kinetic and potential energy of rigid bodies
    if (run.dynamic() && !has_kind(run, {"solid", "rod", "beam"})) {
        double start = 0;
        if (!kinetic_of_rigid(run, 0, run.frames.front(), start)) return found;
        const bool springs = has_couplings(run) && [&] {
            for (const Json& c : run.scene().at("couplings"))
                if (c.value("kind", "weld") == "spring") return true;
            return false;
        }();
        for (const WrittenFrame& frame : run.frames) {
            const int row = h.row_at(frame.time);
            double kinetic = 0, lost = 0;
            if (row < 0 || !kinetic_of_rigid(run, static_cast<std::size_t>(row), frame, kinetic))
                continue;
            const std::vector<double> reported = h.values("kinetic");
            const double change = reported[static_cast<std::size_t>(row)] - reported[0];
            if (!(std::abs(kinetic - start - change) <= kRecomputed * (all + kinetic))) {
                found.push_back(
                    {"energy",
                     fmt::format("t = {:g} s: the kinetic energy changed by {:.6g} J, reported are "
                                 "{:.6g} J",
                                 frame.time, kinetic - start, change)});
                break;
            }
            if (springs || !potential_of_rigid(run, static_cast<std::size_t>(row), lost)) continue;
            const double gained = kinetic - start - lost,
                         limit = run.warnings() > 0 ? kNever : kReported;
            if (!(gained <= limit * (all + start) + floor)) {
                found.push_back(
                    {"energy", fmt::format("t = {:g} s: {:.3g} J are gained of {:.3g} J",
                                           frame.time, gained, all + start)});
                break;
            }
        }
    }
    return found;
}

std::vector<Finding> check_momentum(const WrittenRun& run)
{
    if (!run.dynamic() || !run.history.has_vector("momentum")) return {};
    std::vector<Finding> found;
    const WrittenHistory& h = run.history;
    bool rigid = !has_kind(run, {"solid", "rod", "beam"}),
         alone = vector_of(run.scene().at("gravity")).norm() == 0;
    for (const auto& [name, body] : run.body) {
        alone = alone && body.at("kind") != "obstacle" && !body.contains("drive") &&
                !body.contains("force") && !body.contains("torque") && !body.contains("loads") &&
                !body.contains("hold");
        rigid = rigid && !body.contains("drive");
    }
    if (has_couplings(run))
        for (const Json& c : run.scene().at("couplings"))
            alone = alone && c.at("between").at(1) != "world";
    double size = 0; // largest sum of the bodies' own momenta
    for (std::size_t i = 0; i < h.rows.size(); ++i) {
        Vec3 sum = Vec3::Zero();
        double sizes = h.vector("momentum", i).norm();
        bool known = rigid;
        for (const auto& [name, body] : run.body) {
            double mass = 0;
            Vec3 inertia;
            if (!rigid || body.at("kind") != "rigid") continue;
            known = known && rigid_mass(body, mass, inertia);
            const Vec3 p = mass * h.vector(name + "_velocity", i);
            sum += p;
            sizes += p.norm();
        }
        size = std::max(size, sizes);
        if (known && !((sum - h.vector("momentum", i)).norm() <= 1e-9 * size + 1e-300))
            return {{"momentum",
                     fmt::format(
                         "step {}: the bodies' momenta and the reported sum differ by {:.3g} N s",
                         i, (sum - h.vector("momentum", i)).norm())}};
        if (!alone) continue;
        // Impulses act and react; the residual of their solution is of the requested accuracy.
        const double off = (h.vector("momentum", i) - h.vector("momentum", 0)).norm(),
                     allowed = 1e-6 * size + 1e-300;
        if (!(off <= allowed))
            return {{"momentum",
                     fmt::format(
                         "step {}: nothing acts from outside, but {:.3g} N s of {:.3g} are gained",
                         i, off, size)}};
    }
    return found;
}

std::vector<Finding> check_joints(const WrittenRun& run)
{
    if (!has_couplings(run)) return {};
    std::vector<Finding> found;
    const RunScale scale = scale_of(run);
    int number = -1;
    for (const Json& c : run.scene().at("couplings")) {
        ++number;
        const std::string kind = c.value("kind", "weld"), a = c.at("between").at(0),
                          b = c.at("between").at(1);
        const auto rigid = [&](const std::string& name) {
            return name == "world" || run.body.at(name).at("kind") == "rigid" ||
                   run.body.at(name).at("kind") == "obstacle";
        };
        if (!rigid(a) || !rigid(b)) continue;
        const Vec3 at = vector_of(c.at("at")), to = c.contains("to") ? vector_of(c.at("to")) : at,
                   axis = c.contains("axis") ? vector_of(c.at("axis")).normalized() : Vec3(0, 0, 1);
        for (const WrittenFrame& frame : run.frames) {
            const auto motion = [&](const std::string& name) {
                double miss = 0;
                if (name == "world" || run.body.at(name).at("kind") == "obstacle")
                    return RigidMotion{};
                return fit_motion(run.frames.front().parts.at(name).get("Points/points"),
                                  frame.parts.at(name).get("Points/points"), miss);
            };
            const RigidMotion ma = motion(a), mb = motion(b);
            const Vec3 apart = mb.apply(to) - ma.apply(at);
            const double size = std::max(scale.length, (to - at).norm());
            double off = 0;
            const Vec3 along = mb.turn * axis;
            const double turned =
                std::abs((ma.turn.transpose() * mb.turn).trace() - 3) / 4; // ~ angle^2 / 4
            if (kind == "weld" || kind == "ball" || kind == "hinge") off = apart.norm();
            if (kind == "slider") off = (apart - apart.dot(along) * along).norm();
            if (kind == "hinge") off = std::max(off, size * (ma.turn * axis).cross(along).norm());
            if (kind == "weld" || kind == "slider")
                off = std::max(off, size * 2 * std::sqrt(turned));
            if (kind == "spring") {
                const int row = run.history.row_at(frame.time);
                const double length =
                    c.contains("length") ? c.at("length").get<double>() : (to - at).norm();
                const double force = std::abs(c.value("stiffness", 0.0) * (apart.norm() - length));
                const std::string column = fmt::format("{}_on_{}_coupling_{}_force", a, b, number);
                if (row < 1 || !run.history.has_vector(column)) continue;
                const double reported =
                    run.history.vector(column, static_cast<std::size_t>(row)).norm();
                // A step's rule may take the force within the step: then it is between those of its
                // ends.
                if (run.dynamic() ||
                    std::abs(force - reported) <= 1e-6 * std::max(scale.force, force))
                    continue;
                found.push_back(
                    {"joints",
                     fmt::format("t = {:g} s: spring {} pulls with {:.6g} N by its ends, reported "
                                 "are {:.6g} N",
                                 frame.time, number, force, reported)});
                break;
            }
            // Where the angle is small its square root of a rounded sum is not: 1e-7 is what can be
            // seen of a turn.
            const double allowed =
                kJoint * size + (kind == "weld" || kind == "slider" ? 1e-6 * size : 0);
            if (off <= allowed) continue;
            found.push_back(
                {"joints",
                 fmt::format("t = {:g} s: the {} of {} and {} is off by {:.3g} m, {:.3g} m is "
                             "allowed",
                             frame.time, kind, a, b, off, allowed)});
            break;
        }
    }
    return found;
}

} // namespace amontons::validation
