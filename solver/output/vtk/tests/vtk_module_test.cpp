#include "mesh/tests/test_program.hpp"
#include "solver/output/vtk/vtk_module.hpp"

#include <doctest/doctest.h>

#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <dlfcn.h>
#include <filesystem>
#include <fstream>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

namespace {

namespace fs = std::filesystem;

/// The module's entry points, opened as the program opens them.
struct Module {
    void* library = dlopen(AMONTONS_VTK_MODULE, RTLD_NOW | RTLD_LOCAL);
    template <typename F> F* function(const char* name) const
    {
        REQUIRE_MESSAGE(library, dlerror());
        void* address = dlsym(library, name);
        REQUIRE(address);
        return reinterpret_cast<F*>(address);
    }
    std::string render(const fs::path& folder, const fs::path& png) const
    {
        char message[500] = "";
        const int failed = function<decltype(amontons_vtk_render)>("amontons_vtk_render")(
            folder.c_str(), png.c_str(), message, sizeof message);
        CHECK((failed != 0) == (message[0] != 0));
        return message;
    }
};

const Module& module()
{
    static const Module opened; // VTK cannot be unloaded and loaded again
    return opened;
}

/// The test is skipped where there is nothing to draw on.
bool no_screen()
{
    if (std::getenv("DISPLAY") || std::system("command -v Xvfb >/dev/null 2>&1") == 0) return false;
    amontons::skip_test("no screen to draw on: neither DISPLAY nor Xvfb (xvfb)");
    return true;
}

/// A folder of its own, removed at the end.
struct Folder {
    fs::path path = fs::temp_directory_path() / ("amontons_vtk_test_" + std::to_string(getpid()));
    Folder() { fs::create_directories(path); }
    ~Folder() { fs::remove_all(path); }
    fs::path write(const std::string& name, const std::string& text) const
    {
        std::ofstream(path / name) << text;
        return path / name;
    }
};

std::string array(const std::string& name, const std::string& values, int components = 1)
{
    return R"(<DataArray type="Float64" format="ascii" Name=")" + name +
           R"(" NumberOfComponents=")" + std::to_string(components) + "\">" + values +
           "</DataArray>";
}

std::string cells(const std::string& kind, const std::string& connectivity,
                  const std::string& offsets)
{
    const std::string head = R"(<DataArray type="Int64" format="ascii" Name=")";
    return "<" + kind + ">" + head + "connectivity\">" + connectivity + "</DataArray>" + head +
           "offsets\">" + offsets + "</DataArray></" + kind + ">";
}

/// @param kind  "Lines" (all points one polyline), "Verts" (a cell for each), or "Polys" with
///              connectivity and offsets
std::string vtp(const std::vector<std::array<double, 3>>& points, const std::string& kind,
                const std::string& fields, std::string connectivity = "", std::string offsets = "")
{
    std::string coordinates;
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (const double x : points[i])
            coordinates += std::to_string(x) + " ";
        if (kind != "Polys") connectivity += std::to_string(i) + " ";
        if (kind == "Verts") offsets += std::to_string(i + 1) + " ";
    }
    if (kind == "Lines") offsets = std::to_string(points.size());
    long count = 0;
    for (std::size_t i = 0; i < offsets.size(); ++i)
        count += offsets[i] != ' ' && (i == 0 || offsets[i - 1] == ' ');
    return R"(<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian"><PolyData><Piece )"
           "NumberOfPoints=\"" +
           std::to_string(points.size()) + "\" NumberOf" + kind + "=\"" + std::to_string(count) +
           "\"><PointData>" + fields + "</PointData><Points>" + array("Points", coordinates, 3) +
           "</Points>" + cells(kind, connectivity, offsets) + "</Piece></PolyData></VTKFile>";
}

std::string repeated(double value, std::size_t times)
{
    std::string text;
    for (std::size_t i = 0; i < times; ++i)
        text += std::to_string(value) + " ";
    return text;
}

