#include "contact/curve/bore_contact.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <random>

using namespace amontons;

namespace {

constexpr double kBore = 1e-3, kWire = 4e-4; // radii [m]

/// An arc of radius R about (0, R, 0), from the origin along x, in equal pieces.
Curve arc_from_origin(double R, double angle, int pieces, double radius, const Vec3& shift)
{
    Curve c;
    c.start.push_back(0);
    const auto at = [&](double t) {
        return Vec3(shift + R * Vec3(std::sin(t), 1 - std::cos(t), 0));
    };
    const double h = angle / pieces;
    const auto slope = [&](double t) { return Vec3(R * h * Vec3(std::cos(t), std::sin(t), 0)); };
    for (int i = 0; i < pieces; ++i) {
        c.pieces.push_back({at(i * h), at((i + 1) * h), slope(i * h), slope((i + 1) * h), radius});
        c.start.push_back((i + 1) * h * R);
    }
    return c;
}

/// Contacts of a wire on an arc of another radius in a catheter, at all its stations.
std::vector<CurveContact> bore_contacts(const Curve& outer, const Curve& inner, double reach = 1)
{
    const std::vector<double> bore(outer.pieces.size(), kBore);
    std::vector<CurveContact> found;
    touch_bore({outer, inner, bore}, stations(outer, 0), reach, found);
    return found;
}

} // namespace

TEST_CASE("a wire on an arc in a catheter on a wider one: clearance less the arcs' distance")
{
    const double R = 0.05, aside = 2e-4;
    const Curve outer = arc_from_origin(R, 1, 20, 1.5e-3, Vec3::Zero());
    Curve inner = arc_from_origin(R, 1.3, 37, kWire, {0, 0, aside}); // beside it, and longer
    const std::vector<CurveContact> found = bore_contacts(outer, inner);
    REQUIRE(found.size() == 21); // the inner end is beyond the outer one
    for (const CurveContact& c : found) {
        CHECK(c.gap == doctest::Approx(kBore - kWire - aside).epsilon(1e-6));
        CHECK((c.normal - Vec3::UnitZ()).norm() < 1e-3); // the wire pushes its catheter outwards
        CHECK(c.slides_b);
        CHECK_FALSE(c.slides_a);
    }
    // Shorter than the catheter: stations beyond its end have none, its end has one of its own.
    inner = arc_from_origin(R, 0.52, 15, kWire, {0, 0, aside});
    const std::vector<CurveContact> within = bore_contacts(outer, inner);
    REQUIRE(within.size() == 12); // 0 to 0.5 in steps of 0.05, and the end
    CHECK(within.back().slides_a);
    CHECK(within.back().b.t == 1);
    CHECK(arc_at(outer, within.back().a) == doctest::Approx(0.52 * R).epsilon(1e-4));
    CHECK(bore_contacts(outer, inner, 1e-4).empty()); // farther than the reach
}

TEST_CASE("a gap in a bore changes by what moves along its normal")
{
    std::mt19937 random(7);
    std::uniform_real_distribution<double> any(-1, 1);
    const Curve outer = arc_from_origin(0.04, 1.2, 17, 1.5e-3, Vec3::Zero());
    const Curve inner = arc_from_origin(0.043, 1.0, 23, kWire, {0, 1e-4, 2e-4});
    const std::vector<CurveContact> before = bore_contacts(outer, inner);
    REQUIRE(before.size() > 10);
    for (int k = 0; k < 5; ++k) {
        const Vec3 way = 1e-7 * Vec3(any(random), any(random), any(random));
        Curve moved = inner;
        for (CurvePiece& p : moved.pieces) {
            p.x0 += way;
            p.x1 += way;
        }
        const std::vector<CurveContact> after = bore_contacts(outer, moved);
        int compared = 0;
        for (const CurveContact& c : before)
            for (const CurveContact& now : after) {
                if (c.id != now.id) continue; // the first station may have left the inner curve
                CHECK(std::abs(now.gap - c.gap + c.normal.dot(way)) < 1e-10);
                ++compared;
            }
        CHECK(compared >= int(before.size()) - 1);
    }
}

TEST_CASE("the place on a curve that is nearest is found from any piece, and none beyond its ends")
{
    const double R = 0.03;
    const Curve c = arc_from_origin(R, 2, 31, 1e-3, Vec3::Zero());
    for (int from = 0; from < 31; from += 6) {
        for (double t = 0.01; t < 2; t += 0.13) {
            const Vec3 x = Vec3(0, R, 0) + 1.02 * R * Vec3(std::sin(t), -std::cos(t), 0.01);
            int piece = from;
            const std::optional<CurvePlace> at = nearest_place(c, x, 0, piece);
            REQUIRE(at);
            CHECK(arc_at(c, *at) == doctest::Approx(t * R).epsilon(1e-4));
        }
        int piece = from;
        CHECK_FALSE(nearest_place(c, {-1e-3, 1e-4, 0}, 0, piece));
        CHECK(piece == 0);
        piece = from;
        CHECK_FALSE(nearest_place(c, c.pieces.back().x1 + 0.1 * c.pieces.back().d1, 0, piece));
        CHECK(piece == 30);
    }
}

TEST_CASE("a wire that leaves its catheter's bore stands in its wall, and not beyond its end")
{
    const Curve outer = arc_from_origin(0.05, 1, 20, 1.5e-3, Vec3::Zero());
    const std::vector<double> bore(outer.pieces.size(), kBore);
    const auto depth = [&](const Curve& inner) { return bore_overlap({outer, inner, bore}).depth; };
    CHECK(depth(arc_from_origin(0.05, 1, 30, kWire, {0, 0, kBore - kWire - 1e-6})) == 0);
    CHECK(depth(arc_from_origin(0.05, 1, 30, kWire, {0, 0, kBore - kWire + 1e-5})) ==
          doctest::Approx(1e-5).epsilon(0.01));
    // Straight on from the end: what is beyond it counts no more.
    Curve longer = arc_from_origin(0.05, 1, 30, kWire, Vec3::Zero());
    const Vec3 end = longer.pieces.back().x1, ahead = longer.pieces.back().d1;
    for (int k = 0; k < 20; ++k) {
        longer.pieces.push_back({end + k * ahead, end + (k + 1) * ahead, ahead, ahead, kWire});
        longer.start.push_back(longer.start.back() + ahead.norm());
    }
    CHECK(depth(longer) == 0);
}
