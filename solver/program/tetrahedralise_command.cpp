#include "solver/program/tetrahedralise_command.hpp"

#include "mesh/format/read.hpp"
#include "mesh/quality.hpp"
#include "mesh/repair_surface.hpp"
#include "mesh/size_check.hpp"
#include "mesh/size_field.hpp"
#include "solver/program/mesh_output.hpp"
#include "solver/program/session.hpp"
#include "solver/scene/json_text.hpp"
#include "solver/tetrahedralise.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <new>
#include <numbers>
#include <sys/resource.h>

namespace amontons {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kProgram = 1.2e9; // addresses that the program and its libraries take [bytes]
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

struct Arguments {
    std::string file, field, small = "refuse", element = "T10";
    double scale = 1, feature_angle = 45, memory = 0;
    std::vector<double> near; ///< x, y, z, size; again and again
    TetrahedraliseOptions options;
    MeshOutput to;
};

/// While it lives, the program may not take more address space: what was predicted too low then
/// ends in a message, not in the machine's trouble.
class MemoryLimit {
public:
    explicit MemoryLimit(double bytes)
    {
        ::getrlimit(RLIMIT_AS, &before_);
        if (kSanitized) return; // takes terabytes of addresses
        rlimit limit = before_;
        limit.rlim_cur = std::min(limit.rlim_cur, static_cast<rlim_t>(bytes));
        ::setrlimit(RLIMIT_AS, &limit);
    }
    ~MemoryLimit() { ::setrlimit(RLIMIT_AS, &before_); }
    MemoryLimit(const MemoryLimit&) = delete;
    MemoryLimit& operator=(const MemoryLimit&) = delete;

private:
    rlimit before_{};
};

TetrahedraliseOptions options_of(const Arguments& a)
{
    TetrahedraliseOptions o = a.options;
    o.feature_angle = a.feature_angle * kDegree;
    o.refine_small = a.small == "refine";
    o.kind = a.element == "T4" ? ElementKind::T4 : ElementKind::T10;
    o.memory = a.memory * 1e9;
    for (std::size_t i = 0; i + 3 < a.near.size(); i += 4)
        o.sources.push_back({Vec3(a.near[i], a.near[i + 1], a.near[i + 2]), a.near[i + 3]});
    check_options(o); // as they were written
    o.size *= a.scale;
    o.deviation *= a.scale;
    o.repair *= a.scale;
    for (SizeSource& s : o.sources)
        s = {a.scale * s.at, a.scale * s.size};
    if (!a.field.empty())
        for (const SizeSource& s : read_size_field(a.field, a.scale))
            o.sources.push_back(s);
    return o;
}

void print_made(const Arguments& a, const Tetrahedralised& t, const std::vector<std::string>& notes,
                Session& session)
{
    const QualityReport q = report_of(measure_quality(t.mesh));
    if (!session.json) {
        session.print(fmt::format(
            "{}: {}\n"
            "  smallest dihedral angle {:.1f} degrees, no inverted element; volume {:.6g} m^3\n"
            "  the surface's vertices are within {:.3g} m of it, the middles of its faces within "
            "{:.3g} m of the surface; {} face sets, {} edges kept\n"
            "  meshed in {:.2f} s\n",
            a.to.file, counts_text(t.mesh), t.least_dihedral / kDegree, q.volume, t.deviation,
            t.face_deviation, t.mesh.face_sets.size(), t.feature_edges, t.seconds));
        return;
    }
    JsonText json;
    json.open('{').member("status", "done").member("output", a.to.file);
    add_counts(json, t.mesh);
    json.key("quality")
        .open('{')
        .member("least_dihedral", t.least_dihedral)
        .member("greatest_dihedral", q.greatest_dihedral.greatest)
        .member("inverted", 0)
        .member("volume", q.volume)
        .member("shortest_edge", q.shortest_edge.least)
        .member("median_edge", q.longest_edge.median)
        .member("longest_edge", q.longest_edge.greatest)
        .close('}');
    json.key("predicted")
        .open('{')
        .member("elements", t.predicted_elements)
        .member("memory", t.predicted_memory)
        .close('}');
    json.member("deviation", t.deviation)
        .member("face_deviation", t.face_deviation)
        .member("face_sets", static_cast<std::int64_t>(t.mesh.face_sets.size()))
        .member("feature_edges", t.feature_edges)
        .member("seconds", t.seconds);
    rusage used{};
    ::getrusage(RUSAGE_SELF, &used);
    json.member("peak_memory", 1024. * static_cast<double>(used.ru_maxrss));
    add_list(json, "notes", notes);
    session.print(json.close('}').text() + "\n");
}

void run_tetrahedralise(const Arguments& a, Session& session)
{
    check_output(a.to);
    const TetrahedraliseOptions options = options_of(a);
    std::int64_t merged = 0;
    SurfaceMesh surface = read_surface(a.file, a.scale, {}, &merged);
    SurfaceRepair done;
    done.merged = merged;
    std::vector<std::string> notes = sentences(done);
    session.warn(size_warnings(surface.points, a.file));
    const auto print_notes = [&] {
        for (const std::string& note : notes)
            session.print_line("note: " + a.file + ": " + note);
    };
    Tetrahedralised made;
    try {
        const MemoryLimit limit(kProgram + memory_limit(options));
        made = tetrahedralise(std::move(surface), options, a.file, notes);
    } catch (const std::bad_alloc&) {
        print_notes();
        throw InputError({{a.file, "", "more memory was needed than predicted, or is there",
                           "a larger --size or --deviation, or more --memory"}});
    } catch (const InputError&) {
        print_notes();
        throw;
    }
    write_mesh(a.to, made.mesh, notes);
    print_notes();
    print_made(a, made, notes, session);
}

} // namespace

