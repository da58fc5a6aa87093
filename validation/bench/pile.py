#!/usr/bin/env python3
"""Piles of bricks in bond under their weight, ever larger: time per contact.

    pile.py PROGRAM OUTPUT_FOLDER [--sizes 5x4,10x5,19x5] [--soft 0]

A size is bricks a side and layers; every --soft-th brick is an elastic solid (0: none). Five dynamic steps of
1 ms to 1e-6. Writes pile.csv.
"""
import argparse
import csv
import json
import pathlib
import resource
import subprocess
import tempfile


def scene(side, layers, soft):
    size, gap = 0.1, 0.002
    bodies = {"floor": {"kind": "obstacle", "surface": {"generate": "plane"}}}
    for layer in range(layers):
        odd = layer % 2
        for i in range(side - odd):
            for j in range(side - odd):
                start = {"place": [(i + 0.5 * odd) * (size + gap), (j + 0.5 * odd) * (size + gap), (layer + 0.5) * size]}
                name = f"brick_{len(bodies)}"
                if soft and len(bodies) % soft == 0:
                    bodies[name] = {
                        "kind": "solid", "youngs_modulus": 1e7, "poisson_ratio": 0.3, "density": 1000,
                        "stiffness_damping": 1e-3, "start": start,
                        "mesh": {"generate": "box", "size": [size] * 3, "cells": [2, 2, 2], "element": "H8"}}
                else:
                    bodies[name] = {"kind": "rigid", "shape": {"generate": "box", "size": [size] * 3}, "density": 1000,
                                    "start": start}
    return {"schema": 1, "bodies": bodies, "contact": [{"between": ["*", "*"], "friction": 0.4}],
            "gravity": [0, 0, -9.81], "time": {"kind": "dynamic", "step": 1e-3, "end": 5e-3},
            "accuracy": {"contact": 1e-6}, "output": {"every": 1000, "picture": False, "plots": False}}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--sizes", default="5x4,10x5,19x5")
    parser.add_argument("--soft", type=int, default=0)
    a = parser.parse_args()
    program = pathlib.Path(a.program).resolve()
    rows = []
    for size in a.sizes.split(","):
        side, layers = map(int, size.split("x"))
        with tempfile.TemporaryDirectory() as folder:
            problem = scene(side, layers, a.soft)
            pathlib.Path(folder, "scene.json").write_text(json.dumps(problem))
            before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            result = subprocess.run([program, "run", "scene.json", "--json", "--quiet", "--output", "out"],
                                    cwd=folder, capture_output=True, text=True)
            row = {"bodies": len(problem["bodies"]) - 1, "soft_every": a.soft,
                   "processor": round(resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, 2)}
        if result.returncode:
            row["status"] = result.stderr.strip().splitlines()[-1]
        else:
            out = json.loads(result.stdout)
            s = out["seconds"]
            contacts = out["contacts"]["mean"]
            row.update(status=out["status"], contacts=round(contacts), seconds=round(s["total"], 2),
                       output=round(s["output"], 2), microseconds_per_contact_and_step=round(
                           1e6 * (s["total"] - s["output"]) / (contacts * out["steps"]), 1),
                       peak_memory=out["peak_memory"], worst_error=out["certificate"]["worst_error"])
        rows.append(row)
        print(row, flush=True)
    a.folder.mkdir(parents=True, exist_ok=True)
    with open(a.folder / "pile.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=max(rows, key=len).keys())
        writer.writeheader()
        writer.writerows(rows)


main()
