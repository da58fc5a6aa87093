// What other codes fail on: two blocks, one on the other, with data that is stiff, extreme or has
// no answer. Right to the closed form, or plainly refused.

#include "validation/families/solids/solids.hpp"
#include "validation/solid_meshes.hpp"
#include "validation/solid_run.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

constexpr double kBlockModulus = 1e6, kBlockPressure = 1e3;

struct PressedBlocks {
    ElementKind kind = ElementKind::T4;
    bool small = true;
    double lower_E = kBlockModulus, upper_E = kBlockModulus, nu = 0.3, mu = 0, length = 1;
    int lower_cells = 4, upper_cells = 3;
    double shift = 0;                    ///< of the upper block, up [m]
    double shear = 0;                    ///< along x on its top, of the pressure
    double load = kBlockPressure;        ///< pressure on its top [Pa]
    bool held_aside = true;              ///< both by symmetry planes; else the lower is clamped
    std::vector<HoldInput> lower, upper; ///< further ones
    double layer = 0;                    ///< the lower block's top layer of elements is this thin
};

SolidRun run_blocks(const PressedBlocks& o)
{
    const double s1 = o.length;
    SolidScene s("two blocks");
    const auto mesh = [&](int n, double low, double high, bool thin) {
        const std::vector<double> across = graded(s1, n, 1);
        std::vector<double> z = graded(s1 * (high - low), 2, 1);
        for (double& x : z)
            x += s1 * low;
        if (thin && o.layer > 0) z.insert(z.end() - 1, z.back() - s1 * o.layer);
        return lattice_mesh({across, across, z}, o.kind);
    };
    SolidInput* b = &s.solid("lower", o.lower_E, o.nu, mesh(o.lower_cells, 0, 0.5, true));
    if (o.held_aside)
        b->hold = {hold("z_min", {}, {}, still()), hold("x_min", still(), {}, {}),
                   hold("y_min", {}, still(), {})};
    else
        b->hold = {hold("z_min", {}, {}, {})};
    b->hold.insert(b->hold.end(), o.lower.begin(), o.lower.end());
    b = &s.solid("upper", o.upper_E, o.nu, mesh(o.upper_cells, 0.5, 1, false));
    if (o.held_aside) b->hold = {hold("x_min", still(), {}, {}), hold("y_min", {}, still(), {})};
    b->hold.insert(b->hold.end(), o.upper.begin(), o.upper.end());
    b->start.place = {0, 0, o.shift};
    if (o.load != 0) b->loads = {pressure("z_max", o.load)};
    if (o.shear != 0) b->loads.push_back(traction("z_max", {o.shear * o.load, 0, 0}));
    ContactLaw& law = s.touch("upper", "lower", o.mu, "z_min", "z_max");
    law.sliding = o.small ? "small" : "finite";
    if (o.shift < 0) law.start_overlap = "resolve";
    s.scene.accuracy.contact = o.small ? 5e-11 : 1e-8;
    return try_run(s.scene, true);
}

/// On the upper block, whichever carries the multipliers [N].
Vec3 force_of(const SolidRun& run)
{
    Vec3 sum = Vec3::Zero();
    for (const ContactRecord& c : run.last().contacts)
        sum += c.normal.z() > 0 ? c.force : Vec3(-c.force);
    return sum;
}

/// Against the uniform state under a pressure p: u relative to p / E times the height, pressure.
struct Miss {
    double u = 0, p = 0;
};
Miss miss_of(const SolidRun& run, const PressedBlocks& o, double p)
{
    Miss m;
    const double scale = p * o.length * (0.5 / o.lower_E + 0.5 / o.upper_E);
    for (const BodyRecord& b : run.bodies.back()) {
        const bool upper = b.name == "upper";
        const double E = upper ? o.upper_E : o.lower_E;
        const std::vector<Vec3> u = displacements(b), x = first_places(b);
        for (std::size_t i = 0; i < u.size(); ++i) {
            const double z = x[i].z() - (upper ? o.shift : 0), half = 0.5 * o.length;
            const double down =
                upper ? p * half / o.lower_E + p * (z - half) / E + o.shift : p * z / E;
            const Vec3 exact(o.nu * p / E * x[i].x(), o.nu * p / E * x[i].y(), -down);
            raise_to(m.u, (u[i] - exact).norm() / scale);
        }
    }
    for (const ContactRecord& c : run.last().contacts)
        raise_to(m.p, std::abs(c.pressure / p - 1));
    if (run.last().contacts.empty()) m.p = 1;
    return m;
}

