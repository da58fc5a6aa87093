#pragma once

#include "mesh/box_tree.hpp"
#include "mesh/surface_mesh.hpp"

#include <vector>

namespace amontons {

/// A place where elements are to be smaller than elsewhere.
struct SizeSource {
    Vec3 at = Vec3::Zero(); ///< [m]
    double size = 0;        ///< edge length there [m], > 0
};

/// Edge lengths of a mesh to be made: size(x) = min(greatest, min_i (size_i + gradation |x -
/// x_i|)).
class SizeField {
public:
    /// @param greatest   far from all sources [m], > 0
    /// @param gradation  growth with the distance from a source [-], > 0
    SizeField(double greatest, std::vector<SizeSource> sources, double gradation);

    /// O(log n + sources that reach x). Edge length [m].
    double at(const Vec3& x) const;
    const std::vector<SizeSource>& sources() const { return sources_; }
    double greatest() const { return greatest_; } ///< far from all sources [m]
    double least() const { return least_; }       ///< at the smallest source, or greatest() [m]

private:
    double greatest_, gradation_, least_;
    std::vector<SizeSource> sources_;
    BoxTree reach_; ///< of each source, where it matters
};

/// The integral of 1 / size^3 over what a closed surface encloses: the number of elements, up to a
/// factor of the mesher [-]. The mean of 1 / size^3 is taken on columns of a grid, `across` to each
/// side of the box, and finer while few of them cross the body; the volume is that of the surface,
/// so that one size everywhere gives volume / size^3.
/// @param surface  oriented, as repair_surface leaves it
double count_by_size(const SurfaceMesh& surface, const SizeField& size, int across = 96);

} // namespace amontons
