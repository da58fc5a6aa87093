// G02, G08: other units, another order, another frame: the same answer.

#include "validation/families/solids/blocks.hpp"
#include "validation/families/solids/solids.hpp"

#include <cmath>
#include <fmt/format.h>

namespace amontons::validation {
namespace {

/// Largest difference of u at the five points, of u at the first, and of the forces.
double difference(const Raous& a, const Raous& b)
{
    if (a.certificates + b.certificates > 0) return std::nan(""); // an answer that is none
    double worst = std::abs(a.normal - b.normal) / std::abs(a.normal);
    raise_to(worst, std::abs(a.tangential - b.tangential) / std::abs(a.normal));
    for (std::size_t i = 0; i < a.u.size(); ++i)
        raise_to(worst, (a.u[i] - b.u[i]).norm() / a.u[0].norm());
    return worst;
}

} // namespace

std::vector<Measured> units_changed()
{
    std::vector<Measured> rows;
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T10}) {
        RaousOptions o;
        o.element = kind;
        o.cells = kind == ElementKind::H8 ? 32 : 16; // nodes at the points
        // With a tolerance near round-off, the last iterations are a matter of rounding.
        constexpr double kUsual = 1e-8, kFine = 1e-10;
        o.accuracy = kUsual;
        const Raous usual = raous(o);
        o.accuracy = kFine;
        const Raous si = raous(o);
        for (const auto& [length, stress, what] : {std::tuple{1e3, 1e-6, "mm, N, MPa"},
                                                   {1e6, 1.0, "um, Pa"},
                                                   {1e-6, 1.0, "lengths 1e-6"},
                                                   {1e6, 1e-6, "lengths 1e6, stresses 1e-6"},
                                                   {1.0, 1e12, "stresses 1e12"}}) {
            o.length = length;
            o.stiffness = stress;
            const Raous r = raous(o);
            const std::string of =
                fmt::format(", {}, {}", what, kind == ElementKind::H8 ? "H8" : "T10");
            rows.push_back(at_most("difference from SI" + of, difference(si, r), 1e-10));
            if (kind == ElementKind::T10) continue; // see cases/units-changed
            o.accuracy = kUsual;
            rows.push_back(absolute("iterations" + of, usual.iterations, raous(o).iterations, 0));
            o.accuracy = kFine;
        }
        if (kind == ElementKind::T10)
            rows.push_back(left_out("G02: iterations of T10 in other units",
                                    "50 to 70: rounding decides when sweeps yield to Newton's "
                                    "method; the results are the same to 1e-10"));
    }
    rows.push_back(left_out("G02: units of A02, C12, B06", "block A09 stands for them"));
    return rows;
}

std::vector<Measured> order_and_frame()
{
    std::vector<Measured> rows;
    for (const ElementKind kind : {ElementKind::H8, ElementKind::T10}) {
        const std::string of = kind == ElementKind::H8 ? ", H8" : ", T10";
        RaousOptions o;
        o.element = kind;
        o.cells = kind == ElementKind::H8 ? 32 : 16; // nodes at the points
        o.accuracy = 1e-10;
        const Raous plain = raous(o);
        o.shuffle = 7;
        rows.push_back(
            at_most("nodes and elements shuffled" + of, difference(plain, raous(o)), 1e-10));
        o.shuffle = 0;
        o.turn = {0.3, -1.1, 0.7};
        rows.push_back(at_most("world turned" + of, difference(plain, raous(o)), 1e-10));
        o.turn.setZero();
        o.place = {1e6, -1e6, 1e6};
        const Raous far = raous(o);
        double shift = far.certificates > 0 ? std::nan("") : 0;
        for (std::size_t i = 0; i < far.u.size(); ++i)
            raise_to(shift, (far.u[i] - plain.u[i]).norm() / 0.04);
        rows.push_back(at_most("world shifted by 1e6 m, of the body's size" + of, shift, 1e-8));
    }
    rows.push_back(left_out("G08: B06, C12 and A16; mirrored; bodies and contacts shuffled",
                            "block A09 stands for them: one body on a plane, whose nodes, elements "
                            "and so contacts are shuffled"));
    return rows;
}

} // namespace amontons::validation
