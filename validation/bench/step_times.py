#!/usr/bin/env python3
"""Time of a step of two programs, in turns: the median of a run's steps, and that of the turns.

    step_times.py BEFORE AFTER [SCENE ...] [--turns 9]

BEFORE and AFTER are programs; a SCENE is a file, or one of the jointed scenes made here: hinge,
double, chain (1, 2 and 10 bars of 0.2 m on hinges, released from the horizontal, at 1 ms), each
with the midpoint rule or, with "-alpha" at its end, with generalised-alpha. Without scenes these
six. Times are the wall times of history.csv: nothing else may run.
"""
import argparse
import csv
import json
import pathlib
import statistics
import subprocess
import tempfile

BARS = {"hinge": 1, "double": 2, "chain": 10}
LENGTH, WIDTH = 0.2, 0.02


def bars(count, rule):
    bodies, couplings = {}, []
    for i in range(count):
        bodies[f"bar{i}"] = {"kind": "rigid", "density": 1000,
                             "shape": {"generate": "box", "size": [LENGTH, WIDTH, WIDTH]},
                             "start": {"place": [(i + 0.5) * LENGTH, 0, 0]}}
        couplings.append({"kind": "hinge", "at": [i * LENGTH, 0, 0], "axis": [0, 1, 0],
                          "between": [f"bar{i}", f"bar{i - 1}" if i > 0 else "world"]})
    return {"schema": 1, "bodies": bodies, "couplings": couplings, "gravity": [0, 0, -9.81],
            "time": {"kind": "dynamic", "step": 0.001, "end": 0.2, **rule},
            "output": {"picture": False, "plots": False}}


def scene_file(name, folder):
    kind = name.removesuffix("-alpha")
    if kind not in BARS:
        return str(pathlib.Path(name).resolve())
    rule = {"theta": 0.5} if kind == name else {"rule": "generalised_alpha", "spectral_radius": 0.8}
    path = pathlib.Path(folder) / f"{name}.json"
    path.write_text(json.dumps(bars(BARS[kind], rule)))
    return str(path)


def step_times(program, scene, folder):
    out = pathlib.Path(folder) / "out"
    result = subprocess.run([program, "run", scene, "--quiet", "--output", str(out),
                             "--set", "output.picture=false"], capture_output=True, text=True)
    if result.returncode != 0:
        raise SystemExit(f"{program} {scene}: {result.stderr}")
    with open(out / "history.csv", newline="") as file:
        return [float(row["seconds [s]"]) for row in csv.DictReader(file)][1:]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("before")
    parser.add_argument("after")
    parser.add_argument("scenes", nargs="*", metavar="SCENE")
    parser.add_argument("--turns", type=int, default=9)
    a = parser.parse_args()
    programs = [str(pathlib.Path(p).resolve()) for p in (a.before, a.after)]
    names = a.scenes or [kind + end for kind in BARS for end in ("", "-alpha")]
    for name in names:
        with tempfile.TemporaryDirectory() as folder:
            scene = scene_file(name, folder)
            runs = [[step_times(p, scene, folder) for p in programs] for _ in range(a.turns)]
        median = [1e3 * statistics.median(statistics.median(r[k]) for r in runs) for k in (0, 1)]
        whole = [statistics.median(sum(r[k]) for r in runs) for k in (0, 1)]
        print(f"{name}: {median[0]:.4f} and {median[1]:.4f} ms, {median[1] / median[0]:.2f}; "
              f"all steps {whole[1] / whole[0]:.2f}, {len(runs[0][0])} and {len(runs[0][1])}",
              flush=True)


if __name__ == "__main__":
    main()
