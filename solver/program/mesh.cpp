// amontons mesh info|surface|renumber|convert|generate: solids as meshes. (tetrahedralise is in
// tetrahedralise_command.cpp.)

#include "mesh/base/file.hpp"
#include "mesh/format/read.hpp"
#include "mesh/format/read_volume.hpp"
#include "mesh/generate/solid_box.hpp"
#include "mesh/generate/solid_round.hpp"
#include "mesh/generate/solid_tube.hpp"
#include "mesh/renumber.hpp"
#include "mesh/repair_surface.hpp"
#include "mesh/surface_check.hpp"
#include "mesh/volume_check.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/program/mesh_output.hpp"
#include "solver/program/session.hpp"
#include "solver/program/surface_info.hpp"
#include "solver/program/tetrahedralise_command.hpp"
#include "solver/scene/json_text.hpp"

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fmt/format.h>
#include <numbers>

namespace amontons {
namespace {

struct MeshArguments {
    std::string file, permutation;
    double scale = 1;
    double sliver = VolumeCheckOptions{}.sliver;
    std::vector<std::string> sets;
    bool repair = false;
    double holes = -1; ///< largest length of a hole that is closed [m]; < 0: chosen
    MeshOutput to;
};

VolumeFile read(const MeshArguments& a, Session& session)
{
    VolumeFile file = read_volume(a.file, a.scale);
    for (const std::string& note : file.notes)
        session.print_line("note: " + a.file + ": " + note);
    return file;
}

/// Output of a command that writes a mesh.
void report_written(const MeshArguments& a, const VolumeMesh& mesh,
                    const std::vector<std::string>& notes, Session& session)
{
    JsonText json;
    json.open('{').member("status", "done").member("output", a.to.file);
    add_counts(json, mesh);
    add_list(json, "notes", notes);
    if (session.json)
        session.print(json.close('}').text() + "\n");
    else
        session.print(fmt::format("{}: {}\n", a.to.file, counts_text(mesh)));
}

void write_and_report(const MeshArguments& a, const VolumeMesh& mesh,
                      std::vector<std::string> notes, Session& session)
{
    std::vector<std::string> renamed;
    write_mesh(a.to, mesh, renamed);
    for (const std::string& note : renamed)
        session.print_line("note: " + a.to.file + ": " + note);
    notes.insert(notes.end(), renamed.begin(), renamed.end());
    report_written(a, mesh, notes, session);
}

// ---- info --------------------------------------------------------------------------------

struct SpreadLine {
    const char* name;  // in JSON, SI
    const char* title; // for people
    const Spread* spread;
    double factor; // from SI to what people read
};

std::vector<SpreadLine> lines_of(const QualityReport& q)
{
    constexpr double degree = 180 / std::numbers::pi;
    return {{"volume", "volume [m^3]", &q.element_volume, 1},
            {"shape", "shape, 1 is best", &q.shape, 1},
            {"least_dihedral", "least dihedral angle [deg]", &q.least_dihedral, degree},
            {"greatest_dihedral", "greatest dihedral angle [deg]", &q.greatest_dihedral, degree},
            {"jacobian_ratio", "det J, least / greatest", &q.jacobian_ratio, 1},
            {"aspect", "longest / shortest edge", &q.aspect, 1},
            {"shortest_edge", "shortest edge [m]", &q.shortest_edge, 1},
            {"longest_edge", "longest edge [m]", &q.longest_edge, 1}};
}

double area_of(const VolumeMesh& mesh, const FaceSet& set)
{
    return integrate(surface_of(mesh, set.members), mesh).area;
}

std::string info_json(const VolumeFile& file, const VolumeReport& r,
                      const std::vector<Issue>& errors, const std::vector<Issue>& warnings)
{
    const VolumeMesh& mesh = file.mesh;
    const auto vector = [](JsonText& json, const char* name, const Vec3& x) {
        json.key(name).open('[').value(x[0]).value(x[1]).value(x[2]).close(']');
    };
    JsonText json;
    json.open('{').member("status", errors.empty() ? "ok" : "bad_input");
    add_counts(json, mesh);
    json.key("box").open('{');
    vector(json, "lowest", r.lowest);
    vector(json, "highest", r.highest);
    json.close('}').member("volume", r.quality.volume).key("surface").open('{');
    json.member("faces", static_cast<std::int64_t>(r.surface.faces.size()))
        .member("nodes", static_cast<std::int64_t>(r.surface.used_nodes.size()))
        .member("edges", r.surface_edges)
        .member("area", r.integrals.area)
        .member("volume", r.integrals.volume)
        .member("parts", r.surface_parts)
        .member("closed", r.surface_borders == 0)
        .member("euler_characteristic", r.euler_characteristic)
        .close('}');
    json.key("quality").open('{');
    for (const SpreadLine& line : lines_of(r.quality))
        json.key(line.name)
            .open('{')
            .member("least", line.spread->least)
            .member("median", line.spread->median)
            .member("greatest", line.spread->greatest)
            .close('}');
    json.member("inverted", static_cast<std::int64_t>(r.inverted.size()))
        .member("slivers", static_cast<std::int64_t>(r.slivers.size()))
        .member("sliver_threshold", r.options.sliver)
        .close('}');
    const auto sets = [&](const char* name, const auto& all, auto more) {
        json.key(name).open('[');
        for (const auto& set : all) {
            json.open('{').member("name", set.name);
            json.member("members", static_cast<std::int64_t>(set.members.size()));
            more(set);
            json.close('}');
        }
        json.close(']');
    };
    sets("node_sets", mesh.node_sets, [](const NodeSet&) {});
    sets("element_sets", mesh.element_sets, [](const ElementSet&) {});
    sets("face_sets", mesh.face_sets,
         [&](const FaceSet& set) { json.member("area", area_of(mesh, set)); });
    add_list(json, "notes", file.notes);
    write_issues(json, "warnings", warnings);
    write_issues(json, "issues", errors);
    return json.close('}').text() + "\n";
}

std::string info_text(const std::string& path, const VolumeMesh& mesh, const VolumeReport& r)
{
    std::string t = fmt::format("{}: {}\n", path, counts_text(mesh));
    t += fmt::format("  box      ({:g}, {:g}, {:g}) to ({:g}, {:g}, {:g}) m\n", r.lowest[0],
                     r.lowest[1], r.lowest[2], r.highest[0], r.highest[1], r.highest[2]);
    t += fmt::format("  volume   {:.6g} m^3\n", r.quality.volume);
    t += fmt::format("  surface  {:.6g} m^2, {} faces, {} nodes, {} {}, {}\n", r.integrals.area,
                     r.surface.faces.size(), r.surface.used_nodes.size(), r.surface_parts,
                     r.surface_parts == 1 ? "part" : "parts",
                     r.surface_borders == 0 ? "closed" : "open");
    t +=
        fmt::format("\n  {:<30} {:>11} {:>11} {:>11}\n", "elements", "least", "median", "greatest");
    for (const SpreadLine& line : lines_of(r.quality))
        t += fmt::format("  {:<30} {:>11.4g} {:>11.4g} {:>11.4g}\n", line.title,
                         line.factor * line.spread->least, line.factor * line.spread->median,
                         line.factor * line.spread->greatest);
    t += fmt::format("  {} inverted, {} slivers (shape below {:g})\n", r.inverted.size(),
                     r.slivers.size(), r.options.sliver);
    if (!mesh.element_sets.empty() || !mesh.face_sets.empty() || !mesh.node_sets.empty())
        t += "\n  sets\n";
    for (const ElementSet& s : mesh.element_sets)
        t += fmt::format("  {:<24} {} elements\n", s.name, s.members.size());
    for (const FaceSet& s : mesh.face_sets)
        t += fmt::format("  {:<24} {} faces, {:.6g} m^2\n", s.name, s.members.size(),
                         area_of(mesh, s));
    for (const NodeSet& s : mesh.node_sets)
        t += fmt::format("  {:<24} {} nodes\n", s.name, s.members.size());
    return t;
}

void info(const MeshArguments& a, Session& session)
{
    if (is_surface_file(a.file)) return surface_info(a.file, a.scale, session);
    const VolumeFile file = read(a, session);
    VolumeCheckOptions options;
    options.sliver = a.sliver;
    const VolumeReport report = check_volume(file.mesh, options);
    const std::vector<Issue> errors = errors_of(report, file.mesh, a.file),
                             warnings = warnings_of(report, file.mesh, a.file);
    session.print(session.json ? info_json(file, report, errors, warnings)
                               : info_text(a.file, file.mesh, report));
    session.warn(warnings);
    for (const Issue& e : errors)
        session.error(InputError({e}).what());
    if (!errors.empty()) session.exit_code = kBadInput;
}

// ---- surface, renumber, convert ----------------------------------------------------------

/// A surface with what has one meaning only mended, and small holes closed.
void repair(const MeshArguments& a, Session& session)
{
    constexpr double kLongestHole = 0.01; // of the diagonal
    SurfaceMesh mesh = read_surface(a.file, a.scale, read_vtp);
    SurfaceRepair done = repair_surface(mesh);
    const double longest = a.holes >= 0 ? a.holes : kLongestHole * check_surface(mesh).diagonal;
    if (longest > 0)
        done.closed_holes = close_holes(
            mesh, [&](const BoundaryLoop& hole) { return is_small_hole(hole, longest); });
    write_surface(a.to.file, mesh);
    const SurfaceReport report = check_surface(mesh);
    std::vector<std::string> left;
    for (const BoundaryLoop& hole : report.boundaries)
        left.push_back(fmt::format("hole of {} edges, {:.4g} m around ({:.4g}, {:.4g}, {:.4g})",
                                   hole.vertices.size(), hole.length, hole.centre.x(),
                                   hole.centre.y(), hole.centre.z()));
    SurfaceRequirements all;
    const std::vector<Issue> faults = issues(report, mesh, all, a.to.file);
    for (const std::string& sentence : sentences(done))
        session.print_line(sentence);
    session.warn(faults);
    if (!session.json) {
        session.print(fmt::format("{}: {} triangles, {} points, {}, {:.6g} m^3\n", a.to.file,
                                  mesh.triangles.size(), mesh.points.size(),
                                  report.closed() ? "closed" : "open", report.enclosed_volume));
        for (const std::string& hole : left)
            session.print("  left open: " + hole + "\n");
        return;
    }
    JsonText json;
    json.open('{').member("status", "done").member("output", a.to.file);
    json.member("triangles", report.triangles)
        .member("points", report.vertices)
        .member("closed", report.closed())
        .member("volume", report.enclosed_volume)
        .member("closed_holes", done.closed_holes);
    add_list(json, "repaired", sentences(done));
    add_list(json, "left_open", left);
    write_issues(json, "faults", faults);
    session.print(json.close('}').text() + "\n");
}

void surface(const MeshArguments& a, Session& session)
{
    if (a.repair) return repair(a, session);
    const VolumeFile file = read(a, session);
    const VolumeMesh& mesh = file.mesh;
    ExternalSurface outside;
    if (a.sets.empty()) {
        outside = extract_surface(mesh);
    } else {
        std::vector<std::string> names;
        for (const FaceSet& set : mesh.face_sets)
            names.push_back(set.name);
        std::vector<FaceRef> faces;
        std::vector<Issue> issues;
        for (const std::string& name : a.sets) {
            if (const FaceSet* set = find_set(mesh.face_sets, name)) {
                faces.insert(faces.end(), set->members.begin(), set->members.end());
                continue;
            }
            std::string all;
            for (const std::string& n : names)
                all += (all.empty() ? "" : ", ") + quoted_text(n);
            issues.push_back({a.file, "--set", "no face set " + quoted_text(name),
                              all.empty() ? "no face set is there" : all});
        }
        if (!issues.empty()) throw InputError(std::move(issues));
        std::sort(faces.begin(), faces.end());
        faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
        outside = surface_of(mesh, faces);
    }
    const TriangulatedSurface flat = triangulate(outside, mesh);
    write_surface(a.to.file, flat.mesh);
    const SurfaceEdges edges = find_edges(outside, mesh.nodes);
    const double area = integrate(outside, mesh).area;
    if (!session.json) {
        session.print(fmt::format("{}: {} triangles, {} points, {:.6g} m^2\n", a.to.file,
                                  flat.mesh.triangles.size(), flat.mesh.points.size(), area));
        return;
    }
    JsonText json;
    json.open('{').member("status", "done").member("output", a.to.file);
    json.member("faces", static_cast<std::int64_t>(outside.faces.size()))
        .member("triangles", static_cast<std::int64_t>(flat.mesh.triangles.size()))
        .member("nodes", static_cast<std::int64_t>(outside.used_nodes.size()))
        .member("area", area)
        .member("parts", edges.parts)
        .member("closed", edges.borders == 0);
    add_list(json, "notes", file.notes);
    session.print(json.close('}').text() + "\n");
}

void renumber(const MeshArguments& a, Session& session)
{
    namespace fs = std::filesystem;
    std::error_code ignored;
    const auto same = [&](const std::string& mesh) {
        const auto whole = [&](const std::string& file) {
            return fs::weakly_canonical(fs::absolute(file, ignored), ignored);
        };
        const fs::path other = whole(a.permutation);
        return whole(mesh) == other ||
               (mesh.ends_with(".nodes") && whole(elements_path(mesh)) == other);
    };
    for (const std::string& mesh : {a.file, a.to.file})
        if (!a.permutation.empty() && same(mesh))
            throw InputError(
                {{"(--permutation)", "", quoted_text(a.permutation, 200) + ", a mesh's file",
                  "another file than those of the meshes"}});
    const VolumeFile file = read(a, session);
    const Renumbering order = nested_dissection(file.mesh);
    if (!a.permutation.empty()) {
        std::string text = "# new_node,old_node (from 0)\n";
        for (std::size_t i = 0; i < order.old_node.size(); ++i)
            text += fmt::format("{},{}\n", i, order.old_node[i]);
        write_file(a.permutation, text);
    }
    write_and_report(a, renumbered(file.mesh, order), file.notes, session);
}

void convert(const MeshArguments& a, Session& session)
{
    const VolumeFile file = read(a, session);
    write_and_report(a, file.mesh, file.notes, session);
}

// ---- generate ----------------------------------------------------------------------------

struct GenerateArguments {
    SolidBoxOptions box;
    SolidBallOptions ball;
    SolidCylinderOptions cylinder;
    std::string kind = "T10";
    std::vector<double> size{1, 1, 1}, origin{0, 0, 0}, axis{0, 0, 1}, grading{1, 1, 1};
    std::vector<std::int32_t> cells{1, 1, 1};
    std::int32_t across = 8, along = 20, around = 24, through = 2;
    double radius = 0, length = 0, thickness = 0;
    std::string centreline;
};

Vec3 vector_of(const std::vector<double>& v)
{
    return {v[0], v[1], v[2]};
}

ElementKind element_kind(const std::string& name)
{
    return name == "T4" ? ElementKind::T4 : name == "T10" ? ElementKind::T10 : ElementKind::H8;
}

VolumeMesh make_box(const GenerateArguments& g)
{
    const Vec3 origin = vector_of(g.origin);
    SolidBoxOptions o{origin, origin + vector_of(g.size), {}, {}, element_kind(g.kind)};
    std::copy(g.cells.begin(), g.cells.end(), o.cells.begin());
    std::copy(g.grading.begin(), g.grading.end(), o.grading.begin());
    return make_solid_box(o);
}

VolumeMesh make_ball(const GenerateArguments& g)
{
    return make_solid_ball({vector_of(g.origin), g.radius, g.across, element_kind(g.kind)});
}

VolumeMesh make_cylinder(const GenerateArguments& g)
{
    return make_solid_cylinder({vector_of(g.origin), vector_of(g.axis), g.radius, g.length,
                                g.across, g.along, element_kind(g.kind)});
}

VolumeMesh make_tube(const GenerateArguments& g, double scale)
{
    const auto build = [&](const Centreline& line) {
        return make_solid_tube(
            {line, g.thickness, g.around, g.through, g.along, element_kind(g.kind)});
    };
    std::vector<Issue> issues;
    if (g.centreline.empty() == (g.length == 0))
        issues.push_back({"amontons mesh generate tube", "",
                          g.centreline.empty() ? "no --length" : "--length and --centreline",
                          "one of --length and --centreline"});
    if (g.centreline.empty()) {
        if (!(g.radius > 0)) issues.push_back({"", "/radius", number_text(g.radius), "> 0 [m]"});
        if (!(g.length > 0)) issues.push_back({"", "/length", number_text(g.length), "> 0 [m]"});
        if (!issues.empty()) throw InputError(std::move(issues));
        const Vec3 axis = vector_of(g.axis);
        Centreline line(vector_of(g.origin), axis, Vec3(axis[1], axis[2], axis[0]) + Vec3::UnitX(),
                        g.radius);
        line.append_line(g.length, g.radius);
        return build(line);
    }
    Polyline points = read_centreline(g.centreline, scale);
    if (g.radius > 0) points.radius.assign(points.points.size(), g.radius);
    if (points.radius.empty())
        issues.push_back(
            {g.centreline, "", "points without a radius", "--radius, or a column of it"});
    if (!issues.empty()) throw InputError(std::move(issues));
    return build(make_spline(points.points, points.radius));
}

// ---- the commands ------------------------------------------------------------------------

using Shared = std::shared_ptr<MeshArguments>;

void add_file(CLI::App& command, const Shared& a, Session& session)
{
    command.add_option("FILE", a->file, "Mesh of solids: .msh .vtu .inp .nodes")->required();
    command.add_option("--scale", a->scale, "Metres per unit of the file, 0.001 for millimetres");
    command.add_flag("--json", session.json, "One JSON object on stdout");
}

void add_generator(CLI::App& generate, const char* name, const char* text, Session& session,
                   const std::function<void(CLI::App&, GenerateArguments&)>& add_options,
                   const std::function<VolumeMesh(const GenerateArguments&, double)>& make)
{
    const auto a = std::make_shared<MeshArguments>();
    const auto g = std::make_shared<GenerateArguments>();
    CLI::App* command = generate.add_subcommand(name, text);
    add_options(*command, *g);
    command->add_option("--element", g->kind, "T4, T10 (default) or H8")
        ->check(CLI::IsMember({"T4", "T10", "H8"}));
    command->add_option("--scale", a->scale, "Metres per unit of the numbers and the centreline");
    add_output(*command, a->to, "--output,-o");
    command->add_flag("--json", session.json, "One JSON object on stdout");
    command->callback([a, g, make, name, &session] {
        const std::string who = std::string("amontons mesh generate ") + name;
        if (!(a->scale > 0)) throw InputError({{who, "/scale", number_text(a->scale), "> 0"}});
        for (double* length : {&g->radius, &g->length, &g->thickness})
            *length *= a->scale;
        for (std::vector<double>* lengths : {&g->size, &g->origin})
            for (double& x : *lengths)
                x *= a->scale;
        VolumeMesh made;
        try {
            made = make(*g, a->scale);
        } catch (const InputError& error) { // numbers of the command line, or of a file
            std::vector<Issue> issues = error.issues();
            for (Issue& i : issues)
                if (i.file.empty()) i.file = who;
            throw InputError(std::move(issues));
        }
        write_and_report(*a, made, {}, session);
    });
}

void add_generators(CLI::App& generate, Session& session)
{
    generate.require_subcommand(1);
    const auto three = [](CLI::App& c, const char* name, std::vector<double>& to,
                          const char* text) {
        c.add_option(name, to, text)->delimiter(',')->expected(3)->type_name("X,Y,Z");
    };
    add_generator(
        generate, "box", "A block; face sets x_min, x_max, ..., z_max", session,
        [&](CLI::App& c, GenerateArguments& g) {
            three(c, "--size", g.size, "Lengths of the sides [m]");
            three(c, "--origin", g.origin, "Its lowest corner [m]");
            c.add_option("--cells", g.cells, "Along each axis")
                ->delimiter(',')
                ->expected(3)
                ->type_name("N,M,K");
            three(c, "--grading", g.grading, "Last cell / first cell along each axis");
        },
        [](const GenerateArguments& g, double) { return make_box(g); });
    add_generator(
        generate, "ball", "A full ball; face set outer", session,
        [&](CLI::App& c, GenerateArguments& g) {
            c.add_option("--radius", g.radius, "[m]")->required();
            three(c, "--centre", g.origin, "[m]");
            c.add_option("--cells", g.across, "About this many along a diameter");
        },
        [](const GenerateArguments& g, double) { return make_ball(g); });
    add_generator(
        generate, "cylinder", "A full cylinder; face sets start, end, outer", session,
        [&](CLI::App& c, GenerateArguments& g) {
            c.add_option("--radius", g.radius, "[m]")->required();
            c.add_option("--length", g.length, "[m]")->required();
            three(c, "--start", g.origin, "Centre of one end [m]");
            three(c, "--axis", g.axis, "Direction");
            c.add_option("--cells", g.across, "About this many along a diameter");
            c.add_option("--along", g.along, "Elements along the axis");
        },
        [](const GenerateArguments& g, double) { return make_cylinder(g); });
    add_generator(
        generate, "tube", "The wall of a vessel; face sets inner, outer, start, end", session,
        [&](CLI::App& c, GenerateArguments& g) {
            c.add_option("--radius", g.radius, "Inner radius [m]");
            c.add_option("--thickness", g.thickness, "Of the wall [m]")->required();
            c.add_option("--length", g.length, "Of a straight tube [m]");
            c.add_option("--centreline", g.centreline, "Of a bent tube: .csv or .mrk.json");
            three(c, "--start", g.origin, "Centre of the start of a straight tube [m]");
            three(c, "--axis", g.axis, "Direction of a straight tube");
            c.add_option("--around", g.around, "Elements along the circumference");
            c.add_option("--through", g.through, "Through the wall");
            c.add_option("--along", g.along, "Along the centreline");
        },
        make_tube);
}

} // namespace

void add_mesh(CLI::App& program, Session& session)
{
    CLI::App* mesh = program.add_subcommand("mesh", "Check, convert and make meshes of solids");
    mesh->require_subcommand(1);
    const auto add = [&](const char* name, const char* text, auto run) {
        CLI::App* command = mesh->add_subcommand(name, text);
        const auto a = std::make_shared<MeshArguments>();
        add_file(*command, a, session);
        command->callback([a, run, &session] { run(*a, session); });
        return std::pair{command, a};
    };
    const auto [of_info, a_info] =
        add("info",
            "Counts, sizes, quality and sets of a mesh, of a surface its side and openings; "
            "everything that is wrong with it",
            info);
    of_info->add_option("--sliver", a_info->sliver, "Shape below which an element is a sliver");

    const auto [of_surface, a_surface] = add(
        "surface", "The outside of solids as triangles; --repair: a surface made whole", surface);
    of_surface->add_option("--output,-o", a_surface->to.file, "Surface to write: .stl .ply .obj")
        ->type_name("FILE")
        ->required();
    const auto set =
        of_surface->add_option("--set", a_surface->sets, "Only these face sets")->type_name("NAME");
    const auto mend =
        of_surface
            ->add_flag("--repair", a_surface->repair,
                       "FILE is a surface (.stl .obj .ply .vtp): merge vertices, leave out "
                       "triangles without area and those that are there twice, turn those that "
                       "face the wrong side, close small holes")
            ->excludes(set);
    of_surface
        ->add_option("--holes", a_surface->holes,
                     "Longest border of a hole that is closed [m]; 0: none, default a hundredth of "
                     "the diagonal. Holes of at most four edges are closed with any.")
        ->check(CLI::NonNegativeNumber)
        ->type_name("LENGTH")
        ->needs(mend);

    const auto [of_renumber, a_renumber] =
        add("renumber", "Nodes in an order that keeps a sparse factor small", renumber);
    add_output(*of_renumber, a_renumber->to, "--output,-o");
    of_renumber->add_option("--permutation", a_renumber->permutation, "CSV of new and old numbers")
        ->type_name("FILE");

    const auto [of_convert, a_convert] =
        add("convert", "The same mesh, with its sets, in another format", convert);
    add_output(*of_convert, a_convert->to, "--output,-o");

    add_generators(*mesh->add_subcommand("generate", "A named solid"), session);
    add_tetrahedralise(*mesh, session);
}

} // namespace amontons
