#include "mesh/generate/edge_seeds.hpp"

#include "mesh/base/late.hpp"
#include "mesh/sample_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <tuple>
#include <unordered_map>

namespace amontons {
namespace {

constexpr int kCubeCells = 16;     // along an edge of a cube, a power of two
constexpr int kGroupCells = 4;     // the same of a group
constexpr double kSteepness = 1.1; // of the shape's function, no more (slope)
constexpr double kOverlap = 0.75;  // cells from a cell's middle: what is found there is kept

} // namespace

struct EdgeSeeds::Cubes {
    using Cube = std::vector<Group>;

    const VesselShape& shape;
    Vec3 origin;
    double edge = 0;
    std::mutex mutex; // of the cubes
    std::unordered_map<BrickKey, Late<Cube>, BrickHash> cubes;

    double size() const { return kCubeCells * edge; }
    Vec3 corner(const BrickKey& key) const
    {
        return origin + size() * Vec3{1.0 * key.x, 1.0 * key.y, 1.0 * key.z};
    }
    /// Adds the points in the part of a cube that begins at `low` and is `cells` cells wide.
    /// @param near  parts of the tubes there
    void collect(const Vec3& low, int cells, const VesselParts& near, Cube& out) const
    {
        const Vec3 middle = low + Vec3::Constant(0.5 * cells * edge);
        const double reach = kSteepness * 0.5 * std::sqrt(3.0) * cells * edge;
        const VesselShape::Junction at = shape.junction(middle, near);
        if (std::abs(at.value) > reach || at.apart > shape.blend_width() + 2 * reach) return;
        if (cells == kGroupCells) out.emplace_back();
        if (cells > 1) {
            const VesselParts of_group =
                cells == kGroupCells ? shape.parts_around(middle, reach + edge) : VesselParts{};
            const VesselParts& parts = cells == kGroupCells ? of_group : near;
            const int half = cells / 2;
            for (int part = 0; part < 8; ++part)
                collect(low + half * edge *
                                  Vec3{1.0 * (part >> 2), 1.0 * (part >> 1 & 1), 1.0 * (part & 1)},
                        half, parts, out);
            if (cells == kGroupCells && out.back().point.empty()) out.pop_back();
            return;
        }
        const Vec3 p = shape.project(middle, near);
        if (!((p - middle).cwiseAbs().maxCoeff() <= kOverlap * edge)) return;
        if (shape.junction(p, near).apart > shape.blend_width() + edge) return;
        Group& group = out.back();
        group.low = group.low.min(p.array());
        group.high = group.high.max(p.array());
        group.point.push_back(p);
    }
    const Cube& at(const BrickKey& key)
    {
        std::unique_lock lock(mutex);
        const auto found = cubes
                               .try_emplace(key, std::function<Cube()>{[this, key] {
                                                Cube made;
                                                collect(corner(key), kCubeCells, {}, made);
                                                return made;
                                            }})
                               .first;
        const Late<Cube> cube = found->second; // shares it: others may come meanwhile
        lock.unlock();
        return *cube;
    }
};

EdgeSeeds::EdgeSeeds(const VesselShape& shape, const Vec3& origin, double edge)
    : cubes_{new Cubes{shape, origin, edge, {}, {}}}
{
}
EdgeSeeds::~EdgeSeeds() = default;

std::vector<EdgeSeeds::Near> EdgeSeeds::around(const Vec3& centre, double radius) const
{
    std::vector<Near> all;
    std::array<std::int32_t, 3> from, to;
    for (int a = 0; a < 3; ++a) {
        const double u = centre[a] - cubes_->origin[a];
        from[std::size_t(a)] = std::int32_t(std::floor((u - radius) / cubes_->size()));
        to[std::size_t(a)] = std::int32_t(std::floor((u + radius) / cubes_->size()));
    }
    const double most = radius * radius;
    const Eigen::Array3d x = centre.array();
    for (std::int32_t i = from[0]; i <= to[0]; ++i)
        for (std::int32_t j = from[1]; j <= to[1]; ++j)
            for (std::int32_t k = from[2]; k <= to[2]; ++k) {
                const Vec3 low = cubes_->corner({i, j, k}) - centre;
                const Vec3 off = low.cwiseMax(-low - Vec3::Constant(cubes_->size())).cwiseMax(0.0);
                if (off.squaredNorm() > most) continue;
                for (const Group& g : cubes_->at({i, j, k})) {
                    const double squared =
                        (g.low - x).max(x - g.high).max(0.0).matrix().squaredNorm();
                    if (squared <= most) all.push_back({squared, &g});
                }
            }
    std::ranges::stable_sort(all, {}, &Near::squared);
    return all;
}

const Vec3* EdgeSeeds::nearest(const Vec3& x, const Vec3& centre, const std::vector<Near>& near,
                               double& squared)
{
    const Vec3* found = nullptr;
    const Eigen::Array3d at = x.array();
    const double moved = (x - centre).norm();
    double reach = std::sqrt(squared) + moved; // from the centre
    for (const Near& n : near) {
        if (n.squared > reach * reach) break;
        const Group& g = *n.group;
        if ((g.low - at).max(at - g.high).max(0.0).matrix().squaredNorm() >= squared) continue;
        for (const Vec3& p : g.point) {
            const double s = (x - p).squaredNorm();
            if (!(s < squared)) continue;
            squared = s;
            found = &p;
        }
        reach = std::sqrt(squared) + moved;
    }
    return found;
}

} // namespace amontons