/// A straight wire below a plate that it touches in one point; lengths times `unit`.
void write_run(const Folder& folder, bool with_contact, double unit = 1, bool in_both = false)
{
    const double a = unit;
    folder.write("plate.vtp", vtp({{-a, -0.1 * a, 0.5 * a},
                                   {a, -0.1 * a, 0.5 * a},
                                   {a, 0.1 * a, 0.6 * a},
                                   {-a, 0.1 * a, 0.6 * a}},
                                  "Polys", "", "0 1 2 3", "4"));
    std::string wires, contacts;
    for (int frame = 0; frame <= 4; ++frame) {
        std::vector<std::array<double, 3>> line;
        for (int i = 0; i <= 10; ++i)
            line.push_back({-a + 0.05 * a * i * frame, 0, 0.04 * a * i});
        const std::string n = std::to_string(frame);
        folder.write("wire" + n + ".vtp", vtp(line, "Lines",
                                              array("radius", repeated(0.01 * a, 11)) +
                                                  array("curvature", repeated(1 / a, 11))));
        folder.write(
            "contact" + n + ".vtp",
            vtp({line.back()}, "Verts", array("force", with_contact ? "0 0 -0.3" : "0 0 0", 3)));
        wires += "<DataSet timestep=\"" + n + "\" file=\"wire" + n + ".vtp\"/>";
        contacts += "<DataSet timestep=\"" + n + "\" file=\"contact" + n + ".vtp\"/>";
    }
    const std::string head = R"(<VTKFile type="Collection" version="0.1"><Collection>)";
    folder.write("run.pvd", head + wires + (in_both ? contacts : "") + "</Collection></VTKFile>");
    folder.write("contacts.pvd", head + contacts + "</Collection></VTKFile>");
}

/// One H8 cube of side 1 on a plane, its stress the same everywhere, and a rigid tetrahedron
/// beside it that has moved by `way` at the end.
/// @param plane  half the length of the plane's sides in the file
void write_bodies(const Folder& folder, double stress, double plane, double way, double unit = 1)
{
    const double a = unit, p = plane * unit;
    folder.write("ground.vtp", vtp({{-p, -p, 0}, {p, -p, 0}, {p, p, 0}, {-p, p, 0}}, "Polys",
                                   array("max_contact_force", "0 0 0 0"), "0 1 2 3", "4"));
    std::string cube;
    for (const double z : {0.0, a})
        for (const auto& [x, y] :
             {std::array{0.0, 0.0}, std::array{a, 0.0}, std::array{a, a}, std::array{0.0, a}})
            cube += std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z) + " ";
    folder.write("cube.vtu",
                 R"(<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian">)"
                 R"(<UnstructuredGrid><Piece NumberOfPoints="8" NumberOfCells="1"><PointData>)" +
                     array("von_mises_averaged", repeated(stress, 8)) + "</PointData><Points>" +
                     array("Points", cube, 3) + "</Points><Cells>" +
                     R"(<DataArray type="Int64" format="ascii" Name="connectivity">)"
                     "0 1 2 3 4 5 6 7</DataArray>"
                     R"(<DataArray type="Int64" format="ascii" Name="offsets">8</DataArray>)"
                     R"(<DataArray type="UInt8" format="ascii" Name="types">12</DataArray>)"
                     "</Cells></Piece></UnstructuredGrid></VTKFile>");
    std::string frames;
    for (int frame = 0; frame <= 4; ++frame) {
        const double x = (1.2 + 0.25 * way * frame) * a;
        const std::string n = std::to_string(frame);
        folder.write("rigid" + n + ".vtp",
                     vtp({{x, 0, 0}, {x + 0.7 * a, 0, 0}, {x, 0.7 * a, 0}, {x, 0, 0.7 * a}},
                         "Polys", array("velocity", repeated(0, 12), 3), "0 2 1 0 1 3 0 3 2 1 2 3",
                         "3 6 9 12"));
        for (const std::string& file :
             {"rigid" + n + ".vtp", std::string("cube.vtu"), std::string("ground.vtp")})
            frames += "<DataSet timestep=\"" + n + "\" file=\"" + file + "\"/>";
    }
    folder.write("run.pvd", R"(<VTKFile type="Collection" version="0.1"><Collection>)" + frames +
                                "</Collection></VTKFile>");
}

