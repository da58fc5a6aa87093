#include "mesh/format/slicer_markups.hpp"

#include "mesh/base/text.hpp"
#include "mesh/format/polyline_builder.hpp"

#include <nlohmann/json.hpp>

namespace amontons {
namespace {

constexpr int kDeepestMarkup = 64; // what copies values recurses

using nlohmann::json;

/// A value in the file and its JSON path.
struct Place {
    const json* value = nullptr;
    std::string path;
};

class MarkupsReader {
public:
    MarkupsReader(double scale, FileIssues& issues) : issues_(issues), builder_(scale, issues) {}

    Polyline read(const json& document)
    {
        const Place curve = the_curve({&document, ""});
        const double sign = sign_of_xy(curve);
        check_unit(curve);
        const Place points = array_in(curve, "controlPoints");
        const json* const radii = radii_of(curve, points.value->size());
        for (std::size_t i = 0; i < points.value->size(); ++i)
            add_point(item(points, i), radii ? &(*radii)[i] : nullptr, sign);
        return builder_.finish();
    }

private:
    static Place item(const Place& array, std::size_t i)
    {
        return {&(*array.value)[i], array.path + "/" + std::to_string(i)};
    }

    static std::string shown(const json& value)
    {
        return quoted_text(value.dump(-1, ' ', false, json::error_handler_t::replace));
    }

    /// The field of an object; its value is null if the object has none.
    Place field(const Place& object, const char* name)
    {
        if (!object.value->is_object())
            issues_.fatal(object.path, shown(*object.value), "an object {...}");
        const auto found = object.value->find(name);
        return {found == object.value->end() ? nullptr : &*found, object.path + "/" + name};
    }

    Place array_in(const Place& object, const char* name)
    {
        const Place place = field(object, name);
        if (!place.value || !place.value->is_array())
            issues_.fatal(place.path, place.value ? shown(*place.value) : "nothing",
                          "an array [...]");
        return place;
    }

    /// A string field, or the default if it is not there.
    std::string string_in(const Place& object, const char* name, const char* otherwise)
    {
        const Place place = field(object, name);
        if (!place.value) return otherwise;
        if (!place.value->is_string()) issues_.fatal(place.path, shown(*place.value), "a string");
        return place.value->get<std::string>();
    }

    Place the_curve(const Place& document)
    {
        const Place markups = array_in(document, "markups");
        Place curve;
        std::string types;
        for (std::size_t i = 0; i < markups.value->size(); ++i) {
            const Place markup = item(markups, i);
            const std::string type = string_in(markup, "type", "");
            types += (types.empty() ? "" : ", ") + quoted_text(type);
            if (type != "Curve") continue;
            if (curve.value)
                issues_.fatal(markup.path, "a second curve", "one \"Curve\" in a file");
            curve = markup;
        }
        if (!curve.value)
            issues_.fatal(markups.path, types.empty() ? "nothing" : types,
                          "a markup of type \"Curve\"");
        return curve;
    }

    double sign_of_xy(const Place& curve)
    {
        const std::string system = string_in(curve, "coordinateSystem", "LPS");
        if (system != "LPS" && system != "RAS")
            issues_.add(curve.path + "/coordinateSystem", quoted_text(system), "LPS or RAS");
        return system == "RAS" ? -1 : 1;
    }

    void check_unit(const Place& curve)
    {
        const std::string unit = string_in(curve, "coordinateUnits", "mm");
        if (unit != "mm") issues_.add(curve.path + "/coordinateUnits", quoted_text(unit), "mm");
    }

    /// The array of radii, one for each control point; null if there is none.
    const json* radii_of(const Place& curve, std::size_t points)
    {
        if (!field(curve, "measurements").value) return nullptr;
        const Place measurements = array_in(curve, "measurements");
        for (std::size_t i = 0; i < measurements.value->size(); ++i) {
            const Place measurement = item(measurements, i);
            if (!same_word(string_in(measurement, "name", ""), "Radius")) continue;
            if (!field(measurement, "controlPointValues").value) continue;
            const Place values = array_in(measurement, "controlPointValues");
            if (values.value->size() != points)
                issues_.fatal(values.path, std::to_string(values.value->size()) + " radii",
                              std::to_string(points) + ", one for each control point");
            if (const std::string unit = string_in(measurement, "units", "mm"); unit != "mm")
                issues_.add(measurement.path + "/units", quoted_text(unit), "mm");
            return values.value;
        }
        return nullptr;
    }

    void add_point(const Place& point, const json* radius, double sign)
    {
        const Place position = field(point, "position");
        // A point that its author has not placed has no position of any meaning.
        const std::string status = string_in(point, "positionStatus", "defined");
        if (status != "defined") return;
        Vec3 x = Vec3::Zero();
        const json* const value = position.value;
        bool valid = value && value->is_array() && value->size() == 3;
        for (std::size_t k = 0; valid && k < 3; ++k) {
            valid = (*value)[k].is_number();
            if (valid) x[static_cast<int>(k)] = (k < 2 ? sign : 1) * (*value)[k].get<double>();
        }
        if (!valid) {
            issues_.add(position.path, value ? shown(*value) : "nothing", "3 numbers [x, y, z]");
            return;
        }
        if (radius && !radius->is_number()) {
            issues_.add(point.path, "radius " + shown(*radius), "a number > 0");
            return;
        }
        builder_.add(x, radius ? std::optional(radius->get<double>()) : std::nullopt, point.path);
    }

    FileIssues& issues_;
    PolylineBuilder builder_;
};

} // namespace

Polyline parse_slicer_markups(std::string_view text, const std::string& file, double scale)
{
    FileIssues issues(file);
    json document;
    try {
        document = json::parse(text, [&](int depth, json::parse_event_t, json&) {
            if (depth > kDeepestMarkup)
                issues.fatal("",
                             "values nested more than " + std::to_string(kDeepestMarkup) + " deep",
                             "a markups file of 3D Slicer");
            return true;
        });
    } catch (const json::parse_error& e) {
        issues.fatal(line_and_column(text, e.byte), "broken JSON: " + std::string(e.what()),
                     "a markups file of 3D Slicer");
    } catch (const json::exception& e) { // a number beyond the range of double
        issues.fatal("", e.what(), "numbers that a double can hold");
    }
    return MarkupsReader(scale, issues).read(document);
}

} // namespace amontons
