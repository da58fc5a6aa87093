// Time of a step by phase, against the number of elements and of contacts.
//
//     wire_step_bench [DIR] [MOST]   CSV files and SVG plots into DIR (default docs/results);
//                                    at most MOST elements (default 3200)
//     wire_step_bench DIR MOST elements|contacts|coaxial   one family
//
// Families of scenes, each a wire in a narrow bend. "elements": 200 mm of the same wire with
// contact points 2.5 mm apart, in ever finer elements. "contacts": elements of 2.5 mm, a bend and a
// wire that grow, so that contacts grow along. "coaxial": as "contacts", a catheter over the wire;
// half of the elements are its own. The last 100 steps, of 0.4 mm, are measured.

#include "mesh/generate/tube.hpp"
#include "solver/step/simulation.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fmt/format.h>
#include <string>
#include <vector>

using namespace amontons;

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kElement = 2.5e-3, kStep = 0.4e-3;
constexpr double kLength = 0.2; // pushed in before the measurement [m]
constexpr int kMeasured = 100;

struct Times {
    double elements = 0, detection = 0, contact = 0, rest = 0, total = 0, iterations = 0;
};

struct Point {
    int elements = 0;
    double contacts = 0;
    Times median, p99;
    std::string failed;
};

struct Record : StepObserver {
    std::vector<Times> steps;
    std::vector<int> contacts;
    PhaseSeconds before;
    void on_step(const StepRecord& r) override
    {
        const PhaseSeconds& p = r.phases;
        Times t;
        t.elements = p.free_motion - before.free_motion;
        t.detection = p.detection - before.detection;
        t.contact = p.contact_solve - before.contact_solve;
        t.total = r.seconds;
        t.rest = t.total - t.elements - t.detection - t.contact;
        t.iterations = r.iterations;
        before = p;
        steps.push_back(t);
        contacts.push_back(int(r.contacts.size()));
    }
};

double quantile(std::vector<Times> list, std::size_t from, double Times::*what, double q)
{
    std::vector<double> v;
    for (std::size_t i = from; i < list.size(); ++i)
        v.push_back(list[i].*what);
    std::sort(v.begin(), v.end());
    return v.empty() ? 0 : v[std::min(v.size() - 1, std::size_t(q * double(v.size())))];
}

enum class Family { elements, contacts, coaxial };

Point measure(int elements, Family which)
{
    const bool coaxial = which == Family::coaxial;
    const bool many_contacts = which != Family::elements;
    // "elements": the same wire, tube and contact points, ever finer elements.
    const double element = many_contacts ? kElement : kLength / elements;
    const double end = kMeasured * kStep, length = coaxial         ? elements / 2 * kElement
                                                   : many_contacts ? elements * kElement
                                                                   : kLength;
    const double feed = many_contacts ? kElement : kStep; // a step while the wire is pushed in
    Scene scene;
    scene.order = {"tube", "wire"};
    scene.obstacles.resize(1);
    scene.obstacles[0].name = "tube";
    BeamInput wire;
    wire.name = "wire";
    BeamSegment g;
    g.length = element * std::ceil((length + end) / element + 10);
    g.radius = 4.445e-4;
    g.EI = {5.2e-4, 5.2e-4};
    g.GJ = {4e-4, 4e-4};
    g.EA = {5000, 5000};
    g.element = element;
    wire.segments = {g};
    wire.contact_spacing = kElement;
    // A step is as long in time while feeding as while measuring.
    const double steps = length / feed;
    wire.insertion = {{0, 0}, {1, length}, {1 + kMeasured / steps, length + end}};
    scene.beams = {wire};
    scene.contact = {{{"wire", "tube"}, which == Family::contacts ? 0.0 : 0.05}};
    if (coaxial) {
        BeamInput catheter = wire;
        catheter.name = "catheter";
        catheter.segments[0].radius = 8.35e-4;
        catheter.segments[0].inner_radius = 5e-4;
        catheter.segments[0].EI = {1.9e-4, 1.9e-4};
        catheter.segments[0].GJ = {1.5e-4, 1.5e-4};
        scene.beams.push_back(catheter);
        scene.order.push_back("catheter");
        scene.contact.push_back({{"catheter", "tube"}, 0.05});
        scene.contact.push_back({{"wire", "catheter"}, 0.05});
    }
    scene.time.end = wire.insertion.back()[0];
    scene.time.step = 1 / steps;

    const double radius = coaxial ? 1.4e-3 : 1e-3;
    Centreline line(Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY(), radius);
    line.append_line(0.02, radius);
    line.append_arc(many_contacts ? (length + end) / (1.5 * kPi) : (length + end) / (1.4 * kPi),
                    many_contacts ? 1.6 * kPi : 1.5 * kPi, 0, radius);
    std::vector<Obstacle> obstacles;
    obstacles.push_back({"tube", make_tube({line, 0})});
    Record record;
    std::atomic<bool> never{false};
    const std::unique_ptr<Simulation> simulation = make_simulation(scene, std::move(obstacles));
    const RunSummary s = simulation->run(record, never);
    Point p;
    p.elements = elements;
    if (s.status != "done") p.failed = s.message;
    const std::size_t from =
        record.steps.size() > std::size_t(kMeasured) ? record.steps.size() - kMeasured : 0;
    for (double Times::*what : {&Times::elements, &Times::detection, &Times::contact, &Times::rest,
                                &Times::total, &Times::iterations}) {
        p.median.*what = quantile(record.steps, from, what, 0.5);
        p.p99.*what = quantile(record.steps, from, what, 0.99);
    }
    for (std::size_t i = from; i < record.contacts.size(); ++i)
        p.contacts += double(record.contacts[i]) / double(record.contacts.size() - from);
    return p;
}

