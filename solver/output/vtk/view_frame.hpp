#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

// What a window shows of one instant, and how it is sent there: the program and its viewer are two
// processes of one build, so numbers travel as they lie in memory. No Eigen and no VTK here: both
// sides include it.

namespace amontons {

/// A body as it is drawn. A shape that a frame does not name stays as it was.
struct ViewShape {
    /// Kinds of shapes.
    enum Kind : std::int32_t { wall, wire, solid, rigid };
    std::string name;
    /// One of Kind.
    std::int32_t kind = wall;
    std::vector<float> points;           ///< 3 a point [m]
    std::vector<std::int32_t> triangles; ///< 3 corners each; empty: those of the frame before
    std::vector<float>
        values; ///< a point: radius of a wire [m], stress of a solid [Pa] (none: plain)
    /// Of a solid with triangles: the face of its outside that each is of. For studio alone.
    std::vector<std::int32_t> faces = {};
};

/// One picture of the window: shapes and a caption.
struct ViewFrame {
    /// Line of text below the picture.
    std::string caption;
    std::vector<ViewShape> shapes;
    std::vector<float> contacts; ///< 6 each: point [m], the force that the caption names [N]
    // For studio alone:
    std::vector<float> normal_forces; ///< 3 each: its part along the contact's normal [N]
    /// 2 each, numbers of `names`: the body that the force acts on, and that exerts it.
    std::vector<std::int32_t> pairs;
    std::vector<std::string> names;
};

/// A frame with its length before it.
std::string view_bytes(const ViewFrame& frame);

/// Takes the first whole frame off the bytes.
/// @return  false if they hold none yet
/// @throws std::runtime_error  if they are no frames
bool take_view_frame(std::string& bytes, ViewFrame& frame);

} // namespace amontons
