#include "validation/folder_case.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"
#include "mesh/format/columns.hpp"
#include "validation/report.hpp"

#include <cmath>
#include <doctest/doctest.h>
#include <filesystem>
#include <unistd.h>

using namespace amontons;
using namespace amontons::validation;

namespace {

FolderCase parse(const std::string& measures, const std::string& more = "")
{
    return parse_folder_case(
        R"({"suite": "benchmarks", "source": "s", "verified": "v", "scene": "a.json",)" + more +
            R"("measure": [)" + measures + "]}",
        "case.json", [](const std::string& f) { return f != "missing.csv"; });
}

std::string issues_of_case(const std::string& measures, const std::string& more = "")
{
    try {
        parse(measures, more);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

SceneAnswer answer(const std::string& json, int code = 0, const std::string& words = "")
{
    SceneAnswer a;
    a.exit_code = code;
    a.json = json;
    a.last_words = words;
    return a;
}

const char* const kDone =
    R"({"certificate": {"uncertified_steps": 0}, "quantities": {"q": 2.002}})";

} // namespace

TEST_CASE("a folder's numbers are compared as it specifies")
{
    const FolderCase c = parse(R"({"quantity": "q", "reference": 2, "tolerance": 2e-3},
        {"quantity": "q", "reference": 2, "tolerance": 1e-3, "error": "absolute", "scale": -1},
        {"quantity": "q", "reference": 2, "tolerance": 1e-4})");
    const auto rows = measure(c, [](const std::string&, const auto&) { return answer(kDone); });
    CHECK(rows[0].error == doctest::Approx(1e-3));
    CHECK(rows[0].passed());
    CHECK(rows[1].error == doctest::Approx(4.002));
    CHECK(!rows[2].passed());
}

TEST_CASE("a text passes where it is the same, and states what it is where not")
{
    const FolderCase c = parse(R"({"quantity": "branch", "reference": "left"},
        {"quantity": "branch", "reference": ""}, {"quantity": "status", "reference": "done"})");
    const auto rows = measure(c, [](const std::string&, const auto&) {
        return answer(R"({"status": "done", "certificate": {"uncertified_steps": 0},
                          "quantities": {"branch": "left"}})");
    });
    CHECK(rows[0].passed());
    CHECK(!rows[1].passed());
    CHECK(rows[1].note == "it is \"left\"");
    CHECK(rows[2].passed());
}

TEST_CASE("an answer without certificate and a run that failed pass nothing")
{
    const FolderCase c = parse(R"({"quantity": "q", "reference": 2, "tolerance": 1})");
    const auto uncertified = measure(c, [](const std::string&, const auto&) {
        return answer(R"({"certificate": {"uncertified_steps": 3}, "quantities": {"q": 2}})");
    });
    CHECK(!uncertified[0].passed());
    CHECK(uncertified[0].note == "3 steps without certificate");
    const auto failed = measure(
        c, [](const std::string&, const auto&) { return answer("{}", 3, "failed: stuck"); });
    CHECK(!failed[0].passed());
    CHECK(failed[0].note == "failed: stuck");
}

TEST_CASE("the order of a case is the slope of its errors, and none where they rise")
{
    // q = 2 + h^2: of second order against 2; against the finest of 1, 1/2, 1/4 more, since that
    // is not the limit.
    const auto run = [](const std::string&, const std::vector<std::string>& set) {
        REQUIRE(set.size() == 1);
        const double h = std::stod(set[0].substr(set[0].find('=') + 1));
        return answer(R"({"certificate": {"uncertified_steps": 0}, "steps": )" +
                      std::to_string(int(8 / h)) + R"(, "quantities": {"q": )" +
                      std::to_string(2 + h * h) + "}}");
    };
    const auto order = [&](const std::string& reference, const std::string& at_least,
                           const std::string& values = "[1, 0.5, 0.25]") {
        return measure(parse(R"({"quantity": "q", "order": {"path": "time.step", "values": )" +
                             values + R"(}, "reference": )" + reference + R"(, "at_least": )" +
                             at_least + "}"),
                       run)[0];
    };
    CHECK(order("2", "1.99").value == doctest::Approx(2).epsilon(1e-4));
    CHECK(order("2", "1.99").passed());
    CHECK(!order("2", "2.01").passed());
    CHECK(order("\"finest\"", "2").value == doctest::Approx(std::log2(5)).epsilon(1e-4));
    CHECK(!order("2.5", "0").passed()); // errors rise: no order
    CHECK(std::isnan(order("2.5", "0").error));
    CHECK(issues_of_case(R"({"quantity": "q", "order": {"path": "time.step", "values": [1, 2]},
                             "reference": 2, "at_least": 1})")
              .find("measure.0.order.values") != std::string::npos);
    CHECK(issues_of_case(R"({"quantity": "q", "order": {"path": "p", "values": [1, 2, 3]},
                             "reference": "fine", "at_least": 1})")
              .find("\"finest\"") != std::string::npos);
}

