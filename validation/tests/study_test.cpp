#include "validation/study/table.hpp"

#include "mesh/base/error.hpp"

#include <algorithm>
#include <cmath>
#include <doctest/doctest.h>

using namespace amontons;
using namespace amontons::study;

namespace {

/// A study whose values are made by a formula of its parameters.
template <class Value>
Table made(const std::vector<std::string>& sweeps, double reference, Value value)
{
    Table t;
    for (const std::string& s : sweeps)
        t.sweeps.push_back(parse_sweep(s));
    t.quantity = "q";
    t.kind = ReferenceKind::value;
    t.reference = reference;
    for (const Point& p : all_points(t.sweeps)) {
        PointRecord r;
        r.status = "done";
        std::vector<double> sizes;
        for (std::size_t s = 0; s < t.sweeps.size(); ++s)
            sizes.push_back(size_of(t.sweeps[s], p.values[s]));
        value(sizes, r);
        t.rows.push_back(make_row(p, r, "q"));
    }
    evaluate(t);
    return t;
}

} // namespace

TEST_CASE("commas within brackets and quotes do not separate values")
{
    const Sweep s = parse_sweep("a.cells,b.cells=[2,2,1],[4,4,1],\"x,y\",{\"k\":[1,2]},T4");
    CHECK(s.paths == std::vector<std::string>{"a.cells", "b.cells"});
    CHECK(s.values ==
          std::vector<std::string>{"[2,2,1]", "[4,4,1]", "\"x,y\"", "{\"k\":[1,2]}", "T4"});
    CHECK(overrides({s}, {1, {"[4,4,1]"}}) ==
          std::vector<std::string>{"a.cells=[4,4,1]", "b.cells=[4,4,1]"});
}

TEST_CASE("a row with a step without certificate is no reference and on no front")
{
    Table t = made({"n=1,2,4"}, 0, [](const std::vector<double>& s, PointRecord& r) {
        r.seconds = 1 / s[0]; // the finest would be the quickest
        r.numbers = {{"q", s[0]}, {"unknowns", s[0]}};
        if (s[0] == 4) r.numbers.emplace_back("certificate.uncertified_steps", 1);
    });
    CHECK(t.rows[2].status == "uncertified");
    CHECK(t.rows[2].value == 4);
    CHECK(!t.rows[2].on_front);
    t.kind = ReferenceKind::finest;
    evaluate(t);
    CHECK(t.rows[1].is_reference);
    CHECK(t.reference == 2);
}

TEST_CASE("sweeps that cannot be meant are refused")
{
    for (const char* text :
         {"", "a", "=1", "a=", "a=1,,2", "a=1,1", "a=[1,2", "a=1]", "a=\"x", ",a=1"})
        CHECK_THROWS_AS(parse_sweep(text), InputError);
    CHECK_THROWS_AS(all_points({parse_sweep("a=1,2"), parse_sweep("b,a=1")}), InputError);
    std::string many = "a=0";
    for (int i = 1; i < 400; ++i)
        many += "," + std::to_string(i);
    CHECK_THROWS_AS(all_points({parse_sweep(many), parse_sweep("b" + many.substr(1))}), InputError);
    for (const char* text : {"", "1", "0/2", "3/2", "1/2x", "/2", "-1/2"})
        CHECK_THROWS_AS(parse_shard(text), InputError);
}

TEST_CASE("shards share out all points and none twice")
{
    const std::vector<Point> points = all_points({parse_sweep("a=1,2,3"), parse_sweep("b=x,y")});
    CHECK(points.size() == 6);
    CHECK(points[1].values == std::vector<std::string>{"1", "y"});
    for (const Point& p : points) {
        int n = 0;
        for (const char* s : {"1/4", "2/4", "3/4", "4/4"})
            n += parse_shard(s).has(p);
        CHECK(n == 1);
    }
}

TEST_CASE("an error of C h^p has the order p whether h or 1/h is swept")
{
    const Table by_step = made({"time.step=0.4,0.2,0.1"}, 2, [](const auto& x, PointRecord& r) {
        r.numbers = {{"q", 2 - 0.3 * std::pow(x[0], 1.5)}, {"steps", 1 / x[0]}};
    });
    CHECK(by_step.order == doctest::Approx(1.5));
    const Table by_cells =
        made({"m.cells=[2,1,2],[4,1,4],[8,1,8]"}, 2, [](const auto& x, PointRecord& r) {
            r.numbers = {{"q", 2 + 0.3 * std::pow(x[0], -2)}, {"unknowns", 3 * x[0] * x[0]}};
        });
    CHECK(by_cells.order == doctest::Approx(2));
    REQUIRE(by_cells.series.size() == 1);
    REQUIRE(by_cells.series[0].orders.size() == 2);
    CHECK(by_cells.series[0].orders[1] == doctest::Approx(2));
    // Each kind its own order; of both together there is none.
    const Table kinds = made({"k=0,1", "n=2,4,8"}, 2, [](const auto& x, PointRecord& r) {
        r.numbers = {{"q", 2 + std::pow(x[1], x[0] - 3)}, {"unknowns", x[1]}};
    });
    CHECK(kinds.refined == 1);
    CHECK(std::isnan(kinds.order));
    REQUIRE(kinds.series.size() == 2);
    CHECK(kinds.series[0].order == doctest::Approx(3));
    CHECK(kinds.series[1].order == doctest::Approx(2));
}