void add_tetrahedralise(CLI::App& mesh, Session& session)
{
    CLI::App* c = mesh.add_subcommand(
        "tetrahedralise", "Fill a closed surface with tetrahedra (needs the module cgal)");
    const auto a = std::make_shared<Arguments>();
    c->add_option("FILE", a->file, "Surface: .stl .obj .ply")->required();
    add_output(*c, a->to, "OUTPUT,--output,-o");
    c->add_option("--size", a->options.size, "Longest edge of an element, in the file's unit")
        ->required();
    c->add_option("--size-at", a->near, "A place and the edge length there; may be given again")
        ->delimiter(',')
        ->type_size(4)
        ->expected(1, 1000)
        ->type_name("X,Y,Z,SIZE");
    c->add_option("--size-field", a->field,
                  "Places with an edge length each: .csv with columns x, y, z, size, or a "
                  "centreline with its radius")
        ->type_name("FILE");
    c->add_option("--gradation", a->options.gradation,
                  "Growth of the edge length with the distance from such a place");
    c->add_option("--feature-angle", a->feature_angle,
                  "Edges whose normals differ by more degrees are kept");
    c->add_option("--deviation", a->options.deviation,
                  "Of the mesh's faces from the surface; default: a twentieth of the size");
    c->add_option("--small-features", a->small,
                  "What is smaller than the size: refuse, or refine down to it")
        ->check(CLI::IsMember({"refuse", "refine"}));
    c->add_flag("--close-holes", a->options.close_holes, "Fill the holes of an open surface");
    c->add_option("--repair", a->options.repair,
                  "Leave out what is thinner and fill what is narrower than this, round the edges: "
                  "for surfaces that fold back or pass through themselves")
        ->type_name("WIDTH");
    c->add_option("--element", a->element, "T10 (default) or T4")
        ->check(CLI::IsMember({"T4", "T10"}));
    c->add_option("--memory", a->memory, "Limit [GB]; default: half of the machine's");
    c->add_option("--scale", a->scale, "Metres per unit of the file, 0.001 for millimetres");
    c->add_flag("--json", session.json, "One JSON object on stdout");
    c->callback([a, &session] { run_tetrahedralise(*a, session); });
}

} // namespace amontons
