#!/usr/bin/env python3
"""A block of T4 pressed and sheared on a plane: time and memory of every way to solve it.

    large_solids.py PROGRAM OUTPUT_FOLDER [--cells 12,18,26,38,56] [--ways direct,iterative,2] [--mu 0.5]

A way that is a number is `mpirun -n` of it, distributed. Writes large_solids.csv, and large_solids.svg
where gnuplot is there. Refused runs (memory) are rows without time.
"""
import argparse
import csv
import json
import math
import os
import pathlib
import resource
import shutil
import subprocess
import tempfile

ENVIRONMENT = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}


def scene(cells, mu):
    size, layers = 0.1, max(2, cells - 2)
    height = size * layers / cells
    return {
        "schema": 1,
        "bodies": {
            "plate": {"kind": "obstacle", "surface": {"generate": "plane"}},
            "block": {
                "kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3,
                "mesh": {"generate": "box", "size": [size, size, height], "cells": [cells, cells, layers],
                         "element": "T4", "centre": [0, 0, height / 2]},
                "hold": [{"set": "z_max", "x": [[1, 0], [2, 2e-4]], "y": [[0, 0]], "z": [[0, 0], [1, -1e-3]]}]}},
        "contact": [{"between": ["block", "plate"], "friction": mu}],
        "time": {"step": 1, "end": 2},
        "accuracy": {"contact": 1e-6},
        "output": {"picture": False, "plots": False},
    }, 6 * cells * cells * layers


def run(program, cells, way, mu, folder):
    problem, elements = scene(cells, mu)
    (folder / "scene.json").write_text(json.dumps(problem))
    ranks = ["mpirun", "-n", way] if way.isdigit() else []
    linear = "distributed" if ranks else way
    command = ranks + [program, "run", "scene.json", "--json", "--quiet", "--output", "out"]
    predicted = json.loads(subprocess.run(
        ranks + [program, "check", "scene.json", "--json"], cwd=folder, capture_output=True, text=True,
        env=ENVIRONMENT).stdout)["predicted"]["linear"]
    path = next(p for p in predicted["paths"] if p["name"] == linear)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    result = subprocess.run(command + ["--set", f"solver.linear={linear}"], cwd=folder,
                            capture_output=True, text=True, env=ENVIRONMENT)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    row = {"elements": elements, "way": way, "taken_by_itself": predicted["taken"],
           "predicted_seconds": path["seconds"], "predicted_memory": path["memory"]}
    if result.returncode != 0:
        row["status"] = (result.stderr.strip().splitlines() or ["failed"])[-1]
        return row
    out = json.loads(result.stdout)
    manifest = json.loads((folder / "out/manifest.json").read_text())
    memory = manifest["peak_memory_after"]
    s = out["seconds"]
    forces = {k: v for k, v in out["quantities"].items() if k.startswith("block")}
    row.update(status=out["status"], unknowns=out["unknowns"], contacts=out["contacts"]["max"],
               seconds=s["total"], offline=s["offline"], contact=s["contact_solve"] + s["compliance"],
               processor=after.ru_utime - before.ru_utime, peak_memory=memory.get("all_ranks") or out["peak_memory"],
               newton=out["iterations"], error=out["certificate"]["worst_error"],
               shear=next((v for k, v in forces.items() if k.endswith("_x")), ""))
    return row


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder")
    parser.add_argument("--cells", default="12,18,26,38,56")
    parser.add_argument("--ways", default="direct,iterative,2")
    parser.add_argument("--mu", type=float, default=0.5)
    a = parser.parse_args()
    program = str(pathlib.Path(a.program).resolve())
    folder = pathlib.Path(a.folder)
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for cells in map(int, a.cells.split(",")):
        for way in a.ways.split(","):
            with tempfile.TemporaryDirectory() as work:
                rows.append(run(program, cells, way, a.mu, pathlib.Path(work)))
            print(json.dumps(rows[-1]), flush=True)
    names = ["elements", "unknowns", "contacts", "way", "taken_by_itself", "status", "seconds", "processor", "offline",
             "contact", "newton", "error", "shear", "peak_memory", "predicted_seconds", "predicted_memory"]
    with open(folder / "large_solids.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, names, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(rows)
    for way in a.ways.split(","):
        points = [(math.log(r["elements"]), math.log(r["seconds"])) for r in rows
                  if r["way"] == way and r.get("seconds") and r["elements"] > 5e4]
        if len(points) > 1:
            n, sx, sy = len(points), sum(p[0] for p in points), sum(p[1] for p in points)
            slope = (n * sum(x * y for x, y in points) - sx * sy) / (n * sum(x * x for x, _ in points) - sx * sx)
            print(f"{way}: time grows with elements to the power {slope:.2f} (from 50,000 on)")
    if shutil.which("gnuplot"):
        plots = []
        script = "set terminal svg size 640,480\nset output 'large_solids.svg'\nset logscale xy\nset key left top\n" \
                 "set xlabel 'elements (T4)'\nset ylabel 'wall time [s]'\nset format x '10^{%L}'\n"
        for i, way in enumerate(a.ways.split(",")):
            data = "\n".join(f"{r['elements']} {r['seconds']}" for r in rows if r["way"] == way and r.get("seconds"))
            if data:
                script += f"$d{i} << E\n{data}\nE\n"
                name = f"{way} ranks" if way.isdigit() else way
                plots.append(f"$d{i} with linespoints title '{name}'")
        subprocess.run(["gnuplot"], input=script + "plot " + ", ".join(plots) + "\n", text=True, cwd=folder, check=True)


if __name__ == "__main__":
    main()
