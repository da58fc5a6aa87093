#!/usr/bin/env python3
"""What `check` predicts of memory beside the peak of a run.

    memory.py PROGRAM [--only TEXT] [--most SECONDS] [--csv FILE]

All examples, blocks of solids of 1e3 to 1e5 unknowns (directly and iteratively), piles of rigid bodies and surfaces
from files. Printed are the prediction, the peak of the run's own process (the picture is drawn by another one) and
their ratio. A run that takes more than --most seconds is interrupted; its peak until then counts.
"""
import argparse
import csv
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile

import linear_way

ROOT = pathlib.Path(__file__).resolve().parents[2]
ENVIRONMENT = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMP_NUM_THREADS": "1"}
QUIET = ["--set", "output.picture=false", "--set", "output.plots=false"]


def pile(count):
    """Balls that fall onto a floor, in layers of nine."""
    bodies = {"floor": {"kind": "obstacle", "surface": {"generate": "plane"}}}
    for i in range(count):
        bodies["b%d" % i] = {"kind": "rigid", "mass": 0.1, "shape": {"generate": "ball", "radius": 0.02},
                             "start": {"place": [0.041 * (i % 3) + 0.002 * (i // 9), 0.041 * (i // 3 % 3), 0.021 + 0.041 * (i // 9)]}}
    return {"schema": 1, "bodies": bodies, "contact": [{"between": ["*", "*"], "friction": 0.3}], "gravity": [0, 0, -9.81],
            "time": {"kind": "dynamic", "step": 0.002, "end": 0.02}}


def of_law(cells, law):
    """A hyperelastic or corotational block under a ball."""
    scene = linear_way.under_ball(cells, "T10", 2)
    if law == "corotational":
        scene["bodies"]["block"]["motion"] = law
    else:
        for key in ("youngs_modulus", "poisson_ratio"):
            scene["bodies"]["block"].pop(key)
        scene["bodies"]["block"]["material"] = {"law": law, "youngs_modulus": 1e6, "poisson_ratio": 0.3}
    return scene


def scenes(folder):
    """(name, file, overrides)"""
    for file in sorted(ROOT.glob("examples/*/*.json")):
        if '"schema"' in file.read_text():
            yield f"{file.parent.name}/{file.stem}", file, []
    own = [(name, scene) for name, scene in linear_way.SCENES]
    own += [("pile 27", pile(27)), ("pile 300", pile(300))]
    own += [(f"{law} {n}", of_law([n, n, n // 2], law)) for law in ("corotational", "neo_hooke") for n in (4, 8, 12)]
    for name, scene in own:
        file = folder / (name.replace(" ", "_") + ".json")
        file.write_text(json.dumps(scene))
        ways = ["direct", "iterative"] if name.split()[0] in ("pressed", "ball") else ["auto"]
        for way in ways:
            yield f"{name} {way}" if len(ways) > 1 else name, file, ["--set", f"solver.linear={way}"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--only", default="")
    parser.add_argument("--most", type=float, default=20)
    parser.add_argument("--csv")
    a = parser.parse_args()
    out = csv.writer(open(a.csv, "w", buffering=1) if a.csv else sys.stdout)
    out.writerow(["scene", "predicted_MB", "peak_MB", "ratio", "read_MB", "bodies_MB", "steps_MB", "status"])
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for scene, file, overrides in scenes(folder):
            if a.only not in scene:
                continue
            output = subprocess.run([a.program, "check", file, "--json", *overrides], capture_output=True, text=True, env=ENVIRONMENT)
            if output.returncode != 0:
                print(scene, output.stderr.strip(), file=sys.stderr)
                continue
            predicted = json.loads(output.stdout)["predicted"]["memory"]
            results = folder / "out"
            shutil.rmtree(results, ignore_errors=True)
            run = subprocess.Popen([a.program, "run", file, "--output", results, "--quiet", *QUIET, *overrides],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=ENVIRONMENT)
            try:
                run.wait(a.most)
            except subprocess.TimeoutExpired:
                run.send_signal(signal.SIGINT)
                run.wait()
            manifest = json.loads((results / "manifest.json").read_text())
            after = manifest["peak_memory_after"]
            peak = manifest["peak_memory"]
            out.writerow([scene, round(predicted / 1e6), round(peak / 1e6), "%.2f" % (predicted / peak),
                          *("%.0f" % (after[k] / 1e6) for k in ("read", "bodies", "steps")), manifest["status"]])
            sys.stdout.flush()


if __name__ == "__main__":
    main()
