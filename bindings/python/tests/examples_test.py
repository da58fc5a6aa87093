"""The programs in amontons/examples as they stand, and the examples in docstrings; what importing costs."""

import doctest
import glob
import importlib.util
import os
import pkgutil
import re
import subprocess
import sys

import amontons as am
from scenes import Case, folder, main

HERE = os.path.dirname(am.__file__)


class ExamplesTest(Case):
    def run_in_folder(self, file):
        with folder():
            result = subprocess.run([sys.executable, "-B", "-W", "error", file], capture_output=True, text=True)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def test_first(self):
        lines = self.run_in_folder(os.path.join(HERE, "examples", "1_first.py")).splitlines()
        self.assertIn("done", lines[1])
        self.assertLess(float(lines[2].split()[2]), 1e-7)

    def test_push(self):
        self.assertIn("the wall bears", self.run_in_folder(os.path.join(HERE, "examples", "2_push.py")))

    def test_block(self):
        if not am.build_info()["modules"]["fclib"].startswith("/"):
            self.skipTest("lacks the module fclib")
        lines = self.run_in_folder(os.path.join(HERE, "examples", "3_block.py")).splitlines()
        self.assertEqual(lines[0], "W 4 x 4")
        self.assertTrue(lines[1].startswith("converged"))

    def test_sweep(self):
        lines = self.run_in_folder(os.path.join(HERE, "examples", "4_sweep.py")).splitlines()
        self.assertEqual(len(lines), 17)
        forces = [float(line.split()[2]) for line in lines[:16]]
        self.assertEqual(forces, sorted(forces))  # friction requires more push

    def test_tree(self):
        lines = self.run_in_folder(os.path.join(HERE, "examples", "5_tree.py")).splitlines()
        self.assertEqual(len(lines), 4)
        self.assertGreater(len({line.split("rad: ")[1] for line in lines}), 1)

    def test_tutorials(self):
        files = sorted(glob.glob(os.path.join(HERE, "tutorials", "*.py")))
        self.assertEqual([os.path.basename(f) for f in files], ["bend.py", "hand.py", "solver.py"])
        for file in files:
            self.assertGreater(len(self.run_in_folder(file).splitlines()), 3)

    def test_train(self):
        if importlib.util.find_spec("gymnasium") is None:
            self.skipTest("lacks gymnasium")
        self.assertIn("[", self.run_in_folder(os.path.join(HERE, "examples", "6_train.py")))

    def test_pages(self):
        for page in ("README.md", "docs/python.md", "docs/gym.md"):
            with open(os.path.join(os.environ["AMONTONS_SOURCES"], page), encoding="utf-8") as stream:
                blocks = re.findall(r"^```python\n(.*?)^```", stream.read(), re.M | re.S)
            self.assertGreater(len(blocks), 0)
            for block in blocks:
                with folder() as path:
                    with open("block.py", "w", encoding="utf-8") as stream:
                        stream.write(block)
                    result = subprocess.run([sys.executable, "-B", "-W", "error", "block.py"], capture_output=True, text=True)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertIn("N", result.stdout)

    def test_every_example_has_a_test(self):
        names = {os.path.basename(f)[2:-3] for f in glob.glob(os.path.join(HERE, "examples", "*.py"))}
        self.assertEqual(names, {n[5:] for n in dir(self) if n.startswith("test_")} & names)
        self.assertGreaterEqual(len(names), 4)

    def test_examples_in_docstrings(self):
        tried = 0
        for module in pkgutil.iter_modules(am.__path__, "amontons."):
            if not module.name.endswith("_native") and not module.ispkg:
                result = doctest.testmod(importlib.import_module(module.name))
                self.assertEqual(result.failed, 0)
                tried += result.attempted
        result = doctest.testmod(am)
        self.assertEqual(result.failed, 0)
        self.assertGreater(tried + result.attempted, 20)

    def test_importing_opens_nothing_heavy(self):
        code = "import amontons; print(open('/proc/self/maps').read())"
        maps = subprocess.run([sys.executable, "-B", "-c", code], capture_output=True, text=True, check=True).stdout
        self.assertIn("_native", maps)
        for library in ("libvtk", "cholmod", "hdf5", "libCGAL", "petsc", "scipy", "matplotlib"):
            self.assertNotIn(library, maps)


if __name__ == "__main__":
    main()
