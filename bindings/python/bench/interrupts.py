#!/usr/bin/env python3
"""How long Ctrl-C waits for its answer, at random moments of each call, and what it leaves.

    PYTHONPATH=build/release/lib/python3/site-packages python3 bindings/python/bench/interrupts.py [count [scene ...]]

A line for each scene and call: interrupts, seconds until KeyboardInterrupt is raised in the median, of nine in ten and at
most. After each the same simulation continues: what it then gives must have the bits of one that was never interrupted, or
the exit code is 1.
"""

import os
import random
import signal
import sys
import tempfile
import threading
import time

import numpy as np

import amontons as am

EXAMPLES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../examples")


def block(kind, cells, steps=3, **material):
    material = material or {"youngs_modulus": 1e5, "poisson_ratio": 0.3}
    return {"schema": 1, "bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
        "block": {"kind": "solid", **material,
                  "mesh": {"generate": "box", "size": [0.1, 0.1, 0.1], "centre": [0, 0, 0.05], "cells": [cells] * 3, "element": kind},
                  "hold": [{"set": "z_max", "x": [[0, 0], [1, 0.002]], "y": 0, "z": [[0, 0], [1, -0.001]]}]}},
        "contact": [{"between": ["block", "floor"], "friction": 0.3}], "time": {"step": 0.1, "end": 0.1 * steps}}


def example(name, **changes):
    return am.Scene(os.path.join(EXAMPLES, name, "scene.json"), set={k.replace("__", "."): v for k, v in changes.items()})


RUBBER = {"material": {"law": "neo_hooke", "youngs_modulus": 1e5, "poisson_ratio": 0.45}}
SCENES = {
    "catheter": lambda: example("catheter", time__end=1.5),
    "first_block": lambda: example("first_block", time__end=0.05),
    "linear 24^3 H8": lambda: block("H8", 24),
    "rubber 16^3 H8": lambda: block("H8", 16, **RUBBER),
    "rubber 24^3 H8": lambda: block("H8", 24, **RUBBER),
    "linear 10^3 T10": lambda: block("T10", 10),
    "iterative 40^3 H8": lambda: dict(block("H8", 40, 2), solver={"linear": "iterative"}),
    "pile": lambda: example("pile", output__plots=False, output__picture=False),
    "nest": lambda: example("nest", output__plots=False, output__picture=False),
}


class Press(threading.Thread):
    """Ctrl-C after a time from begin() on."""

    def __init__(self, after):
        super().__init__()
        self.at = None
        self._after, self._begun, self._over = after, threading.Event(), threading.Event()
        self.start()

    def run(self):
        self._begun.wait()
        if not self._over.wait(self._after):
            self.at = time.perf_counter()
            os.kill(os.getpid(), signal.SIGINT)

    def begin(self):
        self._begun.set()

    def end(self):
        self._over.set()
        self.join()


def interrupted(work, after):
    """Seconds from Ctrl-C to KeyboardInterrupt, or None where the work had ended before."""
    press = Press(after)
    try:
        press.begin()
        work()
        press.end()
        time.sleep(0.02)  # it came with the end
    except KeyboardInterrupt:
        now = time.perf_counter()
        press.end()
        return now - press.at
    return None


def bits(record):
    return record.step, record.time, record.contacts.force.tobytes(), record.contacts.gap.tobytes()


