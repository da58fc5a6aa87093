#include "solver/scene/schema.hpp"

#include "solver/scene/fields.hpp"
#include "solver/scene/json_text.hpp"

#include <cmath>
#include <fmt/format.h>
#include <set>

namespace amontons {
namespace {

/// The struct's own value of a field, as JSON; "" where there is none to show.
std::string default_text(const FieldDeclaration& f, const void* defaults)
{
    if (!f.fallback.empty() || f.required || f.optional || !defaults || !f.member) return "";
    void* member = f.member(const_cast<void*>(defaults)); // examined, not changed
    JsonText out(false);
    switch (f.type) {
    case FieldType::boolean:
        out.value(*static_cast<bool*>(member));
        break;
    case FieldType::integer:
        out.value(*static_cast<int*>(member));
        break;
    case FieldType::number:
        out.value(*static_cast<double*>(member));
        break;
    case FieldType::text:
        if (static_cast<std::string*>(member)->empty()) return "";
        out.value(*static_cast<std::string*>(member));
        break;
    case FieldType::vector: {
        const Vec3& v = *static_cast<Vec3*>(member);
        if (f.uniform && v == Vec3::Constant(v.x())) {
            out.value(v.x());
            break;
        }
        out.open('[').value(v.x()).value(v.y()).value(v.z()).close(']');
        break;
    }
    default:
        return "";
    }
    return out.text();
}

void limits(JsonText& out, const FieldDeclaration& f)
{
    const Allowed& a = f.allowed;
    if (std::isfinite(a.lower)) out.member(a.above ? "exclusiveMinimum" : "minimum", a.lower);
    if (std::isfinite(a.upper)) out.member("maximum", a.upper);
    if (a.least > 0) // 0, or no less
        out.key("not")
            .open('{')
            .member("exclusiveMinimum", 0)
            .member("exclusiveMaximum", a.least)
            .close('}');
}

void number_schema(JsonText& out, const FieldDeclaration& f)
{
    out.open('{').member("type", "number");
    limits(out, f);
    out.close('}');
}

void object_schema(JsonText& out, const ObjectDeclaration& object);

void field_schema(JsonText& out, const FieldDeclaration& f, const void* defaults)
{
    out.open('{');
    std::string description = f.doc;
    if (!f.unit.empty()) description += " [" + f.unit + "]";
    if (!f.fallback.empty()) description += " Default: " + f.fallback + ".";
    out.member("description", description);
    if (const std::string d = default_text(f, defaults); !d.empty()) out.key("default").json(d);
    const auto list_of = [&](int least, int most) {
        out.member("type", "array").member("minItems", least);
        if (most > 0) out.member("maxItems", most);
        out.key("items");
    };
    switch (f.type) {
    case FieldType::boolean:
        out.member("type", "boolean");
        break;
    case FieldType::integer:
        out.member("type", "integer");
        limits(out, f);
        break;
    case FieldType::number:
        out.member("type", "number");
        limits(out, f);
        break;
    case FieldType::pair:
        out.key("oneOf").open('[');
        number_schema(out, f);
        out.open('{');
        list_of(2, 2);
        number_schema(out, f);
        out.close('}').close(']');
        break;
    case FieldType::text:
        out.member("type", "string").member("maxLength", int(f.longest));
        if (f.required) out.member("minLength", 1);
        if (!f.choices.empty()) {
            out.key("enum").open('[');
            for (const std::string& c : f.choices)
                out.value(c);
            out.close(']');
        }
        break;
    case FieldType::two_names:
        list_of(2, 2);
        out.open('{').member("type", "string").member("maxLength", int(f.longest)).close('}');
        break;
    case FieldType::vector:
        if (f.uniform) {
            out.key("oneOf").open('[');
            number_schema(out, f);
            out.open('{');
        }
        list_of(3, 3);
        number_schema(out, f);
        if (f.uniform) out.close('}').close(']');
        break;
    case FieldType::matrix:
        list_of(3, 3);
        out.open('{');
        list_of(3, 3);
        number_schema(out, f);
        out.close('}');
        break;
    case FieldType::curve:
        if (f.over == "time") {
            out.key("oneOf").open('[');
            number_schema(out, f);
            out.open('{');
        }
        list_of(1, 0);
        out.open('{').member("type", "array").member("minItems", 2).member("maxItems", 2);
        out.key("items").open('[').open('{').member("type", "number").close('}');
        number_schema(out, f);
        out.close(']').close('}');
        if (f.over == "time") out.close('}').close(']');
        break;
    case FieldType::object:
        object_schema(out, *f.object);
        break;
    case FieldType::list:
        list_of(int(f.least), 0);
        out.open('{');
        object_schema(out, *f.object);
        out.close('}');
        break;
    case FieldType::numbers:
        list_of(1, 0);
        out.open('{').member("type", "integer");
        limits(out, f);
        out.close('}');
        break;
    case FieldType::by_name:
    case FieldType::named:
        out.member("type", "object").member("minProperties", 1).key("patternProperties").open('{');
        out.key("^[A-Za-z0-9_-]+$").open('{');
        object_schema(out, *f.object);
        out.close('}').close('}').member("additionalProperties", false);
        break;
    }
    out.close('}');
}

/// One object's members; `variant` adds its own fields and fixes the discriminator.
void members(JsonText& out, const ObjectDeclaration& object, const VariantDeclaration* variant)
{
    out.member("type", "object").member("additionalProperties", false);
    std::vector<const FieldDeclaration*> fields;
    for (const FieldDeclaration& f : object.fields)
        fields.push_back(&f);
    if (variant)
        for (const FieldDeclaration& f : variant->fields)
            fields.push_back(&f);
    const bool named = variant && !variant->value.empty();
    out.key("required").open('[');
    if (named) out.value(object.discriminator);
    for (const FieldDeclaration* f : fields)
        if (f->required && f->unless.empty()) out.value(f->name);
    out.close(']');
    out.key("properties").open('{');
    if (object.title == "Scene") out.key("$schema").open('{').member("type", "string").close('}');
    if (named) out.key(object.discriminator).open('{').member("const", variant->value).close('}');
    for (const FieldDeclaration* f : fields) {
        out.key(f->name);
        field_schema(out, *f, object.defaults);
    }
    out.close('}');
}

void object_schema(JsonText& out, const ObjectDeclaration& object)
{
    if (object.variants.empty() && object.shorthand.empty()) {
        members(out, object, nullptr);
        return;
    }
    out.key("oneOf").open('[');
    if (object.variants.empty()) {
        out.open('{');
        members(out, object, nullptr);
        out.close('}');
    }
    if (!object.shorthand.empty())
        out.open('{')
            .member("description", "Its " + object.shorthand + ".")
            .member("type", "string")
            .close('}');
    for (const VariantDeclaration& v : object.variants) {
        out.open('{').member("description", v.doc);
        members(out, object, &v);
        out.close('}');
    }
    out.close(']');
}

void field_table(std::string& page, const std::vector<FieldDeclaration>& fields,
                 const void* defaults)
{
    page += "| field | allowed | default | meaning |\n|---|---|---|---|\n";
    for (const FieldDeclaration& f : fields) {
        std::string fallback = f.required ? "required" : f.fallback;
        for (const std::string& other : f.unless)
            fallback +=
                fmt::format(" {} `{}`", &other == &f.unless.front() ? "without" : "and", other);
        if (fallback.empty()) fallback = default_text(f, defaults);
        page +=
            fmt::format("| `{}` | {} | {} | {} |\n", f.name, allowed_in_words(f), fallback, f.doc);
    }
    page += "\n";
}

void section(std::string& page, const ObjectDeclaration& object, const std::string& path,
             std::set<const ObjectDeclaration*>& done)
{
    if (!done.insert(&object).second) return;
    page += fmt::format("## {}\n`{}`\n\n", object.title, path.empty() ? "the file" : path);
    if (!object.fields.empty()) field_table(page, object.fields, object.defaults);
    for (const VariantDeclaration& v : object.variants) {
        page += v.value.empty()
                    ? fmt::format("Without `{}`: {}\n\n", object.discriminator, v.doc)
                    : fmt::format("`\"{}\": \"{}\"`: {}\n\n", object.discriminator, v.value, v.doc);
        field_table(page, v.fields, object.defaults);
    }
    const auto below = [&](const std::vector<FieldDeclaration>& fields) {
        for (const FieldDeclaration& f : fields) {
            if (!f.object) continue;
            const std::string suffix = f.type == FieldType::list      ? "[]"
                                       : f.type == FieldType::named   ? ".NAME"
                                       : f.type == FieldType::by_name ? ".SET"
                                                                      : "";
            section(page, *f.object, (path.empty() ? "" : path + ".") + f.name + suffix, done);
        }
    };
    below(object.fields);
    for (const VariantDeclaration& v : object.variants)
        below(v.fields);
}

} // namespace

std::string scene_schema()
{
    JsonText out;
    out.open('{').member("$schema", "http://json-schema.org/draft-07/schema#");
    out.member("title", "A scene of amontons").member("description", "All values are SI.");
    object_schema(out, scene_declaration());
    out.close('}');
    return out.text() + "\n";
}

std::string scene_reference()
{
    std::string page =
        "# The scene file\n\n"
        "Generated by `amontons schema --markdown`; do not edit. All values are SI. Comments "
        "(`//`, "
        "`/* */`) are allowed. `--set bodies.wire.segments.0.EI=5e-4` replaces a value from the "
        "command line.\n\n";
    std::set<const ObjectDeclaration*> done;
    section(page, scene_declaration(), "", done);
    while (page.size() > 1 && page[page.size() - 2] == '\n')
        page.pop_back();
    return page;
}

} // namespace amontons
