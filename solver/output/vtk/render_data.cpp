#include "solver/output/vtk/render_data.hpp"

#include "solver/output/vtk/outer_surface.hpp"
#include "solver/output/vtk/polydata.hpp"
#include "solver/output/vtk/result_files.hpp"

#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkStringArray.h>
#include <vtkUnstructuredGrid.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <set>
#include <stdexcept>

namespace amontons::vtk_module {
namespace {

constexpr double kRoundOff = 1e-6; // of the largest force: not worth a caption

using Collections = std::vector<std::vector<Frame>>;

/// Triangles, but not those of a wire's own surface: they carry its radius.
bool is_wall(const Poly& data)
{
    return data->GetNumberOfPolys() + data->GetNumberOfStrips() > 0 &&
           !data->GetPointData()->HasArray("radius");
}

/// Triangles that move.
bool is_rigid_body(const Poly& data)
{
    return is_wall(data) && data->GetPointData()->HasArray("velocity");
}

Poly read_or_throw(const std::filesystem::path& file)
{
    std::string error;
    Poly data = Poly::Take(read_polydata(file, error));
    if (!data || !error.empty()) // half a file is worse than none
        throw std::runtime_error(error);
    return data;
}

/// Of a body without stress what round-off makes of it is none: it is drawn plain.
void drop_round_off(const Poly& solid)
{
    auto* const below =
        vtkStringArray::SafeDownCast(solid->GetFieldData()->GetAbstractArray("stress_round_off"));
    vtkDataArray* stress = solid->GetPointData()->GetArray("von_mises_averaged");
    if (!below || below->GetNumberOfValues() < 1 || !stress) return;
    double range[2];
    stress->GetRange(range);
    const std::string text = below->GetValue(0);
    if (range[1] <= std::strtod(text.c_str(), nullptr))
        solid->GetPointData()->RemoveArray("von_mises_averaged");
}

Poly read_solid(const std::filesystem::path& file)
{
    std::string error;
    const auto grid = vtkSmartPointer<vtkUnstructuredGrid>::Take(read_grid(file, error));
    if (!grid || !error.empty()) throw std::runtime_error(error);
    Poly surface = outer_surface(grid);
    drop_round_off(surface);
    return surface;
}

/// All that the collections hold at one instant: of each, the last frame not after it.
Instant read_instant(const Collections& collections, double time, std::vector<Poly>& walls)
{
    Instant instant;
    instant.time = -std::numeric_limits<double>::infinity();
    std::set<std::filesystem::path> seen; // two collections may name the same file
    for (const std::vector<Frame>& frames : collections) {
        double shown = -std::numeric_limits<double>::infinity();
        for (const Frame& frame : frames)
            if (frame.time <= time) shown = std::max(shown, frame.time);
        instant.time = std::max(instant.time, shown);
        for (const Frame& frame : frames) {
            if (frame.time != shown || !seen.insert(frame.file.lexically_normal()).second) continue;
            if (frame.file.extension() == ".vtu") {
                instant.solids.push_back(read_solid(frame.file));
                continue;
            }
            const Poly data = read_or_throw(frame.file);
            if (data->GetPointData()->HasArray("force")) {
                instant.contacts.push_back(data);
            } else if (data->GetNumberOfLines() > 0) {
                instant.wires.push_back(data);
                instant.wire_names.push_back(frame.name);
            } else if (is_rigid_body(data)) {
                instant.rigids.push_back(data);
            } else if (is_wall(data)) {
                walls.push_back(data);
            }
        }
    }
    return instant;
}

/// The row of a history at a time: the last one not after it; NaN if there is none.
double value_at(const std::vector<double>& times, const std::vector<double>& values, double time)
{
    const std::size_t rows = std::min(times.size(), values.size());
    double value = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t row = 0; row < rows && times[row] <= time * (1 + 1e-9); ++row)
        value = values[row];
    return value;
}

void write_captions(const std::filesystem::path& history, std::vector<Instant>& instants)
{
    const std::vector<double> times = read_history_column(history, "time");
    const std::vector<std::string> wires = history_prefixes(history, "push_force");
    for (Instant& instant : instants)
        instant.caption = number("t = %.3g s", instant.time);
    for (const std::string& wire : wires) {
        const std::vector<double> depths = read_history_column(history, wire + "depth");
        const std::vector<double> pushes = read_history_column(history, wire + "push_force");
        double largest_push = 0;
        for (const double push : pushes)
            largest_push = std::max(largest_push, std::abs(push));
        const std::string of = wire.empty() ? "" : " of " + wire.substr(0, wire.size() - 1);
        for (Instant& instant : instants) {
            const double depth = value_at(times, depths, instant.time);
            double push = value_at(times, pushes, instant.time);
            if (std::abs(push) < kRoundOff * largest_push) push = 0;
            if (std::isfinite(depth))
                instant.caption +=
                    (wire.empty() ? ",  depth " : "\ndepth" + of + " ") + length_text(depth);
            if (std::isfinite(push))
                instant.caption +=
                    (wire.empty() ? "\npush force" : ",  push") + number(" %.2g N", push);
        }
    }
}

} // namespace

