#!/usr/bin/env python3
"""tetrahedralise_test.py AMONTONS: amontons mesh tetrahedralise, from outside."""
import json
import math
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import unittest

import reported_skips

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

    def call(self, *words, code=0, addresses=None):
        """addresses: the most that the program may take [bytes]"""
        # OpenBLAS waits for ever for a second thread that has no room.
        environment = os.environ | ({"OPENBLAS_NUM_THREADS": "1"} if addresses else {})
        limits = (addresses, resource.getrlimit(resource.RLIMIT_AS)[1])
        done = subprocess.run([PROGRAM, "mesh", *words], capture_output=True, text=True,
                              cwd=self.folder.name, timeout=600, env=environment,
                              preexec_fn=lambda: addresses and
                              resource.setrlimit(resource.RLIMIT_AS, limits))
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
        return made, info

    def refused(self, name, *words, **how):
        self.path("out.msh").unlink(missing_ok=True)
        reported = self.call("tetrahedralise", name, "out.msh", *words, code=2, **how).stderr
        self.assertFalse(self.path("out.msh").exists())
        return reported

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
        one, metres = self.mesh(self.write("a.obj", points, faces), "--size", "0.3")
        other, info = self.mesh("a.obj", "--size", "0.3", "--scale", "0.001")
        self.assertLess(abs(other["nodes"] / one["nodes"] - 1), 0.02)
        self.assertLess(abs(info["volume"] / metres["volume"] / 1e-9 - 1), 0.01)

    def test_local_sizes_are_followed(self):
        even, _ = self.mesh(self.write("cube.obj", *CUBE), "--size", "0.25")
        fine, _ = self.mesh("cube.obj", "--size", "0.25", "--size-at", "0,0,0,0.02")
        self.assertGreater(fine["elements"]["T10"], 1.5 * even["elements"]["T10"])
        self.assertLess(fine["quality"]["shortest_edge"], 0.03)
        self.path("field.csv").write_text("x,y,z,size\n0,0,0,0.02\n1,1,1,0.2\n")
        read, _ = self.mesh("cube.obj", "--size", "0.25", "--size-field", "field.csv")
        self.assertLess(read["quality"]["shortest_edge"], 0.03)
        # One row, and the finer of two at one place.
        self.path("field.csv").write_text("x,y,z,size\n0,0,0,0.2\n0,0,0,0.02\n")
        both, _ = self.mesh("cube.obj", "--size", "0.25", "--size-field", "field.csv")
        self.path("field.csv").write_text("x,y,z,size\n0,0,0,0.02\n")
        one, _ = self.mesh("cube.obj", "--size", "0.25", "--size-field", "field.csv")
        self.assertEqual(both["elements"], one["elements"])
        self.assertEqual(one["elements"], fine["elements"])

    def test_small_defects_are_repaired_and_reported(self):
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
        self.assertIn("does not touch itself",
                      self.refused(self.write("b.obj", both, faces + [tuple(i + 8 for i in f)
                                                                      for f in faces]),
                                   "--size", "0.2"))
        flat = [(x, y, 0.05 * z) for x, y, z in points]
        reported = self.refused(self.write("c.obj", flat, faces), "--size", "0.1")
        self.assertIn("a wall of 0.05 m", reported)
        made, _ = self.mesh("c.obj", "--size", "0.1", "--small-features", "refine",
                            "--gradation", "1")
        self.assertIn("refined", "\n".join(made["notes"]))
        self.write("cube.obj", *CUBE)
        self.assertIn("--size: found -4,",
                      self.refused("cube.obj", "--size=-4", "--scale", "0.001"))
        self.assertIn("a local size: found 0,",
                      self.refused("cube.obj", "--size", "1", "--size-at", "0,0,0,0"))
        self.assertIn("no such file", self.refused("none.stl", "--size", "1"))
        # The name of the mesh is examined before anything is read.
        self.assertIn('found suffix ".xyz"',
                      self.call("tetrahedralise", "none.stl", "out.xyz", "--size", "1",
                                code=2).stderr)
        # What was repaired is reported even where that is not enough.
        reported = self.refused(self.write("d.obj", points, faces[:-1] + [(0, 0, 1)]), "--size", "0.2")
        self.assertIn("1 triangle with a vertex twice", reported)

    def test_elements_and_memory_are_predicted_and_limited(self):
        self.write("cube.obj", *CUBE)
        made, _ = self.mesh("cube.obj", "--size", "0.05")
        self.assertLess(abs(math.log(made["predicted"]["elements"] / made["elements"]["T10"])),
                        math.log(1.25))
        # Rather more than is needed, but no other order of magnitude. Sanitizers keep what is freed.
        if b"__asan_init" not in pathlib.Path(PROGRAM).read_bytes():
            self.assertLess(made["peak_memory"], 1.1 * made["predicted"]["memory"])
            self.assertLess(made["predicted"]["memory"], 3 * made["peak_memory"])
        reported = self.refused("cube.obj", "--size", "0.02", "--memory", "0.1")
        self.assertIn("memory predicted", reported)
        self.assertIn("1e+08 bytes (--memory)", reported)
        self.assertIn("5e+07 elements",
                      self.refused("cube.obj", "--size", "0.005", "--memory", "1e6"))

    def test_lack_of_memory_and_refining_without_end_are_no_mistakes_of_the_program(self):
        self.write("cube.obj", *CUBE)
        for limit in range(1 << 27, 1 << 32, 1 << 24):  # until a small mesh can be made
            try:
                self.call("tetrahedralise", "cube.obj", "small.msh", "--size", "1",
                          addresses=limit)
                break
            except AssertionError:
                pass
        else:
            self.skipTest("sanitizers take all addresses")
        reported = self.refused("cube.obj", "--size", "0.025", addresses=limit + (1 << 24))
        self.assertIn("more memory was needed than predicted", reported)
        # A surface of 20 facets all around, followed to a millionth.
        self.write("torus.obj", *torus(1, 0.4, 20, 20))
        reported = self.refused("torus.obj", "--size", "0.5", "--deviation", "1e-6")
        self.assertIn("refines without end", reported)

    def test_edges_are_kept_above_the_angle_and_surfaces_within_the_deviation(self):
        n = 10  # sides at 36 degrees to each other
        ring = [(math.cos(2 * math.pi * i / n), math.sin(2 * math.pi * i / n)) for i in range(n)]
        points = [(x, y, z) for z in (0, 1) for x, y in ring] + [(0, 0, 0), (0, 0, 1)]
        faces = []
        for i in range(n):
            j = (i + 1) % n
            faces += [(i, j, n + j), (i, n + j, n + i), (j, i, 2 * n), (n + i, n + j, 2 * n + 1)]
        self.write("prism.obj", points, faces)
        volume = 0.5 * n * math.sin(2 * math.pi / n)
        made, info = self.mesh("prism.obj", "--size", "0.4")
        self.assertEqual(made["face_sets"], 1 + 3)
        self.assertLess(made["face_deviation"], 4 * 0.4 / 20)
        made, info = self.mesh("prism.obj", "--size", "0.4", "--feature-angle", "30")
        self.assertEqual(made["face_sets"], 1 + n + 2)
        self.assertAlmostEqual(info["volume"], volume, places=12)
        # Between corners a kept edge is followed by the size alone: that is seen, and stated.
        reported = self.refused("prism.obj", "--size", "0.4", "--deviation", "0.005")
        self.assertIn("a vertex of the surface 0.05", reported)
        self.assertIn("--feature-angle", reported)
        self.write("torus.obj", *torus(1, 0.4, 96, 48))
        for deviation in (0.02, 0.004):
            made, info = self.mesh("torus.obj", "--size", "0.5", "--deviation", str(deviation))
            self.assertLess(made["face_deviation"], 2 * deviation)
            self.assertLess(abs(info["volume"] - 2 * math.pi ** 2 * 0.16),
                            4 * math.pi ** 2 * 0.4 * deviation)

    def test_a_cavity_is_one_however_it_is_drawn(self):
        points, faces = CUBE
        both = points + [(0.25 + 0.5 * x, 0.25 + 0.5 * y, 0.25 + 0.5 * z) for x, y, z in points]
        self.write("in.obj", both, faces + [(a + 8, c + 8, b + 8) for a, b, c in faces])
        self.write("out.obj", both, faces + [(a + 8, b + 8, c + 8) for a, b, c in faces])
        for name, notes in (("in.obj", 0), ("out.obj", 1)):
            made, info = self.mesh(name, "--size", "0.2")
            self.assertAlmostEqual(info["volume"], 0.875, places=12)
            self.assertEqual(len(made["notes"]), notes)
        near = points + [(0.02 + 0.96 * x, 0.02 + 0.96 * y, 0.02 + 0.96 * z) for x, y, z in points]
        self.write("thin.obj", near, faces + [(a + 8, b + 8, c + 8) for a, b, c in faces])
        self.assertIn("a wall of 0.0", self.refused("thin.obj", "--size", "0.1"))

    def test_a_surface_that_folds_back_is_rounded_on_request_and_that_is_reported(self):
        # A box with a fin like a knife, 0.1 wide at its foot and 0.6 high.
        section = [(0, 0), (1, 0), (1, 1), (0.55, 1), (0.5, 1.6), (0.45, 1), (0, 1)]
        n = len(section)
        points = [(x, y, z) for y in (0, 1) for x, z in section]
        cap = [(0, 1, 2), (0, 2, 3), (0, 3, 5), (3, 4, 5), (0, 5, 6)]
        faces = cap + [(a + n, c + n, b + n) for a, b, c in cap]
        for i in range(n):
            j = (i + 1) % n
            faces += [(i, i + n, j), (j, i + n, j + n)]
        self.write("knife.obj", points, faces)
        width = 0.05
        made, info = self.mesh("knife.obj", "--size", "0.25", "--repair", str(width),
                               "--small-features", "refine", "--gradation", "1")
        self.assertEqual(info["surface"]["euler_characteristic"], 2)
        # What is thinner than 0.8 to 1.1 widths is lost, edges lose less than a width^2 / 2.
        tip = [(0.6 * f * width / 0.1, 0.05 * f * f * width / 0.1 * 0.6 * width / 0.1)
               for f in (0.8, 1.1)]
        self.assertGreater(made["deviation"], tip[0][0] - 0.02)
        self.assertLess(made["deviation"], tip[1][0] + 0.02)
        self.assertLess(info["volume"], 1.03 - 0.5 * tip[0][1])
        self.assertGreater(info["volume"], 1.03 - tip[1][1] - 0.5 * 20 * width ** 2)
        text = "\n".join(made["notes"])
        self.assertRegex(text, r"the surface given left by more than 1.5 times that at [2-4] places")
        self.assertRegex(text, r"at \(0\.\d+, [01]\.?\d*, 1\.6\)")
        self.assertEqual(made["feature_edges"], 0)
        self.assertIn("--repair: found -1,",
                      self.refused("knife.obj", "--size", "0.25", "--repair=-1"))

    def test_parts_that_overlap_are_one_on_request(self):
        points, faces = CUBE
        both = points + [(x + 0.5, y + 0.4, z + 0.3) for x, y, z in points]
        for name, turned in (("same.obj", False), ("other.obj", True)):
            second = [tuple(i + 8 for i in (f[::-1] if turned else f)) for f in faces]
            self.write(name, both, faces + second)
            self.assertIn("--repair WIDTH", self.refused(name, "--size", "0.2"))
            made, info = self.mesh(name, "--size", "0.2", "--repair", "0.03")
            self.assertEqual(info["surface"]["euler_characteristic"], 2)
            # 20 edges of length 1 lose less than the width's square each.
            self.assertLess(info["volume"], 2 - 0.5 * 0.6 * 0.7 + 0.001)
            self.assertGreater(info["volume"], 2 - 0.5 * 0.6 * 0.7 - 20 * 0.03 ** 2)
            self.assertIn("the surface given left by more than 1.5 times that", "\n".join(made["notes"]))
            self.assertGreater(made["deviation"], 0.2)  # the corner within the other

    def test_a_tube_that_passes_through_itself_becomes_a_ring(self):
        # A helix of one turn and a half, its turns nearer than the tube is wide.
        R, r, pitch, n, m = 1, 0.3, 0.23, 90, 24
        points, faces = [], []
        for i in range(n + 1):
            angle = 3 * math.pi * i / n
            c, s = math.cos(angle), math.sin(angle)
            points += [((R + r * math.cos(2 * math.pi * j / m)) * c,
                        (R + r * math.cos(2 * math.pi * j / m)) * s,
                        pitch * angle / (2 * math.pi) + r * math.sin(2 * math.pi * j / m))
                       for j in range(m)]
        for i in range(n):
            for j in range(m):
                a, b, k = i * m + j, i * m + (j + 1) % m, m
                faces += [(a, a + k, b), (b, a + k, b + k)]
        for end, sign in ((0, 1), (n, -1)):
            ring = [end * m + j for j in range(m)]
            faces += [(ring[0], ring[j], ring[j + 1])[::sign] for j in range(1, m - 1)]
        self.write("helix.obj", points, faces)
        self.refused("helix.obj", "--size", "0.25")
        width = 0.05
        made, info = self.mesh("helix.obj", "--size", "0.25", "--repair", str(width),
                               "--deviation", "0.008")
        self.assertEqual(info["surface"]["euler_characteristic"], 0)
        # Two discs that overlap, as high above each other as the turns: their lens is counted once.
        area = m / 2 * r * r * math.sin(2 * math.pi / m)
        d = pitch
        lens = 2 * r * r * math.acos(d / (2 * r)) - d / 2 * math.sqrt(4 * r * r - d * d)
        volume = 3 * math.pi * R * area - math.pi * R * lens
        self.assertLess(abs(info["volume"] / volume - 1), 0.03)

    def test_a_rounded_solid_is_not_sampled_beyond_the_memory(self):
        self.write("cube.obj", *CUBE)
        reported = self.refused("cube.obj", "--size", "0.2", "--repair", "1e-4", "--memory", "1")
        self.assertIn("memory predicted", reported)
        self.assertIn("--repair", reported)
        self.assertIn("nothing is left", self.refused("cube.obj", "--size", "3", "--repair", "2"))

    @unittest.skipUnless("AMONTONS_VESSEL" in os.environ, "no surface of a patient's vessel")
    def test_a_patients_vessel(self):
        """AMONTONS_VESSEL: the .obj, in millimetres; lumen of a few millimetres and more."""
        shutil.copy(os.environ["AMONTONS_VESSEL"], self.path("vessel.obj"))
        made, info = self.mesh("vessel.obj", "--scale", "0.001", "--size", "4", "--repair", "1",
                               "--close-holes", "--small-features", "refine")
        self.assertIn("rounded at a width of 0.001 m", "\n".join(made["notes"]))
        self.assertLess(made["face_deviation"], 1e-3)  # what was filled


if __name__ == "__main__":
    reported_skips.main()
