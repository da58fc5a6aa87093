#include "solver/program/scene_lines.hpp"

#include "solver/program/session.hpp"

#include <poll.h>
#include <unistd.h>

namespace amontons {

std::vector<std::string> SceneLines::take(const Session& session)
{
    std::vector<std::string> out;
    pollfd in{STDIN_FILENO, POLLIN, 0};
    while (open_ && ::poll(&in, 1, 0) > 0) {
        char buffer[1024];
        const ssize_t n = ::read(STDIN_FILENO, buffer, sizeof buffer);
        if (n <= 0) {
            open_ = false;
            break;
        }
        rest_.append(buffer, static_cast<std::size_t>(n));
    }
    for (std::size_t end = 0; (end = rest_.find('\n')) != std::string::npos;
         rest_.erase(0, end + 1)) {
        const std::string line = rest_.substr(0, rest_[end - (end > 0)] == '\r' ? end - 1 : end);
        if (line.starts_with("set ") && line.find('=') != std::string::npos)
            out.push_back(line.substr(4));
        else if (!line.empty())
            session.print_line("not a line \"set PATH=VALUE\": " + line);
    }
    return out;
}

} // namespace amontons
