#include "mesh/generate/wall_seeds.hpp"

#include "mesh/base/late.hpp"
#include "mesh/closest_point.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <tuple>
#include <unordered_map>
#include <vector>

namespace amontons {
namespace {

constexpr int kEdges = 16;       // of triangles, along a cube
constexpr double kBeyond = 2;    // edges that the triangles of a cube continue beyond it
constexpr double kNoWall = 1.25; // steepest change of the functions with the distance
constexpr int kMostDoublings = 4;
constexpr std::size_t kGroup = 8;

/// Triangles in groups of neighbours, as surface_nets() makes them; none where no wall passes.
struct SeedCube {
    struct Group {
        Eigen::Array3d low = Eigen::Array3d::Constant(std::numeric_limits<double>::infinity()),
                       high = -low;
    };
    std::vector<std::array<Vec3, 3>> triangle;
    std::vector<Group> group; // each of kGroup triangles, the last of fewer

    SeedCube() = default;
    explicit SeedCube(const SurfaceMesh& mesh)
    {
        for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
            if (k % kGroup == 0) group.emplace_back();
            std::array<Vec3, 3>& corners = triangle.emplace_back();
            for (std::size_t v = 0; v < 3; ++v) {
                corners[v] = mesh.points[std::size_t(mesh.triangles[k][v])];
                group.back().low = group.back().low.min(corners[v].array());
                group.back().high = group.back().high.max(corners[v].array());
            }
        }
    }
    TrianglePoint closest(const Vec3& x, std::size_t k) const
    {
        return closest_on_triangle(x, triangle[k][0], triangle[k][1], triangle[k][2]);
    }
    /// @param worth  of the squared distance: what is not nearer than that is left out
    /// @return  true if `best` is of this cube now
    bool search(const Vec3& x, double worth, NearestTriangle& best) const
    {
        bool some = false;
        const Eigen::Array3d at = x.array();
        for (std::size_t g = 0; g < group.size(); ++g) {
            const Eigen::Array3d off = (group[g].low - at).max(at - group[g].high).max(0.0);
            if (off.matrix().squaredNorm() >= worth * best.squared) continue;
            const std::size_t end = std::min((g + 1) * kGroup, triangle.size());
            for (std::size_t k = g * kGroup; k < end; ++k) {
                const TrianglePoint p = closest(x, k);
                const double squared = (x - p.point).squaredNorm();
                if (!(squared < best.squared)) continue;
                best = {std::int32_t(k), p, squared};
                some = true;
            }
        }
        return some;
    }
};

} // namespace

struct WallSeeds::Cubes {
    std::function<ImplicitSurface()> surface;
    Vec3 origin;
    double edge = 0;
    std::mutex mutex; // of the cubes
    std::unordered_map<BrickKey, Late<SeedCube>, BrickHash> cubes;

    double size() const { return kEdges * edge; }
    Vec3 corner(const BrickKey& key) const
    {
        return origin + size() * Vec3{1.0 * key.x, 1.0 * key.y, 1.0 * key.z};
    }
    SeedCube made(const BrickKey& key) const
    {
        const ImplicitSurface of = surface();
        const Vec3 beyond = Vec3::Constant(kBeyond * edge), low = corner(key) - beyond,
                   high = corner(key) + Vec3::Constant(size()) + beyond;
        const double half = 0.5 * (high - low).norm();
        if (std::abs(of.value(0.5 * (low + high))) > kNoWall * half) return {};
        return SeedCube{surface_nets(of, low, high, edge)};
    }
    const SeedCube& at(const BrickKey& key)
    {
        std::unique_lock lock(mutex);
        const auto found =
            cubes.try_emplace(key, std::function<SeedCube()>{[this, key] { return made(key); }})
                .first;
        const Late<SeedCube> cube = found->second; // shares it: others may come meanwhile
        lock.unlock();
        return *cube;
    }
};

WallSeeds::WallSeeds(std::function<ImplicitSurface()> surface, const Vec3& origin, double edge)
    : cubes_{std::make_unique<Cubes>()}
{
    cubes_->surface = std::move(surface);
    cubes_->origin = origin;
    cubes_->edge = edge;
}
WallSeeds::~WallSeeds() = default;

NearestTriangle WallSeeds::nearest(const Vec3& x, double reach, double slack, Near& near) const
{
    struct Candidate {
        double squared; // distance of its cube
        BrickKey key;
    };
    if (!x.allFinite() || !std::isfinite(reach)) return {};
    std::vector<Candidate> all;
    const double size = cubes_->size(), worth = 1 / ((1 + slack) * (1 + slack));
    NearestTriangle best;
    for (int doubled = 0; doubled <= kMostDoublings; ++doubled, reach *= 2) {
        all.clear();
        std::array<std::int32_t, 3> from, to;
        for (int a = 0; a < 3; ++a) {
            const double u = x[a] - cubes_->origin[a];
            from[std::size_t(a)] = std::int32_t(std::floor((u - reach) / size));
            to[std::size_t(a)] = std::int32_t(std::floor((u + reach) / size));
        }
        for (std::int32_t i = from[0]; i <= to[0]; ++i)
            for (std::int32_t j = from[1]; j <= to[1]; ++j)
                for (std::int32_t k = from[2]; k <= to[2]; ++k) {
                    const BrickKey key{i, j, k};
                    const Vec3 low = cubes_->corner(key) - x;
                    const Vec3 off = low.cwiseMax(-low - Vec3::Constant(size)).cwiseMax(0.0);
                    if (off.squaredNorm() <= reach * reach) all.push_back({off.squaredNorm(), key});
                }
        std::ranges::sort(all, [](const Candidate& a, const Candidate& b) {
            return std::tie(a.squared, a.key.x, a.key.y, a.key.z) <
                   std::tie(b.squared, b.key.x, b.key.y, b.key.z);
        });
        best = {};
        best.squared = std::numeric_limits<double>::infinity();
        BrickKey cube = near.cube;
        if (near.triangle >= 0) {
            const TrianglePoint p = cubes_->at(cube).closest(x, std::size_t(near.triangle));
            best = {near.triangle, p, (x - p.point).squaredNorm()};
        }
        for (const Candidate& c : all) {
            if (c.squared >= worth * best.squared) break;
            if (cubes_->at(c.key).search(x, worth, best)) cube = c.key;
        }
        if (!(best.squared <= reach * reach)) continue;
        near = {cube, best.triangle};
        return best;
    }
    best.triangle = -1;
    return best;
}

} // namespace amontons