const char* name_of(ElementKind kind)
{
    return kind == ElementKind::T4 ? "T4" : kind == ElementKind::T10 ? "T10" : "H8";
}

/// The uniform state, in the geometry of the start to rounding and in that of the end to the
/// strains.
void uniform(std::vector<Measured>& rows, const std::string& what, PressedBlocks o,
             double p = kBlockPressure, double tolerance = 1e-8)
{
    for (const ElementKind kind : {ElementKind::T4, ElementKind::T10})
        for (const bool small : {true, false}) {
            o.kind = kind;
            o.small = small;
            const std::string of =
                fmt::format("{}, {}{}", what, name_of(kind), small ? "" : ", finite sliding");
            const SolidRun run = run_blocks(o);
            if (run.summary.status != "done") {
                rows.push_back(at_most(of, std::nan(""), tolerance));
                rows.back().note = run.summary.message;
                continue;
            }
            const Miss m = miss_of(run, o, p);
            const double strain = p / std::min(o.lower_E, o.upper_E);
            double worst = m.u;
            raise_to(worst, m.p);
            rows.push_back(at_most(of, certified(run, worst), small ? tolerance : 10 * strain));
            rows.back().note = fmt::format("u {:.1e}, p {:.1e}; {}", m.u, m.p, run.last().remark);
        }
}

/// The run must end with a reason that states `word`.
void refused(std::vector<Measured>& rows, const std::string& what, PressedBlocks o,
             const std::string& word)
{
    for (const ElementKind kind : {ElementKind::T4, ElementKind::T10})
        for (const bool small : {true, false}) {
            o.kind = kind;
            o.small = small;
            const SolidRun run = run_blocks(o);
            const bool reported = run.summary.status == "failed" &&
                                  run.summary.message.find(word) != std::string::npos;
            rows.push_back(at_most(fmt::format("refused: {}, {}{}", what, name_of(kind),
                                               small ? "" : ", finite sliding"),
                                   reported ? 0 : 1, 0));
            rows.back().note = run.summary.status + ": " + run.summary.message;
        }
}

} // namespace

std::vector<Measured> stiff_blocks()
{
    std::vector<Measured> rows;
    PressedBlocks o;
    for (const auto& [lower, upper] :
         {std::pair{kBlockModulus, 1e6 * kBlockModulus}, {1e6 * kBlockModulus, kBlockModulus}})
        for (const auto& [below, above] : {std::pair{4, 3}, {3, 4}}) {
            o.lower_E = lower;
            o.upper_E = upper;
            o.lower_cells = below;
            o.upper_cells = above;
            uniform(rows,
                    fmt::format("stiffness {:.0e} on {:.0e}, {} cells on {}", upper, lower, above,
                                below),
                    o);
        }
    o = {};
    o.nu = 0.49999;
    uniform(rows, "Poisson's ratio 0.49999", o, kBlockPressure, 1e-6);
    o = {};
    o.layer = 1e-5;
    uniform(rows, "slivers: a layer 1e-5 thin", o);
    o = {};
    o.length = 1e-6;
    uniform(rows, "lengths 1e-6", o);
    o.length = 1e6;
    uniform(rows, "lengths 1e6", o);
    return rows;
}

std::vector<Measured> gaps_and_overlaps()
{
    std::vector<Measured> rows;
    PressedBlocks o;
    o.shift = 1e-12;
    uniform(rows, "gap 1e-12", o);
    o.shift = 1e-3;
    uniform(rows, "gap 1e-3, closed by the load", o);
    o.shift = -1e-2; // of a height of 0.5
    uniform(rows, "overlap of 2 % under a load", o);
    // The ends held: the overlap presses by itself.
    o.load = 0;
    o.upper = {hold("z_max", {}, {}, still())};
    {
        const double p = 1e-2 * kBlockModulus;
        for (const ElementKind kind : {ElementKind::T4, ElementKind::T10})
            for (const bool small : {true, false}) {
                o.kind = kind;
                o.small = small;
                const SolidRun run = run_blocks(o);
                Miss m = {1, 1};
                if (run.summary.status == "done") {
                    m.p = 0;
                    for (const ContactRecord& c : run.last().contacts)
                        raise_to(m.p, std::abs(c.pressure / p - 1));
                    if (run.last().contacts.empty()) m.p = 1;
                }
                rows.push_back(at_most(fmt::format("overlap of 2 % between held ends, {}{}",
                                                   name_of(kind), small ? "" : ", finite sliding"),
                                       certified(run, m.p), small ? 1e-8 : 5e-2));
                rows.back().note = run.summary.message;
            }
    }
    // Pulled away: nothing is left in contact.
    o = {};
    o.load = 0;
    o.upper = {hold("z_max", {}, {}, {{0, -1e-3}, {1, 1e-2}})};
    for (const ElementKind kind : {ElementKind::T4, ElementKind::T10})
        for (const bool small : {true, false}) {
            o.kind = kind;
            o.small = small;
            const SolidRun run = run_blocks(o);
            double left = 1;
            if (run.summary.status == "done") {
                left = double(run.last().contacts.size());
                for (const BodyRecord& b : run.bodies.back())
                    for (const Vec3& u : displacements(b))
                        raise_to(left, (u - Vec3(0, 0, b.name == "upper" ? 1e-2 : 0)).norm());
            }
            rows.push_back(at_most(fmt::format("pulled away by its end, {}{}", name_of(kind),
                                               small ? "" : ", finite sliding"),
                                   certified(run, left), 1e-10));
            rows.back().note = run.summary.message;
        }
    o.upper.clear();
    o.load = -kBlockPressure;
    refused(rows, "pulled away by a load", o, "upper");
    return rows;
}

