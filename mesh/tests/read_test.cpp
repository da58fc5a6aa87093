#include "mesh/format/read.hpp"

#include "mesh/base/file.hpp"
#include "mesh/format/csv.hpp"
#include "mesh/format/slicer_markups.hpp"
#include "mesh/format/stl.hpp"
#include "mesh/size_field.hpp"
#include "mesh/tests/sample_surfaces.hpp"
#include "mesh/tests/temporary_folder.hpp"
#include "mesh/tests/test_program.hpp"

#include <Eigen/Geometry>
#include <cstring>
#include <doctest/doctest.h>

using namespace amontons;

namespace {

std::string refused_csv(const std::string& text)
{
    return refusal([&] { parse_centreline_csv(text, "f"); });
}

/// Slicer's format, cut down to what it needs.
const std::string kMarkups = R"({
  "@schema": "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#",
  "markups": [
    {"type": "Fiducial", "controlPoints": []},
    {
      "type": "Curve", "coordinateSystem": "LPS", "coordinateUnits": "mm",
      "controlPoints": [
        {"id": "1", "position": [-10.5, 20.25, 30.0], "positionStatus": "defined"},
        {"id": "2", "position": [0, 0, 0], "positionStatus": "undefined"},
        {"id": "3", "position": [-11, 21, 32], "positionStatus": "defined"}
      ],
      "measurements": [
        {"name": "length", "enabled": false, "units": "mm", "printFormat": "%-#4.4g%s"},
        {"name": "Radius", "enabled": true, "units": "mm", "controlPointValues": [12.5, 99, 13]}
      ]
    }
  ]
})";

std::string markups_with(const char* what, const char* by)
{
    std::string text = kMarkups;
    return text.replace(text.find(what), std::strlen(what), by);
}

std::string refused_markups(const std::string& text)
{
    return refusal([&] { parse_slicer_markups(text, "f"); });
}

} // namespace

TEST_CASE("the suffix picks the format in any case")
{
    const TemporaryFolder folder;
    for (const char* name : {"a.stl", "b.OBJ", "c.x.Ply"}) {
        write_surface(folder / name, unit_cube());
        const SurfaceMesh mesh = read_surface(folder / name, 2);
        CHECK(mesh.points == moved(unit_cube(), 2, Vec3::Zero()).points);
        CHECK(mesh.triangles == unit_cube().triangles);
    }
}

TEST_CASE("vertices at one place are merged in every format")
{
    const TemporaryFolder folder;
    SurfaceMesh twice = unit_cube();
    twice.points.push_back(twice.points[0]);
    twice.triangles[0][0] = 8;
    for (const char* name : {"a.stl", "a.obj", "a.ply"}) {
        write_surface(folder / name, twice);
        CHECK(read_surface(folder / name, 1).points.size() == 8);
    }
}

TEST_CASE(".vtp is passed to the reader that is handed in")
{
    std::string requested;
    const VtpReader vtp = [&](const std::string& path) {
        requested = path;
        return unit_cube();
    };
    CHECK(read_surface("a/b.vtp", 3, vtp).points == moved(unit_cube(), 3, Vec3::Zero()).points);
    CHECK(requested == "a/b.vtp");
    CHECK(refusal([] { read_surface("a.vtp", 1); }).find("no VTK module") != std::string::npos);
    const VtpReader bad = [&](const std::string&) {
        SurfaceMesh mesh = unit_cube();
        mesh.points[2][1] = std::nan("");
        return mesh;
    };
    CHECK(refusal([&] { read_surface("a.vtp", 1, bad); }) ==
          "a.vtp: vertex 2: found coordinates 1 nan 0, allowed: finite numbers");
    CHECK(refusal([&] {
              read_surface("a.vtp", 1, [](const std::string&) { return SurfaceMesh{}; });
          }).find("without triangles") != std::string::npos);
}

