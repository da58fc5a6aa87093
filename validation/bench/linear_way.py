#!/usr/bin/env python3
"""Whether `auto` takes the quicker way to solve the linear systems of solids.

    linear_way.py PROGRAM [OTHER_PROGRAM] [--only TEXT] [--most SECONDS] [--csv FILE]

Scenes from 1e3 to 1e5 unknowns: blocks and plates of T4, T10 and H8, on all of a side, on a corner of
it, under a ball, in layers, in motion. Each is run directly, iteratively and by itself; printed are
processor seconds, what was taken, and the ratio of `auto` to the better of both ways. A way that
takes more than --most seconds is ended.
"""
import argparse
import csv
import json
import os
import resource
import subprocess
import sys
import tempfile
import time

ENVIRONMENT = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
               "OMP_NUM_THREADS": "1"}


def block(cells, element, size):
    return {"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3, "density": 1000,
            "mesh": {"generate": "box", "size": size, "cells": cells, "element": element,
                     "centre": [0, 0, size[2] / 2]}}


def base(bodies, contact, time_, accuracy=1e-6):
    return {"schema": 1, "bodies": bodies, "contact": contact, "time": time_,
            "accuracy": {"contact": accuracy},
            "output": {"picture": False, "plots": False, "every": 1000}}


def pressed(cells, element, mu=0.5):
    """All of the lower side on a plane."""
    size = [0.1, 0.1, 0.1 * cells[2] / cells[0]]
    b = block(cells, element, size)
    b["hold"] = [{"set": "z_max", "x": [[1, 0], [2, 2e-4]], "y": [[0, 0]], "z": [[0, 0], [1, -1e-3]]}]
    plate = {"kind": "obstacle", "surface": {"generate": "plane"}}
    return base({"plate": plate, "block": b}, [{"between": ["block", "plate"], "friction": mu}],
                {"step": 1, "end": 2})


def under_ball(cells, element, steps=4, size=(0.1, 0.1, 0.06)):
    """A small rigid ball on the upper side of a block that is held below."""
    b = block(cells, element, list(size))
    b["hold"] = [{"set": "z_min"}]
    r = 0.15 * size[0]
    ball = {"kind": "rigid", "shape": {"generate": "ball", "radius": r},
            "start": {"place": [0, 0, size[2] + 1.001 * r]},
            "drive": {"z": [[0, 0], [1, -0.02 * r]]}}
    return base({"ball": ball, "block": b}, [{"between": ["block", "ball"], "friction": 0.3}],
                {"step": 1 / steps, "end": 1})


def bent(cells, element, steps=2):
    """A plate that is held at one end, and bent until its tip touches a ball."""
    size = [0.2, 0.2 * cells[1] / cells[0], 0.2 * cells[2] / cells[0]]
    b = block(cells, element, size)
    b["hold"] = [{"set": "x_min"}]
    b["loads"] = [{"set": "x_max", "traction": [0, 0, -20], "over": [[0, 0], [1, 1]]}]
    ball = {"kind": "obstacle", "surface": {"generate": "ball", "radius": 0.02,
                                            "centre": [0.09, 0, -0.0201]}, "side": "outside"}
    return base({"stop": ball, "plate": b}, [{"between": ["plate", "stop"], "friction": 0.2}],
                {"step": 1 / steps, "end": 1})


def in_motion(cells, element, steps=10):
    """A block that falls onto a plane."""
    size = [0.1, 0.1, 0.1 * cells[2] / cells[0]]
    b = block(cells, element, size)
    b["start"] = {"place": [0, 0, 0.001], "velocity": [0.1, 0, -0.5]}
    plate = {"kind": "obstacle", "surface": {"generate": "plane"}}
    s = base({"plate": plate, "block": b}, [{"between": ["block", "plate"], "friction": 0.3}],
             {"kind": "dynamic", "step": 5e-4, "end": 5e-4 * steps})
    s["gravity"] = [0, 0, -9.81]
    return s


