#include "solver/solid/contact_rows.hpp"

namespace amontons {

ContactRows rows_of(const SurfaceContacts& contacts, ContactSide side)
{
    ContactRows rows;
    for (const SurfaceContact& c : contacts.contact) {
        Mat3 frame;
        frame << c.normal, c.t1, c.t2;
        rows.begin(frame);
        if (side != ContactSide::master)
            for (const StencilEntry& e : contacts.slave(c))
                rows.add(e.node, e.weight);
        if (side != ContactSide::slave)
            for (const StencilEntry& e : contacts.master(c))
                rows.add(e.node, -e.weight);
    }
    return rows;
}

Eigen::VectorXd relative_motion(const ContactRows& rows, const Eigen::VectorXd& x)
{
    Eigen::VectorXd u(3 * Eigen::Index(rows.size()));
    for (std::size_t i = 0; i < rows.size(); ++i) {
        Vec3 sum = Vec3::Zero();
        for (const ContactRows::Entry& e : rows.of(i))
            sum += e.weight * x.segment<3>(3 * Eigen::Index(e.node));
        u.segment<3>(3 * Eigen::Index(i)) = rows.frame[i].transpose() * sum;
    }
    return u;
}

void add_reactions(const ContactRows& rows, const Eigen::VectorXd& r, Eigen::Ref<Eigen::VectorXd> f)
{
    AMONTONS_ASSERT(r.size() == 3 * Eigen::Index(rows.size()));
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const Vec3 force = rows.frame[i] * r.segment<3>(3 * Eigen::Index(i));
        for (const ContactRows::Entry& e : rows.of(i))
            f.segment<3>(3 * Eigen::Index(e.node)) += e.weight * force;
    }
}

SparseMatrix contact_matrix(const ContactRows& rows, const FreeDofs& dofs)
{
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(9 * rows.entry.size());
    for (std::size_t i = 0; i < rows.size(); ++i)
        for (const ContactRows::Entry& e : rows.of(i))
            for (int a = 0; a < 3; ++a) {
                const std::int32_t number = dofs.number[3 * std::size_t(e.node) + std::size_t(a)];
                if (number < 0) continue; // prescribed
                for (int c = 0; c < 3; ++c)
                    if (const double value = e.weight * rows.frame[i](a, c); value != 0)
                        entries.emplace_back(number, 3 * std::int32_t(i) + c, value);
            }
    SparseMatrix C(Eigen::Index(dofs.free.size()), 3 * Eigen::Index(rows.size()));
    C.setFromTriplets(entries.begin(), entries.end());
    return C;
}

} // namespace amontons