def calls(name, scene, folder, count, rng):
    """(call, seconds waited) of each interrupt."""
    scene = scene if isinstance(scene, am.Scene) else am.Scene(scene)
    began = time.perf_counter()
    whole = am.Simulation(scene)
    made = time.perf_counter() - began
    reference, took = [], []
    while not whole.done and len(reference) < 4:
        began = time.perf_counter()
        reference.append(bits(whole.step()))
        took.append(time.perf_counter() - began)
    print(f"# {name}: made in {made:.3f} s, steps in {', '.join(f'{t:.3f}' for t in took)} s", flush=True)
    wrong = 0

    def check(sim):
        nonlocal wrong
        while len(reference) > (sim.record.step + 1 if sim.record else 0):
            expected = reference[sim.record.step + 1 if sim.record else 0]
            if bits(sim.step()) != expected:
                wrong += 1
                print(f"# {name}: other bits after an interrupt", flush=True)
                return

    def stepping():
        sim = am.Simulation(scene)
        late = interrupted(lambda: [sim.step() for _ in took], rng.uniform(0, sum(took)))
        check(sim)
        return late

    def making():
        anew = am.Scene(scene.resolved)  # with walls of its own
        return interrupted(lambda: am.Simulation(anew), rng.uniform(0, made))

    def running():
        sim = am.Simulation(scene)
        output = tempfile.mkdtemp(dir=folder)
        late = interrupted(lambda: sim.run(output), rng.uniform(0, sum(took)))
        if late is not None:
            check(sim)
            other = am.Simulation(scene)
            first = []
            other.run(output, resume=True, on_step=lambda record: first.append(bits(record)) or record.step >= 3)
            nonlocal wrong
            if any(b not in reference for b in first if b[0] < len(reference)):
                wrong += 1
                print(f"# {name}: other bits after a run that continued", flush=True)
        return late

    def batching():
        batch = am.Batch(scene, 2, threads=2)
        late = interrupted(lambda: batch.advance(reference[1][1] if len(reference) > 1 else 0), rng.uniform(0, sum(took[:2])))
        for sim in batch.simulations[:1]:
            check(sim)
        return late

    for call, work in (("step", stepping), ("Simulation(...)", making), ("run", running), ("Batch.advance", batching)):
        yield call, [t for t in (work() for _ in range(count)) if t is not None], wrong


def problem(contacts, seed=1):
    """A dense contact problem that takes a while."""
    rng = np.random.default_rng(seed)
    n = 3 * contacts
    H = rng.normal(size=(n, n // 2))
    q = rng.normal(size=n)
    return H @ H.T / n + 1e-6 * np.eye(n), q, 0.5


def contact_calls(count, rng):
    W, q, mu = problem(400)
    work = am.ContactProblem(W, q, mu)
    began = time.perf_counter()
    s = am.solve(work, tolerance=1e-12, max_seconds=5)
    took = time.perf_counter() - began
    print(f"# solve of 400 contacts: {s.status} in {took:.2f} s", flush=True)
    yield "solve", [t for t in (interrupted(lambda: am.solve(work, tolerance=1e-12, max_seconds=5), rng.uniform(0, took)) for _ in range(count)) if t is not None]
    began = time.perf_counter()
    am.certify(W, q, mu, s.reaction)
    took = time.perf_counter() - began
    yield "certify", [t for t in (interrupted(lambda: am.certify(work.W, work.q, work.mu, s.reaction), rng.uniform(0, took)) for _ in range(count)) if t is not None]


def study_calls(count, rng, folder):
    def work():
        return interrupted(lambda: am.study(block("H8", 20), sweep={"time.step": [0.1, 0.05]}, quantity="floor_on_block_force_z",
                                            output=tempfile.mkdtemp(dir=folder)), rng.uniform(0.05, 1))
    yield "study", [t for t in (work() for _ in range(count)) if t is not None]


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    names = sys.argv[2:] or list(SCENES) + ["contact problem", "study"]
    rng, bad, late = random.Random(1), 0, 0
    print(f"{'scene':20s} {'call':16s} {'count':>5s} {'median':>8s} {'9 of 10':>8s} {'most':>8s}")

    def line(name, call, times):
        nonlocal late
        if times:
            t = np.sort(times)
            late += int((t > 0.1).sum())
            print(f"{name:20s} {call:16s} {len(t):5d} {np.median(t):8.3f} {t[int(0.9 * (len(t) - 1))]:8.3f} {t[-1]:8.3f}", flush=True)
        else:
            print(f"{name:20s} {call:16s}     0", flush=True)

    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        for name in names:
            if name == "contact problem":
                for call, times in contact_calls(count, rng):
                    line("", call, times)
            elif name == "study":
                for call, times in study_calls(count, rng, folder):
                    line("", call, times)
            else:
                for call, times, wrong in calls(name, SCENES[name](), folder, count, rng):
                    line(name, call, times)
                bad += wrong
    print(f"{late} answers later than 0.1 s, {bad} with other bits")
    sys.exit(1 if bad else 0)


if __name__ == "__main__":
    main()
