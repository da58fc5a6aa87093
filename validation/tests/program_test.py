#!/usr/bin/env python3
"""The program from outside: bad input, Ctrl-C, a killed process, a full disk, --resume.

program_test.py PROGRAM [--stub] [--samples=MAKER]
PROGRAM is amontons, or amontons_stub (no physics, so that runs are quick, can be slowed down and
can be made to fail); MAKER is fclib_samples, which makes small contact problems.
"""
import csv
import json
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import xml.etree.ElementTree as xml

import reported_skips

PROGRAM = str(pathlib.Path(sys.argv[1]).resolve())
STUB = "--stub" in sys.argv
MAKER = next((a.split("=", 1)[1] for a in sys.argv if a.startswith("--samples=")), "")
ROOT = pathlib.Path(__file__).resolve().parents[2]

SCENE = {
    "schema": 1,
    "bodies": {
        "floor": {"kind": "obstacle", "surface": {"generate": "plane", "centre": [0, 0, -0.002]}},
        "wire": {
            "kind": "beam",
            "segments": [{"length": 0.1, "radius": 4e-4, "EI": 5e-4, "element": 2.5e-3}],
            "drive": {"insertion": [[0, 0], [1, 0.04]]},
        },
    },
    "contact": [{"between": ["wire", "floor"], "friction": 0.1}],
    "time": {"step": 0.02, "end": 1},
    "output": {"every": 10, "picture": False, "plots": False},
}
if not STUB:
    SCENE["time"]["step"] = 0.001  # long enough to be stopped in the middle
TETRAHEDRON = """v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
"""


def clock_columns(header):
    """Columns of history.csv that differ from run to run."""
    return [i for i, name in enumerate(header) if "seconds" in name]


def processor_seconds(pid):
    fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def steps_of(history):
    """The lines of a history without its times."""
    rows = list(csv.reader(pathlib.Path(history).read_text().splitlines()))
    clocks = clock_columns(rows[0])
    return [[v for i, v in enumerate(row) if i not in clocks] for row in rows]


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="amontons_"))
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)

    def scene(self, change=None, text=None, name="case.json"):
        scene = json.loads(json.dumps(SCENE))
        if change:
            change(scene)
        path = self.folder / name
        path.write_text(text if text is not None else json.dumps(scene))
        return str(path)

    def call(self, *arguments, environment=None, **options):
        return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True,
                              cwd=self.folder, env={**os.environ, **(environment or {})},
                              timeout=100, **options)

    def refused(self, *arguments, contains=(), command="check"):
        """Exit code 2, the words on stderr, nothing on stdout but JSON that states the same."""
        result = self.call(command, *arguments)
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertEqual(result.stdout, "")
        for words in contains:
            self.assertIn(words, result.stderr)
        as_json = self.call(command, *arguments, "--json")
        self.assertEqual(as_json.returncode, 2)
        report = json.loads(as_json.stdout)
        self.assertEqual(report["status"], "bad_input")
        for issue in report["issues"]:
            self.assertTrue(issue["found"] and issue["allowed"], issue)
        return report["issues"]

    def run_to(self, directory, *arguments, **options):
        return self.call("run", self.scene(), "--output", directory, *arguments, **options)


