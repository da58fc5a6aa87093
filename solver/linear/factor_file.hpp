#pragma once

#include "mesh/base/file.hpp"
#include "solver/linear/supernodal.hpp"

#include <iosfwd>

// A factor as a file: a line with its kind, numbers of 8 bytes, then the arrays as they
// lie in memory. Only for the kind of machine that wrote it.

namespace amontons {

/// What a factor is of, beside itself.
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

/// Whether hashes are examined. `ignore` is for tests, which then see what else is checked.
enum class Checksums { verify, ignore };

/// Reads a factor straight into its place. Nothing is reserved before the sizes are known to agree
/// with that of the file.
/// @param in     at its beginning
/// @param label  what the file specifies; its key is not compared
/// @returns why it cannot be used, or ""; `factor` is empty then
std::string read_factor(std::istream& in, FactorLabel& label, SupernodalFactor& factor,
                        const SupernodalOptions& options = {},
                        Checksums checksums = Checksums::verify);

} // namespace amontons
