#!/usr/bin/env python3
"""Results are never lost or spoilt: closed streams, two runs in one folder, links, signals, names.

files_test.py PROGRAM [--samples=MAKER]
MAKER is fclib_samples, which makes small contact problems.
"""
import csv
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import reported_skips

PROGRAM = str(pathlib.Path(sys.argv[1]).resolve())
MAKER = next((a.split("=", 1)[1] for a in sys.argv if a.startswith("--samples=")), "")
SCENE = {
    "schema": 1,
    "bodies": {
        "plane": {"kind": "obstacle", "surface": {"generate": "plane"}},
        "block": {"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3, "density": 1000,
                  "mesh": {"generate": "box", "size": [0.1, 0.1, 0.1], "cells": [3, 3, 3], "element": "H8"},
                  "start": {"place": [0, 0, 0.055], "velocity": [0.5, 0.1, 0]}}},
    "contact": [{"between": ["block", "plane"], "friction": 0.3}],
    "gravity": [0, 0, -9.81],
    "time": {"kind": "dynamic", "step": 0.002, "end": 0.1},
    "output": {"every": 10, "picture": False, "plots": False},
}
LONG = ("--set", "time.end=1000")


def rows_of(history):
    rows = list(csv.reader(pathlib.Path(history).read_text().splitlines()))
    return [[v for i, v in enumerate(row) if "seconds" not in rows[0][i]] for row in rows]


def contents(folder):
    return {str(f.relative_to(folder)): os.readlink(f) if f.is_symlink() else f.read_bytes()
            for f in sorted(folder.rglob("*")) if f.is_symlink() or f.is_file()}


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="amontons_"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        (self.folder / "case.json").write_text(json.dumps(SCENE))

    def call(self, *arguments, **options):
        return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, cwd=self.folder, timeout=100, **options)

    def run_case(self, *arguments, **options):
        return self.call("run", "case.json", "--output", "out", *arguments, **options)

    def start(self, *arguments):
        process = subprocess.Popen([PROGRAM, "run", "case.json", "--output", "out", *arguments], cwd=self.folder,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stderr.close)
        return process

    def under_way(self, *arguments):
        process = self.start(*LONG, *arguments)
        history = self.folder / "out/history.csv"
        while not history.exists() or history.read_bytes().count(b"\n") < 5:
            self.assertIsNone(process.poll())
            time.sleep(0.002)
        return process

    def keeps_all(self, *arguments, contains=(), scene=None, **options):
        """Refused with these words, and the folder is as it was."""
        before = contents(self.folder / "out")
        result = self.call("run", scene or "case.json", *arguments, **options)
        self.assertEqual(result.returncode, 2, result.stderr)
        for words in contains:
            self.assertIn(words, result.stderr)
        self.assertEqual(contents(self.folder / "out"), before)


class Streams(Case):
    def test_closed_streams_do_not_become_results(self):
        self.assertEqual(self.run_case().returncode, 0)
        whole = rows_of(self.folder / "out/history.csv")
        for closed in ([0], [1], [2], [0, 1, 2]):
            shutil.rmtree(self.folder / "out")
            subprocess.run([PROGRAM, "run", "case.json", "--output", "out"], cwd=self.folder, stderr=subprocess.DEVNULL,
                           stdout=subprocess.DEVNULL, preexec_fn=lambda: [os.close(fd) for fd in closed], timeout=100)
            self.assertEqual(rows_of(self.folder / "out/history.csv"), whole, closed)
            self.assertEqual(json.loads((self.folder / "out/manifest.json").read_text())["status"], "done")

    def test_a_closed_stdout_is_reported(self):
        result = subprocess.run([PROGRAM, "check", "case.json", "--json"], cwd=self.folder, stderr=subprocess.PIPE, text=True,
                                preexec_fn=lambda: os.close(1), timeout=100)
        self.assertEqual(result.returncode, 3)
        self.assertIn("standard output", result.stderr)


