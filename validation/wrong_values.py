#!/usr/bin/env python3
"""Replaces every value of every example by every one of many wrong ones, and examines what happens.

    validation/wrong_values.py PROGRAM [--examples DIR] [--checks 20000] [--runs 300] [--jobs N] [--seed 1] [--json FILE]

`amontons check` must exit with 0 or 2, and with 2 report the file, the place, what was found and what is allowed. Scenes that pass are candidates
for `amontons run`, cut to three steps: 0, 2 or 3, or 130 when it is interrupted after --seconds. Nothing may end by a signal, nothing
may specify "a mistake in amontons", and what is refused may leave no folder behind. Of values that only differ by their place in a list,
a few are taken (--alike); where there are more cases than requested, a seeded share of them. Exit 1 if there is a finding.
"""
import argparse
import collections
import concurrent.futures
import json
import os
import pathlib
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile

# As they stand in the file: some are no JSON.
WRONG = [
    "0", "-1", "1", "2", "0.5", "1e-9", "-1e-9", "1e-12", "1e-30", "-1e-30", "1e-308", "5e-324", "1e6", "1e9", "1e12", "2147483648",
    "1e18", "1e30", "-1e30", "1e308", "-1e308", "1e999", "NaN", "null", "true", '""', '"x"', '"a, \\"b\\"\\u0001"', '"\\ud800"',
    '"../../../nowhere"', '"*"', '"' + "n" * 300 + '"', "[]", "[0, 0, 0]", "[1e-30, 1, 1]", "[1e30, 1e30, 1e30]", "[1, 1e-12, 1e9]",
    "[1e-9, 1e9]", "[[0, 0], [1, 1e30]]", "[[0, 0], [1, 1e9]]", "[[0, 1], [1e-9, 1e-9]]", "[[1, 1], [0, 0]]", "[" * 5000 + "]" * 5000,
    "{}", '{"": 1}', '{"file": "nowhere"}', "{" + '"a": {' * 3000 + "}" * 3000 + "}",
]
# What no example has: couplings, walls as solids, laws, drives, loads, a path, layers.
HOLD = [{"set": "start"}]
MORE = {
    "coupled": {"bodies": {
        "wall": {"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3, "density": 1000, "mass_damping": 0.1,
                 "stiffness_damping": 1e-4, "mesh": {"generate": "tube", "centreline": {"pieces": [{"length": 0.1}]}, "radius": 0.01,
                                                    "thickness": 0.002, "around": 8, "along": 4, "through": 1, "element": "H8"}, "hold": HOLD},
        "tissue": {"kind": "solid", "density": 1000, "start": {"place": [0.3, 0, 0], "turn": [0, 0, 0.1], "velocity": [0, 0, 1]},
                   "material": {"law": "guccione", "c": 2000, "bf": 8, "bt": 2, "bfs": 4, "bulk_modulus": 5e4, "fibre": [1, 0, 0]},
                   "mesh": {"generate": "cylinder", "radius": 0.02, "length": 0.05, "around": 4, "along": 2, "element": "H8"},
                   "loads": [{"set": "end", "traction": [0, 0, 10], "over": [[0, 0], [1, 1]]}, {"set": "outer", "pressure": 5}]},
        "arm": {"kind": "rigid", "density": 1000, "shape": {"generate": "cylinder", "radius": 0.01, "length": 0.1, "points": 4},
                "start": {"place": [0.5, 0, 0]}, "force": [0, 0, 1], "torque": [0, 0.01, 0], "over": [[0, 0], [1, 1]]},
        "crank": {"kind": "rigid", "mass": 1, "inertia": [1e-3, 1e-3, 1e-3], "shape": {"generate": "box", "size": [0.05, 0.05, 0.05]},
                  "start": {"place": [0.7, 0, 0]}, "drive": {"x": [[0, 0], [1, 0.01]], "axis": [0, 0, 1], "angle": [[0, 0], [1, 1]]}}},
        "couplings": [{"kind": "hinge", "between": ["arm", "crank"], "at": [0.6, 0, 0], "axis": [0, 1, 0]},
                      {"kind": "spring", "between": ["tissue", "world"], "at": [0.3, 0, 0.05], "to": [0.3, 0, 0.1], "stiffness": 10,
                       "length": 0.04, "set": "end"}],
        "contact": [{"between": ["*", "*"], "friction": 0.3, "restitution": 0.5}], "gravity": [0, 0, -9.81],
        "time": {"kind": "dynamic", "step": 0.001, "end": 0.003, "rule": "generalised_alpha", "spectral_radius": 0.8}},
    "rods": {"bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "plane", "centre": [0, 0, -0.002]}},
        "rod": {"kind": "rod", "shape": {"points": [{"at": [0, 0, 0]}, {"at": [0.2, 0, 0]}]}, "drag": 0.1, "contact_spacing": 0.01,
                "segments": [{"length": 0.2, "radius": 0.001, "element": 0.02, "layers": [
                    {"inner_radius": 0.0005, "outer_radius": 0.001, "youngs_modulus": 1e9, "poisson_ratio": 0.3},
                    {"inner_radius": 0.0003, "outer_radius": 0.0005, "youngs_modulus": 1e9, "pitch": 0.001}]}],
                "hold": [{"set": "start", "x": [[0, 0], [1, 0.01]], "y": 0, "z": 0}],
                "loads": [{"set": "end", "force": [0, 0, -0.01], "moment": [0, 0.001, 0], "over": [[0, 0], [1, 1]]},
                          {"set": "all", "line": [0, 0.01, 0]}]}},
        "contact": [{"between": ["rod", "floor"], "friction": 0.2}], "time": {"step": 0.1, "end": 0.3, "smallest_step": 0.01}},
    "pressed": {"bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "cylinder", "centre": [0, 0, -0.1], "axis": [0, 1, 0], "radius": 0.08}},
        "block": {"kind": "solid", "motion": "corotational", "youngs_modulus": 1e5, "poisson_ratio": 0.4,
                  "mesh": {"generate": "box", "size": [0.1, 0.1, 0.04], "cells": [3, 2, 2], "grading": [1, 2, 1], "element": "T10"},
                  "hold": [{"set": "z_max", "x": 0, "y": 0, "z": [[0, 0], [1, -0.01]]}],
                  "loads": [{"set": "x_max", "pressure": [[0, 0], [1, 100]]}]},
        "sack": {"kind": "solid", "material": {"law": "mooney_rivlin", "c1": 1e4, "c2": 1e3, "poisson_ratio": 0.4},
                 "mesh": {"generate": "cylinder", "radius": 0.03, "length": 0.05, "centre": [0.3, 0, 0], "around": 4, "along": 2, "element": "H8"},
                 "loads": [{"set": "end", "volume": [[0, 0], [1, 1e-7]]}], "hold": [{"set": "start"}]}},
        "contact": [{"between": ["block", "floor"], "friction": 0.3, "reach": 0.01}], "time": {"step": 0.1, "end": 0.3}},
}
MEMORY = 6 << 30  # of addresses [bytes]
MARK = "\0here\0"


