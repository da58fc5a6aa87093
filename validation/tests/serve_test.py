#!/usr/bin/env python3
"""amontons serve: the client of docs/serve.md, the numbers of amontons run, wrong requests, signals.

serve_test.py PROGRAM
"""
import array
import base64
import csv
import json
import os
import pathlib
import random
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import reported_skips

PROGRAM = str(pathlib.Path(sys.argv[1]).resolve())
ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs/serve.md").read_text()
CLIENT, USE = (part.split("```", 1)[0] for part in PAGE.split("```python\n")[1:3])
client = {}
exec(CLIENT, client)
Served = client["Served"]

WIRE = {
    "schema": 1,
    "bodies": {
        "tube": {"kind": "obstacle", "surface": {"generate": "tube", "radius": 0.004, "centreline": {
            "pieces": [{"length": 0.02}, {"radius": 0.03, "angle": 1.57}, {"length": 0.02}]}}},
        "wire": {"kind": "beam", "drive": {"insertion": [[0, 0], [3, 0.06]]},
                 "segments": [{"length": 0.15, "radius": 4.445e-4, "EI": 5.2e-4, "element": 2.5e-3}]}},
    "contact": [{"between": ["wire", "tube"], "friction": 0.1}],
    "time": {"step": 0.05, "end": 3},
    "output": {"picture": False, "plots": False},
}
BLOCK = {
    "schema": 1,
    "bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
        "box": {"kind": "rigid", "mass": 2, "shape": {"generate": "box", "size": [0.2, 0.2, 0.2]},
                "start": {"place": [0, 0, 0.1]}}},
    "contact": [{"between": ["box", "floor"], "friction": 0.5}],
    "gravity": [0.2, 0, -9.81],
    "time": {"kind": "dynamic", "step": 0.01, "end": 0.2},
    "output": {"picture": False, "plots": False},
}
# A solid that a drive presses to nothing: its steps fail in the end.
CRUSHED = {
    "schema": 1,
    "bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
        "block": {"kind": "solid", "material": {"law": "neo_hooke", "youngs_modulus": 1e5, "poisson_ratio": 0.45},
                  "mesh": {"generate": "box", "size": [0.1, 0.1, 0.1], "centre": [0, 0, 0.05], "cells": [2, 2, 2],
                           "element": "H8"},
                  "hold": [{"set": "z_max", "x": 0, "y": 0, "z": [[0, 0], [1, -0.12]]}]}},
    "contact": [{"between": ["block", "floor"], "friction": 0.3}],
    "time": {"step": 0.05, "end": 1, "smallest_step": 0.01},
    "output": {"picture": False, "plots": False},
}


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.started = []

    def scene(self, scene):
        path = self.folder / "scene.json"
        path.write_text(json.dumps(scene))
        return str(path)

    def serve(self, scene, *options):
        served = Served(PROGRAM, scene if isinstance(scene, str) else self.scene(scene), *options)
        self.addCleanup(self.end, served.process)
        return served

    def end(self, process):
        process.stdin.close()
        process.stdout.close()
        process.wait(60)

    def refused(self, send, **fields):
        with self.assertRaises(RuntimeError) as caught:
            send(**fields)
        issues = caught.exception.args[0]
        for issue in issues:
            self.assertEqual(list(issue), ["file", "place", "found", "allowed"])
            self.assertTrue(issue["found"] and issue["allowed"], issue)
        return issues

    def lines(self, scene, text, code=0):
        """The answers to a whole text on stdin."""
        result = subprocess.run([PROGRAM, "serve", self.scene(scene)], input=text, capture_output=True, timeout=300)
        self.assertEqual(result.returncode, code, result.stderr)
        return [json.loads(line, parse_constant=self.fail) for line in result.stdout.splitlines()]