TEST_CASE("a suffix or scale or file that does not fit is refused")
{
    CHECK(refusal([] { read_surface("a.step", 1); }) ==
          "a.step: found suffix \".step\", allowed: .stl, .obj or .ply; Gmsh meshes this shape: "
          "gmsh \"a.step\" -2 -o part.stl (lengths are then millimetres mostly: \"scale\": 0.001)");
    CHECK(refusal([] {
              read_surface("a.vtu", 1);
          }).find("amontons mesh surface \"a.vtu\" -o part.stl") != std::string::npos);
    CHECK(refusal([] { read_surface("dir.stl/a", 1); }).find("without suffix") !=
          std::string::npos);
    CHECK(refusal([] { read_centreline("a.stl", 1); }).find(".mrk.json") != std::string::npos);
    CHECK(refusal([] { write_surface("a.vtk", unit_cube()); }).find(".stl, .obj or .ply") !=
          std::string::npos);
    for (const double scale : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
        CHECK(refusal([&] { read_surface("a.stl", scale); }).find("found scale") !=
              std::string::npos);
        CHECK(refusal([&] { read_centreline("a.csv", scale); }).find("found scale") !=
              std::string::npos);
    }
    CHECK(refusal([] { read_surface("/nowhere/a.stl", 1); }) ==
          "/nowhere/a.stl: found no such file, allowed: an existing file");
}

TEST_CASE("a centreline reads back as it was written")
{
    const TemporaryFolder folder;
    Polyline line;
    for (int i = 0; i < 50; ++i) {
        line.points.emplace_back(std::sin(i), 1e-7 * i, 1 / 3.0 + i);
        line.radius.push_back(0.1 + 0.01 * i);
    }
    write_file(folder / "a.csv", centreline_csv(line));
    const Polyline again = read_centreline(folder / "a.csv", 1);
    CHECK(again.points == line.points);
    CHECK(again.radius == line.radius);
    line.radius.clear();
    CHECK(parse_centreline_csv(centreline_csv(line), "f").radius.empty());
}

TEST_CASE("CSV: separators and comments and headers in any order")
{
    const std::vector<Vec3> points = {{0, 0, 0}, {1, 2, 3}};
    for (const char* text : {"0,0,0\n1,2,3", "0;0;0\n1;2;3;\n", "0 0 0\r\n1\t2   3\r\n",
                             "# a\n\n%b\n0,0,0\n\n1, 2 ,+3", "x,y,z\n0,0,0\n1,2,3\n",
                             "Z [mm];X (mm);Y;note\n0;0;0;9\n3;1;2;9\n",
                             "\xef\xbb\xbfX Y Z\n0 0 0\n1 2 3\n", "0,0,0\n0,0,0\n1,2,3\n1,2,3\n"})
        CHECK(parse_centreline_csv(text, "f").points == points);
    for (const char* text :
         {"0,0,0,4\n1,2,3,5", "X Y Z MaximumInscribedSphereRadius\n0 0 0 4\n1 2 3 5",
          "\"Radius\",\"Points:0\",\"Points:1\",\"Points:2\"\n4,0,0,0\n5,1,2,3",
          "r,x,y,z\n4,0,0,0\n5,1,2,3"}) {
        const Polyline line = parse_centreline_csv(text, "f", 2);
        CHECK(line.points == std::vector<Vec3>{{0, 0, 0}, {2, 4, 6}});
        CHECK(line.radius == std::vector<double>{8, 10});
    }
}

TEST_CASE("a damaged CSV has all its lines named")
{
    CHECK(refused_csv("# c\n0,0,0,1\n1,a,0,1\n2,0,0\n3,0,0,-1\n4,inf,0,1\n5,0,0,nan\n6,,0,1\n") ==
          "f: line 3: found \"a\", allowed: a number, with a decimal point\n"
          "f: line 4: found 3 columns, allowed: 4, as in the first row\n"
          "f: line 5: found radius -1, allowed: > 0 and finite\n"
          "f: line 6: found coordinates 4 inf 0, allowed: finite numbers\n"
          "f: line 7: found radius nan, allowed: > 0 and finite\n"
          "f: line 8: found \"\", allowed: a number, with a decimal point");
    CHECK(refused_csv("") == "f: found a centreline of 0 different points, allowed: at least 2");
    CHECK(refused_csv("1,2,3\n1,2,3\n").find("1 different points") != std::string::npos);
    CHECK(refused_csv("1,2\n3,4\n").find("line 1: found 2 numbers") != std::string::npos);
    CHECK(refused_csv("1,2,3,4,5\n").find("line 1: found 5 numbers") != std::string::npos);
    CHECK(refused_csv("s,x,y\n1,2,3\n") ==
          "f: line 1: found a header \"s,x,y\", allowed: columns x, y, z and, if known, radius");
    CHECK(refused_csv("1,5;2,5;3,5\n2;3;4").find("a header") !=
          std::string::npos); // decimal commas
    CHECK(refused_csv("0;0;0\n1,5;2,5;3,5").find("found \"1,5\"") != std::string::npos);
}