def without_comments(text):
    out = re.compile(r'"(?:\\.|[^"\\])*"|//[^\n]*|/\*.*?\*/', re.S)
    return out.sub(lambda m: m.group() if m.group()[0] == '"' else " ", text)


def places_of(value, path=()):
    """The path of every value, of objects and lists as well."""
    yield path
    children = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, child in children:
        yield from places_of(child, path + (key,))


def replaced(scene, path, text):
    """The scene as text with another text in the place of a value."""
    if not path:
        return text
    copy = json.loads(json.dumps(scene))
    at = copy
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = MARK
    return json.dumps(copy).replace(json.dumps(MARK), text)


class Attack:
    def __init__(self, a):
        self.program = str(pathlib.Path(a.program).resolve())
        self.seconds = a.seconds
        self.work = pathlib.Path(tempfile.mkdtemp(prefix="amontons_wrong_"))
        self.scenes = {}
        for file in sorted(pathlib.Path(a.examples).rglob("*.json")):
            try:
                scene = json.loads(without_comments(file.read_text()))
            except ValueError:
                continue
            if not isinstance(scene, dict) or scene.get("schema") != 1:
                continue
            name = f"{file.parent.name}-{file.stem}"
            folder = self.work / name
            shutil.copytree(file.parent, folder)  # beside what it names
            self.scenes[name] = (folder, scene)

        for name, scene in MORE.items():
            (self.work / name).mkdir()
            self.scenes[name] = (self.work / name, {"schema": 1, **scene})

    def cases(self, alike):
        seen = collections.Counter()
        for name, (_, scene) in self.scenes.items():
            for path in places_of(scene):
                kind = (name, tuple("[]" if isinstance(k, int) else k for k in path))
                seen[kind] += 1
                if seen[kind] <= alike:
                    yield from ((name, path, wrong) for wrong in WRONG)

    def call(self, command, seconds, interrupt):
        def limits():
            resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            if not interrupt:  # of the processor: a busy machine is no finding
                resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 5))
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=limits)
        slow = False
        try:
            out, err = process.communicate(timeout=seconds if interrupt else 30 * seconds)
        except subprocess.TimeoutExpired:
            slow = True
            process.send_signal(signal.SIGINT if interrupt else signal.SIGKILL)
            try:
                out, err = process.communicate(timeout=6 * seconds)
            except subprocess.TimeoutExpired:
                process.kill()
                out, err = process.communicate()
                return None, "does not end when it is interrupted", ""
        return (130 if slow and interrupt and process.returncode == 130 else None if slow else process.returncode,
                err.decode(errors="replace"), out.decode(errors="replace"))

    def finding(self, code, err, out, allowed):
        if code is None:
            return err if "interrupted" in err else f"takes more than {self.seconds} s"
        if code == -signal.SIGXCPU:
            return f"takes more than {self.seconds} s"
        if code < 0:
            return f"signal {-code}"
        if "a mistake in amontons" in err:
            return err.strip().splitlines()[-1]
        if code not in allowed:
            return f"exit code {code}: {err.strip()[-200:]}"
        if code == 2 and not all("found " in line and ", allowed: " in line for line in err.splitlines() if line.startswith("error: ")):
            return f"does not state what is allowed: {err.strip()[-200:]}"
        return ""

    def file_of(self, index, case):
        name, path, wrong = case
        folder, scene = self.scenes[name]
        file = folder / f"wrong_{index}.json"
        file.write_text(replaced(scene, path, wrong))
        return file

    def check(self, index, case):
        file = self.file_of(index, case)
        code, err, out = self.call([self.program, "check", str(file), "--json"], self.seconds, False)
        what = self.finding(code, err, out, (0, 2))
        if not what:
            try:
                json.loads(out)
            except ValueError:
                what = f"stdout is no JSON: {out[:80]}"
        file.unlink()
        return code, what

    def run(self, index, case):
        name, path, wrong = case
        file = self.file_of(index, case)
        folder = self.work / f"out_{index}"
        scene = self.scenes[name][1]
        step = scene["time"]["step"]
        short = [] if path[:1] == ("time",) or not path else ["--set", f"time.end={3 * step}"]
        code, err, out = self.call([self.program, "run", str(file), "--output", str(folder), "--set", "output.picture=false", "--set",
                                    "output.plots=false", *short], self.seconds, True)
        what = self.finding(code, err, out, (0, 2, 3, 130))
        if not what and code == 2 and folder.exists():
            what = "refused, and a folder is left"
        shutil.rmtree(folder, ignore_errors=True)
        file.unlink()
        return code, what


