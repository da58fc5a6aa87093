"""Scenes from files and dicts: what is taken, refused and reported."""

import json
import os
import pathlib
import pickle
import types

import numpy as np

import amontons as am
from scenes import CATHETER, Case, block, folder, main, tube_and_wire


class SceneTest(Case):
    def test_a_dict_and_its_file_are_one_scene(self):
        with folder():
            with open("scene.json", "w") as stream:
                json.dump(block(), stream)
            for source in ("scene.json", pathlib.Path("scene.json"), block(), types.MappingProxyType(block())):
                self.assertEqual(am.Scene(source), am.Scene(block()))
        self.assertNotEqual(am.Scene(block()), am.Scene(block(3)))

    def test_values_of_numpy_are_those_of_python(self):
        numbers = {"contact.0.friction": np.float32(0.5), "gravity": np.array([0, 0, -1.0]),
                   "bodies.block.mesh.cells": np.array([1, 2, 3], np.int16)}
        plain = {"contact.0.friction": 0.5, "gravity": [0, 0, -1], "bodies.block.mesh.cells": (1, 2, 3)}
        self.assertEqual(am.Scene(block(), set=numbers), am.Scene(block(), set=plain))
        scene = am.Scene(block(gravity=np.array([0, 0, -1.0])))
        self.assertEqual(scene["gravity"], [0, 0, -1])

    def test_changes_make_another_scene_and_leave_the_first(self):
        scene = am.Scene(tube_and_wire())
        other = scene.changed({"contact.0.friction": 0.2}).changed({"time/end": 2})
        self.assertEqual((scene["contact.0.friction"], scene["time.end"]), (0.1, 8))
        self.assertEqual((other["contact.0.friction"], other["time.end"]), (0.2, 2))
        self.assertEqual(other, am.Scene(tube_and_wire(), set={"contact.0.friction": 0.2, "time.end": 2}))
        resolved = scene.resolved
        resolved["time"]["end"] = 3
        self.assertEqual(scene["time.end"], 8)
        self.assertEqual(am.Scene(scene.resolved), scene)
        self.assertEqual(pickle.loads(pickle.dumps(other)), other)
        with self.assertRaises(KeyError):
            scene["time.nothing"]

    def test_all_mistakes_are_reported_together_with_the_nearest_name(self):
        scene = tube_and_wire()
        scene["bodies"]["wire"]["segments"][0]["radius"] = -1
        scene["contact"][0]["frictoin"] = 1
        scene["time"]["end"] = "late"
        with self.refused("/bodies/wire/segments/0/radius", "-1") as all:
            am.Scene(scene)
        self.assertGreaterEqual(len(all.issues), 3)
        self.assertTrue(any("friction" in i["allowed"] for i in all.issues))
        self.assertTrue(all.issues[0]["file"] == "scene")

    def test_what_is_no_scene_is_refused(self):
        for wrong, place in ((7, "source"), (None, "source"), ({"a": {1, 2}}, "/a"), ({"a": float("nan")}, "/a")):
            with self.refused(place):
                am.Scene(wrong)
        with folder():
            with self.refused(""):
                am.Scene("nowhere.json")
            with open("latin", "wb") as stream:
                stream.write(b'{"title": "\xe4"}')
            with self.refused("", "no UTF-8"):
                am.Scene("latin")
            with self.refused(""):
                am.Scene(".")
        for place, found, value in (("/time/step", "nan", np.nan), ("/gravity/1", "inf", (0.0, np.array(np.inf), 0)), ("/title", "object", object()),
                                    ("/contact/0", "loop", None), ("", "key", (1, 2))):
            wrong = dict(block(), contact=[])
            if place == "/contact/0":
                wrong["contact"].append(wrong["contact"])
            elif place == "":
                wrong[value] = 1
            else:
                names = place.split("/")[1:]
                if names[0] == "time":
                    wrong["time"] = dict(wrong["time"], step=value)
                else:
                    wrong[names[0]] = value
            with self.refused(place, found) as refused:
                am.Scene(wrong)
            self.assertEqual(refused.issues[0]["place"], place)
            self.assertEqual(refused.issues[0]["file"], "scene")
        for wrong in ({"time.end": object()}, {"time.end": float("inf")}, [("time.end", 1)]):
            with self.refused(""):
                am.Scene(block(), set=wrong)

    def test_check_reports_what_the_program_reports(self):
        check = am.Scene(CATHETER).check()
        self.assertEqual({"bodies", "surfaces", "pairs", "uses", "leaves_out", "predicted"}, set(check))
        self.assertEqual([b["name"] for b in check["bodies"]], ["aorta", "wire"])
        overlap = block()
        overlap["bodies"]["block"]["mesh"]["centre"] = [0, 0, 0.04]
        with self.refused("/contact", "overlap"):
            am.Scene(overlap).check()

    def test_files_that_a_scene_names_are_found_beside_it(self):
        with folder() as path:
            os.mkdir("a")
            with open("a/ball.obj", "w") as stream:
                stream.write("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
            scene = {"schema": 1, "bodies": {"tool": {"kind": "rigid", "mass": 1, "shape": {"file": "ball.obj"}}},
                     "time": {"kind": "dynamic", "step": 0.1, "end": 1}}
            with self.refused("", "", ""):
                am.Simulation(scene)
            made = am.Scene(scene, folder="a")
            am.Simulation(made)
            with self.refused("", "ball.obj"):
                made.save(os.path.join(path, "b.json"))
            made.save("a/b.json")
            self.assertEqual(am.Scene("a/b.json"), made)


if __name__ == "__main__":
    main()