/// Pixels by kind in the upper `part` of a picture, where no legend and no bar of length is.
struct Colours {
    long white = 0, blue = 0, red = 0, other = 0;
    bool operator==(const Colours&) const = default;
};

Colours colours_of(const fs::path& png, double part)
{
    vtkNew<vtkPNGReader> reader;
    reader->SetFileName(png.c_str());
    reader->Update();
    vtkImageData* image = reader->GetOutput();
    const int* size = image->GetDimensions();
    REQUIRE(size[0] == 2400);
    Colours count;
    for (int y = static_cast<int>((1 - part) * size[1]); y < size[1]; ++y)
        for (int x = 0; x < size[0]; ++x) {
            const auto* rgb = static_cast<const unsigned char*>(image->GetScalarPointer(x, y, 0));
            if (rgb[0] > 250 && rgb[1] > 250 && rgb[2] > 250)
                ++count.white;
            else if (rgb[2] > rgb[0] + 40)
                ++count.blue;
            else if (rgb[0] > rgb[2] + 90)
                ++count.red;
            else
                ++count.other;
        }
    return count;
}

const std::vector<std::string> kFrames = {"0", "1", "2", "3", "4"};

/// A file of contacts between rods: what the kinds of bodies are.
std::string of_rods(std::string file)
{
    const std::string kinds = // rod, rod
        R"(<FieldData><Array type="String" Name="body_kinds" NumberOfTuples="2" format="ascii">)"
        "114 111 100 0 114 111 100 0</Array></FieldData>";
    return file.insert(file.find("<Piece"), kinds);
}

/// Where pixels of a kind are in the large panel, on an average, from below.
struct Mean {
    long pixels = 0;
    double y = 0;
};
struct Means {
    Mean blue, green, red;
};

Means means_of(const fs::path& png)
{
    vtkNew<vtkPNGReader> reader;
    reader->SetFileName(png.c_str());
    reader->Update();
    vtkImageData* image = reader->GetOutput();
    const int* size = image->GetDimensions();
    Means means;
    for (int y = 4 * size[1] / 10; y < size[1]; ++y)
        for (int x = 0; x < size[0]; ++x) {
            const auto* rgb = static_cast<const unsigned char*>(image->GetScalarPointer(x, y, 0));
            Mean* of = nullptr;
            if (rgb[2] > rgb[0] + 40 && rgb[2] > rgb[1] + 20)
                of = &means.blue;
            else if (rgb[1] > rgb[0] + 25 && rgb[1] > rgb[2] + 25)
                of = &means.green;
            else if (rgb[0] > rgb[2] + 90)
                of = &means.red;
            if (!of) continue;
            ++of->pixels;
            of->y += y;
        }
    for (Mean* m : {&means.blue, &means.green, &means.red})
        m->y /= static_cast<double>(std::max(1L, m->pixels));
    return means;
}

} // namespace

TEST_CASE("a picture shows the wire, and contact forces if there are any" *
          doctest::test_suite("slow"))
{
    if (no_screen()) return;
    const Folder folder;
    write_run(folder, true);
    const fs::path png = folder.path / "run.png";
    REQUIRE(module().render(folder.path, png) == "");
    const Colours with = colours_of(png, 0.6);
    const Colours whole = colours_of(png, 1); // with the legend: the scale of the force
    CHECK(with.white > 1000000);
    CHECK(with.blue > 2000);
    CHECK(with.red > 500);
    CHECK(with.other > 10000); // the plate of glass, the letters

    write_run(folder, true, 1, true); // contacts named by two collections count once
    REQUIRE(module().render(folder.path, png) == "");
    CHECK(colours_of(png, 1) == whole);

    write_run(folder, false);
    REQUIRE(module().render(folder.path, png) == "");
    CHECK(colours_of(png, 0.6).red == 0);
    CHECK(colours_of(png, 0.6).blue > 2000);
}