/// Slope of log(time) over log(x), least squares.
double exponent(const std::vector<Point>& points, double Times::*what)
{
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (const Point& p : points) {
        if (!(p.median.*what > 0)) continue;
        const double x = std::log(double(p.elements)), y = std::log(p.median.*what);
        n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

void plot(const std::string& directory, const std::string& name, const char* title)
{
    FILE* pipe = popen("gnuplot", "w");
    if (!pipe) return;
    fmt::print(pipe,
               "set terminal svg size 720,480 background 'white'\nset output '{0}/{1}.svg'\n"
               "set datafile separator ','\nset logscale xy\nset grid\nset key left top\n"
               "set title '{2}'\nset xlabel 'elements'\nset ylabel 'median time of a step [ms]'\n"
               "plot for [i=3:7] '{0}/{1}.csv' using 1:i with linespoints title columnhead(i)\n",
               directory, name, title);
    pclose(pipe);
}

void family(const std::string& directory, const std::string& name, Family which, int most,
            const char* title)
{
    std::vector<Point> points;
    FILE* csv = std::fopen((directory + "/" + name + ".csv").c_str(), "w");
    if (!csv) {
        fmt::print(stderr, "{}/{}.csv cannot be written\n", directory, name);
        std::exit(2);
    }
    fmt::print(csv, "elements,contacts,elements [ms],detection [ms],contact solve [ms],rest [ms],"
                    "total [ms],p99 [ms],iterations\n");
    for (int n = 100; n <= most; n *= 2) {
        const Point p = measure(n, which);
        const auto line = fmt::format(
            "{},{:.1f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{:.1f}\n", n, p.contacts,
            1e3 * p.median.elements, 1e3 * p.median.detection, 1e3 * p.median.contact,
            1e3 * p.median.rest, 1e3 * p.median.total, 1e3 * p.p99.total, p.median.iterations);
        fmt::print(csv, "{}", line);
        std::fflush(csv);
        fmt::print("{:<10} {}", name, line);
        if (!p.failed.empty())
            fmt::print("           {}\n", p.failed);
        else
            points.push_back(p);
        std::fflush(stdout);
    }
    std::fclose(csv);
    if (points.size() > 1)
        fmt::print(
            "{:<10} exponents: total {:.2f}, elements {:.2f}, detection {:.2f}, contact solve "
            "{:.2f}\n",
            name, exponent(points, &Times::total), exponent(points, &Times::elements),
            exponent(points, &Times::detection), exponent(points, &Times::contact));
    plot(directory, name, title);
}

} // namespace

int main(int argc, char** argv)
{
    if (argc > 1 && argv[1][0] == '-') {
        fmt::print(stderr, "wire_step_bench [FOLDER] [most elements] [elements|contacts|coaxial]\n");
        return 2;
    }
    const std::string directory = argc > 1 ? argv[1] : "docs/results";
    const int most = argc > 2 ? std::atoi(argv[2]) : 3200;
    std::filesystem::create_directories(directory);
    const std::string only = argc > 3 ? argv[3] : "";
    const auto one = [&](const char* name, Family which, const char* title) {
        if (only.empty() || only == name)
            family(directory, std::string("step_time_") + name, which, most, title);
    };
    one("elements", Family::elements, "a fixed number of contacts");
    one("contacts", Family::contacts, "contacts grow with the wire");
    one("coaxial", Family::coaxial, "a catheter over a wire");
    return 0;
}