TEST_CASE("a run that fails leaves no order")
{
    const auto rows = measure(
        parse(R"({"quantity": "q", "order": {"path": "time.step", "values": [1, 2, 3]},
                          "reference": 2, "at_least": 1})"),
        [](const std::string&, const auto& set) {
            return set[0] == "time.step=2" ? answer("{}", 3, "failed: stuck") : answer(kDone);
        });
    CHECK(!rows[0].passed());
    CHECK(rows[0].note == "time.step = 2: failed: stuck");
}

TEST_CASE("a refusal passes only with its reason")
{
    const FolderCase c = parse(R"({"refused": "penetration"})");
    const auto row = [&](int code, const char* words) {
        return measure(
            c, [&](const std::string&, const auto&) { return answer(kDone, code, words); })[0];
    };
    CHECK(row(3, "failed: no motion avoids penetration").passed());
    CHECK(!row(3, "failed: not enough memory").passed());
    CHECK(!row(0, "penetration").passed());
    CHECK(!row(-1, "ended by signal 11 in penetration").passed());
}

TEST_CASE("a contact problem passes with its status and an error below its tolerance")
{
    FolderCase c = parse(R"({"problem": "tower.hdf5", "tolerance": 1e-8},
        {"problem": "jam.hdf5", "status": "infeasible", "tolerance": 1e-8})");
    c.scenes.clear();
    c.folder = "cases/c";
    std::string set_of_run;
    const auto rows = [&](const std::string& first, const std::string& second) {
        return measure(
            c, {},
            [&](const std::string& file, double tolerance) {
                CHECK(tolerance == 1e-8);
                set_of_run += file + " ";
                return answer(file.find("tower") != std::string::npos ? first : second);
            },
            "data");
    };
    const auto good = rows(R"({"status": "converged", "error": 9e-9, "contacts": 4})",
                           R"({"status": "infeasible", "error": 1, "contacts": 2})");
    CHECK(good[0].passed());
    CHECK(good[0].error == 9e-9);
    CHECK(good[1].passed());
    CHECK(set_of_run == "data/tower.hdf5 data/jam.hdf5 ");
    const auto bad =
        rows(R"({"status": "stagnated", "error": 9e-9})", R"({"status": "converged", "error": 0})");
    CHECK(!bad[0].passed());
    CHECK(!bad[1].passed());
    CHECK(!rows(R"({"status": "converged", "error": 2e-8})", "")[0].passed());
    CHECK(!rows(R"({"status": "converged"})", "")[1].passed());
    CHECK(
        issues_of_case(R"({"problem": "missing.csv", "tolerance": 1})").find("measure.0.problem") !=
        std::string::npos);
    CHECK(issues_of_case(R"({"problem": "missing.csv", "tolerance": 1})", R"("data": "fclib",)") ==
          "");
}

TEST_CASE("scenes of a case on data of elsewhere name its folder")
{
    FolderCase c = parse(R"({"quantity": "q", "reference": 2, "tolerance": 1})", R"("data": "d",)");
    c.scenes[0].set = {"bodies.b.mesh={data}/b.msh"};
    std::string set_of_run;
    measure(
        c,
        [&](const std::string&, const std::vector<std::string>& set) {
            set_of_run = set.at(0);
            return answer(kDone);
        },
        {}, "/far/d");
    CHECK(set_of_run == "bodies.b.mesh=/far/d/b.msh");
}

TEST_CASE("a curve is held to its largest distance and where the run has no value it fails")
{
    const std::string folder =
        (std::filesystem::temp_directory_path() / ("amontons_case" + std::to_string(::getpid())))
            .string();
    make_folder(folder);
    write_file(folder + "/r.csv", "t,y\n0,0\n0.5,1\n1,2\n");
    FolderCase c = parse(R"({"curve": "r.csv", "x": "t", "y": "y", "tolerance": 0.06})");
    c.folder = folder;
    const auto row = [&](const char* history) {
        write_file(folder + "/history.csv", history);
        return measure(c, [&](const std::string&, const auto&) {
            SceneAnswer a = answer(kDone);
            a.folder = folder;
            return a;
        })[0];
    };
    const Measured near = row("t,y\n0,0\n1,2.1\n");
    CHECK(near.error == doctest::Approx(0.05)); // of 2
    CHECK(near.passed());
    CHECK(near.curve.value[1] == doctest::Approx(1.05));
    CHECK(!row("t,y\n0,0\n0.9,1.8\n").passed());
    CHECK_THROWS_AS(row("t,z\n0,0\n"), InputError);
    std::filesystem::remove_all(folder);
}

