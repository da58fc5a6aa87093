"""The window of --view from outside, on an Xvfb: view_test.py PROGRAM"""

import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import reported_skips

PROGRAM = pathlib.Path(sys.argv[1]).resolve()
SCENE = {
    "schema": 1,
    "title": "A die on a bed",
    "bodies": {
        "bed": {"kind": "solid", "youngs_modulus": 1e5, "poisson_ratio": 0.3,
                "mesh": {"generate": "box", "size": [0.1, 0.1, 0.04], "cells": [4, 4, 2], "element": "H8"},
                "hold": [{"set": "z_min"}]},
        "die": {"kind": "rigid", "shape": {"generate": "box", "size": [0.04, 0.04, 0.02]}, "mass": 0.1,
                "start": {"place": [0, 0, 0.0305]},
                "drive": {"z": [[0, 0], [0.2, -0.002]]}}},
    "contact": [{"between": ["die", "bed"], "friction": 0.3}],
    "time": {"kind": "quasi_static", "step": 0.005, "end": 0.2},
    "output": {"picture": False, "plots": False},
    "haptic": {"handle": "die", "simulation_rate": 50}}


class View(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        read, write = os.pipe()
        cls.server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", "1100x800x24", "-nolisten", "tcp"],
            pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as number:
            cls.display = ":" + number.readline().strip()

    @classmethod
    def tearDownClass(cls):
        cls.server.terminate()
        cls.server.wait()

    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)
        (self.folder / "scene.json").write_text(json.dumps(SCENE))

    def tearDown(self):
        self.temporary.cleanup()

    def start(self, *arguments, display=None):
        environment = dict(os.environ, DISPLAY=self.display if display is None else display)
        return subprocess.Popen([PROGRAM, *arguments, "--json"], cwd=self.folder, env=environment,
                                text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE)

    def call(self, *arguments, lines="", code=0, **options):
        process = self.start(*arguments, **options)
        out, errors = process.communicate(lines, timeout=120)
        self.assertEqual(process.returncode, code, errors)
        return json.loads(out), errors

    def test_a_run_is_shown_and_its_result_is_the_same(self):
        plain, _ = self.call("run", "scene.json", "--output", "plain")
        shown, _ = self.call("run", "scene.json", "--output", "shown", "--view")
        self.assertGreaterEqual(shown["view"]["frames"], 1) # up to 40 a second: a short run may show one
        self.assertNotIn("view", plain)
        self.assertEqual(plain["quantities"], shown["quantities"])

    def test_without_a_display_nothing_is_begun(self):
        answer, _ = self.call("run", "scene.json", "--output", "out", "--view", display="", code=2)
        self.assertIn("display", answer["issues"][0]["found"])
        self.assertFalse((self.folder / "out").exists())

    def test_a_closed_window_does_not_end_the_run(self):
        process = self.start("run", "scene.json", "--output", "out", "--view", "--set",
                             "time.step=0.0005")
        children = pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children")
        windows = []
        while process.poll() is None and not windows:
            windows = [int(p) for p in children.read_text().split()]
            time.sleep(0.01)
        self.assertTrue(windows, "no window was opened")
        os.kill(windows[0], signal.SIGKILL)
        out, errors = process.communicate(timeout=120)
        if process.returncode == 2: # killed before it was there
            self.assertIn("its process has failed", out)
            self.skipTest("the window was closed before it was there")
        self.assertEqual(process.returncode, 0, errors)
        self.assertEqual(json.loads(out)["status"], "done")

    def test_values_are_changed_between_steps(self):
        soft, _ = self.call("run", "scene.json", "--output", "soft")
        stiff, output = self.call(
            "run", "scene.json", "--output", "stiff", "--view",
            lines="set bodies.bed.youngs_modulus=2e5\nhello\nset bodies.bod.density=1\n"
                  "set bodies.bed.mesh.cells=[2,2,2]\n")
        for words in ["set bodies.bed.youngs_modulus=2e5", "hello", "bod", "not set"]:
            self.assertIn(words, output)
        forces = {k: v for k, v in soft["quantities"].items() if k.endswith("force_z")}
        self.assertTrue(forces)
        for key, value in forces.items(): # elastic forces follow E; the other lines change nothing
            self.assertAlmostEqual(stiff["quantities"][key] / value, 2, places=4, msg=key)

    def test_haptic(self):
        soft, _ = self.call("haptic", "scene.json", "--virtual-time", "--duration", "0.2")
        stiff, output = self.call("haptic", "scene.json", "--virtual-time", "--duration", "0.2",
                                "--view", lines="set bodies.bed.youngs_modulus=4e5\n")
        self.assertIn("set bodies.bed.youngs_modulus=4e5", output)
        self.assertGreaterEqual(stiff["view"]["frames"], 1)
        self.assertNotIn("view", soft)

    def test_a_change_that_needs_new_factors_is_made_beside(self):
        # A finer bed, whose factor takes longer than an operator may age.
        scene = json.loads(json.dumps(SCENE))
        scene["bodies"]["bed"]["mesh"]["cells"] = [18, 18, 8]
        scene["haptic"]["simulation_rate"] = 20
        (self.folder / "scene.json").write_text(json.dumps(scene))
        process = self.start("haptic", "scene.json", "--duration", "600", "--view")
        output = []
        def wait_for(words):
            for line in process.stderr:
                output.append(line)
                if words in line:
                    return
            self.fail("".join(output))
        process.stdin.write("set bodies.bed.youngs_modulus=4e5\n")
        process.stdin.flush()
        wait_for("set bodies.bed.youngs_modulus=4e5")
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        out = process.communicate(timeout=60)[0]
        report = json.loads(out)
        self.assertNotIn("stale operator", "".join(output))
        self.assertEqual(report["ticks_in"]["stale operator"], 0)


if __name__ == "__main__":
    if not shutil.which("Xvfb"):
        print("skipped: no Xvfb (xvfb)")
        sys.exit(77)  # CTest's SKIP_RETURN_CODE
    reported_skips.main(argv=[sys.argv[0]])
