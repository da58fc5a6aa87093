#include "solver/output/plot.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"

#include <algorithm>
#include <cstdlib>
#include <fcntl.h>
#include <filesystem>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace fs = std::filesystem;

namespace amontons {
namespace {

/// The program's path, or "" if it is not installed.
std::string find_program(const std::string& name)
{
    const char* path = std::getenv("PATH");
    std::string rest = path ? path : "";
    while (!rest.empty()) {
        const std::size_t colon = std::min(rest.find(':'), rest.size());
        const std::string file = rest.substr(0, colon) + "/" + name;
        if (::access(file.c_str(), X_OK) == 0) return file;
        rest.erase(0, colon + 1);
    }
    return "";
}

/// Runs gnuplot on a script in its folder, silently. @return its exit code, or -1
int run_gnuplot(const std::string& gnuplot, const std::string& directory, const std::string& script)
{
    const std::string change = fmt::format("cd '{}'", [&] {
        std::string escaped; // gnuplot doubles a quote within single quotes
        for (const char c : directory)
            escaped += c == '\'' ? "''" : std::string(1, c);
        return escaped;
    }());
    std::string name = gnuplot, option = "-e", command = change, file = script;
    char* arguments[] = {name.data(), option.data(), command.data(), file.data(), nullptr};
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    for (const int stream : {0, 1, 2})
        ::posix_spawn_file_actions_addopen(&actions, stream, "/dev/null", O_RDWR, 0);
    pid_t child = 0;
    const int failed =
        ::posix_spawn(&child, gnuplot.c_str(), &actions, nullptr, arguments, environ);
    ::posix_spawn_file_actions_destroy(&actions);
    int status = 0;
    if (failed != 0 || ::waitpid(child, &status, 0) != child) return -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/// One curve: columns of history.csv and what each is multiplied with.
struct Curve {
    std::string column, title;
    double factor = 1;
    bool second_axis = false;
};

struct Plot {
    std::string name, x, x_label, y_label, second_label;
    double x_factor = 1;
    bool logarithmic = false;
    std::vector<Curve> curves;
};

std::string script_of(const Plot& p)
{
    std::string s =
        fmt::format("# Draw again: gnuplot {0}.gp, in this folder.\n"
                    "set terminal svg size 800,500 font 'Helvetica,14' background rgb 'white'\n"
                    "set output '{0}.svg'\n"
                    "set datafile separator comma\nset datafile columnheaders\n"
                    "set grid\nset key outside top center horizontal noenhanced\n"
                    "set xlabel '{1}'\nset ylabel '{2}'\n",
                    p.name, p.x_label, p.y_label);
    if (p.logarithmic) s += "set logscale y\nset format y '10^{%T}'\n";
    if (!p.second_label.empty())
        s += fmt::format("set y2label '{}'\nset y2tics\nset ytics nomirror\n", p.second_label);
    s += "plot";
    for (const Curve& c : p.curves) {
        const std::string value = fmt::format("(column('{}')*{})", c.column, c.factor);
        s += fmt::format(
            "{} 'history.csv' using (column('{}')*{}):{} {}with lines lw 1.5 title '{}'",
            &c == &p.curves.front() ? "" : ",", p.x, p.x_factor,
            p.logarithmic ? fmt::format("({0} > 0 ? {0} : NaN)", value) : value,
            c.second_axis ? "axes x1y2 " : "", c.title);
    }
    return s + "\n";
}

/// What is before `end` in the columns that end so: "" of a wire alone, "NAME_" of each of
/// several.
std::vector<std::string> prefixes_of(const std::string& header, const std::string& end)
{
    std::vector<std::string> found;
    for (std::size_t at = 0; at < header.size();) {
        const std::size_t comma = std::min(header.find(',', at), header.size());
        const std::string column = header.substr(at, comma - at);
        if (column.ends_with(end)) found.push_back(column.substr(0, column.size() - end.size()));
        at = comma + 1;
    }
    return found;
}

/// Of wires over time: how far each is turned at its base and at its tip; of instruments that are
/// driven one by one also the force and the torque that each takes.
void add_wires(const std::string& header, std::vector<Plot>& plots)
{
    const std::string tip = "tip_rotation [rad]";
    const std::vector<std::string> wires = prefixes_of(header, tip);
    if (wires.empty()) return;
    const auto plot = [](const char* name, const char* label) {
        return Plot{name, "time [s]", "time [s]", label, "", 1, false, {}};
    };
    Plot pushes = plot("pushes", "push force [N]"), torques = plot("torques", "torque [N mm]"),
         turns = plot("turns", "turn [degrees]");
    constexpr double kDegrees = 180 / M_PI;
    for (const std::string& wire : wires) {
        const std::string of = wire.empty() ? "" : " of " + wire.substr(0, wire.size() - 1);
        pushes.curves.push_back({wire + "push_force [N]", "push" + of, 1, false});
        torques.curves.push_back({wire + "torque [N m]", "torque" + of, 1000, false});
        turns.curves.push_back({wire + "base_twist [rad]", "base" + of, kDegrees, false});
        turns.curves.push_back({wire + tip, "tip" + of, kDegrees, false});
    }
    if (wires.size() > 1) plots.insert(plots.end(), {pushes, torques});
    plots.push_back(turns);
}

std::vector<Plot> plots_for(const std::string& header)
{
    const auto has = [&](const std::string& column) {
        return ("," + header + ",").find("," + column + ",") != std::string::npos;
    };
    std::vector<Plot> plots;
    const bool depth = has("depth [m]");
    const std::string x = depth ? "depth [m]" : "time [s]";
    const std::string x_label = depth ? "depth [mm]" : "time [s]";
    const double x_factor = depth ? 1000 : 1;
    if (has("push_force [N]")) {
        Plot p{"forces", x,        x_label, "push force [N]",
               "",       x_factor, false,   {{"push_force [N]", "push force", 1, false}}};
        if (has("torque [N m]")) {
            p.second_label = "torque [N mm]";
            p.curves.push_back({"torque [N m]", "torque", 1000, true});
        }
        plots.push_back(p);
    }
    add_wires(header, plots);
    Plot energy{"energy", "time [s]", "time [s]", "energy [mJ]", "", 1, false, {}};
    for (const char* name : {"work", "elastic", "kinetic", "friction", "released", "energy_error"})
        energy.curves.push_back({std::string(name) + " [J]", name, 1000, false});
    plots.push_back(energy);
    plots.push_back({"steps",
                     "step",
                     "step",
                     "error of the certificate [-], time of a step [s]",
                     "",
                     1,
                     true,
                     {{"certificate_error", "error", 1, false},
                      {"certificate_tolerance", "tolerance", 1, false},
                      {"seconds [s]", "time of the step", 1, false}}});
    return plots;
}

} // namespace

std::vector<std::string> plot_history(const std::string& directory, std::string& message)
{
    message.clear();
    std::vector<std::string> files;
    const std::string gnuplot = find_program("gnuplot");
    try {
        const std::string history = read_file(directory + "/history.csv");
        const std::string header = history.substr(0, history.find('\n'));
        if (std::count(history.begin(), history.end(), '\n') < 3) {
            message = "no plots: the run has fewer than two steps";
            return files;
        }
        for (const Plot& p : plots_for(header)) {
            drop_link(directory + "/" + p.name + ".svg");
            write_file(directory + "/" + p.name + ".gp", script_of(p), Flush::to_system,
                       Links::replace);
            files.push_back(p.name + ".gp");
            if (gnuplot.empty()) continue;
            if (run_gnuplot(gnuplot, directory, p.name + ".gp") == 0)
                files.push_back(p.name + ".svg");
            else
                message = "gnuplot could not draw " + directory + "/" + p.name + ".gp";
        }
    } catch (const WriteError& error) {
        message = std::string("no plots: ") + error.what();
    } catch (const InputError& error) {
        message = std::string("no plots: ") + error.what();
    }
    if (gnuplot.empty() && message.empty())
        message =
            "no plots: gnuplot is not installed (gnuplot-nox); their scripts are in " + directory;
    return files;
}

bool draw_plot(const std::string& directory, const std::string& script)
{
    const std::string gnuplot = find_program("gnuplot");
    return !gnuplot.empty() && run_gnuplot(gnuplot, directory, script) == 0;
}

} // namespace amontons
