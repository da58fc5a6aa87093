"""Many simulations at once: the bits of each alone."""

import os
import signal
import threading
import time
import unittest

import numpy as np

import amontons as am
from amontons import _points
from scenes import CATHETER, SANITIZED, Case, ball, block, folder, main, pressed_flat, tube_and_wire


def arrays(record):
    return [record.time, dict(record.quantities), record.contacts.force.tobytes()]


class BatchTest(Case):
    def test_solids_whose_unknowns_are_put_in_order_at_the_same_time_have_the_bits_of_one_alone(self):
        scene = block(6)
        scene["bodies"]["block"]["mesh"]["element"] = "T10"
        del scene["bodies"]["block"]["material"]
        scene["bodies"]["block"].update(youngs_modulus=1e5, poisson_ratio=0.3)
        alone = am.Simulation(scene).advance(0.1).contacts.force.tobytes()
        for _ in range(4):
            batch = am.Batch(scene, 4, threads=4)
            batch.advance(0.1)
            self.assertEqual([s.record.contacts.force.tobytes() for s in batch.simulations], [alone] * 4)

    def test_each_has_the_same_bits_as_alone_for_any_number_of_threads(self):
        frictions = [0.0, 0.1, 0.2, 0.3, 0.4]
        for scene in (tube_and_wire(), block()):
            end = scene["time"]["end"]
            alone = []
            for mu in frictions:
                sim = am.Simulation(scene, set={"contact.0.friction": mu})
                sim.step()
                for k in range(1, 6):
                    sim.advance(k * end / 10)
                alone.append(arrays(sim.record))
            for threads in (1, 2, 7):
                batch = am.Batch(scene, 5, set=[{"contact.0.friction": m} for m in frictions], threads=threads)
                for _ in range(5):
                    self.assertEqual(batch.advance(end / 10).tolist(), [0] * 5)
                self.assertEqual([arrays(s.record) for s in batch.simulations], alone)
            self.assertEqual(batch.advance(end).tolist(), [1] * 5)
            self.assertEqual(batch.advance(end).tolist(), [1] * 5)

    def test_inputs_are_those_of_single_simulations(self):
        batch = am.Batch(tube_and_wire(), 3)
        self.assertEqual(batch.names, ["wire.insertion", "wire.twist"])
        twist = batch.names.index("wire.twist")
        batch.advance(1)
        np.testing.assert_allclose(batch.inputs[:, 0], 0.01)  # the scene's curve
        batch.inputs[:, twist] = [0, 0.5, -0.5]
        batch.advance(0.5)
        single = am.Simulation(tube_and_wire())
        single.step()
        single.advance(1)
        single.inputs["wire.twist"] = 0.5
        single.advance(1.5)
        self.assertEqual(arrays(batch.simulations[1].record), arrays(single.record))
        np.testing.assert_allclose(batch.quantity("base_twist"), [0, 0.5, -0.5])
        before = [s.save() for s in batch.simulations]
        batch.inputs[2, 0] = 1
        with self.refused("inputs[2]: wire.insertion"):
            batch.advance(1)
        self.assertEqual(batch.save(), before)
        np.testing.assert_allclose(batch.quantity("depth"), batch.quantity("depth", np.empty(3)))

    def test_some_continue_and_others_wait(self):
        batch = am.Batch(ball(), 3)
        batch.advance(0.3, where=[True, False, True])
        self.assertEqual([s.time for s in batch.simulations], [batch.simulations[0].time, 0, batch.simulations[0].time])
        self.assertAlmostEqual(batch.simulations[0].time, 0.3)
        batch.advance(0, where=[False, True, False])
        states = batch.save()
        fell = batch.quantity("ball_z").copy()
        batch.advance(0.2)
        after = batch.quantity("ball_z").copy()
        batch.restore(states, where=np.array([True, False, True]))
        np.testing.assert_array_equal(batch.quantity("ball_z"), [fell[0], after[1], fell[2]])
        batch.advance(0.2, where=np.array([True, False, True]))
        np.testing.assert_array_equal(batch.quantity("ball_z"), after)
        with self.refused("state"):
            batch.restore([states[0], b"", states[2]])
        np.testing.assert_array_equal(batch.quantity("ball_z"), after)
        batch.inputs = 3
        with self.refused("inputs"):
            batch.advance(0.1)

    def test_one_that_fails_reports_the_reason_and_the_others_continue(self):
        good = {"bodies.block.hold.0.z": [[0, 0], [1, -0.01]]}
        batch = am.Batch(pressed_flat(), 2, set=[{}, good])
        state = np.array([0, 0])
        while state[0] != 2:
            state = batch.advance(0.1)
            self.assertEqual(state[1], 0)
        self.assertIn("step ", batch.messages[0])
        self.assertEqual(batch.messages[1], "")
        kept = batch.simulations[0].time
        self.assertEqual(batch.advance(0.05)[0], 2)
        self.assertEqual(batch.simulations[0].time, kept)

    def test_points_lie_on_the_wire_at_equal_distances_from_the_tip(self):
        batch = am.Batch(tube_and_wire(), 2)
        batch.advance(6)
        points = batch.points("wire", 9)
        self.assertEqual(points.shape, (2, 9, 3))
        line = batch.simulations[0].record.beams["wire"].points
        np.testing.assert_array_equal(points[0, 0], line[-1])
        np.testing.assert_allclose(points[0, -1], line[0], atol=1e-12)
        lengths = np.linalg.norm(np.diff(points[0], axis=0), axis=1)
        self.assertLess(np.ptp(lengths), 0.02 * lengths.mean())
        np.testing.assert_array_equal(batch.points("wire", 1)[:, 0], points[:, 0])
        with self.refused("body"):
            batch.points("tube", 3)

    def test_images_are_those_of_each(self):
        batch = am.Batch(tube_and_wire(), 3, threads=2)
        camera = am.Camera((0.03, -1, 0.03), (0.03, 0, 0.03), 0.1, (0, 0, 1))
        with self.assertRaisesRegex(RuntimeError, "nothing to see"):
            batch.xray(camera)
        batch.inputs[:, batch.names.index("wire.insertion")] = [0.01, 0.02, 0.03]
        batch.advance(1)
        images = batch.xray(camera, (40, 50), seed=7)
        self.assertEqual((images.shape, images.dtype), ((3, 40, 50), np.uint8))
        for k, sim in enumerate(batch.simulations):
            np.testing.assert_array_equal(images[k], am.xray(sim, camera, (40, 50), seed=7 + k))
        out = np.zeros_like(images)
        self.assertIs(batch.xray(camera, (40, 50), out, seed=7), out)
        np.testing.assert_array_equal(out, images)
        np.testing.assert_array_equal(am.xray(batch, camera, (40, 50), seed=7), images)
        for wrong in (np.zeros((3, 40, 51), np.uint8), np.zeros((3, 40, 50)), [0]):
            with self.refused("out"):
                batch.xray(camera, (40, 50), wrong)
        with self.refused("camera"):
            batch.xray("camera")
        with self.refused("size"):
            batch.xray(camera, (40.5, 50))

    def test_walls_are_made_once_for_all(self):
        import resource
        import time
        scene = am.Scene(CATHETER)
        first = am.Simulation(scene)
        first.advance(4)
        start = time.process_time()
        second = am.Simulation(scene)
        made = time.process_time() - start
        self.assertLess(made, 0.1)  # 20 ms on an idle machine; 0.3 s without what is shared
        second.advance(4)
        self.assertEqual(arrays(second.record), arrays(first.record))
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        batch = am.Batch(scene, 16)
        batch.advance(0.5)
        each = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 16
        if not SANITIZED:
            self.assertLess(each, 4000)  # KiB

    def test_wrong_use_is_refused(self):
        for wrong, place in ((dict(count=0), "count"), (dict(count=2, set=[{}]), "set"), (dict(count=1, threads=0), "threads")):
            with self.refused(place):
                am.Batch(ball(), **wrong)
        batch = am.Batch(ball(), 2)
        with self.assertRaises(RuntimeError):
            batch.quantity("ball_z")
        batch.advance(0)
        with self.refused("quantity", "", "ball_z"):
            batch.quantity("bal_z")
        for out in (np.empty(3), np.empty(2, np.float32), [0, 0], np.empty(4)[::2]):
            with self.refused("out"):
                batch.quantity("ball_z", out)
        for wrong in (-1, float("nan")):
            with self.refused("seconds"):
                batch.advance(wrong)
        with self.refused("where"):
            batch.advance(1, where=[True])

    def test_studies_and_validation_are_those_of_the_program(self):
        with folder():
            study = am.study(ball(), sweep={"time.step": [0.1, 0.05]}, quantity="ball_velocity_z", reference=-9.81, output="out/s")
            self.assertEqual([r["time.step"] for r in study.rows], [0.1, 0.05])
            for row in study.rows:
                self.assertLess(row["error"], 1e-9)  # a constant force: each rule of time is exact
            self.assertTrue(os.path.exists("out/s/study.csv"))
            with self.refused("sweep"):
                am.study(ball(), sweep={}, quantity="ball_velocity_z", output="out/t")
            before = sorted(os.listdir("."))
            kept = am.study(ball(), sweep={"time.step": [0.1, 0.05]}, quantity="ball_velocity_z", reference=-9.81)
            self.assertEqual([r["value"] for r in kept.rows], [r["value"] for r in study.rows])
            self.assertEqual(sorted(os.listdir(".")), before)
            with self.assertRaises(am.InputError) as error:
                am.study("nowhere.json", sweep={"a": [1]}, quantity="b", output="out/t")
            self.assertEqual(error.exception.issues[0]["file"], "nowhere.json")
        with self.assertRaises(am.InputError):
            am.validate("no-such-case")

    @unittest.skipUnless(am.build_info()["modules"]["petsc"].startswith("/"), "lacks the module petsc")
    def test_solids_that_are_solved_iteratively_at_the_same_time_have_the_bits_of_one_alone(self):
        scene = block(8)
        del scene["bodies"]["block"]["material"]
        scene["bodies"]["block"].update(youngs_modulus=1e5, poisson_ratio=0.3)
        scene["solver"] = {"linear": "iterative"}
        alone = am.Simulation(scene).advance(0.2).contacts.force.tobytes()
        batch = am.Batch(scene, 4, threads=4)
        batch.advance(0.2)
        self.assertEqual([s.record.contacts.force.tobytes() for s in batch.simulations], [alone] * 4)
        # What has been solved since a state was saved leaves no trace in the matrix.
        sim = batch.simulations[0]
        state, further = sim.save(), sim.step(2).contacts.force.tobytes()
        sim.restore(state)
        self.assertEqual(sim.step(2).contacts.force.tobytes(), further)
        other = am.Simulation(scene)
        other.restore(state)
        self.assertEqual(other.step(2).contacts.force.tobytes(), further)

    def test_ctrl_c_ends_a_study_before_popen_would(self):
        waited = []
        with folder():
            for k in range(3):
                late = []

                def press():
                    time.sleep(0.4)
                    late.append(time.perf_counter())
                    os.kill(os.getpid(), signal.SIGINT)
                thread = threading.Thread(target=press)
                thread.start()
                with self.assertRaises(KeyboardInterrupt):
                    am.study(block(12), sweep={"time.step": [0.1, 0.05]}, quantity="time", output=f"out/{k}")
                waited.append(time.perf_counter() - late[0])
                thread.join()
            # A program that is slow to end still writes into the folder, and is not left to the garbage collector.
            for ending in [t for t in threading.enumerate() if t.name == _points.INTERRUPTED]:
                ending.join()
            self.assertRaises(ChildProcessError, os.waitpid, -1, os.WNOHANG)
        self.assertLess(min(waited), 0.2)  # 0.04 on an idle machine; Popen waits 0.25 for its program

    def test_a_study_compares_a_registered_solver_with_those_of_the_program(self):
        calls = []

        def own(W, q, mu, kinds=None):
            calls.append(len(q))
            return am.solve(W, q, mu, kinds=kinds, tolerance=1e-12).reaction

        def lazy(W, q, mu, kinds=None):
            raise ValueError("no idea")
        am.register_solver("own", own)
        am.register_solver("lazy", lazy)
        scene = {"schema": 1, "gravity": [6, 0, -9.81], "bodies": {
                     "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
                     "box": {"kind": "rigid", "mass": 2, "shape": {"generate": "box", "size": [1, 1, 1]},
                             "start": {"place": [0, 0, 0.5]}}},
                 "contact": [{"between": ["box", "floor"], "friction": 0.5}],
                 "time": {"kind": "dynamic", "step": 0.01, "end": 0.1}}
        slid = 6 - 0.5 * 9.81  # m/s^2 under Coulomb's law; 0.1 s of it
        with folder():
            study = am.study(scene, sweep={"contact_solver.function": ["", "own", "lazy"], "time.step": [0.02, 0.01]},
                             quantity="box_velocity_x", reference=0.1 * slid, output="out/s")
            self.assertEqual([r["contact_solver.function"] for r in study.rows], ["", "", "own", "own", "lazy", "lazy"])
            for row in study.rows[:4]:
                self.assertEqual(row["status"], "done")
                self.assertLess(row["error"], 1e-6)
                self.assertGreater(row["seconds"], 0)
            for row in study.rows[4:]:
                self.assertEqual(row["status"], "failed")
                self.assertIn("raised ValueError: no idea", row["reason"])
            self.assertGreaterEqual(len(calls), 15)
            before = len(calls)
            again = am.study(scene, sweep={"contact_solver.function": ["", "own", "lazy"], "time.step": [0.02, 0.01]},
                             quantity="box_velocity_x", reference=0.1 * slid, output="out/s")
            self.assertEqual(len(calls), before)  # it continues from what is there
            self.assertEqual([r["value"] for r in again.rows[:4]], [r["value"] for r in study.rows[:4]])
            with self.refused("jobs"):
                am.study(scene, sweep={"contact_solver.function": ["own"]}, quantity="box_velocity_x", output="out/t", jobs=2)
            with self.assertRaises(am.SolveFailed):
                am.study(scene, sweep={"contact_solver.function": ["nobody"]}, quantity="box_velocity_x", output="out/u")


if __name__ == "__main__":
    main()
