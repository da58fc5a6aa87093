#!/usr/bin/env python3
"""What walls from triangle files cost a wire's run.

Writes vessels of triangles (a winding tube of N triangles, coarse and fine, a branching one, and a
given patient's surface with each triangle cut into n^2), pushes a guidewire through each and prints
processor time, the share that detection has of the steps, and memory; a second run with --cache.

    validation/bench/surface_walls.py build/release/bin/amontons [OTHER_PROGRAM] [--aorta FILE.obj]

Where two programs are given they run in turns, and their histories are compared.
"""
import argparse
import csv
import json
import math
import os
import resource
import subprocess
import sys
import tempfile


def winding(path, around, along, wobble=0.0):
    """A tube of 4 to 5 mm radius around a winding line, as an iliac artery [mm]."""
    def centre(s):
        return (14 * math.sin(s / 22), 12 * math.sin(s / 31 + 0.7) - 12 * math.sin(0.7), s)

    length = 180.0
    with open(path, "w") as out:
        for i in range(along + 1):
            s = length * i / along
            c, d = centre(s), centre(s + 1e-4)
            t = [(d[k] - c[k]) / 1e-4 for k in range(3)]
            norm = math.sqrt(sum(x * x for x in t))
            t = [x / norm for x in t]
            u = [1 - t[0] * t[0], -t[0] * t[1], -t[0] * t[2]]
            norm = math.sqrt(sum(x * x for x in u))
            u = [x / norm for x in u]
            v = [t[1] * u[2] - t[2] * u[1], t[2] * u[0] - t[0] * u[2], t[0] * u[1] - t[1] * u[0]]
            for j in range(around):
                a = 2 * math.pi * (j + 0.5 * (i % 2)) / around
                r = 4.5 + 0.5 * math.sin(s / 9) + wobble * math.sin(5 * a + s / 3)
                out.write("v %.9g %.9g %.9g\n" % tuple(
                    c[k] + r * (math.cos(a) * u[k] + math.sin(a) * v[k]) for k in range(3)))
        for i in range(along):
            for j in range(around):
                a, b = i * around + j + 1, i * around + (j + 1) % around + 1
                c, d = a + around, b + around
                if i % 2:
                    out.write("f %d %d %d\nf %d %d %d\n" % (a, d, b, a, c, d))
                else:
                    out.write("f %d %d %d\nf %d %d %d\n" % (a, c, b, b, c, d))
    return 2 * around * along


def cut(source, path, n):
    """Each triangle of an OBJ file cut into n^2."""
    points, triangles = [], []
    for line in open(source):
        w = line.split()
        if w[:1] == ["v"]:
            points.append(tuple(float(x) for x in w[1:4]))
        elif w[:1] == ["f"]:
            triangles.append([int(x.split("/")[0]) - 1 for x in w[1:4]])
    known, out, cells = {}, [], []

    def point(t, i, j):
        weights = sorted((k, v) for k, v in zip(t, (n - i - j, i, j)) if v)
        key = tuple(weights)
        if key not in known:
            known[key] = len(out)
            out.append(tuple(sum(v * points[k][a] for k, v in weights) / n for a in range(3)))
        return known[key] + 1

    for t in triangles:
        for i in range(n):
            for j in range(n - i):
                cells.append((point(t, i, j), point(t, i + 1, j), point(t, i, j + 1)))
                if i + j < n - 1:
                    cells.append((point(t, i + 1, j), point(t, i + 1, j + 1), point(t, i, j + 1)))
    with open(path, "w") as f:
        f.writelines("v %.9g %.9g %.9g\n" % p for p in out)
        f.writelines("f %d %d %d\n" % c for c in cells)
    return len(cells)