TEST_CASE("what is drawn in strips fits together and is drawn once" * doctest::test_suite("slow"))
{
    if (no_screen()) return;
    const Folder folder;
    write_run(folder, true);
    const fs::path png = folder.path / "run.png";
    REQUIRE(module().render(folder.path, png) == "");
    vtkNew<vtkPNGReader> reader;
    reader->SetFileName(png.c_str());
    reader->Update();
    vtkImageData* image = reader->GetOutput();
    const auto rgb_at = [&](int x, int y) { // y from below
        const auto* rgb = static_cast<const unsigned char*>(image->GetScalarPointer(x, y, 0));
        return std::array<int, 3>{rgb[0], rgb[1], rgb[2]};
    };
    // A wide page: the large panel is as wide as the page and begins at 0.38 of its height.
    const int from = 570, captions = 1500 - 110, bar_of_length = from + 120;
    std::vector<double> wire; // where it is in each row
    int dark = 0, dark_above = 0;
    for (int y = from; y < 1500; ++y) {
        double sum = 0;
        int count = 0;
        for (int x = 0; x < 2400; ++x) {
            const auto [r, g, b] = rgb_at(x, y);
            if (b > r + 40 && b > g + 20) {
                sum += x;
                ++count;
            }
            if (const int light = std::max({r, g, b});
                light < 90 && light - std::min({r, g, b}) < 15) {
                if (y >= captions) ++dark_above;
                if (y >= bar_of_length && y < captions) ++dark;
            }
        }
        if (count > 0) wire.push_back(sum / count);
    }
    REQUIRE(wire.size() > 300); // over several strips
    // It rises by 0.2 of its way: five pixels to the right a row, but at its round ends.
    for (std::size_t i = 60; i + 60 < wire.size(); ++i)
        CHECK(wire[i + 1] - wire[i] == doctest::Approx(5).epsilon(0.3));
    CHECK(dark_above > 200); // letters of the captions
    CHECK(dark < 100);       // and nowhere else

    // Of the legend, the bars of force and curvature.
    int bars = 0;
    bool in_bar = false;
    for (int y = 0; y < from; ++y) {
        int coloured = 0;
        for (int x = 1584; x < 2400; ++x) {
            const auto [r, g, b] = rgb_at(x, y);
            coloured += std::max({r, g, b}) - std::min({r, g, b}) > 60;
        }
        const bool here = coloured > 400;
        bars += here && !in_bar;
        in_bar = here;
    }
    CHECK(bars == 2);
}

TEST_CASE("a few wires have each a hue of their own and instruments a ball at the tip" *
          doctest::test_suite("slow"))
{
    if (no_screen()) return;
    const Folder folder;
    const fs::path png = folder.path / "run.png";
    write_run(folder, false);
    REQUIRE(module().render(folder.path, png) == "");
    const Means one = means_of(png);
    std::vector<std::array<double, 3>> line;
    for (int i = 0; i <= 10; ++i)
        line.push_back({-1 + 0.2 * i, 0, 0.6 - 0.04 * i});
    folder.write("other.vtp",
                 vtp(line, "Lines",
                     array("radius", repeated(0.02, 11)) + array("curvature", repeated(1, 11))));
    std::string frames;
    for (const std::string& n : kFrames) // the second wire is a part of the file
        frames += "<DataSet timestep=\"" + n + "\" name=\"wire\" file=\"wire" + n +
                  ".vtp\"/><DataSet timestep=\"" + n + "\" name=\"sheath\" file=\"other.vtp\"/>";
    folder.write("run.pvd", R"(<VTKFile type="Collection" version="0.1"><Collection>)" + frames +
                                "</Collection></VTKFile>");
    REQUIRE(module().render(folder.path, png) == "");
    const Means two = means_of(png);
    CHECK(one.green.pixels == 0);
    CHECK(two.green.pixels > 5000);
    CHECK(two.blue.pixels > 0.5 * static_cast<double>(one.blue.pixels));

    // rods have no tip
    for (const std::string& n : kFrames)
        folder.write("contact" + n + ".vtp",
                     of_rods(vtp({{0, 0, 0}}, "Verts", array("force", "0 0 0", 3))));
    REQUIRE(module().render(folder.path, png) == "");
    CHECK(means_of(png).green.pixels < two.green.pixels - 500);
}

