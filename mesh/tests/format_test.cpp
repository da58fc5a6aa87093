#include "mesh/format/obj.hpp"
#include "mesh/format/ply.hpp"
#include "mesh/format/stl.hpp"

#include "mesh/format/byte_order.hpp"
#include "mesh/orient_surface.hpp"
#include "mesh/tests/sample_surfaces.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstring>
#include <doctest/doctest.h>
#include <random>

using namespace amontons;

namespace {

std::string refused_stl(const std::string& bytes)
{
    return refusal([&] { parse_stl(bytes, "f"); });
}

std::string refused_obj(const std::string& text)
{
    return refusal([&] { parse_obj(text, "f"); });
}

std::string refused_ply(const std::string& bytes)
{
    return refusal([&] { parse_ply(bytes, "f"); });
}

void check_same_surface(const SurfaceMesh& a, const SurfaceMesh& b)
{
    CHECK(a.points == b.points);
    CHECK(a.triangles == b.triangles);
}

SurfaceMesh random_surface()
{
    std::mt19937 rng{7};
    std::normal_distribution<double> normal;
    SurfaceMesh mesh;
    for (int i = 0; i < 300; ++i)
        mesh.points.emplace_back(normal(rng), 1e-9 * normal(rng), 1e9 * normal(rng));
    for (int i = 0; i + 2 < 300; ++i)
        mesh.triangles.push_back({i, i + 1, i + 2});
    return mesh;
}

constexpr const char* kPlyHeader = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
                                   "property float y\nproperty float z\nelement face 1\n"
                                   "property list uchar int vertex_indices\nend_header\n";
constexpr const char* kPlyVertices = "0 0 0\n1 0 0\n0 1 0\n";

} // namespace

TEST_CASE("a cube is the same mesh in every format")
{
    const SurfaceMesh cube = unit_cube();
    check_same_surface(parse_stl(stl_bytes(cube), "f"), cube);
    check_same_surface(parse_stl(stl_text(cube), "f"), cube);
    check_same_surface(parse_obj(obj_text(cube), "f"), cube);
    for (const auto e : {PlyEncoding::ascii, PlyEncoding::little_endian, PlyEncoding::big_endian})
        check_same_surface(parse_ply(ply_bytes(cube, e), "f"), cube);
}

TEST_CASE("what is written reads back bit by bit")
{
    const SurfaceMesh mesh = random_surface();
    check_same_surface(parse_stl(stl_text(mesh), "f"), mesh);
    check_same_surface(parse_obj(obj_text(mesh), "f"), mesh);
    for (const auto e : {PlyEncoding::ascii, PlyEncoding::little_endian, PlyEncoding::big_endian})
        check_same_surface(parse_ply(ply_bytes(mesh, e), "f"), mesh);
    const SurfaceMesh rounded = parse_stl(stl_bytes(mesh), "f"); // floats
    REQUIRE(rounded.points.size() == mesh.points.size());
    for (std::size_t i = 0; i < mesh.points.size(); ++i)
        CHECK((rounded.points[i] - mesh.points[i]).norm() <= 6e-8 * mesh.points[i].norm());
}

TEST_CASE("a scale multiplies every coordinate")
{
    const SurfaceMesh cube = unit_cube(), small = moved(cube, 1e-3, Vec3::Zero());
    check_same_surface(parse_stl(stl_bytes(cube), "f", 1e-3), small);
    check_same_surface(parse_stl(stl_text(cube), "f", 1e-3), small);
    check_same_surface(parse_obj(obj_text(cube), "f", 1e-3), small);
    check_same_surface(parse_ply(ply_bytes(cube), "f", 1e-3), small);
    CHECK(refusal([&] { parse_obj("v 1e300 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3", "f", 1e10); }) ==
          "f: line 1: found coordinates 1e+300 0 0 times 1e+10, allowed: finite numbers");
}

TEST_CASE("binary and ASCII STL are distinguished by size and not by their first word")
{
    std::string bytes = stl_bytes(unit_cube());
    bytes.replace(0, 5, "solid");
    check_same_surface(parse_stl(bytes, "f"), unit_cube());
    check_same_surface(parse_stl("\xef\xbb\xbf" + stl_text(unit_cube()), "f"), unit_cube());
}

