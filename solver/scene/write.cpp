// The way back: a scene as JSON, along the declarations that the reader walks.

#include "solver/scene/fields.hpp"
#include "solver/scene/json_text.hpp"
#include "solver/scene/read.hpp"

#include <algorithm>
#include <cmath>

namespace amontons {
namespace {

void write_object(JsonText& out, const std::vector<const FieldDeclaration*>& fields, void* object,
                  Scene& scene);

void write_number(JsonText& out, double v)
{
    if (v == std::floor(v) && std::abs(v) < 1e15)
        out.value(static_cast<std::int64_t>(v));
    else
        out.value(v);
}

void write_vector(JsonText& out, const Vec3& v)
{
    out.open('[').value(v.x()).value(v.y()).value(v.z()).close(']');
}

std::vector<const FieldDeclaration*> all_fields(const ObjectDeclaration& declaration,
                                                const VariantDeclaration* variant)
{
    std::vector<const FieldDeclaration*> all;
    for (const FieldDeclaration& f : declaration.fields)
        all.push_back(&f);
    if (variant)
        for (const FieldDeclaration& f : variant->fields)
            all.push_back(&f);
    return all;
}

const VariantDeclaration* chosen_variant(const ObjectDeclaration& declaration, void* object)
{
    for (const VariantDeclaration& v : declaration.variants)
        if (declaration.chosen && v.value == declaration.chosen(object)) return &v;
    return nullptr;
}

/// False where the value means "not given" (an empty option, text or list, or the default of a
/// field whose default is chosen later): the reader comes to the same without it.
bool is_given(const FieldDeclaration& f, void* member)
{
    switch (f.type) {
    case FieldType::number:
        if (f.optional) return static_cast<std::optional<double>*>(member)->has_value();
        return f.fallback.empty() || *static_cast<double*>(member) != 0;
    case FieldType::pair:
        return f.fallback.empty() ||
               *static_cast<std::array<double, 2>*>(member) != std::array<double, 2>{};
    case FieldType::vector:
        return !f.optional || static_cast<std::optional<Vec3>*>(member)->has_value();
    case FieldType::matrix:
        return static_cast<std::optional<Mat3>*>(member)->has_value();
    case FieldType::text:
        return !static_cast<std::string*>(member)->empty();
    case FieldType::curve:
        return !static_cast<CurvePoints*>(member)->empty();
    case FieldType::list:
    case FieldType::by_name:
        return f.size(member) > 0;
    case FieldType::numbers:
        return !static_cast<std::vector<int>*>(member)->empty();
    case FieldType::two_names: {
        const auto& names = *static_cast<std::array<std::string, 2>*>(member);
        return !names[0].empty() || !names[1].empty();
    }
    case FieldType::object: // one whose required text is missing was never given
        if (f.object->given && !f.object->given(member)) return false;
        for (const FieldDeclaration& inner : f.object->fields)
            if (inner.required && inner.type == FieldType::text &&
                !is_given(inner, inner.member(member)))
                return false;
        return true;
    default:
        return true;
    }
}

void write_value(JsonText& out, const FieldDeclaration& f, void* member, Scene& scene)
{
    switch (f.type) {
    case FieldType::boolean:
        out.value(*static_cast<bool*>(member));
        return;
    case FieldType::integer:
        out.value(*static_cast<int*>(member));
        return;
    case FieldType::number:
        write_number(out, f.optional ? **static_cast<std::optional<double>*>(member)
                                     : *static_cast<double*>(member));
        return;
    case FieldType::pair: {
        const auto& p = *static_cast<std::array<double, 2>*>(member);
        out.open('[').value(p[0]).value(p[1]).close(']');
        return;
    }
    case FieldType::text:
        out.value(*static_cast<std::string*>(member));
        return;
    case FieldType::two_names: {
        const auto& names = *static_cast<std::array<std::string, 2>*>(member);
        out.open('[').value(names[0]).value(names[1]).close(']');
        return;
    }
    case FieldType::vector:
        if (const Vec3& v = *static_cast<Vec3*>(member); f.uniform && v == Vec3::Constant(v.x())) {
            out.value(v.x());
            return;
        }
        write_vector(out, f.optional ? **static_cast<std::optional<Vec3>*>(member)
                                     : *static_cast<Vec3*>(member));
        return;
    case FieldType::matrix:
        out.open('[');
        for (int i = 0; i < 3; ++i)
            write_vector(out, (*static_cast<std::optional<Mat3>*>(member))->row(i).transpose());
        out.close(']');
        return;
    case FieldType::curve:
        out.open('[');
        for (const auto& p : *static_cast<CurvePoints*>(member))
            out.open('[').value(p[0]).value(p[1]).close(']');
        out.close(']');
        return;
    case FieldType::object: {
        const VariantDeclaration* variant = chosen_variant(*f.object, member);
        out.open('{');
        if (variant && !variant->value.empty()) out.member(f.object->discriminator, variant->value);
        write_object(out, all_fields(*f.object, variant), member, scene);
        out.close('}');
        return;
    }
    case FieldType::list:
        out.open('[');
        for (std::size_t i = 0; i < f.size(member); ++i) {
            out.open('{');
            write_object(out, all_fields(*f.object, nullptr), f.item(member, i), scene);
            out.close('}');
        }
        out.close(']');
        return;
    case FieldType::numbers:
        out.open('[');
        for (const int i : *static_cast<std::vector<int>*>(member))
            out.value(i);
        out.close(']');
        return;
    case FieldType::by_name:
        out.open('{');
        for (std::size_t i = 0; i < f.size(member); ++i) {
            void* item = f.item(member, i);
            out.key(f.name_of(item)).open('{');
            write_object(out, all_fields(*f.object, nullptr), item, scene);
            out.close('}');
        }
        out.close('}');
        return;
    case FieldType::named:
        out.open('{');
        for (const std::string& name : scene.order)
            for (const VariantDeclaration& v : f.object->variants)
                if (void* body = v.find(scene, name)) {
                    out.key(name).open('{').member(f.object->discriminator, v.value);
                    write_object(out, all_fields(*f.object, &v), body, scene);
                    out.close('}');
                }
        out.close('}');
        return;
    }
}

void write_object(JsonText& out, const std::vector<const FieldDeclaration*>& fields, void* object,
                  Scene& scene)
{
    for (const FieldDeclaration* f : fields) {
        void* member = f->member(object);
        if (!f->required && !is_given(*f, member)) continue;
        const bool replaced = std::any_of(fields.begin(), fields.end(), [&](const auto* other) {
            return std::find(f->unless.begin(), f->unless.end(), other->name) != f->unless.end() &&
                   is_given(*other, other->member(object));
        });
        if (replaced) continue;
        out.key(f->name);
        write_value(out, *f, member, scene);
    }
}

} // namespace

std::string resolved_scene(const Scene& scene)
{
    Scene copy = scene; // the declarations find members of a scene that may change
    JsonText out;
    out.open('{');
    write_object(out, all_fields(scene_declaration(), nullptr), &copy, copy);
    out.close('}');
    return out.text();
}

} // namespace amontons
