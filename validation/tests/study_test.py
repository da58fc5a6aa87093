#!/usr/bin/env python3
"""amontons study from outside: study_test.py STUB

STUB is amontons_stub: no physics, so that runs are quick, can be slowed down and can be made to fail.
"""
import csv
import json
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import xml.etree.ElementTree as xml

import reported_skips
from wire_on_floor import SCENE

PROGRAM = str(pathlib.Path(sys.argv[1]).resolve())
STEPS = "time.step=0.2,0.1,0.05"


class Study(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="amontons_"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.write(SCENE)

    def write(self, scene):
        (self.folder / "scene.json").write_text(json.dumps(scene))

    def start(self, *arguments, environment=None, **options):
        return subprocess.Popen([PROGRAM, "study", *arguments], cwd=self.folder, text=True,
                                env={**os.environ, **(environment or {})}, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, **options)

    def call(self, *arguments, code=0, **options):
        process = self.start(*arguments, **options)
        out, errors = process.communicate(timeout=120)
        self.assertEqual(process.returncode, code, errors)
        self.errors = errors
        return json.loads(out) if "--json" in arguments and out else out

    def study(self, *arguments, **options):
        return self.call("scene.json", "--sweep", STEPS, "--quantity", "steps", "--output", "out",
                         "--json", *arguments, **options)

    def points(self, folder="out"):
        return sorted((self.folder / folder / "points").glob("*.json"))

    def test_rows_csv_and_plot(self):
        answer = self.study("--reference", "20")
        self.assertEqual([r["value"] for r in answer["rows"]], [5, 10, 20])
        self.assertEqual([r["error"] for r in answer["rows"]], [0.75, 0.5, 0])
        self.assertEqual([r["parameters"]["time.step"] for r in answer["rows"]], [0.2, 0.1, 0.05])
        for row in answer["rows"]:
            self.assertEqual(row["status"], "done")
            self.assertGreater(row["seconds"], 0)
            self.assertGreater(row["unknowns"], 0)
        self.assertAlmostEqual(answer["order"], 0.585, 3)  # log2(0.75 / 0.5)
        self.assertEqual(answer["reference"], 20)
        text = (self.folder / "out/study.csv").read_text()
        rows = list(csv.DictReader(text.splitlines()))
        self.assertEqual([r["steps"] for r in rows], ["5", "10", "20"])
        self.assertEqual([r["time.step"] for r in rows], ["0.2", "0.1", "0.05"])
        self.assertTrue((self.folder / "out/study.gp").exists())

    @unittest.skipUnless(shutil.which("gnuplot"), "lacks gnuplot")
    def test_the_plot_is_a_picture(self):
        self.study("--reference", "20")
        self.assertTrue(xml.parse(self.folder / "out/study.svg").getroot().tag.endswith("svg"))

    def test_continues_where_it_was_killed(self):
        process = self.start("scene.json", "--sweep", STEPS, "--quantity", "steps", "--output", "out",
                             environment={"AMONTONS_STUB_PAUSE": "0.02"})
        while not (self.folder / "out/points").exists() or len(self.points()) < 2:
            time.sleep(0.01)
        process.kill()
        process.communicate()
        before = [p.stat().st_mtime_ns for p in self.points()]
        answer = self.study()
        self.assertEqual(len(answer["rows"]), 3)
        self.assertIn("2 of 3 points are there already", self.errors)
        self.assertEqual([m for m in before if m in
                          [p.stat().st_mtime_ns for p in self.points()]], before)
        # Nothing is left of the killed one: its child ended with it.
        self.assertEqual(subprocess.run(["pgrep", "-f", str(self.folder)]).returncode, 1)

    def test_interrupted(self):
        process = self.start("scene.json", "--sweep", STEPS, "--quantity", "steps", "--output", "out",
                             "--json", environment={"AMONTONS_STUB_PAUSE": "0.05"})
        while not (self.folder / "out/points").exists() or not self.points():
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        out, errors = process.communicate(timeout=20)
        self.assertEqual(process.returncode, 130, errors)
        rows = json.loads(out)["rows"]
        self.assertTrue(1 <= len(rows) < 3)
        self.assertEqual({r["status"] for r in rows}, {"done"})
        self.assertEqual(len(self.study()["rows"]), 3)

    def test_failures_are_rows(self):
        answer = self.study("--reference", "20", environment={"AMONTONS_STUB_FAIL": "15"})
        last = answer["rows"][2]
        self.assertEqual((last["status"], last["value"], last["error"]), ("failed", None, None))
        self.assertIn("cannot be solved", last["reason"])
        self.assertEqual([r["status"] for r in answer["rows"]], ["done", "done", "failed"])
        self.study("--restart", environment={"AMONTONS_STUB_FAIL": "1"}, code=3)

    def test_a_run_that_takes_too_long_is_a_row(self):
        answer = self.study("--max-time", "1.5", environment={"AMONTONS_STUB_PAUSE": "0.1"})
        status = [r["status"] for r in answer["rows"]] # the middle one's depends on the machine
        self.assertEqual([status[0], status[2]], ["done", "out_of_time"])

    def test_what_ran_out_of_time_runs_again_when_it_has_longer(self):
        slow = {"AMONTONS_STUB_PAUSE": "0.1"}
        first = self.study("--max-time", "1.2", environment=slow)
        self.assertEqual(first["rows"][2]["status"], "out_of_time")
        late = sum(r["status"] == "out_of_time" for r in first["rows"])
        again = self.study("--max-time", "0.5")  # no longer than before: what is there stays
        self.assertEqual([r["status"] for r in again["rows"]], [r["status"] for r in first["rows"]])
        answer = self.study("--max-time", "100")
        self.assertEqual([r["status"] for r in answer["rows"]], ["done"] * 3)
        self.assertIn(f"{3 - late} of 3 points are there", self.errors)

    def test_what_crashed_runs_again_what_failed_does_not(self):
        self.study(environment={"AMONTONS_STUB_FAIL": "15"})
        for status, kept in (("failed", 3), ("crashed", 2)):
            for p in self.points():
                p.write_text(p.read_text().replace('"failed"', f'"{status}"'))
            rows = self.study()["rows"]
            self.assertIn(f"{kept} of 3 points are there", self.errors)
        self.assertEqual([r["status"] for r in rows], ["done"] * 3)

    def test_a_shard_without_points_is_done(self):
        answer = self.study("--shard", "5/9")
        self.assertEqual(answer["rows"], [])
        self.assertIn("no point is in shard 5/9", self.errors)

    def test_a_limit_that_is_none_is_reported_in_one_line(self):
        for limit in ("-1", "0", "soon"):
            self.study("--max-time", limit, code=2)
            self.assertIn("allowed: seconds > 0", self.errors)
            self.assertLess(len(self.errors), 400)

    def test_a_changed_scene_is_noticed(self):
        self.study()
        changed = json.loads(json.dumps(SCENE))
        changed["contact"][0]["friction"] = 0.2
        self.write(changed)
        before = (self.folder / "out/study.csv").read_bytes()
        answer = self.study(code=2)
        self.assertIn("another scene", answer["issues"][0]["found"])
        self.assertEqual((self.folder / "out/study.csv").read_bytes(), before)
        self.write({**SCENE, "title": "only its title"})
        self.study()
        self.assertIn("3 of 3 points are there", self.errors)
        self.write(changed)
        self.study("--restart")
        self.assertNotIn("already", self.errors)

    def test_more_values_continue_from_fewer(self):
        self.study()
        answer = self.call("scene.json", "--sweep", STEPS + ",0.025", "--quantity", "contacts.max",
                           "--output", "out", "--json")
        self.assertIn("3 of 4 points are there", self.errors)
        self.assertEqual(len(answer["rows"]), 4)

    def test_damaged_point_is_run_again(self):
        self.study()
        self.points()[0].write_text("{")
        self.assertEqual(len(self.study()["rows"]), 3)
        self.assertIn("run again", self.errors)

    def test_shards_join_to_the_whole(self):
        both = ["scene.json", "--sweep", STEPS, "--sweep", "contact.0.friction=0.1,0.3", "--quantity",
                "steps", "--json", "--reference", "20"]
        whole = self.call(*both, "--output", "whole", "--jobs", "2")
        for i in ("1", "2"):
            self.call(*both, "--output", "part" + i, "--shard", i + "/2")
        joined = self.call("--merge", "part1", "part2", "--output", "joined", "--json")
        strip = lambda a: [{k: v for k, v in r.items() if "seconds" not in k and k != "pareto"}
                           for r in a["rows"]]
        self.assertEqual(strip(joined), strip(whole))
        self.assertEqual(joined["series"], whole["series"])
        self.assertEqual(len(self.points("joined")), 6)
        alone = self.call("--merge", "part1", "--output", "half", "--json")
        self.assertEqual(len(alone["rows"]), 3)
        self.assertIn("3 points are in none", self.errors)
        self.call("scene.json", "--sweep", "time.step=0.1", "--quantity", "steps", "--output", "other")
        self.call("--merge", "part1", "other", "--output", "no", code=2)
        self.call("--merge", "part1", "nowhere", "--output", "no", code=2)

    def test_reference_from_a_file(self):
        (self.folder / "best.json").write_text('{"quantities": {"steps": 40}}')
        answer = self.study("--reference", "best.json")
        self.assertEqual(answer["rows"][2]["error"], 0.5)
        (self.folder / "best.json").write_text('{"quantities": {"stepz": 40}}')
        self.assertIn("nearest name", self.study("--reference", "best.json", code=2)["issues"][0]["allowed"])

    def test_unknown_quantity_names_the_nearest_and_keeps_the_run(self):
        answer = self.call("scene.json", "--sweep", STEPS, "--quantity", "energy.eror", "--output",
                           "out", "--json", code=2)
        self.assertIn('"energy.error" (nearest name)', answer["issues"][0]["allowed"])
        self.assertEqual(len(self.points()), 1)
        self.study()
        self.assertIn("1 of 3 points are there", self.errors)

    def test_bad_input_runs_nothing(self):
        def refused(*arguments):
            answer = self.call(*arguments, "--output", "bad", "--json", code=2)
            self.assertFalse((self.folder / "bad").exists())
            return json.dumps(answer)
        send = ["scene.json", "--quantity", "steps"]
        self.assertIn("no --sweep", refused(*send))
        self.assertIn("no --quantity", refused("scene.json", "--sweep", STEPS))
        self.assertIn("no scene", refused("--sweep", STEPS, "--quantity", "steps"))
        self.assertIn("no PATH", refused(*send, "--sweep", "time.step"))
        self.assertIn("twice", refused(*send, "--sweep", "time.step=1,1"))
        self.assertIn("step", refused(*send, "--sweep", "time.stop=1,2"))
        self.assertIn("-1", refused(*send, "--sweep", "time.step=0.1,-1"))
        self.assertIn("1 <= i <= n", refused(*send, "--sweep", STEPS, "--shard", "3/2"))
        self.assertIn("finest", refused(*send, "--sweep", STEPS, "--reference", "fines"))

    def test_two_at_once_do_not_share_a_folder(self):
        first = self.start("scene.json", "--sweep", STEPS, "--quantity", "steps", "--output", "out",
                           environment={"AMONTONS_STUB_PAUSE": "0.03"})
        while not (self.folder / "out/study.json").exists():
            time.sleep(0.01)
        self.assertIn("(amontons study scene.json) at work in this folder", self.study(code=2)["issues"][0]["found"])
        first.communicate(timeout=60)
        self.assertEqual(first.returncode, 0)


if __name__ == "__main__":
    reported_skips.main(argv=sys.argv[:1])
