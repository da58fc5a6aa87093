#!/usr/bin/env python3
"""Random variants of scenes in which a contact is easily lost in silence.

    validation/search/variants.py --program PATH [--kinds a,b] [--count 20] [--seed 1] [--jobs 1]
                                  [--reference-program PATH] [--cache DIR] [--keep DIR] [--json FILE]

Each kind is a function that draws a scene and states what is right for it: a closed form, a law, or the same
scene with many small steps, a fine mesh or a reach chosen by hand. README.md beside this file lists the kinds.
Prints a table kind x outcome and every WRONG with the path of its scene. Exit 1 if an answer is WRONG, a run
crashes, or more than 5 % of a kind are refused where that is not right; else 0.
"""
import argparse
import concurrent.futures
import csv
import dataclasses
import hashlib
import json
import math
import pathlib
import random
import re
import struct
import subprocess
import sys
import tempfile
import threading
import time
from typing import Callable, Optional

STEPS = (1, 2, 3, 5, 10, 20)
OUTCOMES = ("done-right", "done-warned", "refused", "refused-timeout", "bad-input", "WRONG", "crash")
SAME = 1e-3  # relative difference allowed between numbers of steps, or with and without a reach
SAME_LINEAR = 1e-6  # the same of linear solids on obstacles, whose answer does not depend on the path
REFUSED_SHARE = 0.05  # of a kind
OVERLAP_SHARE = 0.1  # of the smaller face or the thinner body


# ---------------------------------------------------------------------------------------------------------------
# What is expected of a variant


@dataclasses.dataclass
class Band:
    """Bounds of a contact force [N]; above `silent_high` a warning is needed."""

    low: float
    high: float = math.inf
    silent_high: float = math.inf
    how: str = ""  # where the bounds come from


@dataclasses.dataclass
class Variant:
    """A scene and what is right for it."""

    scene: dict
    label: str = ""  # what was drawn, in a few words
    pair: tuple = ()  # names of the two bodies whose contact force is judged
    axis: tuple = (0.0, 0.0, 1.0)  # direction in which the force is taken
    band: Optional[Band] = None
    overlap_limit: float = math.inf  # [m]
    may_refuse: bool = False
    starts_inside: bool = False  # bad input is right
    law: Optional[Callable] = None  # Run -> what is wrong, or ""
    weak: str = ""  # why the reference is not firm
    references: list = dataclasses.field(default_factory=list)  # scenes of the references


@dataclasses.dataclass
class Run:
    """What a run of the program left."""

    code: Optional[int]  # None: out of time
    result: dict
    message: str
    warnings: list
    overlap: Optional[float]  # worst of all steps [m], where it is reported
    seconds: float
    measured: Optional[float] = None  # overlap of a pair's surfaces at the end [m], where it was requested

    def done(self):
        """Whether the run ended well with a readable result."""
        return self.code == 0 and self.result.get("status") == "done"

    def quantity(self, name):
        """One of the named results, or None."""
        return self.result.get("quantities", {}).get(name)

    def force(self, pair, axis):
        """Size of the contact force of a pair along an axis [N]; either order of names, either sign."""
        for a, b in (pair, tuple(reversed(pair))):
            parts = [self.quantity(f"{a}_on_{b}_force_{i}") for i in "xyz"]
            if None not in parts:
                return abs(sum(p * n for p, n in zip(parts, axis)))
        return None


# ---------------------------------------------------------------------------------------------------------------
# Running scenes


class Program:
    """Runs scenes with one program, in folders that are removed."""

    def __init__(self, path, limit):
        self.path = pathlib.Path(path).resolve()
        self.limit = limit
        self.hash = hashlib.sha256(self.path.read_bytes()).hexdigest()[:16]

    def has_field(self, field):
        """Whether the scene format has a field of this name."""
        text = subprocess.run([self.path, "schema"], capture_output=True, text=True, timeout=60).stdout
        return f'"{field}"' in text

    def run(self, scene, measured_pair=()):
        """Runs a scene and reads its result, warnings and overlap; measures that of a pair at the end."""
        with tempfile.TemporaryDirectory(prefix="amontons_variant_") as folder:
            file, output = pathlib.Path(folder, "scene.json"), pathlib.Path(folder, "out")
            file.write_text(json.dumps(scene))
            start = time.monotonic()
            try:
                done = subprocess.run(
                    [self.path, "run", file, "--json", "--quiet", "--threads", "1", "--output", output],
                    capture_output=True, text=True, timeout=self.limit, cwd=folder, errors="replace")
            except subprocess.TimeoutExpired:
                return Run(None, {}, f"not done in {self.limit:g} s", [], None, time.monotonic() - start)
            seconds = time.monotonic() - start
            try:
                result = json.loads(done.stdout)
            except json.JSONDecodeError:
                result = {}
            message = result.get("message") or done.stderr.strip()
            if result.get("issues"):
                message = json.dumps(result["issues"])
            run = Run(done.returncode, result, message[:400], warnings_of(result, output),
                      overlap_of(result, output), seconds)
            if measured_pair and run.done():
                run.measured = measured_overlap(output / "frames", scene, measured_pair)
            return run


def warnings_of(result, output):
    """The warnings of a run: of its JSON, or of its manifest."""
    if result.get("warnings"):
        return result["warnings"]
    try:
        return json.loads((output / "manifest.json").read_text()).get("warnings", [])
    except (OSError, json.JSONDecodeError):
        return []


def overlap_of(result, output):
    """Worst overlap of the surfaces in any step [m]: of the certificate, or of the history; None if neither states."""
    worst = result.get("certificate", {}).get("worst_overlap")
    try:
        with (output / "history.csv").open() as file:
            for row in csv.DictReader(file):
                for name, value in row.items():
                    if name and name.startswith("worst_overlap") and value:
                        worst = max(worst or 0.0, float(value))
    except (OSError, ValueError):
        pass
    return worst


# ---------------------------------------------------------------------------------------------------------------
# Overlap of surfaces, measured on the last frame


def arrays_of(file):
    """The arrays of a VTK file with raw appended data, by name; of a name used twice the last that is not empty."""
    data = file.read_bytes()
    start = data.index(b"_", data.index(b"<AppendedData")) + 1
    codes = {"Float64": "d", "Float32": "f", "Int32": "i", "Int64": "q", "UInt8": "B"}
    arrays = {}
    for tag in re.findall(rb"<DataArray ([^>]*)>", data[:start]):
        field = dict(re.findall(r'(\w+)="([^"]*)"', tag.decode()))
        if field.get("format") != "appended" or field["type"] not in codes:
            continue
        at = start + int(field["offset"])
        size, = struct.unpack_from("<Q", data, at)
        code = codes[field["type"]]
        values = struct.unpack_from(f"<{size // struct.calcsize(code)}{code}", data, at + 8)
        if values or field["Name"] not in arrays:
            arrays[field["Name"]] = values
    return arrays


HEX_FACES = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))
TET_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))
TET_EDGES = {(0, 1): 4, (1, 2): 5, (0, 2): 6, (0, 3): 7, (1, 3): 8, (2, 3): 9}


def curved_triangles(p, parts=4):
    """A face of six nodes, three of them between the corners, as flat triangles, so many along each side."""

    def place(i, j):
        b, c = i / parts, j / parts
        a = 1 - b - c
        weights = (a * (2 * a - 1), b * (2 * b - 1), c * (2 * c - 1), 4 * a * b, 4 * b * c, 4 * a * c)
        return tuple(sum(w * x for w, x in zip(weights, axis)) for axis in zip(*p))

    triangles = []
    for i in range(parts):
        for j in range(parts - i):
            triangles.append((place(i, j), place(i + 1, j), place(i, j + 1)))
            if i + j < parts - 1:
                triangles.append((place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)))
    return triangles


def surface_triangles(file):
    """Triangles of a body's surface in a frame, each three points; curved faces by sixteen."""
    arrays = arrays_of(file)
    flat = arrays["points"]
    points = [flat[i:i + 3] for i in range(0, len(flat), 3)]
    ends, nodes = arrays["offsets"], arrays["connectivity"]
    cells = [nodes[a:b] for a, b in zip((0, *ends), ends)]
    if file.suffix == ".vtp":
        return [tuple(points[n] for n in c) for c in cells if len(c) == 3]
    faces = {}
    for cell in cells:
        for local in HEX_FACES if len(cell) == 8 else TET_FACES:
            corners = tuple(cell[i] for i in local)
            ring = corners
            if len(cell) == 10:
                pairs = zip(local, local[1:] + local[:1])
                ring = corners + tuple(cell[TET_EDGES[tuple(sorted(p))]] for p in pairs)
            key = tuple(sorted(corners))
            if faces.pop(key, None) is None:
                faces[key] = ring
    triangles = []
    for ring in faces.values():
        p = [points[n] for n in ring]
        if len(p) == 4:
            middle = tuple(sum(x) / 4 for x in zip(*p))
            triangles += [(a, b, middle) for a, b in zip(p, p[1:] + p[:1])]
        elif len(p) == 6:
            triangles += curved_triangles(p)
        else:
            triangles.append(tuple(p))
    return triangles


def minus(a, b):
    """Difference of two vectors."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def dot(a, b):
    """Product of two vectors."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def samples_of(triangles, longest):
    """Corners and middles of triangles that are split until no edge is longer."""
    points, stack = set(), list(triangles)
    while stack:
        t = stack.pop()
        edges = [math.dist(t[i], t[(i + 1) % 3]) for i in range(3)]
        if max(edges) > longest:
            i = edges.index(max(edges))
            a, b, c = t[i], t[(i + 1) % 3], t[(i + 2) % 3]
            m = tuple((x + y) / 2 for x, y in zip(a, b))
            stack += [(a, m, c), (m, b, c)]
        else:
            points.update(tuple(p) for p in t)
            points.add(tuple(sum(x) / 3 for x in zip(*t)))
    return sorted(points)


