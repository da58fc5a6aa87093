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

    def test_info_of_a_surface_names_its_openings_and_its_side(self):
        # A tube of radius 5 along x, from 2 to 32, open at both ends, in millimetres.
        around = [(math.cos(k * math.pi / 12), math.sin(k * math.pi / 12)) for k in range(24)]
        rings = [[(x, 1 + 5 * c, 3 + 5 * s) for c, s in around] for x in (2, 12, 22, 32)]
        lines = [f"v {x:.12g} {y:.12g} {z:.12g}" for ring in rings for x, y, z in ring]
        for i in range(3):
            for k in range(24):
                a, b = 24 * i + k + 1, 24 * i + (k + 1) % 24 + 1
                lines += [f"f {a} {a + 24} {b + 24}", f"f {a} {b + 24} {b}"]
        pathlib.Path(self.path("tube.obj")).write_text("\n".join(lines) + "\n")
        info = self.json_of("info", "tube.obj", "--scale", "0.001")
        self.assertEqual((info["triangles"], info["points"], info["parts"], info["closed"]), (144, 96, 1, False))
        self.assertEqual(info["box"]["lowest"][0], 0.002)
        self.assertAlmostEqual(info["box"]["highest"][2], 0.008, places=15)
        chord = 2 * math.sin(math.pi / 24)
        self.assertAlmostEqual(info["area"] / (24 * 0.005 * chord * 0.03), 1, places=9)
        self.assertEqual(len(info["openings"]), 2)
        for opening in info["openings"]:
            end = 0.002 if opening["centre"][0] < 0.01 else 0.032
            for got, exact in zip(opening["centre"], (end, 0.001, 0.003)):
                self.assertAlmostEqual(got, exact, places=12)
            for got, exact in zip(opening["inwards"], (1 if end == 0.002 else -1, 0, 0)):
                self.assertAlmostEqual(got, exact, places=9)
            self.assertAlmostEqual(opening["radius"] / (24 * 0.005 * chord / (2 * math.pi)), 1, places=9)
        self.assertIn("2 holes", self.run_mesh("info", "tube.obj").stdout)
        # A closed one: the side, and the volume whichever it is.
        self.run_mesh("generate", "box", "--size", "1,2,3", "-o", "box.msh")
        self.run_mesh("surface", "box.msh", "-o", "box.obj")
        text = pathlib.Path(self.path("box.obj")).read_text()
        turned = "\n".join(" ".join(w[:1] + w[:0:-1]) if (w := line.split())[:1] == ["f"] else line
                           for line in text.splitlines())
        pathlib.Path(self.path("turned.obj")).write_text(turned)
        for name, facing in (("box.obj", "outwards"), ("turned.obj", "inwards")):
            info = self.json_of("info", name)
            self.assertEqual((info["closed"], info["facing"], info["openings"]), (True, facing, []))
            self.assertAlmostEqual(info["volume"], 6, places=9)

    def test_wrong_words(self):
        self.assertIn('no command "infp" (nearest: info)', self.run_mesh("infp", "a", code=2).stderr)
        self.assertIn("--output is required", self.run_mesh("convert", "a.msh", code=2).stderr)
        tube = self.run_mesh("generate", "tube", "--thickness", "-1", "--radius", "1", "--length",
                             "1", "-o", "a.msh", code=2)
        self.assertIn("amontons mesh generate tube: /thickness: found -1", tube.stderr)


if __name__ == "__main__":
    reported_skips.main()
