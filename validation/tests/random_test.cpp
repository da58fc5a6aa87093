// The random suite proves itself: every law catches an error that is planted in written files.

#include "mesh/base/file.hpp"
#include "validation/random/change_scene.hpp"
#include "validation/random/geometry.hpp"
#include "validation/random/known.hpp"
#include "validation/random/laws.hpp"
#include "validation/random/pieces.hpp"
#include "validation/random/suite.hpp"
#include "validation/random/variants.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <doctest/doctest.h>
#include <filesystem>
#include <fmt/format.h>
#include <functional>
#include <map>
#include <set>
#include <unistd.h>

namespace fs = std::filesystem;

using namespace amontons;
using namespace amontons::validation;

namespace {

/// The suite of kinds that try one thing each.
const SceneSuite& singles()
{
    return *find_suite("random");
}

/// A folder that is removed in the end.
struct TestFolder {
    TestFolder()
    {
        path = (fs::temp_directory_path() / "amontons_random_test_XXXXXX").string();
        REQUIRE(::mkdtemp(path.data()) != nullptr);
    }
    TestFolder(const TestFolder&) = delete;
    TestFolder& operator=(const TestFolder&) = delete;
    ~TestFolder()
    {
        std::error_code ignored;
        fs::remove_all(path, ignored);
    }
    std::string path;
};

/// Runs a scene with the program; the folder of what it wrote.
std::string run_scene_in(const std::string& folder, const Json& scene)
{
    write_file(folder + "/test.json", scene.dump(), Flush::to_system);
    const std::string command = fmt::format("'{}' run '{}/test.json' --quiet --output '{}/out'",
                                            AMONTONS_PROGRAM, folder, folder);
    REQUIRE(std::system(command.c_str()) == 0);
    return folder + "/out";
}

/// A VTK file with these arrays, as the program writes one.
void write_vtk(const std::string& path, const VtkText& vtk)
{
    std::string head =
        fmt::format("<VTKFile>\n<FieldData>\n<DataArray Name=\"TimeValue\" format=\"ascii\">{}"
                    "</DataArray>\n</FieldData>\n",
                    vtk.time);
    std::string data, section;
    const auto append = [&](auto number) {
        data.append(reinterpret_cast<const char*>(&number), sizeof number);
    };
    for (const auto& [name, array] : vtk.arrays) {
        const std::size_t slash = name.find('/'), at = data.size(), n = array.values.size();
        if (name.substr(0, slash) != section) {
            section = name.substr(0, slash);
            head += "<" + section + ">\n";
        }
        head += fmt::format(
            "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"appended\" "
            "offset=\"{}\"/>\n",
            array.type, name.substr(slash + 1), array.components, at);
        const std::size_t size = array.type == "Float64" ? 8 : array.type == "UInt8" ? 1 : 4;
        append(static_cast<std::uint64_t>(n * size));
        for (const double v : array.values)
            if (array.type == "Float64")
                append(v);
            else if (array.type == "Float32")
                append(static_cast<float>(v));
            else if (array.type == "Int32")
                append(static_cast<std::int32_t>(v));
            else
                append(static_cast<std::uint8_t>(v));
    }
    write_file(path,
               head + "<AppendedData encoding=\"raw\">\n_" + data +
                   "\n</AppendedData>\n</VTKFile>\n",
               Flush::to_system);
}

/// The last frame of a part.
std::string last_frame(const std::string& out, const std::string& part)
{
    std::string last;
    for (const auto& entry : fs::directory_iterator(out + "/frames")) {
        const std::string file = entry.path().filename().string();
        if (file.rfind(part + ".0", 0) == 0 && entry.path().string() > last)
            last = entry.path().string();
    }
    REQUIRE(!last.empty());
    return last;
}

/// Changes the arrays of a part's last frame.
void plant(const std::string& out, const std::string& part,
           const std::function<void(VtkText&)>& change)
{
    const std::string path = last_frame(out, part);
    VtkText vtk = read_vtk(path);
    change(vtk);
    write_vtk(path, vtk);
}

/// Changes a value of history.csv in its last row.
void plant_in_history(const std::string& out, const std::string& column,
                      const std::function<double(double)>& change)
{
    const WrittenHistory h = read_run(out).history;
    const int c = h.column(column);
    REQUIRE(c >= 0);
    std::string text = read_file(out + "/history.csv");
    std::size_t begin = text.rfind('\n', text.size() - 2) + 1;
    for (int k = 0; k < c; ++k)
        begin = text.find(',', begin) + 1;
    const double value = std::strtod(&text[begin], nullptr);
    text.replace(begin, text.find(',', begin) - begin, fmt::format("{:.17g}", change(value)));
    write_file(out + "/history.csv", text, Flush::to_system);
}

std::set<std::string> laws_broken(const std::string& out)
{
    std::set<std::string> laws;
    for (const Finding& f : check_laws(read_run(out))) {
        laws.insert(f.law);
        MESSAGE(f.law << ": " << f.text);
    }
    return laws;
}

/// Runs a scene once and plants errors in copies of what it wrote.
class Planted {
public:
    explicit Planted(const Json& scene) : out_(run_scene_in(folder_.path, scene))
    {
        REQUIRE(laws_broken(out_).empty());
    }