class OneRunAFolder(Case):
    def test_the_second_reports_which_process_is_at_work(self):
        first = self.under_way()
        for more in ((), ("--resume",)):
            second = self.run_case(*more)
            self.assertEqual(second.returncode, 2, second.stderr)
            self.assertIn(f"process {first.pid} (amontons run case.json)", second.stderr)
        first.send_signal(signal.SIGINT)
        first.communicate(timeout=60)
        self.assertEqual(first.returncode, 130)
        self.assertFalse((self.folder / "out/.lock").exists())

    def test_a_killed_one_holds_nothing(self):
        first = self.under_way()
        first.kill()
        first.communicate()
        self.assertEqual(self.run_case().returncode, 0)
        (self.folder / "out/.lock").write_text("process 1 (another)\n")
        self.assertEqual(self.run_case().returncode, 0)

    def test_a_study_and_a_haptic_run_hold_theirs(self):
        first = self.under_way()
        result = self.call("study", "case.json", "--sweep", "time.end=0.1,0.2", "--quantity", "energy.work", "--output", "out")
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn(f"process {first.pid}", result.stderr)
        first.kill()
        first.communicate()


class NothingIsLost(Case):
    def setUp(self):
        super().setUp()
        self.assertEqual(self.run_case().returncode, 0)

    def test_by_what_is_refused(self):
        alone = self.folder / "bin/amontons"  # far from its modules
        alone.parent.mkdir()
        shutil.copy(PROGRAM, alone)
        before = contents(self.folder / "out")
        result = subprocess.run([alone, "run", "case.json", "--output", "out", "--record"], cwd=self.folder, capture_output=True,
                                text=True, env={**os.environ, "AMONTONS_MODULES": str(alone.parent)})
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("no FCLib module", result.stderr)
        self.assertEqual(contents(self.folder / "out"), before)
        self.keeps_all("--output", "out", "--set", "bodies.block.density=1e-15", contains=["/bodies/block", "not positive definite"])
        self.keeps_all("--output", "out", "--set", "bodies.block.start.place=[0, 0, 0.01]", contains=["block"])
        self.keeps_all("--output", "out/history.csv", contains=["out/history.csv"])
        self.keeps_all("--output", "out/history.csv/below", contains=["out/history.csv"])
        long = json.loads(json.dumps(SCENE))
        long["bodies"]["b" * 250] = long["bodies"].pop("block")
        long["contact"][0]["between"][0] = "b" * 250
        (self.folder / "long.json").write_text(json.dumps(long))
        self.keeps_all("--output", "out", scene="long.json", contains=["of at most 100"])

    def test_by_an_output_that_holds_the_scene_or_an_input(self):
        before = contents(self.folder)
        for place in (".", str(self.folder), "out/.."):
            result = self.call("run", "case.json", "--output", place)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn("--output", result.stderr)
        (self.folder / "meshes").mkdir()
        with_file = json.loads(json.dumps(SCENE))
        self.assertEqual(self.call("mesh", "generate", "box", "--size", "0.1,0.1,0.1", "-o", "meshes/block.msh").returncode, 0)
        with_file["bodies"]["block"]["mesh"] = "meshes/block.msh"
        (self.folder / "file.json").write_text(json.dumps(with_file))
        result = self.call("run", "file.json", "--output", "meshes")
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("meshes/block.msh", result.stderr)
        self.assertEqual([f.name for f in (self.folder / "meshes").iterdir()], ["block.msh"])
        self.assertEqual({k: v for k, v in contents(self.folder).items() if k in before}, before)

    def test_by_a_disk_without_room_for_the_beginning(self):
        if subprocess.run(["unshare", "-rm", "mount", "-t", "tmpfs", "-o", "size=64k", "none", "/mnt"],
                          capture_output=True).returncode != 0:
            self.skipTest("lacks the right to mount")
        script = ('mount -t tmpfs -o size=400k none disk && cp -a out disk/out && cp disk/out/history.csv kept && '
                  'dd if=/dev/zero of=disk/fill bs=1k 2>/dev/null; "$0" run case.json --output disk/out; '
                  'echo "code $?"; cmp kept disk/out/history.csv && ls disk/out/checkpoint disk/out/frames | wc -l')
        (self.folder / "disk").mkdir()
        result = subprocess.run(["unshare", "-rm", "sh", "-c", script, PROGRAM], cwd=self.folder, capture_output=True, text=True)
        self.assertIn("code 3", result.stdout, result.stderr)
        self.assertIn("cannot be written", result.stderr)
        self.assertNotIn("differ", result.stdout + result.stderr)

    def test_links_are_replaced(self):
        victims = {}
        for name in ("history.csv", "manifest.json", "case.pvd", "contacts.pvd", "checkpoint", "energy.svg", "energy.gp", "case.png"):
            victim = self.folder / ("victim_" + name)
            victim.write_text("precious")
            place = self.folder / "out" / name
            place.unlink(missing_ok=True)
            place.symlink_to(victim)
            victims[name] = victim
        elsewhere = self.folder / "elsewhere"
        shutil.move(self.folder / "out/frames", elsewhere)
        (self.folder / "out/frames").symlink_to(elsewhere)
        frames = contents(elsewhere)
        result = self.run_case("--set", "output.plots=true", "--set", "output.picture=true")
        self.assertEqual(result.returncode, 0, result.stderr)
        for name, victim in victims.items():
            self.assertEqual(victim.read_text(), "precious", name)
        self.assertEqual(contents(elsewhere), frames)
        self.assertFalse((self.folder / "out/frames").is_symlink())
        self.assertFalse((self.folder / "out/history.csv").is_symlink())

    def test_a_new_run_replaces_the_old_one(self):
        self.assertEqual(self.run_case("--set", "time.end=0.05").returncode, 0)
        self.assertEqual(len(rows_of(self.folder / "out/history.csv")), 27)
        self.assertFalse(list((self.folder / "out").rglob("*.tmp")))
        self.assertFalse((self.folder / "out/frames/block.000050.vtu").exists())


