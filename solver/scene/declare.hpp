#pragma once

#include "solver/scene/fields.hpp"
#include "solver/scene/limits.hpp"

#include <string_view>
#include <utility>

// The words that declarations are written in; only the files that declare fields include this.

namespace amontons::declare {

// --- The type of a field follows from the type of its member. ---

/// The type of a field in the schema, by its C++ type.
template <class T> struct TypeOf {
    /// The type of the schema.
    static constexpr FieldType type = FieldType::object;
    /// True if the field may be absent.
    static constexpr bool optional = false;
};
/// Base of TypeOf for plain types.
template <FieldType kType, bool kOptional = false> struct Is {
    /// The type of the schema.
    static constexpr FieldType type = kType;
    /// True if the field may be absent.
    static constexpr bool optional = kOptional;
};
template <> struct TypeOf<bool> : Is<FieldType::boolean> {
};
template <> struct TypeOf<int> : Is<FieldType::integer> {
};
template <> struct TypeOf<double> : Is<FieldType::number> {
};
template <> struct TypeOf<std::optional<double>> : Is<FieldType::number, true> {
};
template <> struct TypeOf<std::array<double, 2>> : Is<FieldType::pair> {
};
template <> struct TypeOf<std::string> : Is<FieldType::text> {
};
template <> struct TypeOf<std::array<std::string, 2>> : Is<FieldType::two_names> {
};
template <> struct TypeOf<Vec3> : Is<FieldType::vector> {
};
template <> struct TypeOf<std::optional<Vec3>> : Is<FieldType::vector, true> {
};
template <> struct TypeOf<std::optional<Mat3>> : Is<FieldType::matrix, true> {
};
template <> struct TypeOf<CurvePoints> : Is<FieldType::curve> {
};
template <> struct TypeOf<std::vector<int>> : Is<FieldType::numbers> {
};

/// Class and type of a pointer to a member.
template <class M> struct MemberOf;
template <class C, class T> struct MemberOf<T C::*> {
    /// The class.
    using Class = C;
    /// The type of the member.
    using Type = T;
};

/// Address of a member in an object.
template <auto kMember> void* member_of(void* object)
{
    using Class = typename MemberOf<decltype(kMember)>::Class;
    return &(static_cast<Class*>(object)->*kMember);
}

/// What is known of a field from the member alone.
struct Member {
    /// The type of the schema.
    FieldType type;
    bool optional;                  ///< the field may be absent
    void* (*address)(void* object); ///< in an object
};
/// The declaration of a field, whatever its member is.
FieldDeclaration field_of_member(const Member& member, std::string_view name, std::string_view unit,
                                 const Allowed& allowed, std::string_view doc);

/// Declares a number, vector or curve with its unit and range.
template <auto kMember>
FieldDeclaration field(std::string_view name, std::string_view unit, const Allowed& allowed,
                       std::string_view doc)
{
    using Type = TypeOf<typename MemberOf<decltype(kMember)>::Type>;
    return field_of_member({Type::type, Type::optional, &member_of<kMember>}, name, unit, allowed,
                           doc);
}

/// A table over something else than time.
template <auto kMember>
FieldDeclaration table(std::string_view name, std::string_view over, std::string_view over_unit,
                       std::string_view unit, std::string_view doc)
{
    FieldDeclaration f = field<kMember>(name, unit, {}, doc);
    f.over = over;
    f.over_unit = over_unit;
    return f;
}

/// Points of a plane: [[x, y], ...].
template <auto kMember> FieldDeclaration corners(std::string_view name, std::string_view doc)
{
    FieldDeclaration f = field<kMember>(name, "m", {}, doc);
    f.over = "x";
    f.over_unit = "m";
    f.places = true;
    return f;
}

/// Three numbers, or one for all of them.
FieldDeclaration or_one(FieldDeclaration f);

/// Declares a text.
template <auto kMember> FieldDeclaration text(std::string_view name, std::string_view doc)
{
    return field<kMember>(name, "", {}, doc);
}

/// A text that is longer than a name may be: of a file, a title.
template <auto kMember> FieldDeclaration long_text(std::string_view name, std::string_view doc)
{
    FieldDeclaration f = text<kMember>(name, doc);
    f.longest = 4000;
    return f;
}

/// Declares an object.
template <auto kMember>
FieldDeclaration object(std::string_view name, const ObjectDeclaration& fields,
                        std::string_view doc)
{
    FieldDeclaration f = field<kMember>(name, "", {}, doc);
    f.object = &fields;
    return f;
}

/// Fields that stand together in the file and apart in the struct.
FieldDeclaration group(std::string_view name, const ObjectDeclaration& fields,
                       std::string_view doc);

/// Declares a list of objects.
template <auto kMember>
FieldDeclaration list(std::string_view name, const ObjectDeclaration& fields, std::string_view doc)
{
    using List = typename MemberOf<decltype(kMember)>::Type;
    FieldDeclaration f = field<kMember>(name, "", {}, doc);
    f.type = FieldType::list;
    f.object = &fields;
    f.append = [](void* items) -> void* { return &static_cast<List*>(items)->emplace_back(); };
    f.size = [](const void* items) { return static_cast<const List*>(items)->size(); };
    f.item = [](void* items, std::size_t i) -> void* { return &(*static_cast<List*>(items))[i]; };
    return f;
}

/// A list whose items stand in the file each under its `name`.
template <auto kMember>
FieldDeclaration by_name(std::string_view name, const ObjectDeclaration& fields,
                         std::string_view doc)
{
    using Item = typename MemberOf<decltype(kMember)>::Type::value_type;
    FieldDeclaration f = list<kMember>(name, fields, doc);
    f.type = FieldType::by_name;
    f.name_of = [](void* item) -> std::string& { return static_cast<Item*>(item)->name; };
    return f;
}

/// A list that has this many items or more where it is given.
FieldDeclaration no_fewer(std::size_t least, FieldDeclaration f);

/// Makes a field required.
FieldDeclaration required(FieldDeclaration f);

/// Makes a field required unless one of the others is there.
FieldDeclaration required_unless(std::vector<std::string> other, FieldDeclaration f);

/// Not written beside one of these, which give it.
FieldDeclaration replaced_by(std::vector<std::string> other, FieldDeclaration f);

/// Describes in words the default of a field.
FieldDeclaration fallback(std::string words, FieldDeclaration f);

/// Restricts a text to choices.
FieldDeclaration choice(std::vector<std::string> choices, FieldDeclaration f);

/// Any number.
constexpr Allowed kAny{};
/// Numbers > 0.
inline Allowed positive()
{
    Allowed a;
    a.lower = 0;
    a.above = true;
    return a;
}
/// Numbers >= lower.
inline Allowed at_least(double lower)
{
    Allowed a;
    a.lower = lower;
    return a;
}
/// Numbers > lower and <= upper.
inline Allowed above(double lower, double upper)
{
    Allowed a;
    a.lower = lower;
    a.upper = upper;
    a.above = true;
    return a;
}
/// Numbers >= lower and <= upper.
inline Allowed between(double lower, double upper)
{
    Allowed a;
    a.lower = lower;
    a.upper = upper;
    return a;
}
/// Vectors that are not zero.
inline Allowed direction()
{
    Allowed a;
    a.nonzero = true;
    return a;
}

/// Default values of an object.
template <class T> const void* defaults_of()
{
    static const T defaults{};
    return &defaults;
}

/// An object that need not be there and records that it was given.
template <class T>
ObjectDeclaration optional_object(std::string title, std::vector<FieldDeclaration> fields)
{
    ObjectDeclaration d{std::move(title), std::move(fields), "", {}, defaults_of<T>()};
    d.complete = [](void* object, const std::function<bool(const char*)>&) {
        static_cast<T*>(object)->given = true;
    };
    d.given = [](const void* object) { return static_cast<const T*>(object)->given; };
    return d;
}

/// Appends a body of a kind to the scene.
template <auto kBodies> void* append_body(Scene& scene, const std::string& name)
{
    auto& body = (scene.*kBodies).emplace_back();
    body.name = name;
    scene.order.push_back(name);
    return &body;
}

/// The body of a name; nullptr: none.
template <auto kBodies> void* find_body(Scene& scene, const std::string& name)
{
    for (auto& body : scene.*kBodies)
        if (body.name == name) return &body;
    return nullptr;
}

} // namespace amontons::declare