    std::set<std::string> laws(const std::function<void(const std::string& out)>& change)
    {
        const std::string copy = folder_.path + "/copy";
        fs::remove_all(copy);
        fs::copy(out_, copy, fs::copy_options::recursive);
        change(copy);
        return laws_broken(copy);
    }
    const std::string& out() const { return out_; }

private:
    TestFolder folder_;
    std::string out_;
};

/// The force of a contact, turned by 1e-3 about an axis across it.
void turn_force(VtkText& contacts, std::size_t i)
{
    std::vector<double>& f = contacts.arrays.at("PointData/force").values;
    const Vec3 old(f[3 * i], f[3 * i + 1], f[3 * i + 2]);
    const Vec3 turned = turn_by(1e-3 * old.cross(Vec3(0.3, 0.8, 0.1)).normalized()) * old;
    for (std::size_t k = 0; k < 3; ++k)
        f[3 * i + k] = turned[int(k)];
}

/// The contact with the largest force.
std::size_t largest_contact(const VtkText& contacts)
{
    const std::vector<double>& n = contacts.get("PointData/normal_force").values;
    REQUIRE(!n.empty());
    return static_cast<std::size_t>(std::max_element(n.begin(), n.end()) - n.begin());
}

void remove_contact(VtkText& contacts, std::size_t i)
{
    for (auto& [name, array] : contacts.arrays)
        if (name.rfind("PointData/", 0) == 0 || name == "Points/points") {
            const auto n = static_cast<std::ptrdiff_t>(array.components),
                       at = static_cast<std::ptrdiff_t>(i) * n;
            array.values.erase(array.values.begin() + at, array.values.begin() + at + n);
        }
}

void shift_points(VtkText& body, const Vec3& by)
{
    std::vector<double>& x = body.arrays.at("Points/points").values;
    for (std::size_t i = 0; i < x.size(); ++i)
        x[i] += by[int(i % 3)];
}

/// A rigid box at rest on a plane, pushed sideways by less than what moves it.
Json resting_box()
{
    Json box = rigid_box({0.2, 0.3, 0.1}, {0, 0, 0.05});
    box["mass"] = 2;
    box["force"] = {4, 0, 0};
    Json scene = scene_of({{"floor", plane({0, 0, 0}, {0, 0, 1})}, {"box", box}},
                          pair("box", "floor", 0.5), quasi_static(0.5));
    scene["gravity"] = {0, 0, -9.81};
    return scene;
}

/// A block of T4 that is pressed onto a plane and dragged until it slides.
Json dragged_block()
{
    Json block = elastic(box_mesh({0.1, 0.1, 0.05}, {2, 2, 1}, "T4", {0, 0, 0.025}), 1e6, 0.3);
    block["hold"] = Json::array(
        {held("z_max", Json::array({{0, 0}, {0.5, 0}, {1, 0.004}}), 0, ramp(-0.002, 0.5))});
    return scene_of({{"block", block}, {"floor", plane({0, 0, 0}, {0, 0, 1})}},
                    pair("block", "floor", 0.3), quasi_static(0.125));
}

/// Two balls that collide in space.
Json colliding_balls()
{
    Json a = rigid_ball(0.05, {0, 0, 0}), b = rigid_ball(0.05, {0.12, 0.01, 0});
    a["mass"] = 1;
    b["mass"] = 2;
    a["start"]["velocity"] = {1, 0, 0};
    Json contact = pair("a", "b");
    contact["restitution"] = 0.8;
    return scene_of({{"a", a}, {"b", b}}, contact, dynamic(0.002, 0.06));
}

} // namespace

