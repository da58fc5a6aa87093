#!/usr/bin/env python3
"""mesh_command_test.py AMONTONS: amontons mesh, from outside."""
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

import reported_skips

PROGRAM = str(pathlib.Path(sys.argv.pop(1)).resolve())


class MeshCommand(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return str(pathlib.Path(self.folder.name) / name)

    def run_mesh(self, *words, code=0):
        done = subprocess.run([PROGRAM, "mesh", *words], capture_output=True, text=True,
                              cwd=self.folder.name)
        self.assertEqual(done.returncode, code, done.stderr)
        return done

    def json_of(self, *words, code=0):
        return json.loads(self.run_mesh(*words, "--json", code=code).stdout)

    def test_a_box_survives_every_format_with_its_sets(self):
        self.run_mesh("generate", "box", "--size", "1,2,0.5", "--cells", "2,4,1", "--element",
                      "T10", "--output", "a.msh")
        names = ["a.msh", "b.vtu", "c.inp", "d.nodes", "e.msh"]
        for source, target in zip(names, names[1:]):
            made = self.json_of("convert", source, "--output", target, "--binary",
                                "--msh-version", "2.2")
            self.assertEqual(made["elements"], {"T10": 48})
            info = self.json_of("info", target)
            self.assertEqual(info["status"], "ok")
            self.assertEqual(info["warnings"], [])
            self.assertAlmostEqual(info["volume"], 1, places=12)
            self.assertAlmostEqual(info["surface"]["area"], 7, places=12)
            self.assertTrue(info["surface"]["closed"])
            areas = {s["name"]: s["area"] for s in info["face_sets"]}
            self.assertEqual(sorted(areas),
                             ["x_max", "x_min", "y_max", "y_min", "z_max", "z_min"])
            self.assertAlmostEqual(areas["x_min"], 1, places=12)
            self.assertEqual([s["name"] for s in info["element_sets"]], ["volume"])

    def test_renumber_keeps_the_body_and_writes_the_permutation(self):
        self.run_mesh("generate", "ball", "--radius", "0.01", "--element", "T10", "-o", "a.vtu")
        before = self.json_of("info", "a.vtu")
        self.run_mesh("renumber", "a.vtu", "-o", "b.msh", "--permutation", "p.csv")
        after = self.json_of("info", "b.msh")
        self.assertAlmostEqual(after["volume"] / before["volume"], 1, places=12)
        self.assertLess(abs(after["volume"] / (4 / 3 * math.pi * 1e-6) - 1), 0.01)
        lines = pathlib.Path(self.path("p.csv")).read_text().splitlines()[1:]
        self.assertEqual(sorted(int(line.split(",")[1]) for line in lines),
                         list(range(after["nodes"])))

    def test_the_surface_is_closed_or_a_set_of_it(self):
        self.run_mesh("generate", "cylinder", "--radius", "1", "--length", "2", "--element", "H8",
                      "-o", "a.msh")
        whole = self.json_of("surface", "a.msh", "--output", "a.stl")
        self.assertTrue(whole["closed"])
        self.assertEqual(whole["triangles"], 2 * whole["faces"])
        part = self.json_of("surface", "a.msh", "--output", "b.ply", "--set", "start")
        self.assertFalse(part["closed"])
        self.assertLess(abs(part["area"] / math.pi - 1), 0.05)
        wrong = self.run_mesh("surface", "a.msh", "-o", "b.ply", "--set", "top", code=2)
        self.assertIn('no face set "top", allowed: ', wrong.stderr)

    def test_bad_meshes_are_reported_and_end_with_2(self):
        nodes = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
        pathlib.Path(self.path("a.nodes")).write_text(nodes)
        pathlib.Path(self.path("a.elements")).write_text("0 2 1 3\n")
        info = self.json_of("info", "a.nodes", code=2)
        self.assertEqual(info["status"], "bad_input")
        self.assertEqual(info["quality"]["inverted"], 1)
        self.assertIn("an inverted element", info["issues"][0]["found"])
        self.assertIn("element 0", self.run_mesh("info", "a.nodes", code=2).stderr)
        pathlib.Path(self.path("a.elements")).write_text("0 2 1 9\n")
        self.assertEqual(self.json_of("info", "a.nodes", code=2)["issues"][0]["place"], "element 0")
        self.assertIn("no such file", self.run_mesh("info", "b.msh", code=2).stderr)

    def test_millimetres_are_suspected_and_scaled(self):
        self.run_mesh("generate", "box", "--size", "40,40,40", "-o", "a.inp")
        self.assertIn("40 x 40 x 40 m", self.json_of("info", "a.inp")["warnings"][0]["found"])
        info = self.json_of("info", "a.inp", "--scale", "0.001")
        self.assertEqual(info["warnings"], [])
        self.assertAlmostEqual(info["volume"] / 6.4e-5, 1, places=12)

    def test_wrong_words(self):
        self.assertIn('no command "infp" (nearest: info)', self.run_mesh("infp", "a", code=2).stderr)
        self.assertIn("--output is required", self.run_mesh("convert", "a.msh", code=2).stderr)
        tube = self.run_mesh("generate", "tube", "--thickness", "-1", "--radius", "1", "--length",
                             "1", "-o", "a.msh", code=2)
        self.assertIn("amontons mesh generate tube: /thickness: found -1", tube.stderr)


if __name__ == "__main__":
    reported_skips.main()
