#!/usr/bin/env python3
"""Ends runs at random moments, by kill -9, by a full disk and by signals that interrupt, and resumes them.

    validation/faults.py PROGRAM [--trials 200] [--seed 1] [--json FILE]

After each fault every finished step must be readable and the undisturbed run's own; the resumed run must end with the same bytes as
one that was never disturbed: history (but for its clocks), frames, results. A third of the trials are
killed, up to three times in a row, a third interrupted so (SIGTERM, SIGHUP, SIGINT); a third run on a disk of random size that is too small (a tmpfs in a
namespace of its own; where that is not allowed, a limit on the size of each file), and are resumed on
one that is large enough. Exit 1 if a trial fails, with the folder of what it left.
"""
import argparse
import csv
import json
import pathlib
import random
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import xml.etree.ElementTree as xml

PLANE = {"kind": "obstacle", "surface": {"generate": "plane"}}
SCENES = {
    "wire": {
        "schema": 1,
        "bodies": {
            "tube": {"kind": "obstacle", "surface": {"generate": "tube", "radius": 0.004, "centreline": {
                "pieces": [{"length": 0.02}, {"radius": 0.03, "angle": 1.57}, {"length": 0.06}]}}},
            "wire": {"kind": "beam", "drive": {"insertion": [[0, 0], [1, 0.08]]}, "segments": [
                {"length": 0.12, "radius": 4.445e-4, "EI": 5.2e-4, "element": 2.5e-3}]}},
        "contact": [{"between": ["wire", "tube"], "friction": 0.1}],
        "time": {"step": 0.005, "end": 1}},
    "solid": {
        "schema": 1,
        "bodies": {"plane": PLANE, "block": {
            "kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3, "density": 1000,
            "mesh": {"generate": "box", "size": [0.1, 0.1, 0.1], "cells": [3, 3, 3], "element": "H8"},
            "start": {"place": [0, 0, 0.055], "velocity": [0.5, 0.1, 0]}}},
        "contact": [{"between": ["block", "plane"], "friction": 0.3}],
        "gravity": [0, 0, -9.81],
        "time": {"kind": "dynamic", "step": 0.002, "end": 0.4}},
    "rigid": {
        "schema": 1,
        "bodies": {"plane": PLANE, **{f"ball{i}": {
            "kind": "rigid", "shape": {"generate": "ball", "radius": 0.05}, "mass": 1,
            "start": {"place": [0.03 * i, 0.01 * i * i, 0.06 + 0.11 * i]}} for i in range(4)}},
        "contact": [{"between": ["*", "*"], "friction": 0.4}],
        "gravity": [0, 0, -9.81],
        "time": {"kind": "dynamic", "step": 0.002, "end": 0.4}},
    "pressed": {
        "schema": 1,
        "bodies": {"plane": PLANE, "beam": {
            "kind": "solid", "density": 1000, "material": {"law": "neo_hooke", "youngs_modulus": 1e5, "poisson_ratio": 0.2},
            "mesh": {"generate": "box", "size": [0.2, 0.06, 0.04], "cells": [6, 2, 2], "element": "H8"},
            "start": {"place": [0, 0, 0.0215]}, "hold": [{"set": "x_min"}],
            "loads": [{"set": "z_max", "pressure": [[0, 0], [1, 185]]},
                      {"set": "x_max", "traction": [85, -74, -8], "over": [[0, 0], [1, 1]]}]}},
        "contact": [{"between": ["beam", "plane"], "friction": 0.1}],
        "gravity": [0, 0, -9.81],
        "time": {"step": 0.01, "end": 1}},
    "turned": {
        "schema": 1,
        "bodies": {"plane": PLANE, "beam": {
            "kind": "solid", "youngs_modulus": 1e7, "poisson_ratio": 0.45, "motion": "corotational",
            "mesh": {"generate": "box", "size": [0.2, 0.06, 0.04], "cells": [6, 2, 2], "element": "T10"},
            "start": {"place": [0, 0, 0.023]}, "hold": [{"set": "x_min"}],
            "loads": [{"set": "x_max", "traction": [0, 0, -3000], "over": [[0, 0], [1, 1]]}]}},
        "contact": [{"between": ["beam", "plane"], "friction": 0.5}],
        "time": {"step": 0.01, "end": 1}},
}


