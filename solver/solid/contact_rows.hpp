#pragma once

#include "contact/surface/contact_points.hpp"
#include "solver/solid/assembly.hpp"

namespace amontons {

/// Contacts as one body feels them: u_i = F_i^T sum_k w_k x_k over contact i's nodes, with the
/// frame F_i = (n, t1, t2) and the displacements x; in short u = H x. Where the body is the master
/// its weights are negative.
struct ContactRows {
    using Entry = StencilEntry;
    std::vector<Mat3> frame;            ///< one each contact
    std::vector<std::int32_t> start{0}; ///< contacts + 1, in `entry`
    std::vector<Entry> entry;

    std::size_t size() const { return frame.size(); }
    std::span<const Entry> of(std::size_t contact) const
    {
        return std::span(entry).subspan(std::size_t(start[contact]),
                                        std::size_t(start[contact + 1] - start[contact]));
    }
    /// Adds nodes to the contact that begin() opened last.
    void add(std::int32_t node, double weight)
    {
        entry.push_back({node, weight});
        start.back() = std::int32_t(entry.size());
    }
    void begin(const Mat3& axes)
    {
        frame.push_back(axes);
        start.push_back(std::int32_t(entry.size()));
    }
};

/// What a body has of the contacts whose slave, or master, it is. If it is both, the sum of the two
/// sides is what it has.
enum class ContactSide { slave, master, both };
ContactRows rows_of(const SurfaceContacts& contacts, ContactSide side);

/// u = H x. @param x  3 nodes [m]. @return  3 contacts, (n, t1, t2) of each [m]
Eigen::VectorXd relative_motion(const ContactRows& rows, const Eigen::VectorXd& x);

/// f <- f + H^T r. @param r  3 contacts [N]. @param f  3 nodes [N]
void add_reactions(const ContactRows& rows, const Eigen::VectorXd& r,
                   Eigen::Ref<Eigen::VectorXd> f);

/// H^T without its prescribed rows: free x 3 contacts.
SparseMatrix contact_matrix(const ContactRows& rows, const FreeDofs& dofs);

} // namespace amontons
