#!/usr/bin/env python3
"""The recipes are followed as they stand: their files are written, their commands run.

recipes_test.py PROGRAM [--whole]

Without --whole, only what takes no time: meshes, surfaces and `check` of every scene.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import reported_skips

PROGRAM = pathlib.Path(sys.argv[1]).resolve()
WHOLE = "--whole" in sys.argv
ROOT = pathlib.Path(__file__).resolve().parents[2]
BLOCK = re.compile(r"```(\w*)\n(.*?)```", re.S)
QUICK = ("mkdir", "cd ", "amontons mesh", "amontons check")


def blocks(page):
    """(language, text, what stands before) of each block of code."""
    before = 0
    for m in BLOCK.finditer(page):
        yield m[1], m[2], page[before:m.start()]
        before = m.end()


class Recipes(unittest.TestCase):
    def follow(self, name, skip=()):
        page = (ROOT / f"docs/recipes/{name}.md").read_text()
        folder = pathlib.Path(tempfile.mkdtemp(prefix="amontons_"))
        self.addCleanup(shutil.rmtree, folder, ignore_errors=True)
        (folder / "bin").mkdir()
        (folder / "bin/amontons").symlink_to(PROGRAM)
        environment = {**os.environ, "AMONTONS": str(ROOT), "PATH": f"{folder / 'bin'}:{os.environ['PATH']}"}
        done = []
        for language, text, before in blocks(page):
            if language in ("json", "markdown", "python"):
                file = re.findall(r"`([\w.]+\.(?:json|md|py))`", before)[-1]
                (folder / file).write_text(text)
                continue
            commands = text.replace("\\\n", " ").splitlines()
            if not commands[0].startswith(("amontons", "mkdir")):
                continue  # what a command prints, a file
            for command in commands:
                quick = command.startswith(QUICK) or "--output start" in command
                if any(word in command for word in skip) or not (WHOLE or quick):
                    continue
                if command.startswith("mkdir"):
                    command, change = command.split(" && cd ")
                    folder = folder / change
                    subprocess.run(command, shell=True, cwd=folder.parent, check=True)
                    continue
                result = subprocess.run(command, shell=True, cwd=folder, env=environment, capture_output=True, text=True, timeout=900)
                self.assertEqual(result.returncode, 0, f"{name}: {command}\n{result.stdout[-2000:]}{result.stderr}")
                done.append((command, result.stdout))
        return folder, done

    def test_your_vessel(self):
        folder, done = self.follow("vessel")
        checked = next(out for command, out in done if command.startswith("amontons check"))
        self.assertIn("free space inside", checked)
        self.assertIn("4 holes", checked)
        if WHOLE:
            self.assertIn("subclavian", (folder / "branches/study.csv").read_text())

    def test_your_device_and_mesh(self):
        no_module = not list((PROGRAM.parent / "../lib/amontons").glob("libamontons-cgal.so"))
        self.follow("device", ("udp:",) + (("tetrahedralise", "filled.msh") if no_module else ()))

    def test_your_benchmark(self):
        def has(module):
            return subprocess.run([sys.executable, "-c", f"import {module}"], capture_output=True).returncode == 0

        page = (ROOT / "docs/new_solver.md").read_text()
        with_solver = has("h5py") and list((PROGRAM.parent / "../lib/amontons").glob("libamontons-fclib.so"))
        original = subprocess.run

        # my_solver.py is that of its own page, README.md any paragraph.
        def run(command, *a, **b):
            result = original(command, *a, **b)
            if isinstance(command, str) and command.startswith("mkdir"):
                there = pathlib.Path(b["cwd"]) / "braking"
                (there / "README.md").write_text("A block that slides on a plane and comes to rest.\n")
                (there / "my_solver.py").write_text(page.split("```python\n", 1)[1].split("```", 1)[0])
            return result

        subprocess.run = run
        try:
            self.follow("benchmark", () if with_solver else ("my_solver",))
        finally:
            subprocess.run = original

    def test_how_to_add_names_files_that_exist_and_what_stands_in_them(self):
        page = (ROOT / "docs/how_to_add.md").read_text()
        file = r"`((?:mesh|contact|solver|haptics|validation|docs)/[\w./]+)`"
        named = re.findall(file, page)
        self.assertGreater(len(named), 30)
        self.assertEqual([name for name in named if not (ROOT / name).exists()], [])
        words = re.findall(file + r"(?: as they are| alone)?\s+\(((?:`[^`]+`[, .]*)+)\)", page)
        self.assertGreater(len(words), 10)
        for name, inside in words:
            text = (ROOT / name).read_text()
            for word in re.findall(r"`([^`]+)`", inside):
                if not (ROOT / word).exists():
                    self.assertIn(word, text, name)


if __name__ == "__main__":
    reported_skips.main(argv=[sys.argv[0]])