TEST_CASE("a force turned by a thousandth, a contact removed and a place moved are caught at rest")
{
    Planted run(resting_box());
    const auto turned = [](VtkText& c) { turn_force(c, largest_contact(c)); };
    CHECK(run.laws([&](const std::string& out) { plant(out, "contacts", turned); }).count("sums") ==
          1);
    CHECK(run.laws([&](const std::string& out) { plant(out, "contacts", turned); })
              .count("balance") == 1);
    const auto removed = [](VtkText& c) { remove_contact(c, largest_contact(c)); };
    CHECK(run.laws([&](const std::string& out) { plant(out, "contacts", removed); })
              .count("balance") == 1);
    CHECK(
        run.laws([&](const std::string& out) { plant(out, "contacts", removed); }).count("sums") ==
        1);
    const auto moved = [](VtkText& body) {
        shift_points(body, {0, 0, -5e-4});
    }; // 0.5 % of its height
    CHECK(run.laws([&](const std::string& out) { plant(out, "box", moved); }).count("overlap") ==
          1);
    const auto aside = [](VtkText& c) { shift_points(c, {1e-3, 0, 0}); }; // where the forces act
    CHECK(
        run.laws([&](const std::string& out) { plant(out, "contacts", aside); }).count("balance") ==
        1);
}

TEST_CASE("forces and moments on a rod that are a thousandth off are caught")
{
    Json wire = {{"kind", "rod"},
                 {"segments",
                  Json::array({{{"length", 1}, {"radius", 0.01}, {"EI", 1}, {"element", 0.05}}})},
                 {"shape", {{"start", {0.1, 0.2, 0.3}}, {"direction", {1, 0, 0}}}}};
    wire["hold"] = Json::array({Json{{"set", "start"}}});
    wire["loads"] =
        Json::array({Json{{"set", "end"}, {"force", {0.3, 0.5, -1}}, {"moment", {0, 0.2, 0.1}}}});
    Planted run(scene_of({{"wire", wire}}, Json::array(), quasi_static(0.5)));
    const auto more = [](double value) { return 1.001 * value; };
    for (const char* column : {"wire_start_force_z", "wire_start_moment_y"}) {
        CAPTURE(column);
        CHECK(run.laws([&](const std::string& out) { plant_in_history(out, column, more); })
                  .count("balance") == 1);
    }
    const auto moved = [](VtkText& body) { // its end
        body.arrays.at("Points/points").values.back() += 1e-3;
    };
    CHECK(run.laws([&](const std::string& out) { plant(out, "wire", moved); }).count("balance") ==
          1);
}

TEST_CASE("friction beyond its cone, contacts that pull and gaps under a force are caught")
{
    Planted run(dragged_block());
    const auto widened = [](VtkText& c) {
        const std::size_t i = largest_contact(c);
        std::vector<double>& f = c.arrays.at("PointData/force").values;
        f[3 * i] *= 1.001; // along the slip
    };
    CHECK(run.laws([&](const std::string& out) { plant(out, "contacts", widened); })
              .count("Coulomb") == 1);
    const auto pulls = [](VtkText& c) {
        std::vector<double>& f = c.arrays.at("PointData/force").values;
        for (double& v : f)
            v = -v;
    };
    CHECK(
        run.laws([&](const std::string& out) { plant(out, "contacts", pulls); }).count("Coulomb") ==
        1);
    for (const double gap : {1e-3, -1e-3}) {
        const auto opened = [&](VtkText& c) {
            c.arrays.at("PointData/gap").values[largest_contact(c)] = gap;
        };
        CHECK(run.laws([&](const std::string& out) { plant(out, "contacts", opened); })
                  .count("complementarity") == 1);
    }
    const auto against = [](VtkText& c) {
        for (double& v : c.arrays.at("PointData/slip").values)
            v = -v;
    };
    CHECK(run.laws([&](const std::string& out) { plant(out, "contacts", against); })
              .count("Coulomb") == 1);
    const auto moved = [](VtkText& body) { shift_points(body, {0, 0, -1e-3}); };
    CHECK(run.laws([&](const std::string& out) { plant(out, "block", moved); }).count("overlap") ==
          1);
}