class BadInput(Case):
    def test_missing_file(self):
        self.scene()
        self.refused("cas.json", contains=["cas.json", "no such file", "case.json"])

    def test_no_scene(self):
        self.refused(contains=["no scene"])

    def test_folder_as_scene(self):
        self.refused(".", contains=["a folder"])

    def test_broken_json(self):
        self.refused(self.scene(text='{\n "schema": 1,\n "bodies" 3}'), contains=["line 3, column 11"])
        self.refused(self.scene(text='{\n "time": NaN}'), contains=["line 2"])
        self.refused(self.scene(text=""), contains=["an empty file"])

    def test_unknown_field(self):
        def change(s):
            s["contact"][0]["frction"] = s["contact"][0].pop("friction")
        self.refused(self.scene(change), contains=['/contact/0: found field "frction"', '"friction"'])

    def test_wrong_type(self):
        self.refused(self.scene(lambda s: s["time"].update(step="fast")),
                     contains=['/time/step: found "fast", allowed: a number >= 1e-12 and <= 1e+12 [s]'])

    def test_out_of_range(self):
        self.refused(self.scene(lambda s: s["bodies"]["wire"]["segments"][0].update(radius=-1)),
                     contains=["/bodies/wire/segments/0/radius: found -1, allowed: a number >= 1e-09"])
        self.refused(self.scene(lambda s: s["contact"][0].update(friction=-0.1)),
                     contains=["/contact/0/friction: found -0.1"])
        self.refused(self.scene(lambda s: s["bodies"]["wire"]["segments"][0].update(EI=-1)),
                     contains=["/EI: found -1", "[N m^2]"])

    def test_mesh_not_found(self):
        surface = {"file": "vessel.stl", "scale": 0.001}
        self.refused(self.scene(lambda s: s["bodies"]["floor"].update(surface=surface)),
                     contains=["vessel.stl", "no such file"])

    def test_mesh_unreadable(self):
        (self.folder / "vessel.obj").write_text("v 0 0 zero\nf 1 2 3\n")
        (self.folder / "vessel.docx").write_text("no mesh")
        for name, words in (("vessel.obj", "line 1"), ("vessel.docx", ".docx")):
            self.refused(self.scene(lambda s: s["bodies"]["floor"].update(surface={"file": name})),
                         contains=[name, words])

    def test_mesh_open(self):
        (self.folder / "open.obj").write_text(TETRAHEDRON.rsplit("f", 1)[0])
        issues = self.refused(self.scene(
            lambda s: s["bodies"]["floor"].update(surface={"file": "open.obj"})), contains=["open"])
        self.assertEqual(issues[0]["place"], "/bodies/floor/side")

    def test_mesh_self_intersecting(self):
        second = re.sub(r"^v (\S+) (\S+) (\S+)", r"v \1.1 \2.1 \3.1", TETRAHEDRON, flags=re.M)
        second = re.sub(r"(?m)^f (\d) (\d) (\d)",
                        lambda m: "f " + " ".join(str(int(i) + 4) for i in m.groups()), second)
        (self.folder / "two.obj").write_text(TETRAHEDRON + second + "\n")
        self.refused(self.scene(lambda s: s["bodies"]["floor"].update(surface={"file": "two.obj"})),
                     contains=["two.obj", "intersect"])

    def test_wire_and_path(self):
        self.refused(self.scene(lambda s: s["bodies"]["wire"]["drive"].update(
            insertion=[[0, 0], [1, 0.2]])), contains=["/drive/insertion: found 0.2, allowed: < 0.1 [m]"])
        self.refused(self.scene(lambda s: s["bodies"]["wire"]["segments"][0].update(element=0.2)),
                     contains=["/segments/0/element"])
        tube = {"generate": "tube", "radius": 0.004,
                "centreline": {"pieces": [{"length": 0.01}, {"radius": 0.005, "angle": 3}]}}

        def coarse(s):
            s["bodies"]["floor"]["surface"] = tube
            s["bodies"]["wire"]["segments"][0]["element"] = 0.01
        self.refused(self.scene(coarse), contains=["does not follow the bends"])

    @unittest.skipIf(STUB, "the stub has no walls")
    def test_wire_starts_in_the_wall(self):
        self.refused(self.scene(lambda s: s["bodies"]["wire"].update(
            introducer={"at": [0, 0, -0.01]})), contains=["wire"])

    def test_all_together(self):
        def change(s):
            s["time"]["step"] = -1
            s["contact"][0]["between"][1] = "flor"
            s["bodies"]["wire"]["segments"][0]["radius"] = "thin"
            s["outptu"] = {}
        issues = self.refused(self.scene(change), contains=['"floor" (nearest name)', '"output"'])
        self.assertEqual(len(issues), 4)

    def test_overrides(self):
        scene = self.scene()
        self.refused(scene, "--set", "contact.0.frction=0.1", contains=['"friction"'])
        self.refused(scene, "--set", "bodies/wir/segments/0/EI=1", contains=['"wire"'])
        self.refused("--set", "time.end=-1", scene, contains=["(--set)"])

    def test_arguments(self):
        for arguments, words in ((["rum", "x"], "run"), (["run", "--ouput", "x"], "--output"), ([], "")):
            result = self.call(*arguments)
            self.assertEqual(result.returncode, 2, arguments)
            self.assertIn(words, result.stderr)
            self.assertEqual(result.stdout, "")

    def test_output_not_writable(self):
        (self.folder / "file").write_text("x")
        for bad in ("file", "file/below", "/proc/amontons"):
            self.refused(self.scene(), "--output", bad, command="run", contains=[bad])


