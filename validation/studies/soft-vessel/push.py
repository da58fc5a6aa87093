#!/usr/bin/env python3
"""push.py PROGRAM SCENE WORK TABLE [PATH=VALUE ...]: push force over insertion, of walls that yield less and less and of a
rigid one. Writes TABLE (wall, insertion, force) and prints how far each is from the rigid one: the root
mean square of the difference over that of the rigid wall's force, and the largest force. Runs whose folder is
in WORK are not run again. PATH=VALUE changes the walls that are compliant, as --set does (a WORK of its own then)."""
import csv
import json
import math
import os
import subprocess
import sys

WALLS = ["0.3e6", "0.6e6", "3e6", "30e6", "300e6", "rigid"] # Young's modulus [Pa]


def push(program, scene, work, wall, more):
    folder = os.path.join(work, "soft_vessel_" + wall)
    changes = [f"bodies.aorta.youngs_modulus={wall}", *more]
    if wall == "rigid":
        mesh = json.loads("\n".join(line.split("//")[0] for line in open(scene)))["bodies"]["aorta"]["mesh"]
        changes = ["bodies.aorta=" + json.dumps({"kind": "obstacle", "surface": {
            "generate": "tube", "radius": mesh["radius"], "centreline": mesh["centreline"]}})]
    if not os.path.exists(folder + "/history.csv"):
        sets = [a for change in changes for a in ("--set", change)]
        subprocess.run([program, "run", scene, *sets, "--set", "output.picture=false", "--set",
                        "output.every=100000", "--output", folder, "--quiet"], check=True)
    rows = list(csv.DictReader(open(folder + "/history.csv")))
    return [(float(r["insertion [m]"]), float(r["push_force [N]"])) for r in rows]


def at(curve, x):
    for (x0, f0), (x1, f1) in zip(curve, curve[1:]):
        if x0 <= x <= x1 and x1 > x0:
            return f0 + (f1 - f0) * (x - x0) / (x1 - x0)
    return curve[-1][1]


def main(program, scene, work, table, *more):
    curves = {wall: push(program, scene, work, wall, more) for wall in WALLS}
    with open(table, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["wall", "insertion [m]", "push force [N]"])
        for wall, curve in curves.items():
            out.writerows([wall, f"{x:.6g}", f"{f:.6g}"] for x, f in curve)
    places = [0.13 + 0.0005 * i for i in range(261)]
    rigid = [at(curves["rigid"], x) for x in places]
    for wall, curve in curves.items():
        off = sum((at(curve, x) - f)**2 for x, f in zip(places, rigid)) / sum(f * f for f in rigid)
        print(f"{wall:6s} largest force {max(f for _, f in curve):.4f} N, off the rigid wall's by {math.sqrt(off):.2%}")


if __name__ == "__main__":
    main(*sys.argv[1:])
