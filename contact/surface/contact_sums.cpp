#include "contact/surface/contact_sums.hpp"

#include "mesh/base/index.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace amontons {
namespace {

constexpr double kTiny = 0.05;   ///< of the full area: joins a neighbour
constexpr double kNoArea = 1e-8; ///< of the full area, and no neighbour: left out

} // namespace

void FaceSums::clear()
{
    area.fill(0);
    normal.fill(Vec3::Zero());
    slope.fill(Mat3::Zero());
    slave.setZero();
    master.clear();
    far.fill(Vec3::Zero());
}

FaceSums::Master& FaceSums::of(std::int32_t face)
{
    for (Master& m : master)
        if (m.face == face) return m;
    master.push_back({face, Weights::Zero()});
    return master.back();
}

ContactSums::ContactSums(const ExternalSurface& slave, const ExternalSurface& master, bool fixed)
    : slave_surface_(slave)
    , master_surface_(master)
    , fixed_(fixed)
    , multipliers_(slave.used_nodes.size())
{
}

void ContactSums::add(std::size_t slave_face, const FaceMultipliers& multipliers,
                      const FaceSums& sums)
{
    const std::span<const std::int32_t> nodes = slave_surface_.face(slave_face);
    FaceLinks links;
    links.count = multipliers.count;
    for (int i = 0; i < multipliers.count; ++i) {
        const auto k = static_cast<std::size_t>(i);
        const std::int32_t node = nodes[static_cast<std::size_t>(multipliers.node[k])];
        const std::int32_t number = slave_surface_.surface_nodes[at(node)];
        links.multiplier[k] = number;
        Multiplier& m = multipliers_[at(number)];
        m.area += sums.area[k];
        m.full += multipliers.full[k];
        m.normal += sums.normal[k];
        m.far += sums.far[k];
        m.slope += sums.slope[k];
        for (std::size_t j = 0; j < nodes.size(); ++j)
            if (const double w = sums.slave(i, static_cast<Eigen::Index>(j)); w != 0)
                slave_.push_back({number, nodes[j], w});
        for (const FaceSums::Master& other : sums.master) {
            const std::span<const std::int32_t> far = master_surface_.face(at(other.face));
            for (std::size_t l = 0; l < far.size(); ++l)
                if (const double w = other.weights(i, static_cast<Eigen::Index>(l)); w != 0)
                    master_.push_back({number, far[l], w});
        }
    }
    links_.push_back(links);
}

std::vector<std::int32_t> ContactSums::merge_(std::vector<Multiplier>& sums) const
{
    std::vector<std::int32_t> target(sums.size());
    std::iota(target.begin(), target.end(), 0);
    const auto is_tiny = [](const Multiplier& m) { return m.area < kTiny * m.full; };
    std::vector<std::int32_t> best(sums.size(), -1), tiny;
    for (const FaceLinks& face : links_)
        for (int i = 0; i < face.count; ++i) {
            const std::int32_t a = face.multiplier[static_cast<std::size_t>(i)];
            if (!is_tiny(multipliers_[at(a)])) continue;
            if (best[at(a)] < 0) tiny.push_back(a);
            for (int j = 1; j < face.count; ++j) {
                // Of a quadrilateral the corner across it is no neighbour: which of two that carry
                // as much were joined would be a matter of numbers.
                if (face.count == 4 && j == 2) continue;
                const std::int32_t b =
                    face.multiplier[static_cast<std::size_t>((i + j) % face.count)];
                std::int32_t& c = best[at(a)];
                const auto by_area = [&](std::int32_t k) {
                    return std::pair(multipliers_[at(k)].area, -k);
                };
                if (c < 0 || by_area(b) > by_area(c)) c = b;
            }
        }
    std::sort(tiny.begin(), tiny.end(), [&](std::int32_t a, std::int32_t b) {
        return std::pair(multipliers_[at(a)].area, a) < std::pair(multipliers_[at(b)].area, b);
    });
    const auto root = [&](std::int32_t k) {
        while (target[at(k)] != k)
            k = target[at(k)];
        return k;
    };
    for (const std::int32_t a : tiny) {
        const std::int32_t b = root(best[at(a)]);
        if (b == a || !(multipliers_[at(best[at(a)])].area > 0)) continue;
        if (!is_tiny(sums[at(a)])) continue; // others have joined it
        target[at(a)] = b;
        sums[at(b)].area += sums[at(a)].area;
        sums[at(b)].normal += sums[at(a)].normal;
        sums[at(b)].far += sums[at(a)].far;
        sums[at(b)].slope += sums[at(a)].slope;
        sums[at(a)].area = 0;
    }
    for (std::size_t k = 0; k < target.size(); ++k)
        target[k] = root(static_cast<std::int32_t>(k));
    return target;
}

