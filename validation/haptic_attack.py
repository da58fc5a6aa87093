#!/usr/bin/env python3
"""Attacks on the port of a haptic device: what is sent to the hand keeps its laws, whatever arrives.

    validation/haptic_attack.py PROGRAM [--tries 500] [--seed 1] [--kind NAME]

A hand presses a ball on a floor and moves back and forth; every ten poses a try of one kind is thrown in. After
each run the laws of haptic_stress.py must hold in the trace, the program must end by itself with exit
code 0, and its report must be whole. Exit 1 where one does not.
"""
import argparse
import json
import math
import os
import pathlib
import random
import socket
import struct
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import csv  # noqa: E402

from haptic_stress import PACKET, laws  # noqa: E402

SCENE = {
    "schema": 1,
    "bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
        "ball": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.01}, "start": {"place": [0, 0, 0.011]},
                 "drive": {"z": [[0, 0], [1, 0]]}}},
    "contact": [{"between": ["ball", "floor"], "friction": 0.3}],
    "haptic": {"handle": "ball", "device": "omega.3"},
    "time": {"step": 0.02, "end": 1},
}


class Sender:
    """A hand at the other end: its poses, and whatever a try makes of them."""

    def __init__(self, port, seed):
        self.link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.other = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.to, self.number, self.random = ("127.0.0.1", port), 0, random.Random(seed)
        self.begin = None

    def pose(self):
        t = time.monotonic() - self.begin
        return [0.004 * math.sin(3 * t), 0.003 * math.sin(2 * t), -0.004 + 0.004 * math.cos(2.5 * t), 0, 0, 0]

    def send(self, data, link=None):
        try:
            (link or self.link).sendto(data, self.to)
        except OSError:
            pass

    def packet(self, pose, number=None, stamp=None, name=b"AMHP"):
        if number is None:
            self.number += 1
            number = self.number
        stamp = time.monotonic_ns() if stamp is None else stamp
        return PACKET.pack(name, number & 0xFFFFFFFF, stamp, *pose)


def noise(s):
    s.send(os.urandom(s.random.randrange(0, 200)))


def no_packet(s):
    data = bytearray(s.packet(s.pose(), number=0))
    data[s.random.randrange(4)] ^= 1 << s.random.randrange(8)
    s.send(bytes(data))


def wrong_size(s):
    data = s.packet(s.pose(), number=s.number + 1) + os.urandom(64)
    s.send(data[:s.random.choice([0, 1, 4, 63, 65, 127, 128])])


def flipped_bit(s):
    s.number += 1
    data = bytearray(s.packet(s.pose(), number=s.number))
    data[16 + s.random.randrange(48)] ^= 1 << s.random.randrange(8)
    s.send(bytes(data))


def no_number(s):
    pose = s.pose()
    pose[s.random.randrange(6)] = s.random.choice([math.nan, math.inf, -math.inf, 1e308, -1e308, 5e-324])
    s.send(s.packet(pose))


def jump(s):
    pose = s.pose()
    pose[s.random.randrange(3)] += s.random.choice([-1, 1]) * 10 ** s.random.uniform(-3, 3)
    s.send(s.packet(pose))


def turned(s):
    pose = s.pose()
    pose[3 + s.random.randrange(3)] += s.random.choice([-1, 1]) * 10 ** s.random.uniform(-3, 6)
    s.send(s.packet(pose))


def silence(s):
    time.sleep(s.random.uniform(0.005, 0.04))


def old_number(s):
    s.send(s.packet(s.pose(), number=s.number - s.random.randrange(1, 2 ** 31)))


def burst(s):
    for _ in range(100):
        s.send(s.packet(s.pose()))


def other_clock(s):
    s.send(s.packet(s.pose(), stamp=s.random.choice([0, -1, 1, 2 ** 63 - 1, -2 ** 63, s.random.randrange(2 ** 62)])))


def taken_over(s):
    pose = s.pose()
    pose[2] -= 0.01 * s.random.random()
    s.number += 5
    s.send(s.packet(pose, number=s.number), s.other)


KINDS = [noise, no_packet, wrong_size, flipped_bit, no_number, jump, turned, silence, old_number, burst, other_clock, taken_over]


def attack(program, kind, tries, seed):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "scene.json").write_text(json.dumps(SCENE))
        duration = 2 + 0.02 * tries + (0.03 * tries if kind is silence else 0)
        with open(folder / "out", "w") as out, open(folder / "output", "w") as output:
            child = subprocess.Popen([program, "haptic", str(folder / "scene.json"), "--device", f"udp:{port}",
                                      "--duration", f"{duration:.3f}", "--json", "--output", str(folder / "results")], stdout=out, stderr=output)
            s = Sender(port, seed)
            s.begin = time.monotonic()
            made = count = 0
            while child.poll() is None:
                s.send(s.packet(s.pose()))
                count += 1
                if count > 1000 and count % 10 == 0 and made < tries:
                    kind(s)
                    made += 1
                time.sleep(0.001)
        if child.returncode:
            return made, f"exit {child.returncode}: {(folder / 'output').read_text()[-300:]}", {}
        report = json.loads((folder / "out").read_text())
        rows = list(csv.DictReader((folder / "results" / "haptics.csv").read_text().splitlines()))
        found, good = laws(report, rows)
        found["faults"] = report["faults"]
        return made, "" if good else "a law does not hold", found


def main():
    options = argparse.ArgumentParser()
    options.add_argument("program")
    options.add_argument("--tries", type=int, default=500)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--kind")
    a = options.parse_args()
    failed = 0
    for kind in KINDS:
        if a.kind and kind.__name__ != a.kind:
            continue
        made, wrong, found = attack(a.program, kind, a.tries, a.seed)
        failed += bool(wrong) or made < a.tries
        print(f"{kind.__name__:12} {made} tries  " + " ".join(f"{k} {v:.3g}" for k, v in found.items()) + f"  {wrong}", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