class Resume(Case):
    def test_without_checkpoint(self):
        self.refused(self.scene(), "--output", "none", "--resume", command="run", contains=["none"])
        self.run_to("out")
        os.remove(self.folder / "out/checkpoint")
        self.refused(self.scene(), "--output", "out", "--resume", command="run",
                     contains=["checkpoint", "no such file"])

    def test_damaged_checkpoint_loses_nothing(self):
        self.run_to("out")
        before = steps_of(self.folder / "out/history.csv")
        file = self.folder / "out/checkpoint"
        whole = file.read_bytes()
        flipped = whole[:200] + bytes([whole[200] ^ 1]) + whole[201:]
        for damaged in (b"", whole[:-1], whole[:40], flipped, b"hello" * 100):
            file.write_bytes(damaged)
            self.refused(self.scene(), "--output", "out", "--resume", command="run", contains=["checkpoint"])
        self.assertEqual(steps_of(self.folder / "out/history.csv"), before)

    def test_foreign_checkpoint(self):
        self.run_to("out")
        self.refused(self.scene(), "--set", "contact.0.friction=0.3", "--output", "out", "--resume",
                     command="run", contains=["another scene"])

    @unittest.skipIf(STUB, "falls, in the program alone")
    def test_checkpoint_of_another_file_of_the_same_size(self):
        shape = self.folder / "tool.obj"
        shape.write_text(TETRAHEDRON)
        scene = self.scene(text=json.dumps({
            "schema": 1, "bodies": {"tool": {"kind": "rigid", "mass": 1, "shape": {"file": "tool.obj"}}},
            "gravity": [0, 0, -9.81], "time": {"kind": "dynamic", "step": 0.01, "end": 0.1},
            "output": {"picture": False, "plots": False}}))
        self.assertEqual(self.call("run", scene, "--output", "out").returncode, 0)
        self.assertEqual(self.call("run", scene, "--output", "out", "--resume").returncode, 0)
        shape.write_text(TETRAHEDRON.replace("v 1 0 0", "v 2 0 0"))
        self.refused(scene, "--output", "out", "--resume", command="run", contains=["another scene"])

    def files(self, directory):
        """All results by name, without what reports the time or the folder."""
        found = {}
        for file in sorted((self.folder / directory).rglob("*")):
            name = str(file.relative_to(self.folder / directory))
            if file.is_dir() or name in ("manifest.json", "checkpoint"):
                continue
            found[name] = steps_of(file) if name == "history.csv" else file.read_bytes()
        return found

    def check_continuation(self, directory):
        result = self.run_to(directory, "--resume")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertEqual(self.run_to("whole").returncode, 0)
        whole, resumed = self.files("whole"), self.files(directory)
        self.assertEqual(sorted(whole), sorted(resumed))
        for name in whole:
            self.assertEqual(whole[name], resumed[name], name)
        again = self.run_to(directory, "--resume")  # nothing is left to do, and nothing changes
        self.assertEqual(again.returncode, 0, again.stderr)
        self.assertEqual(self.files(directory), whole)

    def start_slow(self, directory, steps):
        """A run that is under way."""
        pause = {"AMONTONS_STUB_PAUSE": "0.02"} if STUB else {}
        process = subprocess.Popen([PROGRAM, "run", self.scene(), "--output", directory],
                                   cwd=self.folder, env={**os.environ, **pause},
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stderr.close)
        history = self.folder / directory / "history.csv"
        for _ in range(2000):
            if history.exists() and history.read_bytes().count(b"\n") > steps:
                break
            time.sleep(0.002)
        return process

    def check_readable(self, directory, finished=True):
        base = self.folder / directory
        text = (base / "history.csv").read_text()
        self.assertTrue(text.endswith("\n"))
        columns = {len(row) for row in csv.reader(text.splitlines())}
        self.assertEqual(len(columns), 1)
        for collection in base.glob("*.pvd"):
            for entry in xml.parse(collection).getroot().iter("DataSet"):
                data = (base / entry.get("file")).read_bytes()
                self.assertTrue(data.endswith(b"</VTKFile>\n"), entry.get("file"))
        if finished:
            self.assertFalse(list(base.rglob("*.tmp")))
        return json.loads((base / "manifest.json").read_text())

    def test_interrupted(self):
        process = self.start_slow("out", 17)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        if not STUB and process.returncode == 0:
            self.skipTest("the run was over before the signal came")
        self.assertEqual(process.returncode, 130, errors)
        manifest = self.check_readable("out")
        self.assertEqual(manifest["status"], "interrupted")
        steps = steps_of(self.folder / "out/history.csv")
        self.assertEqual(int(steps[-1][0]), manifest["steps"])
        self.assertLess(manifest["time"], 1)
        self.check_continuation("out")

    def test_killed(self):
        process = self.start_slow("out", 23)
        process.kill()
        process.communicate()
        if not STUB and process.returncode == 0:
            self.skipTest("the run was over before the signal came")
        self.assertEqual(self.check_readable("out", finished=False)["status"], "running")
        self.check_continuation("out")

    @unittest.skipIf(STUB, "the stub has no bodies")
    def test_a_run_that_was_over_resumes_to_the_same_results(self):
        # Killed after the last checkpoint, before the manifest.
        scene = ROOT / "examples/first_block/scene.json"
        for more in (["--output", "out"], ["--output", "out", "--resume"]):
            result = subprocess.run([PROGRAM, "run", str(scene), "--json", "--set", "time.end=0.02",
                                     "--set", "output.picture=false", "--set", "output.plots=false", *more],
                                    cwd=self.folder, capture_output=True, text=True)
            self.assertEqual(result.returncode, 0, result.stderr)
            report = json.loads(result.stdout)
            if "--resume" not in more:
                first = report
        self.assertIn("plate_on_ball_force_z", first["quantities"])
        for key in ("quantities", "energy", "certificate", "contacts", "steps"):
            self.assertEqual(report[key], first[key], key)

    @unittest.skipUnless(STUB, "needs a slow step")
    def test_second_interrupt_ends_at_once(self):
        process = subprocess.Popen([PROGRAM, "run", self.scene(), "--output", "out"], cwd=self.folder,
                                   env={**os.environ, "AMONTONS_STUB_PAUSE": "20"},
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        while not (self.folder / "out/manifest.json").exists():
            time.sleep(0.01)
        time.sleep(0.1)
        for _ in range(50):  # on a busy machine two may come as one
            process.send_signal(signal.SIGINT)
            try:
                process.wait(timeout=0.1)
                break
            except subprocess.TimeoutExpired:
                pass
        self.assertEqual(process.wait(timeout=5), 130)

    @unittest.skipUnless(STUB, "needs a step that fails")
    def test_failed_solve(self):
        result = self.run_to("out", "--json", environment={"AMONTONS_STUB_FAIL": "33"})
        self.assertEqual(result.returncode, 3)
        report = json.loads(result.stdout)
        self.assertEqual((report["status"], report["steps"]), ("failed", 33))
        self.assertIn("cannot be solved", result.stderr)
        self.assertEqual(self.check_readable("out")["exit_code"], 3)
        self.assertTrue((self.folder / "out/frames/wire.000033.vtp").exists())


class FullDisk(Case):
    def test_file_size_limit(self):
        self.assertEqual(self.run_to("probe").returncode, 0)
        limit = (self.folder / "probe/history.csv").stat().st_size * 2 // 3
        result = self.run_to("out", preexec_fn=lambda: resource.setrlimit(
            resource.RLIMIT_FSIZE, (limit, limit)))
        self.assertEqual(result.returncode, 3, result.stderr)
        self.assertIn("cannot be written", result.stderr)

    def test_full_disk(self):
        disk = self.folder / "disk"
        disk.mkdir()
        mount = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(disk)],
                               capture_output=True)
        if mount.returncode != 0:
            self.skipTest("lacks the right to mount")
        try:
            result = self.run_to("disk/out", "--json", "--set", "output.every=2")
            self.assertEqual(result.returncode, 3, result.stderr)
            self.assertEqual(json.loads(result.stdout)["status"], "failed")
            self.assertIn("No space left", result.stderr)
            base = disk / "out"
            text = (base / "history.csv").read_text()
            self.assertTrue(text.endswith("\n"))
            frames = sorted((base / "frames").glob("wire.0*.vtp"))
            self.assertTrue(frames)
            for frame in frames:
                self.assertTrue(frame.read_bytes().endswith(b"</VTKFile>\n"))
        finally:
            subprocess.run(["umount", str(disk)], check=True)