TEST_CASE("energies that are a thousandth off are caught")
{
    Planted run(dragged_block());
    const auto more = [](double value) { return 1.001 * value; };
    for (const char* column : {"work", "elastic", "friction", "energy_error"}) {
        CAPTURE(column);
        const auto change = [&](double v) { return std::abs(v) < 1e-9 ? 1e-3 : more(v); };
        CHECK(run.laws([&](const std::string& out) { plant_in_history(out, column, change); })
                  .count("energy") == 1);
    }
    // Work and error together: the columns agree, the forces of the holds do not.
    CHECK(run.laws([&](const std::string& out) {
                 double by = 0;
                 plant_in_history(out, "work", [&](double v) { return v + (by = 1e-3 * v); });
                 plant_in_history(out, "friction", [&](double v) { return v + by; });
             })
              .count("energy") == 1);
    const auto stored = [](VtkText& body) {
        for (double& v : body.arrays.at("CellData/strain_energy_density").values)
            v *= 1.001;
    };
    CHECK(run.laws([&](const std::string& out) { plant(out, "block", stored); }).count("energy") ==
          1);
}

TEST_CASE("momenta, impulses and kinetic energies that are a thousandth off are caught")
{
    Planted run(colliding_balls());
    const auto more = [](double value) { return 1.001 * value; };
    CHECK(run.laws([&](const std::string& out) { plant_in_history(out, "momentum_x", more); })
              .count("momentum") == 1);
    const std::set<std::string> faster =
        run.laws([&](const std::string& out) { plant_in_history(out, "b_velocity_x", more); });
    CHECK(faster.count("momentum") == 1);
    CHECK(faster.count("balance") == 1);
    CHECK(faster.count("energy") == 1);
}

TEST_CASE("a joint whose place moved is caught")
{
    Json bar = rigid_box({0.1, 0.02, 0.02}, {0.05, 0, 0});
    bar["density"] = 1000;
    Json time = dynamic(0.0005, 0.01);
    time["theta"] = 0.5;
    Json scene = scene_of({{"bar", bar}}, Json::array(), time);
    scene["couplings"] = Json::array({Json{
        {"kind", "hinge"}, {"between", {"bar", "world"}}, {"at", {0, 0, 0}}, {"axis", {0, 1, 0}}}});
    scene["gravity"] = {0, 0, -9.81};
    TestFolder folder;
    const std::string out = run_scene_in(folder.path, scene);
    const auto broken = [&] {
        std::set<std::string> laws;
        for (const Finding& f : check_joints(read_run(out)))
            laws.insert(f.law);
        return laws;
    };
    REQUIRE(broken().empty());
    plant(out, "bar", [](VtkText& body) { shift_points(body, {1e-4, 0, 0}); });
    CHECK(broken().count("joints") == 1);
}

TEST_CASE("variants that differ are caught, and those that do not are not")
{
    TestFolder folder, other;
    const WrittenRun run = read_run(run_scene_in(folder.path, dragged_block()));
    const std::string out = run_scene_in(other.path, dragged_block());
    Variant same{"threads", {}}, close{"turned", {}};
    close.tolerance = 1e-6;
    CHECK(compare_runs(run, read_run(out), same).empty());
    CHECK(compare_runs(run, read_run(out), close).empty());
    plant_in_history(out, "block_z_max_force_z", [](double v) { return v * (1 + 1e-4); });
    CHECK(compare_runs(run, read_run(out), same).size() == 1);
    CHECK(compare_runs(run, read_run(out), close).size() == 1);
}