def history_of(folder, killed=False):
    """Steps as text without their clocks; every line must be whole. The system ends a killed process's write
    where a page does: then the last line may lack its end, and is of a step that was not finished."""
    text = (folder / "history.csv").read_text()
    if killed:
        text = text[:text.rfind("\n") + 1]
    if not text:
        return []  # not even the heading found room
    assert text.endswith("\n"), "history.csv ends within a line"
    rows = list(csv.reader(text.splitlines()))
    clocks = [i for i, name in enumerate(rows[0]) if "seconds" in name]
    assert all(len(r) == len(rows[0]) for r in rows), "a line of history.csv is not whole"
    return [[v for i, v in enumerate(r) if i not in clocks] for r in rows]


def frames_of(folder):
    """Bytes of every file that a collection names."""
    out = {}
    for pvd in sorted(folder.glob("*.pvd")):
        for entry in xml.parse(pvd).getroot().iter("DataSet"):
            file = entry.get("file")
            data = (folder / file).read_bytes()
            assert data.rstrip().endswith(b"</VTKFile>"), f"{file} is not whole"
            out[pvd.name, entry.get("timestep"), file] = data
    return out


def results_of(folder):
    manifest = json.loads((folder / "manifest.json").read_text())
    return {k: manifest[k] for k in ("status", "steps", "time", "quantities", "energy", "contacts",
                                     "certificate")}


def readable(folder, whole, least=0, killed=False, interrupted=False):
    """What was finished before the fault can be read, and is how the undisturbed run began: (steps, has a
    checkpoint). At least `least` steps were there before."""
    history = history_of(folder, killed) if (folder / "history.csv").exists() else []
    steps = max(0, len(history) - 1)
    assert history == whole[0][:len(history)], "the steps that are left are not those of the undisturbed run"
    assert steps >= least, f"{least} steps were written, {steps} are left"
    by_name = {file: data for (_, _, file), data in whole[1].items()}
    for (collection, moment, file), data in frames_of(folder).items():
        if ".end." in file:
            continue  # where a run that gave up stood: the undisturbed one has none there
        if interrupted and file not in by_name:
            continue  # of the last step, which a run that is interrupted writes
        # What stands still is written anew with the last frame: until then its first file stands for it.
        last = (collection, moment, file.replace(".start.", ".end."))
        there = (collection, moment, file) in whole[1] or last in whole[1]
        assert there and by_name.get(file) == data, f"another frame {file} is left"
    if not (folder / "manifest.json").exists():
        return steps, False
    json.loads((folder / "manifest.json").read_text())
    return steps, (folder / "checkpoint").exists()


def steps_written(folder):
    """Whole lines of a history that a run still writes, but for its heading."""
    try:
        return max(0, (folder / "history.csv").read_bytes().count(b"\n") - 1)
    except OSError:
        return 0


