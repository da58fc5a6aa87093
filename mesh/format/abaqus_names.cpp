#include "mesh/format/abaqus_names.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <initializer_list>

namespace amontons {

std::int32_t abaqus_face(ElementKind kind, std::string_view label)
{
    constexpr std::array<std::int8_t, 4> tetra{3, 0, 1, 2}; // 1-2-3 1-4-2 2-4-3 3-4-1
    constexpr std::array<std::int8_t, 6> hexa{4, 5, 2, 1, 3, 0};
    if (label.size() != 2 || (label[0] != 'S' && label[0] != 's')) return -1;
    const auto i = static_cast<std::size_t>(label[1] - '1');
    if (kind == ElementKind::H8) return i < 6 ? hexa[i] : -1;
    return i < 4 ? tetra[i] : -1;
}

AbaqusType abaqus_type(const std::string& name)
{
    const std::size_t digits = name.find_first_of(
        "0123456789", name.find("3D") == std::string::npos ? 0 : name.find("3D") + 2);
    const std::string family = name.substr(0, digits);
    std::size_t count = 0;
    for (std::size_t i = digits;
         i < name.size() && std::isdigit(static_cast<unsigned char>(name[i])); ++i)
        count = 10 * count + static_cast<std::size_t>(name[i] - '0');
    const auto is = [&](std::initializer_list<const char*> names) {
        return std::find(names.begin(), names.end(), family) != names.end();
    };
    if (is({"C3D", "DC3D", "AC3D", "F3D", "SC", "CSS"})) {
        if (family.size() >= 3 && count == 4)
            return {AbaqusType::Use::solid, ElementKind::T4, 4, 4};
        if (family.size() >= 3 && count == 10)
            return {AbaqusType::Use::solid, ElementKind::T10, 10, 4};
        if (is({"C3D", "DC3D", "AC3D", "F3D"}) && count == 8)
            return {AbaqusType::Use::solid, ElementKind::H8, 8, 8};
        return {AbaqusType::Use::other_solid, ElementKind::T4, 0, 0};
    }
    if (is({"CPS", "CPE", "CAX", "S", "M3D", "SFM3D", "R3D", "DS", "DC2D", "DCAX"}) &&
        (count == 3 || count == 4 || count == 6 || count == 8))
        return {AbaqusType::Use::facet, ElementKind::T4, count, count == 4 || count == 8 ? 4U : 3U};
    if (family == "STRI") return {AbaqusType::Use::facet, ElementKind::T4, count == 3 ? 3U : 6U, 3};
    return {};
}

} // namespace amontons
