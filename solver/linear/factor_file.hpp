#pragma once

#include "mesh/base/file.hpp"
#include "solver/linear/supernodal.hpp"

#include <iosfwd>

// A factor as a file: a line with its kind, numbers of 8 bytes, then the arrays as they
// lie in memory. Only for the kind of machine that wrote it.

namespace amontons {

/// Identity of a factored matrix, stored with its factor.
struct FactorLabel {
    Hash128 key;      ///< of all that the matrix depends on
    double scale = 1; ///< a factor that the owner stores with it, e.g. the modulus (factor)
    bool operator==(const FactorLabel&) const = default;
};

/// Writes a factor, all or nothing.
/// @throws WriteError
void write_factor(const std::string& path, const FactorLabel& label,
                  const SupernodalFactor& factor);
/// The same bytes.
std::string factor_bytes(const FactorLabel& label, const SupernodalFactor& factor);

/// Whether hashes are verified. `ignore` is for tests of the other checks.
enum class Checksums { verify, ignore };

/// Reads a factor directly into its arrays. Memory is reserved only after the sizes have been
/// checked against that of the file.
/// @param in     at its beginning
/// @param label  set to the label in the file; the caller has to compare its key
/// @returns "", or why the file cannot be used; `factor` is then empty
std::string read_factor(std::istream& in, FactorLabel& label, SupernodalFactor& factor,
                        const SupernodalOptions& options = {},
                        Checksums checksums = Checksums::verify);

} // namespace amontons
