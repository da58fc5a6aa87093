#include "solver/scene/fields.hpp"

#include "solver/scene/body_fields.hpp"
#include "solver/scene/declare.hpp"
#include "solver/scene/haptic_fields.hpp"
#include "solver/scene/instruments.hpp"
#include "solver/scene/rod_fields.hpp"
#include "solver/scene/segment_fields.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <numbers>

namespace amontons {
namespace {

using namespace declare;

// --- The declarations, innermost first. ---

ObjectDeclaration declare_piece()
{
    using P = CentrelinePiece;
    return {"Piece of a centreline",
            {field<&P::length>("length", "m", at_least(0), "Length of a straight piece."),
             field<&P::radius>("radius", "m", at_least(0), "Radius of an arc."),
             field<&P::angle>("angle", "rad", at_least(0), "Angle of an arc."),
             field<&P::direction>("direction", "rad", kAny,
                                  "Turns the plane of an arc about the tangent; 0 bends towards "
                                  "`normal`, carried along the curve without twist.")},
            "",
            {},
            defaults_of<P>()};
}

ObjectDeclaration declare_centreline(const ObjectDeclaration& piece)
{
    using C = CentrelineInput;
    ObjectDeclaration d{
        "Centreline",
        {long_text<&C::file>("file", "CSV with columns x, y, z and possibly radius, or a 3D Slicer "
                                     "curve (.mrk.json); beside the scene."),
         fallback(
             "1e-3 for .mrk.json, else 1",
             field<&C::scale>("scale", "m", positive(), "Metres per unit of length of the file.")),
         no_fewer(
             1, list<&C::pieces>("pieces", piece, "Straight pieces and arcs, instead of a file.")),
         field<&C::start>("start", "m", kAny, "Start of the first piece."),
         field<&C::direction>("direction", "", direction(), "Direction of the first piece."),
         field<&C::normal>("normal", "", direction(), "Arcs of direction 0 bend this way.")},
        "",
        {},
        defaults_of<C>()};
    d.shorthand = "file";
    return d;
}

ObjectDeclaration declare_branch()
{
    using B = BranchInput;
    return {"Branch of a vessel",
            {required(text<&B::name>("name", "Name, as it is reported when the wire enters it.")),
             required(field<&B::at>("at", "m", at_least(0),
                                    "Where it leaves: distance before the end of the arch.")),
             required(field<&B::diameter>("diameter", "m", positive(), "At its root and its end.")),
             required(field<&B::length>("length", "m", positive(), "Length.")),
             fallback("pi/2", field<&B::angle>(
                                  "angle", "rad", above(0, std::numbers::pi),
                                  "Take-off angle from the arch's tangent towards its start."))},
            "",
            {},
            defaults_of<B>()};
}

ObjectDeclaration declare_named_branch(const ObjectDeclaration& centreline)
{
    using B = NamedBranchInput;
    return {
        "Named part of a vessel: one of centreline, ball, box",
        {required(text<&B::name>("name", "Name, as it is reported when the wire enters it.")),
         object<&B::centreline>(
             "centreline", centreline,
             "What lies around it, as far as its radius (without one, as the wall is there) and "
             "a third more, or up to the wall of a flat lumen, 2.5 radii at most; and is not "
             "around another branch's as well."),
         object<&B::ball>("ball", declare_ball(),
                          "A wire whose tip was in it is in the branch "
                          "until it comes back, or into another one."),
         object<&B::box>("box", declare_box(), "As ball.")},
        "",
        {},
        defaults_of<B>()};
}

ObjectDeclaration declare_surface(const ObjectDeclaration& centreline,
                                  const ObjectDeclaration& branch,
                                  const ObjectDeclaration& named_branch)
{
    using S = SurfaceInput;
    const FieldDeclaration resolution = fallback(
        "chosen from the size",
        field<&S::resolution>("resolution", "m", at_least(0), "Edge of the triangles; 0: chosen."));
    const FieldDeclaration centre = field<&S::centre>("centre", "m", kAny, "Centre.");
    const FieldDeclaration axis = field<&S::axis>("axis", "", direction(), "Axis.");
    const FieldDeclaration branches = list<&S::named_branches>(
        "branches", named_branch, "Parts of a vessel that the quantity `branch` names.");
    ObjectDeclaration d;
    d.title = "Surface";
    d.discriminator = "generate";
    d.defaults = defaults_of<S>();
    d.chosen = [](void* surface) -> std::string& { return static_cast<S*>(surface)->generate; };
    d.variants = {
        {"",
         "A triangle surface from a file.",
         {required(long_text<&S::file>("file", "STL, OBJ, PLY or VTP; beside the scene.")),
          or_one(
              field<&S::scale>("scale", "m", positive(),
                               "Metres per unit of length of the file; three numbers: along x, y, "
                               "z.")),
          branches}},
        {"tube",
         "A tube swept along a centreline.",
         {required(object<&S::centreline>("centreline", centreline, "The middle of the tube.")),
          fallback("the centreline's own",
                   field<&S::radius>("radius", "m", positive(), "Radius of the tube.")),
          branches, resolution}},
        {"vessel",
         "An aortic arch: a straight descending part from `centre` along `axis`, an arch, an "
         "ascending part closed by a half sphere, and branches on the outer side of the arch.",
         {field<&S::centre>("centre", "m", kAny, "Middle of the open inlet."),
          field<&S::axis>("axis", "", direction(), "From the inlet along the descending part."),
          field<&S::arch_towards>("arch_towards", "", direction(), "The arch bends this way."),
          required(field<&S::descending_length>("descending_length", "m", positive(), "Length.")),
          required(field<&S::descending_diameter>("descending_diameter", "m", positive(),
                                                  "At the inlet and where the arch begins.")),
          required(field<&S::arch_radius>("arch_radius", "m", positive(),
                                          "Radius of the arch's centreline.")),
          field<&S::arch_angle>("arch_angle", "rad", above(0, 2 * std::numbers::pi),
                                "Angle of the arch."),
          required(field<&S::arch_diameter>("arch_diameter", "m", positive(),
                                            "At the start and the end of the arch.")),
          required(field<&S::ascending_length>("ascending_length", "m", positive(), "Length.")),
          required(field<&S::ascending_diameter>("ascending_diameter", "m", positive(),
                                                 "Of the ascending part.")),
          list<&S::branches>("branches", branch, "Side vessels of the arch."),
          field<&S::blend>("blend", "m", positive(), "Radius of the blend between vessels."),
          resolution}},
        {"ball",
         "A ball.",
         {centre, required(field<&S::radius>("radius", "m", positive(), "Radius.")), resolution}},
        {"cylinder",
         "An endless cylinder.",
         {centre, axis, required(field<&S::radius>("radius", "m", positive(), "Radius.")),
          resolution}},
        {"plane",
         "A plane; the free space is where its normal points.",
         {field<&S::centre>("centre", "m", kAny, "A point of the plane."),
          field<&S::axis>("axis", "", direction(), "Its normal."), resolution}}};
    return d;
}

ObjectDeclaration declare_place()
{
    using P = IntroducerPlace;
    return {"Place of an introducer on a centreline; depth is then measured along it as well",
            {required(long_text<&P::file>("file", "CSV with columns x, y, z, or a 3D Slicer curve "
                                                  "(.mrk.json); beside the scene.")),
             fallback("1e-3 for .mrk.json, else 1",
                      field<&P::scale>("scale", "m", positive(),
                                       "Metres per unit of length of the file.")),
             field<&P::along>("along", "m", at_least(0), "Distance from the centreline's start."),
             field<&P::reverse>("reverse", "", {}, "Start at the centreline's last point.")},
            "",
            {},
            defaults_of<P>(),
            nullptr,
            nullptr,
            "file"};
}

ObjectDeclaration declare_introducer(const ObjectDeclaration& place)
{
    using I = IntroducerInput;
    ObjectDeclaration d{
        "Introducer: a straight frictionless sheath that holds the wire still outside",
        {replaced_by({"centreline", "branch"},
                     fallback("[0,0,0]", field<&I::at>("at", "m", kAny,
                                                       "Its end, where the wire comes out."))),
         replaced_by({"centreline", "branch"},
                     fallback("[1,0,0]", field<&I::direction>("direction", "", direction(),
                                                              "Direction of the wire."))),
         fallback("chosen", field<&I::normal>("normal", "", direction(),
                                              "Curvature of angle 0 bends this way.")),
         object<&I::centreline>("centreline", place, "Instead of \"at\" and \"direction\"."),
         text<&I::branch>("branch", "Instead: a branch of an obstacle, by whose end the wire comes "
                                    "in along its centreline."),
         fallback(
             "start; of a branch end",
             choice({"start", "end"},
                    text<&I::end>("end", "Which end of the centreline the wire comes in by."))),
         fallback("the wire's length",
                  field<&I::length>("length", "m", positive(), "Length of the sheath.")),
         field<&I::fade>("fade", "m", at_least(0),
                         "The grip fades out over this length before the end; 0: a rigid end.")},
        "",
        {},
        defaults_of<I>()};
    d.complete = [](void* introducer, const std::function<bool(const char*)>& given) {
        static_cast<I*>(introducer)->at_given = given("at");
        static_cast<I*>(introducer)->direction_given = given("direction");
    };
    return d;
}

ObjectDeclaration declare_beam_drive()
{
    using B = BeamInput;
    return {"Drive of a beam's base",
            {required(field<&B::insertion>("insertion", "m", at_least(0),
                                           "Length of wire past the introducer's end over time.")),
             field<&B::twist>("twist", "rad", kAny, "Rotation of the base over time.")},
            "",
            {},
            defaults_of<B>()};
}

ObjectDeclaration declare_tip_hold()
{
    using H = TipHoldInput;
    return optional_object<H>(
        "What holds the tip of a wire",
        {field<&H::x>("x", "m", kAny, "Displacement from where the tip begins, over time."),
         field<&H::y>("y", "m", kAny, "The same along y."),
         field<&H::z>("z", "m", kAny, "The same along z."),
         choice({"free", "held"},
                text<&H::turns>("turns", "Whether its cross-section is held as it begins: the "
                                         "wire's direction there, and its turn about it."))});
}

ObjectDeclaration declare_tip()
{
    using T = TipInput;
    const auto own = [](FieldDeclaration f) { return fallback("the shape's", std::move(f)); };
    return {"Tip of an instrument, other than its own",
            {fallback("the instrument's",
                      choice({"straight", "J", "angled", "pigtail"},
                             text<&T::shape>("shape", "J: 72 degrees at 12.1 mm; angled: 45 at 5 "
                                                      "mm and 5 mm straight; pigtail: 315 at 5 "
                                                      "mm."))),
             own(field<&T::radius>("radius", "m", positive(), "Radius of the bend.")),
             own(field<&T::angle>("angle", "rad", positive(), "Angle of the bend.")),
             own(field<&T::length>("length", "m", positive(), "Straight beyond the bend."))},
            "",
            {},
            defaults_of<T>()};
}

std::vector<std::string> instrument_names()
{
    std::vector<std::string> names;
    for (const Instrument& i : instruments())
        names.push_back(i.name);
    return names;
}

ObjectDeclaration declare_bodies(const ObjectDeclaration& surface, const ObjectDeclaration& segment,
                                 const ObjectDeclaration& tip, const ObjectDeclaration& introducer,
                                 const ObjectDeclaration& drive,
                                 const ObjectDeclaration& centreline)
{
    using O = ObstacleInput;
    using B = BeamInput;
    static const ObjectDeclaration tip_hold = declare_tip_hold();
    ObjectDeclaration d;
    d.title = "Body";
    d.discriminator = "kind";
    d.variants = {
        {"obstacle",
         "A rigid body at rest.",
         {required(object<&O::surface>("surface", surface, "Its surface.")),
          fallback("from the sign of the enclosed volume",
                   choice({"inside", "outside"},
                          text<&O::side>("side", "Where the free space is; an open surface from "
                                                 "a file needs it.")))},
         &append_body<&Scene::obstacles>,
         &find_body<&Scene::obstacles>},
        {"beam",
         "A wire or a cable, pushed and turned at its base.",
         {list<&B::segments>("segments", segment, "From the base towards the tip."),
          fallback("none: its segments",
                   choice(instrument_names(),
                          text<&B::instrument>("instrument", "One of the library, instead of "
                                                             "segments."))),
          fallback("the instrument's", field<&B::length>("length", "m", positive(),
                                                         "Length of the instrument: its shaft "
                                                         "is made longer or shorter.")),
          fallback("the instrument's", field<&B::element>("element", "m", positive(),
                                                          "Length of the shaft's elements; "
                                                          "half of it in taper and tip.")),
          object<&B::tip>("tip", tip, "Another tip of the instrument."),
          object<&B::introducer>("introducer", introducer, "Where the wire comes from."),
          required(group("drive", drive, "How the base is moved.")),
          object<&B::hold>("hold", tip_hold, "What holds its tip; without it the tip is free."),
          fallback("none", field<&B::plane>("plane", "", direction(),
                                            "Normal of a plane that the wire is kept in.")),
          fallback("half the shortest element",
                   field<&B::contact_spacing>("contact_spacing", "m", at_least(0),
                                              "Distance of the contact points along the wire; 0: "
                                              "half the shortest element."))},
         &append_body<&Scene::beams>,
         &find_body<&Scene::beams>}};
    for (const VariantDeclaration& v : body_variants(centreline))
        d.variants.push_back(v);
    d.variants.push_back(rod_variant(segment, centreline));
    return d;
}

ObjectDeclaration declare_time()
{
    using T = TimeInput;
    return {
        "Time",
        {choice(
             {"quasi_static", "dynamic"},
             text<&T::kind>("kind", "Whether inertia counts; then each segment needs a density.")),
         required(field<&T::step>("step", "s", positive(), "Longest step.")),
         required(field<&T::end>("end", "s", positive(), "End of the run.")),
         fallback("step / 1024",
                  field<&T::smallest_step>(
                      "smallest_step", "s", at_least(0),
                      "A step is not halved below this. Where rods alone find no "
                      "balance at this length, they are followed to the one they snap to.")),
         fallback("steps in time",
                  field<&T::path>("path", "m", at_least(0),
                                  "A quasi-static rod alone: steps of about this length (root "
                                  "mean square over its nodes) along the path of its balances, "
                                  "past limit points; the time, which its loads and holds "
                                  "follow, may then fall.")),
         choice({"mean", "course"},
                text<&T::balance>(
                    "balance", "When a quasi-static step of wires is refused because the work at "
                               "their bases is neither stored nor rubbed away. \"mean\": it misses "
                               "more than 2 % of the work by the mean of the loads at both ends of "
                               "the step. \"course\": it misses more than loads can that run from "
                               "one of these to the other in whatever way without turning back; "
                               "steps may then be as long as contact allows, and a jump that sets "
                               "free less than the change of the loads times their ways is not "
                               "distinguished from a step.")),
         field<&T::damping>("damping", "1/s", at_least(0),
                            "Damping of beams proportional to the mass; dynamic only."),
         choice({"theta", "generalised_alpha"},
                text<&T::rule>("rule", "Dynamic steps of solids and rigid bodies: the rule "
                                       "of their smooth motion. Blows are Moreau's with "
                                       "either.")),
         field<&T::theta>("theta", "", between(0.5, 1),
                          "Of the rule \"theta\": 1 is implicit Euler, of first order, which damps "
                          "what moves; 0.5 the midpoint rule, of second order, which keeps the "
                          "energy of what is linear, joined or slides on rigid surfaces."),
         field<&T::spectral_radius>(
             "spectral_radius", "", between(0, 1),
             "Of the rule \"generalised_alpha\", which is of second order: what a step leaves "
             "of the highest frequencies; 1 keeps them, 0 leaves none.")},
        "",
        {},
        defaults_of<T>()};
}

ObjectDeclaration declare_accuracy()
{
    using A = AccuracyInput;
    return {"Accuracy",
            {field<&A::contact>("contact", "", between(1e-16, 0.1),
                                "Relative error of forces and gaps at the end of a step."),
             choice({"auto", "nsgs", "anderson", "uzawa", "newton", "path"},
                    text<&A::solver>("solver", "Of the contact problems of solids and rigid "
                                               "bodies."))},
            "",
            {},
            defaults_of<A>()};
}

ObjectDeclaration declare_solver()
{
    using S = SolverInput;
    return {"Solver",
            {choice({"auto", "direct", "iterative", "distributed"},
                    text<&S::linear>("linear", "How the linear systems of solids are solved: by a "
                                               "factor, by iterations on this machine, or on all "
                                               "ranks of mpirun. `amontons check` states what each "
                                               "would cost and which is taken."))},
            "",
            {},
            defaults_of<S>()};
}

ObjectDeclaration declare_contact_solver()
{
    using S = ContactSolverInput;
    return {
        "ContactSolver",
        {fallback("none",
                  long_text<&S::command>(
                      "command", "Run by a shell in the scene's folder with two files, PROBLEM and "
                                 "SOLVED: it writes SOLVED, a copy of PROBLEM with /solution. "
                                 "Certified like those of the program's own solvers.")),
         fallback("none", text<&S::function>(
                              "function",
                              "Instead: the name of a function that the program which steps the "
                              "scene has registered (amontons.register_solver of Python).")),
         field<&S::max_time>("max_time", "s", above(0, 1e9), "It is ended after this wall time.")},
        "",
        {},
        defaults_of<S>()};
}

ObjectDeclaration declare_output()
{
    using O = OutputInput;
    return {"Output",
            {field<&O::every>("every", "", at_least(1), "Steps between two written frames."),
             field<&O::picture>("picture", "", {}, "A picture at the end (needs the VTK module)."),
             field<&O::plots>("plots", "", {}, "Plots at the end (need gnuplot).")},
            "",
            {},
            defaults_of<O>()};
}

FieldDeclaration named_bodies(const ObjectDeclaration& body)
{
    FieldDeclaration f;
    f.name = "bodies";
    f.type = FieldType::named;
    f.required = true;
    f.doc = "The bodies, each under its name.";
    f.member = [](void* scene) { return scene; };
    f.object = &body;
    return f;
}

} // namespace

const ObjectDeclaration& scene_declaration()
{
    static const ObjectDeclaration piece = declare_piece();
    static const ObjectDeclaration centreline = declare_centreline(piece);
    static const ObjectDeclaration branch = declare_branch();
    static const ObjectDeclaration named_branch = declare_named_branch(centreline);
    static const ObjectDeclaration surface = declare_surface(centreline, branch, named_branch);
    static const ObjectDeclaration layer = declare_layer();
    static const ObjectDeclaration segment = declare_segment(layer);
    static const ObjectDeclaration tip = declare_tip();
    static const ObjectDeclaration place = declare_place();
    static const ObjectDeclaration introducer = declare_introducer(place);
    static const ObjectDeclaration drive = declare_beam_drive();
    static const ObjectDeclaration body =
        declare_bodies(surface, segment, tip, introducer, drive, centreline);
    static const ObjectDeclaration contact = declare_contact();
    static const ObjectDeclaration coupling = declare_coupling();
    static const ObjectDeclaration time = declare_time();
    static const ObjectDeclaration accuracy = declare_accuracy();
    static const ObjectDeclaration solver = declare_solver();
    static const ObjectDeclaration contact_solver = declare_contact_solver();
    static const ObjectDeclaration output = declare_output();
    static const ObjectDeclaration haptic = declare_haptic();
    Allowed first_schema;
    first_schema.lower = first_schema.upper = 1;
    static const ObjectDeclaration scene{
        "Scene",
        {required(
             field<&Scene::schema>("schema", "", first_schema, "Version of the scene format.")),
         long_text<&Scene::title>("title", "What the scene shows."), named_bodies(body),
         list<&Scene::contact>("contact", contact, "Pairs of bodies that can touch."),
         list<&Scene::couplings>("couplings", coupling, "Joints and springs between bodies."),
         field<&Scene::gravity>("gravity", "m/s^2", kAny, "Acts where there is mass."),
         required(object<&Scene::time>("time", time, "Steps and end.")),
         object<&Scene::accuracy>("accuracy", accuracy, "How exact the result must be."),
         object<&Scene::solver>("solver", solver,
                                "Methods of solution, which do not change the result."),
         object<&Scene::contact_solver>("contact_solver", contact_solver,
                                        "A program that solves the contact problems of solids and "
                                        "rigid bodies instead of the built-in solvers."),
         object<&Scene::output>("output", output, "What is written."),
         object<&Scene::haptic>("haptic", haptic, "What a hand holds, for amontons haptic.")},
        "",
        {},
        defaults_of<Scene>()};
    return scene;
}

std::string allowed_in_words(const FieldDeclaration& field)
{
    if (!field.choices.empty()) {
        std::string words = "one of";
        for (const std::string& c : field.choices)
            words += fmt::format("{} \"{}\"", &c == &field.choices.front() ? "" : ",", c);
        return words;
    }
    std::string unit = field.unit.empty() ? "" : " [" + field.unit + "]";
    const Allowed& a = field.allowed;
    std::string range;
    const bool lower = a.lower > -std::numeric_limits<double>::infinity();
    const bool upper = a.upper < std::numeric_limits<double>::infinity();
    if (lower && a.lower == a.upper)
        range = fmt::format("{}", a.lower);
    else {
        if (lower)
            range = fmt::format("{}{} {:.7g}", a.least > 0 ? "0, or " : "", a.above ? ">" : ">=",
                                a.least > 0 ? std::max(a.lower, a.least) : a.lower);
        if (upper) range += fmt::format("{}<= {:.7g}", lower ? " and " : "", a.upper);
    }
    switch (field.type) {
    case FieldType::boolean:
        return "true or false";
    case FieldType::integer:
        return "a whole number" + (range.empty() ? "" : " " + range);
    case FieldType::number:
        return (range.empty() ? "a number" : "a number " + range) + unit;
    case FieldType::pair:
        return "a number or [start, end]" + (range.empty() ? "" : ", each " + range) + unit;
    case FieldType::text:
        return fmt::format("a text of at most {} printable bytes", field.longest);
    case FieldType::two_names:
        return fmt::format("[name, name] of two bodies, each of at most {} printable bytes",
                           field.longest);
    case FieldType::vector:
        if (field.uniform)
            return "a number, or three numbers" + (range.empty() ? "" : ", each " + range) + unit;
        return (a.nonzero ? "three numbers, not all 0" : "three numbers") +
               (range.empty() ? "" : ", each " + range) + unit;
    case FieldType::matrix:
        return "three rows [a, b, c] of numbers" + (range.empty() ? "" : ", each " + range) + unit;
    case FieldType::curve:
        if (field.places) return "[[x, y], ...]" + (range.empty() ? "" : ", each " + range) + unit;
        if (field.over != "time")
            return fmt::format("[[{}, value], ...], {}{} strictly increasing, value{}{}",
                               field.over, field.over,
                               field.over_unit.empty() ? "" : " [" + field.over_unit + "]",
                               range.empty() ? "" : " " + range, unit);
        return "a number, or [[time, value], ...], time [s] strictly increasing, value" +
               (range.empty() ? "" : " " + range) + unit;
    case FieldType::object:
        return field.object && !field.object->shorthand.empty()
                   ? "an object {...}, or a text: its " + field.object->shorthand
                   : "an object {...}";
    case FieldType::list:
        return "a list [...] of objects";
    case FieldType::numbers:
        return "a list [...] of at least one whole number" +
               (range.empty() ? "" : ", each " + range);
    case FieldType::by_name:
        return "an object of objects, each under its name";
    case FieldType::named:
        return "an object with at least one body";
    }
    return "";
}

} // namespace amontons