TEST_CASE("runs whose steps are cut otherwise may differ by what finer runs measure, and no more")
{
    TestFolder folder;
    const WrittenRun run = read_run(run_scene_in(folder.path, dragged_block()));
    const auto with_force = [&](double factor) {
        WrittenRun r = run;
        for (const char* axis : {"x", "y", "z"})
            r.history.rows
                .back()[std::size_t(r.history.column(std::string("block_z_max_force_") + axis))] *=
                factor;
        return r;
    };
    CHECK_FALSE(took_other_steps(run, run, 1));
    WrittenRun cut = run;
    cut.history.rows[1][std::size_t(cut.history.column("time"))] *= 0.5;
    CHECK(took_other_steps(run, cut, 1));
    const StepError left = step_error(run, {with_force(1 + 1e-4), with_force(1 - 2e-4)});
    Variant turned{"turned", {}};
    turned.tolerance = 1e-6;
    CHECK(compare_runs(run, with_force(1 + 3.9e-4), turned, left)
              .empty()); // twice 2e-4 of its length
    CHECK(compare_runs(run, with_force(1 + 8e-4), turned, left).size() == 1);
    CHECK(compare_runs(run, with_force(1 + 3.9e-4), turned).size() == 1);
}

TEST_CASE("work over steps that are cut otherwise may differ by the energy that these miss")
{
    TestFolder folder;
    const WrittenRun run = read_run(run_scene_in(folder.path, dragged_block()));
    REQUIRE(run.history.rows.size() > 3);
    const auto add = [](WrittenRun& r, const char* column, std::size_t from, double by) {
        for (std::size_t i = from; i < r.history.rows.size(); ++i)
            r.history.rows[i][std::size_t(r.history.column(column))] += by;
    };
    const double missed = 1e-3 * run.history.last("work_absolute");
    const auto other = [&](bool merged, double error) {
        WrittenRun r = run; // its second step misses energy
        add(r, "work", 2, missed);
        add(r, "energy_error", 2, error);
        if (merged) r.history.rows.erase(r.history.rows.begin() + 1); // a longer step
        return r;
    };
    Variant turned{"turned", {}};
    turned.tolerance = 1e-6;
    CHECK(compare_runs(run, other(true, 1.01 * missed), turned).empty());
    CHECK(compare_runs(run, other(true, 0.9 * missed), turned).size() == 1);
    CHECK(compare_runs(run, other(false, 1.01 * missed), turned).size() == 1); // the same steps
}

TEST_CASE("a file that is cut short is caught")
{
    Planted run(resting_box());
    CHECK_THROWS(run.laws([&](const std::string& out) {
        const std::string path = last_frame(out, "contacts"), bytes = read_file(path);
        write_file(path, bytes.substr(0, bytes.size() - 40), Flush::to_system);
    }));
    CHECK_THROWS(run.laws([&](const std::string& out) {
        std::string text = read_file(out + "/history.csv");
        text.insert(text.find('\n'), ",one column more");
        write_file(out + "/history.csv", text, Flush::to_system);
    }));
}

TEST_CASE("every kind of scene comes at least eight times in three hundred, whatever the seed")
{
    CHECK(singles().kinds.size() >= 24);
    for (const std::uint64_t seed : {0ULL, 1ULL, 2ULL, 77ULL, 18446744073709551615ULL}) {
        std::map<std::string, int> drawn;
        for (int i = 0; i < 300; ++i)
            ++drawn[kind_of_scene(singles(), seed, i).name];
        for (const SceneKind& kind : singles().kinds)
            CHECK_MESSAGE(drawn[kind.name] >= 8, kind.name);
    }
}

TEST_CASE("a scene depends on seed and number alone, and other seeds give other scenes")
{
    for (int i = 0; i < 66; ++i) {
        const Json scene = draw_scene(singles(), 5, i).scene;
        CHECK(scene == draw_scene(singles(), 5, i).scene);
        CHECK(scene != draw_scene(singles(), 6, i).scene);
    }
}

TEST_CASE("numbers are drawn as SplitMix64 gives them on every machine")
{
    // Java's SplittableRandom(0).nextLong(), and the seeding table of xoshiro's authors.
    CHECK(SplitMix{0}.next() == 0xe220a8397b1dcdafULL);
    SplitMix numbers{1234567};
    for (const std::uint64_t right :
         {6457827717110365317ULL, 3203168211198807973ULL, 9817491932198370423ULL})
        CHECK(numbers.next() == right);
}

