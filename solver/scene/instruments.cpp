#include "solver/scene/instruments.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kTorsionOfBending = 0.77; // GJ / EI, nu = 0.3

/// EI of a round bar or tube [N m^2].
double bending_of(double modulus, double outer, double inner)
{
    return modulus * kPi / 64 * (std::pow(outer, 4) - std::pow(inner, 4));
}

/// The straight shafts of 0.035 inch, measured in three-point bending as a homogeneous wire
/// (Harrison et al., J. Endovasc. Ther. 18 (2011) 797-801); taper and J of stEVE's wire.
Instrument stiff_wire(const char* name, double modulus)
{
    constexpr double kDiameter = 0.889e-3, kRadius = 12.1e-3;
    Instrument i;
    i.name = name;
    i.kind = "guidewire";
    i.length = 0.450;
    i.diameter = kDiameter;
    i.EI = bending_of(modulus, kDiameter, 0);
    i.EI_tip = std::min(2e-5, i.EI);
    i.taper = 0.030;
    i.element = 2.5e-3;
    i.tip = {{0.4 * kPi * kRadius, 1 / kRadius}};
    i.source = fmt::format("flexural modulus {:.3g} GPa: Harrison et al. 2011, "
                           "10.1583/11-3592.1; J of 12.1 mm and 72 degrees: stEVE; taper: estimate",
                           modulus / 1e9);
    return i;
}

Instrument tube(const char* name, const char* kind, double length, double outer, double inner,
                double EI, double element, std::string source)
{
    Instrument i;
    i.name = name;
    i.kind = kind;
    i.length = length;
    i.diameter = outer;
    i.bore = inner;
    i.EI = i.EI_tip = EI;
    i.element = element;
    i.source = std::move(source);
    return i;
}

std::vector<Instrument> make_library()
{
    std::vector<Instrument> all;
    all.push_back(stiff_wire("guidewire-amplatz", 9.5e9));
    all.push_back(stiff_wire("guidewire-stiff", 17e9));
    all.push_back(stiff_wire("guidewire-extra-stiff", 29.2e9));
    all.push_back(stiff_wire("guidewire-super-stiff", 60.3e9));
    all.push_back(stiff_wire("guidewire-ultra-stiff", 65.4e9));
    all.push_back(stiff_wire("guidewire-backup-meier", 139.6e9));
    all.push_back(stiff_wire("guidewire-lunderquist", 158.4e9));

    const double pascal = 1e9; // of stEVE's polymer instruments
    all.push_back(tube("microwire", "guidewire", 0.450, 0.36e-3, 0, bending_of(pascal, 0.36e-3, 0),
                       1.25e-3, "stEVE_bench: 0.36 mm, 1 GPa"));
    all.push_back(tube("microcatheter", "catheter", 0.450, 0.7e-3, 0.57e-3,
                       bending_of(pascal, 0.7e-3, 0.57e-3), 2e-3,
                       "stEVE_bench: 0.7 mm, bore 0.57 mm, 1 GPa"));
    Instrument five = tube("catheter-5f", "catheter", 0.400, 1.67e-3, 1.0e-3, 1.9e-4, 2.5e-3,
                           "5 French, bore 1.0 mm; EI and GJ of a braided shaft: estimate");
    five.GJ = 1.5e-4;
    all.push_back(five);
    Instrument simmons =
        tube("catheter-simmons", "catheter", 0.545, 2e-3, 1e-3, bending_of(pascal, 2e-3, 1e-3),
             2.5e-3, "stEVE's Simmons: 2 mm, bore 1 mm, 1 GPa, bends of 10, 6, 20, 20 mm");
    const auto bend = [](double radius, double degrees) {
        return TipPiece{radius * std::abs(degrees) * kPi / 180, (degrees < 0 ? -1 : 1) / radius};
    };
    // stEVE's straights and bends in turn; its first bend, of -2 degrees, is left out.
    simmons.tip = {{0.030, 0}, bend(0.006, 185), {0.005, 0}, bend(0.020, 20),
                   {0.005, 0}, bend(0.020, -70), {0.005, 0}};
    all.push_back(simmons);
    all.push_back(tube("catheter-magnetic", "catheter", 0.534, 1.33e-3, 0.8e-3,
                       bending_of(170e6, 1.33e-3, 0.8e-3), 2.5e-3,
                       "mCR_simulator: 1.33 mm, bore 0.8 mm, 170 MPa body, 34 mm tip of 21 MPa"));
    all.back().EI_tip = bending_of(21e6, 1.33e-3, 0.8e-3);
    all.back().taper = 0.034;
    all.push_back(tube("sheath-6f", "sheath", 0.250, 2.6e-3, 2.0e-3,
                       bending_of(pascal, 2.6e-3, 2.0e-3), 2.5e-3,
                       "bore of 6 French (2 mm); wall and 1 GPa: estimate"));
    for (Instrument& i : all)
        if (i.GJ == 0) i.GJ = kTorsionOfBending * i.EI;
    return all;
}

double tip_length(const std::vector<TipPiece>& tip)
{
    double sum = 0;
    for (const TipPiece& p : tip)
        sum += p.length;
    return sum;
}

