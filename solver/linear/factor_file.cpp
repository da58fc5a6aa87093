#include "solver/linear/factor_file.hpp"

#include "mesh/base/error.hpp"

#include <array>
#include <bit>
#include <cstring>
#include <istream>
#include <limits>

namespace amontons {
namespace {

constexpr std::string_view kMagic = "amontons factor\n"; // so that `head` states what it is
constexpr std::uint64_t kVersion = 1;
constexpr std::uint64_t kByteOrder = 0x0102030405060708;

/// As in the file. All members of 8 bytes: no gaps.
struct Header {
    std::array<char, 16> magic{};
    std::uint64_t version = kVersion, byte_order = kByteOrder;
    std::uint64_t key_high = 0, key_low = 0, scale = 0;
    std::uint64_t rows = 0, supernodes = 0, listed_rows = 0, entries = 0;
    std::array<std::uint64_t, 6> array_hash{}; // in the order of the arrays
    std::uint64_t hash = 0;                    // of all before
};
static_assert(sizeof(Header) == 16 + 16 * 8 && kMagic.size() == 16);

template <class T> std::string_view bytes_of(std::span<const T> values)
{
    return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

std::uint64_t hash_of(const Header& header)
{
    return hash_bytes({reinterpret_cast<const char*>(&header), sizeof header - 8});
}

using Parts = std::array<std::string_view, 6>;

Parts parts_of(const FactorArrays& arrays)
{
    return {bytes_of(arrays.permutation), bytes_of(arrays.first), bytes_of(arrays.row_start),
            bytes_of(arrays.start),       bytes_of(arrays.row),   bytes_of(arrays.value)};
}

Header header_of(const FactorLabel& label, const FactorArrays& arrays)
{
    Header header;
    std::memcpy(header.magic.data(), kMagic.data(), kMagic.size());
    header.key_high = label.key.high;
    header.key_low = label.key.low;
    header.scale = std::bit_cast<std::uint64_t>(label.scale);
    header.rows = arrays.permutation.size();
    header.supernodes = arrays.first.size() - 1;
    header.listed_rows = arrays.row.size();
    header.entries = arrays.value.size();
    const Parts parts = parts_of(arrays);
    for (std::size_t k = 0; k < parts.size(); ++k)
        header.array_hash[k] = hash_bytes(parts[k]);
    header.hash = hash_of(header);
    return header;
}

/// Bytes from here to the end, or -1.
std::int64_t bytes_left(std::istream& in)
{
    const auto here = in.tellg();
    in.seekg(0, std::ios::end);
    const auto end = in.tellg();
    in.seekg(here);
    return in ? std::int64_t(end - here) : -1;
}

template <class T> bool read_array(std::istream& in, std::span<T> values)
{
    return bool(
        in.read(reinterpret_cast<char*>(values.data()), std::streamsize(values.size_bytes())));
}

} // namespace

void write_factor(const std::string& path, const FactorLabel& label, const SupernodalFactor& factor)
{
    const FactorArrays arrays = factor.arrays();
    const Header header = header_of(label, arrays);
    std::vector<std::string_view> all{{reinterpret_cast<const char*>(&header), sizeof header}};
    for (const std::string_view part : parts_of(arrays))
        all.push_back(part);
    // A lost cache is no loss: the disk may take its time.
    write_file(path, all, Flush::to_system);
}

std::string factor_bytes(const FactorLabel& label, const SupernodalFactor& factor)
{
    const FactorArrays arrays = factor.arrays();
    const Header header = header_of(label, arrays);
    std::string bytes(reinterpret_cast<const char*>(&header), sizeof header);
    for (const std::string_view part : parts_of(arrays))
        bytes.append(part);
    return bytes;
}

std::string read_factor(std::istream& in, FactorLabel& label, SupernodalFactor& factor,
                        const SupernodalOptions& options, Checksums checksums)
{
    factor = SupernodalFactor();
    Header header;
    if (!in.read(reinterpret_cast<char*>(&header), sizeof header)) return "cut off";
    if (std::string_view(header.magic.data(), header.magic.size()) != kMagic) return "no factor";
    if (header.byte_order != kByteOrder) return "of a machine with another byte order";
    if (header.version != kVersion) return "of version " + std::to_string(header.version);
    if (checksums == Checksums::verify && header.hash != hash_of(header)) return "damaged";
    label = {{header.key_high, header.key_low}, std::bit_cast<double>(header.scale)};

    constexpr std::uint64_t most = std::numeric_limits<std::int32_t>::max();
    for (const std::uint64_t size :
         {header.rows, header.supernodes, header.listed_rows, header.entries})
        if (size < 1 || size >= most) return "damaged";
    const std::uint64_t expected =
        4 * (header.rows + 3 * (header.supernodes + 1) + header.listed_rows) + 8 * header.entries;
    if (const std::int64_t left = bytes_left(in); left < 0 || std::uint64_t(left) != expected)
        return "cut off, or too long";

    const auto fill = [&](const FactorSpace& space) {
        const bool there = read_array(in, space.permutation) && read_array(in, space.first) &&
                           read_array(in, space.row_start) && read_array(in, space.start) &&
                           read_array(in, space.row) && read_array(in, space.value);
        if (!there || checksums == Checksums::ignore) return there;
        const Parts parts = parts_of(
            {space.permutation, space.first, space.row_start, space.start, space.row, space.value});
        for (std::size_t k = 0; k < parts.size(); ++k)
            if (header.array_hash[k] != hash_bytes(parts[k])) return false;
        return true;
    };
    const FactorSizes sizes{std::int64_t(header.rows), std::int64_t(header.supernodes),
                            std::int64_t(header.listed_rows), std::int64_t(header.entries)};
    return factor.restore(sizes, fill, options) ? "" : "damaged";
}

} // namespace amontons
