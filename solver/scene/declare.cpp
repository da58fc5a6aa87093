#include "solver/scene/declare.hpp"

#include <algorithm>

namespace amontons {

FieldDeclaration::FieldDeclaration() = default;
FieldDeclaration::FieldDeclaration(const FieldDeclaration&) = default;
FieldDeclaration::FieldDeclaration(FieldDeclaration&&) noexcept = default;
FieldDeclaration& FieldDeclaration::operator=(const FieldDeclaration&) = default;
FieldDeclaration& FieldDeclaration::operator=(FieldDeclaration&&) noexcept = default;
FieldDeclaration::~FieldDeclaration() = default;

namespace declare {
namespace {

constexpr double kMostInteger = 1e9; ///< of an int (number)

} // namespace

FieldDeclaration field_of_member(const Member& member, std::string_view name, std::string_view unit,
                                 const Allowed& allowed, std::string_view doc)
{
    FieldDeclaration f;
    f.name = name;
    f.type = member.type;
    f.optional = member.optional;
    f.unit = unit;
    f.allowed = within_limits(allowed, unit);
    if (f.type == FieldType::integer || f.type == FieldType::numbers)
        f.allowed.upper = std::min(f.allowed.upper, kMostInteger);
    f.doc = doc;
    f.member = member.address;
    return f;
}

FieldDeclaration or_one(FieldDeclaration f)
{
    f.uniform = true;
    return f;
}

FieldDeclaration group(std::string_view name, const ObjectDeclaration& fields, std::string_view doc)
{
    FieldDeclaration f;
    f.name = name;
    f.type = FieldType::object;
    f.doc = doc;
    f.member = [](void* object) { return object; };
    f.object = &fields;
    return f;
}

FieldDeclaration no_fewer(std::size_t least, FieldDeclaration f)
{
    f.least = least;
    return f;
}

FieldDeclaration required(FieldDeclaration f)
{
    f.required = true;
    if (f.type == FieldType::list && f.least == 0) f.least = 1;
    return f;
}

FieldDeclaration required_unless(std::vector<std::string> other, FieldDeclaration f)
{
    f.unless = std::move(other);
    return required(std::move(f));
}

FieldDeclaration replaced_by(std::vector<std::string> other, FieldDeclaration f)
{
    f.unless = std::move(other);
    return f;
}

FieldDeclaration fallback(std::string words, FieldDeclaration f)
{
    f.fallback = std::move(words);
    return f;
}

FieldDeclaration choice(std::vector<std::string> choices, FieldDeclaration f)
{
    f.choices = std::move(choices);
    return f;
}

} // namespace declare
} // namespace amontons
