#pragma once

#include "solver/step/simulation.hpp"
#include "validation/measure.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

// Scenes of solids and rigid bodies, made in C++, and what cases need of their runs.

namespace amontons::validation {

/// A scene under construction; meshes that no generator has lie in a folder of its own, which
/// follows it.
class SolidScene {
public:
    explicit SolidScene(std::string title);
    ~SolidScene();
    SolidScene(const SolidScene&) = delete;
    SolidScene& operator=(const SolidScene&) = delete;

    Scene scene;

    /// A solid. The reference holds until the next one is added.
    SolidInput& solid(const std::string& name, double youngs_modulus, double poisson_ratio,
                      const VolumeMesh& mesh);
    /// A block from the program's generator.
    SolidInput& block(const std::string& name, double youngs_modulus, double poisson_ratio,
                      const Vec3& low, const Vec3& high, const Vec3& cells,
                      const std::string& element);
    RigidInput& rigid(const std::string& name, const ShapeInput& shape);
    /// An obstacle whose free space is where the normal points.
    void plane(const std::string& name, const Vec3& point, const Vec3& normal);
    /// A pair of small sliding on the geometry of the start.
    ContactLaw& touch(const std::string& a, const std::string& b, double friction,
                      const std::string& a_surface = "", const std::string& b_surface = "");
    /// A file in the scene's folder.
    std::string path(const std::string& file);

private:
    std::string folder_;
};

HoldInput hold(const std::string& set, const CurvePoints& x, const CurvePoints& y,
               const CurvePoints& z);
/// The value 0 at all times; an empty curve leaves the axis free.
CurvePoints still();
CurvePoints at_once(double value);
LoadInput pressure(const std::string& set, double value);
LoadInput traction(const std::string& set, const Vec3& value);

/// A finished run and its simulation.
struct SolidRun {
    std::unique_ptr<Simulation> simulation;
    RunSummary summary;
    std::vector<StepRecord> steps;               ///< from the initial state on
    std::vector<std::vector<BodyRecord>> bodies; ///< of every step, if requested

    /// A quantity of a step, the last one by default.
    /// @throws std::out_of_range  if there is none of that name
    double quantity(const std::string& name, int step = -1) const;
    Vec3 vector(const std::string& name, int step = -1) const; ///< NAME_x, NAME_y, NAME_z
    const StepRecord& last() const { return steps.back(); }
};

/// Runs to the scene's end; a run that fails is returned as well.
/// @throws InputError
SolidRun try_run(const Scene& scene, bool keep_bodies = false);
/// @throws std::runtime_error  if it does not reach the end
SolidRun run_solids(const Scene& scene, bool keep_bodies = false);

/// Displacement of each node at the end [m].
std::vector<Vec3> displacements(const BodyRecord& body);
/// Places of each node before anything moved [m].
std::vector<Vec3> first_places(const BodyRecord& body);
/// The node nearest to a place of the start.
std::size_t nearest_node(const BodyRecord& body, const Vec3& place);
const BodyRecord& body_of(const std::vector<BodyRecord>& bodies, const std::string& name);

/// Rows for certificates: every step was certified.
/// An error of a run; NaN if one of its steps has no certificate: then it shows nothing.
double certified(const SolidRun& run, double error);

void add_certificates(std::vector<Measured>& rows, const SolidRun& run, const std::string& of = "");

} // namespace amontons::validation