TEST_CASE("ASCII STL: several solids with any case and line ends and normals of any kind")
{
    const std::string triangle = "FACET NORMAL nan nan nan\r\nOuter Loop\r\nvertex 0 0 0\r\n"
                                 "vertex +1 0 0\r\nvertex 0 1e0 0\r\nendloop\r\nendfacet\r\n";
    const SurfaceMesh mesh = parse_stl("solid a name of facets\r\n" + triangle + "endsolid a\r\n" +
                                           "solid\r\n" + triangle + "endsolid\r\n",
                                       "f");
    CHECK(mesh.points.size() == 3);
    CHECK(mesh.triangles.size() == 2);
}

TEST_CASE("a damaged STL states where and what")
{
    const std::string cube = stl_bytes(unit_cube());
    CHECK(refused_stl(cube.substr(0, 300)) ==
          "f: byte 80: found 12 triangles in the header, in a file of 300 bytes, allowed: a file "
          "of 684 bytes, or ASCII that begins with \"solid\"");
    CHECK(refused_stl(cube + "x").find("684 bytes") != std::string::npos);
    std::string named_solid = cube; // binary all the same, as some programs write it
    named_solid.replace(0, 8, "solid x ");
    check_same_surface(parse_stl(named_solid, "f"), unit_cube());
    CHECK(refused_stl(named_solid.substr(0, 300)).find("12 triangles in the header") !=
          std::string::npos);
    CHECK(refused_stl("abc").find("found 3 bytes") != std::string::npos);
    CHECK(refused_stl("").find("found 0 bytes") != std::string::npos);
    std::string hostile = cube;
    std::memcpy(&hostile[80], "\xff\xff\xff\xff", 4); // 4 294 967 295 triangles: 215 GB
    CHECK(refused_stl(hostile).find("214748364834 bytes") != std::string::npos);
    std::string not_finite = cube;
    const float nan = std::nanf("");
    std::memcpy(&not_finite[84 + 50 * 3 + 12 + 4], &nan, 4);
    CHECK(refused_stl(not_finite) ==
          "f: triangle 3 (byte 246): found coordinates 0 nan 1, allowed: finite numbers");
    CHECK(refused_stl("solid a\nendsolid a\n").find("without triangles") != std::string::npos);
    CHECK(refused_stl(std::string(84, '\0')).find("without triangles") != std::string::npos);

    const std::string text = stl_text(unit_cube());
    const auto with = [&](const char* what, const char* by) {
        std::string t = text;
        t.replace(t.find(what), std::strlen(what), by);
        return refused_stl(t);
    };
    CHECK(with("vertex 0 0 0", "vertex 0 0") == "f: line 5: found \"vertex\", allowed: a number");
    CHECK(with("vertex 0 0 0", "vertex 0,0 0 0").find("line 4: found \"0,0\"") !=
          std::string::npos);
    CHECK(with("vertex 0 0 0", "vertex 0 inf 0") ==
          "f: line 4: found coordinates 0 inf 0, allowed: finite numbers");
    CHECK(with("endloop", "vertex 1 1 1") == "f: line 7: found \"vertex\", allowed: \"endloop\"");
    CHECK(with("facet", "face") ==
          "f: line 2: found \"face\", allowed: \"facet\", \"solid\" or \"endsolid\"");
    CHECK(refused_stl(text.substr(0, text.find("loop"))).find("the end of the file") !=
          std::string::npos);
}

TEST_CASE("OBJ: all ways to name a vertex")
{
    const SurfaceMesh mesh = parse_obj("mtllib a.mtl\n"
                                       "v 0 0 0 1.0\n"
                                       "\tv 1 0 0 0.2 0.3 0.4 # with a colour\r\n"
                                       "v 0 1 \\\n 0\n"
                                       "vn 0 0 1\nvt 0 0\ng a\nusemtl b\ns off\n"
                                       "f 1 2 3\nf 1/1 2/1 3/1\nf 1//1 2//1 3//1\n"
                                       "f 1/1/1 2/1/1 3/1/1\nf -3 -2 -1 #end\n"
                                       "v 9 9 9",
                                       "f");
    CHECK(mesh.points.size() == 4);
    CHECK(mesh.points[2] == Vec3(0, 1, 0));
    REQUIRE(mesh.triangles.size() == 5);
    for (const auto& triangle : mesh.triangles)
        CHECK(triangle == std::array<std::int32_t, 3>{0, 1, 2});
}

