#pragma once

#include "mesh/base/error.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

// Plain values and vectors of them to bytes and back, in the machine's own layout: the state
// inside a checkpoint, whose frame specifies which machine and scene it belongs to.

namespace amontons {

/// Writes plain values as bytes, for checkpoints.
class ByteWriter {
public:
    /// A plain value.
    template <class T> void value(const T& v)
    {
        static_assert(std::is_trivially_copyable_v<T>);
        const auto* p = reinterpret_cast<const std::byte*>(&v);
        bytes_.insert(bytes_.end(), p, p + sizeof v);
    }
    /// A vector of plain values, with its size.
    template <class T> void vector(const std::vector<T>& v)
    {
        value(std::uint64_t(v.size()));
        for (const T& x : v)
            value(x);
    }
    /// The bytes; the writer is empty afterwards.
    std::vector<std::byte> take() { return std::move(bytes_); }

private:
    std::vector<std::byte> bytes_;
};

/// @throws InputError  where the bytes end early, continue too long, or hold an impossible size
class ByteReader {
public:
    explicit ByteReader(const std::vector<std::byte>& bytes) : bytes_(bytes) {}
    /// A plain value. @throws std::runtime_error if the bytes end
    template <class T> T value()
    {
        static_assert(std::is_trivially_copyable_v<T>);
        if constexpr (std::is_same_v<T, bool>) { // any other byte in a bool is undefined
            const auto v = value<unsigned char>();
            if (v > 1) refuse("neither true nor false");
            return v == 1;
        } else {
            if (bytes_.size() - at_ < sizeof(T)) refuse("an end within a value");
            T v;
            std::memcpy(&v, bytes_.data() + at_, sizeof v);
            at_ += sizeof v;
            return v;
        }
    }
    /// A vector of at most `most` elements.
    template <class T> std::vector<T> vector(std::size_t most)
    {
        const auto size = value<std::uint64_t>();
        if (size > most || size > (bytes_.size() - at_) / sizeof(T)) refuse("an impossible size");
        std::vector<T> v;
        v.reserve(size);
        for (std::uint64_t i = 0; i < size; ++i)
            v.push_back(value<T>());
        return v;
    }
    /// A vector that must have this size.
    template <class T> std::vector<T> exactly(std::size_t size)
    {
        std::vector<T> v = vector<T>(size);
        if (v.size() != size) refuse("another number of unknowns");
        return v;
    }
    /// Checks that all bytes were read.
    void end() const
    {
        if (at_ != bytes_.size()) refuse("bytes behind the end");
    }
    /// Throws: the checkpoint is not readable.
    [[noreturn]] static void refuse(const char* found)
    {
        throw InputError({{"checkpoint", "", found, "the state of this scene"}});
    }

private:
    const std::vector<std::byte>& bytes_;
    std::size_t at_ = 0;
};

} // namespace amontons