TEST_CASE("all that is wrong with a case is reported with its place")
{
    CHECK(issues_of_case(R"({"quantity": "q", "reference": 1, "tolerance": 1})").empty());
    const std::string all = issues_of_case(R"({"quantity": "q", "refernce": 1, "tolerance": -1},
        {"curve": "missing.csv", "x": "t", "y": "y", "tolerance": 1}, {"scene": "b", "refused": "x"},
        {"quantity": "q", "curve": "r", "reference": 1, "tolerance": 1}, 7)",
                                           R"("sweet": 1,)");
    for (const char* part :
         {"\"reference\" (nearest name)", "measure.0.tolerance", "missing.csv", "measure.2.scene",
          "2 of quantity, curve, refused, problem and left_out", "measure.4", "\"sweet\""})
        CHECK_MESSAGE(all.find(part) != std::string::npos, part << " in " << all);
    CHECK(
        issues_of_case(R"({"quantity": "q", "reference": 0, "error": "relative", "tolerance": 1})")
            .find("absolute") != std::string::npos);
    const auto without_readme = [] {
        parse_folder_case(R"({"suite": "x", "measure": []})", "case.json",
                          [](const std::string&) { return false; });
    };
    CHECK_THROWS_WITH_AS(without_readme(), doctest::Contains("README.md"), InputError);
}

TEST_CASE("the first paragraph of its README describes a case")
{
    const std::string folder =
        (std::filesystem::temp_directory_path() / ("amontons_about" + std::to_string(::getpid())))
            .string();
    CHECK(about_case(folder).empty());
    make_folder(folder);
    CHECK(about_case(folder).empty());
    write_file(folder + "/README.md", "# A block\n\nIt slides\non a plane.\n\nMore.\n");
    CHECK(about_case(folder) == "It slides on a plane.");
    write_file(folder + "/README.md", "# A block\n");
    CHECK(about_case(folder).empty());
    std::filesystem::remove_all(folder);
}

TEST_CASE("tables of numbers are read by name and their mistakes by line")
{
    const Columns t = parse_columns("# a\n\"x [m]\", y\n1,2\n\n3,\n", "f.csv");
    CHECK(t.names == std::vector<std::string>{"x [m]", "y"});
    CHECK(*t.find("x [m]") == std::vector<double>{1, 3});
    CHECK(std::isnan((*t.find("y"))[1]));
    CHECK(t.find("z") == nullptr);
    for (const char* text : {"", "x,y\n", "x,y\n1\n", "x\n1a\n", "x\n1e999\n"})
        CHECK_THROWS_AS(parse_columns(text, "f.csv"), InputError);
    CHECK(value_at({0, 1, 2}, {0, 10, 0}, 1.5) == 5);
    CHECK(value_at({2, 1, 0}, {0, 10, 20}, 0.5) == 15);
    CHECK(std::isnan(value_at({0, 1}, {0, 1}, 1.1)));
}

TEST_CASE("results survive the way through JSON and the report counts them")
{
    CaseResult r;
    r.name = "a<b";
    r.suite = "stability";
    r.source = "x, \"y\"";
    r.seconds = 0.25;
    r.rows = {relative("q", 2, 2.002, 1e-4), at_most("z", std::nan(""), 1)};
    r.rows[0].curve = {"t", "y", {0, 1}, {0, 1}, {0, std::nan("")}};
    CaseResult left;
    left.name = "left";
    left.left_out = "no data";
    const std::vector<CaseResult> all{r, left};
    const std::vector<CaseResult> back = read_results(json_of(all), "json");
    CHECK(json_of(back) == json_of(all));
    CHECK(csv_of(back) == csv_of(all));
    REQUIRE(back.size() == 2);
    CHECK(back[1].left_out == "no data");
    CHECK(!back[0].rows[1].passed());
    const std::string html = html_of(back, "", {"a<b-1"});
    CHECK(html.find("2 cases, 2 rows, 2 failed; 1 cases left out") != std::string::npos);
    CHECK(html.find("a<b") == std::string::npos);
    CHECK(html.find("plots/a&lt;b-1.svg") != std::string::npos);
    CHECK(plots_of(back).size() == 2);
    for (const char* text : {"", "{}", "[1]"})
        CHECK_THROWS_AS(read_results(text, "json"), InputError);
}
