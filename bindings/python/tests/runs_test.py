"""Runs with files: those of the program, read again."""

import csv
import os
import subprocess

import numpy as np

import amontons as am
from scenes import CATHETER, Case, block, folder, main, pressed_flat, tube_and_wire

PROGRAM = am.build_info()["program"]


def table(path):
    """history.csv without clocks."""
    with open(os.path.join(path, "history.csv"), newline="") as stream:
        rows = list(csv.reader(stream))
    keep = [k for k, name in enumerate(rows[0]) if "seconds" not in name]
    return [[row[k] for k in keep] for row in rows]


class RunsTest(Case):
    def test_files_are_those_of_the_program(self):
        with folder():
            for name, scene in (("wire", tube_and_wire()), ("block", block())):
                am.Scene(scene).save(f"{name}.json")
                summary = am.Simulation(f"{name}.json").run(f"a/{name}")
                subprocess.run([PROGRAM, "run", f"{name}.json", "--output", f"b/{name}", "--quiet"], check=True)
                self.assertEqual(table(f"a/{name}"), table(f"b/{name}"))
                listed = [sorted(os.path.relpath(os.path.join(d, f), top) for d, _, files in os.walk(top) for f in files)
                          for top in (f"a/{name}", f"b/{name}")]
                self.assertEqual(*listed)
                one, two = am.read_run(f"a/{name}"), am.read_run(f"b/{name}")
                for key in ("steps", "status", "quantities", "contacts", "files", "exit_code", "warnings"):
                    self.assertEqual(one.manifest[key], two.manifest[key], key)
                self.assertEqual(summary.steps, one.manifest["steps"])
                last = one.frames[-1][name]
                np.testing.assert_array_equal(last.points, two.frames[-1][name].points)

    def test_history_frames_and_contacts_are_those_that_were_reported(self):
        with folder():
            steps = []
            sim = am.Simulation(tube_and_wire())
            sim.run("out", on_step=steps.append)
            run = am.read_run("out")
            h = run.history
            np.testing.assert_array_equal(h["push_force"], [r.quantities["push_force"] for r in steps])
            np.testing.assert_array_equal(h["step"], [r.step for r in steps])
            self.assertEqual(h["step"].dtype.kind, "i")
            self.assertEqual((h.units["push_force"], h.units["step"]), ("N", ""))
            self.assertEqual(h["remark"].dtype.kind, "U")
            with self.assertRaises(ValueError):
                h["step"][0] = 1
            self.assertEqual(run.frames[-1].time, sim.time)
            wire = run.frames[-1]["wire"]
            np.testing.assert_array_equal(wire.points, sim.record.beams["wire"].points)
            np.testing.assert_array_equal(wire.point_fields["moment"], sim.record.beams["wire"].fields["moment"])
            contacts = run.contacts(8)
            np.testing.assert_array_equal(contacts.points, sim.record.contacts.point)
            np.testing.assert_array_equal(contacts.point_fields["force"], sim.record.contacts.force)
            with self.refused("time"):
                run.contacts(-1)
            for wrong in ("nowhere", "."):
                with self.refused("", "manifest"):
                    am.read_run(wrong)
            with open("broken.json", "w") as stream:
                stream.write("{")
            os.mkdir("broken")
            os.rename("broken.json", "broken/manifest.json")
            with self.refused(""):
                am.read_run("broken").manifest

    def test_a_run_that_was_stopped_continues_from_its_folder(self):
        with folder():
            am.Simulation(tube_and_wire()).run("whole")
            for stop_at in (0, 17):
                half = am.Simulation(tube_and_wire())
                self.assertEqual(half.run("half", on_step=lambda r: r.step == stop_at).status, "interrupted")
                self.assertEqual(am.read_run("half").manifest["status"], "interrupted")
                rest = am.Simulation(tube_and_wire()).run("half", resume=True)
                self.assertEqual(rest.status, "done")
                self.assertEqual(table("half"), table("whole"))
            with self.assertRaises(am.InputError):
                am.Simulation(block()).run("half", resume=True)  # of another scene
            with self.refused("resume"):
                am.Simulation(block()).run(resume=True)

    def test_contact_problems_are_kept_as_the_program_keeps_them(self):
        with self.refused("record"):
            am.Simulation(block()).run(record=True)
        if not am.build_info()["modules"]["fclib"].startswith("/"):
            with folder(), self.assertRaisesRegex(am.ModuleMissing, "libfclib-dev"):
                am.Simulation(block()).run("a", record=True)
            self.skipTest("no module fclib")
        with folder():
            for scene in (block(), tube_and_wire(time={"step": 0.5, "end": 4})):
                am.Scene(scene).save("case.json")
                am.Simulation("case.json").run("a", record=True)
                subprocess.run([PROGRAM, "run", "case.json", "--record", "--output", "b", "--quiet"], check=True)
                names = sorted(os.listdir("b/record"))
                self.assertEqual(sorted(os.listdir("a/record")), names)
                self.assertGreater(len(names), 1)
                for name in names:
                    one, two = am.read_fclib(f"a/record/{name}"), am.read_fclib(f"b/record/{name}")
                    np.testing.assert_array_equal(one.q, two.q)
                    np.testing.assert_array_equal(one.reaction, two.reaction)
                    self.assertLess(am.certify(one, r=one.reaction).error, 1e-6)

    def test_every_so_many_steps_a_callback_is_called(self):
        seen = []
        am.Simulation(block()).run(on_step=lambda r: seen.append(r.step), every=4)
        self.assertEqual(seen, [0, 4, 8])
        for wrong in ({"every": 0}, {"every": 1.5}, {"on_step": 3}):
            with self.refused(next(iter(wrong))):
                am.Simulation(block()).run(**wrong)

    def test_a_run_that_fails_raises_with_whole_files(self):
        with folder():
            with self.assertRaises(am.SolveFailed) as failed:
                am.Simulation(pressed_flat()).run("out")
            error = failed.exception
            self.assertEqual(error.summary.status, "failed")
            self.assertEqual(am.read_run("out").manifest["status"], "failed")
            self.assertEqual(am.read_run("out").history["step"][-1], error.record.step)

    def test_results_are_not_written_where_the_scene_is(self):
        with folder():
            am.Scene(block()).save("scene.json")
            with self.refused("", "", "neither the scene"):
                am.Simulation("scene.json").run(".")


if __name__ == "__main__":
    main()