TEST_CASE("size fields keep every place and a centreline takes no size for its radius")
{
    const auto read = [](const char* text) { return parse_size_field_csv(text, "f", 2); };
    const auto one = read("x,y,z,size\n1,2,3,0.5\n");
    REQUIRE(one.size() == 1);
    CHECK(one[0].at == Vec3(2, 4, 6));
    CHECK(one[0].size == 1);
    // The finer of two at one place, whichever comes first; size before radius.
    for (const char* text : {"0,0,0,0.2\n0,0,0,0.02\n", "x y z size\n0 0 0 0.02\n0 0 0 0.2\n",
                             "radius,size,x,y,z\n7,0.2,0,0,0\n7,0.02,0,0,0\n",
                             "size,radius,x,y,z\n0.2,7,0,0,0\n0.02,7,0,0,0\n"}) {
        const auto both = read(text);
        REQUIRE(both.size() == 2);
        CHECK(std::min(both[0].size, both[1].size) == doctest::Approx(0.04));
        CHECK(std::max(both[0].size, both[1].size) == doctest::Approx(0.4));
    }
    CHECK(read("x,y,z,radius\n0,0,0,3\n")[0].size == 6);
    CHECK(parse_centreline_csv("x,y,z,size\n0,0,0,1\n1,0,0,1\n", "f").radius.empty());
    CHECK(parse_centreline_csv("x,y,z,radius,size\n0,0,0,3,9\n1,0,0,3,9\n", "f").radius ==
          std::vector<double>{3, 3});
    const auto refused = [&](const char* text) { return refusal([&] { read(text); }); };
    CHECK(refused("x,y,z,size\n0,0,0,0\n0,0,0,nan\n0,0,inf,1\n") ==
          "f: line 2: found size 0, allowed: > 0 and finite\n"
          "f: line 3: found size nan, allowed: > 0 and finite\n"
          "f: line 4: found coordinates 0 0 inf times 2, allowed: finite numbers");
    CHECK(refused("") == "f: found no places, allowed: rows of x, y, z, size");
    CHECK(refused("x,y,z\n0,0,0\n").find("line 2: found a place without a size") !=
          std::string::npos);
    CHECK(refusal([] { read_size_field("a.stl", 1); }).find(".mrk.json") != std::string::npos);
}

TEST_CASE("Slicer's markups: placed points and radii and mm")
{
    const Polyline line = parse_slicer_markups(kMarkups, "f", 1);
    CHECK(line.points == std::vector<Vec3>{{-10.5, 20.25, 30}, {-11, 21, 32}});
    CHECK(line.radius == std::vector<double>{12.5, 13});
    const Polyline metres = parse_slicer_markups(kMarkups, "f");
    CHECK((metres.points[0] - Vec3(-0.0105, 0.02025, 0.03)).norm() < 1e-15);
    CHECK(metres.radius[1] == doctest::Approx(0.013));
    CHECK(default_scale("a/B.MRK.JSON") == 1e-3);
    CHECK(default_scale("a.csv") == 1);
}

TEST_CASE("RAS markups are turned to LPS and radii may be missing")
{
    const Polyline ras = parse_slicer_markups(markups_with("LPS", "RAS"), "f", 1);
    CHECK(ras.points == std::vector<Vec3>{{10.5, -20.25, 30}, {11, -21, 32}});
    CHECK(parse_slicer_markups(markups_with("\"Radius\"", "\"Other\""), "f").radius.empty());
    CHECK(parse_slicer_markups(markups_with("\"measurements\"", "\"others\""), "f").radius.empty());
}

