#include "solver/studio/guard.hpp"

#include <array>
#include <cstdint>
#include <stdexcept>
#include <sys/random.h>

namespace fs = std::filesystem;

namespace amontons::studio {

std::string random_token()
{
    std::array<unsigned char, 16> bytes{};
    if (::getrandom(bytes.data(), bytes.size(), 0) != ssize_t(bytes.size()))
        throw std::runtime_error("the system gives no random numbers");
    constexpr char kDigits[] = "0123456789abcdef";
    std::string token;
    for (const unsigned char b : bytes) {
        token += kDigits[b >> 4];
        token += kDigits[b & 15];
    }
    return token;
}

bool same_secret(std::string_view a, std::string_view b)
{
    if (a.size() != b.size()) return false;
    volatile unsigned char differs = 0; // volatile: no compiler ends the loop early
    for (std::size_t i = 0; i < a.size(); ++i)
        differs = static_cast<unsigned char>(differs | (a[i] ^ b[i]));
    return differs == 0;
}

bool is_authorised(std::string_view authorization, std::string_view token)
{
    constexpr std::string_view kHead = "Bearer ";
    return authorization.substr(0, kHead.size()) == kHead &&
           same_secret(authorization.substr(kHead.size()), token);
}

bool is_own_host(std::string_view host, int port)
{
    const std::string tail = ":" + std::to_string(port);
    return host == "127.0.0.1" + tail || host == "[::1]" + tail || host == "localhost" + tail;
}

bool is_own_origin(std::string_view origin, int port)
{
    constexpr std::string_view kHead = "http://";
    return origin.empty() || (origin.substr(0, kHead.size()) == kHead &&
                              is_own_host(origin.substr(kHead.size()), port));
}

std::optional<fs::path> inside(const fs::path& root, std::string_view relative)
{
    if (relative.find('\0') != std::string_view::npos || relative.substr(0, 1) == "/")
        return std::nullopt;
    std::error_code error;
    const fs::path path = fs::weakly_canonical(root / fs::path(relative), error);
    if (error) return std::nullopt;
    const fs::path from_root = path.lexically_relative(root);
    if (from_root.empty() || *from_root.begin() == "..") return std::nullopt;
    return path;
}

} // namespace amontons::studio
