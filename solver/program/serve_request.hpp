#pragma once

#include "mesh/base/error.hpp"

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace amontons {

/// A line that a client of `amontons serve` has sent (docs/serve.md).
struct ServeRequest {
    enum class What {
        step,
        advance,
        set,
        save,
        restore,
        reset,
        state,
        inputs,
        scene,
        check,
        contacts,
        view,
        quit,
        // of the engine of amontons studio alone
        run,
        pause,
        frame,
        sets
    };
    std::string id = "null"; ///< as JSON: a whole number or a text, as it came
    What what = What::state;
    int count = 1;             ///< of step
    double until = 0;          ///< of advance [s]
    std::string path;          ///< of set: an input's name, or a place in the scene
    std::string value;         ///< of set, as JSON
    std::string state;         ///< of restore: the bytes
    bool whole = false;        ///< of view and frame: what does not move, too
    double speed = 0;          ///< of run: simulated seconds a second at most; 0: no bound
    std::uint64_t after = 0;   ///< of frame: the sequence of the one that the client has
    std::vector<Issue> issues; ///< what is wrong with the line: then nothing is done
};

/// Reads a line, without its end. Never throws for what it holds.
/// @param engine  run, pause, frame and sets are known, too
ServeRequest read_request(std::string_view line, bool engine = false);

} // namespace amontons
