#pragma once

namespace CLI {
class App;
}

namespace amontons {

struct Session;

/// amontons mesh tetrahedralise. @param mesh  the command `mesh`
void add_tetrahedralise(CLI::App& mesh, Session& session);

} // namespace amontons