TEST_CASE("forces between rods are those on the first one and are not called those on a wall" *
          doctest::test_suite("slow"))
{
    if (no_screen()) return;
    const Folder folder;
    const fs::path png = folder.path / "run.png";
    write_run(folder, false);
    for (const double up : {1.0, -1.0}) {
        std::string contact = vtp({{0, 0, 0.2}}, "Verts",
                                  array("force", "0 0 " + std::to_string(up), 3) +
                                      array("body_a", "0") + array("body_b", "1"));
        for (const std::string& n : kFrames)
            folder.write("contact" + n + ".vtp", of_rods(contact));
        REQUIRE(module().render(folder.path, png) == "");
        const Means m = means_of(png);
        CHECK(m.red.pixels > 500);
        CHECK((m.red.y > m.blue.y) == (up > 0));
    }
}

TEST_CASE("a rod among rigid bodies does not hide what they are" * doctest::test_suite("slow"))
{
    if (no_screen()) return;
    const Folder folder;
    const fs::path png = folder.path / "run.png";
    write_bodies(folder, 2e6, 2, 1);
    REQUIRE(module().render(folder.path, png) == "");
    const Means without = means_of(png);
    folder.write("rod.vtp", vtp({{0, 0, 1.1}, {1, 0, 1.1}}, "Lines", array("radius", "0.03 0.03")));
    std::string frames;
    for (const std::string& n : kFrames)
        for (const std::string& file :
             std::vector<std::string>{"rod.vtp", "rigid" + n + ".vtp", "cube.vtu", "ground.vtp"})
            frames += "<DataSet timestep=\"" + n + "\" file=\"" + file + "\"/>";
    folder.write("run.pvd", R"(<VTKFile type="Collection" version="0.1"><Collection>)" + frames +
                                "</Collection></VTKFile>");
    REQUIRE(module().render(folder.path, png) == "");
    const Means with = means_of(png); // the cube's stress is blue, the rigid body yellow
    CHECK(with.blue.pixels > 0.8 * static_cast<double>(without.blue.pixels));
}

TEST_CASE("a run in millimetres gives the picture of the same run in metres" *
          doctest::test_suite("slow"))
{
    if (no_screen()) return;
    const Folder folder;
    const fs::path png = folder.path / "run.png";
    write_run(folder, true);
    REQUIRE(module().render(folder.path, png) == "");
    const Colours metres = colours_of(png, 0.5);
    write_run(folder, true, 1000);
    REQUIRE(module().render(folder.path, png) == "");
    const Colours millimetres = colours_of(png, 0.5);
    CHECK(std::abs(metres.blue - millimetres.blue) < 0.01 * static_cast<double>(metres.blue));
    CHECK(std::abs(metres.red - millimetres.red) < 0.01 * static_cast<double>(metres.red));
}