class Inside:
    """Whether a point is inside a closed surface, by the crossings of a line askew to everything."""

    TURN = (0.3141, -0.2718, 0.1618)

    def __init__(self, triangles):
        self.triangles = [tuple(rotated(p, self.TURN) for p in t) for t in triangles]
        sides = [[min(p[i] for t in self.triangles for p in t), max(p[i] for t in self.triangles for p in t)]
                 for i in (0, 1)]
        self.low = [s[0] for s in sides]
        count = max(1, int(math.sqrt(len(triangles)) / 2))
        self.size = [(s[1] - s[0]) / count or 1.0 for s in sides]
        self.buckets = {}
        for t in self.triangles:
            spans = [range(self.place(min(p[i] for p in t), i), self.place(max(p[i] for p in t), i) + 1) for i in (0, 1)]
            for i in spans[0]:
                for j in spans[1]:
                    self.buckets.setdefault((i, j), []).append(t)

    def place(self, value, axis):
        """Bucket of a coordinate."""
        return math.floor((value - self.low[axis]) / self.size[axis])

    def __call__(self, point):
        x, y, z = rotated(point, self.TURN)
        crossings = 0
        for a, b, c in self.buckets.get((self.place(x, 0), self.place(y, 1)), ()):
            d = (b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])
            if d == 0:
                continue
            u = ((x - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (y - a[1])) / d
            v = ((b[0] - a[0]) * (y - a[1]) - (x - a[0]) * (b[1] - a[1])) / d
            if u >= 0 and v >= 0 and u + v <= 1 and a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2]) > z:
                crossings += 1
        return crossings % 2 == 1


def distance_to(point, triangle):
    """Distance of a point to a triangle."""
    a, b, c = triangle
    ab, ac, ap = minus(b, a), minus(c, a), minus(point, a)
    d11, d12, d22, p1, p2 = dot(ab, ab), dot(ab, ac), dot(ac, ac), dot(ap, ab), dot(ap, ac)
    area = d11 * d22 - d12 * d12
    if area > 0:
        u, v = (d22 * p1 - d12 * p2) / area, (d11 * p2 - d12 * p1) / area
        if u >= 0 and v >= 0 and u + v <= 1:
            return math.sqrt(max(0.0, dot(ap, ap) - u * p1 - v * p2))
    best = math.inf
    for p, q in ((a, b), (b, c), (c, a)):
        pq, px = minus(q, p), minus(point, p)
        long = dot(pq, pq)
        t = min(1.0, max(0.0, dot(px, pq) / long)) if long else 0.0
        best = min(best, math.dist(px, (t * pq[0], t * pq[1], t * pq[2])))
    return best