TEST_CASE("the finest row is the reference and takes no part in order and front")
{
    Table t = made({"n=2,4,8,16"}, 0, [](const auto& x, PointRecord& r) {
        r.numbers = {{"q", 1 + std::pow(x[0], -2)}, {"unknowns", x[0]}};
        r.seconds = x[0];
    });
    t.kind = ReferenceKind::finest;
    evaluate(t);
    CHECK(t.rows[3].is_reference);
    CHECK(t.reference == 1 + 1.0 / 256);
    CHECK(!t.rows[3].on_front);
    CHECK(t.order > 2); // of the errors against a run that has one itself
    CHECK(t.order < 2.3);
}

TEST_CASE("the front has every row that no other beats in both and no row more")
{
    const double seconds[] = {1, 2, 3, 4, 5}, errors[] = {0.5, 0.6, 0.1, 0.1, 0.01};
    const Table t = made({"k=0,1,2,3,4"}, 1, [&](const auto& x, PointRecord& r) {
        r.seconds = seconds[int(x[0])];
        r.numbers = {{"q", 1 + errors[int(x[0])]}};
    });
    std::string front;
    for (const Row& r : t.rows)
        front += r.on_front ? '1' : '0';
    CHECK(front == "10101");
}

TEST_CASE("of a quantity in words the study states how often which came out")
{
    const Table t = made({"n=1,2,3,4,5"}, 0, [](const auto& x, PointRecord& r) {
        if (x[0] == 4)
            r = {"", {}, "failed", "no", "", 1, 1, {}, {}};
        else
            r.texts = {{"quantities.q", x[0] == 2 ? "" : x[0] < 4 ? "left, common" : "right"}};
    });
    CHECK(text_counts(t) ==
          std::vector<std::pair<std::string, int>>{{"left, common", 2}, {"", 1}, {"right", 1}});
    const std::string text = text_of(t);
    CHECK(text.find("2 of 5  left, common\n") != std::string::npos);
    CHECK(text.find("1 of 5  none\n") != std::string::npos);
    CHECK(csv_of(t).find("\n0,1,\"left, common\",,") != std::string::npos);
    const Texts read = texts_of(json_of(t), "json");
    CHECK(find(numbers_of(json_of(t), "json"), "counts.right") == 1);
    CHECK(plot_script(t, "study").empty());
}

TEST_CASE("no order is reported where errors do not fall from each row to the finer one")
{
    const auto order = [](double middle) {
        return made({"n=1,2,4,8"}, 1, [&](const auto& x, PointRecord& r) {
            const double error = x[0] == 2 ? middle : std::pow(x[0], -2);
            r.numbers = {{"q", 1 + error}, {"unknowns", x[0]}};
        });
    };
    CHECK(order(0.25).order == doctest::Approx(2));
    CHECK(std::isnan(order(1.5).order));
    CHECK(text_of(order(1.5)).find("no order: errors do not fall monotonically") !=
          std::string::npos);
    CHECK(std::isfinite(order(0.8).order));
}

TEST_CASE("points of another program have errors as well and are in plot and tables")
{
    Table t = made({"n=1,2,4"}, 1, [](const auto& x, PointRecord& r) {
        r.numbers = {{"q", 1 + std::pow(x[0], -2)}, {"unknowns", x[0]}};
        r.seconds = x[0];
        r.cpu_seconds = 5 - x[0];
    });
    t.added =
        read_added("name,seconds [s],value,unknowns\nother,0.5,1.25,7\n# no\nother,2,1.01,\n", "a");
    evaluate(t);
    REQUIRE(t.added.size() == 2);
    CHECK(t.added[0].error == doctest::Approx(0.25));
    CHECK(std::isnan(t.added[1].unknowns));
    CHECK(plot_script(t, "study").find("0.5 0.25\n") != std::string::npos);
    CHECK(plot_script(t, "study").find("title 'other'") != std::string::npos);
    CHECK(text_of(t).find("other") != std::string::npos);
    const std::string tex = tex_of(t);
    CHECK(tex.find("\\begin{tabular}{lrrrr}") != std::string::npos);
    CHECK(tex.find("4 & 1.0625 & $6.2\\cdot 10^{-2}$ & 4 & 4 \\\\") != std::string::npos);
    CHECK(tex.find("other &  & ") == std::string::npos);
    // By processor time another row is on the front.
    CHECK(t.rows[0].on_front);
    t.by_cpu = true;
    evaluate(t);
    CHECK(!t.rows[0].on_front);
    CHECK(t.rows[2].on_front);
    CHECK(plot_script(t, "study").find("processor time") != std::string::npos);
    // The table of another study: named by its folder and what it varied, what failed left out.
    const std::vector<AddedRow> ours = read_added(
        "point,time.step,\"q, all\",error,seconds [s],cpu_seconds [s],unknowns,steps,status\n"
        "0,0.1,1.5,0.5,3,2,7,10,done\n1,\"[1,2]\",,,9,8,7,0,failed\n2,0.3,1.25,0.25,4,3,7,5,done\n",
        "out/theirs/study.csv", "q, all", true);
    REQUIRE(ours.size() == 2);
    CHECK(ours[0].name == "theirs 0.1");
    CHECK(ours[0].value == 1.5);
    CHECK(ours[0].seconds == 2);
    CHECK(ours[1].name == "theirs 0.3");
    CHECK(ours[1].unknowns == 7);
    for (const char* bad :
         {"", "name,seconds\na,1\n", "name,seconds,error\na,x,1\n", "name,seconds,error\na,-1,1\n"})
        CHECK_THROWS_AS(read_added(bad, "a.csv"), InputError);
}

