#!/usr/bin/env python3
"""What rigid bodies from triangle files cost beside the same shapes given by name.

    rigid_triangles.py PROGRAM [--only TEXT] [--most SECONDS] [--sizes 1472,20000,100000]

Balls, an ellipsoid and boxes of triangles touch solids, rigid bodies, rods and obstacles in 110 steps; the
shape by name does the same. Printed are processor seconds of both runs, those of a run of one step
(reading, checking the surface, trees), and the ratio of the times without these.
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


def ball_file(path, triangles, radii=(1.0, 1.0, 1.0)):
    """Meridians and parallels: 2 n (m - 1) triangles."""
    m = max(4, round(math.sqrt(triangles / 2 * 0.75)))
    n = max(6, round(triangles / (2 * (m - 1))))
    points = [(0, 0, -1.0)]
    for j in range(1, m):
        a = math.pi * j / m
        points += [(math.sin(a) * math.cos(2 * math.pi * i / n), math.sin(a) * math.sin(2 * math.pi * i / n),
                    -math.cos(a)) for i in range(n)]
    points.append((0, 0, 1.0))
    cells = [(0, 1 + (i + 1) % n, 1 + i) for i in range(n)]
    for j in range(m - 2):
        for i in range(n):
            a, b = 1 + j * n + i, 1 + j * n + (i + 1) % n
            cells += [(a, b, b + n), (a, b + n, a + n)]
    last, first = len(points) - 1, 1 + (m - 2) * n
    cells += [(last, first + i, first + (i + 1) % n) for i in range(n)]
    # Tilted: its poles are no place of contact.
    c, s = math.cos(0.7), math.sin(0.7)
    points = [(x * radii[0], y * radii[1], z * radii[2]) for x, y, z in points]
    if radii[0] == radii[1] == radii[2]:
        points = [(x, c * y - s * z, s * y + c * z) for x, y, z in points]
    write_obj(path, points, cells)
    return len(cells)


def box_file(path, size, n):
    """Each side in n x n squares of two triangles."""
    number, points, cells = {}, [], []

    def point(p):
        if p not in number:
            number[p] = len(points)
            points.append(tuple(size[k] * (p[k] / n - 0.5) for k in range(3)))
        return number[p]

    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, n):
            for i in range(n):
                for j in range(n):
                    corner = []
                    for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)):
                        p = [0, 0, 0]
                        p[axis], p[u], p[v] = end, a, b
                        corner.append(point(tuple(p)))
                    if end == 0:
                        corner.reverse()
                    a, b, c, d = corner
                    cells += [(a, b, c), (a, c, d)]
    write_obj(path, points, cells)
    return len(cells)


def write_obj(path, points, cells):
    with open(path, "w") as out:
        out.writelines("v %.17g %.17g %.17g\n" % p for p in points)
        out.writelines("f %d %d %d\n" % tuple(k + 1 for k in c) for c in cells)


def base(bodies, contact, step, end, kind=None, gravity=None):
    s = {"schema": 1, "bodies": bodies, "contact": contact, "time": {"step": step, "end": end},
         "output": {"picture": False, "plots": False, "every": 100000}}
    if kind:
        s["time"]["kind"] = kind
    if gravity:
        s["gravity"] = gravity
    return s


def on_block(shape, cells=(10, 10, 4), element="H8", motion=None):
    """A ball of 20 mm pressed by 1 mm into a block and drawn along it, 110 steps."""
    block = {"kind": "solid", "youngs_modulus": 1e5, "poisson_ratio": 0.3,
             "mesh": {"generate": "box", "size": [0.1, 0.1, 0.04], "cells": list(cells), "element": element,
                      "centre": [0, 0, -0.02]}, "hold": [{"set": "z_min"}]}
    if motion:
        block["motion"] = motion
    ball = {"kind": "rigid", "shape": shape, "start": {"place": [-0.02, 0, 0.0201]},
            "drive": {"x": [[0, 0], [10, 0], [110, 0.04]], "z": [[0, 0], [10, -0.0011]]}}
    return base({"block": block, "ball": ball}, [{"between": ["block", "ball"], "friction": 0.3}], 1, 110)


def on_rigid(shape):
    """A ball of 20 mm that rolls over a fixed one."""
    fixed = {"kind": "rigid", "shape": shape, "drive": {"z": [[0, 0], [1, 0]]}}
    ball = {"kind": "rigid", "shape": shape, "density": 1000, "start": {"place": [0.002, 0.001, 0.0405]}}
    return base({"fixed": fixed, "ball": ball}, [{"between": ["ball", "fixed"], "friction": 0.3}], 2e-3, 0.22,
                "dynamic", [0, 0, -9.81])


def under_named(shape):
    """The same of a ball by name over one of triangles."""
    s = on_rigid(shape)
    s["bodies"]["ball"]["shape"] = {"generate": "ball", "radius": 0.02}
    return s


def on_box(shape):
    """A ball that falls on a rigid box, and rolls."""
    bed = {"kind": "rigid", "shape": {"generate": "box", "size": [0.2, 0.2, 0.02]}, "drive": {"z": [[0, 0], [1, 0]]},
           "start": {"place": [0, 0, -0.01]}}
    ball = {"kind": "rigid", "shape": shape, "density": 1000,
            "start": {"place": [0, 0, 0.021], "velocity": [0.2, 0, 0]}}
    return base({"bed": bed, "ball": ball}, [{"between": ["ball", "bed"], "friction": 0.3}], 2e-3, 0.22,
                "dynamic", [0, 0, -9.81])


def on_plane(shape):
    s = on_box(shape)
    s["bodies"]["bed"] = {"kind": "obstacle", "surface": {"generate": "plane"}}
    return s


def on_rod(shape):
    """A ball pressed on a rod that is held at both ends, and drawn along it."""
    rod = {"kind": "rod", "segments": [{"length": 0.2, "radius": 1e-3, "EI": 7.85e-4, "element": 5e-3}],
           "hold": [{"set": "start"}, {"set": "end"}]}
    ball = {"kind": "rigid", "shape": shape, "start": {"place": [0.08, 0, 0.0211]},
            "drive": {"x": [[0, 0], [10, 0], [110, 0.04]], "z": [[0, 0], [10, -0.003]]}}
    return base({"rod": rod, "ball": ball}, [{"between": ["rod", "ball"], "friction": 0.2}], 1, 110)


def in_canal(shape):
    """A head through an elastic canal that is a little narrower."""
    canal = {"kind": "solid", "youngs_modulus": 1e5, "poisson_ratio": 0.3,
             "mesh": {"generate": "tube", "radius": 0.0195, "thickness": 0.012, "element": "H8", "around": 20,
                      "along": 10, "through": 2,
                      "centreline": {"pieces": [{"length": 0.1}], "direction": [0, 0, 1], "normal": [1, 0, 0]}},
             "hold": [{"set": "outer"}]}
    head = {"kind": "rigid", "shape": shape, "start": {"place": [0, 0, -0.0195 - 0.02]},
            "drive": {"z": [[0, 0], [110, 0.08]]}}
    return base({"canal": canal, "head": head}, [{"between": ["canal", "head"], "surfaces": ["inner", ""], "friction": 0.1}], 1, 110)


def box_on_block(shape):
    """A box of 40 mm pressed flat on a block and drawn along it."""
    s = on_block(shape)
    s["bodies"]["ball"]["start"]["place"] = [-0.01, 0.0, 0.0201]
    s["bodies"]["ball"]["drive"] = {"x": [[0, 0], [10, 0], [110, 0.02]], "z": [[0, 0], [10, -0.0006]]}
    return s


def run(program, path, folder, *more, most=600):
    out = os.path.join(folder, "out")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run([program, "run", path, "--output", out, "--json", "--quiet", *more],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=most)
    except subprocess.TimeoutExpired:
        return most, None, "ended"
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
    if done.returncode != 0:
        return cpu, None, (done.stderr.strip().splitlines() or ["code %d" % done.returncode])[0]
    return cpu, json.load(open(os.path.join(out, "manifest.json"))), ""


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("--only", default="")
    parser.add_argument("--most", type=float, default=300)
    parser.add_argument("--sizes", default="1472,20000,100000")
    arguments = parser.parse_args()
    sizes = [int(x) for x in arguments.sizes.split(",")]
    named_ball = {"generate": "ball", "radius": 0.02}
    named_head = {"generate": "ellipsoid", "radii": [0.02, 0.02, 0.025]}
    named_box = {"generate": "box", "size": [0.04, 0.04, 0.04]}
    scenes = [("ball on H8 block", on_block, named_ball),
              ("ball on T4 block", lambda s: on_block(s, element="T4"), named_ball),
              ("ball on T10 block", lambda s: on_block(s, (6, 6, 3), "T10"), named_ball),
              ("ball on rigid ball", on_rigid, named_ball),
              ("ball by name on rigid ball", under_named, named_ball), ("ball on rigid box", on_box, named_ball),
              ("ball on plane", on_plane, named_ball), ("ball on rod", on_rod, named_ball),
              ("head in canal", in_canal, named_head), ("box on H8 block", box_on_block, named_box)]
    print("scene,triangles,named_s,triangles_s,set_up_s,ratio,steps,outcome", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for name, make, named in scenes:
            if arguments.only not in name:
                continue
            path = os.path.join(folder, "scene.json")

            def spent(shape):
                scene = make(shape)
                json.dump(scene, open(path, "w"))
                whole, manifest, output = run(arguments.program, path, folder, most=arguments.most)
                if manifest is None:
                    return whole, 0, 0, output
                first, _, output1 = run(arguments.program, path, folder, "--set", "time.end=%g" % scene["time"]["step"],
                                      most=arguments.most)
                return whole, first, manifest["steps"], output1

            own, first, steps, output = spent(named)
            print("%s,0,%.3f,,%.3f,,%s,%s" % (name, own, first, steps, output), flush=True)
            for size in sizes:
                file = os.path.join(folder, "shape.obj")
                if "box on H8" in name:
                    count = box_file(file, named["size"], max(1, round(math.sqrt(size / 12))))
                else:
                    count = ball_file(file, size, named.get("radii") or [named["radius"]] * 3)
                t, f, k, output = spent({"file": "shape.obj"})
                print("%s,%d,%.3f,%.3f,%.3f,%.2f,%s,%s" % (name, count, own, t, f, (t - f) / max(own - first, 1e-3), k, output),
                      flush=True)


main()
