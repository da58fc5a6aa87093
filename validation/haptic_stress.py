#!/usr/bin/env python3
"""The haptic loop in real time under load: what is sent and the energy that a hand is given.

    validation/haptic_stress.py PROGRAM [SCENE ...] [--duration 60] [--gap 0.015] [--busy N] [--free]

For each scene (default: all examples with a hand) a hand of mass, damper and spring at the other end of UDP
follows a path into the scene and back and forth, 1000 poses a second, and is silent for --gap seconds once a
second; with a busy process on each core. From the trace of all ticks, not from the report:

    rise    the largest rise of |sent| in a tick beyond that of |computed| [N], 0.2 at most
    over    the largest |sent| beyond the larger of |computed| and |sent before|: damping alone [N]
    grown   the largest growth in a tick of a fault [N], 0
    reported    ticks in "running" whose force is not as computed, 0
    share   of the computed force that is sent, the median over the ticks that are "limited" [-]
    energy  what the program shows that the hand was given at most [J], 1e-5 at most
    own     what the hand felt itself, by its own clock [J]: not a law, as packets come late

Exit 1 where a law does not hold. --free: no gap, no busy process.
"""
import argparse
import csv
import json
import math
import os
import pathlib
import socket
import struct
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[1]
PACKET = struct.Struct("<4sIq3d3d")
FAULTS = {"stale operator", "device lost", "too fast", "pose jump", "not a number", "simulation stopped"}


def wave(t, period):
    return math.sin(2 * math.pi * t / period)


def ease(t, end):
    return 0.5 - 0.5 * math.cos(math.pi * min(max(t, 0) / end, 1))


# Path of the hand [m], by scene: into it, then back and forth and out and in again.
PATHS = {
    "hapco/hexa.json": lambda t: (0.006 * wave(t, 3.1), 0.004 * wave(t, 2.3), -0.010 * ease(t - 1, 2) * (1 + wave(t, 4.7))),
    "hapco/tetra.json": lambda t: (0.006 * wave(t, 3.1), 0.004 * wave(t, 2.3), -0.010 * ease(t - 1, 2) * (1 + wave(t, 4.7))),
    "haptic_bed/scene.json": lambda t: (0.012 * wave(t, 3.7), 0.008 * wave(t, 2.9), -0.007 * ease(t - 1, 2) * (1 + 0.9 * wave(t, 5.3))),
    "haptic_catheter/scene.json": lambda t: (0.13 * ease(t - 1, 5) + 0.02 * ease(t - 5, 2) * wave(t, 2.7), 0, 0),
    "haptic_rod/scene.json": lambda t: (0.004 * wave(t, 1.9), 0.03 * ease(t - 2, 1) * wave(t, 4.3), -0.015 * ease(t - 1, 2) * (1 + 0.9 * wave(t, 6.1))),
}
MASS, DAMPING, STIFFNESS = 0.15, 3.0, 300.0