TEST_CASE("axes moved on three times, and units changed there and back, give the same scene")
{
    for (int i = 0; i < 66; ++i) {
        const RandomScene s = draw_scene(singles(), 3, i);
        if (const auto once = scene_in_units(s.scene, {8, 4, 2})) {
            const auto back = scene_in_units(*once, {1.0 / 8, 1.0 / 4, 1.0 / 2});
            REQUIRE(back);
            CHECK(*back == s.scene);
            CHECK(*once != s.scene);
        }
        std::optional<Json> turned = s.scene;
        for (int k = 0; k < 3 && turned; ++k)
            turned = turned_scene(*turned, axes_moved_on(), Vec3::Zero());
        if (!turned) continue;
        for (const auto& [name, body] : s.scene.at("bodies").items()) {
            const Json& there = turned->at("bodies").at(name);
            CHECK(body.value("hold", Json()) == there.value("hold", Json()));
            CHECK((start_of(body).turn - start_of(there).turn).norm() < 1e-12);
            CHECK((start_of(body).shift - start_of(there).shift).norm() < 1e-12);
        }
    }
}

TEST_CASE("depths of bodies in each other are those of closed forms")
{
    PlacedBody floor{"floor", "obstacle"};
    floor.depth = [](const Vec3& p, double) { return Depth{p.z(), 0}; };
    PlacedBody ball{"ball", "rigid"};
    ball.places = {{Vec3(0.3, 0.2, 0.09), 0, 0.1}};
    CHECK(deepest_place(ball, floor).depth == doctest::Approx(0.01));
    CHECK(turn_by(Vec3(0, 0, 1.5707963267948966))
              .isApprox((Mat3() << 0, -1, 0, 1, 0, 0, 0, 0, 1).finished(), 1e-15));
    WrittenArray from, to;
    const Mat3 turn = turn_by(Vec3(0.3, -1.2, 0.7));
    for (const Vec3& p : {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 2, 0), Vec3(0, 0, 3)}) {
        const Vec3 q = turn * p + Vec3(1, 2, 3);
        from.values.insert(from.values.end(), {p.x(), p.y(), p.z()});
        to.values.insert(to.values.end(), {q.x(), q.y(), q.z()});
    }
    double miss = 1;
    const RigidMotion motion = fit_motion(from, to, miss);
    CHECK(miss < 1e-14);
    CHECK(motion.turn.isApprox(turn, 1e-14));
    CHECK(motion.shift.isApprox(Vec3(1, 2, 3), 1e-14));
}

TEST_CASE("the outside of a block is closed, and its cells fill it")
{
    TestFolder folder;
    for (const char* element : {"T4", "T10", "H8"}) {
        Json block = elastic(box_mesh({0.1, 0.2, 0.3}, {2, 1, 2}, element, {0, 0, 0}), 1e6, 0.3);
        block["hold"] = Json::array({held("z_min")});
        const WrittenRun run = read_run(run_scene_in(
            folder.path, scene_of({{"block", block}}, Json::array(), quasi_static(1))));
        const VtkText& solid = run.frames.back().parts.at("block");
        double volume = 0, flux = 0;
        for (const double v : cell_volumes(solid, true))
            volume += v;
        for (const OuterTriangle& t : outside_of(solid))
            flux += t.corner[0].dot(t.corner[1].cross(t.corner[2])) / 6; // divergence
        CHECK(volume == doctest::Approx(0.006).epsilon(1e-12));
        CHECK(flux == doctest::Approx(0.006).epsilon(1e-12));
        const PlacedBody placed = place_body(run, "block", run.frames.back());
        CHECK(placed.depth(Vec3(0.01, 0.02, 0.11), 1).distance == doctest::Approx(-0.04));
        CHECK(placed.depth(Vec3(0.08, 0, 0), 1).distance == doctest::Approx(0.03));
    }
}

TEST_CASE("known mistakes are of kinds that exist")
{
    std::set<std::string> kinds;
    for (const SceneKind& k : singles().kinds)
        kinds.insert(k.name);
    for (const KnownMistake& k : known_mistakes()) {
        CHECK_MESSAGE(kinds.count(k.kind) == 1, k.kind);
        CHECK(std::string(k.law) != "");
        CHECK(std::string(k.reason) != "");
    }
    CHECK(known_reason("box_on_plane", "", "balance", "forces on box leave") == "");
}