SCENES = [
    ("pressed T4 1e3", pressed([6, 6, 5], "T4")),
    ("pressed T4 6e3", pressed([12, 12, 10], "T4")),
    ("pressed T4 2e4", pressed([18, 18, 16], "T4")),
    ("pressed T4 5e4", pressed([26, 26, 24], "T4")),
    ("pressed H8 1e4", pressed([16, 16, 10], "H8")),
    ("pressed H8 4e4", pressed([28, 28, 16], "H8", 0)),
    ("pressed T10 2e4", pressed([10, 10, 8], "T10")),
    ("pressed T10 5e4", pressed([14, 14, 11], "T10")),
    ("flat H8 4e4", pressed([64, 8, 20], "H8")),
    ("flat H8 thin 5e4", pressed([80, 64, 2], "H8")),
    ("ball H8 1e3", under_ball([7, 7, 4], "H8")),
    ("ball H8 1e4", under_ball([16, 16, 10], "H8")),
    ("ball H8 4e4", under_ball([28, 28, 16], "H8")),
    ("ball H8 1e5", under_ball([40, 40, 20], "H8", 2)),
    ("ball T4 3e4", under_ball([24, 24, 14], "T4")),
    ("ball T4 1e5", under_ball([36, 36, 22], "T4", 2)),
    ("ball T10 3e4", under_ball([12, 12, 7], "T10")),
    ("ball T10 9e4", under_ball([18, 18, 10], "T10", 2)),
    ("bent H8 15e3", bent([64, 2, 24], "H8")),
    ("bent H8 plate 3e4", bent([60, 40, 3], "H8")),
    ("bent H8 beam 2e4", bent([120, 6, 6], "H8")),
    ("bent T10 9e4", bent([60, 20, 5], "T10")),
    ("bent T10 3e4", bent([40, 10, 4], "T10")),
    ("bent T4 5e4", bent([80, 40, 4], "T4")),
    ("motion H8 3e3", in_motion([10, 10, 8], "H8")),
    ("motion H8 2e4", in_motion([20, 20, 14], "H8")),
    ("motion H8 6e4", in_motion([28, 28, 24], "H8", 5)),
    ("motion T4 2e4", in_motion([20, 20, 14], "T4")),
    ("motion T4 6e4", in_motion([28, 28, 24], "T4", 5)),
    ("motion T10 3e4", in_motion([10, 10, 9], "T10", 5)),
]


def run(program, path, folder, way, most):
    out = os.path.join(folder, "out")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    child = subprocess.Popen([program, "run", path, "--output", out, "--json", "--quiet", "--set",
                              "solver.linear=" + way], stdout=subprocess.DEVNULL,
                             stderr=subprocess.PIPE, text=True, env=ENVIRONMENT,
                             preexec_fn=lambda: resource.setrlimit(
                                 resource.RLIMIT_CPU, (int(most) + 1, int(most) + 1)))
    output = child.communicate()[1]
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    if child.returncode < 0:
        return seconds, "ended", None
    if child.returncode not in (0,):
        return seconds, (output.strip().splitlines() or ["failed"])[0], None
    manifest = json.load(open(os.path.join(out, "manifest.json")))
    return seconds, "done", manifest


def taken(program, path):
    output = subprocess.run([program, "check", path, "--json"], capture_output=True, text=True,
                          env=ENVIRONMENT)
    try:
        linear = json.loads(output.stdout)["predicted"]["linear"]
    except (ValueError, KeyError):
        return output.stderr.strip() or output.stdout.strip(), {}
    return linear["taken"], {p["name"]: p["seconds"] for p in linear["paths"]}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", nargs="+")
    parser.add_argument("--only", default="")
    parser.add_argument("--most", type=float, default=40)
    parser.add_argument("--csv")
    arguments = parser.parse_args()
    out = csv.writer(open(arguments.csv, "w", buffering=1) if arguments.csv else sys.stdout)
    head = ["scene", "direct_s", "iterative_s"]
    for k in range(len(arguments.program)):
        head += ["taken_%d" % (k + 1), "predicted_direct_%d" % (k + 1),
                 "predicted_iterative_%d" % (k + 1), "auto_s_%d" % (k + 1), "ratio_%d" % (k + 1)]
    out.writerow(head)
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "scene.json")
        for name, scene in SCENES:
            if arguments.only not in name:
                continue
            json.dump(scene, open(path, "w"))
            direct, output, _ = run(arguments.program[0], path, folder, "direct", arguments.most)
            if output not in ("done", "ended"):
                print(name, output, file=sys.stderr)
                continue
            iterative, output, _ = run(arguments.program[0], path, folder, "iterative",
                                     min(arguments.most, 6 * direct + 3))
            if output not in ("done", "ended"):
                print(name, output, file=sys.stderr)
                iterative = float("inf")
            row = [name, "%.2f" % direct, "%.2f%s" % (iterative, "+" if output == "ended" else "")]
            for program in arguments.program:
                way, predicted = taken(program, path)
                auto, output, _ = run(program, path, folder, "auto", 2 * arguments.most)
                row += [way, "%.2f" % predicted.get("direct", -1),
                        "%.2f" % predicted.get("iterative", -1), "%.2f" % auto,
                        "%.2f" % (auto / min(direct, iterative))]
            out.writerow(row)
            sys.stdout.flush()


if __name__ == "__main__":
    main()