TEST_CASE("solids show their stress and rigid bodies are drawn and a plane ends near the bodies" *
          doctest::test_suite("slow"))
{
    if (no_screen()) return;
    const Folder folder;
    const fs::path png = folder.path / "run.png";
    write_bodies(folder, 2e6, 2, 1);
    REQUIRE(module().render(folder.path, png) == "");
    const Colours stressed = colours_of(png, 0.6);
    CHECK(stressed.blue > 50000);
    CHECK(stressed.white > 500000);
    CHECK(stressed.other > 50000); // the plate, the other body
    CHECK(stressed.red == 0);      // no contacts, no arrows

    write_bodies(folder, 2e6, 500, 1); // only its part near the bodies counts
    REQUIRE(module().render(folder.path, png) == "");
    CHECK(colours_of(png, 0.6) == stressed);

    write_bodies(folder, 2e6, 2, 1, 1000); // in millimetres
    REQUIRE(module().render(folder.path, png) == "");
    CHECK(std::abs(colours_of(png, 0.6).blue - stressed.blue) <
          0.01 * static_cast<double>(stressed.blue));

    write_bodies(folder, 2e6, 2, 3); // it continues, so all is drawn smaller
    REQUIRE(module().render(folder.path, png) == "");
    CHECK(colours_of(png, 0.6).blue < 0.8 * static_cast<double>(stressed.blue));

    folder.write("run.pvd", R"(<VTKFile type="Collection" version="0.1"><Collection>)"
                            R"(<DataSet timestep="1" file="cube.vtu"/></Collection></VTKFile>)");
    REQUIRE(module().render(folder.path, png) == ""); // one frame: the other panels stay white
    CHECK(colours_of(png, 1).white > 2400000);

    write_bodies(folder, 0, 2, 1);
    fs::remove(folder.path / "rigid4.vtp");
    fs::copy(folder.path / "ground.vtp", folder.path / "rigid4.vtp");
    REQUIRE(module().render(folder.path, png) == "");
    CHECK(colours_of(png, 0.6).blue < 0.1 * static_cast<double>(stressed.blue));
}

TEST_CASE("a damaged solid is refused and its file named")
{
    const Folder folder;
    const fs::path png = folder.path / "run.png";
    const auto refused_with = [&](const std::string& before, const std::string& after) {
        write_bodies(folder, 1, 2, 1);
        std::ifstream file(folder.path / "cube.vtu");
        std::string text((std::istreambuf_iterator<char>(file)), {});
        const std::size_t at = text.find(before);
        REQUIRE(at != std::string::npos);
        folder.write("cube.vtu", text.replace(at, before.size(), after));
        const std::string message = module().render(folder.path, png);
        CAPTURE(after);
        CAPTURE(message);
        CHECK(message.find(".vtu") != std::string::npos);
        CHECK_FALSE(fs::exists(png));
    };
    refused_with("5 6 7<", "5 6 9<"); // no such point
    refused_with("5 6 7<", "5 6 -7<");
    refused_with(">12<", ">10<"); // a tetrahedron of eight points
    refused_with(">8</Data", ">900</Data");
    refused_with("UnstructuredGrid", "StructuredGrid");
}

TEST_CASE("what cannot be drawn is reported and no file is left" * doctest::test_suite("slow"))
{
    const Folder folder;
    const fs::path png = folder.path / "run.png";
    CHECK(module().render(folder.path, png).find("no .pvd file") != std::string::npos);
    CHECK(module().render(folder.path / "missing", png).find("no .pvd file") != std::string::npos);
    write_run(folder, true);
    CHECK(
        module().render(folder.path, folder.path / "missing" / "a.png").find("cannot be written") !=
        std::string::npos);
    fs::resize_file(folder.path / "wire4.vtp", 700);
    CHECK(module().render(folder.path, png).find("wire4.vtp") != std::string::npos);
    for (const auto& entry : fs::directory_iterator(folder.path))
        CHECK(entry.path().string().find(".png") == std::string::npos);
}

