#!/usr/bin/env python3
"""Writes a source file with a mistake in it: mutate.py MUTANT ROOT FILE OUTPUT

The mistakes are listed here. Each text must stand in its file exactly once, so that a change of the
sources is noticed; nothing of this is part of the program that is installed.
"""
import pathlib
import sys

MUTANTS = {
    # Contact solves end at 1e5 times the error that is requested.
    "tolerance": {
        "contact/solvers/solve.cpp": (
            "ContactSolution solve_in_range(const ContactProblem& problem, const SolverOptions& options,\n"
            "                               const Eigen::VectorXd& warm_start)\n{\n",
            "ContactSolution solve_in_range(const ContactProblem& problem, const SolverOptions& requested,\n"
            "                               const Eigen::VectorXd& warm_start)\n{\n"
            "    SolverOptions options = requested;\n    options.tolerance = 1e5 * requested.tolerance;\n"),
    },
    # Every cone 1 % too wide, for solver and certificate alike.
    "cone": {
        "solver/step/body_problem.cpp": ("problem_.mu[Eigen::Index(i)] = mu;",
                                         "problem_.mu[Eigen::Index(i)] = 1.01 * mu;"),
        "solver/beam/wire_contact.cpp": ("c.mu = walls[w].friction[p];",
                                         "c.mu = 1.01 * walls[w].friction[p];"),
    },
    # Normals of contacts point the wrong way.
    "normal": {
        "contact/rigid/detect.cpp": ("c.normal = turn * c.normal;", "c.normal = -(turn * c.normal);"),
        "contact/surface/contact_sums.cpp": ("c.normal = m.normal.normalized();",
                                             "c.normal = -m.normal.normalized();"),
        "solver/beam/wire_contact.cpp": ("c.n = sample.normal;", "c.n = -sample.normal;"),
    },
    # Tangents of beams and of turning solids: a block of the wrong sign, half of the stiffness.
    "tangent": {
        "solver/beam/element.cpp": ("t.e1 = s.R1 * E1;", "t.e1 = -1.0 * (s.R1 * E1);"),
        "solver/solid/corotational.cpp": ("K.noalias() = e.K * P;", "K.noalias() = 0.5 * (e.K * P);"),
    },
    # The same tangents, 5 % off: what converges is right, and takes longer.
    "stiff": {
        "solver/beam/element.cpp": ("t.e1 = s.R1 * E1;", "t.e1 = 1.05 * (s.R1 * E1);"),
        "solver/solid/corotational.cpp": ("K.noalias() = e.K * P;", "K.noalias() = 1.05 * (e.K * P);"),
    },
}


def main(mutant, root, file, output):
    text = (pathlib.Path(root) / file).read_text()
    old, new = MUTANTS[mutant][file]
    if text.count(old) != 1:
        sys.exit(f"mutate.py: {file} has {text.count(old)} times what the mutant {mutant} changes: {old}")
    pathlib.Path(output).write_text(text.replace(old, new))


if __name__ == "__main__":
    main(*sys.argv[1:])
