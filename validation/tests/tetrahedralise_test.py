#!/usr/bin/env python3
"""tetrahedralise_test.py AMONTONS: amontons mesh tetrahedralise, from outside."""
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

PROGRAM = str(pathlib.Path(sys.argv.pop(1)).resolve())


def obj(points, faces):
    return "".join("v %.17g %.17g %.17g\n" % tuple(p) for p in points) + "".join(
        "f " + " ".join(str(i + 1) for i in f) + "\n" for f in faces)


CUBE = ([(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
        [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7), (0, 3, 5), (0, 5, 4), (3, 2, 6), (3, 6, 5),
         (2, 1, 7), (2, 7, 6), (1, 0, 4), (1, 4, 7)])


def torus(R, r, n, m):
    points = [((R + r * math.cos(2 * math.pi * j / m)) * math.cos(2 * math.pi * i / n),
               (R + r * math.cos(2 * math.pi * j / m)) * math.sin(2 * math.pi * i / n),
               r * math.sin(2 * math.pi * j / m)) for i in range(n) for j in range(m)]
    faces = []
    for i in range(n):
        for j in range(m):
            a, b = i * m + j, (i + 1) % n * m + j
            c, d = (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
            faces += [(a, b, c), (a, c, d)]
    return points, faces


class Tetrahedralise(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return pathlib.Path(self.folder.name) / name

    def write(self, name, points, faces):
        self.path(name).write_text(obj(points, faces))
        return name

    def call(self, *words, code=0):
        done = subprocess.run([PROGRAM, "mesh", *words], capture_output=True, text=True,
                              cwd=self.folder.name)
        self.assertEqual(done.returncode, code, done.stderr)
        return done

    def mesh(self, name, *words):
        made = json.loads(self.call("tetrahedralise", name, "out.msh", *words, "--json").stdout)
        info = json.loads(self.call("info", "out.msh", "--json").stdout)
        self.assertEqual((made["status"], info["status"]), ("done", "ok"))
        self.assertEqual(info["quality"]["inverted"], 0)
        self.assertEqual(info["warnings"], [])
        self.assertTrue(info["surface"]["closed"])
        degrees = math.degrees(made["quality"]["least_dihedral"])
        self.assertAlmostEqual(info["quality"]["least_dihedral"]["least"],
                               made["quality"]["least_dihedral"], places=12)
        self.assertGreater(degrees, 8)
        # What refuses a mesh that is too large may not be far off: within a factor of 3.
        count = sum(made["elements"].values())
        self.assertLess(abs(math.log(made["predicted"]["elements"] / count)), math.log(3))
        return made, info

    def refused(self, name, *words):
        return self.call("tetrahedralise", name, "out.msh", *words, code=2).stderr

    def test_a_cube_keeps_its_edges_corners_and_faces(self):
        made, info = self.mesh(self.write("cube.obj", *CUBE), "--size", "0.2")
        self.assertAlmostEqual(info["volume"], 1, places=12)
        self.assertAlmostEqual(info["surface"]["area"], 6, places=12)
        self.assertEqual(info["surface"]["euler_characteristic"], 2)
        areas = {s["name"]: s["area"] for s in info["face_sets"]}
        self.assertAlmostEqual(areas.pop("outer"), 6, places=12)
        self.assertEqual(sorted(areas), ["face_%d" % i for i in range(1, 7)])
        for area in areas.values():
            self.assertAlmostEqual(area, 1, places=12)
        self.assertEqual(list(made["elements"]), ["T10"])
        self.assertEqual(made["notes"], [])
        # The same file, the same mesh.
        first = self.path("out.msh").read_bytes()
        self.mesh("cube.obj", "--size", "0.2")
        self.assertEqual(first, self.path("out.msh").read_bytes())

    def test_a_sphere_and_a_torus_keep_volume_and_topology(self):
        self.call("generate", "ball", "--radius", "1", "--element", "H8", "--cells", "24", "-o",
                  "ball.msh")
        self.call("surface", "ball.msh", "-o", "ball.stl")
        ball = json.loads(self.call("info", "ball.msh", "--json").stdout)
        _, info = self.mesh("ball.stl", "--size", "0.25", "--element", "T4")
        # No triangle is farther from the surface than a twentieth of the size.
        self.assertLess(abs(info["volume"] - ball["volume"]),
                        ball["surface"]["area"] * 0.25 / 20)
        self.assertEqual(info["surface"]["euler_characteristic"], 2)
        _, info = self.mesh(self.write("torus.obj", *torus(1, 0.4, 96, 48)), "--size", "0.2")
        self.assertLess(abs(info["volume"] - 2 * math.pi ** 2 * 0.16),
                        4 * math.pi ** 2 * 0.4 * 0.2 / 20)
        self.assertEqual(info["surface"]["euler_characteristic"], 0)

    def test_millimetres_give_the_same_mesh(self):
        points, faces = torus(1, 0.4, 48, 24)
        one, _ = self.mesh(self.write("a.obj", points, faces), "--size", "0.3")
        other, info = self.mesh("a.obj", "--size", "0.3", "--scale", "0.001")
        self.assertLess(abs(other["nodes"] / one["nodes"] - 1), 0.02)
        self.assertLess(info["volume"], 1e-8)

    def test_local_sizes_are_followed(self):
        even, _ = self.mesh(self.write("cube.obj", *CUBE), "--size", "0.25")
        fine, _ = self.mesh("cube.obj", "--size", "0.25", "--size-at", "0,0,0,0.02")
        self.assertGreater(fine["elements"]["T10"], 1.5 * even["elements"]["T10"])
        self.assertLess(fine["quality"]["shortest_edge"], 0.03)
        self.path("field.csv").write_text("x,y,z,size\n0,0,0,0.02\n1,1,1,0.2\n")
        read, _ = self.mesh("cube.obj", "--size", "0.25", "--size-field", "field.csv")
        self.assertLess(read["quality"]["shortest_edge"], 0.03)

    def test_small_defects_are_repaired_and_said(self):
        points, faces = list(CUBE[0]), list(CUBE[1])
        points.append(points[6])            # a second vertex at the same place
        faces[3] = (4, 8, 7)
        faces[2] = (5, 4, 6)                # the other way around
        faces.append((0, 0, 1))             # collapsed
        made, info = self.mesh(self.write("a.obj", points, faces), "--size", "0.3")
        self.assertAlmostEqual(info["volume"], 1, places=12)
        text = "\n".join(made["notes"])
        for words in ("1 vertex merged", "1 triangle turned", "1 triangle with a vertex twice"):
            self.assertIn("repaired: " + words, text)

    def test_what_cannot_be_meshed_is_refused_with_its_place(self):
        points, faces = CUBE
        self.assertIn("hole around", self.refused(self.write("a.obj", points, faces[:-1]),
                                                  "--size", "0.2"))
        self.assertIn("--close-holes", self.refused("a.obj", "--size", "0.2"))
        made, info = self.mesh("a.obj", "--size", "0.3", "--close-holes")
        self.assertAlmostEqual(info["volume"], 1, places=12)
        self.assertIn("1 hole closed", "\n".join(made["notes"]))
        both = points + [(x + 0.5, y + 0.5, z + 0.5) for x, y, z in points]
        self.assertIn("does not meet itself",
                      self.refused(self.write("b.obj", both, faces + [tuple(i + 8 for i in f)
                                                                      for f in faces]),
                                   "--size", "0.2"))
        flat = [(x, y, 0.05 * z) for x, y, z in points]
        told = self.refused(self.write("c.obj", flat, faces), "--size", "0.1")
        self.assertIn("a wall of 0.05 m", told)
        made, _ = self.mesh("c.obj", "--size", "0.1", "--small-features", "refine",
                            "--gradation", "1")
        self.assertIn("refined", "\n".join(made["notes"]))
        self.write("cube.obj", *CUBE)
        told = self.refused("cube.obj", "--size", "0.0005")
        self.assertIn("memory predicted", told)
        self.assertIn("--size: found -1", self.refused("cube.obj", "--size", "-1"))
        self.assertIn("no such file", self.refused("none.stl", "--size", "1"))
        self.assertFalse(self.path("none.msh").exists())


if __name__ == "__main__":
    unittest.main()