std::vector<ContactSums::Entry> ContactSums::sorted_(const std::vector<Entry>& entries,
                                                     const std::vector<std::int32_t>& target,
                                                     std::vector<std::size_t>& begin) const
{
    begin.assign(multipliers_.size() + 1, 0);
    for (const Entry& e : entries)
        ++begin[at(target[at(e.multiplier)]) + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::size_t> next(begin.begin(), begin.end() - 1);
    std::vector<Entry> sorted(entries.size());
    for (const Entry& e : entries)
        sorted[next[at(target[at(e.multiplier)])]++] = e;
    return sorted;
}

SurfaceContacts ContactSums::contacts(std::span<const Vec3> slave_places,
                                      std::span<const Vec3> master_places, double reach,
                                      bool of_gap) const
{
    if (links_.empty()) return {};
    std::vector<Multiplier> sums = multipliers_;
    const std::vector<std::int32_t> target = merge_(sums);
    std::vector<std::size_t> slave_begin, master_begin;
    std::vector<Entry> slave = sorted_(slave_, target, slave_begin);
    std::vector<Entry> master = sorted_(master_, target, master_begin);

    SurfaceContacts out;
    const auto append = [&](std::vector<Entry>& entries, std::size_t begin, std::size_t end,
                            double area) {
        const auto first = entries.begin() + static_cast<std::ptrdiff_t>(begin);
        const auto last = entries.begin() + static_cast<std::ptrdiff_t>(end);
        std::sort(first, last, [](const Entry& a, const Entry& b) { return a.node < b.node; });
        const std::size_t start = out.stencil.size();
        for (auto e = first; e != last; ++e) {
            if (out.stencil.size() == start || out.stencil.back().node != e->node)
                out.stencil.push_back({e->node, 0});
            out.stencil.back().weight += e->weight / area;
        }
        return static_cast<std::int32_t>(out.stencil.size());
    };
    for (std::size_t k = 0; k < sums.size(); ++k) {
        const Multiplier& m = sums[k];
        if (!(m.area > kNoArea * m.full) || !(m.area > 0)) continue;
        SurfaceContact c;
        c.id = slave_surface_.used_nodes[k];
        c.area = m.area;
        c.normal = m.normal.normalized();
        set_tangents(c);
        const std::size_t start = out.stencil.size();
        c.slave_begin = static_cast<std::int32_t>(start);
        c.slave_end = append(slave, slave_begin[k], slave_begin[k + 1], m.area);
        c.master_begin = c.slave_end;
        c.master_end = append(master, master_begin[k], master_begin[k + 1], m.area);
        c.point = weighted(out.slave(c), slave_places);
        const Vec3 opposite =
            fixed_ ? Vec3(m.far / m.area) : weighted(out.master(c), master_places);
        c.gap = c.normal.dot(c.point - opposite);
        if (of_gap) {
            const Vec3 gradient = m.slope * c.normal / m.area;
            if (const double length = gradient.norm(); length > 0) {
                c.normal = gradient / length;
                c.gap /= length;
                set_tangents(c);
            }
        }
        if (std::abs(c.gap) <= reach)
            out.contact.push_back(c);
        else
            out.stencil.resize(start);
    }
    return out;
}

} // namespace amontons