class Output(Case):
    def test_json_alone_on_stdout(self):
        result = self.run_to("out", "--json", "--verbose")
        self.assertEqual(result.returncode, 0, result.stderr)
        report = json.loads(result.stdout)
        for key in ("status", "steps", "time", "seconds", "contacts", "certificate", "energy",
                    "peak_memory", "modules", "quantities", "undetermined", "undetermined_not_examined"):
            self.assertIn(key, report)
        self.assertEqual(set(report["seconds"]), {"total", "read", "offline", "free_motion",
                         "detection", "compliance", "contact_solve", "correction", "output"})
        self.assertLessEqual({"worst_error", "worst_penetration", "worst_overlap", "overlap_not_measured",
                              "worst_cone_violation", "uncertified_steps"},
                             set(report["certificate"]))
        self.assertEqual(set(report["energy"]), {"work", "work_absolute", "elastic", "kinetic",
                         "elastic_start", "kinetic_start", "friction", "released", "error"})
        self.assertIn("branch", report["quantities"])
        listed = self.call("check", self.scene(), "--quantities", "--json")  # what a study may name
        self.assertLessEqual({row["name"] for row in json.loads(listed.stdout)}, set(report["quantities"]))
        self.assertEqual(report["status"], "done")
        self.assertNotIn("\r", result.stderr)  # no bar in a log

    def test_manifest_repeats_the_run(self):
        self.run_to("out", "--set", "contact.0.friction=0.2")
        manifest = json.loads((self.folder / "out/manifest.json").read_text())
        self.assertEqual(manifest["exit_code"], 0)
        resolved = manifest["scene"]["resolved"]
        self.assertEqual(resolved["contact"][0]["friction"], 0.2)
        again = self.scene(text=json.dumps(resolved), name="again.json")
        self.assertEqual(self.call("run", again, "--output", "again").returncode, 0)
        self.assertEqual(steps_of(self.folder / "out/history.csv"),
                         steps_of(self.folder / "again/history.csv"))

    @unittest.skipIf(STUB, "physics")
    def test_forces_of_a_table_that_the_laws_leave_open(self):
        """A square table on one floor, and with each leg on a block of its own."""
        points = [(x, y, 0.5) for y in (-1, 0, 1) for x in (-1, 0, 1)]  # below the plate
        points += [(x, y, 0.6) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]  # 9 to 12, above
        faces = [(9, 10, 11), (9, 11, 12)]
        for below, a, b in (((0, 1, 2), 9, 10), ((2, 5, 8), 10, 11), ((8, 7, 6), 11, 12), ((6, 3, 0), 12, 9)):
            faces += [(below[0], below[1], a), (below[1], b, a), (below[1], below[2], b)]
        for i, j in ((0, 0), (1, 0), (0, 1), (1, 1)):  # four legs, each a pyramid on its tip
            points.append((i - 0.5, j - 0.5, 0))
            square = [3 * j + i, 3 * j + i + 1, 3 * j + i + 4, 3 * j + i + 3]
            faces += [(square[(k + 1) % 4], square[k], len(points) - 1) for k in range(4)]
        (self.folder / "table.obj").write_text(
            "".join("v {} {} {}\n".format(*p) for p in points) +
            "".join("f {} {} {}\n".format(*(k + 1 for k in f)) for f in faces))
        table = {"kind": "rigid", "shape": {"file": "table.obj"}, "mass": 1}
        floor = {"kind": "obstacle", "surface": {"generate": "plane"}}
        blocks = {f"block{i}{j}": {"kind": "rigid", "shape": {"generate": "box", "size": [0.2, 0.2, 0.1]}, "mass": 2,
                                   "start": {"place": [i - 0.5, j - 0.5, -0.05]}} for i in (0, 1) for j in (0, 1)}

        def undetermined(friction, **bodies):
            scene = {"schema": 1, "bodies": {"table": table, **bodies}, "gravity": [0, 0, -1],
                     "contact": [{"between": ["*", "*"], "friction": friction}], "time": {"step": 1, "end": 1},
                     "output": {"picture": False, "plots": False}}
            path = self.scene(text=json.dumps(scene), name="table.json")
            result = self.call("run", path, "--output", "table", "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            report = json.loads(result.stdout)
            self.assertEqual(report["undetermined_not_examined"], [])
            manifest = json.loads((self.folder / "table/manifest.json").read_text())
            self.assertEqual(manifest["undetermined"], report["undetermined"])
            return report["undetermined"]

        self.assertEqual(undetermined(0, floor=floor), [])
        self.assertEqual(undetermined(0.5, floor=floor), [])
        floor["surface"]["centre"] = [0, 0, -0.1]
        for friction in (0, 0.5):
            found = undetermined(friction, floor=floor, **blocks)
            legs = [u for u in found if "table" in u["pair"]]
            self.assertEqual(len(legs), 4)
            for u in legs:
                self.assertIn("normal", u["directions"])
                self.assertEqual("tangential" in u["directions"], friction > 0)
                if friction == 0:
                    self.assertAlmostEqual(u["normal_force"][0], 0, 6)
                    self.assertAlmostEqual(u["normal_force"][1], 0.5, 6)
                else:  # tips that press outwards against each other bend nothing
                    self.assertGreaterEqual(u["normal_force"][1], 0.5 - 1e-6)
            below = [u for u in found if "floor" in u["pair"]]
            self.assertEqual(len(below), 4)
            for u in below:
                self.assertGreaterEqual(u["normal_force"][0], 2 - 1e-6)

    @unittest.skipIf(STUB, "physics")
    def test_long_steps_keep_the_energy_balance(self):
        """Where a step is cut short by a kink of the forces alone, relaxing it would add an error."""
        result = self.call("run", ROOT / "examples/catheter/scene.json", "--output", "out", "--json",
                           "--set", "time.step=0.25", "--set", "output.every=1000",
                           "--set", "output.picture=false", "--set", "output.plots=false")
        self.assertEqual(result.returncode, 0, result.stderr)
        report = json.loads(result.stdout)
        self.assertEqual(report["certificate"]["uncertified_steps"], 0)
        self.assertEqual(report["quantities"]["passed_through"], 0)
        energy = report["energy"]
        self.assertLess(abs(energy["error"]), 0.01 * energy["work_absolute"])

    def test_threads_in_any_order(self):
        self.assertEqual(self.run_to("one").returncode, 0)
        self.assertEqual(self.run_to("two", "--threads", "2", "--any-order").returncode, 0)
        self.assertEqual(steps_of(self.folder / "one/history.csv"),
                         steps_of(self.folder / "two/history.csv"))

    @unittest.skipIf(STUB, "the stub has no bodies")
    def test_threads_of_solids(self):
        scene = ROOT / "examples/first_block/scene.json"
        histories = []
        for threads in (1, 2, 3):
            result = subprocess.run(
                [PROGRAM, "run", str(scene), "--output", f"threads{threads}", "--threads", str(threads), "--set",
                 "time.end=0.02", "--set", "output.picture=false", "--set", "output.plots=false"],
                cwd=self.folder, capture_output=True, text=True)
            self.assertEqual(result.returncode, 0, result.stderr)
            histories.append(steps_of(self.folder / f"threads{threads}/history.csv"))
        self.assertGreater(len(histories[0]), 5)
        self.assertEqual(histories[0], histories[1])
        self.assertEqual(histories[0], histories[2])

    @unittest.skipIf(STUB, "the stub has no bodies")
    def test_one_thread_unless_more_are_requested(self):
        """BLAS, once it is loaded, starts none either: they would spin."""
        environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
        with subprocess.Popen(
                [PROGRAM, "run", str(ROOT / "examples/first_block/scene.json"), "--output", "out", "--set",
                 "time.end=1000", "--set", "output.picture=false", "--set", "output.plots=false"],
                cwd=self.folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as run:
            history = self.folder / "out/history.csv"
            until = time.monotonic() + 60
            while not (history.exists() and len(history.read_text().splitlines()) > 4):
                self.assertIsNone(run.poll())
                self.assertLess(time.monotonic(), until)
                time.sleep(0.01)
            maps = pathlib.Path(f"/proc/{run.pid}/maps").read_text()
            threads = len(list(pathlib.Path(f"/proc/{run.pid}/task").iterdir()))
            run.send_signal(signal.SIGINT)
        self.assertEqual(run.returncode, 130)
        self.assertIn("libcholmod", maps)
        if "libtsan" not in maps: # has a thread of its own
            self.assertEqual(threads, 1)

    def test_quiet(self):
        result = self.run_to("out", "--quiet")
        self.assertEqual((result.returncode, result.stdout, result.stderr), (0, "", ""))

    def test_a_new_run_leaves_nothing_of_the_old(self):
        self.run_to("out", "--set", "output.every=7")
        self.run_to("out")
        names = {f.name for f in (self.folder / "out/frames").iterdir()}
        self.assertNotIn("wire.000007.vtp", names)
        self.assertIn("wire.000010.vtp", names)
        (self.folder / "out/notes.pvd").write_text("mine")
        self.call("run", self.scene(name="other.json"), "--output", "out")
        collections = {f.name for f in (self.folder / "out").glob("*.pvd")}
        self.assertEqual(collections, {"other.pvd", "contacts.pvd", "notes.pvd"})

    @unittest.skipIf(STUB, "the stub has no bodies")
    def test_check_reports_side_volume_and_holes_of_surfaces_and_the_size_of_sets(self):
        ball = {"schema": 1, "bodies": {
            "room": {"kind": "obstacle", "side": "inside", "surface": {"generate": "ball", "radius": 1}},
            "tube": {"kind": "obstacle", "surface": {"generate": "tube", "radius": 0.1, "centreline": {
                "start": [5, 0, 0], "pieces": [{"length": 1}]}}},
            "block": {"kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3,
                      "mesh": {"generate": "box", "size": [0.2, 0.1, 0.1], "cells": [4, 2, 2], "element": "H8"},
                      "sets": {"root": {"plane": {"at": [-0.1, 0, 0], "normal": [1, 0, 0]}}},
                      "hold": [{"set": "root"}]}},
            "time": {"step": 1, "end": 1}}
        (self.folder / "room.json").write_text(json.dumps(ball))
        result = self.call("check", "room.json", "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        plan = json.loads(result.stdout)
        room, tube = plan["surfaces"]
        self.assertEqual((room["side"], room["holes"]), ("inside", 0))
        self.assertAlmostEqual(room["volume"], 4.18879, delta=0.05)
        self.assertEqual((tube["side"], tube["holes"]), ("inside", 2))
        self.assertAlmostEqual(tube["volume"], 0.0314159, delta=4e-4)
        sets = {s["name"]: s for s in plan["bodies"][2]["sets"]}
        self.assertEqual((sets["root"]["faces"], sets["root"]["nodes"]), (4, 9))
        self.assertAlmostEqual(sets["root"]["area"], 0.01, 12)

    def test_check(self):
        result = self.call("check", self.scene(), "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        plan = json.loads(result.stdout)
        self.assertEqual(set(plan), {"bodies", "surfaces", "pairs", "uses", "leaves_out", "predicted"})
        self.assertEqual([s["name"] for s in plan["surfaces"]], ["floor"])
        self.assertEqual([b["name"] for b in plan["bodies"]], ["floor", "wire"])
        self.assertEqual(plan["pairs"], [{"a": "wire", "b": "floor", "law": "coulomb", "friction": 0.1}])
        self.assertGreater(plan["predicted"]["memory"], 1e6)
        self.assertEqual(list(self.folder.iterdir()), [self.folder / "case.json"])

    def test_check_of_solids_and_rigid_bodies(self):
        block = {"kind": "solid", "mesh": {"generate": "box", "size": [1, 1, 1]}, "youngs_modulus": 1e6,
                 "poisson_ratio": 0.3, "density": 1000}
        scene = {
            "schema": 1,
            "bodies": {
                "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
                "lower": dict(block, start={"place": [0, 0, 0.5]}),
                "upper": dict(block, start={"place": [0, 0, 1.5]}, motion="corotational"),
                "stone": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.2}, "mass": 1,
                          "start": {"place": [0, 0, 2.5]}},
            },
            "contact": [{"between": ["*", "*"], "friction": 0.2}],
            "gravity": [0, 0, -9.81],
            "time": {"kind": "dynamic", "step": 0.01, "end": 1},
        }
        (self.folder / "bodies.json").write_text(json.dumps(scene))
        result = self.call("check", "bodies.json", "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        plan = json.loads(result.stdout)
        uses = "\n".join(plan["uses"])
        for part in ("linear solids", "corotational solids", "CHOLMOD", "METIS", "mortar", "rigid bodies",
                     "implicit dynamic", "Coulomb"):
            self.assertIn(part, uses)
        self.assertNotIn("exact beams", uses)
        out = [left["what"] for left in plan["leaves_out"]]
        self.assertIn("beams", out)
        self.assertNotIn("CHOLMOD", out)
        self.assertNotIn("inertia", out)
        self.assertNotIn("beam", plan["predicted"]["path"])
        if not STUB:
            kinds = {b["name"]: (b["kind"], b["unknowns"]) for b in plan["bodies"]}
            self.assertEqual(kinds["stone"], ("rigid", 6))
            self.assertEqual(kinds["lower"][0], "solid")
        rigid = dict(scene, bodies={n: scene["bodies"][n] for n in ("floor", "stone")})
        (self.folder / "bodies.json").write_text(json.dumps(rigid))
        plan = json.loads(self.call("check", "bodies.json", "--json").stdout)
        self.assertIn("CHOLMOD", [left["what"] for left in plan["leaves_out"]])
        self.assertNotIn("mortar", "\n".join(plan["uses"]))

    def test_the_table_of_bodies_names_no_branch(self):
        if STUB:
            self.skipTest("needs bodies")
        scene = {
            "schema": 1,
            "bodies": {"stone": {"kind": "rigid", "shape": {"generate": "ball", "radius": 0.2}, "mass": 1}},
            "time": {"kind": "dynamic", "step": 0.1, "end": 0.2},
            "output": {"picture": False, "plots": False},
        }
        (self.folder / "bodies.json").write_text(json.dumps(scene))
        result = self.call("run", "bodies.json", "--output", "out")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertNotIn("branch", result.stdout)
        self.assertIn("branch", self.run_to("out2").stdout)

    def test_help_and_version(self):
        for command in ([], ["run"], ["check"], ["solve"], ["schema"], ["validate"], ["render"], ["completion"]):
            for flag in ("--help", "--version"):
                result = self.call(*command, flag)
                self.assertEqual((result.returncode, result.stderr), (0, ""), (command, flag))
                self.assertTrue(result.stdout)

    def test_completion(self):
        script = self.folder / "completion"
        script.write_text(self.call("completion", "bash").stdout)
        self.assertEqual(self.call("completion").stdout, script.read_text())
        self.assertEqual(self.call("completion", "fish").returncode, 2)
        answer = subprocess.run(
            ["bash", "-c", f"source {script}; COMP_WORDS=(amontons run --res); COMP_CWORD=2; "
             "_amontons; echo ${COMPREPLY[@]}"], capture_output=True, text=True)
        self.assertEqual(answer.stdout.strip(), "--resume", answer.stderr)

    def test_small_scenes_load_no_heavy_library(self):
        """Of a beam and of a rigid body, by what the loader states from the first to the last moment."""
        (self.folder / "box.json").write_text(json.dumps({
            "schema": 1,
            "bodies": {"plate": {"kind": "obstacle", "surface": {"generate": "plane"}},
                       "box": {"kind": "rigid", "shape": {"generate": "box", "size": [0.1, 0.1, 0.1]},
                               "density": 1000, "start": {"place": [0, 0, 0.05]}}},
            "contact": [{"between": ["box", "plate"], "friction": 0.5}],
            "gravity": [0, 0, -9.81],
            "time": {"kind": "dynamic", "step": 0.001, "end": 0.002},
            "output": {"picture": False, "plots": False}}))
        scenes = [self.scene()] if STUB else [self.scene(), str(self.folder / "box.json")] # the stub has no bodies
        for scene in scenes:
            result = self.call("run", scene, "--json", "--output", pathlib.Path(scene).stem,
                               environment={"LD_DEBUG": "files", "LD_DEBUG_OUTPUT": str(self.folder / "loader")})
            self.assertEqual(result.returncode, 0, result.stderr)
            loaded = ""
            for output in self.folder.glob("loader.*"):
                loaded += output.read_text(errors="replace")
                output.unlink()
            self.assertIn("libc.so", loaded) # the loader did state
            for library in ("libmpi", "libpetsc", "libvtk", "libCGAL", "libhdf5", "libamontons-",
                            "libcholmod", "libblas", "libopenblas"):
                self.assertNotIn(library, loaded)
            if "libasan" not in loaded and "libtsan" not in loaded:
                self.assertLess(json.loads(result.stdout)["peak_memory"], 15e6)


@unittest.skipUnless(MAKER, "a stub" if STUB else "lacks the module fclib")
class Solve(Case):
    """amontons solve, on files that MAKER wrote."""

    @classmethod
    def setUpClass(cls):
        cls.samples = pathlib.Path(tempfile.mkdtemp(prefix="amontons_"))
        subprocess.run([MAKER, str(cls.samples)], check=True)

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.samples, ignore_errors=True)

    def file(self, name):
        return str(self.samples / (name + ".hdf5"))

    def solve(self, name, *arguments, code=0):
        result = self.call("solve", self.file(name), "--json", *arguments)
        self.assertEqual(result.returncode, code, result.stderr)
        return json.loads(result.stdout)

    def test_converged(self):
        for name, contacts, level in (("tower", 4, "velocity"), ("room", 2, "position"),
                                      ("global", 2, "velocity"), ("glued", 3, "velocity"),
                                      ("empty", 0, "position")):
            report = self.solve(name)
            self.assertEqual((report["status"], report["contacts"], report["level"]),
                             ("converged", contacts, level))
            self.assertLessEqual(report["error"], report["threshold"])
            self.assertEqual(report["tolerance"], 1e-8)
            for key in ("solver", "iterations", "seconds", "rank_deficient", "worst_penetration",
                        "worst_cone_violation", "worst_contact"):
                self.assertIn(key, report)
            self.assertNotIn("proof", report)
            for point in report["history"]:
                self.assertEqual(set(point), {"iteration", "seconds", "error"})

    def test_every_solver(self):
        issues = self.refused(self.file("global"), "--solver", "?", command="solve", contains=["(--solver)"])
        names = issues[0]["allowed"].split(", ")
        self.assertIn("auto", names)
        for name in names:
            result = self.call("solve", self.file("global"), "--json", "--solver", name)
            self.assertIn(result.returncode, (0, 3), (name, result.stderr))
            self.assertIn(json.loads(result.stdout)["status"],
                          ("converged", "stagnated", "infeasible", "out_of_time"))

    def test_infeasible(self):
        report = self.solve("infeasible", code=3)
        self.assertEqual(report["status"], "infeasible")
        self.assertEqual(report["proof"]["contacts"], [0, 1])
        self.assertAlmostEqual(report["proof"]["closing"], 1e-6, 12)
        self.assertGreater(report["proof"]["size"], 0)
        human = self.call("solve", self.file("infeasible"))
        self.assertEqual(human.returncode, 3)
        self.assertIn("infeasible", human.stdout)
        self.assertIn("contacts 0, 1", human.stdout)

    def test_limits(self):
        report = self.solve("tower", "--max-iterations", "3", "--solver", "nsgs", code=3)
        self.assertEqual((report["status"], report["iterations"]), ("stagnated", 3))
        report = self.solve("tower", "--max-time", "0", "--solver", "nsgs", code=3)
        self.assertEqual(report["status"], "out_of_time")
        loose = self.solve("tower", "--tolerance", "1e-2", "--solver", "nsgs")
        tight = self.solve("tower", "--tolerance", "1e-12", "--solver", "nsgs")
        self.assertLess(loose["iterations"], tight["iterations"])
        self.assertLessEqual(tight["error"], 1e-12)

    def test_what_another_program_wrote_is_judged_by_the_same_measure(self):
        for name in ("tower", "global", "glued"):
            solved = self.folder / (name + "_judged.hdf5")
            ours = self.solve(name, "--tolerance", "1e-6", "--output", solved)
            result = self.call("solve", solved, "--judge", "--tolerance", "1e-6", "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            judged = json.loads(result.stdout)
            for key in ("status", "contacts"):
                self.assertEqual(judged[key], ours[key])
            for key in ("error", "worst_penetration", "worst_cone_violation"):
                self.assertAlmostEqual(judged[key], ours[key], delta=1e-3 * abs(ours[key]) + 1e-15)
            # The same reaction is none to a tolerance that it does not touch.
            strict = self.call("solve", solved, "--judge", "--tolerance", str(0.1 * ours["error"]), "--json")
            if ours["error"] > 1e-13:
                self.assertEqual((strict.returncode, json.loads(strict.stdout)["status"]), (3, "stagnated"))
        self.refused(self.file("tower"), "--judge", command="solve", contains=["/solution/r", "nothing"])

    def test_an_outside_solver_is_run_and_judged(self):
        script = self.folder / "mine.sh"
        script.write_text(f'#!/bin/sh\necho solving\n"{PROGRAM}" solve "$2" --solver "$1" --tolerance 1e-3 -o "$3"\n')
        script.chmod(0o755)
        report = self.solve("tower", "--solver-command", f"'{script}' nsgs", "--tolerance", "1e-3")
        self.assertEqual(report["status"], "converged")
        self.assertIn("mine.sh", report["solver"])
        self.assertGreater(report["seconds"], 0)
        self.assertEqual(self.solve("tower", "--solver-command", f"'{script}' nsgs", code=3)["status"], "stagnated")
        for command, why in (("false #", "exit code 1"), ("true #", "wrote no file"), ("sleep 9 #", "did not end within")):
            self.refused(self.file("tower"), "--solver-command", command, "--max-time", "0.5", command="solve",
                         contains=["--solver-command", why])

    def test_the_solution_in_a_file_does_not_pass_for_that_of_a_command(self):
        for name in ("tower", "global", "glued"):
            solved = self.folder / (name + "_brought.hdf5")
            self.solve(name, "--output", solved)
            before = solved.read_bytes()
            copied = self.call("solve", solved, "--json", "--solver-command", "cp")
            self.assertEqual((copied.returncode, json.loads(copied.stdout)["status"]), (3, "stagnated"))
            self.assertEqual(solved.read_bytes(), before)

    def test_output(self):
        for name in ("tower", "glued"):
            solved = self.folder / (name + "_solved.hdf5")
            report = self.solve(name, "--output", solved)
            self.assertEqual(report["status"], "converged")
            self.assertTrue(solved.exists())
            self.assertEqual(list(self.folder.glob(".*")) + list(self.folder.glob("*.tmp")), [])
            again = self.call("solve", solved, "--json")  # still a problem, and the same one
            self.assertEqual(again.returncode, 0, again.stderr)
            repeated = json.loads(again.stdout)
            for key in ("contacts", "error", "title"):
                self.assertEqual(repeated[key], report[key])
        report = self.solve("infeasible", "--output", "best.hdf5", code=3)
        self.assertTrue((self.folder / "best.hdf5").exists())  # what was reached is written

    def test_output_not_writable(self):
        (self.folder / "file").write_text("x")
        for bad in (".", "file/below", "none/out.hdf5", "/proc/amontons"):
            # Refused before the solve, which would outlast the call.
            self.refused(self.file("slow"), "--solver", "nsgs", "--tolerance", "0", "--max-iterations",
                         "2000000000", "--output", bad, command="solve", contains=[bad])
        self.assertEqual((self.folder / "file").read_text(), "x")

    def test_output_onto_the_problem(self):
        problem = self.folder / "tower.hdf5"
        shutil.copy(self.file("tower"), problem)
        (self.folder / "link.hdf5").symlink_to(problem)
        bytes_before = problem.read_bytes()
        for same in (problem, "./tower.hdf5", "link.hdf5"):
            self.refused(problem, "--output", same, command="solve", contains=[str(same), "the problem itself"])
        self.assertEqual(problem.read_bytes(), bytes_before)

    def test_bad_input(self):
        self.refused(self.file("plane"), command="solve", contains=["/fclib_local/spacedim", "plane"])
        self.refused(self.file("negative_mu"), command="solve", contains=["vectors/mu[1]: found -0.1"])
        self.refused(self.file("short"), command="solve", contains=["vectors/q: found 3 values"])
        self.refused(self.file("text"), command="solve", contains=["vectors/q: found text"])
        self.refused(self.file("towr"), command="solve", contains=["no such file", "tower.hdf5"])
        self.refused(self.scene(), command="solve", contains=["no HDF5 file"])
        whole = pathlib.Path(self.file("tower")).read_bytes()
        (self.folder / "cut.hdf5").write_bytes(whole[:5000])
        self.refused("cut.hdf5", command="solve", contains=["cut.hdf5"])
        self.refused(self.file("tower"), "--solver", "nsgz", command="solve",
                     contains=['"nsgz"', "auto, nsgs", "nearest name: nsgs"])
        self.refused(self.file("tower"), "--tolerance", "-1", command="solve", contains=["tolerance"])
        result = self.call("solve")
        self.assertEqual(result.returncode, 2)

    def test_no_module(self):
        lonely = self.folder / "bin"
        lonely.mkdir()
        shutil.copy(PROGRAM, lonely / "amontons")
        result = subprocess.run([str(lonely / "amontons"), "solve", self.file("tower")],
                                capture_output=True, text=True)
        self.assertEqual(result.returncode, 2)
        self.assertIn("libamontons-fclib.so is not installed", result.stderr)

    def test_interrupted(self):
        process = subprocess.Popen(
            [PROGRAM, "solve", self.file("slow"), "--solver", "nsgs", "--tolerance", "0",
             "--max-iterations", "2000000000", "--output", "out.hdf5"],
            cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        while process.poll() is None and processor_seconds(process.pid) < 0.4:
            time.sleep(0.01)  # the file is read and the solve under way by then
        process.send_signal(signal.SIGINT)
        out, errors = process.communicate(timeout=20)
        if process.returncode != 130 and ("stagnated" in errors or process.returncode == 0):
            self.skipTest("the solve was over before the signal came")
        self.assertEqual(process.returncode, 130, errors)
        self.assertIn("interrupted: ", errors)
        self.assertIn(": interrupted\n", out)
        # What was reached is there: a file that reads, and the reaction in it.
        self.assertEqual([p.name for p in self.folder.iterdir()], ["out.hdf5"])
        self.assertGreater((self.folder / "out.hdf5").stat().st_size,
                           pathlib.Path(self.file("slow")).stat().st_size)
        again = self.call("solve", "out.hdf5", "--solver", "nsgs", "--max-time", "0")
        self.assertIn(again.returncode, (0, 3), again.stderr)

    def test_recorded(self):
        slope = self.scene(lambda s: s["bodies"]["wire"].update(
            introducer={"at": [0, 0, 0], "direction": [1, 0, -0.1]}))
        record = ["run", slope, "--output", "out", "--record", "--set", "time.step=0.02"]
        result = self.call(*record)
        self.assertEqual(result.returncode, 0, result.stderr)
        files = sorted((self.folder / "out/record").iterdir())
        self.assertGreater(len(files), 10)
        self.assertRegex(files[0].name, r"^step_\d{6}\.hdf5$")
        for file in (files[0], files[-1]):
            solved = self.call("solve", file, "--json", "--tolerance", "1e-6", "--max-time", "5")
            self.assertIn(solved.returncode, (0, 3), solved.stderr)
            report = json.loads(solved.stdout)
            self.assertEqual(report["level"], "position")
            self.assertIn("wire: step", report["title"])
            self.assertGreater(report["contacts"], 0)
        self.call(*record, "--set", "time.end=0.7")
        self.assertLess(len(list((self.folder / "out/record").iterdir())), len(files))

    def test_quiet(self):
        result = self.call("solve", self.file("tower"), "--quiet")
        self.assertEqual((result.returncode, result.stdout, result.stderr), (0, "", ""))


class Schema(Case):
    def test_examples_and_mistakes(self):
        try:
            import jsonschema
        except ImportError:
            self.skipTest("lacks python3-jsonschema")
        schema = json.loads(self.call("schema").stdout)
        jsonschema.Draft7Validator.check_schema(schema)
        validator = jsonschema.Draft7Validator(schema)
        scenes = sorted(ROOT.glob("examples/*/scene.json"))
        self.assertTrue(scenes)
        for path in scenes:
            text = re.sub(r"^\s*//.*$", "", path.read_text(), flags=re.M)
            self.assertEqual([e.message for e in validator.iter_errors(json.loads(text))], [], path)
        for path in ("time.stp", "bodies.wire.segments.0.radius", "contact.0.friction"):
            scene = json.loads(json.dumps(SCENE))
            at = scene
            *way, last = path.split(".")
            for name in way:
                at = at[int(name) if name.isdigit() else name]
            at[last] = -1
            self.assertFalse(validator.is_valid(scene), path)

    def test_reference_page_is_up_to_date(self):
        page = ROOT / "docs/scene_reference.md"
        self.assertEqual(page.read_text(), self.call("schema", "--markdown").stdout,
                         f"write it again: amontons schema --markdown > {page}")


if __name__ == "__main__":
    reported_skips.main(argv=[sys.argv[0]] + [a for a in sys.argv[2:] if a != "--stub" and not a.startswith("--samples=")])
