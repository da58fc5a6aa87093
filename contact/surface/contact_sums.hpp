#pragma once

#include "contact/surface/contact_points.hpp"
#include "contact/surface/multipliers.hpp"

namespace amontons {

/// Integrals over what is covered of one face of the slave; i counts its multipliers.
struct FaceSums {
    using Weights = Eigen::Matrix<double, 4, kMostSolidFaceNodes>;
    /// What one face of the master contributes.
    struct Master {
        /// Number of the face.
        std::int32_t face = 0;
        Weights weights; ///< int psi_i M_l, l counts the face's nodes [m^2]
    };

    std::array<double, 4> area{}; ///< int psi_i [m^2]
    std::array<Vec3, 4> normal;   ///< int psi_i (nu_master - nu_slave) [m^2]
    /// int psi_i nu_master e^T / (nu_master . e), e the direction in which the master is seen [m^2]
    std::array<Mat3, 4> slope;
    Weights slave; ///< int psi_i N_j, j counts the face's nodes [m^2]
    std::vector<Master> master;
    std::array<Vec3, 4> far; ///< of a master that does not bend: int psi_i y, y its place [m^3]

    /// Empties the sums for the next slave face.
    void clear();
    Master& of(std::int32_t face); ///< of a face of the master; new ones are 0
};

/// Contacts from the integrals over the faces of the slave.
class ContactSums {
public:
    /// @param fixed  a master that does not bend: contacts have no stencil on it
    ContactSums(const ExternalSurface& slave, const ExternalSurface& master, bool fixed = false);

    /// Adds the integrals of one slave face to its multipliers.
    void add(std::size_t slave_face, const FaceMultipliers& multipliers, const FaceSums& sums);

    /// The contacts of all faces that were added. A multiplier with less than 5 % of its full area
    /// is merged with its neighbour of the largest area: its constraint on almost no area would
    /// count as much as any other. The sum of areas and the total force are kept. Contacts with
    /// |gap| > reach are left out.
    /// @param slave_places, master_places  of all nodes of each mesh [m]
    /// @param of_gap  normals are the gradients of the gaps (MortarOptions::normals_of_gap)
    SurfaceContacts contacts(std::span<const Vec3> slave_places,
                             std::span<const Vec3> master_places, double reach,
                             bool of_gap = false) const;

private:
    struct Entry {
        std::int32_t multiplier = 0, node = 0;
        double weight = 0;
    };
    struct Multiplier {
        double area = 0, full = 0;
        Vec3 normal = Vec3::Zero(), far = Vec3::Zero();
        Mat3 slope = Mat3::Zero();
    };
    struct FaceLinks {
        int count = 0;
        std::array<std::int32_t, 4> multiplier{};
    };

    std::vector<std::int32_t> merge_(std::vector<Multiplier>& sums) const;
    /// Entries sorted by their multiplier, and where each begins.
    std::vector<Entry> sorted_(const std::vector<Entry>& entries,
                               const std::vector<std::int32_t>& target,
                               std::vector<std::size_t>& begin) const;

    const ExternalSurface& slave_surface_;
    const ExternalSurface& master_surface_;
    bool fixed_ = false;
    std::vector<Multiplier> multipliers_; ///< of each of the slave's used_nodes
    std::vector<FaceLinks> links_;        ///< of each face that was added
    std::vector<Entry> slave_, master_;
};

} // namespace amontons