TEST_CASE("without Xvfb and DISPLAY the message names the package to install")
{
    const Folder folder;
    write_run(folder, true);
    const std::string path = std::getenv("PATH");
    const char* display = std::getenv("DISPLAY");
    const std::string kept = display ? display : "";
    setenv("PATH", folder.path.c_str(), 1);
    unsetenv("DISPLAY");
    CHECK(module().render(folder.path, folder.path / "run.png").find("xvfb") != std::string::npos);
    setenv("PATH", path.c_str(), 1);
    if (display) setenv("DISPLAY", kept.c_str(), 1);
}

TEST_CASE("a VTP surface comes as triangles in the file's orientation")
{
    const Folder folder;
    double* points = nullptr;
    int* triangles = nullptr;
    long point_count = 0, triangle_count = 0;
    char message[300] = "";
    auto* read =
        module().function<decltype(amontons_vtk_read_surface)>("amontons_vtk_read_surface");
    auto* restore = module().function<decltype(amontons_vtk_free)>("amontons_vtk_free");
    const auto read_file = [&](const fs::path& file) {
        return read(file.c_str(), &points, &point_count, &triangles, &triangle_count, message,
                    sizeof message);
    };
    // a square of area 4 with the normal +z, as one polygon
    const std::vector<std::array<double, 3>> square{{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}};
    REQUIRE(read_file(folder.write("a.vtp", vtp(square, "Polys", "", "0 1 2 3", "4"))) == 0);
    REQUIRE(point_count == 4);
    REQUIRE(triangle_count == 2);
    double area = 0;
    for (long t = 0; t < triangle_count; ++t) {
        const double* p[3];
        for (int corner = 0; corner < 3; ++corner)
            p[corner] = points + 3 * triangles[3 * t + corner];
        area += 0.5 * ((p[1][0] - p[0][0]) * (p[2][1] - p[0][1]) -
                       (p[2][0] - p[0][0]) * (p[1][1] - p[0][1]));
    }
    CHECK(area == doctest::Approx(4));
    restore(points);
    restore(triangles);

    for (const fs::path& bad :
         {folder.path / "missing.vtp", folder.write("text.vtp", "solid a\n"),
          folder.write("far.vtp", vtp(square, "Polys", "", "0 1 2 9", "4")),
          folder.write("negative.vtp", vtp(square, "Polys", "", "0 1 2 -1", "4")),
          folder.write("offsets.vtp", vtp(square, "Polys", "", "0 1 2 3", "3 -1")),
          folder.write("line.vtp", vtp(square, "Lines", ""))}) {
        CAPTURE(bad);
        message[0] = 0;
        CHECK(read_file(bad) == 1);
        CHECK(std::string(message).find(bad.filename()) != std::string::npos);
        CHECK(points == nullptr);
        CHECK(triangles == nullptr);
    }
    char few[8] = "";
    CHECK(read("missing.vtp", &points, &point_count, &triangles, &triangle_count, few, 8) == 1);
    CHECK(std::string(few) == "missing");
}

TEST_CASE("vtk_reads accepts good files and refuses damaged ones")
{
    const Folder folder;
    write_run(folder, true);
    const std::string quiet = " >/dev/null 2>&1";
    const auto reads = [&](const std::string& name) {
        const int status =
            std::system((VTK_READS " " + (folder.path / name).string() + quiet).c_str());
        return WIFEXITED(status) && WEXITSTATUS(status) == 0;
    };
    CHECK(reads("run.pvd"));
    CHECK(reads("plate.vtp"));
    CHECK_FALSE(reads("missing.vtp"));
    fs::resize_file(folder.path / "wire2.vtp", 700);
    CHECK_FALSE(reads("run.pvd"));
    const std::vector<std::array<double, 3>> two{{0, 0, 0}, {1, 0, 0}};
    folder.write("short.vtp", vtp(two, "Lines", array("radius", "1")));
    CHECK_FALSE(reads("short.vtp"));
}