TEST_CASE("a damaged OBJ has all its lines named")
{
    CHECK(refused_obj("v 0 0 0\nv 1 a 0\nv 0 1\nv 0 nan 0\nf 1 2 9\nf 1 2\nf 1 0 2\nf 1 2.5 3\n"
                      "f -9 1 2\n") ==
          "f: line 2: found \"a\", allowed: a vertex of 3 numbers\n"
          "f: line 3: found the end of the line, allowed: a vertex of 3 numbers\n"
          "f: line 4: found coordinates 0 nan 0, allowed: finite numbers\n"
          "f: line 7: found \"0\", allowed: the number of a vertex, from 1\n"
          "f: line 8: found \"2.5\", allowed: the number of a vertex, from 1\n"
          "f: line 5: found vertex 9, allowed: 1 to 4\n"
          "f: line 6: found a face with 2 corners, allowed: 3 to 1024 corners\n"
          "f: line 9: found vertex -4, allowed: 1 to 4\n"
          "f: found a surface without triangles (4 vertices), allowed: at least one face");
    CHECK(refused_obj("").find("without triangles") != std::string::npos);
    CHECK(refused_obj("f 1 2 3").find("found vertex 1") != std::string::npos);
    CHECK(refused_obj("v 0 0 0\nf 1 1 99999999999999999999").find("line 2") != std::string::npos);
    std::string many;
    for (int i = 0; i < 1000; ++i)
        many += "v x\n";
    const std::string text = refused_obj(many);
    CHECK(std::count(text.begin(), text.end(), '\n') == 20);
    CHECK(text.find("more of this") != std::string::npos);
}

TEST_CASE("a polygon becomes triangles that cover it once")
{
    // A regular 12-gon, an L, a star with 5 dents, a spiral; all in a skew plane.
    const Vec3 e1 = Vec3(1, 2, -1).normalized(), e2 = e1.cross(Vec3(0.3, 0.1, 1)).normalized();
    std::vector<std::vector<std::array<double, 2>>> polygons(3);
    for (int i = 0; i < 12; ++i)
        polygons[0].push_back({std::cos(i * 3.14159 / 6), std::sin(i * 3.14159 / 6)});
    polygons[1] = {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 3}, {0, 3}};
    for (int i = 0; i < 10; ++i) {
        const double r = i % 2 ? 0.3 : 1, angle = i * 3.14159 / 5;
        polygons[2].push_back({r * std::cos(angle), r * std::sin(angle)});
    }
    polygons.push_back(
        {{0, 0}, {4, 0}, {4, 4}, {1, 4}, {1, 2}, {2, 2}, {2, 3}, {3, 3}, {3, 1}, {0, 1}});
    polygons.push_back({{0, 0}, {2, 0}, {0.5, 0.5}, {0, 2}}); // a quadrilateral with a dent
    polygons.push_back({{0.5, 0.5}, {0, 2}, {0, 0}, {2, 0}});
    for (const auto& polygon : polygons) {
        std::string text, face = "f";
        double area = 0;
        for (std::size_t i = 0; i < polygon.size(); ++i) {
            const auto& [x, y] = polygon[i];
            const auto& [u, v] = polygon[(i + 1) % polygon.size()];
            area += (x * v - y * u) / 2;
            const Vec3 p = 100 * e1 + x * e1 + y * e2;
            text.append("v");
            for (int k = 0; k < 3; ++k)
                text.append(" ").append(std::to_string(p[k]));
            text.append("\n");
            face.append(" ").append(std::to_string(i + 1));
        }
        const SurfaceMesh mesh = parse_obj(text + face, "f");
        CHECK(mesh.triangles.size() == polygon.size() - 2);
        const Vec3 normal = e1.cross(e2);
        double sum = 0;
        for (const auto& [a, b, c] : mesh.triangles) {
            const auto x = [&](int i) { return mesh.points[static_cast<std::size_t>(i)]; };
            const double part = (x(b) - x(a)).cross(x(c) - x(a)).dot(normal) / 2;
            CHECK(part > 0); // none lies upside down, so that none covers another
            sum += part;
        }
        CHECK(sum == doctest::Approx(area).epsilon(1e-4));
    }
}

