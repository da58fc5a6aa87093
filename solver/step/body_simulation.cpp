#include "solver/step/body_simulation.hpp"

#include "mesh/base/curve.hpp"
#include "mesh/base/phase_timer.hpp"
#include "solver/body/rigid_body.hpp"
#include "solver/body/solid_body.hpp"
#include "solver/step/body_build.hpp"
#include "solver/step/byte_stream.hpp"
#include "solver/step/recorded_problem.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

namespace amontons {
namespace {

constexpr double kDefaultSmallest = 1.0 / 1024; // of the longest step
constexpr double kSticks = 1e-9;                // slip per step below this share of the body sticks
constexpr int kBallFacets = 24;

/// Every curve whose knots a step must not pass.
std::vector<const CurvePoints*> curves_of(const Scene& scene)
{
    std::vector<const CurvePoints*> all;
    const auto drive = [&](const DriveInput& d) {
        all.insert(all.end(), {&d.x, &d.y, &d.z, &d.angle});
    };
    for (const SolidInput& s : scene.solids) {
        drive(s.drive);
        for (const HoldInput& h : s.hold)
            all.insert(all.end(), {&h.x, &h.y, &h.z});
        for (const LoadInput& l : s.loads)
            all.insert(all.end(), {&l.pressure, &l.over});
    }
    for (const RigidInput& r : scene.rigids) {
        drive(r.drive);
        all.push_back(&r.over);
    }
    std::erase_if(all, [](const CurvePoints* c) { return c->empty(); });
    return all;
}

/// A shape as triangles, for pictures.
SurfaceMesh picture_of(const RigidShape& shape)
{
    SurfaceMesh m;
    if (const auto* triangles = std::get_if<TriangleShape>(&shape)) return triangles->mesh;
    const auto ring = [&](double radius, double z, int n) {
        for (int i = 0; i < n; ++i) {
            const double a = 2 * 3.14159265358979323846 * i / n;
            m.points.emplace_back(radius * std::cos(a), radius * std::sin(a), z);
        }
    };
    const auto band = [&](int from, int to, int n) {
        for (int i = 0; i < n; ++i) {
            const int j = (i + 1) % n;
            m.triangles.push_back({from + i, from + j, to + j});
            m.triangles.push_back({from + i, to + j, to + i});
        }
    };
    const auto fan = [&](int tip, int from, int n, bool up) {
        for (int i = 0; i < n; ++i) {
            const int j = (i + 1) % n;
            if (up)
                m.triangles.push_back({tip, from + i, from + j});
            else
                m.triangles.push_back({tip, from + j, from + i});
        }
    };
    const int n = kBallFacets;
    if (const auto* box = std::get_if<Box>(&shape)) {
        for (int i = 0; i < 8; ++i)
            m.points.emplace_back((i & 1 ? 1 : -1) * box->half_extents.x(),
                                  (i & 2 ? 1 : -1) * box->half_extents.y(),
                                  (i & 4 ? 1 : -1) * box->half_extents.z());
        m.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                       {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    } else if (const auto* ball = std::get_if<Ball>(&shape)) {
        m.points.emplace_back(0, 0, -ball->radius);
        for (int k = 1; k < n / 2; ++k) {
            const double a = 3.14159265358979323846 * k / (n / 2);
            ring(ball->radius * std::sin(a), -ball->radius * std::cos(a), n);
        }
        m.points.emplace_back(0, 0, ball->radius);
        const int last = 1 + (n / 2 - 2) * n;
        fan(0, 1, n, false);
        for (int k = 0; k + 2 < n / 2; ++k)
            band(1 + k * n, 1 + (k + 1) * n, n);
        fan(int(m.points.size()) - 1, last, n, true);
    } else if (const auto* cylinder = std::get_if<Cylinder>(&shape)) {
        m.points.emplace_back(0, 0, -cylinder->half_length);
        ring(cylinder->radius, -cylinder->half_length, n);
        ring(cylinder->radius, cylinder->half_length, n);
        m.points.emplace_back(0, 0, cylinder->half_length);
        fan(0, 1, n, false);
        band(1, 1 + n, n);
        fan(1 + 2 * n, 1 + n, n, true);
    }
    return m;
}

double von_mises(const Vec6& s)
{
    const double a = s[0] - s[1], b = s[1] - s[2], c = s[2] - s[0];
    return std::sqrt(0.5 * (a * a + b * b + c * c) + 3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
}

Vec6 turned(const Vec6& s, const Mat3& R)
{
    Mat3 m;
    m << s[0], s[3], s[5], s[3], s[1], s[4], s[5], s[4], s[2];
    const Mat3 t = R * m * R.transpose();
    Vec6 out;
    out << t(0, 0), t(1, 1), t(2, 2), t(0, 1), t(1, 2), t(0, 2);
    return out;
}

} // namespace

struct BodySimulation::State {
    Scene scene;
    std::vector<Obstacle> obstacles;
    std::vector<Issue> warnings;
    SimulationOptions options;
    std::vector<std::string> messages;
    std::unique_ptr<BodySystem> system;
    std::vector<const CurvePoints*> curves;
    BodyStepReport last;

    bool ready = false, started = false;
    double time = 0, step_length = 0;
    int step = 0, retries = 0;
    double contacts_sum = 0;
    EnergyRecord energy;
    double elastic_start = 0, kinetic_start = 0;
    RunSummary summary;

    double smallest() const
    {
        return scene.time.smallest_step > 0 ? scene.time.smallest_step
                                            : kDefaultSmallest * scene.time.step;
    }
    bool dynamic() const { return scene.time.kind == "dynamic"; }
    double next_stop() const
    {
        double next = scene.time.end;
        for (const CurvePoints* c : curves)
            for (const auto& p : *c)
                if (p[0] > time * (1 + 1e-12) && p[0] < next) next = p[0];
        return next;
    }
    void make_ready();
    bool advance(double h);
    StepRecord record(double h, double seconds);
    void add_quantities(StepRecord& out) const;
    void finish();
};

/// The offline stage, once.
void BodySimulation::State::make_ready()
{
    if (ready) return;
    ready = true;
    const Stopwatch watch;
    StepInput input;
    input.h = dynamic() ? scene.time.step : 0;
    input.dynamic = dynamic();
    input.theta = scene.time.theta;
    input.gravity = scene.gravity;
    for (const BodyRef& b : system->refs)
        if (b.solid) {
            b.solid->expect_steps((scene.time.end - time) / scene.time.step);
            b.solid->make_ready(input, options.cache, messages);
        }
    summary.seconds.offline += watch.seconds();
}

/// One step; either all bodies move or none.
bool BodySimulation::State::advance(double h)
{
    StepInput input;
    input.start = time;
    input.h = h;
    input.dynamic = dynamic() && h > 0;
    input.theta = scene.time.theta;
    input.gravity = scene.gravity;
    BodyStepOptions settings;
    settings.tolerance = scene.accuracy.contact;
    settings.solver = contact_solver(scene.accuracy.solver);
    settings.threads = options.threads;
    last = try_body_step(*system, input, settings);
    summary.seconds.free_motion += last.free_motion;
    summary.seconds.detection += last.detection;
    summary.seconds.compliance += last.compliance;
    summary.seconds.contact_solve += last.contact_solve;
    summary.seconds.correction += last.correction;
    if (!last.accepted) return false;
    time = input.end();
    energy.work += last.energy.work;
    energy.work_absolute += last.energy.work_absolute;
    energy.friction += last.friction;
    energy.released += last.energy.dissipated - (dynamic() ? last.normal_work : 0);
    energy.elastic = last.energy.elastic - elastic_start;
    energy.kinetic = last.energy.kinetic - kinetic_start;
    return true;
}

void BodySimulation::State::add_quantities(StepRecord& out) const
{
    const auto vector = [&](const std::string& name, const char* unit, const Vec3& v) {
        const char* axes[] = {"_x", "_y", "_z"};
        for (int i = 0; i < 3; ++i)
            out.quantities.push_back({name + axes[i], unit, v[i]});
    };
    const std::vector<ContactPair>& pairs = system->finder.pairs();
    std::vector<Vec3> force(pairs.size(), Vec3::Zero());
    std::vector<double> pressure(pairs.size(), 0);
    for (std::size_t c = 0; c < last.contacts.contact.size(); ++c) {
        const BodyContact& k = last.contacts.contact[c];
        force[std::size_t(k.pair)] += last.force[c];
        if (k.area > 0)
            pressure[std::size_t(k.pair)] =
                std::max(pressure[std::size_t(k.pair)], k.frame.col(0).dot(last.force[c]) / k.area);
    }
    for (std::size_t p = 0; p < pairs.size(); ++p) {
        if (!pairs[p].named) continue; // there may be thousands
        const std::string name = system->refs[std::size_t(pairs[p].a)].name + "_on_" +
                                 (pairs[p].b < 0 ? obstacles[std::size_t(pairs[p].obstacle)].name
                                                 : system->refs[std::size_t(pairs[p].b)].name);
        vector(name + "_force", "N", force[p]);
        if (system->refs[std::size_t(pairs[p].a)].solid)
            out.quantities.push_back({name + "_max_pressure", "Pa", pressure[p]});
    }
    std::size_t solid = 0;
    for (const BodyRef& b : system->refs) {
        if (b.rigid) {
            vector(b.name, "m", b.rigid->centre());
            if (dynamic()) vector(b.name + "_velocity", "m/s", b.rigid->centre_velocity());
            if (dynamic()) vector(b.name + "_spin", "rad/s", b.rigid->spin());
            continue;
        }
        const SolidInput& input = scene.solids[solid++];
        const std::vector<Vec3> reactions = b.solid->reactions();
        for (std::size_t k = 0; k < reactions.size(); ++k)
            vector(b.name + "_" + input.hold[k].set + "_force", "N", reactions[k]);
        double largest = 0;
        const std::span<const Vec3> now = b.solid->places(), first = b.solid->first_places();
        // Of the nodes that may touch, which are known without the rest; else of all.
        for (const std::int32_t node : b.solid->touching())
            largest = std::max(largest, (now[std::size_t(node)] - first[std::size_t(node)]).norm());
        if (b.solid->touching().empty()) {
            b.solid->complete();
            for (std::size_t i = 0; i < now.size(); ++i)
                largest = std::max(largest, (now[i] - first[i]).norm());
        }
        out.quantities.push_back({b.name + "_max_displacement", "m", largest});
    }
    Vec3 momentum = Vec3::Zero(), angular = Vec3::Zero();
    if (dynamic()) {
        for (const BodyRef& b : system->refs) {
            momentum += b.body->momentum();
            angular += b.body->angular_momentum();
        }
        vector("momentum", "kg m/s", momentum);
        vector("angular_momentum", "kg m^2/s", angular);
    }
    std::vector<double> joint(scene.couplings.size(), 0);
    for (std::size_t r = 0; r < system->couplings.size(); ++r)
        joint[std::size_t(system->couplings[r].input)] +=
            last.coupling_force.size() > r ? std::pow(last.coupling_force[r], 2) : 0;
    for (std::size_t k = 0; k < joint.size(); ++k)
        out.quantities.push_back({fmt::format("coupling_{}_force", k), "N", std::sqrt(joint[k])});
}

StepRecord BodySimulation::State::record(double h, double seconds)
{
    StepRecord out;
    out.step = step;
    out.time = time;
    out.step_length = h;
    out.seconds = seconds;
    out.iterations = last.iterations;
    out.factorisations = last.factorisations;
    out.retries = retries;
    out.energy = energy;
    for (const std::string& r : last.remarks)
        out.remark += (out.remark.empty() ? "" : "; ") + r;
    out.certificate.error = last.error;
    out.certificate.tolerance = std::max(last.threshold, scene.accuracy.contact);
    out.certificate.worst_penetration = last.penetration;
    out.certificate.worst_cone_violation = last.cone;
    out.certificate.certified = out.certificate.error <= out.certificate.tolerance;
    const auto number = [&](int body, int obstacle) { // obstacles first, then bodies
        return body < 0 ? obstacle : int(obstacles.size()) + body;
    };
    const std::vector<ContactPair>& pairs = system->finder.pairs();
    for (std::size_t c = 0; c < last.contacts.contact.size(); ++c) {
        const BodyContact& k = last.contacts.contact[c];
        if (last.force[c].isZero()) continue;
        const ContactPair& pair = pairs[std::size_t(k.pair)];
        ContactRecord r;
        r.point = k.point;
        r.force = last.force[c];
        r.normal = k.frame.col(0);
        r.slip = last.slip[c];
        r.normal_force = r.normal.dot(r.force);
        r.clustered_force = r.normal_force;
        r.gap = k.gap;
        r.pressure = k.area > 0 ? r.normal_force / k.area : 0;
        r.area = k.area;
        const Vec3 tangential = r.force - r.normal_force * r.normal;
        const double size = system->refs[std::size_t(k.a)].body->size();
        const bool slips = tangential.norm() >= (1 - 1e-6) * pair.friction * r.normal_force ||
                           r.slip.norm() > kSticks * size;
        r.status = slips ? ContactStatus::slip : ContactStatus::stick;
        r.body_a = number(k.a, 0);
        r.body_b = number(k.b, pair.obstacle);
        out.contacts.push_back(r);
    }
    add_quantities(out);
    return out;
}

void BodySimulation::State::finish()
{
    summary.steps = step;
    summary.time = time;
    summary.energy = energy;
    summary.contacts_mean = step > 0 ? contacts_sum / step : 0;
}

BodySimulation::BodySimulation(const Scene& scene, std::vector<Obstacle> obstacles,
                               const SimulationOptions& options)
    : state_(std::make_unique<State>())
{
    State& s = *state_;
    s.scene = scene;
    s.obstacles = std::move(obstacles);
    s.options = options;
    s.step_length = scene.time.step;
    s.system = build_bodies(s.scene, s.obstacles, s.warnings);
    s.curves = curves_of(s.scene);
}

BodySimulation::~BodySimulation() = default;

RunSummary BodySimulation::run(StepObserver& observer, const std::atomic<bool>& stop)
{
    State& s = *state_;
    RunSummary& sum = s.summary;
    sum.status = "running";
    sum.message.clear();
    const auto finish = [&](const char* status, std::string message) {
        sum.status = status;
        sum.message = std::move(message);
        s.finish();
        return sum;
    };
    const auto observe = [&](StepRecord r) {
        const Stopwatch watch;
        r.phases = sum.seconds;
        sum.quantities = r.quantities;
        s.finish();
        observer.on_step(r);
        sum.seconds.output += watch.seconds();
    };
    s.make_ready();
    if (!s.started) {
        // Quasi-static: the balance that the first loads and places ask for.
        if (!s.dynamic() && !s.advance(0))
            return finish("failed", "the initial state: " + s.last.refusal);
        if (s.dynamic()) {
            for (const BodyRef& b : s.system->refs)
                s.kinetic_start += b.body->kinetic_energy();
        }
        s.started = true;
        s.elastic_start += s.energy.elastic;
        s.energy = {};
        observe(s.record(0, 0));
    }
    const double end = s.scene.time.end;
    while (s.time < end * (1 - 1e-12)) {
        if (stop) return finish("interrupted", "interrupted by the user");
        const Stopwatch watch;
        const double reach = s.next_stop() - s.time;
        double h = std::min(s.step_length, reach);
        if (reach - h < 1e-6 * s.scene.time.step) h = reach; // no sliver before a knot
        s.retries = 0;
        while (!s.advance(h)) {
            if (h <= s.smallest() * (1 + 1e-9))
                return finish("failed", fmt::format("step {} (t = {:.6g} s): {}", s.step + 1,
                                                    s.time, s.last.refusal));
            h = std::max(0.5 * h, s.smallest());
            ++s.retries;
        }
        ++s.step;
        if (std::abs(s.time - (s.next_stop())) < 1e-12 * end) s.time = s.next_stop();
        s.step_length = std::min(2 * h, s.scene.time.step);
        if (h == reach && s.retries == 0) s.step_length = s.scene.time.step;
        StepRecord r = s.record(h, watch.seconds());
        sum.step_seconds.push_back(r.seconds);
        sum.contacts_max = std::max(sum.contacts_max, int(r.contacts.size()));
        s.contacts_sum += double(r.contacts.size());
        sum.worst_error = std::max(sum.worst_error, r.certificate.error);
        sum.worst_penetration = std::max(sum.worst_penetration, r.certificate.worst_penetration);
        sum.worst_cone_violation =
            std::max(sum.worst_cone_violation, r.certificate.worst_cone_violation);
        if (!r.certificate.certified) ++sum.uncertified_steps;
        observe(r);
    }
    return finish("done", "");
}

const std::vector<Obstacle>& BodySimulation::obstacles() const
{
    return state_->obstacles;
}

std::vector<BodyPlan> BodySimulation::plan() const
{
    std::vector<BodyPlan> plan;
    for (const Obstacle& o : state_->obstacles)
        plan.push_back({o.name, "obstacle", 0});
    for (const BodyRef& b : state_->system->refs)
        plan.push_back({b.name, b.rigid ? "rigid" : "solid",
                        b.rigid ? b.body->unknowns() : 3 * int(b.solid->mesh().nodes.size())});
    return plan;
}

std::vector<double> BodySimulation::max_contact_force(std::size_t obstacle) const
{
    return std::vector<double>(state_->obstacles[obstacle].model.surface.points.size(), 0);
}

std::vector<Issue> BodySimulation::warnings() const
{
    return state_->warnings;
}

std::vector<std::string> BodySimulation::messages() const
{
    return state_->messages;
}

std::vector<RecordedProblem> BodySimulation::contact_problems() const
{
    const BodyStepReport& r = state_->last;
    if (r.recorded.mu.size() == 0) return {};
    RecordedProblem p;
    p.problem = r.recorded;
    p.reaction = r.recorded_reaction;
    p.contact = r.recorded_identity;
    return {p};
}

std::vector<BodyRecord> BodySimulation::body_records() const
{
    const State& s = *state_;
    std::vector<BodyRecord> all;
    for (std::size_t b = 0; b < s.system->refs.size(); ++b) {
        const BodyRef& ref = s.system->refs[b];
        BodyRecord r;
        r.name = ref.name;
        if (ref.rigid) {
            const SurfaceMesh picture = picture_of(ref.rigid->shape());
            const Placement at = ref.rigid->placement();
            for (const Vec3& X : picture.points)
                r.points.push_back(at * X);
            for (const auto& t : picture.triangles)
                r.triangles.push_back({t[0], t[1], t[2]});
            Field velocity{"velocity", "m/s", 3, {}};
            for (const Vec3& x : r.points) {
                const Vec3 v = ref.rigid->velocity({{}, x});
                velocity.values.insert(velocity.values.end(), v.data(), v.data() + 3);
            }
            r.point_fields.push_back(std::move(velocity));
            all.push_back(std::move(r));
            continue;
        }
        ref.solid->complete();
        const SolidBody& solid = *ref.solid;
        r.elements = &solid.mesh();
        r.points.assign(solid.places().begin(), solid.places().end());
        const std::size_t n = r.points.size();
        Field moved{"displacement", "m", 3, {}};
        for (std::size_t i = 0; i < n; ++i) {
            const Vec3 d = r.points[i] - solid.first_places()[i];
            moved.values.insert(moved.values.end(), d.data(), d.data() + 3);
        }
        std::vector<Vec6> stress;
        std::vector<double> energy;
        solid.stresses(stress, energy);
        Field cauchy{"stress", "Pa", 6, {}}, mises{"von_mises", "Pa", 1, {}},
            density{"strain_energy_density", "J/m^3", 1, energy};
        const Mat3 R = solid.frame().turn.toRotationMatrix();
        std::vector<Vec6> nodal(n, Vec6::Zero());
        std::vector<double> shares(n, 0);
        for_each_element(solid.mesh(), [&](std::int32_t e, ElementKind, auto nodes) {
            const Vec6 t = turned(stress[std::size_t(e)], R * solid.element_rotation(e));
            cauchy.values.insert(cauchy.values.end(), t.data(), t.data() + 6);
            mises.values.push_back(von_mises(t));
            for (const std::int32_t node : nodes) {
                nodal[std::size_t(node)] += t;
                shares[std::size_t(node)] += 1;
            }
        });
        Field smooth{"stress_averaged", "Pa", 6, {}},
            smooth_mises{"von_mises_averaged", "Pa", 1, {}};
        for (std::size_t i = 0; i < n; ++i) {
            const Vec6 t = nodal[i] / std::max(1.0, shares[i]);
            smooth.values.insert(smooth.values.end(), t.data(), t.data() + 6);
            smooth_mises.values.push_back(von_mises(t));
        }
        // Pressure and traction on the body where it carries the contacts' functions.
        Field pressure{"contact_pressure", "Pa", 1, std::vector<double>(n, 0.0)};
        Field traction{"contact_traction", "Pa", 3, std::vector<double>(3 * n, 0.0)};
        for (std::size_t c = 0; c < s.last.contacts.contact.size(); ++c) {
            const BodyContact& k = s.last.contacts.contact[c];
            if (k.a != int(b) || !(k.area > 0)) continue;
            const auto node = std::size_t(k.id);
            pressure.values[node] += k.frame.col(0).dot(s.last.force[c]) / k.area;
            for (std::size_t i = 0; i < 3; ++i)
                traction.values[3 * node + i] += s.last.force[c][Eigen::Index(i)] / k.area;
        }
        r.point_fields = {std::move(moved), std::move(smooth), std::move(smooth_mises),
                          std::move(pressure), std::move(traction)};
        r.cell_fields = {std::move(cauchy), std::move(mises), std::move(density)};
        all.push_back(std::move(r));
    }
    return all;
}

std::vector<std::byte> BodySimulation::save() const
{
    const State& s = *state_;
    ByteWriter out;
    out.value(s.started);
    out.value(s.time);
    out.value(s.step_length);
    out.value(s.step);
    out.value(s.contacts_sum);
    out.value(s.energy);
    out.value(s.elastic_start);
    out.value(s.kinetic_start);
    for (const auto& b : s.system->bodies)
        out.vector(b->state());
    std::vector<std::int64_t> keys;
    std::vector<double> forces;
    for (const auto& [key, f] : s.system->warm) {
        keys.insert(keys.end(), {key.pair, key.id});
        forces.insert(forces.end(), f.data(), f.data() + 3);
    }
    out.vector(keys);
    out.vector(forces);
    out.value(s.summary.seconds);
    out.value(s.summary.contacts_max);
    out.value(s.summary.worst_error);
    out.value(s.summary.worst_penetration);
    out.value(s.summary.worst_cone_violation);
    out.value(s.summary.uncertified_steps);
    out.vector(s.summary.step_seconds);
    return out.take();
}

void BodySimulation::restore(const std::vector<std::byte>& state)
{
    // Read into copies first: a damaged state changes nothing.
    State& s = *state_;
    s.make_ready(); // a solid's state is of what its offline stage finds
    ByteReader in(state);
    const auto started = in.value<bool>();
    const auto time = in.value<double>();
    const auto step_length = in.value<double>();
    const auto step = in.value<int>();
    const auto contacts_sum = in.value<double>();
    const auto energy = in.value<EnergyRecord>();
    const auto elastic_start = in.value<double>();
    const auto kinetic_start = in.value<double>();
    std::vector<std::vector<double>> bodies;
    for (const auto& b : s.system->bodies)
        bodies.push_back(in.exactly<double>(b->state().size()));
    const auto keys = in.vector<std::int64_t>(1u << 28);
    const auto forces = in.vector<double>(1u << 28);
    if (keys.size() % 2 != 0 || forces.size() * 2 != keys.size() * 3)
        ByteReader::refuse("another number of contacts");
    RunSummary sum;
    sum.seconds = in.value<PhaseSeconds>();
    sum.contacts_max = in.value<int>();
    sum.worst_error = in.value<double>();
    sum.worst_penetration = in.value<double>();
    sum.worst_cone_violation = in.value<double>();
    sum.uncertified_steps = in.value<int>();
    sum.step_seconds = in.vector<double>(1u << 28);
    in.end();

    s.started = started;
    s.time = time;
    s.step_length = step_length;
    s.step = step;
    s.contacts_sum = contacts_sum;
    s.energy = energy;
    s.elastic_start = elastic_start;
    s.kinetic_start = kinetic_start;
    for (std::size_t b = 0; b < bodies.size(); ++b)
        s.system->bodies[b]->set_state(bodies[b]);
    s.system->warm.clear();
    for (std::size_t i = 0; 2 * i < keys.size(); ++i)
        s.system->warm[{int(keys[2 * i]), keys[2 * i + 1]}] =
            Vec3(forces[3 * i], forces[3 * i + 1], forces[3 * i + 2]);
    s.summary = std::move(sum);
}

} // namespace amontons