RenderData read_result(const std::filesystem::path& folder)
{
    Collections collections;
    std::set<std::filesystem::path> named;
    double begin = std::numeric_limits<double>::infinity(), end = -begin;
    for (const auto& pvd : collections_in(folder)) {
        std::string error;
        collections.push_back(read_collection(pvd, error));
        if (!error.empty()) throw std::runtime_error(error);
        for (const Frame& frame : collections.back()) {
            named.insert(frame.file.lexically_normal());
            begin = std::min(begin, frame.time);
            end = std::max(end, frame.time);
        }
    }
    if (named.empty())
        throw std::runtime_error(folder.string() + ": no .pvd file with frames of a run");

    RenderData result;
    std::vector<Poly> walls;
    result.instants.push_back(read_instant(collections, end, walls));
    std::vector<Poly> ignored; // the walls of earlier instants: the last ones serve all panels
    for (int quarter = 1; quarter <= 3; ++quarter)
        result.instants.push_back(
            read_instant(collections, begin + 0.25 * quarter * (end - begin), ignored));
    const Instant& last = result.instants.front();
    if (last.wires.empty() && last.solids.empty() && last.rigids.empty())
        throw std::runtime_error(folder.string() +
                                 ": no wire (a polyline), solid (.vtu) or rigid body (triangles "
                                 "with a velocity) in any .pvd file");

    std::vector<std::filesystem::path> loose;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().extension() == ".vtp" && !named.count(entry.path().lexically_normal()))
            loose.push_back(entry.path());
    std::sort(loose.begin(), loose.end());
    for (const auto& file : loose) {
        const Poly data = read_or_throw(file);
        if (is_wall(data)) walls.push_back(data);
    }
    // A run may write a wall twice, at its start and with the forces at its end: draw it once.
    const auto has_force = [](const Poly& wall) {
        return wall->GetPointData()->HasArray("max_contact_force") != 0;
    };
    const bool any = std::any_of(walls.begin(), walls.end(), has_force);
    for (const Poly& wall : walls)
        if (!any || has_force(wall)) result.walls.push_back(wall);
    write_captions(folder / "history.csv", result.instants);
    return result;
}

namespace {

/// A list of words of a file's field data; empty if it has none of the name.
std::vector<std::string> words_of(const Poly& data, const char* name)
{
    std::vector<std::string> words;
    if (const auto* texts =
            vtkStringArray::SafeDownCast(data->GetFieldData()->GetAbstractArray(name)))
        for (vtkIdType i = 0; i < texts->GetNumberOfValues(); ++i)
            words.push_back(const_cast<vtkStringArray*>(texts)->GetValue(i));
    return words;
}

} // namespace

bool holds_wires_alone(const RenderData& result)
{
    const Instant& last = result.instants.front();
    const auto is_vessel = [](const Poly& solid) {
        return solid->GetPointData()->HasArray("contact_force") != 0;
    };
    return !last.wires.empty() && last.rigids.empty() &&
           std::all_of(last.solids.begin(), last.solids.end(), is_vessel);
}

bool touch_walls_alone(const RenderData& result)
{
    for (const Instant& instant : result.instants)
        for (const Poly& data : instant.contacts)
            for (const std::string& kind : words_of(data, "body_kinds"))
                if (kind == "rod") return false;
    return true;
}