TEST_CASE("a crash, a refusal, bad input and an answer in time are distinguished")
{
    TestFolder folder;
    int number = 0; // a scene that must be done
    while (draw_scene(singles(), 1, number).answer != Answer::done)
        ++number;
    const auto outcome = [&](const ProgramAnswer& answer) {
        return try_scene(singles(), 1, number, folder.path + "/scene",
                         [&](const auto&) { return answer; });
    };
    ProgramAnswer answer;
    answer.signal = 11;
    CHECK(outcome(answer).outcome == "wrong");
    CHECK(outcome(answer).findings.at(0).law == "crash");
    answer.signal = 0;
    answer.exit_code = 3;
    CHECK(outcome(answer).findings.at(0).law == "refused");
    answer.exit_code = 2;
    CHECK(outcome(answer).outcome == "wrong");
    answer.exit_code = 0; // done, and wrote nothing
    CHECK(outcome(answer).findings.at(0).law == "files");
    const SceneResult r = outcome(answer), back = read_scene_result(json_of(r));
    CHECK(back.kind == r.kind);
    CHECK(back.outcome == r.outcome);
    CHECK(back.findings.size() == r.findings.size());
    CHECK(findings_text(r, 7).find("--seed 7 --scene " + std::to_string(number)) !=
          std::string::npos);
}

TEST_CASE("pushes and torques of instruments, and forces of joints, that are off are caught")
{
    // A wire that carries a ball over a block, both in contact and in a weld.
    Json wire = instrument(0.08, 3e-4, 5e-4, 0.0025, {0, 0, 0}, {1, 0, 0},
                           Json::array({{0, 0.01}, {1, 0.03}}));
    Json ball = rigid_ball(0.002, {0.012, 0, 0});
    ball["mass"] = 2e-4;
    Json table = plane({0, 0, -0.00201}, {0, 0, 1});
    Json scene = scene_of({{"table", table}, {"wire", wire}, {"ball", ball}},
                          Json::array({pair("ball", "table", 0.3)}), quasi_static(0.25));
    scene["couplings"] = Json::array({joint("weld", "wire", "ball", {0.01, 0, 0})});
    scene["gravity"] = {0, 0, -kGravity};
    Planted run(scene);
    const auto more = [](double v) { return std::abs(v) < 1e-12 ? 1e-3 : 1.001 * v; };
    const auto far_more = [](double v) { return v + 1e-6; }; // the moment itself is negligible
    for (const char* column :
         {"wire_push_force", "wire_torque", "wire_on_ball_coupling_0_force_z"}) {
        CAPTURE(column);
        CHECK(run.laws([&](const std::string& out) { plant_in_history(out, column, more); })
                  .count("balance") == 1);
    }
    CHECK(run.laws([&](const std::string& out) {
                 plant_in_history(out, "wire_on_ball_coupling_0_moment_y", far_more);
             })
              .count("balance") == 1);
    const auto turned = [](VtkText& c) { turn_force(c, largest_contact(c)); };
    CHECK(run.laws([&](const std::string& out) { plant(out, "contacts", turned); })
              .count("balance") == 1);
}

TEST_CASE("scenes that mix bodies: every kind comes in two hundred, each scene from its number")
{
    const SceneSuite& mixed = *find_suite("mixed");
    CHECK(mixed.count == 200);
    CHECK(mixed.kinds.size() >= 10);
    CHECK(find_suite("no_such_suite") == nullptr);
    std::map<std::string, int> drawn;
    for (int i = 0; i < mixed.count; ++i) {
        ++drawn[kind_of_scene(mixed, 1, i).name];
        const RandomScene s = draw_scene(mixed, 1, i);
        CHECK(s.scene == draw_scene(mixed, 1, i).scene);
        CHECK(scene_in_units(s.scene, {8, 4, 2}).has_value());
        CHECK(turned_scene(s.scene, axes_moved_on(), Vec3::Zero()).has_value());
    }
    for (const SceneKind& kind : mixed.kinds)
        CHECK_MESSAGE(drawn[kind.name] >= 12, kind.name);
}
