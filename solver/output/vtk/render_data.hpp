#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

template <class T> class vtkSmartPointer;
class vtkPolyData;

namespace amontons::vtk_module {

using Poly = vtkSmartPointer<vtkPolyData>;
using Vec = std::array<double, 3>;

inline double dot(const Vec& a, const Vec& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// Contacts that lie close together, as one force.
struct Cluster {
    Vec point{};          ///< mean of the contacts, weighted by their forces [m]
    Vec force{};          ///< sum, on the wall of a vessel, or on a pair's first body [N]
    double magnitude = 0; ///< of the sum [N]
    std::array<int, 2> bodies{-1, -1}; ///< that touch, where they are distinguished
};

/// What a run's files hold at one instant.
struct Instant {
    double time = 0; ///< [s]
    std::vector<Poly> wires;
    std::vector<std::string> wire_names; ///< of each; "" where the files do not name it
    std::vector<Poly> solids;            ///< their outer surfaces; lines are edges of elements
    std::vector<Poly> rigids;            ///< closed surfaces
    std::vector<Poly> contacts;
    std::string caption; ///< time, and from history.csv depth and push force
};

/// A finished run as it is drawn.
struct RenderData {
    std::vector<Poly> walls;
    std::vector<Instant> instants; ///< the end first, then those at 1/4, 1/2 and 3/4 of the time
};

/// Reads every .pvd of a folder and every .vtp there that no .pvd names; what a file is follows
/// from what it holds (see amontons_vtk_render).
/// @throws std::runtime_error  if no .pvd names a wire or a body, or a file cannot be read
RenderData read_result(const std::filesystem::path& folder);

/// Whether one of the instants before number i has its time: a short run has fewer than four
/// frames.
bool is_repeated(const RenderData& result, std::size_t i);

/// Joins contacts: the one with the largest force takes in all within `radius` [m], and so on.
/// @param by_pair  only contacts of the same two bodies are joined, and forces are those on the
///                 first; else those of wires on walls alone, not of wires in one another
std::vector<Cluster> cluster_contacts(const std::vector<Poly>& contacts, double radius,
                                      bool by_pair = false);

/// True if wires, and walls rigid or compliant that they touch, are all that there is.
bool holds_wires_alone(const RenderData& result);

/// True unless rods are among the bodies: instruments press on walls, rods on one another, too.
bool touch_walls_alone(const RenderData& result);

/// "B_on_A" of each pair (A, B) of clusters, as the columns of history.csv are called; empty if the
/// files name no bodies.
std::vector<std::string> pair_names(const RenderData& result,
                                    const std::vector<std::vector<Cluster>>& clusters);

/// printf for one number.
std::string number(const char* format, double value);

/// A length as a paper writes it: "300 mm", "1.2 m".
std::string length_text(double metres);

} // namespace amontons::vtk_module