def shown(case):
    name, path, wrong = case
    return f"{name}: /{'/'.join(map(str, path))} = {wrong if len(wrong) < 50 else wrong[:20] + '...'}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("program")
    parser.add_argument("--examples", default=str(pathlib.Path(__file__).resolve().parent.parent / "examples"))
    parser.add_argument("--checks", type=int, default=20000)
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--alike", type=int, default=1, help="of values that only differ by their place in lists")
    parser.add_argument("--seconds", type=float, default=20, help="that one of them may take")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", help="write counts and findings into this file")
    a = parser.parse_args()
    attack = Attack(a)
    chosen = random.Random(a.seed)
    cases = list(attack.cases(a.alike))
    chosen.shuffle(cases)
    findings, counts = [], {"check": collections.Counter(), "run": collections.Counter()}

    def all_of(command, list_of_cases):
        passed = []
        do = getattr(attack, command)
        with concurrent.futures.ThreadPoolExecutor(a.jobs) as pool:
            for case, (code, what) in zip(list_of_cases, pool.map(do, range(len(list_of_cases)), list_of_cases)):
                counts[command][str(code)] += 1
                if what:
                    findings.append({"command": command, "case": shown(case), "finding": what})
                    print(f"{command} {shown(case)}: {what}", file=sys.stderr, flush=True)
                elif code == 0:
                    passed.append(case)
        return passed

    passed = all_of("check", cases[:a.checks])
    all_of("run", passed[:a.runs])
    shutil.rmtree(attack.work, ignore_errors=True)
    for command, codes in counts.items():
        print(f"{command}: {sum(codes.values())} of {len(cases) if command == 'check' else len(passed)}, exit codes "
              + ", ".join(f"{code}: {n}" for code, n in sorted(codes.items())))
    print(f"{len(findings)} findings")
    if a.json:
        pathlib.Path(a.json).write_text(json.dumps({"counts": counts, "findings": findings}, indent=1) + "\n")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
