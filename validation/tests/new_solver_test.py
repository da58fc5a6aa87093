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

PROGRAM = str(pathlib.Path(sys.argv[1]).resolve())
MAKER = next((a.split("=", 1)[1] for a in sys.argv if a.startswith("--samples=")), "")
PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs/new_solver.md"


@unittest.skipIf(not MAKER, "no module fclib")
@unittest.skipIf(importlib.util.find_spec("h5py") is None, "h5py is not installed (python3-h5py)")
class NewSolver(unittest.TestCase):
    def test_the_page_s_solver_solves_and_is_judged_as_ours(self):
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


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0]])
