#pragma once

#include "solver/program/scene_arguments.hpp"

#include <string>
#include <vector>

namespace amontons {

struct Session;

/// What `amontons study` was called with.
struct StudyArguments {
    SceneArguments scene;
    std::vector<std::string> sweeps, merge;
    std::string quantity, reference = "finest", output, shard = "1/1";
    int jobs = 1, threads = 1;
    double max_time = 0;
    bool restart = false, keep = false;
    std::string time = "wall", table, run_by;
    std::vector<std::string> add;
    bool new_reference = false; ///< --reference was given
};

/// Runs the points of a study, or joins folders of shards, and prints its rows. As `validate`
/// (validate.hpp): the program amontons-validate does it itself, amontons becomes that program.
void carry_out_study(const StudyArguments& arguments, Session& session);

} // namespace amontons
