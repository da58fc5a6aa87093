#include "solver/output/problem_recorder.hpp"

#include "mesh/base/file.hpp"
#include "solver/fclib_file.hpp"
#include "solver/module.hpp"
#include "solver/scene/instrument_rods.hpp"
#include "solver/step/recorded_problem.hpp"

#include <filesystem>
#include <fmt/format.h>

namespace amontons {

void check_recorder()
{
    if (find_module("fclib").empty())
        throw InputError(
            {{"(--record)", "", "no FCLib module", "./setup.sh packages, then build again"}});
}

void check_recordable(const Scene& scene)
{
    for (std::size_t k = 0; k < scene.contact.size(); ++k) {
        const auto& [a, b] = scene.contact[k].between;
        if (body_named(scene.beams, a) && body_named(scene.beams, b))
            throw InputError({{scene.file, fmt::format("/contact/{}", k),
                               quoted_text(a) + " in " + quoted_text(b) + ", and --record",
                               "instruments that are not in one another, or no --record: the "
                               "contact problem of nested ones is not written yet"}});
    }
}

ProblemRecorder::ProblemRecorder(const Simulation& simulation, const Scene& scene,
                                 std::string folder, bool resume)
    : simulation_(simulation)
    , scene_(scene)
    , folder_(std::move(folder))
{
    drop_link(folder_);
    make_folder(folder_);
    if (resume) return;
    for (const auto& entry : std::filesystem::directory_iterator(folder_))
        if (entry.path().extension() == ".hdf5") std::filesystem::remove(entry.path());
}

void ProblemRecorder::write(const StepRecord& record) const
{
    const std::vector<RecordedProblem> all = simulation_.contact_problems();
    for (std::size_t w = 0; w < all.size(); ++w) {
        const RecordedProblem& r = all[w];
        if (r.contact.empty()) continue;
        FclibProblem file;
        FclibForm form = fclib_form(r.problem);
        FclibSolution& own = file.solution.emplace();
        own.r = own.u = Eigen::VectorXd::Zero(form.problem.q.size());
        own.r(form.rows) = r.reaction;
        own.u(form.rows) = r.problem.W * r.reaction + r.problem.q;
        file.local = std::move(form.problem);
        file.identity = r.contact;
        const bool wire = !scene_.beams.empty() && !instruments_are_rods(scene_);
        const std::string name = wire ? scene_.beams[w].name : "all bodies";
        file.title = fmt::format("{}, {}: step {}, t = {:.9g} s", scene_.title, name, record.step,
                                 record.time);
        file.description =
            wire ? "Gaps and slips over the step [m], forces [N]; W = H A^-1 H^T with "
                   "the tangent A at the end of the step. /solution is the step's own; "
                   "/amontons/contact: contact point * walls + wall."
                 : "The last contact problem of the step; /solution is its answer.";
        if (wire)
            file.math_info =
                fmt::format("A has {} negative eigenvalues{}; its inverse is good to {:.1e}; "
                            "the tangent was unsymmetric by {:.1e}, A is its symmetric part",
                            r.negative_eigenvalues,
                            r.negative_eigenvalues > 0 ? ", so W is not semidefinite: the wire is "
                                                         "held by its contacts"
                                                       : "",
                            r.inverse_error, r.asymmetry);
        write_file(fmt::format("{}/step_{:06d}{}.hdf5", folder_, record.step,
                               all.size() > 1 ? "_" + name : ""),
                   fclib_bytes(file), Flush::to_system, Links::replace);
    }
}

} // namespace amontons