TEST_CASE("a quadrilateral is cut along its shorter diagonal")
{
    const std::string vertices = "v 0 0 0\nv 2 0 0\nv 3 1 0\nv 1 1 0\n";
    for (const char* face : {"f 1 2 3 4", "f 2 3 4 1", "f 3 4 1 2"}) {
        const SurfaceMesh mesh = parse_obj(vertices + face, "f");
        REQUIRE(mesh.triangles.size() == 2);
        std::ptrdiff_t on_both = 0; // the diagonal 2-4 is in both triangles
        for (const auto& t : mesh.triangles)
            on_both += std::count(t.begin(), t.end(), 1) + std::count(t.begin(), t.end(), 3);
        CHECK(on_both == 4);
    }
}

TEST_CASE("a polygon without area or with too many corners does no harm")
{
    const SurfaceMesh flat = parse_obj("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nv 4 0 0\n"
                                       "f 1 2 3 4 5\nf 1 1 1 1 1 1\nf 1 2 1 2\n",
                                       "f");
    CHECK(flat.triangles.size() == 3 + 4 + 2);
    std::string text = "v 0 0 0\nf";
    for (int i = 0; i < 1025; ++i)
        text += " 1";
    CHECK(refused_obj(text).find("1025 corners") != std::string::npos);
}