/// Radius, angle and straight end of a shape, where the scene does not give them.
std::vector<TipPiece> tip_of(const TipInput& in, const Instrument& own)
{
    if (in.shape == "straight" || (in.shape.empty() && own.tip.empty())) return {};
    double radius = 12.1e-3, angle = 0.4 * kPi, straight = 0; // "J": stEVE's
    if (in.shape == "angled") radius = 5e-3, angle = kPi / 4, straight = 5e-3;
    if (in.shape == "pigtail") radius = 5e-3, angle = 1.75 * kPi;
    if (in.radius > 0) radius = in.radius;
    if (in.angle > 0) angle = in.angle;
    if (in.length > 0) straight = in.length;
    if (in.shape.empty() && in.radius == 0 && in.angle == 0 && in.length == 0) return own.tip;
    std::vector<TipPiece> tip{{radius * angle, 1 / radius}};
    if (straight > 0) tip.push_back({straight, 0});
    return tip;
}

/// From the base: shaft, what of the taper lies before the tip, the tip's pieces.
std::vector<BeamSegment> segments_of(const Instrument& i, const std::vector<TipPiece>& tip,
                                     double length, double element)
{
    const double bent = tip_length(tip), soft = std::max(i.taper, bent), shaft = length - soft;
    // EI at a distance from the tip
    const auto EI_at = [&](double from_tip) {
        const double t = i.taper > 0 ? std::min(from_tip / i.taper, 1.0) : 1;
        return i.EI_tip + (i.EI - i.EI_tip) * t;
    };
    std::vector<BeamSegment> all;
    const auto add = [&](double from_tip, double piece, double curvature, double h) {
        BeamSegment g;
        g.length = piece;
        g.radius = i.diameter / 2;
        g.inner_radius = i.bore / 2;
        g.EI = {EI_at(from_tip), EI_at(from_tip - piece)};
        for (std::size_t end = 0; end < 2; ++end) {
            g.GJ[end] = i.GJ / i.EI * g.EI[end];
            g.EA[end] = 4 * g.EI[end] / (std::pow(g.radius, 2) + std::pow(g.inner_radius, 2));
        }
        g.curvature = curvature;
        g.element = std::min(h, piece);
        all.push_back(g);
    };
    add(length, shaft, 0, element);
    double left = soft; // of the tip
    // A taper that ends within a piece of the tip would need another segment.
    if (left > bent * (1 + kInputRoundOff)) add(left, left - bent, 0, element / 2), left = bent;
    for (const TipPiece& p : tip) {
        add(left, p.length, p.curvature, element / 2);
        left -= p.length;
    }
    return all;
}

} // namespace

const std::vector<Instrument>& instruments()
{
    static const std::vector<Instrument> library = make_library();
    return library;
}

void make_segments(Scene& scene, Findings& findings)
{
    for (BeamInput& b : scene.beams) {
        const std::string place = "/bodies/" + b.name;
        if (b.instrument.empty()) {
            if (b.segments.empty())
                findings.add({place + "/segments", place + "/instrument"}, "nothing",
                             "a list [...] of objects, or an \"instrument\"");
            if (b.length > 0)
                findings.add({place + "/length", place + "/instrument"},
                             fmt::format("{}", b.length), "nothing: only an \"instrument\" has it");
            if (b.element > 0)
                findings.add({place + "/element", place + "/instrument"},
                             fmt::format("{}", b.element),
                             "nothing: only an \"instrument\" has it");
            if (!b.tip.shape.empty() || b.tip.radius > 0 || b.tip.angle > 0 || b.tip.length > 0)
                findings.add({place + "/tip", place + "/instrument"}, "a tip",
                             "nothing: only an \"instrument\" has it");
            continue;
        }
        const auto& library = instruments();
        const auto it = std::find_if(library.begin(), library.end(),
                                     [&](const Instrument& i) { return i.name == b.instrument; });
        if (it == library.end()) continue; // refused by its declaration
        if (!b.segments.empty()) {
            findings.add({place + "/instrument", place + "/segments"}, quoted_text(b.instrument),
                         "either \"instrument\" or \"segments\"");
            continue;
        }
        const bool shaped = b.tip.radius > 0 || b.tip.angle > 0 || b.tip.length > 0;
        if (shaped && b.tip.shape.empty() && it->tip.size() != 1)
            findings.add({place + "/tip", place + "/instrument"}, "no \"shape\"",
                         it->tip.empty() ? "a \"shape\": the instrument's own tip is straight"
                                         : "a \"shape\": the instrument's own tip has many bends");
        if (shaped && b.tip.shape == "straight")
            findings.add({place + "/tip", place + "/instrument"},
                         "a radius, an angle or a length of a straight tip",
                         "nothing but \"shape\": \"straight\"");
        const std::vector<TipPiece> tip = tip_of(b.tip, *it);
        const double length = b.length > 0 ? b.length : it->length;
        const double soft = std::max(it->taper, tip_length(tip));
        double sharpest = 0;
        for (const TipPiece& p : tip)
            sharpest = std::max(sharpest, std::abs(p.curvature));
        if (sharpest * it->diameter / 2 >= 1)
            findings.add(
                {place + "/tip/radius", place + "/tip"}, fmt::format("{:.6g}", 1 / sharpest),
                fmt::format("> {:.6g} [m], the radius of the instrument itself", it->diameter / 2));
        else if (!(length > soft * (1 + kInputRoundOff)))
            findings.add({place + "/length", place + "/tip"}, fmt::format("{:.6g}", length),
                         fmt::format("> {:.6g} [m], its taper and tip", soft));
        else
            b.segments = segments_of(*it, tip, length, b.element > 0 ? b.element : it->element);
        b.instrument.clear();
        b.length = b.element = 0;
        b.tip = {};
    }
}

} // namespace amontons
