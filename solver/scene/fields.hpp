#pragma once

#include "solver/scene/scene.hpp"

#include <cstddef>
#include <functional>
#include <limits>
#include <string>
#include <vector>

// Every field of a scene is declared once, in fields.cpp: its name, type, unit, allowed
// range and one line of documentation. The reader, the JSON schema, the reference page and
// the resolved scene in the manifest all walk these declarations; a default is the value of
// a default-constructed struct, so it stands in scene.hpp and nowhere else.

namespace amontons {

/// What a field holds. In brackets: the C++ member it fills.
enum class FieldType {
    boolean,   ///< [bool]
    integer,   ///< [int]
    number,    ///< [double], or [std::optional<double>] if `optional`
    pair,      ///< a number or [start, end] [std::array<double, 2>]
    text,      ///< [std::string]; one of `choices` if there are any
    two_names, ///< [std::array<std::string, 2>]
    vector,    ///< three numbers [Vec3], or [std::optional<Vec3>] if `optional`
    matrix,    ///< three rows of three numbers [std::optional<Mat3>]
    curve,     ///< [[time, value], ...], strictly increasing in time [CurvePoints]; or a table
               ///< over something else
    object,    ///< fields of its own [a struct, or the same struct for a group of fields]
    list,      ///< objects, one after the other [std::vector of structs]
    numbers,   ///< whole numbers, one after the other [std::vector<int>]
    by_name,   ///< objects by name [std::vector of structs]; `name_of` finds where an item's stands
    named      ///< objects by name: the bodies [Scene]
};

/// The numbers that a field allows. NaN and infinity never are.
struct Allowed {
    /// Least value, in the unit of the field.
    double lower = -std::numeric_limits<double>::infinity();
    /// Greatest value, in the unit of the field.
    double upper = std::numeric_limits<double>::infinity();
    bool above = false; ///< the lower bound itself is not allowed
    double least =
        0; ///< what is not 0 is at least this large, of a lower bound of 0 [unit of the field]
    bool nonzero = false; ///< of a vector: it must have a direction
};

struct ObjectDeclaration;

/// One field. `member` finds its value in the struct that it belongs to.
struct FieldDeclaration {
    // In declare.cpp: hundreds are passed on, and each time a kilobyte of code would be compiled.
    FieldDeclaration();
    FieldDeclaration(const FieldDeclaration&);
    FieldDeclaration(FieldDeclaration&&) noexcept;
    FieldDeclaration& operator=(const FieldDeclaration&);
    FieldDeclaration& operator=(FieldDeclaration&&) noexcept;
    ~FieldDeclaration();

    std::string name;
    FieldType type = FieldType::number;
    /// True if the field must be there.
    bool required = false;
    bool optional = false;           ///< the member is a std::optional
    std::vector<std::string> unless; ///< not required beside one of these
    Allowed allowed;
    std::size_t least = 0; ///< list: fewest items of one that is given
    std::string unit;      ///< SI, "" if none
    /// Of a curve: what it is over, and its unit. Over time one number stands for all times.
    std::string over = "time", over_unit = "s";
    bool places = false;  ///< of a curve: points of a plane, in any order
    bool uniform = false; ///< of a vector: one number stands for all three
    std::vector<std::string> choices;
    std::size_t longest = 200; ///< of a text [bytes]
    std::string fallback;      ///< the default in words, where it is not the struct's value
    std::string doc;           ///< one sentence
    /// Address of the member in the object.
    void* (*member)(void* object) = nullptr;
    void* (*append)(void* list) = nullptr;              ///< list: a new last item
    std::size_t (*size)(const void* list) = nullptr;    ///< list
    void* (*item)(void* list, std::size_t i) = nullptr; ///< list
    std::string& (*name_of)(void* item) = nullptr;      ///< by_name: of an item of the list
    const ObjectDeclaration* object = nullptr;          ///< object, list, by_name, named
};

/// One of several shapes of an object, chosen by the value of its discriminator.
struct VariantDeclaration {
    std::string value; ///< of the discriminator; "" when the discriminator is absent
    std::string doc;
    std::vector<FieldDeclaration> fields;
    void* (*append)(Scene& scene, const std::string& name) = nullptr; ///< named
    void* (*find)(Scene& scene, const std::string& name) = nullptr;   ///< named
};

/// The fields of an object: `fields`, and those of one variant where there are variants.
struct ObjectDeclaration {
    std::string title; ///< e.g. "Segment of a beam"
    std::vector<FieldDeclaration> fields;
    std::string discriminator; ///< "" or the name of the field that chooses the variant
    std::vector<VariantDeclaration> variants;
    const void* defaults = nullptr;                 ///< a default-constructed struct
    std::string& (*chosen)(void* object) = nullptr; ///< the discriminator's member, if it has one
    /// Fills the defaults that follow from other fields; null if there are none.
    void (*complete)(void* object, const std::function<bool(const char*)>& given) = nullptr;
    std::string shorthand = {}; ///< a text in the object's place stands for this one field
    /// Whether an object that need not be there was given; null: it always counts.
    bool (*given)(const void* object) = nullptr;
};

/// The declarations of a whole scene; built at the first call.
const ObjectDeclaration& scene_declaration();

/// "> 0 [m]", ">= 0", "one of \"inside\", \"outside\"": what a field allows, in words.
std::string allowed_in_words(const FieldDeclaration& field);

} // namespace amontons