TEST_CASE("damaged markups state where and what")
{
    CHECK(refused_markups("{\n  \"markups\": [,]\n}")
              .find("f: line 2, column 15: found broken JSON") == 0);
    CHECK(refused_markups("").find("line 1, column 1") != std::string::npos);
    CHECK(refused_markups("[1e999]").find("numbers that a double can hold") != std::string::npos);
    CHECK(refused_markups("[]") == "f: found \"[]\", allowed: an object {...}");
    CHECK(refused_markups("{}") == "f: /markups: found nothing, allowed: an array [...]");
    CHECK(markups_with("\"Curve\"", "\"Line\"").size() > 0);
    CHECK(refused_markups(markups_with("\"Curve\"", "\"Line\"")) ==
          "f: /markups: found \"Fiducial\", \"Line\", allowed: a markup of type \"Curve\"");
    CHECK(refused_markups(markups_with("\"Fiducial\"", "\"Curve\"")).find("a second curve") !=
          std::string::npos);
    CHECK(refused_markups(markups_with("\"LPS\"", "\"XYZ\"")) ==
          "f: /markups/1/coordinateSystem: found \"XYZ\", allowed: LPS or RAS");
    CHECK(refused_markups(markups_with("\"LPS\"", "3")).find("allowed: a string") !=
          std::string::npos);
    CHECK(refused_markups(markups_with("\"mm\"", "\"m\"")) ==
          "f: /markups/1/coordinateUnits: found \"m\", allowed: mm");
    CHECK(refused_markups(markups_with("-10.5, 20.25, 30.0", "1, 2")) ==
          "f: /markups/1/controlPoints/0/position: found \"[1,2]\", allowed: 3 numbers [x, y, z]");
    CHECK(refused_markups(markups_with("20.25", "\"a\"")).find("3 numbers") != std::string::npos);
    CHECK(refused_markups(markups_with("[-11, 21, 32]", "null")).find("found \"null\"") !=
          std::string::npos);
    CHECK(refused_markups(markups_with("[12.5, 99, 13]", "[12.5, 13]")) ==
          "f: /markups/1/measurements/1/controlPointValues: found 2 radii, allowed: 3, one for "
          "each control point");
    CHECK(refused_markups(markups_with("[12.5, 99, 13]", "[12.5, 99, null]"))
              .find("radius \"null\"") != std::string::npos);
    CHECK(refused_markups(markups_with("[12.5, 99, 13]", "[0, 99, -1]")) ==
          "f: /markups/1/controlPoints/0: found radius 0, allowed: > 0 and finite\n"
          "f: /markups/1/controlPoints/2: found radius -1, allowed: > 0 and finite");
    for (std::size_t n = 0; n < kMarkups.size(); n += 5) // cut anywhere
        CHECK(refused_markups(kMarkups.substr(0, n)) != "");
}

TEST_CASE("a patient's centrelines lie within the patient's vessels")
{
    const auto folder = vessel_data() / "centrelines";
    if (!std::filesystem::exists(folder)) {
        skip_test("no file ../shared/data/vessels/centrelines");
        return;
    }
    const auto surface = vessel_data() / "aorta_supra_aortic.obj";
    const SurfaceMesh wall = read_surface(surface.string(), 1e-3);
    // Solid angle of the wall / 4 pi: -1 inside, since normals point inwards; 0 outside.
    const auto winding = [&](const Vec3& at) {
        double angle = 0; // of each triangle: Van Oosterom & Strackee 1983
        for (const auto& [i, j, k] : wall.triangles) {
            const auto to = [&](std::int32_t v) -> Vec3 {
                return wall.points[static_cast<std::size_t>(v)] - at;
            };
            const Vec3 a = to(i), b = to(j), c = to(k);
            const double na = a.norm(), nb = b.norm(), nc = c.norm();
            angle += 2 * std::atan2(a.dot(b.cross(c)),
                                    na * nb * nc + a.dot(b) * nc + b.dot(c) * na + c.dot(a) * nb);
        }
        return angle / (4 * 3.14159265358979323846);
    };
    int lines = 0;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        ++lines;
        const std::string file = entry.path().string();
        CAPTURE(file);
        const Polyline line = read_centreline(file, default_scale(file));
        REQUIRE(!line.points.empty());
        REQUIRE(line.radius.size() == line.points.size());
        int inside = 0, inside_if_ras = 0;
        for (const Vec3& x : line.points) {
            inside += std::abs(winding(x) + 1) < 1e-6;
            inside_if_ras += std::abs(winding(Vec3(-x[0], -x[1], x[2])) + 1) < 1e-6;
        }
        CHECK(inside > 0.95 * static_cast<double>(line.points.size()));
        CHECK(inside_if_ras == 0);
    }
    CHECK(lines > 0);
}
