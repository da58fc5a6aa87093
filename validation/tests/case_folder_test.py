#!/usr/bin/env python3
"""Cases that are folders, and the report, from outside: case_folder_test.py STUB

STUB is amontons_stub: no physics, so that runs are quick and can be made to fail.
"""
import csv
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import reported_skips

from wire_on_floor import SCENE

PROGRAM = str(pathlib.Path(sys.argv[1]).resolve())
CASE = {"suite": "benchmarks", "source": "a stub", "verified": "by counting", "scene": "scene.json",
        "measure": [{"quantity": "steps", "reference": 10, "tolerance": 0},
                    {"curve": "r.csv", "x": "step", "y": "time [s]", "tolerance": 1e-9}]}


class CaseFolder(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="amontons_"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        self.make("counted")

    def make(self, name, **change):
        folder = self.folder / name
        folder.mkdir()
        (folder / "case.json").write_text(json.dumps({**CASE, **change}))
        (folder / "scene.json").write_text(json.dumps(SCENE))
        (folder / "r.csv").write_text("step,time [s]\n0,0\n5,0.5\n10,1\n")
        (folder / "README.md").write_text("# Counting\n\nTen steps & nothing\nelse.\n\nMore.\n")
        return "./" + name

    def call(self, *arguments, code=0, environment=None):
        run = subprocess.run([PROGRAM, "validate", *arguments], cwd=self.folder, capture_output=True,
                             text=True, env={**os.environ, **(environment or {})})
        self.assertEqual(run.returncode, code, run.stderr)
        self.errors = run.stderr
        return run.stdout

    def rows(self, *arguments, **options):
        return json.loads(self.call(*arguments, "--json", **options))

    def test_a_folder_is_a_case(self):
        rows = self.rows("./counted")
        self.assertEqual([(r["case"], r["value"], r["passed"]) for r in rows],
                         [("counted", 10, True), ("counted", 0, True)])
        self.assertEqual(rows[0]["source"], "a stub")
        self.assertEqual(rows[1]["curve"]["value"], [0, 0.5, 1])
        listed = json.loads(self.call("./counted", "--list", "--json"))
        self.assertEqual([c["case"] for c in listed], ["counted"])
        self.assertEqual(len(self.rows("./counted", "--suite", "benchmarks")), 2)
        # A case that is named is not passed over.
        self.call("./counted", "--suite", "stability", code=2)
        self.assertIn("counted (benchmarks)", self.errors)

    def test_what_is_left_out_is_reported(self):
        part = self.make("part", measure=[CASE["measure"][0], {"left_out": "no device", "what": "its touch"}])
        rows = self.rows(part)
        self.assertEqual([(r["quantity"], r["left_out"]) for r in rows],
                         [("steps", ""), ("its touch", "no device")])
        self.assertIn("no device", self.call(part))
        self.call(self.make("all", measure=[{"left_out": "no device", "what": "all"}]), code=1)
        self.call(self.make("what", measure=[{"left_out": "no device"}]), code=2)

    def test_a_wrong_result_fails(self):
        wrong = [{"quantity": "steps", "reference": 11, "tolerance": 1e-3}]
        rows = self.rows(self.make("wrong", measure=wrong), "./counted", code=1)
        self.assertEqual([r["passed"] for r in rows], [False, True, True])

    def test_a_run_that_fails_is_no_result(self):
        rows = self.rows("./counted", code=1, environment={"AMONTONS_STUB_FAIL": "3"})
        self.assertEqual({(r["value"], r["passed"]) for r in rows}, {(None, False)})
        self.assertIn("cannot be solved", rows[0]["note"])
        stuck = self.make("stuck", measure=[{"refused": "cannot be solved"}], suite="stability")
        self.call(stuck, environment={"AMONTONS_STUB_FAIL": "3"})
        self.call(stuck, code=1)

    def test_several_scenes_and_overrides(self):
        two = self.make("two", scenes={"short": {"file": "scene.json", "set": ["time.end=0.5"]},
                                       "long": "scene.json"},
                        measure=[{"scene": "short", "quantity": "steps", "reference": 5, "tolerance": 0},
                                 {"scene": "long", "quantity": "steps", "reference": 10, "tolerance": 0}])
        path = self.folder / "two/case.json"
        case = json.loads(path.read_text())
        del case["scene"]
        path.write_text(json.dumps(case))
        self.assertEqual([r["quantity"] for r in self.rows(two)], ["steps, short", "steps, long"])

    def test_bad_cases_are_refused_before_anything_runs(self):
        def refused(*arguments):
            return json.dumps(json.loads(self.call(*arguments, "--json", code=2)))
        self.assertIn("nearest name", refused(self.make("typo", sauce="x")))
        self.assertIn("README.md", refused(self.bare("unread")))
        self.assertIn("no such file", refused("./nowhere"))
        self.assertIn("a folder with a case.json", refused("no-such-case"))
        # What only a run can determine.
        self.assertIn("history.csv", refused(self.make(
            "column", measure=[{**CASE["measure"][1], "y": "tims [s]"}])))
        self.assertIn('"measure.1.quantity"', refused(self.make(
            "quantity", measure=[CASE["measure"][0], {**CASE["measure"][0], "quantity": "stips"}])))

    def bare(self, name):
        folder = self.make(name)
        (self.folder / name / "README.md").unlink()
        return folder

    def test_the_report_regenerates_but_for_times_and_machine(self):
        other = self.make("other", measure=[{"quantity": "contacts.max", "reference": 99, "tolerance": 1e-3}])
        texts = []
        for out in ("a", "b"):
            self.call("./counted", other, "--report", out, code=1)
            files = {p.relative_to(self.folder / out): p.read_text()
                     for p in (self.folder / out).rglob("*") if p.is_file()}
            for name in ("index.html", "validation.csv", "validation.json", "validation.md",
                         "plots/errors.gp", "plots/counted-1.gp"):
                self.assertIn(pathlib.Path(name), files)
            self.assertIn("Ten steps &amp; nothing else.", files[pathlib.Path("index.html")])
            texts.append({n: self.without_times(t) for n, t in files.items()})
        self.assertEqual(texts[0], texts[1])
        rows = list(csv.DictReader((self.folder / "a/validation.csv").read_text().splitlines()))
        self.assertEqual([r["verdict"] for r in rows], ["passed", "passed", "FAILED"])

    @unittest.skipUnless(shutil.which("gnuplot"), "lacks gnuplot")
    def test_the_report_shows_its_plots(self):
        other = self.make("other", measure=[{"quantity": "contacts.max", "reference": 99, "tolerance": 1e-3}])
        self.call("./counted", other, "--report", "shown", code=1)
        self.assertIn('<img src="plots/counted-1.svg"', (self.folder / "shown/index.html").read_text())
        self.assertTrue((self.folder / "shown/plots/errors.svg").exists())

    @staticmethod
    def without_times(text):
        text = re.sub(r"<p>amontons .*</p>", "", text)  # program, machine and date
        text = re.sub(r"<small>[0-9.]+ s</small>", "", text)
        text = re.sub(r'"seconds": [0-9.e-]+', "", text)
        text = re.sub(r",(passed|FAILED),[0-9.]+,", r",\1,,", text)
        return re.sub(r"\| [0-9.]+ \|$", "", text, flags=re.M)

    def test_interrupted(self):
        slow = self.make("slow")
        process = subprocess.Popen([PROGRAM, "validate", "./counted", slow, "--json", "--jobs", "1"],
                                   cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                   env={**os.environ, "AMONTONS_STUB_PAUSE": "0.15"})
        time.sleep(2.5)
        process.send_signal(signal.SIGINT)
        out, errors = process.communicate(timeout=20)
        self.assertEqual(process.returncode, 130, errors)
        self.assertLessEqual({r["case"] for r in json.loads(out)}, {"counted", "slow"})
        self.assertIn("of 2 cases ran", errors)


if __name__ == "__main__":
    reported_skips.main(argv=sys.argv[:1])
