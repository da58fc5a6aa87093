#pragma once

#include "mesh/base/types.hpp"

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

// The contents of a scene file, in SI, with defaults. Plain data: the reader
// (solver/scene/read.hpp) fills it, solver/obstacle/build.hpp makes the obstacles of a Simulation
// from it.

namespace amontons {

/// Value over time: linear between points, constant before the first and after the last.
using CurvePoints = std::vector<std::array<double, 2>>; ///< (time [s], value)

/// A piece of a centreline given by its shape.
struct CentrelinePiece {
    double length = 0;    ///< of a straight piece [m]; 0 for an arc
    double radius = 0;    ///< of an arc [m]; 0 for a straight piece
    double angle = 0;     ///< of an arc [rad]; > 0
    double direction = 0; ///< plane of the arc: turned by this angle about the tangent [rad]
};

/// A curve in space: a file of points, or pieces from a start.
struct CentrelineInput {
    std::string file; ///< CSV x,y,z[,radius] in m, or 3D Slicer .mrk.json
    double scale = 0; ///< of the file's lengths [m per unit]; 0: the format's own
    std::vector<CentrelinePiece> pieces; ///< instead of a file
    Vec3 start = Vec3::Zero();           ///< of the first piece [m]
    Vec3 direction = Vec3::UnitX();      ///< of the first piece
    Vec3 normal = Vec3::UnitY();         ///< arcs with direction 0 bend this way
};

/// A side vessel of a generated vessel.
struct BranchInput {
    std::string name;
    double at = 0;                         ///< distance before the end of the arch [m]
    std::array<double, 2> diameter{};      ///< at its root and its end [m]
    double length = 0;                     ///< [m]
    double angle = 1.57079632679489661923; ///< from the arch's tangent towards its start [rad]
};

/// A box of places: one of several ways to specify a set or a branch.
struct SetBox {
    /// True if the scene has one.
    bool given = false;
    Vec3 from = Vec3::Zero(), to = Vec3::Zero(); ///< two opposite corners [m]
};
/// A ball of places.
struct SetBall {
    /// True if the scene has one.
    bool given = false;
    Vec3 centre = Vec3::Zero(); ///< [m]
    double radius = 0;          ///< [m]
};

/// A part of any vessel with a name: around a centreline, in a ball or in a box.
struct NamedBranchInput {
    std::string name;
    /// Its line.
    CentrelineInput centreline;
    SetBall ball;
    SetBox box;
    /// True if it is given by a line.
    bool has_line() const { return !centreline.file.empty() || !centreline.pieces.empty(); }
};

/// Surface of an obstacle: a generator's name with its numbers, or a file.
struct SurfaceInput {
    std::string generate; ///< "tube" | "vessel" | "ball" | "cylinder" | "plane", or "" for a file
    std::string file;     ///< .stl .obj .ply .vtp
    Vec3 scale = Vec3::Ones();  ///< of the file's lengths along x, y, z [m per unit]
    CentrelineInput centreline; ///< tube
    double radius = 0;          ///< tube, ball, cylinder [m]; 0 on a tube: the centreline's own
    Vec3 centre = Vec3::Zero(); ///< ball, cylinder, plane [m]
    Vec3 axis = Vec3::UnitZ();  ///< cylinder's axis, plane's normal
    // vessel: descending straight part along `axis` from `centre`, then an arch, then an ascending
    // part
    std::array<double, 2> descending_diameter{}; ///< [m]
    double descending_length = 0;                ///< [m]
    double arch_radius = 0;                      ///< [m]
    double arch_angle = 3.14159265358979323846;  ///< [rad]
    std::array<double, 2> arch_diameter{};       ///< [m]
    double ascending_length = 0;                 ///< [m]
    double ascending_diameter = 0;               ///< [m]
    Vec3 arch_towards = Vec3::UnitX();           ///< the arch bends this way
    std::vector<BranchInput> branches;
    std::vector<NamedBranchInput> named_branches; ///< file, tube
    double blend = 0.002;                         ///< radius of the blend between vessels [m]
    double resolution = 0;                        ///< edge of the triangles [m]; 0: chosen
};

/// An obstacle: a rigid wall.
struct ObstacleInput {
    std::string name;
    /// Its surface.
    SurfaceInput surface;
    std::string side; ///< "inside" | "outside" | "": from the sign of the enclosed volume
};

/// A tube of a section, or a coil of round wire in it.
struct SectionLayer {
    double inner_radius = 0, outer_radius = 0; ///< [m]
    /// The same at the segment's end, linear in between; absent: as at its beginning [m]
    std::optional<double> end_inner_radius, end_outer_radius;
    double youngs_modulus = 0; ///< [Pa]
    double poisson_ratio = 0.3;
    double pitch = 0; ///< of a coil of round wire as thick as the layer [m]; 0: a tube
};

/// A piece of a wire, from its base towards its tip. Pairs are values at the piece's two ends.
struct BeamSegment {
    double length = 0;          ///< [m]
    double radius = 0;          ///< of the round surface [m]
    double end_radius = 0;      ///< ... at the end of a cone; 0: radius; see tapers.hpp [m]
    double inner_radius = 0;    ///< of the bore; 0: solid [m]
    std::array<double, 2> EI{}; ///< bending stiffness [N m^2]
    /// ... across the plane of a curvature at angle 0, of flattened wires and ribbons; 0: EI
    /// [N m^2]
    std::array<double, 2> EI_across{};
    std::array<double, 2> GJ{}; ///< torsional stiffness [N m^2]; default 0.77 EI
    std::array<double, 2> EA{}; ///< axial stiffness [N]; default 4 EI / (radius^2 + inner_radius^2)
    std::array<double, 2> GA{}; ///< shear stiffness [N]; 0: no shear deformation
    std::vector<SectionLayer> layers; ///< what EI, GJ and EA are made of; empty: they are given
    CurvePoints bending;              ///< (change of curvature [1/m], moment [N m]); empty: linear
    CurvePoints stretching;           ///< (strain, force [N]); empty: linear
    double curvature = 0;             ///< natural curvature [1/m]
    double curvature_angle = 0;       ///< turns the plane of the curvature about the wire [rad]
    double twist = 0;                 ///< natural twist: turn of that plane along the wire [rad/m]
    double element = 0;               ///< length of the elements [m]
    std::optional<double> friction;   ///< overrides the pair's
    double density = 0;               ///< mass per volume [kg/m^3]; needed for dynamics
};

/// Where an introducer sits on a centreline, instead of a point and a direction.
struct IntroducerPlace {
    std::string file;     ///< .mrk.json or .csv
    double scale = 0;     ///< of the file's lengths [m per unit]; 0: the format's own
    double along = 0;     ///< distance from the centreline's start [m]
    bool reverse = false; ///< the centreline runs against the wire: it starts at its last point
};

/// A straight frictionless sheath that holds the part of the wire still outside.
struct IntroducerInput {
    Vec3 at = Vec3::Zero(); ///< its end, where the wire comes out [m]
    /// Direction of the introducer (unit vector).
    Vec3 direction = Vec3::UnitX();
    std::optional<Vec3> normal; ///< the wire's curvature of angle 0 bends this way; default chosen
    double length = 0;          ///< [m]; 0: as long as the wire
    double fade = 0;            ///< the grip fades out over this length before the end [m]
    IntroducerPlace centreline; ///< with a file: gives `at` and `direction`, and the depth
    std::string branch;         ///< of an obstacle: its centreline gives `at` and `direction`
    std::string end; ///< "start" | "end" of the centreline, where the wire comes in; "": its start,
                     ///< of a branch its end
    bool at_given = false, direction_given = false; ///< by the reader
    /// True if the scene gives its place.
    bool placed() const { return !centreline.file.empty() || !branch.empty(); }
};

/// Another tip than the instrument's own.
struct TipInput {
    std::string shape; ///< "straight" | "J" | "angled" | "pigtail"; "": the instrument's own
    double radius = 0; ///< of the bend [m]; 0: the shape's
    double angle = 0;  ///< of the bend [rad]; 0: the shape's
    double length = 0; ///< straight beyond the bend [m]; 0: the shape's
};

/// The tip of a wire is held: its place over time, and the turns of its cross-section.
struct TipHoldInput {
    /// True if the scene has one.
    bool given = false;
    CurvePoints x, y, z;        ///< displacement from where the tip begins [m]; empty: 0
    std::string turns = "free"; ///< "free" | "held"
};

/// A wire, catheter or sheath.
struct BeamInput {
    std::string name;
    std::vector<BeamSegment> segments;
    std::string instrument; ///< of the library, instead of segments; "" once they are made
    double length = 0;      ///< of the instrument [m]; 0: its own
    double element = 0;     ///< of its elements [m]; 0: its own
    TipInput tip;           ///< of the instrument
    IntroducerInput introducer;
    CurvePoints insertion;     ///< of the base (time [s], [m])
    CurvePoints twist;         ///< of the base (time [s], [rad])
    std::optional<Vec3> plane; ///< normal of a plane the wire is constrained to
    TipHoldInput hold;
    double contact_spacing = 0; ///< [m]; 0: half the shortest element
};

/// Elements of a solid: a generator's name with its numbers, or a file.
struct MeshInput {
    std::string generate;        ///< "box" | "ball" | "cylinder" | "tube", or "" for a file
    std::string file;            ///< .msh .vtu .inp .nodes
    Vec3 scale = Vec3::Ones();   ///< of the file's lengths along x, y, z [m per unit]
    std::string element = "T10"; ///< "T4" | "T10" | "H8"
    Vec3 centre = Vec3::Zero();  ///< of a box or a ball; of a cylinder's first end [m]
    Vec3 size = Vec3::Zero();    ///< box [m]
    Vec3 cells = Vec3::Ones();   ///< box: elements along x, y, z
    Vec3 grading = Vec3::Ones(); ///< box: last cell / first cell
    double radius = 0;           ///< ball, cylinder, tube [m]
    double length = 0;           ///< cylinder [m]
    Vec3 axis = Vec3::UnitZ();   ///< cylinder
    double thickness = 0;        ///< tube [m]
    CentrelineInput centreline;  ///< tube
    int around = 24;             ///< tube: elements around; ball, cylinder: across a diameter
    int along = 8;               ///< cylinder, tube
    int through = 2;             ///< tube
};

/// Prescribed displacement of a named set over time; no curve along an axis holds the three at 0,
/// or as the turn or the gradient has them: u = x(t) + (R(t) - 1)(X - about), or
/// u = x(t) + over(t) A (X - about), X where the run begins.
struct HoldInput {
    /// Name of the set of faces.
    std::string set;
    CurvePoints x, y, z;          ///< (time [s], [m]); empty: this axis is free
    Vec3 axis = Vec3::UnitZ();    ///< of the turn
    Vec3 about = Vec3::Zero();    ///< the point that turn or gradient leave at rest [m]
    CurvePoints angle;            ///< [rad]; empty: no turn
    std::optional<Mat3> gradient; ///< A [-]
    CurvePoints over;             ///< factor on it; empty: 1
    /// True if it has a gradient.
    bool affine() const { return !angle.empty() || gradient.has_value(); }
    std::string axes =
        "world"; ///< x, y, z of where the body begins: "world" | "body": turned with it
};

/// A load on a named set. Vectors are multiplied by `over`.
struct LoadInput {
    /// Name of the set of faces.
    std::string set;
    CurvePoints pressure;         ///< pushes against a set of faces (time [s], [Pa])
    CurvePoints volume;           ///< prescribed volume swept inwards by faces (time [s], [m^3])
    std::optional<Vec3> traction; ///< force per area on a set of faces [Pa]
    std::optional<Vec3> force;    ///< total, shared equally by the set's nodes [N]
    CurvePoints over;             ///< factor on traction and force over time; empty: 1
};

/// A prescribed rigid motion: shift and turn from where the body begins.
struct DriveInput {
    /// True if the scene has one.
    bool given = false;
    CurvePoints x, y, z;       ///< (time [s], [m])
    Vec3 axis = Vec3::UnitZ(); ///< of the turn
    std::optional<Vec3> about; ///< a point on the axis [m]; default the body's own centre
    CurvePoints angle;         ///< (time [s], [rad])
};

/// Where a body begins and how it moves then.
struct StartInput {
    Vec3 place = Vec3::Zero();    ///< shift [m]
    Vec3 turn = Vec3::Zero();     ///< turned first, about the origin: a rotation vector [rad]
    Vec3 velocity = Vec3::Zero(); ///< [m/s]
    Vec3 spin = Vec3::Zero();     ///< angular velocity about the centre of mass [rad/s]
};

/// A hyperelastic material: a law's name and its constants in the order of its declaration.
struct MaterialInput {
    std::string law; ///< of solver/material/law.hpp; "": none given
    std::array<double, 8> constants{};
    Vec3 fibre = Vec3::UnitX(); ///< of directed laws: along the fibres, at rest
    std::string fibres;         ///< or a file with the direction of each element
    Vec3 turned = Vec3::Zero(); ///< what the file's directions are turned by, with their mesh [rad]
};

/// Faces in a plane: another way to specify a set.
struct SetPlane {
    /// True if the scene has one.
    bool given = false;
    Vec3 at = Vec3::Zero(); ///< a point of it [m]
    /// Outward normal.
    Vec3 normal = Vec3::UnitZ();
};
/// A place from which a smooth part of the surface is collected.
struct SetSeed {
    /// True if the scene has one.
    bool given = false;
    Vec3 at = Vec3::Zero(); ///< a place on the outside [m]
    double angle = 30;      ///< between neighbouring faces that are alike [degree]
};

/// A part of a solid's outside by where it lies when its mesh is read, before it is placed.
struct SetInput {
    std::string name;
    std::string of = "faces"; ///< "faces" | "nodes": also those inside
    SetBox box;
    SetBall ball;
    SetPlane plane;
    double within = 0; ///< of the plane, on both sides [m]; 0: 1e-6 of the mesh's diagonal
    SetSeed faces_like;
    std::vector<int> faces; ///< of the outside, counted from 0
    std::vector<int> nodes; ///< as the file numbers them
};

/// Springs from faces to the surroundings: a force per area against the displacement.
struct SupportInput {
    std::string set;       ///< of faces
    double normal = 0;     ///< [N/m^3]
    double tangential = 0; ///< [N/m^3]
};

/// A place or a set of a solid whose displacement, stress and pressure are reported of every step.
struct ProbeInput {
    std::string name;
    std::optional<Vec3> at; ///< in the mesh as it is read [m]
    std::string set;        ///< or of faces or nodes
    /// Or a line in the mesh as it is read, along which fields are compared with a file's.
    struct Line {
        /// True if the scene has one.
        bool given = false;
        Vec3 from = Vec3::Zero(), to = Vec3::Zero(); ///< [m]
        std::string reference; ///< CSV beside the scene: distance from `from` [m], then fields
    } line;

