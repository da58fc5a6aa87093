"""What validation/robustness.sh runs with the module under sanitizers.

    sanitized.py views      10 000 steps, views kept at random: nothing is read that no longer exists, nothing changes
    sanitized.py refusals   wrong use of all kinds: an exception each, and what was right continues
    sanitized.py threads    8 threads in one vessel: the bits of one alone
"""

import gc
import os
import random
import sys
import threading

import numpy as np

import amontons as am

VESSEL = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../../examples/catheter/scene.json")


def pushed_to_and_fro(steps):
    """A wire in a bent tube, in and out."""
    return {"schema": 1, "bodies": {
        "tube": {"kind": "obstacle", "surface": {"generate": "tube", "radius": 0.004, "centreline": {
            "pieces": [{"length": 0.01}, {"radius": 0.02, "angle": 1.57}, {"length": 0.02}]}}},
        "wire": {"kind": "beam", "drive": {"insertion": [[0.01 * steps * k / 20, 0.04 if k % 2 else 0.02] for k in range(21)]},
                 "segments": [{"length": 0.08, "radius": 4.445e-4, "EI": 5.2e-4, "element": 4e-3}]}},
        "contact": [{"between": ["wire", "tube"], "friction": 0.1}], "time": {"step": 0.01, "end": 0.01 * steps}}


def views(steps=10000):
    rng = random.Random(1)
    sim = am.Simulation(pushed_to_and_fro(steps))
    kept, taken, states = [], 0, []
    while not sim.done:
        record = sim.step()
        taken += 1
        if rng.random() < 0.02:
            states.append(sim.save())
            if rng.random() < 0.3:
                sim.restore(rng.choice(states[-5:]))
        if rng.random() < 0.005:
            sim = sim.fork()
        beam, body = record.beams["wire"], sim.bodies["tube"]
        choice = [record.contacts.force, record.contacts.status, beam.points, beam.fields["moment"], body.points, body.triangles]
        if rng.random() < 0.3:
            view = rng.choice(choice)
            kept.append((view, view.copy()))
        while len(kept) > 300 or (kept and rng.random() < 0.2):
            view, copy = kept.pop(rng.randrange(len(kept)))
            np.testing.assert_array_equal(view, copy)
        if taken >= steps:
            break
    del sim, record, beam, body, choice
    gc.collect()
    for view, copy in kept:
        np.testing.assert_array_equal(view, copy)
    print(f"{taken} steps, {len(kept)} views at the end as they were")


def refusals(rounds=300):
    rng = random.Random(2)
    sim = am.Simulation(pushed_to_and_fro(1000))
    closed = am.Simulation(pushed_to_and_fro(1000))
    with closed:
        closed.step(3)
    raised = {}

    def wrong(kinds, work):
        try:
            work()
        except kinds as error:
            raised[type(error).__name__] = raised.get(type(error).__name__, 0) + 1
        else:
            raise AssertionError("not refused")

    W, q = np.eye(3), np.array([-1.0, 1, 0])
    for _ in range(rounds):
        state, before = sim.save(), sim.step().contacts.force.copy()
        k, bit = rng.randrange(len(state)), 1 << rng.randrange(8)
        wrong(am.InputError, lambda: sim.restore(state[:k] + bytes([state[k] ^ bit]) + state[k + 1:]))
        wrong(am.InputError, lambda: sim.restore(state[:k]))
        wrong(am.InputError, lambda: sim.inputs.__setitem__("wire.insertion", rng.choice([np.nan, np.inf, -1.0, 1e9, "x", None])))
        wrong(am.InputError, lambda: sim.advance(rng.choice([np.nan, -1.0, np.inf, 1e9])))
        wrong(am.InputError, lambda: sim.set(rng.choice(["no.field", "bodies.wire", "time.step"]), {"a": 1}))
        wrong((am.InputError, TypeError), lambda: sim.step(rng.choice([0, -1, 1.5, "x", None, 10**30])))
        wrong(RuntimeError, lambda: rng.choice([closed.step, closed.save, closed.fork, lambda: closed.record, lambda: closed.inputs["wire.twist"]])())
        wrong(am.InputError, lambda: am.solve(rng.choice([np.eye(4), np.full((3, 3), np.nan), W[0], np.eye(3) * 1j]), q, 0.5))
        wrong(am.InputError, lambda: am.Scene({"schema": 1, "bodies": {"a": {"kind": rng.choice(["bem", 3, None])}}}))
        sim.restore(state)
        np.testing.assert_array_equal(sim.step().contacts.force, before)
    wrong(RuntimeError, lambda: sim.run(on_step=lambda record: sim.step()))
    wrong(ZeroDivisionError, lambda: sim.run(on_step=lambda record: 1 / 0))
    print(f"{sim.record.step} steps between refusals: {raised}")


def threads(count=8, until=3.0):
    scene = am.Scene(VESSEL)

    def bits():
        sim = am.Simulation(scene)
        forces = [sim.advance(until * k / 3).contacts.force.tobytes() for k in (1, 2, 3)]
        return forces, sim.record.quantities["push_force"]
    found = [None] * count

    def work(k):
        found[k] = bits()
    all = [threading.Thread(target=work, args=(k,)) for k in range(count)]
    for t in all:
        t.start()
    for t in all:
        t.join()
    assert found == [bits()] * count
    batch = am.Batch(scene, count, threads=count)
    batch.advance(until)
    assert len(set(batch.quantity("push_force"))) == 1
    print(f"{count} threads in one vessel, and a batch, with the bits of one alone")


if __name__ == "__main__":
    {"views": views, "refusals": refusals, "threads": threads}[sys.argv[1]](*(float(a) if "." in a else int(a) for a in sys.argv[2:]))
