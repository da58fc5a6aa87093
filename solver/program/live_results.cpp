#include "solver/program/live_results.hpp"

#include "mesh/base/error.hpp"
#include "mesh/base/file.hpp"
#include "solver/obstacle/build.hpp"
#include "solver/output/output_folder.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fmt/format.h>
#include <sys/stat.h>

namespace fs = std::filesystem;

namespace amontons {

std::string make_numbered_folder(const std::string& base)
{
    make_folder(fs::path(base).parent_path().string());
    for (int number = 1;; ++number) {
        const std::string folder = fmt::format("{}-{:03}", base, number);
        if (::mkdir(folder.c_str(), 0777) == 0) return folder;
        if (errno != EEXIST) throw WriteError(folder, std::strerror(errno));
    }
}

/// One folder. The scene as `amontons run` has it, and the simulation, outlive the writer.
struct LiveResults::Open {
    Scene scene;
    SharedScene text;
    std::shared_ptr<Simulation> simulation;
    std::string folder;
    std::atomic<bool> stop{false}; ///< set by the writer where it cannot write
    StepResult::Outcome last = StepResult::Outcome::interrupted;
    std::unique_ptr<RunWriter> writer;
};

LiveResults::LiveResults(std::string base) : base_(std::move(base)) {}

LiveResults::~LiveResults()
{
    end("the simulation was ended");
}

void LiveResults::begin(const SteppedScene& scene, const std::string& folder, bool resume)
{
    auto open = std::make_unique<Open>();
    open->text = scene.scene();
    open->scene = open->text->scene;
    place_introducers(open->scene); // as `amontons run` does: the hash of the run is the same
    open->simulation = scene.shared();
    open->folder = folder;
    check_output_folder(folder, open->scene);
    RunWriterOptions options;
    options.name = run_name(open->text->file);
    options.directory = folder;
    options.command = {"amontons", "run", open->text->file, "--output", folder};
    for (const std::string& o : open->text->overrides)
        options.command.push_back("--set=" + o);
    for (const Issue& w : scene.warnings())
        options.warnings.push_back(InputError({w}).what());
    options.warnings.emplace_back(
        "inputs of this run were set by hand (amontons studio): their values are not in the scene");
    options.threads = scene.options().threads;
    options.resume = resume;
    open->writer = std::make_unique<RunWriter>(open->scene, *open->simulation, options, open->stop);
    open_ = std::move(open);
}

void LiveResults::resume(SteppedScene& scene, const std::string& folder)
{
    end("another run is continued");
    begin(scene, folder, true);
}

bool LiveResults::add(const SteppedScene& scene)
{
    if (!failure_.empty()) return false;
    try {
        if (open_ && open_->simulation != scene.shared()) end("the scene was changed");
        if (!open_) begin(scene, make_numbered_folder(base_), false);
        open_->writer->on_step(scene.record()->step);
        open_->last = scene.done() ? StepResult::Outcome::done : StepResult::Outcome::interrupted;
        if (open_->stop) {
            end("");
            failure_ = "the folder of results could not be written to";
        }
    } catch (const std::exception& error) { // the run continues without
        failure_ = error.what();
        open_.reset();
    }
    return failure_.empty();
}

void LiveResults::end(const std::string& why)
{
    if (!open_) return;
    const std::unique_ptr<Open> open = std::move(open_);
    try {
        StepResult last;
        last.outcome = open->last;
        RunSummary summary = open->simulation->conclude(last);
        if (summary.message.empty() && open->last != StepResult::Outcome::done)
            summary.message = why;
        open->writer->finish(summary);
    } catch (const std::exception& error) {
        if (failure_.empty()) failure_ = error.what();
    }
}

std::string LiveResults::folder() const
{
    return open_ ? open_->folder : "";
}

} // namespace amontons
