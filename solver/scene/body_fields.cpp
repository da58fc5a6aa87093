#include "solver/scene/body_fields.hpp"

#include "solver/material/law.hpp"
#include "solver/scene/declare.hpp"

namespace amontons {
namespace {

using namespace declare;

ObjectDeclaration declare_mesh(const ObjectDeclaration& centreline)
{
    using M = MeshInput;
    const FieldDeclaration element =
        choice({"T4", "T10", "H8"}, text<&M::element>("element", "Kind of the elements."));
    const FieldDeclaration radius =
        required(field<&M::radius>("radius", "m", positive(), "Radius."));
    ObjectDeclaration d;
    d.title = "Elements of a solid";
    d.shorthand = "file";
    d.discriminator = "generate";
    d.defaults = defaults_of<M>();
    d.chosen = [](void* mesh) -> std::string& { return static_cast<M*>(mesh)->generate; };
    d.variants = {
        {"",
         "From a file.",
         {required(long_text<&M::file>("file",
                                       ".msh (Gmsh), .vtu, .inp (Abaqus, CalculiX) or .nodes "
                                       "(plain text); beside the scene.")),
          or_one(
              field<&M::scale>("scale", "m", positive(),
                               "Metres per unit of length of the file; three numbers: along x, y, "
                               "z."))}},
        {"box",
         "A block. Face sets x_min, x_max, y_min, y_max, z_min, z_max.",
         {required(field<&M::size>("size", "m", positive(), "Lengths along x, y, z.")),
          field<&M::centre>("centre", "m", kAny, "Its middle."),
          field<&M::cells>("cells", "", at_least(1), "Elements along x, y, z (whole numbers)."),
          field<&M::grading>("grading", "", positive(),
                             "Last cell over first cell, along x, y, z."),
          element}},
        {"ball",
         "A full ball. Face set outer.",
         {field<&M::centre>("centre", "m", kAny, "Its middle."), radius,
          field<&M::around>("around", "", at_least(2), "Elements along a diameter."), element}},
        {"cylinder",
         "A full cylinder. Face sets start, end, outer.",
         {field<&M::centre>("centre", "m", kAny, "Middle of the start."),
          field<&M::axis>("axis", "", direction(), "From start to end."), radius,
          required(field<&M::length>("length", "m", positive(), "Length.")),
          field<&M::around>("around", "", at_least(2), "Elements along a diameter."),
          field<&M::along>("along", "", at_least(1), "Elements along the axis."), element}},
        {"tube",
         "The wall of a vessel. Face sets inner, outer, start, end.",
         {required(object<&M::centreline>("centreline", centreline, "The middle of the lumen.")),
          fallback("the centreline's own",
                   field<&M::radius>("radius", "m", positive(), "Of the lumen.")),
          required(field<&M::thickness>("thickness", "m", positive(), "Of the wall.")),
          field<&M::around>("around", "", at_least(3), "Elements around."),
          field<&M::along>("along", "", at_least(1), "Elements along."),
          field<&M::through>("through", "", at_least(1), "Elements through the wall."), element}}};
    return d;
}

template <std::size_t k> void* constant(void* material)
{
    return &static_cast<MaterialInput*>(material)->constants[k];
}

template <std::size_t... k> auto constants_of(std::index_sequence<k...>)
{
    return std::array<void* (*)(void*), sizeof...(k)>{&constant<k>...};
}

/// One variant for each law, its constants as fields: from the table of laws.
ObjectDeclaration declare_material()
{
    using M = MaterialInput;
    static const auto member = constants_of(std::make_index_sequence<kMostConstants>());
    ObjectDeclaration d;
    d.title = "Hyperelastic material";
    d.discriminator = "law";
    d.defaults = defaults_of<M>();
    d.chosen = [](void* material) -> std::string& { return static_cast<M*>(material)->law; };
    d.given = [](const void* material) { return !static_cast<const M*>(material)->law.empty(); };
    for (const MaterialLaw& law : material_laws()) {
        VariantDeclaration v;
        v.value = law.name;
        v.doc = law.doc;
        for (std::size_t i = 0; i < law.constants.size(); ++i) {
            const MaterialConstant& c = law.constants[i];
            FieldDeclaration f;
            f.name = c.name;
            f.unit = c.unit;
            f.doc = c.doc;
            f.allowed.lower = c.lower;
            f.allowed.above = c.above;
            if (c.upper != 0) f.allowed.upper = c.upper;
            f.allowed = within_limits(f.allowed, f.unit);
            f.member = member[i];
            v.fields.push_back(required(std::move(f)));
        }
        if (law.directed) {
            v.fields.push_back(
                field<&M::fibre>("fibre", "", direction(), "Along the fibres, at rest."));
            v.fields.push_back(long_text<&M::fibres>(
                "fibres", "Instead: a file with three numbers a line, the direction of each "
                          "element in the mesh's order; beside the scene."));
        }
        d.variants.push_back(std::move(v));
    }
    return d;
}

} // namespace

const ObjectDeclaration& declare_box()
{
    static const ObjectDeclaration box = optional_object<SetBox>(
        "A box along the axes",
        {required(field<&SetBox::from>("from", "m", kAny, "A corner.")),
         required(field<&SetBox::to>("to", "m", kAny, "The opposite one; the box may be flat."))});
    return box;
}

const ObjectDeclaration& declare_ball()
{
    static const ObjectDeclaration ball = optional_object<SetBall>(
        "A ball", {required(field<&SetBall::centre>("centre", "m", kAny, "Its middle.")),
                   required(field<&SetBall::radius>("radius", "m", positive(), "Its radius."))});
    return ball;
}

namespace {

ObjectDeclaration declare_set()
{
    using S = SetInput;
    static const ObjectDeclaration plane = optional_object<SetPlane>(
        "A plane", {required(field<&SetPlane::at>("at", "m", kAny, "A point of it.")),
                    required(field<&SetPlane::normal>("normal", "", direction(), "Its normal."))});
    // No angle in radians is so large: one given so is refused, not misread.
    static const ObjectDeclaration seed = optional_object<SetSeed>(
        "Faces that edges without a corner connect with one of them",
        {required(field<&SetSeed::at>("at", "m", kAny, "A place on or near that face.")),
         field<&SetSeed::angle>("angle", "degree", between(5, 180),
                                "Largest angle between neighbouring faces that count as alike.")});
    return {"Set of a solid, by where it lies before `start`: one of box, ball, plane, faces_like, "
            "faces, nodes",
            {object<&S::box>("box", declare_box(),
                             "Faces of the outside that lie in it with all their "
                             "nodes."),
             object<&S::ball>("ball", declare_ball(), "As box."),
             object<&S::plane>("plane", plane, "As box: faces in it."),
             fallback("1e-6 of the mesh's diagonal",
                      field<&S::within>("within", "m", positive(),
                                        "How far from the plane, on both sides.")),
             object<&S::faces_like>("faces_like", seed,
                                    "From one face on, up to edges with a "
                                    "corner."),
             field<&S::faces>("faces", "", at_least(0),
                              "Numbers of faces of the outside, from 0: in the order of elements, "
                              "within one in that of its faces."),
             field<&S::nodes>("nodes", "", at_least(0),
                              "Numbers of nodes, as the file has them; "
                              "from 1 of generated meshes."),
             choice({"faces", "nodes"},
                    text<&S::of>("of", "\"nodes\": all nodes that lie in the box, the ball or the "
                                       "plane, also inside the solid, for holds and forces."))},
            "",
            {},
            defaults_of<S>()};
}

ObjectDeclaration declare_hold()
{
    using H = HoldInput;
    return {
        "Prescribed displacement of a set; without x, y and z all three are held, at 0 or as a "
        "turn "
        "or a gradient has them",
        {required(
             text<&H::set>("set", "A set of faces or nodes of the mesh; \"all\": every node.")),
         field<&H::x>("x", "m", kAny, "Over time; without it this axis is free."),
         field<&H::y>("y", "m", kAny, "As x."), field<&H::z>("z", "m", kAny, "As x."),
         field<&H::axis>("axis", "", direction(), "Of a turn by `angle`."),
         field<&H::about>("about", "m", kAny,
                          "Place that the turn or the gradient leaves where it is."),
         field<&H::angle>("angle", "rad", kAny,
                          "Turn of the set as a rigid body, about the axis through `about`, "
                          "over time; with x, y or z along these alone, beside them."),
         fallback("none",
                  field<&H::gradient>("gradient", "", kAny,
                                      "Instead of a turn: the displacement is A (x - `about`) "
                                      "times `over`, x where the run begins; A by rows.")),
         fallback("1", field<&H::over>("over", "", kAny, "Factor on the gradient over time.")),
         choice({"world", "body"},
                text<&H::axes>(
                    "axes", "Axes in which x, y, z, axis, place and gradient are given, where the "
                            "body begins; the same for all holds of a body with a start.turn."))},
        "",
        {},
        defaults_of<H>()};
}

ObjectDeclaration declare_load()
{
    using L = LoadInput;
    return {
        "Load on a set",
        {required(
             text<&L::set>("set", "A set of faces or nodes of the mesh; \"all\": every node.")),
         field<&L::pressure>("pressure", "Pa", kAny, "Pushes against faces, over time."),
         field<&L::volume>("volume", "m^3", kAny,
                           "Instead: by how much the faces yield into the body, over time; the "
                           "pressure that does it is found. Hyperelastic solids, quasi-static."),
         fallback("none", field<&L::traction>("traction", "Pa", kAny, "Force per area on faces.")),
         fallback("none", field<&L::force>("force", "N", kAny,
                                           "In all, shared equally by the set's nodes.")),
         fallback("1",
                  field<&L::over>("over", "", kAny, "Factor on traction and force over time."))},
        "",
        {},
        defaults_of<L>()};
}

ObjectDeclaration declare_probe()
{
    using P = ProbeInput;
    using L = ProbeInput::Line;
    static const ObjectDeclaration line = optional_object<L>(
        "A line along which fields are compared with those of a file",
        {required(
             field<&L::from>("from", "m", kAny, "Where it begins, in the mesh as it is read.")),
         required(field<&L::to>("to", "m", kAny, "Where it ends.")),
         required(long_text<&L::reference>(
             "reference", "CSV beside the scene. The first column is the distance from `from` [m], "
                          "the others are called as the columns of a probe: `stress_xx [Pa]`, "
                          "`displacement_z [m]`, `contact_pressure [Pa]`."))});
    return {"A place whose displacement, stress and contact pressure are columns of history.csv",
            {required_unless({"set", "line"},
                             field<&P::at>("at", "m", kAny,
                                           "A place in the mesh as it is read, before the "
                                           "body is placed.")),
             replaced_by({"at", "line"},
                         required_unless(
                             {"at", "line"},
                             text<&P::set>("set", "Or a set of faces or nodes: means over it."))),
             object<&P::line>("line", line,
                              "Or a line: the columns are then the errors of the reference's "
                              "fields, root mean square along the line over that of the "
                              "reference.")},
            "",
            {},
            defaults_of<P>()};
}

ObjectDeclaration declare_support()
{
    using S = SupportInput;
    return {
        "Springs between faces and the surroundings: a force per area of -k times the displacement "
        "since the start, along the faces' normals at rest and across them",
        {required(text<&S::set>("set", "A set of faces of the mesh.")),
         field<&S::normal>("normal", "N/m^3", at_least(0), "k along the normal."),
         field<&S::tangential>("tangential", "N/m^3", at_least(0), "k along the faces.")},
        "",
        {},
        defaults_of<S>()};
}

ObjectDeclaration declare_drive()
{
    using D = DriveInput;
    ObjectDeclaration d{
        "Prescribed rigid motion, from where the body begins",
        {field<&D::x>("x", "m", kAny, "Shift over time."), field<&D::y>("y", "m", kAny, "As x."),
         field<&D::z>("z", "m", kAny, "As x."),
         field<&D::axis>("axis", "", direction(), "Of the turn."),
         fallback("the body's centre",
                  field<&D::about>("about", "m", kAny, "A point on the axis, where it begins.")),
         field<&D::angle>("angle", "rad", kAny, "Turn over time.")},
        "",
        {},
        defaults_of<D>()};
    d.complete = [](void* drive, const std::function<bool(const char*)>&) {
        static_cast<D*>(drive)->given = true;
    };
    d.given = [](const void* drive) { return static_cast<const D*>(drive)->given; };
    return d;
}

ObjectDeclaration declare_start()
{
    using S = StartInput;
    return {"Where a body begins",
            {field<&S::place>("place", "m", kAny, "Shift."),
             field<&S::turn>("turn", "rad", kAny,
                             "Rotation vector; the body is turned about the origin, then shifted."),
             field<&S::velocity>("velocity", "m/s", kAny, "Of the centre of mass; dynamic only."),
             field<&S::spin>("spin", "rad/s", kAny, "Angular velocity; dynamic only.")},
            "",
            {},
            defaults_of<S>()};
}

ObjectDeclaration declare_shape()
{
    using S = ShapeInput;
    const FieldDeclaration radius =
        required(field<&S::radius>("radius", "m", positive(), "Radius."));
    ObjectDeclaration d;
    d.title = "Shape of a rigid body";
    d.shorthand = "file";
    d.discriminator = "generate";
    d.defaults = defaults_of<S>();
    d.chosen = [](void* shape) -> std::string& { return static_cast<S*>(shape)->generate; };
    d.variants = {
        {"",
         "A closed triangle surface from a file.",
         {required(long_text<&S::file>("file", "STL, OBJ or PLY; beside the scene.")),
          or_one(
              field<&S::scale>("scale", "m", positive(),
                               "Metres per unit of length of the file; three numbers: along x, y, "
                               "z."))}},
        {"box",
         "A box about the origin.",
         {required(field<&S::size>("size", "m", positive(), "Lengths along x, y, z."))}},
        {"ball", "A ball about the origin.", {radius}},
        {"cylinder",
         "A cylinder about the origin, along z.",
         {radius, required(field<&S::length>("length", "m", positive(), "Length.")),
          field<&S::points>("points", "", at_least(0),
                            "Contact points spread over each end; 0: on its rim.")}},
        {"ellipsoid",
         "An ellipsoid about the origin.",
         {required(field<&S::radii>("radii", "m", positive(), "Half axes along x, y, z."))}},
        {"capsule",
         "A cylinder with half balls on its ends, about the origin, along z.",
         {radius, required(field<&S::length>("length", "m", positive(),
                                             "Length between the centres of the half balls."))}},
        {"wedge",
         "A polygon in the plane of x and y, extruded along z, half of the length to either side.",
         {required(corners<&S::outline>("points",
                                        "Its corners in order, either way round; sides do not "
                                        "cross.")),
          required(field<&S::length>("length", "m", positive(), "Length along z."))}}};
    return d;
}

} // namespace

std::vector<VariantDeclaration> body_variants(const ObjectDeclaration& centreline)
{
    using S = SolidInput;
    using R = RigidInput;
    static const ObjectDeclaration mesh = declare_mesh(centreline);
    static const ObjectDeclaration material = declare_material();
    static const ObjectDeclaration set = declare_set();
    static const ObjectDeclaration hold = declare_hold();
    static const ObjectDeclaration load = declare_load();
    static const ObjectDeclaration support = declare_support();
    static const ObjectDeclaration probe = declare_probe();
    static const ObjectDeclaration drive = declare_drive();
    static const ObjectDeclaration start = declare_start();
    static const ObjectDeclaration shape = declare_shape();
    Allowed poisson = above(-1, 0.4999999);
    return {
        {"solid",
         "An elastic body of tetrahedra or hexahedra.",
         {required(object<&S::mesh>("mesh", mesh, "Its elements.")),
          by_name<&S::sets>("sets", set,
                            "Sets beside those of the mesh, for surfaces of contact, "
                            "holds and loads."),
          required_unless(
              {"material"},
              field<&S::youngs_modulus>("youngs_modulus", "Pa", positive(), "Young's modulus E.")),
          required_unless({"material"}, field<&S::poisson_ratio>("poisson_ratio", "", poisson,
                                                                 "Poisson's ratio nu.")),
          object<&S::material>("material", material,
                               "Of a hyperelastic solid; without it that is neo_hooke with E and "
                               "nu."),
          fallback("none: no weight, no inertia",
                   field<&S::density>("density", "kg/m^3", at_least(0), "Mass per volume.")),
          choice({"linear", "corotational", "hyperelastic"},
                 text<&S::motion>("motion",
                                  "\"linear\": small elastic displacements, on top of a rigid "
                                  "motion if nothing is held; \"corotational\": every element "
                                  "turns with the material; \"hyperelastic\", or with a "
                                  "`material`: large strains.")),
          object<&S::start>("start", start, "Where it begins."),
          object<&S::drive>("drive", drive, "Prescribes its rigid motion."),
          list<&S::hold>("hold", hold, "Prescribed displacements."),
          list<&S::loads>("loads", load, "Loads."),
          list<&S::supports>("supports", support,
                             "Springs to the surroundings; their energy is part of the elastic "
                             "energy."),
          by_name<&S::probes>("probes", probe,
                              "Places and sets whose displacement, stress and contact pressure are "
                              "quantities of every step."),
          field<&S::mass_damping>("mass_damping", "1/s", at_least(0), "Rayleigh's, dynamic."),
          field<&S::stiffness_damping>("stiffness_damping", "s", at_least(0),
                                       "Rayleigh's, dynamic.")},
         &append_body<&Scene::solids>,
         &find_body<&Scene::solids>},
        {"rigid",
         "A rigid body that moves, freely or as prescribed.",
         {required(object<&R::shape>("shape", shape, "Its shape.")),
          fallback("none", field<&R::density>("density", "kg/m^3", positive(), "Mass per volume.")),
          fallback("from the density", field<&R::mass>("mass", "kg", positive(), "Its mass.")),
          fallback("from the shape",
                   field<&R::inertia>("inertia", "kg m^2", positive(),
                                      "About the centre of mass, along the shape's axes.")),
          object<&R::start>("start", start, "Where it begins."),
          object<&R::drive>("drive", drive, "Prescribes its motion."),
          field<&R::force>("force", "N", kAny, "At the centre of mass."),
          field<&R::torque>("torque", "N m", kAny, "About the centre of mass."),
          fallback("1",
                   field<&R::over>("over", "", kAny, "Factor on force and torque over time."))},
         &append_body<&Scene::rigids>,
         &find_body<&Scene::rigids>}};
}

ObjectDeclaration declare_contact()
{
    using C = ContactLaw;
    return {"Contact of a pair of bodies",
            {required(text<&C::between>("between", "Names of two bodies. Bodies in no pair do "
                                                   "not touch. \"*\": every body "
                                                   "and obstacle not named with the other in a "
                                                   "pair of its own, and each rod itself. A "
                                                   "hyperelastic solid twice: it touches "
                                                   "itself.")),
             field<&C::friction>("friction", "", at_least(0), "Coulomb's coefficient."),
             field<&C::restitution>("restitution", "", between(0, 1),
                                    "Newton's coefficient of restitution; dynamic rigid bodies."),
             fallback("all of the outside",
                      text<&C::surfaces>("surfaces", "Face sets of the two; \"\": all. Of a "
                                                     "rod \"start\" or \"end\": that end alone.")),
             choice({"finite", "small"},
                    text<&C::sliding>("sliding", "\"small\": of solids, the geometry of the start "
                                                 "decides which places may touch.")),
             choice({"mortar", "nodal"},
                    text<&C::discretisation>("discretisation",
                                             "Of solids: \"mortar\" integrates over the faces, "
                                             "\"nodal\" takes the other face at one point.")),
             fallback("chosen",
                      field<&C::reach>("reach", "m", at_least(0),
                                       "How far contacts are searched for: a hint for the cost.")),
             choice({"refuse", "resolve", "close"},
                    text<&C::start_overlap>(
                        "start_overlap",
                        "Bodies that overlap when the run begins: \"refuse\" such a scene; "
                        "\"resolve\" separates them before the first step; \"close\" subtracts "
                        "gaps and overlaps of surfaces that should fit from the gap.")),
             fallback("rigid",
                      field<&C::foundation>("foundation", "N/m^2", positive(),
                                            "Of a beam and an obstacle: springs along the normal "
                                            "instead of a rigid wall; force per length of beam "
                                            "and depth."))},
            "",
            {},
            defaults_of<C>()};
}

ObjectDeclaration declare_coupling()
{
    using C = CouplingInput;
    return {
        "Joint or spring between two bodies",
        {choice({"weld", "ball", "hinge", "slider", "distance", "spring", "turn_spring"},
                text<&C::kind>("kind", "What it leaves free: nothing, all turns, the turn "
                                       "about the axis, the shift along the axis, all but the "
                                       "distance of `at` and `to`; or a spring along the line "
                                       "between the two, or one that works against the turn "
                                       "about the axis of a hinge.")),
         required(
             text<&C::between>("between", "Names of two bodies; the second may be \"world\".")),
         field<&C::at>("at", "m", kAny,
                       "Where, when the run begins. On a rod: no farther from its middle line than "
                       "its radius; a node is put there."),
         fallback("`at`",
                  field<&C::to>("to", "m", kAny, "Spring, distance: the end on the second body.")),
         field<&C::axis>("axis", "", direction(), "Of a hinge, a slider or a turn spring."),
         field<&C::stiffness>("stiffness", "N/m", at_least(0),
                              "Of a spring; of a turn spring [N m/rad]."),
         field<&C::damping>("damping", "N s/m", at_least(0),
                            "Of a spring in motion: force per speed at which it gets longer; of a "
                            "turn spring [N m s/rad]."),
         fallback("as it begins", field<&C::length>("length", "m", at_least(0),
                                                    "Of a spring free of load, or a distance.")),
         fallback("`radius`",
                  text<&C::set>("set", "Set of faces of the solid that is joined: force and moment "
                                       "act on it as a traction that is linear over it, and its "
                                       "mean motion is the joint's. Of two solids: of the first.")),
         fallback("`radius`",
                  text<&C::to_set>("to_set", "Of two solids: set of faces of the second.")),
         fallback("`set`",
                  field<&C::radius>("radius", "m", positive(),
                                    "In place of a set: all of the solid's outside that is as near "
                                    "to `at` (on a second body: to `to`, if it is given)."))},
        "",
        {},
        defaults_of<C>()};
}

} // namespace amontons
