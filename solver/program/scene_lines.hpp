#pragma once

#include <string>
#include <vector>

namespace amontons {

struct Session;

/// Lines `set PATH=VALUE` on stdin, for a scene that is changed while it runs. Never waits.
class SceneLines {
public:
    /// What has come since: PATH=VALUE of each. States which lines are something else.
    std::vector<std::string> take(const Session& session);

private:
    std::string rest_; ///< a line that has not ended yet
    bool open_ = true;
};

} // namespace amontons
