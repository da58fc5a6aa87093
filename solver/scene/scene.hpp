#pragma once

#include "mesh/base/types.hpp"

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <variant>
#include <vector>

// What a scene file says, in SI, with its defaults. No pointers, no files opened: the
// reader (scene/read) fills it, build turns it into a Simulation.

namespace amontons {

/// Value over time: linear between points, constant before the first and after the last.
using CurvePoints = std::vector<std::array<double, 2>>; ///< (time [s], value)

/// A piece of a centreline given by its shape.
struct CentrelinePiece {
    double length = 0;      ///< of a straight piece [m]; 0 for an arc
    double radius = 0;      ///< of an arc [m]; 0 for a straight piece
    double angle = 0;       ///< of an arc [rad]; > 0
    double direction = 0;   ///< plane of the arc: turned by this angle about the tangent [rad]
};

/// A curve in space: a file of points, or pieces from a start.
struct CentrelineInput {
    std::string file;                     ///< CSV x,y,z[,radius] in m, or 3D Slicer .mrk.json
    double scale = 0;                     ///< of the file's lengths [m per unit]; 0: the format's own
    std::vector<CentrelinePiece> pieces;  ///< instead of a file
    Vec3 start = Vec3::Zero();            ///< of the first piece [m]
    Vec3 direction = Vec3::UnitX();       ///< of the first piece
    Vec3 normal = Vec3::UnitY();          ///< arcs with direction 0 bend this way
};

/// A side vessel of a generated vessel.
struct BranchInput {
    std::string name;
    double at = 0;               ///< distance before the end of the arch [m]
    std::array<double, 2> diameter{}; ///< at its root and its end [m]
    double length = 0;           ///< [m]
    double angle = 1.57079632679489661923; ///< from the arch's tangent towards its start [rad]
};

/// Surface of an obstacle: a generator's name with its numbers, or a file.
struct SurfaceInput {
    std::string generate;        ///< "tube" | "vessel" | "ball" | "cylinder" | "plane", or "" for a file
    std::string file;            ///< .stl .obj .ply .vtp
    double scale = 1;            ///< of the file's lengths [m per unit]
    CentrelineInput centreline;  ///< tube
    double radius = 0;           ///< tube, ball, cylinder [m]; 0 on a tube: the centreline's own
    Vec3 centre = Vec3::Zero();  ///< ball, cylinder, plane [m]
    Vec3 axis = Vec3::UnitZ();   ///< cylinder's axis, plane's normal
    // vessel: descending straight part along `axis` from `centre`, then an arch, then an ascending part
    std::array<double, 2> descending_diameter{}; ///< [m]
    double descending_length = 0;                ///< [m]
    double arch_radius = 0;                      ///< [m]
    double arch_angle = 3.14159265358979323846;  ///< [rad]
    std::array<double, 2> arch_diameter{};       ///< [m]
    double ascending_length = 0;                 ///< [m]
    double ascending_diameter = 0;               ///< [m]
    Vec3 arch_towards = Vec3::UnitX();           ///< the arch bends this way
    std::vector<BranchInput> branches;
    double blend = 0.002;                        ///< radius of the blend between vessels [m]
    double resolution = 0;                       ///< edge of the triangles [m]; 0: chosen
};

struct ObstacleInput {
    std::string name;
    SurfaceInput surface;
    std::string side;            ///< "inside" | "outside" | "": from the sign of the enclosed volume
};

/// A piece of a wire, from its base towards its tip. Pairs are values at the piece's two ends.
struct BeamSegment {
    double length = 0;                 ///< [m]
    double radius = 0;                 ///< of the round surface [m]
    std::array<double, 2> EI{};        ///< bending stiffness [N m^2]
    std::array<double, 2> GJ{};        ///< torsional stiffness [N m^2]; default 0.77 EI
    std::array<double, 2> EA{};        ///< axial stiffness [N]; default 4 EI / radius^2
    std::array<double, 2> GA{};        ///< shear stiffness [N]; 0: no shear deformation
    double curvature = 0;              ///< natural curvature [1/m]
    double curvature_angle = 0;        ///< turns the plane of the curvature about the wire [rad]
    double element = 0;                ///< length of the elements [m]
    std::optional<double> friction;    ///< overrides the pair's
    double density = 0;                ///< mass per volume [kg/m^3]; needed for dynamics
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
    Vec3 at = Vec3::Zero();             ///< its end, where the wire comes out [m]
    Vec3 direction = Vec3::UnitX();
    std::optional<Vec3> normal;         ///< the wire's curvature of angle 0 bends this way; default chosen
    double length = 0;                  ///< [m]; 0: as long as the wire
    double fade = 0;                    ///< the grip fades out over this length before the end [m]
    IntroducerPlace centreline;         ///< with a file: gives `at` and `direction`, and the depth
};

struct BeamInput {
    std::string name;
    std::vector<BeamSegment> segments;
    IntroducerInput introducer;
    CurvePoints insertion;              ///< of the base (time [s], [m])
    CurvePoints twist;                  ///< of the base (time [s], [rad])
    std::optional<Vec3> plane;          ///< normal of a plane the wire is constrained to
    double contact_spacing = 0;         ///< [m]; 0: half the shortest element
};

struct ContactLaw {
    std::array<std::string, 2> between;
    double friction = 0;                ///< Coulomb's coefficient [-]
};

struct TimeInput {
    std::string kind = "quasi_static";  ///< "quasi_static" | "dynamic"
    double step = 0;                    ///< longest step [s]
    double end = 0;                     ///< [s]
    double smallest_step = 0;           ///< [s]; 0: step / 1024
    double damping = 0;                 ///< mass-proportional Rayleigh damping, dynamic [1/s]
};

struct AccuracyInput {
    double contact = 1e-8;              ///< relative error of forces and gaps at the end of a step
};

struct OutputInput {
    int every = 10;                     ///< steps between two written frames
    double cluster = 0.005;             ///< contact forces are summed over this length of wire [m]
    bool picture = true;
    bool plots = true;
};

struct Scene {
    int schema = 1;
    std::string title;
    std::string file;                   ///< as the user wrote it; surface files are beside it
    std::vector<std::string> order;     ///< names of the bodies, in the file's order
    std::vector<ObstacleInput> obstacles;
    std::vector<BeamInput> beams;
    std::vector<ContactLaw> contact;
    TimeInput time;
    AccuracyInput accuracy;
    OutputInput output;
};

} // namespace amontons
