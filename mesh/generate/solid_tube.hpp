#pragma once

#include "mesh/centreline.hpp"
#include "mesh/volume_mesh.hpp"

namespace amontons {

/// The wall of a vessel: what lies between the radius of a centreline and a thickness more.
struct SolidTubeOptions {
    Centreline centreline;    ///< its radius is the inner one
    double thickness = 0;     ///< [m], > 0
    std::int32_t around = 24; ///< elements along the circumference, >= 3
    std::int32_t through = 2; ///< through the wall, >= 1
    std::int32_t along = 20;  ///< along the centreline, of equal arc length, >= 1
    ElementKind kind = ElementKind::H8;
};

/// A cross-section of a tube: its plane is normal to the centreline.
struct TubeSection {
    Vec3 centre, across, third; ///< third = tangent x across; angles count from across to third
    double radius = 0;          ///< of the lumen [m]
};

/// A frame that is carried along a centreline without turning about it.
class TubeFrame {
public:
    TubeFrame() = default;
    /// @param parts  stations along the line, beside where its pieces begin
    TubeFrame(const Centreline& line, std::int32_t parts);
    /// The first vector of the frame there.
    /// @param tangent  of the line at arc length s
    /// @param s  [m]
    Vec3 across(double s, const Vec3& tangent) const;

private:
    std::vector<double> at_; ///< arc lengths of the stations
    std::vector<Vec3> tangent_, across_;
};
/// The frame of a tube wall along its centreline.
TubeFrame tube_frame(const SolidTubeOptions& options);

/// 2 along + 1 sections, of equal arc length: every second one has middle nodes only. Their frame
/// is carried along without twist.
std::vector<TubeSection> tube_sections(const SolidTubeOptions& options);

/// Where a node lies: all counts are in halves of an element.
Vec3 tube_point(const SolidTubeOptions& options, const std::vector<TubeSection>& sections,
                std::int32_t half_section, std::int32_t half_layer, std::int32_t half_angle);

/// Face sets "inner", "outer", "start", "end"; element set "volume". Cross-sections are planes
/// normal to the centreline and do not turn about it. A T10's middle nodes lie on the true wall.
/// @throws InputError  if a number is out of range, or a bend is tighter than the outer radius
VolumeMesh make_solid_tube(const SolidTubeOptions& options);

} // namespace amontons
