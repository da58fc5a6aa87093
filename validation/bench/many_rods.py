#!/usr/bin/env python3
"""Many wires in contact with friction: time and memory of whole runs against their elements.

    many_rods.py PROGRAM OUTPUT_FOLDER [--rows 5,16,50,160,500] [--steps 4]

A row is a wire of 100 elements held at both ends, and one across it, held at one end, that four loads
press down on the five wires below it: 200 elements. All pairs may touch ("*"). Writes many_rods.csv,
and many_rods.svg where gnuplot is there.
"""
import argparse
import csv
import json
import math
import pathlib
import resource
import shutil
import subprocess
import tempfile
import time

ELEMENTS, CROSSED = 100, 5
LENGTH, RADIUS = 0.1, 2.5e-4
SPACING = LENGTH / CROSSED


def wire(start, direction, length, more):
    EI = 2e11 * math.pi / 4 * RADIUS**4
    return {"kind": "rod", "segments": [{"length": length, "radius": RADIUS, "EI": EI, "element": length / ELEMENTS}],
            "shape": {"start": start, "direction": direction, "normal": [0, 0, 1]}, **more}


def scene(rows, steps):
    bodies = {}
    loads = [{"at": 0.0141 + SPACING * k, "force": [0, 0, -1], "over": [[0, 0], [1, 0.05]]} for k in range(4)]
    for j in range(rows):
        bodies[f"low{j}"] = wire([0, j * SPACING, 0], [1, 0, 0], LENGTH,
                                 {"hold": [{"set": "start"}, {"set": "end", "turns": "free"}]})
        at = [SPACING * (j % CROSSED + 0.5), (j - 0.5) * SPACING - 0.004, 2 * RADIUS + 2e-5]
        bodies[f"up{j}"] = wire(at, [0, 1, 0], 0.94 * LENGTH, {"hold": [{"set": "start"}], "loads": loads})
    return {"schema": 1, "bodies": bodies, "contact": [{"between": ["*", "*"], "friction": 0.3}],
            "time": {"step": 1 / steps, "end": 1}, "output": {"picture": False, "plots": False}}


def run(program, rows, steps):
    with tempfile.TemporaryDirectory() as folder:
        (pathlib.Path(folder) / "scene.json").write_text(json.dumps(scene(rows, steps)))
        before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
        result = subprocess.run([program, "run", "scene.json", "--json", "--quiet", "--output", "out"], cwd=folder,
                                capture_output=True, text=True)
        seconds = time.monotonic() - begin
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if result.returncode != 0:
        raise SystemExit(result.stderr)
    out = json.loads(result.stdout)
    phases = out["seconds"]
    return {"elements": 2 * ELEMENTS * rows, "rods": 2 * rows, "contacts": out["contacts"]["max"],
            "steps": out["steps"], "iterations": out["iterations"], "seconds": round(seconds, 3),
            "processor": round(after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, 3),
            "contact": round(phases["contact_solve"], 3), "detection": round(phases["detection"], 3),
            "peak_memory": out["peak_memory"], "error": out["certificate"]["worst_error"]}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder")
    parser.add_argument("--rows", default="5,16,50,160,500")
    parser.add_argument("--steps", type=int, default=4)
    a = parser.parse_args()
    folder = pathlib.Path(a.folder).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    rows = []
    for n in map(int, a.rows.split(",")):
        rows.append(run(str(pathlib.Path(a.program).resolve()), n, a.steps))
        print(json.dumps(rows[-1]), flush=True)
    with open(folder / "many_rods.csv", "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    for i, j in zip(rows, rows[1:]):
        ratio = math.log(j["elements"] / i["elements"])
        print(f"{i['elements']} to {j['elements']}: time to the power {math.log(j['processor'] / i['processor']) / ratio:.2f}, "
              f"memory {math.log(j['peak_memory'] / i['peak_memory']) / ratio:.2f}")
    if shutil.which("gnuplot"):
        data = "\n".join(f"{r['elements']} {r['processor']} {r['peak_memory'] / 1e6}" for r in rows)
        script = f"""set terminal svg size 640,480
set output 'many_rods.svg'
set logscale xy
set key left top
set xlabel 'elements'
set ylabel 'processor time [s], peak memory [100 MB]'
set format x '10^{{%L}}'
$d << E
{data}
E
first = {rows[0]['processor'] / rows[0]['elements']}
plot $d using 1:2 with linespoints title 'time of a run of {a.steps} steps', \\
     $d using 1:($3/100) with linespoints title 'peak memory', first*x title 'linear'
"""
        subprocess.run(["gnuplot"], input=script, text=True, cwd=folder, check=True)


if __name__ == "__main__":
    main()
