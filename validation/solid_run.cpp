#include "validation/solid_run.hpp"

#include "mesh/format/read_volume.hpp"
#include "solver/obstacle/build.hpp"

#include <atomic>
#include <filesystem>
#include <fmt/format.h>
#include <limits>
#include <random>
#include <stdexcept>

namespace amontons::validation {
namespace {

struct CollectBodies : StepObserver {
    SolidRun& run;
    bool keep;
    CollectBodies(SolidRun& r, bool k) : run(r), keep(k) {}
    void on_step(const StepRecord& record) override
    {
        run.steps.push_back(record);
        if (keep) run.bodies.push_back(run.simulation->body_records());
    }
};

} // namespace

SolidScene::SolidScene(std::string title)
{
    scene.title = std::move(title);
    scene.time.step = scene.time.end = 1;
}

SolidScene::~SolidScene()
{
    std::error_code ignored; // a folder that stays is no failure of a case
    if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

std::string SolidScene::path(const std::string& file)
{
    if (folder_.empty()) {
        std::random_device random;
        folder_ = (std::filesystem::temp_directory_path() /
                   fmt::format("amontons-{:08x}{:08x}", random(), random()))
                      .string();
        std::filesystem::create_directories(folder_);
    }
    return folder_ + "/" + file;
}

SolidInput& SolidScene::solid(const std::string& name, double youngs_modulus, double poisson_ratio,
                              const VolumeMesh& mesh)
{
    SolidInput s;
    s.name = name;
    s.mesh.file = path(name + ".msh");
    write_volume(s.mesh.file, mesh, GmshOptions{false, true});
    s.youngs_modulus = youngs_modulus;
    s.poisson_ratio = poisson_ratio;
    scene.order.push_back(name);
    return scene.solids.emplace_back(std::move(s));
}

SolidInput& SolidScene::block(const std::string& name, double youngs_modulus, double poisson_ratio,
                              const Vec3& low, const Vec3& high, const Vec3& cells,
                              const std::string& element)
{
    SolidInput s;
    s.name = name;
    s.mesh.generate = "box";
    s.mesh.centre = 0.5 * (low + high);
    s.mesh.size = high - low;
    s.mesh.cells = cells;
    s.mesh.element = element;
    s.youngs_modulus = youngs_modulus;
    s.poisson_ratio = poisson_ratio;
    scene.order.push_back(name);
    return scene.solids.emplace_back(std::move(s));
}

RigidInput& SolidScene::rigid(const std::string& name, const ShapeInput& shape)
{
    RigidInput r;
    r.name = name;
    r.shape = shape;
    scene.order.push_back(name);
    return scene.rigids.emplace_back(std::move(r));
}

void SolidScene::plane(const std::string& name, const Vec3& point, const Vec3& normal)
{
    ObstacleInput o;
    o.name = name;
    o.surface.generate = "plane";
    o.surface.centre = point;
    o.surface.axis = normal;
    scene.order.push_back(name);
    scene.obstacles.push_back(o);
}

ContactLaw& SolidScene::touch(const std::string& a, const std::string& b, double friction,
                              const std::string& a_surface, const std::string& b_surface)
{
    ContactLaw law;
    law.between = {a, b};
    law.surfaces = {a_surface, b_surface};
    law.friction = friction;
    law.sliding = "small";
    return scene.contact.emplace_back(std::move(law));
}

HoldInput hold(const std::string& set, const CurvePoints& x, const CurvePoints& y,
               const CurvePoints& z)
{
    return {set, x, y, z};
}

CurvePoints still()
{
    return at_once(0);
}

CurvePoints at_once(double value)
{
    return {{0, value}};
}

LoadInput pressure(const std::string& set, double value)
{
    LoadInput l;
    l.set = set;
    l.pressure = at_once(value);
    return l;
}

LoadInput traction(const std::string& set, const Vec3& value)
{
    LoadInput l;
    l.set = set;
    l.traction = value;
    return l;
}

double SolidRun::quantity(const std::string& name, int step) const
{
    const StepRecord& r = step < 0 ? steps.back() : steps.at(std::size_t(step));
    for (const Quantity& q : r.quantities)
        if (q.name == name) return q.value;
    throw std::out_of_range("no quantity " + name);
}

Vec3 SolidRun::vector(const std::string& name, int step) const
{
    return {quantity(name + "_x", step), quantity(name + "_y", step), quantity(name + "_z", step)};
}

SolidRun try_run(const Scene& scene, bool keep_bodies)
{
    SolidRun r;
    r.simulation = make_simulation(scene, build_obstacles(scene));
    CollectBodies collect(r, keep_bodies);
    const std::atomic<bool> never{false};
    r.summary = r.simulation->run(collect, never);
    return r;
}

SolidRun run_solids(const Scene& scene, bool keep_bodies)
{
    SolidRun r = try_run(scene, keep_bodies);
    if (r.summary.status != "done") throw std::runtime_error(r.summary.message);
    return r;
}

std::vector<Vec3> displacements(const BodyRecord& body)
{
    for (const Field& f : body.point_fields)
        if (f.name == "displacement") {
            std::vector<Vec3> u;
            for (std::size_t i = 0; i + 2 < f.values.size(); i += 3)
                u.emplace_back(f.values[i], f.values[i + 1], f.values[i + 2]);
            return u;
        }
    throw std::out_of_range("no displacement of " + body.name);
}

std::vector<Vec3> first_places(const BodyRecord& body)
{
    std::vector<Vec3> x = displacements(body);
    for (std::size_t i = 0; i < x.size(); ++i)
        x[i] = body.points[i] - x[i];
    return x;
}

std::size_t nearest_node(const BodyRecord& body, const Vec3& place)
{
    const std::vector<Vec3> x = first_places(body);
    std::size_t best = 0;
    for (std::size_t i = 0; i < x.size(); ++i)
        if ((x[i] - place).norm() < (x[best] - place).norm()) best = i;
    return best;
}

const BodyRecord& body_of(const std::vector<BodyRecord>& bodies, const std::string& name)
{
    for (const BodyRecord& b : bodies)
        if (b.name == name) return b;
    throw std::out_of_range("no body " + name);
}

double certified(const SolidRun& run, double error)
{
    return run.summary.uncertified_steps > 0 ? std::numeric_limits<double>::quiet_NaN() : error;
}

void add_certificates(std::vector<Measured>& rows, const SolidRun& run, const std::string& of)
{
    rows.push_back(at_most("steps without certificate" + of, run.summary.uncertified_steps, 0));
    rows.back().note =
        fmt::format("{} steps, worst error {:.1e}, {} contacts at most", run.summary.steps,
                    run.summary.worst_error, run.summary.contacts_max);
}

} // namespace amontons::validation