std::vector<std::string> pair_names(const RenderData& result,
                                    const std::vector<std::vector<Cluster>>& clusters)
{
    std::vector<std::string> names;
    for (const Instant& instant : result.instants)
        for (const Poly& data : instant.contacts)
            if (names.empty()) names = words_of(data, "body_names");
    std::set<std::array<int, 2>> pairs;
    for (const std::vector<Cluster>& at : clusters)
        for (const Cluster& c : at)
            pairs.insert(c.bodies);
    std::vector<std::string> out;
    for (const auto& [a, b] : pairs)
        if (a >= 0 && b >= 0 && std::max(a, b) < static_cast<int>(names.size()))
            out.push_back(names[static_cast<std::size_t>(b)] + "_on_" +
                          names[static_cast<std::size_t>(a)]);
    return out;
}

std::vector<Cluster> cluster_contacts(const std::vector<Poly>& contacts, double radius,
                                      bool by_pair)
{
    std::vector<Cluster> single;
    for (const Poly& data : contacts) {
        vtkDataArray* force = data->GetPointData()->GetArray("force");
        vtkDataArray* of[] = {data->GetPointData()->GetArray("body_a"),
                              data->GetPointData()->GetArray("body_b")};
        const std::vector<std::string> kinds = words_of(data, "body_kinds");
        for (vtkIdType i = 0; force && i < data->GetNumberOfPoints(); ++i) {
            if (const auto b = of[1] ? static_cast<std::size_t>(of[1]->GetTuple1(i)) : kinds.size();
                !by_pair && b < kinds.size() && kinds[b] == "beam")
                continue; // in a bore
            Cluster contact;
            data->GetPoint(i, contact.point.data());
            force->GetTuple(i, contact.force.data());
            for (double& f : contact.force)
                if (!by_pair) f = -f; // the files hold the force on the first body, the wire
            for (std::size_t k = 0; by_pair && k < 2; ++k)
                if (of[k]) contact.bodies[k] = static_cast<int>(of[k]->GetTuple1(i));
            contact.magnitude = std::sqrt(dot(contact.force, contact.force));
            if (contact.magnitude > 0) single.push_back(contact);
        }
    }
    std::stable_sort(single.begin(), single.end(),
                     [](const Cluster& a, const Cluster& b) { return a.magnitude > b.magnitude; });

    std::vector<bool> taken(single.size(), false);
    std::vector<Cluster> clusters;
    for (std::size_t i = 0; i < single.size(); ++i) {
        if (taken[i]) continue;
        Cluster sum;
        sum.bodies = single[i].bodies;
        double weight = 0;
        for (std::size_t j = i; j < single.size(); ++j) {
            Vec apart{};
            for (std::size_t k = 0; k < 3; ++k)
                apart[k] = single[j].point[k] - single[i].point[k];
            if (taken[j] || dot(apart, apart) > radius * radius ||
                single[j].bodies != single[i].bodies)
                continue;
            taken[j] = true;
            weight += single[j].magnitude;
            for (std::size_t k = 0; k < 3; ++k) {
                sum.point[k] += single[j].magnitude * single[j].point[k];
                sum.force[k] += single[j].force[k];
            }
        }
        for (double& x : sum.point)
            x /= weight;
        sum.magnitude = std::sqrt(dot(sum.force, sum.force));
        clusters.push_back(sum);
    }
    return clusters;
}

std::string number(const char* format, double value)
{
    char text[64];
    std::snprintf(text, sizeof text, format, value);
    return text;
}

bool is_repeated(const RenderData& result, std::size_t i)
{
    const auto before = result.instants.begin() + std::ptrdiff_t(i);
    return std::find_if(result.instants.begin(), before,
                        [&](const Instant& other) { return other.time == before->time; }) != before;
}

std::string length_text(double metres)
{
    const double size = std::abs(metres);
    if (size >= 1 || size == 0) return number("%.3g m", metres);
    return size >= 1e-3 ? number("%.3g mm", metres * 1e3) : number("%.3g \xC2\xB5m", metres * 1e6);
}

} // namespace amontons::vtk_module