def play(program, scene, path, a):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with tempfile.TemporaryDirectory() as folder:
        out = open(pathlib.Path(folder) / "report.json", "w+")
        output = open(pathlib.Path(folder) / "output", "w+")
        child = subprocess.Popen([program, "haptic", str(scene), "--device", f"udp:{port}", "--duration",
                                  str(a.duration), "--json", "--output", folder, *a.option], stdout=out, stderr=output)
        link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        link.setblocking(False)
        x, v, force = [0.0] * 3, [0.0] * 3, (0.0,) * 3
        number, own, most = 0, 0.0, 0.0
        begin = last = next_pose = time.monotonic()
        first_force = None  # when the first force came
        while child.poll() is None:
            now = time.monotonic()
            step = min(now - last, 0.02)
            last = now
            t = (now - first_force) if first_force else 0.0
            target = path(t)
            for part in range(8):  # finer than the poses
                h = step / 8
                for i in range(3):
                    pull = STIFFNESS * (target[i] - x[i]) - DAMPING * v[i] + force[i]
                    v[i] += h * pull / MASS
                    x[i] += h * v[i]
                    own += h * v[i] * force[i]
            most = max(most, own)
            if not (a.gap and t % 1.0 > 1.0 - a.gap):
                number += 1
                try:
                    link.sendto(PACKET.pack(b"AMHP", number, time.monotonic_ns(), *x, 0, 0, 0), ("127.0.0.1", port))
                except ConnectionError:
                    pass
            try:
                while True:
                    data = link.recv(128)
                    if len(data) == 64 and data[:4] == b"AMHF":
                        force = PACKET.unpack(data)[3:6]
                        first_force = first_force or now
            except (BlockingIOError, ConnectionError):
                pass
            next_pose = max(next_pose + 1e-3, time.monotonic() - 0.01)
            time.sleep(max(0.0, next_pose - time.monotonic()))
        out.seek(0), output.seek(0)
        if child.returncode:
            sys.exit(f"{scene}: exit {child.returncode}: {output.read()}")
        report = json.load(out)
        rows = list(csv.DictReader((pathlib.Path(folder) / "haptics.csv").read_text().splitlines()))
        return report, rows, most, output.read()


def size(row, name):
    return math.sqrt(sum(float(row[f"{name}_{a} [N]"]) ** 2 for a in "xyz"))


def laws(report, rows):
    tiny = 1e-5  # digits of the trace
    found = {"rise": -1.0, "over": 0.0, "grown": 0.0, "told": 0}
    before = None
    for row in rows:
        s, c = size(row, "sent"), size(row, "computed")
        if row["state"] == "running":
            found["told"] += any(abs(float(row[f"sent_{a} [N]"]) - float(row[f"computed_{a} [N]"])) > tiny * max(1, c)
                                 for a in "xyz")
        if before:
            s0, c0 = before
            found["rise"] = max(found["rise"], s - s0 - max(0.0, c - c0))
            found["over"] = max(found["over"], s - max(c, s0))
            if row["state"] in FAULTS:
                found["grown"] = max(found["grown"], s - s0)
        before = s, c
    found["energy"] = report["energy_injected"]
    # How much of the computed force is sent where it is not all.
    shares = sorted(size(r, "sent") / size(r, "computed") for r in rows
                    if r["state"] == "limited" and size(r, "computed") > 1e-3)
    found["share"] = shares[len(shares) // 2] if shares else 1.0
    good = (found["rise"] <= 0.2 + tiny and found["grown"] <= tiny and found["told"] == 0
            and found["energy"] <= 1e-5)
    return found, good


def main():
    options = argparse.ArgumentParser()
    options.add_argument("program")
    options.add_argument("scene", nargs="*")
    options.add_argument("--duration", type=float, default=60)
    options.add_argument("--gap", type=float, default=0.015)
    options.add_argument("--busy", type=int, default=os.cpu_count())
    options.add_argument("--free", action="store_true")
    options.add_argument("--option", action="append", default=[], help="for the program, e.g. --option=--no-control")
    a = options.parse_args()
    if a.free:
        a.gap, a.busy = 0, 0
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(a.busy)]
    failed = 0
    try:
        for name, path in PATHS.items():
            if a.scene and not any(s in name for s in a.scene):
                continue
            report, rows, own, output = play(a.program, ROOT / "examples" / name, path, a)
            found, good = laws(report, rows)
            failed += not good
            print(f"{name:28} {'' if good else 'FAILED '}" + " ".join(
                f"{k} {v:.3g}" for k, v in found.items()) + f" own {own:.2g}; {len(rows)} ticks, largest "
                f"{report['largest_force']:.2f} N, missed {sum(report['missed'][k] for k in ('compute', 'host', 'wake', 'preempted'))}, "
                f"longest {report['missed']['longest']}, faults {report['faults']}; {report.get('ticks_in', '')}", flush=True)
            for line in output.splitlines():
                print("    " + line[:150])
    finally:
        for child in busy:
            child.kill()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
