// The tables of docs/theory/contact.md: what a sweep costs, and how many iterations each solver
// takes as a problem gets stiffer. Built on demand: cmake --build BUILD --target contact_ladder.

#include "contact/solvers/solve.hpp"

#include "contact/tests/contact_problems.hpp"

#include <algorithm>
#include <cstdio>
#include <string>

using namespace amontons;

namespace {

/// Elastic layers on a floor, `faces` contacts between two: layer b presses on both its faces
/// with a full compliance matrix over its stiffness, 1 and `contrast` in turns.
ContactProblem layers(int count, int faces, double contrast, double mu, unsigned seed)
{
    std::mt19937 rng{seed};
    std::normal_distribution<double> normal;
    const int n = count * faces, rows = 3 * n;
    ContactProblem p;
    p.W.dense().setZero(rows, rows);
    for (int b = 0; b < count; ++b) {
        const int first = 3 * faces * b, last = std::min(first + 6 * faces, rows);
        Eigen::MatrixXd G(last - first, last - first);
        for (double& x : G.reshaped())
            x = 0.15 * normal(rng);
        G.diagonal().array() += 1;
        for (int k = 0; k < 3; ++k) // the layer's own motion couples all its contacts
            for (int i = k; i < last - first; i += 3)
                G(i, k) += i < 3 * faces ? 0.5 : -0.5;
        const double stiffness = b % 2 ? contrast : 1;
        p.W.dense().block(first, first, last - first, last - first) +=
            G * G.transpose() / stiffness;
    }
    p.q.resize(rows);
    for (int i = 0; i < n; ++i)
        p.q.segment<3>(3 * i) = Vec3{-1 - 0.3 * normal(rng), 0.5 * normal(rng), 0.5 * normal(rng)};
    p.mu.setConstant(n, mu);
    return p;
}

std::string iterations(const ContactProblem& p, SolverOptions options)
{
    options.max_seconds = 20;
    const ContactSolution s = solve(p, options);
    char text[64];
    if (s.certificate.status == SolveStatus::converged)
        std::snprintf(text, sizeof text, "%d", s.certificate.iterations);
    else
        std::snprintf(text, sizeof text, "%.0e (%s)", s.certificate.error,
                      name(s.certificate.status));
    return text;
}

void print_row(const char* label, double value, const ContactProblem& p)
{
    std::string cells;
    for (double tolerance : {1e-4, 1e-8}) {
        SolverOptions nsgs, uzawa, adaptive;
        nsgs.solver = ContactSolver::nsgs;
        uzawa.solver = adaptive.solver = ContactSolver::uzawa;
        adaptive.uzawa.rho = SolverOptions::Uzawa::Rho::adaptive;
        for (SolverOptions* o : {&nsgs, &uzawa, &adaptive}) {
            o->tolerance = tolerance;
            cells += " | " + iterations(p, *o);
        }
    }
    SolverOptions path;
    path.solver = ContactSolver::path;
    cells += " | " + iterations(p, path);
    std::printf("| %s %.0e%s |\n", label, value, cells.c_str());
}

void print_sweep(int contacts, double freeze, double mu)
{
    // Pressed everywhere, so that no contact is open.
    const ContactProblem p = layers(2, contacts / 2, 1, mu, 1);
    SolverOptions options;
    options.solver = ContactSolver::nsgs;
    options.tolerance = 0;
    options.nsgs.freeze = freeze;
    double best = 1e9;
    int sweeps = 0;
    for (int repeat = 0; repeat < 15; ++repeat) {
        options.max_iterations = 12;
        const ContactSolution s = solve(p, options);
        // Between two samples: without the checks before and the certificate after.
        const ErrorPoint& a = s.history[2];
        const ErrorPoint& b = s.history.back();
        sweeps = b.iteration - a.iteration;
        best = std::min(best, (b.seconds - a.seconds) / sweeps);
    }
    std::printf("| %d | %.2f | %.1f us | %.0f ns |\n", contacts, freeze, 1e6 * best,
                1e9 * best / contacts);
}

} // namespace

int main()
{
    std::printf("| contacts | freeze | one sweep | per contact |\n|---|---|---|---|\n");
    for (int contacts : {10, 100, 300})
        for (double freeze : {0.0, SolverOptions{}.nsgs.freeze})
            print_sweep(contacts, freeze, 0.5);

    const char* head =
        "| | nsgs 1e-4 | uzawa | uzawa adaptive | nsgs 1e-8 | uzawa | uzawa adaptive "
        "| path 1e-8 |\n|---|---|---|---|---|---|---|---|\n";
    std::printf("\n%s", head);
    for (double contrast : {1.0, 1e2, 1e4, 1e6, 1e8})
        print_row("stiffness contrast", contrast, layers(6, 8, contrast, 0.5, 2));
    std::printf("\n%s", head);
    for (double ratio : {1.0, 10.0, 1e2, 1e3, 1e4, 1e6}) { // the heavy block on top
        std::vector<double> mass(5, 1.0);
        mass.back() = ratio;
        print_row("mass ratio", ratio, test::tower(mass, 0.3, 0.5));
    }
}
