#include "solver/output/live_frame.hpp"

#include "solver/scene/json_text.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace amontons {
namespace {

static_assert(std::endian::native == std::endian::little);
constexpr std::size_t kMostExact = 20000; // points that are sent as floats
constexpr double kHalfRange = 32767;

/// The arrays, and what the header specifies of each.
struct ArraysOut {
    std::string bytes;
    JsonText& json;

    template <class T>
    void add(const std::string& name, const char* type, const std::vector<T>& numbers, int columns)
    {
        bytes.resize((bytes.size() + 7) / 8 * 8);
        json.open('{').member("name", name).member("type", type).key("shape").open('[');
        json.value(std::int64_t(numbers.size()) / columns).value(std::int64_t(columns)).close(']');
        json.member("offset", std::int64_t(bytes.size()));
        bytes.append(reinterpret_cast<const char*>(numbers.data()), sizeof(T) * numbers.size());
    }
};

void add_points(ArraysOut& out, const std::string& name, const std::vector<float>& points)
{
    const bool finite = std::ranges::all_of(points, [](float x) { return std::isfinite(x); });
    if (points.size() / 3 <= kMostExact || !finite) {
        out.add(name, "f32", points, 3);
        out.json.close('}');
        return;
    }
    std::array<double, 3> low{points[0], points[1], points[2]}, high = low;
    for (std::size_t i = 0; i < points.size(); ++i) {
        low[i % 3] = std::min<double>(low[i % 3], points[i]);
        high[i % 3] = std::max<double>(high[i % 3], points[i]);
    }
    double half = 0;
    for (std::size_t k = 0; k < 3; ++k)
        half = std::max(half, (high[k] - low[k]) / 2);
    const double scale = half > 0 ? half / kHalfRange : 1;
    std::vector<std::int16_t> coarse(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double x = (points[i] - (low[i % 3] + high[i % 3]) / 2) / scale;
        coarse[i] = static_cast<std::int16_t>(std::lround(std::clamp(x, -kHalfRange, kHalfRange)));
    }
    out.add(name, "i16", coarse, 3);
    out.json.member("scale", scale).key("shift").open('[');
    for (std::size_t k = 0; k < 3; ++k)
        out.json.value((low[k] + high[k]) / 2);
    out.json.close(']').close('}');
}

} // namespace

std::string live_frame_bytes(const ViewFrame& frame, const LiveFrameHead& head)
{
    constexpr const char* kKinds[] = {"wall", "wire", "solid", "rigid"};
    JsonText json(false);
    json.open('{').member("seq", std::int64_t(head.sequence));
    json.member("before", std::int64_t(head.before)).member("step", head.step);
    json.member("time", head.time).member("done", head.done).member("caption", frame.caption);
    json.key("bodies").open('[');
    for (const ViewShape& s : frame.shapes)
        json.open('{').member("name", s.name).member("kind", kKinds[s.kind]).close('}');
    json.close(']').key("names").open('[');
    for (const std::string& name : frame.names)
        json.value(name);
    json.close(']').key("arrays").open('[');
    ArraysOut out{{}, json};
    for (const ViewShape& s : frame.shapes) {
        add_points(out, s.name + "/points", s.points);
        if (!s.triangles.empty()) {
            out.add(s.name + "/triangles", "i32", s.triangles, 3);
            json.close('}');
        }
        if (!s.faces.empty()) {
            out.add(s.name + "/faces", "i32", s.faces, 1);
            json.close('}');
        }
        if (!s.values.empty()) {
            out.add(s.name + "/values", "f32", s.values, 1);
            json.close('}');
        }
    }
    out.add("/contacts", "f32", frame.contacts, 6); // no body has an empty name
    json.close('}');
    out.add("/normal_forces", "f32", frame.normal_forces, 3);
    json.close('}');
    out.add("/pairs", "i32", frame.pairs, 2);
    json.close('}').close(']').close('}');
    std::string header = json.text();
    header.resize((header.size() + 7) / 8 * 8, ' ');
    const auto length = static_cast<std::uint32_t>(header.size());
    std::string bytes = "AMF1";
    bytes.append(reinterpret_cast<const char*>(&length), sizeof length);
    return bytes + header + out.bytes;
}

} // namespace amontons
