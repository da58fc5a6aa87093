"""Small scenes, and what the tests of the package share."""

import contextlib
import os
import sys
import tempfile
import unittest

import amontons as am

SOURCES = os.environ["AMONTONS_SOURCES"]
sys.path.append(os.path.join(SOURCES, "validation", "tests"))
import reported_skips  # noqa: E402
CATHETER = os.path.join(SOURCES, "examples", "catheter", "scene.json")
SOFT_VESSEL = os.path.join(SOURCES, "examples", "soft_vessel", "scene.json")


def tube_and_wire(**more):
    """A wire pushed 80 mm into a bent tube."""
    return {"schema": 1, "bodies": {
        "tube": {"kind": "obstacle", "surface": {"generate": "tube", "radius": 0.004, "centreline": {
            "pieces": [{"length": 0.02}, {"radius": 0.03, "angle": 1.57}, {"length": 0.06}]}}},
        "wire": {"kind": "beam", "drive": {"insertion": [[0, 0], [8, 0.08]]},
                 "segments": [{"length": 0.15, "radius": 4.445e-4, "EI": 5.2e-4, "element": 2.5e-3}]}},
        "contact": [{"between": ["wire", "tube"], "friction": 0.1}], "time": {"step": 0.1, "end": 8}, **more}


def block(cells=2, **more):
    """A rubber block that is drawn over a plane."""
    return {"schema": 1, "bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
        "block": {"kind": "solid", "material": {"law": "neo_hooke", "youngs_modulus": 1e5, "poisson_ratio": 0.45},
                  "mesh": {"generate": "box", "size": [0.1, 0.1, 0.1], "centre": [0, 0, 0.05],
                           "cells": [cells, cells, cells], "element": "H8"},
                  "hold": [{"set": "z_max", "x": [[0, 0], [1, 0.01]], "y": 0, "z": [[0, 0], [1, -0.003]]}]}},
        "contact": [{"between": ["block", "floor"], "friction": 0.3}], "time": {"step": 0.1, "end": 1}, **more}


def pressed_flat():
    """A block that is pressed to nothing: no balance from some step on."""
    scene = block()
    scene["bodies"]["block"]["hold"] = [{"set": "z_max", "x": 0, "y": 0, "z": [[0, 0], [1, -0.12]]}]
    scene["time"] = {"step": 0.05, "end": 1, "smallest_step": 0.01}
    return scene


def pressed_by_plate():
    """A rubber block on a plane under a rigid plate that comes down."""
    scene = block()
    del scene["bodies"]["block"]["hold"]
    scene["bodies"]["plate"] = {"kind": "rigid", "mass": 1, "shape": {"generate": "box", "size": [0.3, 0.3, 0.02]},
                                "start": {"place": [0, 0, 0.11]}, "drive": {"z": [[0, 0], [0.35, -0.002], [1, -0.004]]}}
    scene["contact"] = [{"between": ["block", "floor"], "friction": 0.3}, {"between": ["block", "plate"], "friction": 0.3}]
    return scene


def ball(**more):
    return {"schema": 1, "bodies": {"ball": {"kind": "rigid", "mass": 2, "shape": {"generate": "ball", "radius": 0.1}}},
            "gravity": [0, 0, -9.81], "time": {"kind": "dynamic", "step": 0.1, "end": 1}, **more}


#: What is loaded before the interpreter keeps memory that is given back.
SANITIZED = "san.so" in os.environ.get("LD_PRELOAD", "")


@contextlib.contextmanager
def folder():
    """A folder of its own, which is the current one meanwhile, with the examples in it."""
    before = os.getcwd()
    with tempfile.TemporaryDirectory() as path:
        os.symlink(os.path.join(SOURCES, "examples"), os.path.join(path, "examples"))
        os.chdir(path)
        try:
            yield path
        finally:
            os.chdir(before)


class Case(unittest.TestCase):
    def refused(self, place, found="", allowed=""):
        """Expects an InputError with an issue of this place that states these words."""
        case = self

        class Refused:
            def __enter__(self):
                return self

            def __exit__(self, kind, error, _):
                case.assertIsNotNone(kind, f"{place} was not refused")
                if not issubclass(kind, am.InputError):
                    return False
                self.issues = error.issues
                case.assertTrue(any(place in i["place"] and found in i["found"] and allowed in i["allowed"]
                                    for i in error.issues), error.issues)
                for issue in error.issues:
                    case.assertEqual(sorted(issue), ["allowed", "file", "found", "place"])
                return True
        return Refused()


def main():
    reported_skips.main(verbosity=1)
