#include "solver/step/contact_size.hpp"

#include "contact/surface/overlap.hpp"
#include "mesh/base/dense.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace amontons {
namespace {

/// Where the nodes of a place are beyond where they would be without strain.
Vec3 strained(const SolidBody& solid, const SolidBody::Unstrained& unstrained,
              std::span<const StencilEntry> nodes)
{
    Vec3 d = Vec3::Zero();
    for (const StencilEntry& e : nodes)
        d += e.weight * (solid.places()[std::size_t(e.node)] -
                         unstrained.place(solid.mesh().nodes[std::size_t(e.node)]));
    return d;
}

struct FaceThere {
    double size = 0, curvature = 0;
};

/// Of a face at the node that has most of a place.
FaceThere face_at(const ContactSurface& surface, const SolidBody& solid,
                  std::span<const StencilEntry> nodes)
{
    const auto most = std::ranges::max_element(
        nodes, {}, [](const StencilEntry& e) { return std::abs(e.weight); });
    const PlacedSurface placed{*surface.facets, solid.mesh().nodes}; // at rest
    FaceThere f;
    for (const std::int32_t t : placed.facets.around(most->node)) {
        const auto face = std::size_t(placed.facets.triangles()[std::size_t(t)].face);
        f.size = std::max(f.size, longest_edge(surface.outside, face, placed.places));
        f.curvature = std::max(f.curvature, curvature_of_face(placed, face));
    }
    return f;
}

} // namespace

std::vector<ContactSize> contact_sizes(const BodySystem& system, const BodyStepReport& step,
                                       const std::map<int, ContactSize>& known)
{
    const std::vector<ContactPair>& pairs = system.finder.pairs();
    std::map<int, SolidBody::Unstrained> unstrained;
    const auto strain_of = [&](int body, std::span<const StencilEntry> nodes) -> Vec3 {
        const SolidBody* solid = body >= 0 ? system.refs[std::size_t(body)].solid : nullptr;
        if (!solid || nodes.empty()) return Vec3::Zero();
        const auto [at, is_new] = unstrained.try_emplace(body);
        if (is_new) at->second = solid->unstrained();
        return strained(*solid, at->second, nodes);
    };

    // ---- Contacts by pair
    struct Found {
        ContactSize size;
        std::size_t deepest = 0;
    };
    std::map<int, Found> found;
    const auto force_of = [&](std::size_t c) {
        const BodyContact& k = step.contacts.contact[c];
        const ContactPair& p = pairs[std::size_t(k.pair)];
        const bool measured = !p.small && p.a != p.b && p.surface_a;
        return measured ? std::max(0.0, k.frame.col(0).dot(step.force[c])) : 0;
    };
    for (std::size_t c = 0; c < step.contacts.contact.size(); ++c)
        if (const double force = force_of(c); force > 0) {
            Found& f = found[step.contacts.contact[c].pair];
            f.size.pair = step.contacts.contact[c].pair;
            f.size.force += force;
        }
    std::erase_if(found, [&](const auto& f) {
        const auto at = known.find(f.first);
        return at != known.end() && !(f.second.size.force > at->second.force);
    });
    for (std::size_t c = 0; c < step.contacts.contact.size() && !found.empty(); ++c) {
        const BodyContact& k = step.contacts.contact[c];
        const auto at = found.find(k.pair);
        if (at == found.end() || !(force_of(c) > 0)) continue;
        Found& f = at->second;
        const Vec3 strain = strain_of(k.a, step.contacts.place_a(k).nodes) -
                            strain_of(k.b, step.contacts.place_b(k).nodes);
        const double indentation = k.frame.col(0).dot(strain) - k.gap;
        if (!(indentation > f.size.indentation)) continue;
        f.size.indentation = indentation;
        f.size.point = k.point;
        f.deepest = c;
    }

    // ---- Sizes
    std::vector<ContactSize> sizes;
    for (auto& [pair, f] : found) {
        if (!(f.size.indentation > 0)) continue;
        const BodyContact& k = step.contacts.contact[f.deepest];
        const ContactPair& p = pairs[std::size_t(pair)];
        double curvature = 0;
        const auto side = [&](int body, const ContactSurface* surface,
                              std::span<const StencilEntry> nodes) {
            const SolidBody* solid = body >= 0 ? system.refs[std::size_t(body)].solid : nullptr;
            if (!solid || !surface || nodes.empty()) return;
            const FaceThere there = face_at(*surface, *solid, nodes);
            f.size.face = std::max(f.size.face, there.size);
            curvature += there.curvature;
        };
        side(k.a, p.surface_a, step.contacts.place_a(k).nodes);
        side(k.b, p.surface_b, step.contacts.place_b(k).nodes);
        if (p.b >= 0 && system.refs[std::size_t(p.b)].rigid) {
            const RigidBody& rigid = *system.refs[std::size_t(p.b)].rigid;
            if (const auto* ball = std::get_if<Ball>(&rigid.shape())) curvature += 1 / ball->radius;
            if (const auto* round = std::get_if<Cylinder>(&rigid.shape()))
                curvature +=
                    symmetric_eigenvalues(distance_from(rigid, rigid.placement())(k.point).hessian)
                                .maxCoeff() > 0
                        ? 1 / round->radius
                        : 0;
            if (std::holds_alternative<Ellipsoid>(rigid.shape()) ||
                std::holds_alternative<Capsule>(rigid.shape()))
                curvature += std::max(
                    0.0,
                    symmetric_eigenvalues(distance_from(rigid, rigid.placement())(k.point).hessian)
                        .maxCoeff());
        }
        f.size.width = curvature > 0 ? 2 * std::sqrt(f.size.indentation / curvature)
                                     : std::numeric_limits<double>::infinity();
        if (p.b >= 0) // no contact is wider than the smaller body
            for (const int b : {p.a, p.b})
                f.size.width = std::min(f.size.width, 2 * system.refs[std::size_t(b)].body->size());
        sizes.push_back(f.size);
    }
    return sizes;
}

} // namespace amontons