class Signals(Case):
    def test_a_lost_terminal_is_an_interruption(self):
        for which in (signal.SIGHUP, signal.SIGTERM, signal.SIGINT):
            shutil.rmtree(self.folder / "out", ignore_errors=True)
            process = self.under_way()
            process.send_signal(which)
            process.communicate(timeout=60)
            self.assertEqual(process.returncode, 130)
            manifest = json.loads((self.folder / "out/manifest.json").read_text())
            self.assertEqual((manifest["status"], manifest["checkpoint"]), ("interrupted", True))

    def test_nohup_continues(self):
        process = subprocess.Popen(["nohup", PROGRAM, "run", "case.json", "--output", "out"], cwd=self.folder,
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(0.05)
        process.send_signal(signal.SIGHUP)
        self.assertEqual(process.wait(timeout=60), 0)

    def test_the_first_milliseconds_leave_what_resume_understands(self):
        whole = self.run_case()
        self.assertEqual(whole.returncode, 0)
        rows = rows_of(self.folder / "out/history.csv")
        codes = set()
        for k in range(24):
            shutil.rmtree(self.folder / "out", ignore_errors=True)
            process = self.start()
            time.sleep(0.0015 * k)
            process.send_signal((signal.SIGTERM, signal.SIGHUP)[k % 2])
            process.communicate(timeout=60)
            codes.add(process.returncode)
            if process.returncode < 0:  # before main
                self.assertFalse((self.folder / "out").exists())
                continue
            result = self.run_case("--resume")
            self.assertEqual(result.returncode, 0, (k, result.stderr))
            self.assertEqual(rows_of(self.folder / "out/history.csv"), rows, k)
        self.assertIn(130, codes)

    def test_before_the_first_step_older_results_stay(self):
        self.assertEqual(self.run_case().returncode, 0)
        before = contents(self.folder / "out")
        for k in range(6):
            process = self.start("--set", "contact.0.friction=0.4")
            time.sleep(0.001 * k)
            process.send_signal(signal.SIGTERM)
            process.communicate(timeout=60)
            after = contents(self.folder / "out")
            manifest = json.loads(after["manifest.json"])
            self.assertTrue(after == before or manifest["command"][-1] == "contact.0.friction=0.4")
            if after != before:
                break


class Names(Case):
    def test_columns_of_sets_with_commas_and_quotes(self):
        block = json.loads(json.dumps(SCENE))
        msh = self.folder / "block.msh"
        self.assertEqual(self.call("mesh", "generate", "box", "--size", "0.1,0.1,0.1", "-o", str(msh)).returncode, 0)
        name = "bottom, 'glued'"
        msh.write_text(msh.read_text().replace('"z_min"', f'"{name}"'))
        block["bodies"]["block"]["mesh"] = "block.msh"
        block["bodies"]["block"]["hold"] = [{"set": name}]
        (self.folder / "case.json").write_text(json.dumps(block))
        result = self.run_case("--set", "output.plots=true", "--set", "time.end=0.02")
        self.assertEqual(result.returncode, 0, result.stderr)
        rows = list(csv.reader((self.folder / "out/history.csv").read_text().splitlines()))
        self.assertEqual({len(row) for row in rows}, {len(rows[0])})
        self.assertIn(f"block_{name}_force_x [N]", rows[0])

    def test_names_that_no_column_can_bear(self):
        for name in ("a" * 300, "tab\there", "\u202etxet", "line\nbreak"):
            result = self.call("check", "case.json", "--set", "bodies.block.hold=" + json.dumps([{"set": name}]))
            self.assertEqual(result.returncode, 2, name)
            self.assertIn("at most 200 printable bytes", result.stderr)

    def test_an_empty_field_name_is_unknown(self):
        for override in ("..time.step=1", "time.={}", "bodies.block.={\"\": 1}"):
            result = self.call("check", "case.json", "--set", override)
            self.assertEqual(result.returncode, 2, override)
            self.assertIn('field ""', result.stderr)

    def test_bytes_that_are_no_text(self):
        for option in (b"--output=\xff", b"\xc3", b"--set=title=\xed\xa0\x80"):
            result = subprocess.run([PROGRAM.encode(), b"run", b"case.json", option, b"--json"], cwd=self.folder, capture_output=True)
            self.assertEqual(result.returncode, 2)
            json.loads(result.stdout)
            self.assertIn(b"UTF-8", result.stderr)

    def test_json_answers_a_wrong_option(self):
        for wrong in (("run", "case.json", "--outptu", "x", "--json"), ("run", "--json", "case.json", "--threads", "no"),
                      ("check", "--json"), ("solve", "--json", "--tolerance"), ("mesh", "info", "--json", "--nonsense")):
            result = self.call(*wrong)
            self.assertEqual(result.returncode, 2, wrong)
            report = json.loads(result.stdout)
            self.assertEqual(report["status"], "bad_input")
            for issue in report["issues"]:
                self.assertTrue(issue["found"] and issue["allowed"])


class OtherCommands(Case):
    @unittest.skipUnless(MAKER, "lacks the module fclib")
    def test_solve_reports_a_full_disk(self):
        subprocess.run([MAKER, str(self.folder)], check=True, capture_output=True)
        problem = next(iter(sorted(self.folder.glob("*.hdf5"))))
        result = self.call("solve", str(problem), "--output", "/dev/full")
        self.assertEqual(result.returncode, 3, result.stderr)
        self.assertIn("/dev/full: cannot be written: No space left on device", result.stderr)
        # A limit on the size of files is a full disk of one's own.
        limited = subprocess.run([PROGRAM, "solve", str(problem), "--output", "solved.hdf5"], cwd=self.folder, capture_output=True,
                                 text=True, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000)))
        self.assertEqual(limited.returncode, 3, limited.stderr)
        self.assertIn("solved.hdf5: cannot be written: File too large", limited.stderr)

    def test_renumber_refuses_one_file_for_two(self):
        self.assertEqual(self.call("mesh", "generate", "box", "--size", "1,1,1", "-o", "a.msh").returncode, 0)
        for output, permutation in (("b.msh", "b.msh"), ("b.msh", "./b.msh"), ("b.nodes", "b.elements"), ("b.msh", "a.msh")):
            result = self.call("mesh", "renumber", "a.msh", "--output", output, "--permutation", permutation)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertFalse((self.folder / "b.msh").exists())
        self.assertEqual(self.call("mesh", "renumber", "a.msh", "--output", "b.msh", "--permutation", "p.csv").returncode, 0)


if __name__ == "__main__":
    reported_skips.main(argv=sys.argv[:1])
