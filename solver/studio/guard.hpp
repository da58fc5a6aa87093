#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

// Who may send requests, and which: docs/studio.md.

namespace amontons::studio {

/// 128 bits of the system's random numbers, as 32 hexadecimal digits.
/// @throws std::runtime_error  the system has none
std::string random_token();

/// Whether they are the same, in a time that depends on the lengths alone.
bool same_secret(std::string_view a, std::string_view b);

/// "Bearer TOKEN", and nothing else.
bool is_authorised(std::string_view authorization, std::string_view token);

/// This machine by number (of either kind) or by name, with the server's port: a name that another
/// host has pointed at 127.0.0.1 is refused (DNS rebinding).
bool is_own_host(std::string_view host, int port);

/// No origin (not sent by a page), or that of the server's page.
bool is_own_origin(std::string_view origin, int port);

/// The file or folder that a path means, links followed, if it lies in `root`; it need not exist.
/// @param root      absolute, links followed
/// @param relative  as a page sends it: UTF-8, no leading '/'
std::optional<std::filesystem::path> inside(const std::filesystem::path& root,
                                            std::string_view relative);

} // namespace amontons::studio