TEST_CASE("a table of words has no column of errors")
{
    Table t = made({"n=1,2"}, 1, [](const auto& x, PointRecord& r) {
        r.numbers = {{"unknowns", x[0]}};
        r.texts = {{"quantities.q", x[0] == 1 ? "left_carotid" : ""}};
    });
    const std::string tex = tex_of(t);
    CHECK(tex.find("\\begin{tabular}{llrr}") != std::string::npos);
    CHECK(tex.find("error") == std::string::npos);
    CHECK(tex.find("1 & left\\_carotid & ") != std::string::npos);
    for (std::size_t at = tex.find("midrule"); (at = tex.find('\n', at)) != std::string::npos;) {
        const std::string line = tex.substr(++at, tex.find('\n', at) - at);
        if (!line.empty() && line[0] != '\\') CHECK(std::ranges::count(line, '&') == 3);
    }
}

TEST_CASE("failures are rows with their reason without value and error")
{
    Table t = made({"n=1,2,4"}, 1, [](const auto& x, PointRecord& r) {
        r.numbers = {{"quantities.q", 1 + 1 / x[0]}, {"unknowns", x[0]}};
        if (x[0] == 2) r = {"", {}, "failed", "a jam, \"at\" 3 mm", "", 1, 1, {}, {}};
        if (x[0] == 4) r.numbers = {{"other", 1.0}};
    });
    CHECK(t.rows[0].error == doctest::Approx(1));
    CHECK(std::isnan(t.rows[1].error));
    CHECK(t.rows[2].status == "no_quantity");
    CHECK(csv_of(t).find("failed,0,0,\"a jam, \"\"at\"\" 3 mm\"\n") != std::string::npos);
    const Numbers read = numbers_of(json_of(t), "json");
    CHECK(find(read, "reference") == 1);
    CHECK(std::isnan(*find(read, "order")));
    // Nothing is done: nothing to draw, and no reference.
    for (Row& r : t.rows)
        r.status = "failed";
    t.kind = ReferenceKind::finest;
    evaluate(t);
    CHECK(std::isnan(t.reference));
    CHECK(plot_script(t, "study").empty());
}

TEST_CASE("numbers are found by path and by the name of a quantity with the nearest name")
{
    const Numbers n = numbers_of(
        R"({"seconds": {"total": 2}, "quantities": {"depth": 0.3, "branch": "LCCA"}})", "run");
    CHECK(find(n, "seconds.total") == 2);
    CHECK(find(n, "depth") == 0.3);
    CHECK(find(n, "quantities.depth") == 0.3);
    CHECK(!find(n, "branch"));
    const Texts t =
        texts_of(R"({"status": "done", "quantities": {"depth": 0.3, "branch": "LCCA"}})", "run");
    CHECK(find(t, "branch") == "LCCA");
    CHECK(find(t, "status") == "done");
    CHECK(!find(t, "depth"));
    CHECK(allowed_names(n, t, "dept").find("\"depth\" (nearest name)") == 0);
    CHECK(allowed_names(n, t, "brunch").find("\"branch\" (nearest name)") == 0);
    CHECK_THROWS_AS(numbers_of("[1]", "run"), InputError);
}

TEST_CASE("what a folder keeps reads back the same and damage is named")
{
    const PointRecord r{"ab", {"a=1"},          "done",           "odd", "0.1", 0.1,
                        0.2,  {{"q", 1.0 / 3}}, {{"branch", "a"}}};
    const PointRecord back = read_record(record_text(r), "file");
    CHECK(back.numbers == r.numbers);
    CHECK(back.texts == r.texts);
    CHECK(back.overrides == r.overrides);
    CHECK(record_text(back) == record_text(r));
    for (const char* text : {"", "{", "[]", "{}", R"({"hash": 1})"})
        CHECK_THROWS_AS(read_record(text, "file"), InputError);
    try {
        read_definition(R"({"scene": "a", "set": [1]})", "study.json");
        FAIL("read");
    } catch (const InputError& error) {
        CHECK(error.issues().size() == 6);
        CHECK(error.issues()[1].place == "set");
    }
}