class Trials:
    def __init__(self, program, seed):
        self.program = str(pathlib.Path(program).resolve())
        self.random = random.Random(seed)
        self.work = pathlib.Path(tempfile.mkdtemp(prefix="amontons_faults_"))
        self.small_disks = subprocess.run(
            ["unshare", "-rm", "mount", "-t", "tmpfs", "-o", "size=64k", "none", "/mnt"],
            capture_output=True).returncode == 0
        self.whole = {}

    def command(self, name, folder, *more):
        return [self.program, "run", str(self.work / (name + ".json")), "--quiet", "--output", str(folder),
                *more]

    def prepare(self, name):
        """The undisturbed run: what it gives, how long it takes, how much it writes."""
        scene = {**SCENES[name], "output": {"picture": False, "plots": False, "every": 5}}
        (self.work / (name + ".json")).write_text(json.dumps(scene))
        folder = self.work / (name + "_whole")
        start = time.monotonic()
        subprocess.run(self.command(name, folder), check=True)
        seconds = time.monotonic() - start
        size = sum(f.stat().st_size for f in folder.rglob("*") if f.is_file())
        self.whole[name] = (history_of(folder), frames_of(folder), results_of(folder), seconds, size)

    def kill(self, name, folder, signals=(signal.SIGKILL,)):
        """Up to three ends, each at a random moment of what is left."""
        started = False
        for _ in range(self.random.randint(1, 3)):
            more = ["--resume"] if started else []
            process = subprocess.Popen(self.command(name, folder, *more), stderr=subprocess.PIPE)
            try:
                process.wait(timeout=self.random.uniform(0, 0.9 * self.whole[name][3]))
                break  # it was quicker
            except subprocess.TimeoutExpired:
                written = steps_written(folder)
                how = self.random.choice(signals)
                process.send_signal(how)
                process.communicate()
                if how != signal.SIGKILL and process.returncode not in (0, 130, -how):
                    raise AssertionError(f"exit code {process.returncode} after signal {how}")
                if not (folder / "manifest.json").exists():  # before main
                    continue
            _, started = readable(folder, self.whole[name], written, True, how != signal.SIGKILL)
            if how != signal.SIGKILL:
                manifest = json.loads((folder / "manifest.json").read_text())
                assert manifest["checkpoint"] == (folder / "checkpoint").exists(), "the manifest reports another checkpoint"
                started = True  # where it specifies that there is none, --resume begins anew
        return started

    def fill(self, name, folder):
        """A disk that is full after a random share of what the run writes."""
        size = max(8192, int(self.random.uniform(0.02, 0.95) * self.whole[name][4]))
        if self.small_disks:
            disk = self.work / "disk"
            disk.mkdir(exist_ok=True)
            script = ('mount -t tmpfs -o size="$1" none "$2" || exit 99; shift 2; copy="$1"; shift; '
                      '"$@"; code=$?; cp -a "$disk/out" "$copy" 2>/dev/null; exit $code')
            run = subprocess.run(
                ["unshare", "-rm", "sh", "-c", f'disk="{disk}"; ' + script, "sh", str(size), str(disk),
                 str(folder), *self.command(name, disk / "out")], capture_output=True, text=True)
        else:
            limit = size // 20
            run = subprocess.run(
                self.command(name, folder), capture_output=True, text=True,
                preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        if run.returncode not in (0, 3) and not (run.returncode == 2 and not folder.exists()):
            raise AssertionError(f"exit code {run.returncode} on a full disk: {run.stderr.strip()}")
        if run.returncode == 3 and "cannot be written" not in run.stderr:
            raise AssertionError(f"a full disk is called: {run.stderr.strip()}")
        return readable(folder, self.whole[name])[1] if folder.exists() else False

    def trial(self, name, kind):
        folder = self.work / "out"
        shutil.rmtree(folder, ignore_errors=True)
        continues = (self.fill(name, folder) if kind == "full disk" else self.kill(name, folder) if kind == "kill -9" else
                   self.kill(name, folder, (signal.SIGTERM, signal.SIGHUP, signal.SIGINT)))
        again = subprocess.run(self.command(name, folder, *(["--resume"] if continues else [])),
                               capture_output=True, text=True)
        assert again.returncode == 0, f"resumed: exit code {again.returncode}: {again.stderr.strip()}"
        history, frames, results, _, _ = self.whole[name]
        assert history_of(folder) == history, "another history"
        found = frames_of(folder)
        assert found.keys() == frames.keys(), "other frames"
        assert found == frames, "other bytes in a frame"
        assert results_of(folder) == results, "other results"
        return continues


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("program")
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", help="write the counts into this file")
    a = parser.parse_args()
    t = Trials(a.program, a.seed)
    names = list(SCENES)
    for name in names:
        t.prepare(name)
    counts = {}
    failures = []
    for i in range(a.trials):
        name, kind = names[i // 3 % len(names)], ("kill -9", "full disk", "signal")[i % 3]
        row = counts.setdefault((kind, name), {"trials": 0, "resumed": 0, "failed": 0})
        row["trials"] += 1
        try:
            row["resumed"] += bool(t.trial(name, kind))
        except (AssertionError, OSError, ValueError, xml.ParseError) as error:
            row["failed"] += 1
            kept = t.work / f"failed_{i}"
            if (t.work / "out").exists():
                shutil.move(t.work / "out", kept)
            failures.append(f"trial {i} ({kind}, {name}): {error}; see {kept}")
            print(failures[-1], file=sys.stderr)
    print(f"{'fault':<10} {'scene':<6} {'trials':>6} {'resumed':>8} {'from the start':>15} {'failed':>7}")
    for (kind, name), row in counts.items():
        print(f"{kind:<10} {name:<6} {row['trials']:>6} {row['resumed']:>8} "
              f"{row['trials'] - row['resumed'] - row['failed']:>15} {row['failed']:>7}")
    print(f"{a.trials} trials, {len(failures)} failed"
          + ("" if t.small_disks else "; no right to mount: files were limited instead of the disk"))
    if a.json:
        pathlib.Path(a.json).write_text(json.dumps(
            [{"fault": k, "scene": n, **row} for (k, n), row in counts.items()], indent=1) + "\n")
    if not failures:
        shutil.rmtree(t.work, ignore_errors=True)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