TEST_CASE("PLY: other elements and properties are passed over")
{
    const std::string header =
        "ply\r\nformat %s 1.0\r\ncomment by hand\r\nobj_info x\r\nelement material 2\r\n"
        "property list uint8 float32 colours\r\nelement vertex 4\r\nproperty uchar red\r\n"
        "property double z\r\nproperty float y\r\nproperty list uchar short tags\r\n"
        "property float x\r\nelement nothing 4000000000\r\nelement face 1\r\n"
        "property float quality\r\nproperty list int16 uint32 vertex_index\r\n"
        "property list uchar float texcoord\r\nend_header\r\n";
    const auto with_format = [&](const char* format) {
        std::string h = header;
        return h.replace(h.find("%s"), 2, format);
    };
    const SurfaceMesh ascii =
        parse_ply(with_format("ascii") + "2 0.5 0.5\n0\n255 0 0 1 7 0\n255 0 0 0 1\n"
                                         "255 0 1 2 7 7 1\n255 0 1 0 0\n0.5 4 0 1 2 3 1 0.25",
                  "f");
    CHECK(ascii.points == std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
    CHECK(ascii.triangles.size() == 2);
    for (const bool big : {false, true}) {
        std::string b = with_format(big ? "binary_big_endian" : "binary_little_endian");
        append_bytes(b, std::uint8_t{1}, big);
        append_bytes(b, 0.5F, big);
        append_bytes(b, std::uint8_t{0}, big);
        for (const auto& [x, y] : {std::array{0.F, 0.F}, {1.F, 0.F}, {1.F, 1.F}, {0.F, 1.F}}) {
            append_bytes(b, std::uint8_t{255}, big);
            append_bytes(b, 0.0, big);
            append_bytes(b, y, big);
            append_bytes(b, std::uint8_t{1}, big);
            append_bytes(b, std::int16_t{-7}, big);
            append_bytes(b, x, big);
        }
        append_bytes(b, 0.5F, big);
        append_bytes(b, std::int16_t{4}, big);
        for (const std::uint32_t corner : {0U, 1U, 2U, 3U})
            append_bytes(b, corner, big);
        append_bytes(b, std::uint8_t{0}, big);
        check_same_surface(parse_ply(b, "f"), ascii);
    }
}

TEST_CASE("a damaged PLY states where and what")
{
    const std::string head = kPlyHeader, good = head + kPlyVertices + "3 0 1 2\n";
    CHECK(parse_ply(good, "f").triangles.size() == 1);
    const auto with = [&](const char* what, const char* by) {
        std::string t = good;
        t.replace(t.find(what), std::strlen(what), by);
        return refused_ply(t);
    };
    CHECK(refused_ply("") == "f: line 1: found \"\", allowed: \"ply\"");
    CHECK(refused_ply("solid").find("found \"solid\"") != std::string::npos);
    CHECK(refused_ply("ply\nformat ascii 1.0\n").find("\"end_header\"") != std::string::npos);
    CHECK(with("ascii", "text") == "f: line 2: found format \"text\", allowed: ascii, "
                                   "binary_little_endian or binary_big_endian");
    CHECK(with("float x", "real x").find("line 4: found type \"real\"") != std::string::npos);
    CHECK(with("float x", "float").find("a property without name") != std::string::npos);
    CHECK(with("float x", "float u").find("without x, y and z") != std::string::npos);
    CHECK(with("list uchar", "list float").find("no whole number") != std::string::npos);
    CHECK(with("element vertex 3", "elements vertex 3").find("found \"elements\"") !=
          std::string::npos);
    CHECK(with("element vertex 3", "element vertex -3").find("count \"-3\"") != std::string::npos);
    CHECK(with("format ascii 1.0", "comment").find("without format") != std::string::npos);
    CHECK(with("vertex_indices", "other").find("no faces") != std::string::npos);
    CHECK(with("element vertex", "element point").find("no vertices") != std::string::npos);
    CHECK(refused_ply("ply\nformat ascii 1.0\nproperty float x\nend_header\n")
              .find("a property of no element") != std::string::npos);
    CHECK(with("0 1 0\n", "0 one 0\n") == "f: line 12: found \"one\", allowed: a number");
    CHECK(with("0 1 0\n", "0 nan 0\n") ==
          "f: vertex 2: found coordinates 0 nan 0, allowed: finite numbers");
    CHECK(with("3 0 1 2", "3 0 1 3") == "f: face 0: found vertex 3, allowed: 0 to 2\n"
                                        "f: found a surface without triangles (3 vertices), "
                                        "allowed: at least one face");
    CHECK(with("3 0 1 2", "3 0 1 1.5").find("vertex 1.5") != std::string::npos);
    CHECK(with("3 0 1 2", "3 0 1 -1").find("vertex -1") != std::string::npos);
    CHECK(with("3 0 1 2", "2 0 1").find("2 corners") != std::string::npos);
    CHECK(with("3 0 1 2", "-3 0 1 2").find("list of length -3") != std::string::npos);
    CHECK(with("3 0 1 2", "3 0 1").find("the end of the file") != std::string::npos);
    CHECK(with("3 0 1 2", "3 0 1 2 5") ==
          "f: line 13: found \"5\" after the last element, allowed: the end of the file");
    CHECK(with("element face 1", "element face 0").find("after the last") != std::string::npos);
}

TEST_CASE("sizes that a file cannot hold are refused before memory is allocated")
{
    const std::string head = kPlyHeader;
    const auto with = [](std::string text, const char* what, const char* by) {
        return refused_ply(text.replace(text.find(what), std::strlen(what), by));
    };
    CHECK(with(head + kPlyVertices, "vertex 3", "vertex 4000000000000000000")
              .find("which the file can hold") != std::string::npos);
    CHECK(with(head + kPlyVertices, "face 1", "face 9000000000000000000")
              .find("which the file can hold") != std::string::npos);
    CHECK(with(head + kPlyVertices, "vertex 3", "vertex 99999999999999999999").find("count") !=
          std::string::npos);
    const auto binary = [&](const char* type) {
        std::string h = head;
        h.replace(h.find("ascii"), 5, "binary_little_endian");
        h.replace(h.find("uchar"), 5, type);
        return h + std::string(36, '\0');
    };
    std::string list = binary("uint");
    append_bytes(list, 0xffffffffU, false);
    CHECK(refused_ply(list).find("a list of length 4294967295") != std::string::npos);
    CHECK(with(binary("uchar"), "vertex 3", "vertex 4").find("at most 3") != std::string::npos);
}

TEST_CASE("files cut at any byte are refused or read but never more than that")
{
    const SurfaceMesh cube = unit_cube();
    for (const std::string& whole :
         {stl_bytes(cube), stl_text(cube), obj_text(cube), ply_bytes(cube),
          ply_bytes(cube, PlyEncoding::ascii), ply_bytes(cube, PlyEncoding::big_endian)}) {
        for (std::size_t n = 0; n < whole.size(); n += 3) {
            const std::string cut = whole.substr(0, n);
            refused_stl(cut);
            refused_obj(cut);
            refused_ply(cut);
        }
    }
}

TEST_CASE("100 000 triangles are read whole")
{
    const SurfaceMesh tube = open_tube(100, 500, 10);
    const std::string stl = stl_text(tube), obj = obj_text(tube), ply = ply_bytes(tube);
    for (const SurfaceMesh& read :
         {parse_stl(stl, "f"), parse_obj(obj, "f"), parse_ply(ply, "f")}) {
        CHECK(read.points.size() == tube.points.size());
        CHECK(read.triangles.size() == tube.triangles.size());
    }
}
