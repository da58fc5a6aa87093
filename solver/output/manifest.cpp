#include "solver/output/manifest.hpp"

#include "solver/output/version.hpp"

#include <Eigen/Core>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fmt/format.h>
#include <memory>
#include <sys/utsname.h>
#include <thread>

namespace amontons {
namespace {

/// The first line of a system file that starts with `key`, without the key.
std::string system_line(const char* file, const std::string& key)
{
    const std::unique_ptr<FILE, int (*)(FILE*)> in(std::fopen(file, "r"), std::fclose);
    char line[512];
    while (in && std::fgets(line, sizeof line, in.get())) {
        std::string text = line;
        if (text.rfind(key, 0) != 0) continue;
        text = text.substr(key.size());
        const std::size_t first = text.find_first_not_of(" \t:");
        const std::size_t last = text.find_last_not_of(" \t\n");
        return first == std::string::npos ? "" : text.substr(first, last - first + 1);
    }
    return "";
}

void write_strings(JsonText& json, const char* name, const std::vector<std::string>& texts)
{
    json.key(name).open('[');
    for (const std::string& t : texts)
        json.value(t);
    json.close(']');
}

} // namespace

std::string program_version()
{
    return AMONTONS_VERSION;
}

std::string program_describe()
{
    return AMONTONS_DESCRIBE;
}

std::string machine_text()
{
    utsname system{};
    ::uname(&system);
    return fmt::format("{} {}, {}, {} cores", system.sysname, system.release,
                       system_line("/proc/cpuinfo", "model name"),
                       std::thread::hardware_concurrency());
}

std::string now_utc()
{
    const std::time_t now = std::time(nullptr);
    std::tm utc{};
    ::gmtime_r(&now, &utc);
    char text[32];
    std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
    return text;
}

double peak_memory()
{
    return 1024 * std::strtod(system_line("/proc/self/status", "VmHWM:").c_str(), nullptr);
}

int exit_code(const RunSummary& summary)
{
    return summary.status == "done" ? 0 : summary.status == "interrupted" ? 130 : 3;
}

void write_certificate(JsonText& json, const RunSummary& s)
{
    json.member("worst_error", s.worst_error);
    json.member("worst_penetration", s.worst_penetration);
    json.member("worst_overlap", s.worst_overlap.depth);
    if (s.worst_overlap.depth > 0) {
        const Vec3& x = s.worst_overlap.point;
        json.key("worst_overlap_at").open('{');
        json.member("a", s.worst_overlap.a).member("b", s.worst_overlap.b);
        json.key("point").open('[').value(x.x()).value(x.y()).value(x.z()).close(']');
        json.member("step", s.worst_overlap.step).close('}');
    }
    write_strings(json, "overlap_not_measured", s.not_measured);
    json.member("worst_cone_violation", s.worst_cone_violation);
    json.member("uncertified_steps", s.uncertified_steps);
}

void write_energy(JsonText& json, const EnergyRecord& e)
{
    json.member("work", e.work).member("work_absolute", e.work_absolute);
    json.member("elastic", e.elastic).member("kinetic", e.kinetic).member("friction", e.friction);
    json.member("elastic_start", e.elastic_start).member("kinetic_start", e.kinetic_start);
    json.member("released", e.released).member("error", e.error());
}

void write_summary(JsonText& json, const RunSummary& s, const std::vector<std::string>& modules,
                   const std::vector<std::string>& warnings)
{
    json.member("status", s.status).member("message", s.message);
    std::vector<std::string> all = warnings;
    all.insert(all.end(), s.warnings.begin(), s.warnings.end());
    write_strings(json, "warnings", all);
    json.member("steps", s.steps).member("time", s.time);
    const PhaseSeconds& t = s.seconds;
    json.key("seconds").open('{');
    json.member("total", t.total).member("read", t.read).member("offline", t.offline);
    json.member("free_motion", t.free_motion).member("detection", t.detection);
    json.member("compliance", t.compliance).member("contact_solve", t.contact_solve);
    json.member("correction", t.correction).member("output", t.output).close('}');
    json.key("contacts")
        .open('{')
        .member("max", s.contacts_max)
        .member("mean", s.contacts_mean)
        .close('}');
    json.key("certificate").open('{');
    write_certificate(json, s);
    json.close('}');
    json.key("undetermined").open('[');
    for (const UndeterminedForce& u : s.undetermined) {
        json.open('{').key("pair").open('[').value(u.a).value(u.b).close(']');
        json.key("directions").open('[');
        if (u.normal) json.value("normal");
        if (u.tangential) json.value("tangential");
        json.close(']');
        json.key("normal_force").open('[').value(u.min).value(u.max).close(']').close('}');
    }
    json.close(']');
    write_strings(json, "undetermined_not_examined", s.undetermined_not_examined);
    json.key("energy").open('{');
    write_energy(json, s.energy);
    json.close('}');
    json.key("snaps").open('[');
    for (const SnapRecord& snap : s.snaps)
        json.open('{')
            .member("step", snap.step)
            .member("time", snap.time)
            .member("depth", snap.depth)
            .member("released", snap.released)
            .close('}');
    json.close(']');
    json.member("peak_memory", peak_memory());
    json.key("peak_memory_after").open('{');
    json.member("read", s.memory.read).member("bodies", s.memory.bodies);
    json.member("offline", s.memory.offline).member("steps", s.memory.steps);
    if (s.memory.all_ranks > 0) json.member("all_ranks", s.memory.all_ranks);
    json.close('}');
    write_strings(json, "modules", modules);
    if (!s.linear.taken.empty())
        json.key("linear")
            .open('{')
            .member("taken", s.linear.taken)
            .member("why", s.linear.why)
            .member("predicted_seconds", s.linear.predicted)
            .member("seconds", s.linear.seconds)
            .close('}');
    json.key("minima").open('{');
    for (const Extremes& e : s.extremes)
        json.member(e.name, e.least);
    json.close('}').key("maxima").open('{');
    for (const Extremes& e : s.extremes)
        json.member(e.name, e.largest);
    json.close('}');
    json.key("quantities").open('{');
    for (const Quantity& q : s.quantities)
        json.member(q.name, q.value);
    for (const NamedText& t : s.texts)
        json.member(t.name, t.value);
    json.close('}');
}

std::string manifest_bytes(const ManifestInput& in, const RunSummary& summary)
{
    utsname system{};
    ::uname(&system);
    JsonText json;
    json.open('{');
    json.key("program").open('{').member("name", "amontons").member("version", program_version());
    json.member("describe", program_describe()).member("build", AMONTONS_BUILD_TYPE);
    json.member("compiler", AMONTONS_COMPILER).close('}');
    json.key("libraries").open('{');
    json.member("eigen", fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION,
                                     EIGEN_MINOR_VERSION));
    json.member("fmt", fmt::format("{}.{}.{}", FMT_VERSION / 10000, FMT_VERSION / 100 % 100,
                                   FMT_VERSION % 100));
    json.close('}');
    json.key("machine").open('{').member("system",
                                         fmt::format("{} {}", system.sysname, system.release));
    json.member("cpu", system_line("/proc/cpuinfo", "model name"));
    json.member("cores", static_cast<int>(std::thread::hardware_concurrency())).close('}');
    write_strings(json, "command", in.command);
    json.member("threads", in.threads).member("resumed", in.resumed);
    json.member("checkpoint", in.checkpoint);
    json.member("started", in.started).member("written", now_utc());
    write_summary(json, summary, in.modules, in.warnings);
    if (summary.status != "running") json.member("exit_code", exit_code(summary));
    write_strings(json, "files", in.files);
    json.key("scene").open('{').member("file", in.scene_file);
    json.member("hash", fmt::format("{:016x}", in.scene_hash));
    json.key("resolved").json(in.resolved_scene).close('}');
    json.close('}');
    return json.text() + "\n";
}

} // namespace amontons
