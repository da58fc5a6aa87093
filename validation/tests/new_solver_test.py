#!/usr/bin/env python3
"""The solver of docs/new_solver.md is run as it stands there, and judged.

new_solver_test.py PROGRAM --samples=MAKER
"""
import importlib.util
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import reported_skips

PROGRAM = str(pathlib.Path(sys.argv[1]).resolve())
MAKER = next((a.split("=", 1)[1] for a in sys.argv if a.startswith("--samples=")), "")
PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs/new_solver.md"


@unittest.skipIf(not MAKER, "lacks the module fclib")
@unittest.skipIf(importlib.util.find_spec("h5py") is None, "lacks h5py (python3-h5py)")
class NewSolver(unittest.TestCase):
    def test_the_page_s_solver_solves_and_is_certified_as_the_program_s(self):
        code = PAGE.read_text().split("```python\n", 1)[1].split("```", 1)[0]
        self.assertLessEqual(len(code.splitlines()), 50)
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            subprocess.run([MAKER, str(folder)], check=True)
            (folder / "my_solver.py").write_text(code)
            for name in ("tower", "room"):
                problem = folder / f"{name}.hdf5"
                ours = json.loads(subprocess.run([PROGRAM, "solve", problem, "--json"], capture_output=True,
                                                 text=True, check=True).stdout)
                result = subprocess.run([PROGRAM, "solve", problem, "--json", "--solver-command",
                                         f"'{sys.executable}' my_solver.py"], cwd=folder, capture_output=True, text=True)
                self.assertEqual(result.returncode, 0, result.stderr)
                theirs = json.loads(result.stdout)
                self.assertEqual((theirs["status"], theirs["contacts"]), ("converged", ours["contacts"]))
                self.assertLessEqual(theirs["error"], theirs["threshold"])
                self.assertIn("sweeps", result.stderr)

    def scene(self, folder, command, friction=0.3, max_time=60, **more):
        """An elastic block that a plane brakes, with a rigid box on it."""
        scene = {
            "schema": 1,
            "bodies": {
                "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
                "block": {"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3, "density": 1000,
                          "mesh": {"generate": "box", "element": "H8", "size": [0.1, 0.1, 0.1], "cells": [1, 1, 1]},
                          "start": {"place": [0, 0, 0.05], "velocity": [0.5, 0.2, 0]}},
                "box": {"kind": "rigid", "shape": {"generate": "box", "size": [0.05, 0.05, 0.05]}, "mass": 0.2,
                        "start": {"place": [0, 0, 0.125], "velocity": [0.5, 0.2, 0]}}},
            "contact": [{"between": ["block", "floor"], "friction": friction}, {"between": ["box", "block"], "friction": friction}],
            "gravity": [0, 0, -9.81], "accuracy": {"contact": 1e-7},
            "time": {"kind": "dynamic", "step": 0.002, "end": 0.008}, "output": {"picture": False, "plots": False}, **more}
        if command:
            scene["contact_solver"] = {"command": command, "max_time": max_time}
        (folder / "scene.json").write_text(json.dumps(scene))
        result = subprocess.run([PROGRAM, "run", "scene.json", "--json", "--output", "out", "--record"], cwd=folder,
                                capture_output=True, text=True)
        return result, json.loads(result.stdout) if result.stdout else None

    def folder(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = pathlib.Path(folder.name)
        code = PAGE.read_text().split("```python\n", 1)[1].split("```", 1)[0]
        (path / "my_solver.py").write_text(code)
        return path

    def test_a_scene_is_solved_by_the_page_s_solver_as_by_the_program_s(self):
        folder = self.folder()
        for friction in (0.3, 0):
            ours_result, ours = self.scene(folder, "", friction)
            self.assertEqual(ours_result.returncode, 0, ours_result.stderr)
            mine_result, mine = self.scene(folder, f"'{sys.executable}' my_solver.py", friction)
            self.assertEqual(mine_result.returncode, 0, mine_result.stderr)
            self.assertEqual(mine["certificate"]["uncertified_steps"], 0)
            self.assertLess(mine["certificate"]["worst_error"], 1e-7)
            for name, value in ours["quantities"].items():
                if name.startswith(("block_on_", "box_on_")) and "force" in name:
                    self.assertAlmostEqual(mine["quantities"][name], value, delta=1e-5 * 12, msg=name)
            # Steps were handed over: each is solved as the file specifies, by whoever judges it.
            for file in sorted((folder / "out/record").glob("*.hdf5")):
                judged = subprocess.run([PROGRAM, "solve", file, "--judge", "--tolerance", "1e-6", "--json"],
                                        capture_output=True, text=True)
                self.assertEqual(judged.returncode, 0, judged.stderr)

    def test_an_answer_that_is_wrong_or_none_ends_the_run_with_what_it_was(self):
        folder = self.folder()
        # Half of the right reaction.
        (folder / "half.py").write_text((folder / "my_solver.py").read_text().replace(
            'solution = file', 'r *= 0.5\n    solution = file'))
        for command, words in ((f"'{sys.executable}' half.py", "the solution of contact_solver has an error of"),
                               ("false", "ended with exit code 1"),
                               ("true", "wrote no file"),
                               ("cp", "without a reaction"),
                               ("kill -9 $$ #", "ended by signal 9"),
                               ("no_such_program", "not found")):
            result, _ = self.scene(folder, command)
            self.assertEqual(result.returncode, 3, (command, result.stderr))
            self.assertIn(words, result.stderr)
        result, _ = self.scene(folder, "sleep 60 #", max_time=0.1)
        self.assertIn("did not end within 0.1 s", result.stderr)

    def test_scenes_without_such_a_problem_are_refused(self):
        folder = self.folder()
        (folder / "rod.json").write_text(json.dumps({
            "schema": 1, "contact_solver": {"command": "true"}, "time": {"step": 1, "end": 1},
            "bodies": {"rod": {"kind": "rod", "shape": {"points": [[0, 0, 0], [1, 0, 0]]}, "hold": [{"set": "start"}],
                               "segments": [{"length": 1, "radius": 0.01, "E": 1e9, "element": 0.1}]}}}))
        result = subprocess.run([PROGRAM, "check", "rod.json"], cwd=folder, capture_output=True, text=True)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("/contact_solver", result.stderr)
        result, _ = self.scene(folder, "true", accuracy={"solver": "nsgs"})
        self.assertEqual(result.returncode, 2, result.stderr)
        result, _ = self.scene(folder, "true", solver={"linear": "iterative"})
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("contact_solver is given W", result.stderr)


if __name__ == "__main__":
    reported_skips.main(argv=[sys.argv[0]])