def thinned(items, most):
    """At most so many of a list, evenly chosen."""
    return items if len(items) <= most else [items[i * len(items) // most] for i in range(most)]


def measured_overlap(frames, scene, pair):
    """Deepest point of either surface in the other, or of one below a plane, at the end of a run [m]; None where
    that cannot be measured."""
    surfaces, planes = [], []
    for name in pair:
        body = scene["bodies"][name]
        if body["kind"] == "obstacle":
            planes.append(body["surface"])
            continue
        files = sorted(file for kind in ("vtu", "vtp") for file in frames.glob(f"{name}.*.{kind}"))
        if not files:
            return None
        surfaces.append(surface_triangles(files[-1]))
    if not all(surfaces):
        return None
    deepest = 0.0
    for plane in planes:
        if plane["generate"] != "plane":
            return None
        axis, centre = plane.get("axis", (0, 0, 1)), plane.get("centre", (0, 0, 0))
        points = [minus(p, centre) for s in surfaces for t in s for p in t]
        return max(0.0, *(-dot(p, axis) for p in points)) / math.hypot(*axis)
    boxes = [[(min(x), max(x)) for x in zip(*(p for t in s for p in t))] for s in surfaces]
    smaller = min(max(h - l for l, h in box) for box in boxes)
    for mine, other, box in ((*surfaces, boxes[1]), (*surfaces[::-1], boxes[0])):
        near = [t for t in mine if all(max(x) > l and min(x) < h for x, (l, h) in zip(zip(*t), box))]
        points = [p for p in samples_of(near, smaller / 16) if all(l < x < h for x, (l, h) in zip(p, box))]
        inside = Inside(other)
        for point in thinned([p for p in thinned(points, 2000) if inside(p)], 80):
            depth = math.inf
            for t in other:
                if minimum_gap(point, t) < depth:
                    depth = min(depth, distance_to(point, t))
            deepest = max(deepest, depth)
    return deepest


def minimum_gap(point, triangle):
    """A bound from below on the distance of a point to a triangle, by the axes."""
    a, b, c = triangle
    gap = 0.0
    for x, p, q, r in zip(point, a, b, c):
        gap = max(gap, min(p, q, r) - x, x - max(p, q, r))
    return gap


class Lab:
    """Makes references with the reference program and keeps them on disk by a hash of scene and program."""

    def __init__(self, program, cache, resolves):
        self.program = program
        self.cache = cache
        self.resolves = resolves  # whether the program under test has "start_overlap"
        self.seconds = 0.0
        self.lock = threading.Lock()
        if cache:
            cache.mkdir(parents=True, exist_ok=True)

    def answer(self, scene, pair, axis=(0, 0, 1)):
        """Contact forces of a reference scene [N]: at its end, or None; and where it stopped before its end, or 0;
        and the overlap of its surfaces at the end [m], 0 where it cannot be measured."""
        text = json.dumps(scene, sort_keys=True)
        key = hashlib.sha256(f"{self.program.hash} {pair} {tuple(axis)} {text}".encode()).hexdigest()[:32]
        file = self.cache / f"{key}.json" if self.cache else None
        if file and file.exists():
            kept = json.loads(file.read_text())
            return kept["force"], kept["reached"], kept["overlap"]
        run = self.program.run(scene, pair)
        value = run.force(pair, axis) if run.done() else None
        reached = (run.force(pair, axis) or 0.0) if run.code == 3 else 0.0
        overlap = max(run.measured or 0.0, run.overlap or 0.0)
        with self.lock:
            self.seconds += run.seconds
        if file:
            part = file.with_suffix(f".{threading.get_ident()}")
            part.write_text(json.dumps({"force": value, "reached": reached, "overlap": overlap,
                                        "seconds": run.seconds, "message": run.message}))
            part.replace(file)
        return value, reached, overlap


# ---------------------------------------------------------------------------------------------------------------
# Drawing numbers


class Draw:
    """Random numbers of one variant, rounded so that scenes can be read."""

    def __init__(self, seed):
        self.random = random.Random(seed)

    def between(self, low, high):
        """Uniform, four digits."""
        return short(self.random.uniform(low, high))

    def scale(self, low, high):
        """Uniform in the logarithm, two digits."""
        return short(math.exp(self.random.uniform(math.log(low), math.log(high))), 2)

    def whole(self, low, high):
        """A whole number, both ends possible."""
        return self.random.randint(low, high)

    def one_of(self, *values):
        """One of the values."""
        return self.random.choice(values)

    def chance(self, share):
        """True in this share of cases."""
        return self.random.random() < share

    def element(self):
        """A kind of element."""
        return self.one_of("T4", "T10", "H8")

    def elastic(self):
        """Young's modulus and Poisson's ratio of a solid."""
        return {"youngs_modulus": self.scale(1e3, 1e10), "poisson_ratio": self.one_of(0.0, 0.2, 0.3, 0.3, 0.4, 0.45)}

    def turn(self):
        """A rotation vector for the whole scene, none in half of the cases."""
        if self.chance(0.5):
            return (0.0, 0.0, 0.0)
        return tuple(self.between(-1.5, 1.5) for _ in range(3))


def short(value, digits=4):
    """A number rounded to some digits."""
    return float(f"{value:.{digits}g}")


# ---------------------------------------------------------------------------------------------------------------
# Pieces of scenes


def box_mesh(size, cells, element, centre):
    """Mesh of a block."""
    return {"generate": "box", "size": list(size), "cells": list(cells), "element": element, "centre": list(centre)}


def solid(mesh, elastic, hold, **more):
    """An elastic body."""
    return {"kind": "solid", "mesh": mesh, **elastic, "hold": hold, **more}


def rigid(shape, place, **more):
    """A rigid body."""
    start = {"place": list(place)}
    if "turn" in more:
        start["turn"] = list(more.pop("turn"))
    if "velocity" in more:
        start["velocity"] = list(more.pop("velocity"))
    return {"kind": "rigid", "shape": shape, "start": start, **more}


def pressed(depth):
    """A drive by `depth` against z in one second."""
    return {"x": 0, "y": 0, "z": [[0, 0], [1, -depth]]}


def still():
    """A drive that holds a body where it is."""
    return {"x": 0, "y": 0, "z": 0, "angle": 0}


def scene_of(bodies, law, time_):
    """A whole scene with one contact law."""
    return {"schema": 1, "bodies": bodies, "contact": [law], "time": time_,
            "output": {"picture": False, "plots": False, "every": 1000}}


def in_steps(count):
    """Quasi-static time of one second in a number of steps."""
    return {"kind": "quasi_static", "step": 1.0 / count, "end": 1.0}


def with_steps(scene, count):
    """The same scene in another number of steps."""
    return {**scene, "time": {**scene["time"], "step": scene["time"]["end"] / count}}


def with_law(scene, **changes):
    """The same scene with changes of its contact law; None takes a field away."""
    law = {**scene["contact"][0], **changes}
    return {**scene, "contact": [{k: v for k, v in law.items() if v is not None}]}


def with_cells(scene, name, cells, element=None):
    """The same scene with another mesh of a block."""
    body = scene["bodies"][name]
    mesh = {**body["mesh"], "cells": list(cells), "element": element or body["mesh"]["element"]}
    return {**scene, "bodies": {**scene["bodies"], name: {**body, "mesh": mesh}}}


def rotated(vector, turn):
    """A vector turned by a rotation vector."""
    angle = math.sqrt(sum(t * t for t in turn))
    if angle == 0:
        return tuple(vector)
    n = [t / angle for t in turn]
    dot = sum(a * b for a, b in zip(n, vector))
    cross = (n[1] * vector[2] - n[2] * vector[1], n[2] * vector[0] - n[0] * vector[2],
             n[0] * vector[1] - n[1] * vector[0])
    c, s = math.cos(angle), math.sin(angle)
    return tuple(c * v + s * x + (1 - c) * dot * k for v, x, k in zip(vector, cross, n))


def turn_after(second, first):
    """Rotation vector of `first` followed by `second`, by quaternions."""
    def quaternion(w):
        angle = math.sqrt(sum(t * t for t in w))
        f = 0.5 if angle == 0 else math.sin(angle / 2) / angle
        return math.cos(angle / 2), [f * t for t in w]

    (a, u), (b, v) = quaternion(second), quaternion(first)
    w = a * b - sum(x * y for x, y in zip(u, v))
    cross = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    r = [a * y + b * x + z for x, y, z in zip(u, v, cross)]
    size = math.sqrt(sum(x * x for x in r))
    if size == 0:
        return (0.0, 0.0, 0.0)
    factor = 2 * math.atan2(size, w) / size
    return tuple(factor * x for x in r)


def turned(scene, turn):
    """The whole scene turned about the origin. Holds must be without values; drives have common times."""
    if not any(turn):
        return scene
    bodies = {}
    for name, body in scene["bodies"].items():
        body = json.loads(json.dumps(body))
        if body["kind"] == "obstacle":
            surface = body["surface"]
            surface["centre"] = list(rotated(surface.get("centre", (0, 0, 0)), turn))
            if surface["generate"] != "ball":
                surface["axis"] = list(rotated(surface.get("axis", (0, 0, 1)), turn))
        else:
            start = body.setdefault("start", {})
            start["turn"] = list(turn_after(turn, start.get("turn", (0, 0, 0))))
            for key in ("place", "velocity"):
                if key in start:
                    start[key] = list(rotated(start[key], turn))
            if "drive" in body:
                body["drive"] = turned_drive(body["drive"], turn)
        bodies[name] = body
    more = {"gravity": list(rotated(scene["gravity"], turn))} if "gravity" in scene else {}
    return {**scene, "bodies": bodies, **more}


def turned_drive(drive, turn):
    """A drive of x, y, z along turned axes."""
    times = sorted({row[0] for c in drive.values() if isinstance(c, list) and c and isinstance(c[0], list)
                    for row in c}) or [0]

    def at(curve, t):
        if not isinstance(curve, list):
            return curve
        if t <= curve[0][0]:
            return curve[0][1]
        for (t0, v0), (t1, v1) in zip(curve, curve[1:]):
            if t <= t1:
                return v0 + (v1 - v0) * (t - t0) / (t1 - t0)
        return curve[-1][1]

    rows = [(t, rotated([at(drive.get(k, 0), t) for k in "xyz"], turn)) for t in times]
    result = {k: [[t, v[i]] for t, v in rows] for i, k in enumerate("xyz")}
    if "angle" in drive:
        result["angle"] = drive["angle"]
        result["axis"] = list(rotated(drive.get("axis", (0, 0, 1)), turn))
        if "about" in drive:
            result["about"] = list(rotated(drive["about"], turn))
    return result


def allowed_overlap(size, cells, *thin):
    """A tenth of the smaller face of a block's upper side, or of the thinner body."""
    return OVERLAP_SHARE * min(size[0] / cells[0], size[1] / cells[1], size[2], *thin)


# ---------------------------------------------------------------------------------------------------------------
# References


@dataclasses.dataclass
class Reference:
    """A force [N] (None: unknown), the lower of two that agree, why it is weak ("" if it is firm), a force that was
    reached before the end."""

    value: Optional[float]
    lowest: Optional[float]
    weak: str
    reached: float


def agreed(lab, variant, within, axis=(0, 0, 1)):
    """Force of the first of a variant's reference scenes with which another one agrees within a share. They are run
    in turn; one whose surfaces overlap by more than is allowed does not count."""
    known, reached, overlapping = [], 0.0, 0
    for scene in variant.references:
        force, stopped, overlap = lab.answer(scene, variant.pair, axis)
        reached = max(reached, stopped)
        if not force:
            continue
        if overlap > variant.overlap_limit:
            overlapping += 1
            continue
        for other in known:
            if abs(other - force) <= within * max(other, force):
                return Reference(other, min(other, force), "", reached)
        known.append(force)
    if known and len(known) > 1:
        weak = f"references differ by {100 * (max(known) - min(known)) / max(known):.2g} %"
    else:
        weak = f"{'only one' if known else 'no'} reference run ends with a force"
    if overlapping:
        weak += f", {overlapping} more overlap too much"
    return Reference(known[0] if known else None, min(known) if known else None, weak, reached)


def in_many_steps(scene, counts=(20, 40, 30, 60, 10)):
    """The same scene in these numbers of steps, as references."""
    return [with_steps(scene, n) for n in counts]


def judge_force(variant, reference, share, how, law=(0.0, math.inf, "contact there must be")):
    """Sets the band of a variant: the reference within a share where it is firm and within the bounds of a law
    (low, high [N], name); else these bounds and what a refused reference had reached, and the variant is weak."""
    low, high, name = law
    value, weak = reference.value, reference.weak
    if value is not None and not low <= value <= high:
        weak = f"{weak}; " * bool(weak) + f"{name}: {low:.4g} to {high:.4g} N, reference {value:.4g} N"
    variant.weak = weak
    if weak:
        variant.band = Band(max(low, 0.9 * reference.reached, 1e-300), high, how=f"{name}, wide bounds")
    else:
        variant.band = Band(value * (1 - share), value * (1 + share), how=how)
    return variant


def must_touch(variant):
    """Sets the band of a variant of which only contact is known."""
    variant.band = Band(1e-300, how="contact there must be")
    return variant


def plane_modulus(elastic):
    """E / (1 - nu^2) [Pa]."""
    return elastic["youngs_modulus"] / (1 - elastic["poisson_ratio"] ** 2)


def layer_modulus(elastic):
    """Stress over strain where all strain across is prevented [Pa]."""
    e, nu = elastic["youngs_modulus"], elastic["poisson_ratio"]
    return e * (1 - nu) / ((1 + nu) * (1 - 2 * nu))


def ball_on_layer(elastic, radius, depth, height):
    """Force of a rigid ball on a bonded layer [N]. Source: Dimitriadis et al. 2002, eq. 10 to 13."""
    nu = elastic["poisson_ratio"]
    a = -(1.2876 - 1.4678 * nu + 1.3442 * nu ** 2) / (1 - nu)
    b = (0.6387 - 1.0277 * nu + 1.5164 * nu ** 2) / (1 - nu)
    x = math.sqrt(radius * depth) / height
    pi = math.pi
    series = (1 - 2 * a / pi * x + 4 * a ** 2 / pi ** 2 * x ** 2
              - 8 / pi ** 3 * (a ** 3 + 4 * pi ** 2 / 15 * b) * x ** 3
              + 16 * a / pi ** 4 * (a ** 3 + 3 * pi ** 2 / 5 * b) * x ** 4)
    return 4 / 3 * plane_modulus(elastic) * math.sqrt(radius) * depth ** 1.5 * series


def clamped_bar(youngs, width, height, length, at):
    """Stiffness of a bar clamped at both ends, pushed at `at` from its start [N/m], with Timoshenko's shear."""
    inertia = width * height ** 3 / 12
    b = length - at
    bending = (at * b) ** 3 / (3 * youngs * inertia * length ** 3)
    shear = at * b / length / (youngs / 2.6 * 5 / 6 * width * height)
    return 1 / (bending + shear)


def energy_from_nothing(run):
    """A law of all quasi-static runs: what is stored does not exceed twice the work done."""
    energy = run.result.get("energy", {})
    stored = energy.get("elastic", 0) - energy.get("elastic_start", 0)
    if run.result.get("steps", 0) >= 2 and stored > 2 * energy.get("work_absolute", math.inf):
        return f"elastic energy {stored:.3g} J from {energy['work_absolute']:.3g} J of work"
    return ""


# ---------------------------------------------------------------------------------------------------------------
# Kinds: tools pressed in any number of steps


def box_on_plane(draw, lab):
    """An elastic box driven or pushed on a plane: the same force in any number of steps, within the bounds of
    uniaxial stress and uniaxial strain."""
    unit, elastic = draw.scale(0.01, 10), draw.elastic()
    size = [short(unit * draw.between(0.1, 0.4)) for _ in range(3)]
    element = draw.element()
    cells = [draw.whole(2, 5 if element == "H8" else 3) for _ in range(3)]
    depth = short(size[2] * draw.between(0.05, 0.45))
    gap = draw.one_of(0.0, 0.0, short(size[2] * draw.between(0.01, 1.0)))
    by_hold = draw.chance(0.4)
    turn = (0, 0, 0) if by_hold else draw.turn()
    count = draw.one_of(1, 1, *STEPS)
    mesh = box_mesh(size, cells, element, [0, 0, size[2] / 2 + gap])
    if by_hold:
        body = solid(mesh, elastic, [{"set": "z_max", **pressed(depth + gap)}])
    else:
        body = solid(mesh, elastic, [{"set": "z_max"}], drive={"z": pressed(depth + gap)["z"]})
    flat = scene_of({"box": body, "plane": {"kind": "obstacle", "surface": {"generate": "plane"}}},
                    {"between": ["box", "plane"]}, in_steps(count))
    pair = ("box", "plane")
    references = in_many_steps(flat)
    share = size[0] * size[1] * depth / size[2]
    law = (0.97 * elastic["youngs_modulus"] * share, 1.01 * layer_modulus(elastic) * share,
           "uniaxial stress to uniaxial strain")
    variant = Variant(turned(flat, turn), f"{element} {cells} in {count} steps, {'hold' if by_hold else 'drive'}"
                      + (", turned" if any(turn) else ""), pair, rotated((0, 0, 1), turn), references=references,
                      overlap_limit=allowed_overlap(size, cells))
    return judge_force(variant, agreed(lab, variant, SAME_LINEAR), SAME_LINEAR, "two of 10 to 60 steps that agree", law)


def tool_in_block(draw, lab, shapes):
    """A rigid tool pressed in an elastic block: the same force in any number of steps."""
    unit, elastic = draw.scale(0.01, 10), draw.elastic()
    element = draw.element()
    most = {"H8": (10, 5), "T4": (8, 4), "T10": (5, 2)}[element]
    size = [short(unit * draw.between(0.7, 1.2)), short(unit * draw.between(0.7, 1.2)),
            short(unit * draw.between(0.3, 0.6))]
    cells = [draw.whole(4, most[0]), draw.whole(4, most[0]), draw.whole(2, most[1])]
    shape_name = draw.one_of(*shapes)
    turn_tool = (0.0, 0.0, 0.0)
    if shape_name == "box":
        tool = [short(unit * draw.between(0.12, 0.35)) for _ in range(3)]
        shape, half, area = {"generate": "box", "size": tool}, tool[2] / 2, tool[0] * tool[1]
        if draw.chance(0.3):
            turn_tool = (0.0, 0.0, draw.between(-0.7, 0.7))
    elif shape_name == "slab":  # wider than the block
        tool = [short(1.2 * size[0]), short(1.3 * size[1]), short(unit * draw.between(0.05, 0.3))]
        shape, half, area = {"generate": "box", "size": tool}, tool[2] / 2, size[0] * size[1]
    else:
        radius, length = short(unit * draw.between(0.08, 0.17)), short(unit * draw.between(0.1, 0.35))
        shape = {"generate": "cylinder", "radius": radius, "length": length}
        half, area = length / 2, math.pi * radius ** 2
        if draw.chance(0.3):
            shape["points"] = draw.whole(5, 40)
        if shape_name == "roller":
            turn_tool, half, area = (math.pi / 2, 0.0, 0.0), radius, radius * length
    depth = short(draw.between(0.02, 0.12) * size[2])
    gap = draw.one_of(0.0, short(depth * draw.between(0.01, 0.8)))
    place = [short(unit * draw.between(-0.1, 0.1)), short(unit * draw.between(-0.1, 0.1)), half + gap]
    if shape_name == "slab":
        place[:2] = [0.0, 0.0]
    turn, count = draw.turn(), draw.one_of(1, 1, *STEPS)
    flat = scene_of({
        "tool": rigid(shape, place, turn=turn_tool, drive={**pressed(depth + gap), "angle": 0}),
        "block": solid(box_mesh(size, cells, element, [0, 0, -size[2] / 2]), elastic, [{"set": "z_min"}])},
        {"between": ["tool", "block"]}, in_steps(count))
    pair = ("tool", "block")
    references = in_many_steps(flat)
    punch = 2 * plane_modulus(elastic) * math.sqrt(area / math.pi) * depth
    layer = layer_modulus(elastic) * area * depth / size[2]
    if shape_name == "slab":
        low = 0.5 * elastic["youngs_modulus"] * area * depth / size[2]
    else:
        low = (0.1 if shape_name == "roller" else 0.3) * punch
    variant = Variant(turned(flat, turn), f"{shape_name} in {element} {cells}, {count} steps"
                      + (", turned" if any(turn) else ""), pair, rotated((0, 0, 1), turn), references=references,
                      overlap_limit=allowed_overlap(size, cells, 2 * half))
    return judge_force(variant, agreed(lab, variant, SAME), SAME, "two of 10 to 60 steps that agree",
                       (low, 4 * (punch + layer), "flat punch and layer"))


def rigid_box(draw, lab):
    """A rigid box, or a slab wider than the block, pressed in a block in any number of steps."""
    return tool_in_block(draw, lab, ("box", "box", "slab"))


def rigid_cylinder(draw, lab):
    """A rigid cylinder, upright or lying, pressed in a block in any number of steps."""
    return tool_in_block(draw, lab, ("upright", "upright", "roller"))


def paddle(draw, lab):
    """A rigid paddle turned against, or through, a held block. Pressed: as in many steps. Through: the held face
    cannot be passed, so there is contact at the end, or the run is refused."""
    unit, elastic = draw.scale(0.01, 10), draw.elastic()
    element = draw.element()
    cells = [draw.whole(2, 4 if element == "H8" else 3) for _ in range(3)]
    half = short(unit * draw.between(0.04, 0.07))
    away = short(unit * draw.between(0.18, 0.26))
    thick = short(unit * draw.between(0.02, 0.08))
    arm = short(away + half * draw.between(0.3, 1.5))
    through = draw.chance(0.6)
    # angle at which the paddle's leading face touches the block's lower edge nearest to it
    contact_angle = math.pi / 2 - math.atan2(half, away - half) - math.asin(thick / 2 / math.hypot(half, away - half))
    if through:
        angle, count = draw.between(2.6, 5.5), draw.one_of(1, 2, 3, 5)
    else:
        angle, count = short(contact_angle + draw.between(0.1, 0.4) * half / away), draw.one_of(*STEPS)
    scene = scene_of({
        "paddle": rigid({"generate": "box", "size": [2 * arm, thick, short(2.6 * half)]}, [0, 0, 0],
                        drive={"x": 0, "y": 0, "z": 0, "axis": [0, 0, 1], "angle": [[0, 0], [1, angle]]}),
        "block": solid(box_mesh([2 * half] * 3, cells, element, [0, away, 0]), elastic,
                       [{"set": draw.one_of("x_min", "z_min") if through else "x_min"}])},
        {"between": ["paddle", "block"]}, in_steps(count))
    pair, axis = ("paddle", "block"), (math.sin(angle), -math.cos(angle), 0.0)
    variant = Variant(scene, f"{'through' if through else 'against'} {element} {cells}, {angle:g} rad in {count} steps",
                      pair, axis, may_refuse=through,
                      overlap_limit=OVERLAP_SHARE * min(thick, min(2 * half / c for c in cells)))
    if through:
        return must_touch(variant)
    variant.references = in_many_steps(scene)
    return judge_force(variant, agreed(lab, variant, 0.02, axis), 0.05, "two of 10 to 60 steps that agree")


def small_reach(draw, lab):
    """A reach that is far smaller than the way of a step loses no contact: the same force as without it."""
    unit, elastic = draw.scale(0.01, 10), draw.elastic()
    element = draw.element()
    n = 4 if element == "H8" else 3
    upper = [short(unit * draw.between(0.15, 0.25)) for _ in range(3)]
    lower = [short(unit * draw.between(0.6, 1.0)), short(unit * draw.between(0.6, 1.0)),
             short(unit * draw.between(0.15, 0.25))]
    lower_cells = [draw.whole(3, n + 2), draw.whole(3, n + 2), draw.whole(1, 2)]
    depth, lift = short(upper[2] * draw.between(0.02, 0.15)), short(upper[2] * draw.between(0, 0.4))
    way = [[0, 0], [0.5, lift], [1, -depth]]
    how = draw.one_of("solid", "rigid", "plane")
    below = solid(box_mesh(lower, lower_cells, element, [short(unit * 0.02), short(unit * 0.01), -lower[2] / 2]),
                  elastic, [{"set": "z_min"}])
    above = solid(box_mesh(upper, [draw.whole(2, n) for _ in range(3)], element, [0, 0, upper[2] / 2]), elastic,
                  [{"set": "z_max", "x": 0, "y": 0, "z": way}])
    if how == "rigid":
        above = rigid({"generate": "box", "size": upper}, [0, 0, upper[2] / 2],
                      drive={"x": 0, "y": 0, "z": way, "angle": 0})
    if how == "plane":
        below = {"kind": "obstacle", "surface": {"generate": "plane"}}
    count = draw.one_of(2, 4, 10, 20)
    reach = short(draw.scale(1e-4, 0.5) * upper[2])
    scene = scene_of({"up": above, "lo": below}, {"between": ["up", "lo"], "reach": reach}, in_steps(count))
    pair, free = ("up", "lo"), with_law(scene, reach=None)
    face = min([s / c for s, c in zip(lower, lower_cells)] + [upper[2] / n])
    variant = Variant(scene, f"{how} {element}, reach {reach:g} m, {count} steps", pair,
                      overlap_limit=OVERLAP_SHARE * face, references=in_many_steps(free, (20, 40, 60, 10)))
    area = upper[0] * upper[1]
    soft = elastic["youngs_modulus"] * area * depth / (upper[2] * (1 if how != "rigid" else 0) + lower[2])
    share = SAME_LINEAR if how == "plane" else SAME
    return judge_force(variant, agreed(lab, variant, share), share, "without reach, two of 10 to 60 steps",
                       (0.3 * soft, 20 * soft, "blocks in series"))


# ---------------------------------------------------------------------------------------------------------------
# Kinds: thin bodies


def ball_through_sheet(draw, lab):
    """A rigid ball pressed far into a sheet held at its edges: held as in many small steps."""
    unit, elastic = draw.scale(0.1, 10), draw.elastic()
    elastic["poisson_ratio"] = draw.one_of(0.0, 0.2, 0.3)
    element = draw.element()
    wide = [short(0.1 * unit), short(0.1 * unit * draw.between(0.7, 1.3))]
    thick = short(0.1 * unit * draw.between(0.02, 0.08))
    n = {"H8": (5, 10), "T4": (5, 8), "T10": (4, 6)}[element]
    cells = [draw.whole(*n), draw.whole(*n), draw.one_of(1, 1, 2) if element != "T10" else 1]
    radius = short(0.1 * unit * draw.between(0.03, 0.1))
    place = [short(0.1 * unit * draw.between(-0.25, 0.25)) for _ in range(2)]
    gap = short(0.05 * thick)
    depth = short(thick * draw.between(1.5, 7))
    count, turn = draw.one_of(3, 5, 10, 20), draw.turn()
    flat = scene_of({
        "ball": rigid({"generate": "ball", "radius": radius}, [*place, radius + gap],
                      drive={**pressed(depth + gap), "angle": 0}),
        "sheet": solid(box_mesh([*wide, thick], cells, element, [0, 0, -thick / 2]), elastic,
                       [{"set": s} for s in ("x_min", "x_max", "y_min", "y_max")])},
        {"between": ["ball", "sheet"]}, in_steps(count))
    pair, many = ("ball", "sheet"), math.ceil(depth / (0.08 * thick))
    variant = Variant(turned(flat, turn), f"{element} {cells}, {depth / thick:.2g} thicknesses in {count} steps"
                      + (", turned" if any(turn) else ""), pair, rotated((0, 0, 1), turn),
                      overlap_limit=allowed_overlap([*wide, thick], cells),
                      references=in_many_steps(flat, (2 * many, many, 4 * many)))
    bending = elastic["youngs_modulus"] * thick ** 3 / 12 / (1 - elastic["poisson_ratio"] ** 2)
    plate = bending * depth / (0.00725 * min(wide) ** 2)  # clamped, long, pushed in the middle: the softest
    return judge_force(variant, agreed(lab, variant, 0.02), 0.05, f"{2 * many} steps",
                       (0.5 * plate, math.inf, "clamped plate"))


def bars(draw, cells, overlap, gap, count):
    """Two crossing bars held at their ends, the upper one moved down by gap and overlap (a share of the thickness);
    the scene, the thinner thickness [m], the force by beam theory [N]."""
    unit, elastic = draw.scale(0.01, 10), draw.elastic()
    elastic["poisson_ratio"] = draw.one_of(0.2, 0.3)
    element = "H8" if max(cells) < 6 or draw.chance(0.7) else "T10"
    width, thick = [[short(unit * draw.between(0.03, 0.08)) for _ in range(2)] for _ in range(2)]
    aside = [short(unit * draw.between(-0.01, 0.01)) for _ in range(2)]
    thin = min(thick)
    way = short((gap + overlap) * thin)
    held = {"x": 0, "y": 0, "z": [[0, 0], [1, -way]]}
    scene = scene_of({
        "up": solid(box_mesh([unit, width[0], thick[0]], [cells[0], 1, 1], element,
                             [0, 0, short(thick[0] / 2 + gap * thin, 8)]), elastic,
                    [{"set": "x_min", **held}, {"set": "x_max", **held}]),
        "lo": solid(box_mesh([width[1], unit, thick[1]], [1, cells[1], 1], element, [*aside, -thick[1] / 2]), elastic,
                    [{"set": "y_min"}, {"set": "y_max"}])},
        {"between": ["up", "lo"]}, in_steps(count))
    youngs = elastic["youngs_modulus"]
    stiff = [clamped_bar(youngs, width[0], thick[0], unit, unit / 2 + aside[0]),
             clamped_bar(youngs, width[1], thick[1], unit, unit / 2 - aside[1])]
    force = overlap * thin / (1 / stiff[0] + 1 / stiff[1])
    return scene, element, thin, min(*width, *thick, unit / max(cells)), force


def crossing(draw, lab, cells, overlap, gap, count, theory, share=0.03):
    """Crossing bars judged within a share of the same with a reach chosen by hand and 20 steps."""
    scene, element, thin, face, force = bars(draw, cells, overlap, gap, count)
    pair = ("up", "lo")
    many = max(20, math.ceil((overlap + gap) * 10))
    variant = Variant(scene, f"{element} {cells}, overlap {overlap:g} of the thickness in {count} steps", pair,
                      overlap_limit=OVERLAP_SHARE * min(face, thin), law=energy_from_nothing,
                      references=[with_steps(with_law(scene, reach=r * thin), n)
                                  for r, n in ((1, many), (0.5, many), (0.3, 2 * many))])
    return judge_force(variant, agreed(lab, variant, share / 3), share, f"reach of a thickness, {many} steps",
                       (theory[0] * force, theory[1] * force, "beam theory"))


def crossing_bars(draw, lab):
    """Crossing bars of many elements, thinner than the default reach."""
    cells = [draw.whole(8, 24), draw.whole(8, 24)]
    return crossing(draw, lab, cells, draw.between(0.1, 0.8), draw.between(0.01, 0.1), draw.one_of(1, 2, 4, 5, 10),
                    (0.8, 1.5))


def crossing_bars_coarse(draw, lab):
    """Crossing bars of few elements."""
    cells = [draw.whole(2, 6), draw.whole(2, 6)]
    return crossing(draw, lab, cells, draw.between(0.004, 0.3), draw.between(0.005, 0.05), draw.one_of(1, 2, 4, 10),
                    (0.5, 20))


def edge_through_edge(draw, lab):
    """Bars moved through one another by more than their thickness: held as in many small steps; bars of one
    element, which cannot bend, may be refused."""
    one = draw.chance(0.4)
    cells = [1, 1] if one else [draw.whole(4, 16), draw.whole(4, 16)]
    overlap, gap, count = draw.between(1.2, 5), draw.between(0.5, 5), draw.one_of(1, 2, 4, 5, 10)
    if not one:
        return crossing(draw, lab, cells, overlap, gap, count, (0.5, 3), 0.05)
    scene, element, thin, face, _ = bars(draw, cells, overlap, gap, count)
    variant = Variant(scene, f"{element} {cells}, overlap {overlap:g} of the thickness in {count} steps", ("up", "lo"),
                      overlap_limit=OVERLAP_SHARE * min(face, thin), may_refuse=True)
    return must_touch(variant)


def two_plates(draw, lab):
    """A plate pressed on another by its held edges, both thinner than the default reach."""
    unit, elastic = draw.scale(0.01, 10), draw.elastic()
    elastic["poisson_ratio"] = draw.one_of(0.2, 0.3)
    element = draw.one_of("H8", "H8", "T10")
    thick = [short(unit * draw.scale(0.004, 0.04)) for _ in range(2)]
    if draw.chance(0.5):
        thick[1] = thick[0]
    thin = min(thick)
    upper = [short(unit * draw.between(0.4, 0.7)), short(unit * draw.between(0.3, 0.6)), thick[0]]
    most = 7 if element == "H8" else 5
    cells = [[draw.whole(4, most), draw.whole(4, most), 1] for _ in range(2)]
    gap, overlap = short(thin * draw.between(0.01, 0.05)), short(thin * draw.between(0.03, 0.15))
    held = {"x": 0, "y": 0, "z": [[0, 0], [1, -short(gap + overlap)]]}
    count = draw.one_of(1, 2, 4, 10)
    scene = scene_of({
        "up": solid(box_mesh(upper, cells[0], element, [short(unit * draw.between(-0.05, 0.05)),
                                                        short(unit * draw.between(-0.05, 0.05)),
                                                        short(thick[0] / 2 + gap, 8)]), elastic,
                    [{"set": "x_min", **held}, {"set": "x_max", **held}]),
        "lo": solid(box_mesh([unit, unit, thick[1]], cells[1], element, [0, 0, -thick[1] / 2]), elastic,
                    [{"set": s} for s in ("x_min", "x_max", "y_min", "y_max")])},
        {"between": ["up", "lo"]}, in_steps(count))
    pair = ("up", "lo")
    variant = Variant(scene, f"{element} {cells[0]} on {cells[1]}, {thick[0] / unit:g} on {thick[1] / unit:g}, "
                      f"{count} steps", pair, overlap_limit=OVERLAP_SHARE * thin, law=energy_from_nothing,
                      references=[with_steps(with_law(scene, reach=r * thin), n)
                                  for r, n in ((0.4, 10), (0.6, 10), (0.2, 20), (0.8, 20))])
    return judge_force(variant, agreed(lab, variant, 0.01), 0.03,
                       "reach of 0.4 of the thinner plate, 10 steps")


# ---------------------------------------------------------------------------------------------------------------
# Kinds: a contact smaller than a face


def judge_coarse(variant, reference, size, cells, half_width, law):
    """Sets the band of a contact on a coarse block: not below 0.85 of a fine mesh's force. Above 2.5 times is wrong
    where no edge of a cell is longer than the contact is wide, and needs a warning where a face is. The law is (low,
    likely, high [N], name)."""
    low, likely, high, name = law
    variant.weak = reference.weak
    if reference.value is None or not low <= reference.value <= high:
        variant.weak = f"{name}: {low:.4g} to {high:.4g} N, reference {reference.value} N"
    value, lowest = reference.value, reference.lowest
    if variant.weak:
        value, lowest = likely, min(lowest or likely, likely)
    edges = [s / c for s, c in zip(size, cells)]
    wide, deep = max(edges[:2]) > 2 * half_width, edges[2] > 2 * half_width
    variant.band = Band(0.85 * lowest, math.inf if wide or deep else 2.5 * value, 2.5 * value if wide else math.inf,
                        name if variant.weak else "fine mesh")
    return variant


def ball_on_block(draw, lab, make_ball):
    """A ball pressed on a coarse block; `make_ball` takes radius, place and depth."""
    unit, elastic = draw.scale(0.01, 10), draw.elastic()
    element = draw.element()
    if element == "T4":  # it locks
        elastic["poisson_ratio"] = min(0.3, elastic["poisson_ratio"])
    radius = short(0.1 * unit)
    size = [short(unit * draw.between(0.4, 0.6)), short(unit * draw.between(0.4, 0.6)),
            short(unit * draw.between(0.2, 0.3))]
    cells = [draw.whole(3, 10), draw.whole(3, 10), draw.whole(1, 4)]
    if element == "T10":
        cells = [min(c, 6) for c in cells]
    place = [short(unit * draw.between(-0.06, 0.06)) for _ in range(2)]
    depth, count = short(radius * draw.between(0.05, 0.12)), draw.one_of(1, 1, 2, 5)
    ball = make_ball(radius, [*place, radius], depth)
    scene = scene_of({"ball": ball, "block": solid(box_mesh(size, cells, element, [0, 0, -size[2] / 2]), elastic,
                                                   [{"set": "z_min"}])},
                     {"between": ["ball", "block"]}, in_steps(count))
    if ball["kind"] == "solid":
        ball.update(elastic)
    pair, half_width = ("ball", "block"), math.sqrt(radius * depth)
    fine = with_steps(with_cells(scene, "block", [14, 14, 7], "T10"), 1)
    theory = ball_on_layer(elastic, radius, depth, size[2])
    face = max(size[0] / cells[0], size[1] / cells[1])
    variant = Variant(scene, f"{element} {cells}, faces of {face / half_width:.2g} half-widths, {count} steps", pair,
                      references=[fine], overlap_limit=allowed_overlap(size, cells))
    force = lab.answer(fine, pair)[0]
    return judge_coarse(variant, Reference(force, force, "", 0.0), size, cells, half_width,
                        (0.75 * theory, theory, 1.25 * theory, "ball on a layer"))


def fine_ball_on_coarse(draw, lab):
    """A finely meshed ball, held as a whole, on a coarse block."""
    around, element = draw.one_of(10, 12, 16), draw.one_of("T10", "T10", "H8")

    def make(radius, place, depth):
        mesh = {"generate": "ball", "radius": radius, "around": around, "element": element}
        return {"kind": "solid", "mesh": mesh, "start": {"place": place}, "hold": [{"set": "all", **pressed(depth)}]}

    return ball_on_block(draw, lab, make)


def rigid_ball(draw, lab):
    """A rigid ball on a coarse block of any element."""
    return ball_on_block(draw, lab, lambda radius, place, depth: rigid(
        {"generate": "ball", "radius": radius}, place, drive={**pressed(depth), "angle": 0}))


def roller(draw, lab):
    """A finely meshed lying cylinder, held as a whole, on a coarse block."""
    unit, elastic = draw.scale(0.01, 10), draw.elastic()
    element = draw.element()
    if element == "T4":  # it locks
        elastic["poisson_ratio"] = min(0.3, elastic["poisson_ratio"])
    radius, length = short(0.1 * unit), short(unit * draw.between(0.2, 0.4))
    size = [short(0.6 * unit), short(0.6 * unit), short(unit * draw.between(0.15, 0.25))]
    n = round(draw.scale(4, {"H8": 24, "T4": 14, "T10": 8}[element]))
    cells = [n, draw.whole(math.ceil(0.7 * n), n), draw.whole(1, max(2, n // 4))]
    depth, count = short(radius * draw.between(0.04, 0.08)), draw.one_of(1, 1, 2, 5)
    place = [short(unit * draw.between(-0.05, 0.05)), short(unit * draw.between(-0.02, 0.02)), radius]
    mesh = {"generate": "cylinder", "radius": radius, "length": length, "axis": [0, 1, 0],
            "centre": [0, -length / 2, 0], "around": draw.one_of(12, 16), "along": draw.whole(3, 6), "element": "H8"}
    scene = scene_of({
        "roller": solid(mesh, elastic, [{"set": "all", **pressed(depth)}], start={"place": place}),
        "block": solid(box_mesh(size, cells, element, [0, 0, -size[2] / 2]), elastic, [{"set": "z_min"}])},
        {"between": ["roller", "block"]}, in_steps(count))
    pair = ("roller", "block")
    references = [with_steps(with_cells(scene, "block", c, "H8"), 1) for c in ([64, 12, 8], [48, 12, 8], [72, 16, 8])]
    face, half_width = max(size[0] / cells[0], size[1] / cells[1]), math.sqrt(radius * depth)
    variant = Variant(scene, f"{element} {cells}, faces of {face / half_width:.2g} half-widths, {count} steps", pair,
                      references=references, overlap_limit=allowed_overlap(size, cells))
    # line contact: between the stiffness of a wide layer under the chord and a tenth of a flat punch
    chord = 2 * math.sqrt(2 * radius * depth)
    line = math.pi / 4 * plane_modulus(elastic) * length * depth
    likely = 0.7 * line
    return judge_coarse(variant, agreed(lab, variant, 0.08), size, cells, half_width,
                        (0.3 * line, likely, 2 * line + layer_modulus(elastic) * chord * length * depth / size[2],
                         "line contact"))


def cylinder_rim(draw, lab):
    """An upright rigid disc pressed on a coarse bed and slid: its rim lies inside faces."""
    unit, elastic = draw.scale(0.1, 10), draw.elastic()
    radius = short(0.02 * unit * draw.between(0.7, 1.3))
    size = [short(0.12 * unit), short(0.1 * unit), short(0.05 * unit * draw.between(0.8, 1.3))]
    element = draw.one_of("H8", "H8", "T4")
    cells = [draw.whole(4, 8), draw.whole(4, 7), draw.whole(2, 4)]
    place = [short(unit * draw.between(-0.012, 0.012)), short(unit * draw.between(-0.012, 0.012))]
    depth, gap = short(radius * draw.between(0.02, 0.1)), short(0.0002 * unit)
    slide, count = short(unit * draw.between(-0.012, 0.012)), draw.one_of(2, 4, 10)
    scene = scene_of({
        "tool": rigid({"generate": "cylinder", "radius": radius, "length": 2 * radius},
                      [*place, short(radius + gap, 8)],
                      drive={"x": [[0, 0], [0.5, 0], [1, slide]], "y": 0,
                             "z": [[0, 0], [0.5, -short(depth + gap)]], "angle": 0}),
        "bed": solid(box_mesh(size, cells, element, [0, 0, -size[2] / 2]), elastic, [{"set": "z_min"}],
                     motion=draw.one_of("linear", "corotational"))},
        {"between": ["tool", "bed"], "friction": draw.one_of(0, 0.1, 0.3)}, in_steps(count))
    pair = ("tool", "bed")
    references = [with_steps(with_cells(scene, "bed", c, "H8"), 4) for c in ([24, 20, 8], [18, 15, 7])]
    punch = 2 * plane_modulus(elastic) * radius * depth
    layer = layer_modulus(elastic) * math.pi * radius ** 2 * depth / size[2]
    face = max(size[0] / cells[0], size[1] / cells[1])
    variant = Variant(scene, f"{element} {cells}, faces of {face / radius:.2g} radii, {count} steps", pair,
                      references=references, overlap_limit=allowed_overlap(size, cells))
    return judge_coarse(variant, agreed(lab, variant, 0.2), size, cells, radius,
                        (0.8 * punch, punch, 1.6 * (punch + layer), "flat punch and layer"))


def sharp_edge_slides(draw, lab):
    """A die pressed and slid over a softer block with friction: stored and rubbed energy are the work's."""
    del lab
    unit, soft = draw.scale(0.1, 10), draw.scale(1e3, 1e6)
    nu, friction = draw.one_of(0.3, 0.4), draw.one_of(0.1, 0.2, 0.3)
    long, high = short(0.4 * unit * draw.between(0.7, 1.3)), short(0.3 * unit)
    nx, nz = draw.whole(16, 28), draw.whole(4, 6)
    press, slide = short(unit * draw.between(0.01, 0.03)), short(unit * draw.between(0.15, 0.4))
    x = short(0.25 * unit + long / 2)
    law = {"law": "neo_hooke", "poisson_ratio": nu}
    scene = scene_of({
        "die": {"kind": "solid", "mesh": box_mesh([long, 0.2 * unit, high], [draw.whole(5, 8), 1, 4], "H8",
                                                  [x, 0.1 * unit, short(0.4 * unit + high / 2, 8)]),
                "material": {**law, "youngs_modulus": short(soft * draw.between(2, 6))},
                "hold": [{"set": "all", "y": 0}, {"set": "z_max", "x": [[0, 0], [1, 0], [2, slide]],
                                                  "z": [[0, 0], [1, -press]]}]},
        "block": {"kind": "solid", "mesh": box_mesh([1.4 * unit, 0.2 * unit, 0.4 * unit], [nx, 1, nz], "H8",
                                                    [0.7 * unit, 0.1 * unit, 0.2 * unit]),
                  "material": {**law, "youngs_modulus": soft},
                  "hold": [{"set": "all", "y": 0}, {"set": "z_min", "x": 0, "z": 0}]}},
        {"between": ["die", "block"], "friction": friction, "surfaces": ["z_min", "z_max"]},
        {"kind": "quasi_static", "step": 0.05, "end": 2})

    def balance(run):
        energy = run.result.get("energy", {})
        stored = energy.get("elastic", 0) - energy.get("elastic_start", 0) + energy.get("friction", 0)
        work = energy.get("work", 0)
        if abs(work - stored - max(0.0, energy.get("released", 0))) > 0.005 * energy.get("work_absolute", 0):
            return f"stored and rubbed {stored:.5g} J, work {work:.5g} J"
        return ""

    variant = Variant(scene, f"block {nx} x {nz}, friction {friction:g}, slid by {slide / unit:g}", ("die", "block"),
                      law=balance, overlap_limit=OVERLAP_SHARE * 0.4 * unit / nz)
    return must_touch(variant)


# ---------------------------------------------------------------------------------------------------------------
# Kinds: bodies that start in one another


def some_rigid(draw, unit):
    """A rigid shape and the distance of its lowest point below its middle [m]."""
    name = draw.one_of("box", "ball", "cylinder")
    if name == "box":
        size = [short(unit * draw.between(0.1, 0.3)) for _ in range(3)]
        return {"generate": "box", "size": size}, size[2] / 2
    radius = short(unit * draw.between(0.05, 0.15))
    if name == "ball":
        return {"generate": "ball", "radius": radius}, radius
    length = short(unit * draw.between(0.1, 0.3))
    return {"generate": "cylinder", "radius": radius, "length": length}, length / 2


def some_block(draw, unit, elastic, set_="z_min"):
    """A held block whose upper face is at z = 0."""
    element = draw.element()
    size = [short(unit * draw.between(0.6, 1)), short(unit * draw.between(0.6, 1)), short(unit * draw.between(0.4, 0.6))]
    cells = [draw.whole(2, 6), draw.whole(2, 6), draw.whole(1, 4)]
    if element == "T10":
        cells = [min(c, 3) for c in cells]
    return solid(box_mesh(size, cells, element, [0, 0, -size[2] / 2]), elastic, [{"set": set_}])


def some_obstacle(draw, unit):
    """An obstacle whose upper side is at z = 0 above the origin."""
    name = draw.one_of("plane", "ball", "cylinder")
    if name == "plane":
        return {"kind": "obstacle", "surface": {"generate": "plane"}}
    radius = short(unit * draw.between(0.2, 0.5))
    surface = {"generate": name, "centre": [0, 0, -radius], "radius": radius}
    if name == "cylinder":
        surface["axis"] = [0, 1, 0]
    return {"kind": "obstacle", "surface": surface}


def start_inside(draw, lab):
    """A body that starts inside another, in part or wholly, is bad input."""
    del lab
    unit, elastic = draw.scale(0.01, 10), draw.elastic()
    what = draw.one_of("rigid in solid", "rigid in solid", "solid in rigid", "solid in solid", "solid in solid",
                       "rigid in rigid", "rigid in obstacle", "solid in obstacle")
    wholly = draw.chance(0.4) and not what.endswith("obstacle")
    aside = [short(unit * draw.between(-0.05, 0.05)) for _ in range(2)]
    count, turn = draw.one_of(1, 1, 2, 5), draw.turn()
    shape, below = some_rigid(draw, unit)
    share = draw.between(0.1, 0.9)
    drive = draw.one_of(still(), {**pressed(0.01 * unit), "angle": 0})

    def middle(half):
        """Height of the inner body's middle, whose lower half is `half` high."""
        return short(-half - 0.05 * unit) if wholly else short(half * (1 - 2 * share))

    if what == "rigid in solid":
        if wholly:  # as small as it must be to be inside
            radius = short(unit * draw.between(0.03, 0.1))
            shape, below = {"generate": "ball", "radius": radius}, radius
        a, b = rigid(shape, [*aside, middle(below)], drive=drive), some_block(draw, unit, elastic)
    elif what == "solid in rigid":
        half = short(unit * draw.between(0.05, 0.12))
        mesh = box_mesh([2 * half] * 3, [draw.whole(1, 4) for _ in range(3)], draw.element(), [*aside, middle(half)])
        a = solid(mesh, elastic, [{"set": "z_max"}])
        b = rigid({"generate": "box", "size": [short(0.8 * unit), short(0.8 * unit), short(0.6 * unit)]},
                  [0, 0, short(-0.3 * unit)], drive=still())
    elif what == "solid in solid":
        half = short(unit * draw.between(0.05, 0.12))
        mesh = box_mesh([2 * half] * 3, [draw.whole(1, 4) for _ in range(3)], draw.element(), [*aside, middle(half)])
        a, b = solid(mesh, elastic, [{"set": "z_max"}]), some_block(draw, unit, elastic)
    elif what == "rigid in rigid":
        if wholly:
            radius = short(unit * draw.between(0.03, 0.1))
            shape, below = {"generate": "ball", "radius": radius}, radius
        a = rigid(shape, [*aside, middle(below)], drive=drive)
        b = rigid({"generate": "box", "size": [short(0.8 * unit), short(0.8 * unit), short(0.6 * unit)]},
                  [0, 0, short(-0.3 * unit)], drive=still())
    else:
        aside = [0.0, 0.0]
        b = some_obstacle(draw, unit)
        if what == "rigid in obstacle":
            a = rigid(shape, [*aside, middle(below)], drive=drive)
        else:
            half = short(unit * draw.between(0.05, 0.12))
            mesh = box_mesh([2 * half] * 3, [draw.whole(1, 4) for _ in range(3)], draw.element(), [0, 0, middle(half)])
            a = solid(mesh, elastic, [{"set": "z_max"}])
    scene = turned(scene_of({"a": a, "b": b}, {"between": ["a", "b"]}, in_steps(count)), turn)
    return Variant(scene, f"{what}, {'wholly' if wholly else 'in part'}" + (", turned" if any(turn) else ""),
                   ("a", "b"), starts_inside=True)


def start_inside_rod(draw, lab):
    """A rod that starts inside an obstacle, a solid, a rigid body or another rod is bad input."""
    del lab
    unit = draw.scale(0.1, 10)
    what = draw.one_of("ball", "cylinder", "plane", "solid", "rigid", "rod", "rod")
    radius = short(unit * draw.between(0.0006, 0.002))
    body = short(unit * draw.between(0.01, 0.02))  # half of the other body's size
    length = short(unit * draw.between(0.04, 0.07))
    inside = short(body * draw.between(0.2, 1.8)) if what not in ("rod", "plane") else 0.0
    stiffness = draw.scale(1e-5, 1e-1) * unit ** 4
    segment = {"radius": radius, "EI": short(stiffness)}

    def rod(points, hold):
        size = math.dist(*points)
        return {"kind": "rod", "segments": [{**segment, "length": size, "element": size / draw.whole(10, 25)}],
                "shape": {"points": [{"at": list(p)} for p in points]}, "hold": hold}

    # the rod comes along x, or passes through, and ends `inside` below the other's surface at x = -body
    tip = -body + inside
    hold = [{"set": "start", "y": 0, "z": 0, "x": [[0, 0], [1, short(unit * draw.between(0, 0.03))]]}]
    wire = rod([[short(tip - length, 8), 0, 0], [short(tip, 8), 0, 0]], hold)
    if what == "ball":
        other = {"kind": "obstacle", "surface": {"generate": "ball", "radius": body}}
    elif what == "cylinder":
        other = {"kind": "obstacle", "surface": {"generate": "cylinder", "radius": body, "axis": [0, 1, 0]}}
    elif what == "plane":
        other = {"kind": "obstacle", "surface": {"generate": "plane", "axis": [-1, 0, 0],
                                                 "centre": [short(tip - length * draw.between(0.1, 0.6)), 0, 0]}}
    elif what == "solid":
        other = solid(box_mesh([2 * body] * 3, [draw.whole(1, 4) for _ in range(3)], draw.element(), [0, 0, 0]),
                      draw.elastic(), [{"set": "x_max"}])
    elif what == "rigid":
        shape = draw.one_of({"generate": "ball", "radius": body}, {"generate": "box", "size": [2 * body] * 3})
        other = rigid(shape, [0, 0, 0], drive=still())
    else:  # another rod that crosses, or runs along, nearer than the two radii
        near = short(2 * radius * draw.between(0, 0.8))
        x = short(tip - length * draw.between(0.2, 0.8), 8)
        half = length / 2
        along = draw.between(-1.5, 1.5)
        d = [half * math.sin(along), half * math.cos(along)]
        other = rod([[x - d[0], -d[1], near], [x + d[0], d[1], near]], [{"set": "start"}, {"set": "end"}])
    scene = scene_of({"wire": wire, "other": other}, {"between": ["wire", "other"],
                                                      "friction": draw.one_of(0, 0.1)}, in_steps(draw.one_of(1, 10, 50)))
    return Variant(scene, f"rod in {what}", ("wire", "other"), starts_inside=True)


def start_overlap_resolve(draw, lab):
    """With "start_overlap": "resolve" the force is as if the bodies were pressed together from outside."""
    if not lab.resolves:
        return None
    unit, elastic = draw.scale(0.01, 10), draw.elastic()
    what = draw.one_of("rigid in solid", "solid in solid", "solid in obstacle")
    block = some_block(draw, unit, elastic)
    depth = short(unit * draw.between(0.01, 0.06))
    aside = [short(unit * draw.between(-0.05, 0.05)) for _ in range(2)]
    size = [short(unit * draw.between(0.15, 0.3)) for _ in range(3)]
    cells, element, count = [draw.whole(2, 4) for _ in range(3)], draw.element(), draw.one_of(1, 2, 5)
    if what == "solid in obstacle":
        block = {"kind": "obstacle", "surface": {"generate": "plane"}}

    def scene(start, way, steps, law):
        """The upper body begins `start` deep and is pressed by `way`."""
        height = short(size[2] / 2 - start, 8)
        if what == "rigid in solid":
            upper = rigid({"generate": "box", "size": size}, [*aside, height], drive={**pressed(way), "angle": 0})
        else:
            upper = solid(box_mesh(size, cells, element, [*aside, height]), elastic, [{"set": "z_max", **pressed(way)}])
        return scene_of({"up": upper, "lo": block}, {"between": ["up", "lo"], **law}, in_steps(steps))

    pair = ("up", "lo")
    references = in_many_steps(scene(0, depth, 20, {}))
    variant = Variant(scene(depth, 0, count, {"start_overlap": "resolve"}), f"{what}, {element}, {count} steps", pair,
                      references=references)
    return judge_force(variant, agreed(lab, variant, SAME), 0.01, "pressed from outside in 20 steps")


# ---------------------------------------------------------------------------------------------------------------
# Kinds: motion


def falling(draw, unit, law, step, share):
    """A rigid body that starts in an obstacle or in a rigid body by a share of its lower half; scene, depth [m]."""
    shape, below = some_rigid(draw, unit)
    depth = short(share * below)
    if draw.chance(0.3):
        other = rigid({"generate": "box", "size": [unit, unit, short(0.4 * unit)]}, [0, 0, short(-0.2 * unit)],
                      mass=draw.scale(0.1, 10), drive=still())
    else:
        other = some_obstacle(draw, unit)
    scene = scene_of({"floor": other, "body": rigid(shape, [0, 0, short(below - depth, 8)], mass=draw.scale(0.01, 100))},
                     {"between": ["body", "floor"], **law}, {"kind": "dynamic", "step": step, "end": 10 * step})
    scene["gravity"] = [0, 0, -9.81]
    return scene, depth


def motion_overlap(draw, lab):
    """A rigid body in motion that starts inside an obstacle or a rigid body is bad input."""
    del lab
    step, share = draw.one_of(1e-6, 1e-5, 1e-4, 1e-3), draw.between(0.02, 0.5)
    scene, _ = falling(draw, draw.scale(0.1, 10), {"restitution": draw.one_of(0, 0, 0.5)}, step, share)
    return Variant(scene, f"{share:g} of its half deep, step {step:g} s", starts_inside=True)


def motion_overlap_resolve(draw, lab):
    """With "start_overlap": "resolve" the speed at the end does not depend on the step."""
    if not lab.resolves:
        return None
    step, share = draw.one_of(1e-5, 1e-4, 1e-3), draw.between(0.02, 0.3)
    scene, depth = falling(draw, draw.scale(0.1, 10), {"start_overlap": "resolve"}, step, share)
    end = scene["time"]["end"]
    allowed = 9.81 * end + 0.1 * math.sqrt(2 * 9.81 * depth)

    def slow(run):
        speed = run.quantity("body_velocity_z")
        if speed is None or abs(speed) > allowed:
            return f"leaves with {speed} m/s, free fall and a tenth of a fall by the overlap: {allowed:.3g} m/s"
        return ""

    return Variant(scene, f"{share:g} of its half deep, step {step:g} s", law=slow)


def motion_tunnel(draw, lab):
    """A ball between a bar or a floor and one that strikes it stays on its side."""
    del lab
    unit = draw.scale(0.1, 10)
    light, heavy = short(0.005 * unit * draw.between(0.5, 2)), short(0.02 * unit * draw.between(0.5, 2))
    gap, way = draw.one_of(0.0, short(0.01 * unit * draw.between(0, 1))), short(0.01 * unit * draw.between(0.1, 2))
    speed = draw.scale(0.5, 100) * unit
    step = short(draw.scale(0.05, 8) * light / speed)
    on = draw.one_of("bar", "bar", "plane", "ball", "slab")
    radius = short(0.003 * unit * draw.between(0.5, 3))
    surface = {"bar": {"generate": "cylinder", "centre": [0, 0, -radius], "axis": [0, 1, 0], "radius": radius},
               "plane": {"generate": "plane"},
               "ball": {"generate": "ball", "centre": [0, 0, -radius], "radius": radius}}.get(on)
    if on == "slab":
        floor = rigid({"generate": "box", "size": [unit, unit, 2 * radius]}, [0, 0, -radius], mass=1, drive=still())
    else:
        floor = {"kind": "obstacle", "surface": surface}
    aside = short(light * draw.between(-0.3, 0.3)) if on in ("plane", "slab") and draw.chance(0.5) else 0.0
    masses = [draw.scale(1e-4, 1), draw.scale(0.1, 100)]
    lower, upper = short(light + gap, 8), short(2 * light + gap + way + heavy, 8)
    bounce = draw.one_of(0, 0, 0.3, 0.5, 0.9, 1)
    strike = way / speed
    end = short(max(10 * step, draw.between(1.5, 5) * strike))
    scene = scene_of({
        "light": rigid({"generate": "ball", "radius": light}, [0, 0, lower], mass=masses[0]),
        "heavy": rigid({"generate": "ball", "radius": heavy}, [aside, 0, upper], mass=masses[1],
                       velocity=[0, 0, -speed]),
        "floor": floor},
        {"between": ["*", "*"], "restitution": bounce}, {"kind": "dynamic", "step": step, "end": end})
    tolerance = OVERLAP_SHARE * min(light, heavy, radius)
    start_energy = 0.5 * masses[1] * speed ** 2

    def order(run):
        place = {b: [run.quantity(f"{b}_{k}") or 0.0 for k in "xyz"] for b in ("light", "heavy")}
        for body, size in (("light", light), ("heavy", heavy)):
            if on in ("plane", "slab") and place[body][2] < size - tolerance:
                return f"{body} ends at z = {place[body][2]:.4g} m, {size:g} m is on the floor"
            if on in ("bar", "ball"):
                across = place[body][::2] if on == "bar" else place[body]
                if math.hypot(*across[:-1], across[-1] + radius) < radius + size - tolerance or across[-1] < 0:
                    return f"{body} ends at {place[body]}, inside the {on} or below it"
        apart = math.dist(place["light"], place["heavy"])
        if apart < light + heavy - tolerance or (aside == 0 and place["heavy"][2] < place["light"][2]):
            return f"the balls end {apart:.4g} m apart, radii {light + heavy:.4g} m, or have changed places"
        kinetic = run.result.get("energy", {}).get("kinetic", 0)
        if kinetic > 1.001 * start_energy:
            return f"kinetic energy {kinetic:.4g} J of {start_energy:.4g} J"
        return ""

    return Variant(scene, f"on a {on}, masses {masses[0]:g} and {masses[1]:g} kg, {speed:g} m/s, step {step:g} s "
                   f"({speed * step / light:.2g} radii), restitution {bounce:g}", law=order, overlap_limit=tolerance)


KINDS = {f.__name__: f for f in (
    box_on_plane, rigid_box, rigid_cylinder, paddle, small_reach, ball_through_sheet, edge_through_edge, crossing_bars,
    crossing_bars_coarse, two_plates, fine_ball_on_coarse, roller, rigid_ball, cylinder_rim, sharp_edge_slides,
    start_inside, start_inside_rod, start_overlap_resolve, motion_overlap, motion_overlap_resolve, motion_tunnel)}


# ---------------------------------------------------------------------------------------------------------------
# Judging and reporting


def judge(variant, run):
    """The outcome of a run and the reason for it."""
    if run.code is None:
        return "refused-timeout", run.message
    if run.code == 3:
        return "refused", run.message
    if run.code == 2:
        return ("bad-input" if variant.starts_inside else "WRONG"), f"bad input: {run.message}"
    if not run.done():
        return "crash", f"exit code {run.code}: {run.message}"
    faults = []
    if variant.starts_inside:
        faults.append("done, though a body starts inside another")
    if variant.band:
        faults.append(force_fault(variant, run))
    if variant.law:
        faults.append(variant.law(run))
    if run.overlap is not None and run.overlap > variant.overlap_limit:
        faults.append(f"overlap of {run.overlap:.3g} m, {variant.overlap_limit:.3g} m is allowed")
    elif run.measured is not None and run.measured > variant.overlap_limit:
        reported = "none is reported" if run.overlap is None else f"{run.overlap:.3g} m is reported"
        faults.append(f"overlap of {run.measured:.3g} m at the end by the last frame, {reported}, "
                      f"{variant.overlap_limit:.3g} m is allowed")
    faults = [f for f in faults if f]
    if faults:
        return "WRONG", "; ".join(faults)
    return ("done-warned" if run.warnings else "done-right"), ""


def force_fault(variant, run):
    """What is wrong with the contact force, or ""."""
    force, band = run.force(variant.pair, variant.axis), variant.band
    if force is None or not math.isfinite(force):
        return f"no force {variant.pair[0]}_on_{variant.pair[1]} among the results"
    if not band.low <= force <= band.high:
        return f"force {force:.7g} N, right are {band.low:.7g} to {band.high:.7g} N ({band.how})"
    if force > band.silent_high and not run.warnings:
        return f"force {force:.7g} N without a warning, up to {band.silent_high:.7g} N need none ({band.how})"
    return ""


def try_variant(kind, index, seed, lab, program, keep):
    """Makes, runs and judges one variant; a record of it, or None where the program lacks what it needs."""
    start = time.monotonic()
    variant = KINDS[kind](Draw(f"{seed}/{kind}/{index}"), lab)
    if variant is None:
        return None
    making = time.monotonic() - start
    variant.scene["title"] = f"{kind} {index} of seed {seed}: {variant.label}"
    run = program.run(variant.scene, variant.pair if variant.overlap_limit < math.inf else ())
    outcome, reason = judge(variant, run)
    refused_fairly = outcome.startswith("refused") and variant.may_refuse
    record = {"kind": kind, "index": index, "label": variant.label, "outcome": outcome, "reason": reason,
              "weak": variant.weak, "force": run.force(variant.pair, variant.axis) if variant.pair else None,
              "band": dataclasses.asdict(variant.band) if variant.band else None,
              "overlap": run.overlap, "measured_overlap": run.measured,
              "overlap_limit": variant.overlap_limit, "warnings": run.warnings, "refused_fairly": refused_fairly,
              "seconds": run.seconds, "reference_seconds": making, "scene": ""}
    if outcome in ("WRONG", "crash") or outcome.startswith("refused") and not refused_fairly:
        keep.mkdir(parents=True, exist_ok=True)
        for i, scene in enumerate([variant.scene, *variant.references]):
            name = f"{kind}_{seed}_{index}" + (f"_reference_{i}" if i else "") + ".json"
            (keep / name).write_text(json.dumps(scene, indent=1) + "\n")
        record["scene"] = str(keep / f"{kind}_{seed}_{index}.json")
    return record


def table_of(records, kinds):
    """The table kind x outcome as text; the last two columns are weak references and refusals that are right."""
    heads = [*OUTCOMES, "weak ref", "may refuse", "seconds"]
    width = max(len(k) for k in kinds) + 2
    lines = ["kind".ljust(width) + "".join(h.rjust(len(h) + 2) for h in heads)]
    for kind in [*kinds, "all"]:
        mine = [r for r in records if kind in (r["kind"], "all")]
        counts = [sum(r["outcome"] == o for r in mine) for o in OUTCOMES]
        counts += [sum(bool(r["weak"]) for r in mine), sum(r["refused_fairly"] for r in mine),
                   round(sum(r["seconds"] for r in mine), 1)]
        lines.append(kind.ljust(width) + "".join(str(c or "-").rjust(len(h) + 2) for c, h in zip(counts, heads)))
    return "\n".join(lines)


def failures(records, kinds):
    """Sentences on what fails the whole: WRONG, crash, too many refused."""
    found = [f"{o}: {n}" for o in ("WRONG", "crash") if (n := sum(r["outcome"] == o for r in records))]
    for kind in kinds:
        mine = [r for r in records if r["kind"] == kind]
        refused = sum(r["outcome"].startswith("refused") and not r["refused_fairly"] for r in mine)
        if refused > REFUSED_SHARE * len(mine):
            found.append(f"{kind}: {refused} of {len(mine)} refused")
    return found


def main():
    """Reads the command line, tries the variants, prints what came out."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("--program", type=pathlib.Path, help="the amontons to be tried")
    parser.add_argument("--reference-program", type=pathlib.Path, help="makes the references (default: the same)")
    parser.add_argument("--kinds", default="", help="names with commas (default: all)")
    parser.add_argument("--count", type=int, default=20, help="variants of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--limit", type=float, default=60, help="seconds for a run")
    parser.add_argument("--cache", type=pathlib.Path, help="folder where references are kept")
    parser.add_argument("--keep", type=pathlib.Path, help="folder for scenes that failed (default: a new one)")
    parser.add_argument("--json", type=pathlib.Path, help="file for all records")
    parser.add_argument("--list", action="store_true", help="print the kinds and end")
    options = parser.parse_args()
    if options.list:
        for name, function in KINDS.items():
            print(f"{name:24}{' '.join(function.__doc__.split())}")
        return 0
    if not options.program:
        parser.error("--program is needed")
    kinds = [k for k in options.kinds.split(",") if k] or list(KINDS)
    unknown = [k for k in kinds if k not in KINDS]
    if unknown:
        parser.error(f"unknown kinds: {', '.join(unknown)}; there are {', '.join(KINDS)}")
    program = Program(options.program, options.limit)
    reference = Program(options.reference_program or options.program, 4 * options.limit)
    lab = Lab(reference, options.cache, program.has_field("start_overlap"))
    keep = options.keep or pathlib.Path(tempfile.mkdtemp(prefix="amontons_variants_"))
    start, records, left_out = time.monotonic(), [], set()
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        tasks = {pool.submit(try_variant, k, i, options.seed, lab, program, keep): k
                 for k in kinds for i in range(options.count)}
        for task, kind in tasks.items():
            record = task.result()
            if record is None:
                left_out.add(kind)
                continue
            records.append(record)
            if sys.stderr.isatty():
                print(f"\r{len(records)} of {len(tasks)} ", end="", file=sys.stderr)
    failed = failures(records, kinds)
    if options.json:
        options.json.write_text(json.dumps({"program": str(program.path), "seed": options.seed, "failed": failed,
                                            "variants": records}, indent=1) + "\n")
    print(table_of(records, kinds))
    for kind in left_out:
        print(f"left out: {kind}, the program has no \"start_overlap\"")
    for record in records:
        if record["scene"]:
            print(f"{record['outcome']}: {record['scene']}\n    {record['label']}\n    {record['reason']}"
                  + (f"\n    weak reference: {record['weak']}" if record["weak"] else ""))
    for record in records:
        if record["weak"] and not record["scene"]:
            print(f"weak reference: {record['kind']} {record['index']} ({record['label']}): {record['weak']}")
    print(f"{len(records)} variants in {time.monotonic() - start:.0f} s, references {lab.seconds:.0f} s"
          + (f"; failed: {'; '.join(failed)}" if failed else "; all right"))
    if not options.keep and keep.exists() and not any(keep.iterdir()):
        keep.rmdir()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
