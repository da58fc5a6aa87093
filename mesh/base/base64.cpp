#include "mesh/base/base64.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace amontons {
namespace {

constexpr std::string_view kLetters =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

constexpr std::array<std::int8_t, 256> value_of_letters()
{
    std::array<std::int8_t, 256> value{};
    value.fill(-1);
    for (std::size_t i = 0; i < kLetters.size(); ++i)
        value[static_cast<unsigned char>(kLetters[i])] = static_cast<std::int8_t>(i);
    return value;
}

} // namespace

std::string to_base64(std::string_view bytes)
{
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k)
            bits = bits << 8 | (k < n ? static_cast<unsigned char>(bytes[i + k]) : 0u);
        for (std::size_t k = 0; k < 4; ++k)
            text += k <= n ? kLetters[bits >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

std::optional<std::string> from_base64(std::string_view text)
{
    static constexpr std::array<std::int8_t, 256> kValue = value_of_letters();
    if (text.size() % 4 != 0) return std::nullopt;
    std::string bytes;
    bytes.reserve(text.size() / 4 * 3);
    for (std::size_t i = 0; i < text.size(); i += 4) {
        std::size_t letters = 4;
        if (i + 4 == text.size())
            while (letters > 2 && text[i + letters - 1] == '=')
                --letters;
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 4; ++k) {
            const int v = k < letters ? kValue[static_cast<unsigned char>(text[i + k])] : 0;
            if (v < 0) return std::nullopt;
            bits = bits << 6 | static_cast<std::uint32_t>(v);
        }
        for (std::size_t k = 0; k + 1 < letters; ++k)
            bytes += static_cast<char>(bits >> (16 - 8 * k) & 255);
        // What the last letter holds beyond whole bytes is zero: a text has one meaning.
        if (letters < 4 && (bits & (letters == 2 ? 0xffffu : 0xffu)) != 0) return std::nullopt;
    }
    return bytes;
}

} // namespace amontons
