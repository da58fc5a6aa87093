#pragma once

#include "haptics/link/handle_link.hpp"
#include "solver/scene/scene.hpp"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace amontons {

/// The scene with these values ("PATH=VALUE") in place of its own, ready to be built.
/// @throws InputError
using ReadAgain = std::function<Scene(const std::vector<std::string>& overrides)>;
/// Obstacles of a scene. @throws InputError
using MakeObstacles = std::function<std::vector<Obstacle>(const Scene& scene)>;

/// A scene with one of its values replaced, ready to continue with.
struct ChangedLink {
    std::string line; ///< PATH=VALUE
    std::vector<std::string> overrides;
    Scene scene;
    std::vector<Obstacle> obstacles; // before the link, which uses them
    std::unique_ptr<HandleLink> link;
    std::string refusal;
};

/// Values of the scene that the user changes during the run. What a change requires, mainly new
/// factors, is computed in a thread of its own; the simulation continues unchanged until then.
class LinkChanges {
public:
    /// @param waits  True: next() waits for each change (virtual time)
    LinkChanges(ReadAgain read, MakeObstacles make, const LinkOptions& options, bool waits);
    ~LinkChanges();

    /// @param lines  "PATH=VALUE", made ready one after another
    void request(std::vector<std::string> lines);
    /// Is called for each change: its line and "", or why it is not made.
    using ReportChange = std::function<void(const std::string& line, const std::string& refusal)>;
    /// The next change that is ready, taken over from the state of the simulation; or no link.
    ChangedLink next(const HandleLink& now, const ReportChange& report);
    /// The run is over.
    void end(const std::function<void(const std::string&)>& print_line);

private:
    struct State;
    std::unique_ptr<State> state_;
};

} // namespace amontons
