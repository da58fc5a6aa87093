#!/usr/bin/env python3
"""What `check` predicts of memory, and what a run states of the modules that it has mapped.

memory_test.py PROGRAM
"""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

import reported_skips

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "validation/bench"))
import linear_way  # noqa: E402
import memory  # noqa: E402

PROGRAM = str(pathlib.Path(sys.argv[1]).resolve())
QUIET = memory.QUIET


class Memory(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def check(self, file, *more):
        return json.loads(subprocess.run([PROGRAM, "check", file, "--json", *more], capture_output=True, text=True, check=True,
                                         env=memory.ENVIRONMENT).stdout)

    def run_whole(self, file, *more):
        out = self.folder / "out"
        run = subprocess.Popen([PROGRAM, "run", file, "--output", out, "--quiet", *QUIET, *more], stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL, env=memory.ENVIRONMENT)
        mapped = set()
        while run.poll() is None:
            try:
                maps = pathlib.Path(f"/proc/{run.pid}/maps").read_text()
            except OSError:
                break
            mapped |= set(re.findall(r"/libamontons-(\w+)\.so", maps))
            time.sleep(0.005)
        run.wait()
        return json.loads((out / "manifest.json").read_text()), mapped

    def test_memory_is_predicted_within_30_percent(self):
        scenes = [(ROOT / "examples/catheter/scene.json", [])]
        own = dict(linear_way.SCENES)
        for name in ("pressed T4 6e3", "pressed H8 1e4", "ball H8 1e4", "bent H8 15e3"):
            file = self.folder / f"{name.replace(' ', '_')}.json"
            file.write_text(json.dumps(own[name]))
            scenes.append((file, ["--set", "solver.linear=direct"]))
        for count in (27, 300):
            file = self.folder / f"pile_{count}.json"
            file.write_text(json.dumps(memory.pile(count)))
            scenes.append((file, []))
        for file, more in scenes:
            predicted = self.check(file, *more)["predicted"]["memory"]
            manifest, _ = self.run_whole(file, *more)
            self.assertEqual(manifest["status"], "done", file)
            ratio = predicted / manifest["peak_memory"]
            self.assertTrue(0.7 <= ratio <= 1.3, f"{file.name}: {predicted / 1e6:.0f} MB predicted, "
                                                 f"{manifest['peak_memory'] / 1e6:.0f} MB taken")

    def test_the_picture_is_listed_separately(self):
        plan = self.check(ROOT / "examples/first_block/scene.json")
        if (pathlib.Path(PROGRAM).parent / "../lib/amontons/libamontons-vtk.so").exists():
            self.assertGreater(plan["predicted"]["picture_memory"], 1e8)
        without = self.check(ROOT / "examples/first_block/scene.json", "--set", "output.picture=false")
        self.assertEqual(without["predicted"]["picture_memory"], 0)
        self.assertEqual(without["predicted"]["memory"], plan["predicted"]["memory"])

    def test_a_picture_takes_less_than_400_MB(self):
        if not (pathlib.Path(PROGRAM).parent / "../lib/amontons/libamontons-vtk.so").exists():
            self.skipTest(reported_skips.LACKS + "VTK")
        if not (shutil.which("Xvfb") or os.environ.get("DISPLAY")):
            self.skipTest(reported_skips.LACKS + "Xvfb")
        for name, end in (("catheter", 2), ("first_block", None)): # a tall page and a medium one
            file = ROOT / f"examples/{name}/scene.json"
            self.run_whole(file, *(["--set", f"time.end={end}"] if end else []))
            drawing = subprocess.Popen([PROGRAM, "render", self.folder / "out", "-o", self.folder / "picture.png"],
                                       stdout=subprocess.DEVNULL, env=memory.ENVIRONMENT)
            _, code, use = os.wait4(drawing.pid, 0)
            drawing.returncode = os.waitstatus_to_exitcode(code)
            self.assertEqual(drawing.returncode, 0, name)
            peak = use.ru_maxrss * 1024
            self.assertLess(peak, 400e6, name)
            predicted = self.check(file)["predicted"]["picture_memory"]
            self.assertTrue(0.7 <= predicted / peak <= 1.3, f"{name}: {predicted / 1e6:.0f} MB predicted, {peak / 1e6:.0f} MB taken")

    def test_modules_are_those_that_are_mapped(self):
        file = self.folder / "block.json"
        file.write_text(json.dumps(dict(linear_way.SCENES)["pressed T4 1e3"]))
        manifest, mapped = self.run_whole(file)
        self.assertEqual(set(manifest["modules"]), mapped)
        self.assertEqual(manifest["linear"]["taken"], "direct")
        self.assertGreater(manifest["linear"]["seconds"], 0)
        if (pathlib.Path(PROGRAM).parent / "../lib/amontons/libamontons-petsc.so").exists():
            manifest, mapped = self.run_whole(file, "--set", "solver.linear=iterative")
            self.assertIn("petsc", mapped)
            self.assertEqual(set(manifest["modules"]), mapped)
            self.assertEqual(manifest["linear"]["taken"], "iterative")

    def test_no_list_is_begun_that_is_empty(self):
        for file in ("lee_frame", "catheter", "first_block", "pile"):
            output = subprocess.run([PROGRAM, "check", ROOT / f"examples/{file}/scene.json"], capture_output=True, text=True,
                                  check=True, env=memory.ENVIRONMENT).stdout.splitlines()
            for heading, after in zip(output, output[1:] + ["end"]):
                if not heading.startswith(" "):
                    self.assertTrue(after.startswith("  "), f"{file}: nothing below {heading!r}")


if __name__ == "__main__":
    reported_skips.main(argv=[sys.argv[0]])
