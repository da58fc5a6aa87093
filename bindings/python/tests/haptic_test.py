"""A hand in a scene: on threads of C++, observed by Python."""

import csv
import os
import subprocess
import sys
import time

import numpy as np

import amontons as am
import amontons.haptic
from scenes import Case, block, folder, main

PROGRAM = am.build_info()["program"]


def pressed_ball(**more):
    """A ball in the hand, 1 mm above a floor that it is pressed on."""
    return {"schema": 1, "bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
        "ball": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.01}, "start": {"place": [0, 0, 0.011]},
                 "drive": {"z": [[0, 0], [0.4, -0.005]]}}},
        "contact": [{"between": ["ball", "floor"], "friction": 0.3}],
        "haptic": {"handle": "ball", "device": "omega.3", "hand": {"stiffness": 1000, "damping": 20}},
        "time": {"step": 0.02, "end": 0.5}, **more}


class HapticTest(Case):
    def test_ticks_are_those_of_the_program(self):
        with folder():
            am.Scene(pressed_ball()).save("ball.json")
            subprocess.run([PROGRAM, "haptic", "ball.json", "--virtual-time", "--output", "out", "--quiet"], check=True)
            with open("out/haptics.csv", newline="") as stream:
                rows = list(csv.reader(stream))
            session = am.haptic.Session("ball.json", virtual_time=True)
            self.assertIsNone(session.latest())
            session.start()
            self.assertTrue(session.wait())
            trace = session.trace()
            self.assertEqual(list(trace), [head.partition(" [")[0] for head in rows[0]])
            for k, (name, column) in enumerate(trace.items()):
                if name not in ("compute", "wake", "cpu"):
                    self.assertEqual([str(v) if column.dtype.kind == "U" else float(v) for v in column],
                                     [r[k] if column.dtype.kind == "U" else float(r[k]) for r in rows[1:]], name)
            self.assertEqual((trace.units["sent_z"], trace["contacts"].dtype.kind), ("N", "i"))
            summary = session.summary()
            self.assertEqual((summary["status"], summary["ticks"], summary["faults"]), ("done", 500, 0))
            # 4 mm below the floor, between two springs of 1000 N/m: hand and coupling.
            self.assertAlmostEqual(trace["sent_z"][-1], 2, delta=0.1)
            now = session.latest()
            self.assertAlmostEqual(now.force[2], 2, delta=0.2)  # as of the pose that the last step used
            self.assertEqual((now.contacts.names, len(now.contacts)), (("floor", "ball"), 1))
            np.testing.assert_allclose(abs(now.contacts.normal_force), now.force[2], rtol=0.05)
            self.assertEqual(now.place.shape, (3,))
            self.assertAlmostEqual(np.linalg.norm(now.turn), 1)
            with self.assertRaises(ValueError):
                now.force[0] = 1

    def test_in_real_time_it_is_observed_changed_and_stopped(self):
        with am.haptic.Session(pressed_ball(), duration=60) as session:
            session.start()
            self.assertTrue(session.running)
            self.assertFalse(session.wait(0.01))
            seen = None
            end = time.monotonic() + 60
            while time.monotonic() < end:  # until the floor is felt
                seen = session.latest()
                if seen is not None and len(seen.contacts) > 0:
                    break
                time.sleep(0.01)
            self.assertGreater(len(seen.contacts), 0)
            kept = seen.force.copy()
            session.set("contact.0.friction", 0.5)
            session.set("contact.0.friction", -1)
            while time.monotonic() < end and len([m for m in session.messages if "set" in m]) < 2:
                time.sleep(0.01)
            self.assertIn("set contact.0.friction=0.5", session.messages)
            self.assertTrue(any(m.startswith("not set: ") and "/contact/0/friction" in m for m in session.messages))
            for early in (session.summary, session.trace):
                with self.assertRaisesRegex(RuntimeError, "has not ended"):
                    early()
            with self.assertRaisesRegex(RuntimeError, "started before"):
                session.start()
            begin = time.monotonic()
            session.stop()
            self.assertLess(time.monotonic() - begin, 10)  # 50 ms and a step on an idle machine
            self.assertFalse(session.running)
            np.testing.assert_array_equal(seen.force, kept)
        summary = session.summary()
        self.assertEqual(summary["status"], "interrupted")
        self.assertGreater(summary["ticks"], 0)
        self.assertEqual(len(session.trace()["time"]), summary["ticks"])
        with self.assertRaisesRegex(RuntimeError, "has ended"):
            session.set("contact.0.friction", 0.5)

    def test_a_wire_in_the_walls_of_its_scene_exerts_a_force_on_the_hand(self):
        scene = am.Scene(os.path.join(os.environ["AMONTONS_SOURCES"], "examples", "haptic_catheter", "scene.json"))
        session = am.haptic.Session(scene, virtual_time=True, duration=0.3)
        session.start()
        session.wait()
        self.assertEqual(session.summary()["ticks"], 300)
        (beam,) = session.latest().beams.values()
        self.assertEqual(beam.points.shape[1], 3)

    def test_none_is_left_when_it_is_deleted_or_the_process_ends(self):
        session = am.haptic.Session(pressed_ball(), duration=60)
        session.start()
        before = time.monotonic()
        del session
        self.assertLess(time.monotonic() - before, 10)
        code = ("import sys; sys.path.insert(0, %r)\nimport amontons as am, amontons.haptic, haptic_test\n"
                "s = am.haptic.Session(haptic_test.pressed_ball(), duration=60)\ns.start()\n" % os.path.dirname(__file__))
        result = subprocess.run([sys.executable, "-B", "-c", code], capture_output=True, text=True, timeout=50)
        self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_wrong_use_is_refused(self):
        for arguments, place in ((dict(device="simulate"), ""), (dict(device=3), "device"), (dict(duration=0), "duration"),
                                 (dict(duration="long"), "duration"), (dict(threads=0), "threads"), (dict(late=0.1), "late"),
                                 (dict(latency=1.5, virtual_time=True), "latency"), (dict(late=0.9, virtual_time=True), "late"),
                                 (dict(device="recorded:nowhere.csv"), ""), (dict(device="udp:9", virtual_time=True), "")):
            with self.refused(place):
                am.haptic.Session(pressed_ball(), **arguments)
        with self.refused("/haptic"):
            am.haptic.Session(block())
        with self.refused("/haptic/device"):
            am.haptic.Session(pressed_ball(), set={"haptic.device": "omega.4"})
        session = am.haptic.Session(pressed_ball())
        with self.assertRaisesRegex(RuntimeError, "not been started"):
            session.summary()
        session.stop()
        with self.refused("set"):
            session.set("", 1)

    def test_no_force_is_a_failure_with_its_reason(self):
        scene = pressed_ball()
        # A soft block under a traction that no material of its law can carry.
        scene["bodies"]["block"] = {
            "kind": "solid", "material": {"law": "neo_hooke", "youngs_modulus": 1e3, "poisson_ratio": 0.3},
            "hold": [{"set": "z_min"}], "loads": [{"set": "z_max", "traction": [1e9, 0, -1e9]}],
            "mesh": {"generate": "box", "size": [0.08, 0.06, 0.03], "centre": [0, 0, -0.5], "cells": [2, 2, 2], "element": "H8"}}
        session = am.haptic.Session(scene, virtual_time=True, duration=0.1)
        session.start()
        session.wait()
        with self.assertRaisesRegex(am.SolveFailed, "there was no force: the simulation found no balance") as failed:
            session.summary()
        self.assertEqual(failed.exception.summary["status"], "failed")
        self.assertTrue(any(m.startswith("no force yet") for m in session.messages))


if __name__ == "__main__":
    main()
