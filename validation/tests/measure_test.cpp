#include "validation/measure.hpp"

#include "validation/report.hpp"
#include "validation/scene_run.hpp"
#include "validation/solid_run.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <set>
#include <stdexcept>

using namespace amontons;
using namespace amontons::validation;

TEST_CASE("a row passes within its tolerance and at no other time and not even as NaN")
{
    CHECK(relative("", 2, 2.001, 1e-3).passed());
    CHECK(!relative("", 2, 2.003, 1e-3).passed());
    CHECK(!relative("", -2, 2, 1e-3).passed());
    CHECK(absolute("", 0, -1e-4, 1e-3).passed());
    CHECK(!at_most("", -2e-3, 1e-3).passed());
    CHECK(!at_most("", std::nan(""), 1e300).passed());
}

TEST_CASE("a case that cannot be run fails with the reason")
{
    const Case broken{"broken", "stability", "", "",
                      []() -> std::vector<Measured> { throw std::runtime_error("stuck at 3 mm"); }};
    const CaseResult r = run_case(broken);
    CHECK(!r.passed());
    REQUIRE(r.rows.size() == 1);
    CHECK(r.rows[0].note == "stuck at 3 mm");
}

TEST_CASE("what is no number stays the worst whatever comes after it")
{
    double worst = 0;
    raise_to(worst, 2);
    raise_to(worst, 1);
    CHECK(worst == 2);
    raise_to(worst, std::nan(""));
    raise_to(worst, 3);
    CHECK(std::isnan(worst));
}

TEST_CASE("an error of a run with a step without certificate is no number")
{
    SolidRun run;
    CHECK(certified(run, 1e-9) == 1e-9);
    run.summary.uncertified_steps = 1;
    CHECK(std::isnan(certified(run, 1e-9)));
}

TEST_CASE("a case that measures nothing fails and what it leaves out does not count for it")
{
    const Case nothing{"nothing", "stability", "", "", [] { return std::vector<Measured>{}; }};
    CHECK(!run_case(nothing).passed());
    const Case skipped{"skipped", "stability", "", "",
                       [] { return std::vector<Measured>{left_out("all of it", "no time")}; }};
    const CaseResult r = run_case(skipped);
    CHECK(!r.passed());
    REQUIRE(!r.rows.empty());
    CHECK(r.rows.back().note == "nothing was measured");
    CHECK(!CaseResult{}.passed());
}

TEST_CASE("what is left out and what misses its source's tolerance is reported with its reason")
{
    CaseResult r;
    r.name = "bend";
    r.suite = "benchmarks";
    r.rows = {relative("tip", 1, 1.0001, 1e-3), left_out("twist", "the section has none"),
              missed(relative("root", 1, 1.01, 1e-3), "first order in the step"),
              missed(relative("middle", 1, 1, 1e-3), "never")};
    CHECK(r.passed());
    CHECK(r.rows[3].left_out.empty()); // it does not miss any more
    const std::vector<CaseResult> back = read_results(json_of({r}), "validation.json");
    REQUIRE(back.size() == 1);
    REQUIRE(back[0].rows.size() == 4);
    CHECK(back[0].left_out.empty());
    CHECK(back[0].passed());
    for (const std::string& text :
         {text_of(back[0]), csv_of(back), markdown_of(back), html_of(back, "", {})}) {
        CHECK(text.find("the section has none") != std::string::npos);
        CHECK(text.find("first order in the step") != std::string::npos);
        CHECK(text.find("missed") != std::string::npos);
        CHECK(text.find("nan") == std::string::npos);
    }
    CHECK(json_of(back) == json_of({r}));
    CHECK(left_out_text(back).find("1 parts of cases left out, 1 rows") != std::string::npos);
    CHECK(missed(relative("", 1, std::nan(""), 1e-3), "first order").failed());
    r.rows.push_back(relative("end", 1, 2, 1e-3));
    CHECK(!r.passed());
}

TEST_CASE("cases have names of their own and a suite")
{
    std::set<std::string_view> names;
    CHECK(cases().size() > 20);
    for (const Case& c : cases()) {
        CHECK(names.insert(c.name).second);
        CHECK((c.suite == "benchmarks" || c.suite == "stability"));
        CHECK(!c.source.empty());
        CHECK(!c.verified.empty());
    }
}

TEST_CASE("means weigh every step with its length and are NaN where there are no steps")
{
    Run run;
    for (double x : {0.0, 1.0, 1.5, 4.0}) {
        Step s;
        s.insertion = x;
        s.push = 2 * x + 1;
        run.steps.push_back(s);
    }
    CHECK(mean(run, &Step::push, 0.5, 3.5) == doctest::Approx(5).epsilon(1e-14));
    CHECK(mean(run, &Step::push, 1, 1.25) == doctest::Approx(3.25).epsilon(1e-14));
    CHECK(std::isnan(mean(run, &Step::push, 3, 5)));
    CHECK(value_at(run, &Step::push, 1.2) == doctest::Approx(3.4).epsilon(1e-14));
    CHECK(largest(run, &Step::push) == 9);
}

TEST_CASE("points of a curve are sorted by x but references at some places are no line")
{
    const double none = std::nan("");
    ReferenceCurve c{"x", "y", {}, {}, {}};
    c.add(2, 20, 21);
    c.add(1, 10, 11);
    const ReferenceCurve sorted = by_x(c);
    CHECK(sorted.x == std::vector<double>{1, 2});
    CHECK(sorted.reference == std::vector<double>{10, 20});
    CHECK(sorted.value == std::vector<double>{11, 21});
    CHECK(sorted.x_label == "x");

    CaseResult r;
    r.name = "bend";
    r.rows.push_back(at_most("off", 0, 1));
    r.rows[0].curve = sorted;
    const auto script = [&] { return plots_of({r}).at(1).second; };
    CHECK(script().find("$reference with lines") != std::string::npos);
    r.rows[0].curve.add(3, none, 31);
    CHECK(script().find("$reference with points") != std::string::npos);
    CHECK(script().find("3 31\n") != std::string::npos);
    CHECK(script().find("nan") == std::string::npos);
    // through the file and back
    const std::vector<CaseResult> back = read_results(json_of({r}), "validation.json");
    CHECK(back.at(0).rows.at(0).curve.value == r.rows[0].curve.value);
    CHECK(std::isnan(back.at(0).rows.at(0).curve.reference.at(2)));
}

TEST_CASE("a scene in other units has every length and force in them")
{
    const Scene a = scene("double-u"), b = scaled(a, 1000, 3);
    const BeamSegment &g = a.beams[0].segments[0], &k = b.beams[0].segments[0];
    CHECK(k.length == doctest::Approx(330));
    CHECK(k.EI[0] == doctest::Approx(3e6 * g.EI[0]));
    CHECK(k.EA[1] == doctest::Approx(3 * g.EA[1]));
    CHECK(b.obstacles[0].surface.radius == doctest::Approx(4));
    CHECK(b.obstacles[0].surface.centreline.pieces[1].radius == doctest::Approx(30));
    CHECK(b.obstacles[0].surface.centreline.pieces[1].angle ==
          a.obstacles[0].surface.centreline.pieces[1].angle);
    CHECK(b.beams[0].insertion.back()[1] == doctest::Approx(300));
    CHECK(b.beams[0].introducer.fade == doctest::Approx(5));
}