def scene(surface, at, direction, insertion, element=None, instrument="guidewire-stiff"):
    wire = {"kind": "beam", "instrument": instrument, "length": 2 * insertion,
            "introducer": {"at": at, "direction": direction},
            "drive": {"insertion": [[0, 0], [10, insertion]], "twist": [[0, 0], [10, 3]]}}
    if element:
        wire["element"] = element
    return {"schema": 1,
            "bodies": {"vessel": {"kind": "obstacle", "side": "inside",
                                  "surface": {"file": surface, "scale": 1e-3}}, "wire": wire},
            "contact": [{"between": ["wire", "vessel"], "friction": 0.1}],
            "output": {"picture": False, "plots": False}, "time": {"step": 0.02, "end": 10}}


def run(program, name, folder, *more):
    out = os.path.join(folder, "out")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([program, "run", name, "--output", out, "--json", *more],
                          stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in (0, 3):
        sys.exit(done.stderr)
    manifest = json.load(open(os.path.join(out, "manifest.json")))
    s = manifest["seconds"]
    step = s["free_motion"] + s["detection"] + s["compliance"] + s["contact_solve"] + s["correction"]
    history = [row for row in csv.reader(open(os.path.join(out, "history.csv")))]
    return {"cpu": after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime,
            "detection": s["detection"], "share": s["detection"] / step,
            "memory": manifest["peak_memory"] / 1e6, "steps": manifest["steps"], "history": history}


def different(a, b):
    """The largest relative difference of two histories' numbers, but seconds."""
    if len(a) != len(b):
        return float("inf")
    worst = 0.0
    for k, name in enumerate(a[0]):
        if "seconds" in name or "iteration" in name:  # of a clock, and of the way there
            continue
        try:
            x, y = ([float(r[k]) if r[k] else 0.0 for r in h[1:]] for h in (a, b))
        except ValueError:  # words
            continue
        size = max(map(abs, x + y), default=0.0)
        if size > 0 and not any(w in name for w in ("certificate", "worst", "error", "factorisation")):
            worst = max(worst, max(abs(p - q) for p, q in zip(x, y)) / size)
    return worst


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program", nargs="+")
    parser.add_argument("--aorta")
    parser.add_argument("--only", default="")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        cases = []
        for name, around, along, wobble, element in (
                ("winding_3000", 20, 75, 0, None), ("winding_45000", 72, 312, 0.15, None),
                ("winding_100000", 108, 463, 0.15, None),
                ("winding_45000_fine_wire", 72, 312, 0.15, 0.5e-3)):
            file = os.path.join(folder, name + ".obj")
            cases.append((name, winding(file, around, along, wobble),
                          scene(file, [0, 0, 2e-3], [14 / 22, 12 / 31 * math.cos(0.7), 1], 0.16,
                                element)))
        if arguments.aorta:
            at, direction = [-0.257, 0.039, -0.036], [-60, 23, -38]
            for n in (1, 4, 5):
                file = os.path.join(folder, "aorta_%d.obj" % n)
                count = cut(arguments.aorta, file, n)
                cases.append(("aorta_cut_%d" % n, count, scene(file, at, direction, 0.2)))
        print("case,triangles,program,processor_s,detection_s,share_of_step,memory_MB,steps,difference")
        for name, count, what in cases:
            if arguments.only and arguments.only not in name:
                continue
            path = os.path.join(folder, name + ".json")
            json.dump(what, open(path, "w"))
            first = None
            for k, program in enumerate(arguments.program):
                ways = [("", ())]
                if k == 0:
                    cache = os.path.join(folder, "cache_" + name)
                    ways += [(" first with cache", ("--cache", cache)), (" cached", ("--cache", cache)),
                             (" threads 2", ("--threads", "2"))]
                for label, more in ways:
                    r = run(program, path, folder, *more)
                    first = first or r
                    print("%s,%d,%s,%.2f,%.2f,%.3f,%.0f,%d,%.1e" % (
                        name, count, os.path.basename(program) + label, r["cpu"], r["detection"],
                        r["share"], r["memory"], r["steps"], different(first["history"], r["history"])),
                        flush=True)


main()
