#!/usr/bin/env python3
"""bad_body_test.py AMONTONS: what is wrong with solids and rigid bodies, from outside: the message
names file, place, what was found and what is allowed, the exit code is 2, and nothing is written."""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import reported_skips

PROGRAM = str(pathlib.Path(sys.argv.pop(1)).resolve())
TETRAHEDRON = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
SETS = "node_set bottom\n0 1 2 3 4 5 6 7 8\nface_set top\n4 5\n5 5\n6 5\n7 5\n"


def box(cells=2, size=0.05):
    """A cube of hexahedra from the origin: nodes, elements."""
    n = cells + 1
    nodes = [[size * i / cells, size * j / cells, size * k / cells]
             for k in range(n) for j in range(n) for i in range(n)]
    corners = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    return nodes, [[i + a + n * (j + b + n * (k + c)) for a, b, c in corners]
                   for k in range(cells) for j in range(cells) for i in range(cells)]


class BadBodies(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def call(self, command, *words):
        return subprocess.run([PROGRAM, command, "a.json", "--json", *words], capture_output=True,
                              text=True, cwd=self.folder)

    def write(self, nodes, elements, sets=SETS, end="\n"):
        lines = ["\n".join(" ".join(map(str, row)) for row in rows) for rows in (nodes, elements)]
        (self.folder / "a.nodes").write_text(lines[0] + "\n")
        (self.folder / "a.elements").write_text(lines[1] + "\n" + sets.rstrip("\n") + end)

    def scene(self, change=None, **bodies):
        block = {"kind": "solid", "mesh": {"file": "a.nodes"}, "youngs_modulus": 1e6,
                 "poisson_ratio": 0.3, "hold": [{"set": "bottom"}]}
        scene = {"schema": 1, "bodies": bodies or {"block": block}, "time": {"step": 1, "end": 1},
                 "output": {"picture": False, "plots": False}}
        if change:
            change(scene, block)
        (self.folder / "a.json").write_text(json.dumps(scene))

    def refused(self, file, place, found, allowed):
        """One of the issues is this one; the run wrote nothing; check states the same."""
        before = sorted(self.folder.iterdir())
        for command, words in (("check", []), ("run", ["--output", "out"])):
            result = self.call(command, *words)
            self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
            issues = json.loads(result.stdout)["issues"]
            self.assertTrue(any(i["file"] == file and place in i["place"] and found in i["found"] and
                                allowed in i["allowed"] for i in issues), issues)
            self.assertIn(found, result.stderr)
        self.assertEqual(sorted(self.folder.iterdir()), before)

    def warned(self, *words):
        for command, more in (("check", []), ("run", ["--output", "out"])):
            result = self.call(command, *more)
            self.assertEqual(result.returncode, 0, result.stderr)
            for word in words:
                self.assertIn(word, result.stderr)
            if not words:
                self.assertEqual(result.stderr, "")
        output = [line.removeprefix("warning: ") for line in result.stderr.splitlines() if line.startswith("warning: ")]
        quiet = self.call("run", "--quiet", "--output", "out")  # hidden, but kept with the results
        self.assertEqual((quiet.returncode, quiet.stderr), (0, ""))
        self.assertEqual(json.loads((self.folder / "out/manifest.json").read_text())["warnings"], output)

    # ---- meshes

    def test_a_good_mesh_causes_no_message(self):
        self.write(*box())
        self.scene()
        self.warned()

    def test_nodes_of_no_element_are_warned_of_and_carry_nothing(self):
        nodes, elements = box()
        self.write(nodes + [[1, 1, 1]], elements)
        self.scene()
        self.warned("warning: a.nodes: node 27: found a node of no element at (1, 1, 1)")

    def test_a_node_that_is_there_twice_tears_the_surface(self):
        nodes, elements = box()
        elements[7][elements[7].index(13)] = 27
        self.write(nodes + [nodes[13]], elements)
        self.scene()
        self.refused("a.nodes", "node 27", "the place of node 13", "one node at a place")
        self.refused("a.nodes", "edge (", "4 faces of the surface", "two faces")

    def test_inverted_elements_are_named(self):
        nodes, elements = box()
        elements[3] = elements[3][4:] + elements[3][:4]
        self.write(nodes, elements)
        self.scene()
        self.refused("a.nodes", "element 3", "an inverted element", "det J > 0")

    def test_a_surface_that_is_no_manifold(self):
        nodes, elements = box()
        self.write(nodes, [elements[0], elements[3]], "node_set bottom\n0 1 3 4\n")
        self.scene()
        self.refused("a.nodes", "edge (0.025, 0.025, 0)", "4 faces of the surface", "two faces")
        self.write(nodes, [elements[0], elements[7]], "node_set bottom\n0 1 3 4\n")
        self.refused("a.nodes", "node 13", "elements that share this node only", "share an edge")

    def test_elements_of_other_kinds(self):
        nodes, elements = box()
        self.write(nodes, [e[:6] for e in elements])
        self.scene()
        self.refused("a.elements", "line 1", "6 numbers", "T4, H8, T10")
        (self.folder / "a.inp").write_text(
            "*NODE\n" + "".join(f"{i + 1},{x[0]},{x[1]},{x[2]}\n" for i, x in enumerate(nodes)) +
            "*ELEMENT,TYPE=C3D6\n1,1,2,4,10,11,13\n")
        self.scene(lambda s, b: b.update(mesh="a.inp"))
        self.refused("a.inp", "line 29", "C3D6", "C3D8")

    def test_sets_without_a_name_or_members_or_that_are_not_there(self):
        nodes, elements = box()
        self.write(nodes, elements, "node_set\n0 1 2\n")
        self.scene()
        self.refused("a.elements", "line 9", "a set without a name", "a name")
        self.write(nodes, elements, SETS + "node_set no_nodes\n")
        for name, found, allowed in (("", '""', "not empty"), ("no_nodes", "an empty set", "a set of nodes"),
                                     ("botom", '"botom"', '"bottom" (nearest name)')):
            self.scene(lambda s, b: b.update(hold=[{"set": name}]))
            self.refused("a.json", "/bodies/block/hold/0/set", found, allowed)
        self.scene(lambda s, b: b.update(loads=[{"set": "bottom", "pressure": 1}]))
        self.refused("a.json", "/bodies/block/loads/0/set", "a set of nodes", "a set of faces")

    def test_coordinates_that_are_no_numbers(self):
        for word in ("nan", "inf", "-inf", "1e999"):
            nodes, elements = box()
            nodes[5][1] = word
            self.write(nodes, elements)
            self.scene()
            self.refused("a.nodes", "line 6", word if word != "1e999" else "", "")
        (self.folder / "a.obj").write_text(TETRAHEDRON.replace("v 0.1", "v nan"))
        self.scene(stone={"kind": "rigid", "shape": "a.obj", "mass": 1, "drive": {}})
        self.refused("a.obj", "line 2", "nan", "finite numbers")

    def test_millimetres_are_suspected_of_solids_rigid_bodies_and_obstacles(self):
        nodes, elements = box(size=50)
        self.write(nodes, elements)
        self.scene()
        self.warned("warning: a.nodes: found a size of 50 x 50 x 50 m", "scale 0.001")
        (self.folder / "a.obj").write_text(TETRAHEDRON.replace("0.1", "100"))
        self.scene(stone={"kind": "rigid", "shape": "a.obj", "mass": 1, "drive": {}})
        self.warned("warning: a.obj: found a size of 100 x 100 x 100 m", "scale 0.001")
        stone = {"kind": "rigid", "shape": {"generate": "ball", "radius": 1}, "mass": 1, "drive": {}}
        self.scene(wall={"kind": "obstacle", "surface": {"file": "a.obj"}, "side": "outside"}, stone=stone)
        self.warned("warning: a.obj: found a size of 100 x 100 x 100 m", "scale 0.001")
        self.scene(wall={"kind": "obstacle", "surface": {"file": "a.obj", "scale": 1e-3},
                         "side": "outside"}, stone=stone)
        self.warned()

    def test_a_file_that_ends_within_a_line_is_warned_of(self):
        self.write(*box(), end="")
        self.scene()
        self.warned("warning: a.elements: found a last line without an end")

    # ---- bodies

    def test_a_node_that_two_holds_take_to_different_places_is_warned_of(self):
        block = {"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3,
                 "mesh": {"generate": "box", "size": [1, 1, 1], "cells": [2, 2, 2]}}
        moved = {"set": "x_min", "x": [[0, 0], [1, 0.01]]}
        self.scene(block=block | {"hold": [{"set": "z_min"}, moved]})
        self.warned("/bodies/block/hold/1/set", "hold 0 (\"z_min\")", "along x: that one counts")
        for other in ({"set": "x_min", "x": 0}, {"set": "x_max", "y": 0}, {"set": "z_max", "z": 0.02}):
            self.scene(block=block | {"hold": [{"set": "z_min"}, other]})
            self.warned()
        self.scene(block=block | {"hold": [{"set": "z_min", "y": 0, "z": 0}, moved,
                                           moved | {"set": "y_min"}]})
        self.warned()

    def test_joined_bodies_that_start_apart_are_warned_of_where_the_rule_does_not_damp(self):
        for theta, speed, spin, reported in ((0.5, 1, 0, True), (1, 1, 0, False), (0.5, 0, 0, False),
                                         (0.5, 0, 2, True)):
            def ball(x, speed, spin):
                return {"kind": "rigid", "mass": 1, "shape": {"generate": "ball", "radius": 0.1},
                        "start": {"place": [x, 0, 0], "velocity": [speed, 0, 0], "spin": [0, 0, spin]}}
            def join(scene, _):
                scene["couplings"] = [{"kind": "ball", "between": ["one", "two"], "at": [0.5, 0, 0]}]
                scene["time"] = {"kind": "dynamic", "step": 0.01, "end": 0.02, "theta": theta}
            self.scene(join, one=ball(0, speed, spin), two=ball(1, 0, 0))
            self.warned(*(["/couplings/0: found bodies that start 1 m/s apart"] if reported else []))

    def test_solids_that_fill_the_same_place_are_refused(self):
        block = {"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3, "hold": [{"set": "z_min"}]}
        for element, kind in ((2, "H8"), (1, "T10"), (3, "T4")):
            mesh = {"generate": "box", "size": [1, 1, 1], "cells": [element] * 3, "element": kind}
            law = {"between": ["one", "two"], "friction": 0.3}
            self.scene(lambda scene, _: scene.update(contact=[law]), one=block | {"mesh": mesh},
                       two=block | {"mesh": mesh})
            self.refused("a.json", "/contact", "one and two overlap by", "start_overlap")

    def test_a_body_that_can_fly_is_named_with_its_free_motions(self):
        self.write(*box())
        self.scene(lambda s, b: b.update(hold=[]))
        self.refused("a.json", "/bodies/block", "nothing prevents: every shift and turn",
                     "a hold, a drive, a contact")
        self.scene(lambda s, b: b.update(hold=[{"set": "all", "x": 0, "y": 0}]))
        self.refused("a.json", "/bodies/block", "nothing prevents: shift along (0, 0, ", "a hold")
        self.scene(stone={"kind": "rigid", "shape": {"generate": "ball", "radius": 0.1}, "mass": 1})
        self.refused("a.json", "/bodies/stone", "nothing prevents: every shift and turn", "a hold")

    def test_shapes_and_inertias_that_cannot_be(self):
        stone = {"kind": "rigid", "shape": {"generate": "box", "size": [0.1, 0.1, 0]}, "mass": 1}
        self.scene(stone=stone)
        self.refused("a.json", "/bodies/stone/shape/size", "[0.1,0.1,0]", "each >= 1e-09 and <= 1e+09 [m]")
        self.scene(stone=dict(stone, shape={"generate": "ball", "radius": 1}, inertia=[1, 1, 5]))
        self.refused("a.json", "/bodies/stone/inertia", "[1, 1, 5]", "the sum of the other two")
        (self.folder / "a.obj").write_text(TETRAHEDRON.replace("f 2 3 4\n", ""))
        self.scene(stone=dict(stone, shape="a.obj"))
        self.refused("a.obj", "hole around", "3 open edges", "a closed surface")

    def test_elements_too_stiff_for_what_hardly_changes_its_volume_are_warned_of(self):
        for element, ratio, warned in (("T4", 0.45, False), ("T4", 0.46, True), ("T10", 0.45, False),
                                       ("T10", 0.48, True), ("T10", 0.49, True), ("T10", 0.4999, True),
                                       ("H8", 0.49, False), ("H8", 0.4999, False)):
            with self.subTest(element=element, ratio=ratio):
                self.scene(block={"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": ratio,
                                  "mesh": {"generate": "box", "size": [1, 1, 1], "cells": [2, 2, 2],
                                           "element": element}, "hold": [{"set": "z_min"}]})
                result = self.call("check")
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertEqual(f"found {element} with a Poisson's ratio of {ratio}" in result.stderr, warned, result.stderr)


if __name__ == "__main__":
    reported_skips.main()