    /// What that is in the mesh: place_probes.
    struct Found {
        /// Nodes of the set.
        std::vector<std::int32_t> nodes;
        std::vector<double> weights;                         ///< of each node, their sum is 1
        std::int32_t element = -1;                           ///< of a place
        Vec3 xi = Vec3::Zero();                              ///< in it
        double area = 0;                                     ///< of a set of faces [m^2]
        std::vector<std::pair<std::int32_t, double>> behind; ///< its elements, shares of the area
    } found;
    /// The same of the places of a line.
    struct Place {
        double s = 0; ///< from the line's beginning [m]
        Found found;
    };
    std::vector<Place> along;
    /// Fields of the reference, by their names in history.csv, at these places.
    std::vector<std::pair<std::string, std::vector<double>>> fields;
};

/// An elastic solid.
struct SolidInput {
    std::string name;
    /// Its elements.
    MeshInput mesh;
    /// Its sets.
    std::vector<SetInput> sets;
    double youngs_modulus = 0;     ///< [Pa]
    double poisson_ratio = 0;      ///< [-]
    double density = 0;            ///< [kg/m^3]
    std::string motion = "linear"; ///< "linear" | "corotational" | "hyperelastic"
    MaterialInput material;        ///< hyperelastic
    StartInput start;
    DriveInput drive;
    std::vector<HoldInput> hold;
    std::vector<LoadInput> loads;
    std::vector<SupportInput> supports;
    std::vector<ProbeInput> probes;
    double mass_damping = 0;      ///< Rayleigh [1/s]
    double stiffness_damping = 0; ///< Rayleigh [s]
};

/// True if the solid has large strains.
inline bool is_hyperelastic(const SolidInput& s)
{
    return s.motion == "hyperelastic" || !s.material.law.empty();
}

/// The shape of a rigid body, about its own origin.
struct ShapeInput {
    std::string
        generate;     ///< "box" | "ball" | "cylinder" | "ellipsoid" | "capsule" | "wedge", or ""
    std::string file; ///< .stl .obj .ply, closed
    Vec3 scale = Vec3::Ones(); ///< of the file's lengths along x, y, z [m per unit]
    Vec3 size = Vec3::Zero();  ///< box [m]
    double radius = 0;         ///< ball, cylinder, capsule [m]
    double length = 0;         ///< cylinder, capsule (without its round ends), wedge, along z [m]
    Vec3 radii = Vec3::Zero(); ///< ellipsoid [m]
    CurvePoints outline;       ///< wedge: corners (x, y) [m]
    int points = 0;            ///< cylinder: contact points spread over each end; 0: its rim
};

/// A rigid body.
struct RigidInput {
    std::string name;
    /// Its shape.
    ShapeInput shape;
    double density = 0;          ///< [kg/m^3]
    std::optional<double> mass;  ///< instead of a density [kg]
    std::optional<Vec3> inertia; ///< about the centre of mass along the shape's axes [kg m^2]
    StartInput start;
    DriveInput drive;
    Vec3 force = Vec3::Zero();  ///< at the centre of mass [N]
    Vec3 torque = Vec3::Zero(); ///< [N m]
    CurvePoints over;           ///< factor on force and torque over time; empty: 1
};

/// A point of a polyline.
struct RodPoint {
    Vec3 at = Vec3::Zero(); ///< [m]
};

/// Where a rod begins: along a curve, a polyline with rigid corners, or (neither) from a start on,
/// bent as its segments are when free of load.
struct RodShape {
    /// First point [m].
    Vec3 start = Vec3::Zero();
    /// Direction at the first point.
    Vec3 direction = Vec3::UnitX();
    std::optional<Vec3> normal;   ///< section axis 2, curvature of angle 0 bends this way; chosen
    std::vector<RodPoint> points; ///< corners are rigid
    CentrelineInput curve;
    /// True if it follows a curve or points.
    bool has_curve() const { return !curve.file.empty() || !curve.pieces.empty(); }
    bool closed = false; ///< the end is joined to the start
    bool stress_free =
        true; ///< in the given shape; else its segments specify how it is free of load
};

/// A place or motion that is prescribed to a cross-section of a rod.
struct RodHold {
    std::string set;             ///< "start" | "end" | "all" | "": `at`
    std::optional<double> at;    ///< arc length [m]
    std::string places = "held"; ///< "held" | "free"
    CurvePoints x, y, z;         ///< displacement over time [m]; without any: all three are 0
    std::string turns = "held";  ///< "held" | "free" | "about": only about `axis`
    Vec3 axis = Vec3::UnitZ();   ///< fixed in space
    CurvePoints angle;           ///< turn about the axis over time, of turns that are held [rad]
};

/// A load on a rod. Vectors are multiplied by `over`.
struct RodLoad {
    std::string set;            ///< "start" | "end" | "all" | "": `at`
    std::optional<double> at;   ///< arc length [m]
    std::optional<Vec3> force;  ///< [N]
    std::optional<Vec3> moment; ///< [N m]
    std::optional<Vec3> line;   ///< force per length, of "all" [N/m]
    bool follows = false;       ///< force and moment turn with the cross-section
    CurvePoints over;           ///< factor over time; empty: 1
};

/// A beam without an introducer: its shape gives its place, and it may be held and loaded anywhere.
struct RodInput {
    std::string name;
    std::vector<BeamSegment> segments;
    RodShape shape;
    std::string elements = "exact"; ///< "exact" | "corotational"
    std::optional<Vec3> plane;      ///< normal of a plane that the rod is kept in
    std::vector<RodHold> hold;
    std::vector<RodLoad> loads;
    Vec3 velocity = Vec3::Zero(); ///< when the run begins [m/s]
    Vec3 spin = Vec3::Zero();     ///< about the centre of mass [rad/s]
    double contact_spacing = 0;   ///< [m]; 0: at the nodes; in the hand: two radii
    CurvePoints fed; ///< how far its end is out of a sheath over time [m]; empty: there is none
    double drag = 0; ///< viscous: force per length and velocity [N s/m^2]; quasi-static steps only
    bool instrument = false; ///< given as a beam: see instrument_rods.hpp
};

/// A joint (bilateral constraints) or a spring between two bodies.
struct CouplingInput {
    /// "weld" | "ball" | "hinge" | "slider" | "distance" | "spring" | "turn_spring"
    std::string kind = "weld";
    std::array<std::string, 2> between{}; ///< the second may be "world"
    Vec3 at = Vec3::Zero();               ///< where, when the run begins [m]
    std::optional<Vec3> to;    ///< spring, distance: its other end, on the second body [m]
    Vec3 axis = Vec3::UnitZ(); ///< of a hinge, a slider or a turn spring
    double stiffness = 0;      ///< of a spring [N/m], of a turn spring [N m/rad]
    double damping = 0;        ///< of a spring [N s/m], of a turn spring [N m s/rad]
    std::optional<double>
        length;         ///< of a spring free of load, of a distance [m]; default: as it begins
    std::string set;    ///< faces of the solid that it acts on; of two solids: of the first
    std::string to_set; ///< of two solids: of the second
    double radius = 0;  ///< instead: what of the solid's outside is as near to the place [m]
};

/// The law of a pair of bodies.
struct ContactLaw {
    /// Names of the pair; "*": all others.
    std::array<std::string, 2> between;
    double friction = 0;                   ///< Coulomb's coefficient [-]
    double restitution = 0;                ///< Newton's, dynamic [-]
    std::array<std::string, 2> surfaces{}; ///< face sets of the two; "": all of the outside
    std::string sliding = "finite";        ///< "finite" | "small": on the geometry of the start
    std::string discretisation = "mortar"; ///< "mortar" | "nodal"
    double reach = 0;                      ///< how far contacts are searched for [m]; 0: chosen
    std::string start_overlap = "refuse";  ///< "refuse" | "resolve" | "close"
    /// Of a beam and an obstacle: springs along the normal instead of a rigid wall, force per
    /// length of beam and depth [N/m^2]; 0: rigid.
    double foundation = 0;
};

/// Steps and rule of time.
struct TimeInput {
    std::string kind = "quasi_static"; ///< "quasi_static" | "dynamic"
    double step = 0;                   ///< longest step [s]
    double end = 0;                    ///< [s]
    double smallest_step = 0;          ///< [s]; 0: step / 1024
    double path = 0; ///< quasi-static rods: length of a step on the equilibrium path [m]; 0: none
    std::string balance = "mean"; ///< of quasi-static beams: "mean" | "course"
    double damping = 0;           ///< mass-proportional Rayleigh damping of beams [1/s]
    std::string rule = "theta";   ///< of dynamic solids: "theta" | "generalised_alpha"
    double theta = 1;             ///< 1 implicit Euler, 0.5 the midpoint rule (weight)
    double spectral_radius = 0.8; ///< of generalised_alpha, at infinite frequency (factor)
};

/// Tolerances (relative).
struct AccuracyInput {
    double contact = 1e-8;       ///< relative error of forces and gaps at the end of a step
    std::string solver = "auto"; ///< of the contact problem: see contact/options.hpp
};

/// Choice of linear and contact solvers.
struct SolverInput {
    /// Of the linear systems of solids: "auto" | "direct" | "iterative" | "distributed"
    std::string linear = "auto";
};

/// An external solver for the contact problems of solids and rigid bodies.
struct ContactSolverInput {
    std::string command;   ///< for a shell in the scene's folder
    std::string function;  ///< of the program that the library is in: see solver/step/outside.hpp
    double max_time = 600; ///< of one problem for a command [s]
    bool given() const
    {
        return !command.empty() || !function.empty();
    } ///< false: the program's own
};

/// Files and pictures of a run.
struct OutputInput {
    int every = 10;         ///< steps between two written frames
    double cluster = 0.005; ///< contact forces are summed over this length of wire [m]
    bool picture = true;
    bool plots = true;
};

/// A simulated hand: values of van Beek et al., Sci. Rep. 5 (2015) 18004, fig. 3.
struct HandInput {
    double mass = 0.554;    ///< [kg]
    double damping = 6.45;  ///< [N s/m]
    double stiffness = 135; ///< [N/m]
};

/// What a hand holds, for `amontons haptic`.
struct HapticInput {
    /// True if the scene has one.
    bool given = false;
    std::string handle;           ///< a body
    std::string kind;             ///< "rigid" | "elastic" | "beam"; "": that of the body
    std::string device = "touch"; ///< profile
    double rate = 1000;           ///< of the loop [Hz]
    double simulation_rate = 50;  ///< [Hz]
    double stiffness = 0;         ///< between device and handle [N/m]; 0: chosen
    double turn_stiffness = 0;    ///< [N m/rad]; 0: turns are held rigidly
    double damping = 0;           ///< [N s/m]
    double speed = 0.2;           ///< fastest predicted [m/s]
    double ramp = 0.5;            ///< over which the force is scaled up [s]
    int contacts = 300;           ///< most that are handed over
    HandInput hand;
};

/// The contents of a scene file, in SI.
struct Scene {
    // In scene.cpp: as long as this file, and else compiled wherever a scene is copied or ends.
    Scene();
    Scene(const Scene&);
    Scene(Scene&&) noexcept;
    Scene& operator=(const Scene&);
    Scene& operator=(Scene&&) noexcept;
    ~Scene();

    /// Version of the format.
    int schema = 1;
    /// Of plots and pictures.
    std::string title;
    std::string file;               ///< as the user wrote it; surface files are beside it
    std::vector<std::string> order; ///< names of the bodies, in the file's order
    std::vector<ObstacleInput> obstacles;
    std::vector<BeamInput> beams;
    std::vector<SolidInput> solids;
    std::vector<RigidInput> rigids;
    std::vector<RodInput> rods;
    std::vector<ContactLaw> contact;
    std::vector<CouplingInput> couplings;
    Vec3 gravity = Vec3::Zero(); ///< [m/s^2]; acts where there is mass
    TimeInput time;
    AccuracyInput accuracy;
    SolverInput solver;
    ContactSolverInput contact_solver;
    OutputInput output;
    HapticInput haptic;
};

/// The body of a name, or nullptr.
template <class Body>
const Body* body_named(const std::vector<Body>& bodies, const std::string& name)
{
    for (const Body& body : bodies)
        if (body.name == name) return &body;
    return nullptr;
}

} // namespace amontons
