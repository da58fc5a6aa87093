#pragma once

#include "mesh/base/file.hpp"
#include "solver/linear/supernodal.hpp"
#include "solver/solid/assembly.hpp"

namespace amontons {

/// Which matrix of a solid is factored: stiffness K + mass M, with E of the first element taken
/// out.
struct SolidMatrixKind {
    double stiffness = 1;     ///< > 0 (scale)
    double mass = 0;          ///< e.g. 1 / h^2 [1/s^2]
    std::string scheme = "K"; ///< what else distinguishes matrices, such as "lumped"
};

/// A factor of the free part of a solid's matrix A, made or found on disk.
struct SolidFactor {
    SupernodalFactor factor;
    FactorResult result;
    double scale = 1; ///< A = scale x what was factored: for SolidCompliance::set_scale
    bool factor_read = false, order_read = false; ///< from the cache
    std::vector<std::string> messages; ///< files that were ignored or could not be written, and why
};

/// Factors A, or reads its factor from a folder where it was left before.
///
/// A factor belongs to places, elements, ratios of E, nu, ratios of mass to stiffness, prescribed
/// dofs and the kind of matrix; one with another E alone is the same up to `scale`. What is read is
/// tried on A: a factor that does not solve it is ignored, whatever its name specifies. An order of
/// elimination belongs to the elements alone, and serves any prescribed dofs.
/// Files: KEY.factor, KEY.order, written whole or not at all. Nothing is ever deleted.
/// @param folder     "" : nothing is read or written. Made if it is not there.
/// @param free       A without its prescribed rows and columns (Elimination::ff), compressed
/// @param materials  one for all elements, or one of each
/// @param options    node_order is not used: it comes from the cache, or is found
SolidFactor cached_factor(const std::string& folder, const VolumeMesh& mesh,
                          std::span<const SolidMaterial> materials, const FreeDofs& dofs,
                          const SolidMatrixKind& kind, const SparseMatrix& free,
                          SupernodalOptions options = {});

/// Names of the files, without a folder.
std::string factor_file_name(const VolumeMesh& mesh, std::span<const SolidMaterial> materials,
                             const FreeDofs& dofs, const SolidMatrixKind& kind,
                             const SupernodalOptions& options);
/// File name of an elimination order: a hash of the elements and the method.
std::string order_file_name(const VolumeMesh& mesh, Ordering method);

/// An order as a file's bytes, and back; empty if they are none.
std::string order_bytes(std::span<const std::int32_t> order);
/// Reads an elimination order. @throws std::runtime_error if the bytes are damaged
std::vector<std::int32_t> read_order(std::string_view bytes);

} // namespace amontons