std::vector<Measured> floating_blocks()
{
    std::vector<Measured> rows;
    PressedBlocks o;
    o.held_aside = false;
    o.nu = 0; // a clamped foot leaves the state uniform
    uniform(rows, "floating, without friction", o);
    o.shear = 0.1;
    refused(rows, "floating without friction, pushed aside", o, "upper");
    for (const double mu : {0.05, 0.09}) {
        o.mu = mu;
        refused(rows, fmt::format("floating, mu {} below the shear of 0.1", mu), o, "upper");
    }
    for (const double mu : {0.12, 0.15, 0.3, 0.5, 0.8, 1.0, 1.5, 3.0})
        for (const ElementKind kind : {ElementKind::T4, ElementKind::T10})
            for (const bool small : {true, false}) {
                o.mu = mu;
                o.kind = kind;
                o.small = small;
                o.nu = 0.3;
                const SolidRun run = run_blocks(o);
                double worst = std::nan("");
                if (run.summary.status == "done") {
                    const Vec3 f = force_of(run);
                    worst = (f - Vec3(-0.1 * kBlockPressure, 0, kBlockPressure)).norm() /
                            kBlockPressure;
                    worst = certified(run, worst);
                }
                rows.push_back(at_most(fmt::format("floating, sheared, mu {}: balance, {}{}", mu,
                                                   name_of(kind), small ? "" : ", finite sliding"),
                                       worst, small ? 1e-8 : 1e-2));
                rows.back().note = small ? run.summary.message : "the pressure turns with its face";
            }
    return rows;
}

std::vector<Measured> prescribed_faces()
{
    std::vector<Measured> rows;
    PressedBlocks o;
    o.nu = 0;
    o.upper = {hold("z_min", still(), still(), {})};
    uniform(rows, "one face held along itself", o);
    o.lower = {hold("z_max", still(), still(), {})};
    uniform(rows, "both faces held along themselves", o);
    o = {};
    o.nu = 0;
    o.load = 0;
    for (const bool upper : {true, false}) {
        o.upper.clear();
        o.lower.clear();
        if (upper) {
            o.upper = {hold("z_min", {}, {}, at_once(-1e-3))};
        } else {
            o.lower = {hold("z_max", {}, {}, at_once(1e-3))};
            o.upper = {hold("z_max", {}, {}, still())};
        }
        for (const ElementKind kind : {ElementKind::T4, ElementKind::T10})
            for (const auto& [below, above] : {std::pair{4, 3}, {3, 4}}) {
                o.kind = kind;
                o.lower_cells = below;
                o.upper_cells = above;
                const SolidRun run = run_blocks(o);
                double worst = std::nan("");
                if (run.summary.status == "done") {
                    worst =
                        certified(run, std::abs(force_of(run).z() / (2e-3 * kBlockModulus) - 1));
                }
                rows.push_back(
                    at_most(fmt::format("{} face prescribed, {} cells on {}, {}: force",
                                        upper ? "upper" : "lower", above, below, name_of(kind)),
                            worst, 1e-8));
                rows.back().note =
                    fmt::format("{}, {} contacts, {:.6g} N {}", run.summary.status,
                                run.steps.empty() ? 0 : int(run.last().contacts.size()),
                                run.steps.empty() ? 0.0 : force_of(run).z(), run.summary.message);
            }
    }
    o.lower = {hold("z_max", {}, {}, still())};
    o.upper = {hold("z_min", {}, {}, at_once(-1e-3))};
    refused(rows, "both faces prescribed into each other", o, "penetration");
    return rows;
}

} // namespace amontons::validation