class Client(Case):
    def test_the_page_s_client_has_at_most_thirty_lines_and_does_what_the_page_shows(self):
        self.assertLessEqual(len(CLIENT.strip().splitlines()), 30)
        where = dict(client)
        where["print"] = lambda *words: printed.append(words)
        printed = []
        before = os.getcwd()
        os.chdir(ROOT)
        try:
            exec(USE.replace('"amontons"', repr(PROGRAM)), where)
        finally:
            os.chdir(before)
        self.assertEqual([words[0] for words in printed], [0.0, 1.57, 3.14])
        for words in printed:
            self.assertGreater(abs(words[1]), 0)
        self.end(where["wire"].process)
        self.assertEqual(where["wire"].process.returncode, 0)


class Numbers(Case):
    def check_run(self, scene):
        path = self.scene(scene)
        out = self.folder / "out"
        result = subprocess.run([PROGRAM, "run", path, "--output", out, "--json"], capture_output=True, text=True, check=True)
        whole = json.loads(result.stdout)
        served = self.serve(path)
        with open(out / "history.csv", newline="") as file:
            rows = [{name.split(" [")[0]: value for name, value in row.items()} for row in csv.DictReader(file)]
        self.assertGreater(len(rows), 10)
        for row in rows:
            answer = served.step()
            now = answer["quantities"]
            reported = [name for name in row if name in now]
            self.assertGreater(len(reported), 3)
            for name in reported + ["time"]:
                self.assertEqual(float(row[name]), answer["time"] if name == "time" else now[name], name)
            self.assertEqual(answer["step"]["number"], int(row["step"]))
            self.assertEqual(answer["certificate"]["error"], float(row["certificate_error"]))
            self.assertEqual(answer["energy"]["work"], float(row["work"]))
        self.assertTrue(answer["done"])
        self.assertEqual(answer["time"], whole["time"])
        self.assertEqual({k: answer["certificate"][k] for k in whole["certificate"]}, whole["certificate"])
        self.assertEqual(answer["energy"], whole["energy"])
        self.assertEqual({k: answer["quantities"][k] for k in whole["quantities"]}, whole["quantities"])
        self.assertEqual(served.step(count=3)["taken"], 0)  # at the end
        return served

    def test_a_wire_s_numbers_are_those_of_a_run(self):
        self.check_run(WIRE)

    def test_a_rigid_body_s_numbers_are_those_of_a_run(self):
        self.check_run(BLOCK)

    def test_advance_falls_on_its_time_and_on_the_steps_of_a_run(self):
        served, other = self.serve(WIRE), self.serve(WIRE)
        self.assertEqual(served.advance(until=0.5)["taken"], 11)
        self.assertEqual(other.step(count=11)["quantities"], served.state()["quantities"])
        self.assertEqual(served.advance(until=0.5123)["time"], 0.5123)

    def test_a_saved_state_continues_bit_by_bit_and_reset_begins_anew(self):
        for scene, path, value in ((WIRE, "wire.twist", 0.7), (BLOCK, "gravity.0", 0.3)):
            served = self.serve(scene)
            first = served.step(count=4)
            served.set(path=path, value=value)
            state = served.save()["state"]
            there = served.step(count=5)
            again = served.restore(state=state)
            self.assertEqual(again["quantities"], first["quantities"])
            clock = lambda answer: {**answer, "id": 0, "step": {**answer["step"], "seconds": 0}}
            self.assertEqual(clock(served.step(count=5)), clock(there))
            self.assertIsNone(served.reset()["step"])
            anew = served.step(count=4)
            if path == "wire.twist":  # an input that was led is led no more
                self.assertEqual(clock(anew), clock({**first}))
            else:  # what was set in the scene stays
                self.assertEqual(served.scene()["scene"]["gravity"][0], value)

    def test_a_state_of_another_scene_is_refused_though_its_sizes_fit(self):
        for scene, path, value in ((WIRE, "bodies.wire.segments.0.EI", 6e-4), (WIRE, "contact.0.friction", 0.2), (BLOCK, "bodies.box.mass", 3)):
            served = self.serve(scene)
            served.step(count=4)
            state = served.save()["state"]
            other = self.serve(scene, "--set", f"{path}={value}")
            other.step()
            before = other.save()["state"]
            issues = self.refused(other.restore, state=state)
            self.assertEqual([(i["place"], i["found"]) for i in issues], [("state", "the state of another scene")])
            self.assertEqual(other.save()["state"], before)
            served.set(path=path, value=value)  # takes the state along: from here on it is one of that scene
            self.refused(served.restore, state=state)
            self.assertEqual(other.restore(state=served.save()["state"])["quantities"], served.state()["quantities"])

    def test_an_input_moves_its_drive_and_a_path_changes_the_scene(self):
        served = self.serve(WIRE)
        served.step(count=11)
        all = {i["name"]: i for i in served.inputs()["inputs"]}
        self.assertEqual((all["wire.insertion"]["unit"], all["wire.twist"]["largest"]), ("m", None))
        served.set(path="wire.insertion", value=0.011)
        self.assertEqual(served.step()["quantities"]["insertion"], 0.011)
        self.assertEqual(served.step(count=3)["quantities"]["insertion"], 0.011)  # stays
        before = served.state()["quantities"]
        self.assertEqual(served.set(path="contact.0.friction", value=0.4)["quantities"], before)
        self.assertEqual(served.scene()["scene"]["contact"][0]["friction"], 0.4)
        self.assertEqual(served.check()["check"]["pairs"][0]["friction"], 0.4)
        self.assertEqual({i["name"]: i["value"] for i in served.inputs()["inputs"]}["wire.insertion"], 0.011)
        served.set(path="time/end", value=5)
        self.assertEqual(served.advance(until=4.5)["done"], False)

    def test_contacts_and_views_contain_the_same_forces(self):
        served = self.serve(WIRE)
        self.assertEqual(served.contacts()["contacts"], [])
        answer = served.advance(until=2.5)
        contacts = served.contacts()["contacts"]
        self.assertEqual(len(contacts), answer["contacts"]["now"])
        self.assertGreater(len(contacts), 0)
        for c in contacts:
            self.assertEqual((c["a"], c["b"]), ("wire", "tube"))
            along = sum(x * y for x, y in zip(c["force"], c["normal"]))
            self.assertAlmostEqual(along, c["normal_force"], delta=1e-9 * abs(along))
        numbers = lambda text, kind="f": array.array(kind, base64.b64decode(text))
        view = served.view()
        shapes = {s["name"]: s for s in view["shapes"]}
        self.assertEqual({n: s["kind"] for n, s in shapes.items()}, {"tube": "wall", "wire": "wire"})
        triangles = numbers(shapes["tube"]["triangles"], "i")
        self.assertEqual(max(triangles), len(numbers(shapes["tube"]["points"])) // 3 - 1)
        tip = numbers(shapes["wire"]["points"])[-3:]
        for k, name in enumerate("xyz"):
            self.assertAlmostEqual(tip[k], answer["quantities"][f"tip_{name}"], delta=1e-6)
        forces = numbers(view["contacts"])
        self.assertEqual(len(forces), 6 * len(contacts))
        for c, at in zip(contacts, range(0, len(forces), 6)):
            for k in range(3):  # on the wall, as the caption states
                self.assertAlmostEqual(forces[at + 3 + k], -c["force"][k], delta=1e-6)
        self.assertEqual([s["name"] for s in served.view()["shapes"]], ["wire"])
        self.assertEqual([s["name"] for s in served.view(whole=True)["shapes"]], ["tube", "wire"])


class Wrong(Case):
    def test_each_wrong_request_is_answered_by_its_place_and_changes_nothing(self):
        served = self.serve(WIRE)
        served.step(count=5)
        state = served.save()["state"]
        for what, fields, place in (
                ("step", {"count": 0}, "count"), ("step", {"count": 1.5}, "count"), ("step", {"count": "3"}, "count"),
                ("step", {"count": 10**12}, "count"), ("advance", {}, "until"), ("advance", {"until": "1"}, "until"),
                ("advance", {"until": 0.1}, "until"), ("advance", {"until": 99}, "until"),
                ("set", {"path": "wire.insertion"}, "value"), ("set", {"path": "wire.insertion", "value": "x"}, "wire.insertion"),
                ("set", {"path": "wire.insertion", "value": -1}, "wire.insertion"), ("set", {"path": "", "value": 1}, "path"),
                ("set", {"path": "time.end=2", "value": 1}, "path"), ("set", {"path": 3, "value": 1}, "path"),
                ("set", {"path": "wire.insertio", "value": 1}, "path"),
                ("set", {"path": "contact.0.friction", "value": -1}, "/contact/0/friction (--set)"),
                ("restore", {}, "state"), ("restore", {"state": "!"}, "state"), ("restore", {"state": "Zm9v"}, "state"),
                ("restore", {"state": state[:400]}, "state"), ("restore", {"state": 1}, "state"),
                ("view", {"whole": 1}, "whole"), ("stop", {}, "do"), ("step", {"cuont": 3}, "")):
            with self.subTest(what=what, fields=fields):
                issues = self.refused(getattr(served, what), **fields)
                self.assertIn(place, [i["place"] for i in issues] if place != "state" else [place])
                self.assertEqual(served.save()["state"], state)
        self.assertIn('"count" (nearest name)', self.refused(served.step, cuont=3)[0]["allowed"])
        # What makes other bodies does not fit the state.
        self.refused(served.set, path="bodies.wire.segments.0.element", value=1e-3)
        self.assertEqual(served.save()["state"], state)

    def test_lines_that_are_no_requests_are_answered_without_an_id(self):
        lines = ["", "nonsense", "[]", "3", "{}", '{"id": true, "do": "state"}', '{"do": "state"}', '{"id": 1}',
                 '{"id": 1, "id": 2, "do": "state"}', "[" * 100000, '{"id": 1, "do": "state"', '{"id": 1e999, "do": "state"}']
        answers = self.lines(BLOCK, "\n".join(lines + ['{"id": "last", "do": "state"}']).encode() + b"\n\xff\xfe\n\x00\n")
        self.assertEqual(len(answers), len(lines) + 3)
        for line, answer in zip(lines, answers):
            self.assertEqual((answer["ok"], answer["status"]), (False, "bad_input"), line[:60])
            if not line.startswith('{"id": 1'):
                self.assertIsNone(answer["id"], line[:60])
            for issue in answer["issues"]:
                self.assertTrue(issue["found"] and issue["allowed"], line[:60])
        self.assertEqual((answers[-3]["id"], answers[-3]["ok"]), ("last", True))
        self.assertFalse(answers[-2]["ok"] or answers[-1]["ok"])

    def test_a_line_that_is_longer_than_allowed_is_passed_over(self):
        long = b'{"id": 1, "do": "restore", "state": "' + b"A" * (2**28) + b'"}\n'
        answers = self.lines(BLOCK, long + b'{"id": 2, "do": "state"}')
        self.assertEqual([(a["id"], a["ok"]) for a in answers], [(None, False), (2, True)])

    def test_random_lines_are_each_answered_by_one_line_and_end_nothing(self):
        draw = random.Random(45)
        words = ['{"id": 1, "do": "step"}', '{"id": 2, "do": "set", "path": "wire.insertion", "value": 0.01}',
                 '{"id": 3, "do": "advance", "until": 0.3}', '{"id": 4, "do": "save"}', '{"id": 5, "do": "reset"}',
                 '{"id": 6, "do": "set", "path": "contact.0.friction", "value": 0.2}', '{"id": 7, "do": "view", "whole": true}',
                 '{"id": 8, "do": "restore", "state": "YW1vbnN0MDEAAAAAAAAAAA=="}', '{"id": 9, "do": "inputs"}']
        lines = []
        for _ in range(600):
            line = bytearray(draw.choice(words).encode())
            for _ in range(draw.choice((0, 1, 1, 2, 5))):
                at = draw.randrange(len(line))
                change = draw.random()
                if change < 0.4:
                    line[at] = draw.randrange(256)
                elif change < 0.7:
                    del line[at:at + draw.randrange(1, 6)]
                else:
                    line[at:at] = draw.choice(words).encode()[:draw.randrange(1, 30)]
                if not line:
                    line = bytearray(b"{}")
            # `quit` cannot come from these words; a line's end would make two of one.
            lines.append(bytes(line).replace(b"\n", b" "))
        answers = self.lines(WIRE, b"\n".join(lines) + b"\n")
        self.assertEqual(len(answers), len(lines))
        fine = sum(a["ok"] for a in answers)
        self.assertTrue(100 < fine < 590, fine)

    def test_a_scene_that_is_wrong_ends_with_exit_code_2_and_one_line(self):
        scene = json.loads(json.dumps(WIRE))
        scene["bodies"]["wire"]["segments"][0]["radius"] = -1
        scene["time"]["stop"] = 3
        (answer,) = self.lines(scene, b'{"id": 1, "do": "step"}\n', code=2)
        self.assertEqual((answer["id"], answer["ok"], len(answer["issues"])), (None, False, 2))

    def test_a_step_that_fails_leaves_the_last_good_state(self):
        served = self.serve(CRUSHED)
        answers = [served.step()]
        while True:
            try:
                answers.append(served.step())
                self.assertFalse(answers[-1]["done"], "nothing failed")
            except RuntimeError as error:
                (issue,) = error.args[0]
                break
        self.assertIn("step", issue["found"])
        self.assertGreater(len(answers), 3)
        now = served.state()
        self.assertEqual(now["time"], answers[-1]["time"])
        self.assertEqual(now["quantities"], answers[-1]["quantities"])
        self.refused(served.step)  # as before
        served.reset()
        again = [served.step() for _ in range(len(answers))]
        self.assertEqual([a["quantities"] for a in again], [a["quantities"] for a in answers])


class Ends(Case):
    def test_the_end_of_the_input_ends_the_program_with_exit_code_0(self):
        self.assertEqual(self.lines(BLOCK, b""), [])
        (answer,) = self.lines(BLOCK, b'{"id": 1, "do": "state"}')  # without a line's end
        self.assertTrue(answer["ok"])
        answers = self.lines(BLOCK, b'{"id": 1, "do": "quit"}\n{"id": 2, "do": "state"}\n')
        self.assertEqual(answers, [{"id": 1, "ok": True}])

    def test_a_signal_ends_a_program_that_waits(self):
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            served = self.serve(BLOCK)
            served.step()
            began = time.monotonic()
            served.process.send_signal(number)
            self.assertEqual(served.process.wait(60), 130)
            self.assertLess(time.monotonic() - began, 5)

    def test_a_signal_in_a_long_advance_is_answered_and_ends_the_program(self):
        scene = json.loads(json.dumps(BLOCK))
        scene["time"].update(step=1e-5, end=1000)
        served = self.serve(scene)
        served.step()
        served.process.stdin.write('{"id": "far", "do": "advance", "until": 1000}\n')
        served.process.stdin.flush()
        time.sleep(0.5)
        served.process.send_signal(signal.SIGTERM)
        answer = json.loads(served.process.stdout.readline())
        self.assertEqual((answer["id"], answer["ok"], answer["status"]), ("far", False, "interrupted"))
        self.assertGreater(answer["taken"], 0)
        self.assertEqual(served.process.wait(60), 130)


if __name__ == "__main__":
    reported_skips.main(argv=sys.argv[:1])
