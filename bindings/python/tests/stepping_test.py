"""Simulations stepped, cut, saved, forked and led by hand: one thread, the same bits."""

import math
import os
import shutil
import signal
import subprocess
import sys
import threading
import time

import numpy as np

import amontons as am
from scenes import CATHETER, SOFT_VESSEL, Case, ball, block, folder, main, pressed_by_plate, pressed_flat, tube_and_wire


def bits(record):
    c = record.contacts
    return (record.step, record.time, record.iterations, dict(record.quantities), c.force.tobytes(), c.point.tobytes(),
            [b.points.tobytes() for b in record.beams.values()])


class SteppingTest(Case):
    def test_steps_advances_and_runs_are_the_same_to_the_last_bit(self):
        for scene in (tube_and_wire(), block(), ball()):
            whole = []
            summary = am.Simulation(scene).run(on_step=lambda r: whole.append(bits(r)))
            self.assertEqual(summary.status, "done")
            one = am.Simulation(scene)
            steps = []
            while not one.done:
                steps.append(bits(one.step()))
            self.assertEqual(steps, whole)
            many = am.Simulation(scene)
            self.assertEqual(bits(many.step(10**6)), whole[-1])
            self.assertTrue(many.done)
            cut = am.Simulation(scene)
            for k in (3, 4, 7):
                self.assertEqual(bits(cut.advance(whole[k][1])), whole[k])
            self.assertEqual(bits(cut.advance(whole[-1][1])), whole[-1])

    def test_advance_ends_exactly_at_the_requested_time(self):
        sim = am.Simulation(tube_and_wire())
        for until in (0.05, 1.2345, 1.2346, 7.999, 8.0):
            record = sim.advance(until)
            self.assertTrue(math.isclose(record.time, until, rel_tol=1e-12))
            self.assertEqual(sim.time, record.time)
            self.assertTrue(record.certificate.certified)
        self.assertTrue(sim.done)
        for wrong in (7.0, 9.0, float("nan"), float("inf")):
            with self.refused("until"):
                sim.advance(wrong)
        self.assertEqual(sim.step().time, 8.0)  # nothing is left to do
        with self.refused("count"):
            sim.step(0)

    def test_a_saved_state_continues_bit_by_bit_and_belongs_to_its_scene(self):
        for scene in (tube_and_wire(), block(), ball()):
            sim = am.Simulation(scene)
            empty = sim.save()
            record = sim.step(4)
            state = sim.save()
            self.assertEqual(sim.save(), state)
            rest = [bits(sim.step()) for _ in range(5)]
            other = am.Simulation(scene)
            other.restore(state)
            self.assertEqual(bits(other.record), bits(record))
            self.assertEqual(other.time, record.time)
            self.assertEqual(other.save(), state)
            self.assertEqual([bits(other.step()) for _ in range(5)], rest)
            sim.restore(state)
            for changed in (state[:-8], state + b"8 bytes.", *(state[:k] + bytes([state[k] ^ 1]) + state[k + 1:]
                                                               for k in range(0, len(state), len(state) // 40))):
                with self.refused("state"):
                    sim.restore(changed)
            self.assertEqual(sim.save(), state)
            fork = sim.fork()
            self.assertEqual([bits(fork.step()) for _ in range(5)], rest)
            self.assertEqual(sim.save(), state)
            self.assertIsInstance(fork, am.Simulation)
            sim.restore(empty)
            self.assertIsNone(sim.record)
            self.assertEqual(sim.time, 0)
            before = sim.save()
            for wrong in (b"", state[:40], state[:-1], state + b"x", b"x" * 1000, am.Simulation(block(3)).save()):
                with self.assertRaises(am.InputError):
                    sim.restore(wrong)
                self.assertEqual(sim.save(), before)

    def test_a_state_of_another_scene_is_refused_though_its_sizes_fit(self):
        for scene, others in ((tube_and_wire(), {"bodies.wire.segments.0.EI": 6e-4, "bodies.tube.surface.radius": 0.0041, "contact.0.friction": 0.2,
                                                 "bodies.wire.drive.insertion": [[0, 0], [8, 0.07]], "time.step": 0.05}),
                              (block(), {"bodies.block.material.youngs_modulus": 2e5, "bodies.block.material.poisson_ratio": 0.4,
                                         "gravity": [0, 0, -9.81], "bodies.block.hold.0.z": -0.001}),
                              (ball(), {"bodies.ball.mass": 3, "bodies.ball.shape.radius": 0.2})):
            sim = am.Simulation(scene)
            record = sim.step(3)
            state = sim.save()
            for path, value in others.items():
                other = am.Simulation(scene, set={path: value})
                before = other.save()
                with self.refused("state", "another scene", "the same values"):
                    other.restore(state)
                self.assertEqual(other.save(), before)
                batch = am.Batch(scene, 2, set=[{}, {path: value}])
                with self.refused("", "another scene"):
                    batch.restore([state, state])
            for path, value in {"title": "another", "output.every": 7, "time.end": 16}.items():
                other = am.Simulation(scene, set={path: value})
                other.restore(state)
                self.assertEqual(bits(other.record), bits(record))
                self.assertEqual(bits(other.step()), bits(sim.step()))
                sim.restore(state)

    def test_a_state_belongs_to_the_files_that_its_scene_names(self):
        corners = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
        faces = ((0, 2, 3), (0, 3, 1), (4, 5, 7), (4, 7, 6), (0, 1, 5), (0, 5, 4), (2, 6, 7), (2, 7, 3), (0, 4, 6), (0, 6, 2), (1, 3, 7), (1, 7, 5))

        def write(name, size):
            with open(name, "w") as file:
                file.writelines(f"v {x} {y} {z}\n" for x, y, z in (corners - 0.5) * size)
                file.writelines(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in faces)
        for body in ("tool", "floor"):
            scene = {"schema": 1, "bodies": {
                "floor": {"kind": "obstacle", "surface": {"file": "floor.obj"}},
                "tool": {"kind": "rigid", "mass": 1, "shape": {"file": "tool.obj"}, "start": {"place": [0, 0, 0.2]}}},
                "contact": [{"between": ["tool", "floor"], "friction": 0.3}],
                "gravity": [0, 0, -9.81], "time": {"kind": "dynamic", "step": 0.01, "end": 1}}
            with folder():
                write("floor.obj", 0.2)
                write("tool.obj", 0.1)
                sim = am.Simulation(scene)
                sim.step(3)
                state = sim.save()
                os.mkdir("elsewhere")
                for name in ("floor.obj", "tool.obj"):
                    shutil.copy(name, "elsewhere")
                am.Simulation(am.Scene(scene, folder="elsewhere")).restore(state)  # copies are the same
                write(body + ".obj", 0.11)
                with self.refused("state", "another scene"):
                    am.Simulation(scene).restore(state)
                sim.restore(state)  # made before the file was another

    def test_a_step_that_fails_leaves_the_last_one(self):
        sim = am.Simulation(pressed_flat())
        good = None
        with self.assertRaises(am.SolveFailed) as failed:
            while True:
                good = sim.step()
        self.assertTrue(str(failed.exception).startswith("step "))
        self.assertEqual(bits(failed.exception.record), bits(good))
        self.assertEqual(failed.exception.step, good.step)
        with self.assertRaises(am.SolveFailed) as again:
            sim.step()
        self.assertEqual(str(again.exception), str(failed.exception))
        self.assertEqual(bits(sim.record), bits(good))
        with self.assertRaises(am.SolveFailed) as whole:
            am.Simulation(pressed_flat()).run()
        self.assertEqual(whole.exception.summary.status, "failed")
        self.assertEqual(whole.exception.summary.steps, good.step)

    def test_inputs_sampled_from_a_curve_push_as_the_curve(self):
        curve = [[0, 0], [3, 0.05], [4, 0.045], [8, 0.08]]
        scene = tube_and_wire()
        scene["bodies"]["wire"]["drive"]["insertion"] = curve
        whole = []
        am.Simulation(scene).run(on_step=whole.append)
        led = am.Simulation(tube_and_wire())
        led.step()
        for record in whole[1:]:
            led.inputs["wire.insertion"] = np.interp(record.time, *np.transpose(curve))
            same = led.advance(record.time)
            self.assertAlmostEqual(same.time, record.time, delta=1e-12)
            for name in ("push_force", "depth", "torque"):
                self.assertAlmostEqual(same.quantities[name], record.quantities[name], delta=1e-9)

    def test_drives_of_rigid_bodies_can_be_set_step_by_step(self):
        whole = []
        am.Simulation(pressed_by_plate()).run(on_step=whole.append)
        scene = pressed_by_plate()
        scene["bodies"]["plate"]["drive"] = {"z": [[0, 0], [5, -1]]}
        scene["time"] = {"step": 0.1, "end": 2, "smallest_step": 0.05}
        led = am.Simulation(scene)
        self.assertEqual(led.inputs.names, ("plate.x", "plate.y", "plate.z", "plate.angle"))
        led.step()
        for record in whole[1:]:
            led.inputs["plate.z"] = np.interp(record.time, [0, 0.35, 1], [0, -0.002, -0.004])
            same = led.advance(record.time)
            for name in ("plate_z", "plate_on_block_force_z"):
                self.assertAlmostEqual(same.quantities[name], record.quantities[name],
                                       delta=1e-9 * max(1, abs(record.quantities[name])))
        self.assertGreater(abs(whole[-1].quantities["plate_on_block_force_z"]), 1)
        state = led.save()
        led.inputs["plate.angle"] = 0.1
        led.inputs["plate.z"] = -0.2  # through the floor: no step leads there
        with self.assertRaises(am.SolveFailed):
            led.step(1000)  # in parts no longer than contacts are searched for
        reached = led.time, led.inputs["plate.z"], led.record.quantities["plate_z"] - 0.11
        self.assertAlmostEqual(reached[1], reached[2])
        with self.assertRaises(am.SolveFailed):
            led.step()
        self.assertEqual((led.time, led.inputs["plate.z"]), reached[:2])
        led.restore(state)
        led.inputs["plate.z"] = -0.0041
        led.step()
        self.assertAlmostEqual(led.record.quantities["plate_z"], 0.11 - 0.0041)

    def test_holds_of_solids_and_rods_can_be_set_step_by_step(self):
        def rod():
            return {"schema": 1, "bodies": {"rod": {
                "kind": "rod", "segments": [{"length": 0.2, "radius": 1e-3, "EI": 1e-3, "GJ": 1e-3, "element": 0.02}],
                "shape": {"start": [0, 0, 0], "direction": [1, 0, 0]},
                "hold": [{"set": "start"}, {"set": "end", "x": 0, "y": 0, "z": [[0, 0], [0.33, 0.01], [1, 0.02]]}]}},
                "time": {"step": 0.1, "end": 1}}

        def turned():
            scene = block()
            scene["bodies"]["block"]["hold"] = [{"set": "z_max", "x": [[0, 0], [0.5, 0.002], [1, 0]], "y": 0,
                                                 "z": [[0, 0], [1, -0.003]], "angle": [[0, 0], [1, 0.1]], "about": [0, 0, 0.1]}]
            return scene
        for scene, names, probes in (
                (turned(), ("block.hold.0.x", "block.hold.0.y", "block.hold.0.z", "block.hold.0.angle"),
                 ("block_z_max_force_x", "block_z_max_force_z")),
                (rod(), ("rod.hold.1.x", "rod.hold.1.y", "rod.hold.1.z"), ())):
            body, = (b for b in scene["bodies"].values() if "hold" in b)
            whole = []
            am.Simulation(scene).run(on_step=whole.append)
            led = am.Simulation(scene)
            self.assertEqual(led.inputs.names, names)
            curves = {n: body["hold"][int(n.split(".")[2])][n.split(".")[3]] for n in names}
            led.step()
            for record in whole[1:]:
                for name, curve in curves.items():
                    led.inputs[name] = np.interp(record.time, *np.transpose(curve)) if isinstance(curve, list) else curve
                same = led.advance(record.time)
                for name in probes or record.quantities:
                    value = record.quantities[name]
                    self.assertAlmostEqual(same.quantities[name], value, delta=1e-7 * max(1e-3, abs(value)), msg=name)
            # Knots of a curve that is led no longer cut steps; those of the others do.
            free = am.Simulation(scene)
            for name in names:
                free.inputs[name] = 0
            free.step()
            times = []
            while not free.done:
                times.append(free.step().time)
            np.testing.assert_allclose(times, np.arange(1, 11) / 10, rtol=1e-9)
            for name in names:
                self.assertEqual(free.inputs[name], 0)

    def test_inputs_are_kept_in_states_and_refuse_what_they_cannot_be(self):
        sim = am.Simulation(tube_and_wire())
        self.assertEqual(sim.inputs.names, ("wire.insertion", "wire.twist"))
        self.assertEqual(sim.inputs.units["wire.twist"], "rad")
        sim.step(11)
        self.assertAlmostEqual(sim.inputs["wire.insertion"], 0.01)
        sim.inputs["wire.twist"] = 0.3
        self.assertEqual(sim.inputs["wire.twist"], 0.3)
        waiting = sim.save()
        record = sim.step()
        self.assertAlmostEqual(record.quantities["base_twist"], 0.3)
        self.assertAlmostEqual(record.quantities["insertion"], 0.011)  # of the scene's curve still
        other = am.Simulation(tube_and_wire())
        other.restore(waiting)
        self.assertEqual(other.inputs["wire.twist"], 0.3)
        self.assertEqual(bits(other.step()), bits(record))
        self.assertEqual(bits(other.step(7)), bits(sim.step(7)))
        self.assertAlmostEqual(sim.record.quantities["base_twist"], 0.3)  # stays
        before = sim.save()
        for name, value in (("wire.insertion", -1), ("wire.insertion", 0.15), ("wire.twist", float("nan")),
                            ("wire.twist", "far"), ("wire.twist", "0.1"), ("wire.twist", [0.1]), ("wire.twists", 0)):
            with self.refused(name):
                sim.inputs[name] = value
        for wrong in ([1], ["a", "b"], [[0, 0]], 3):
            with self.refused("inputs.values"):
                sim.inputs.values = wrong
        with self.refused("wire.insertion"):
            sim.inputs.values = [9, 0.1]
        self.assertEqual(sim.save(), before)
        sim.inputs.values = [0.02, 0.1]
        np.testing.assert_allclose(sim.inputs.values, [0.02, 0.1])
        with self.assertRaises(ValueError):
            sim.inputs.values[0] = 0.01  # of a copy

    def test_a_scene_changed_between_steps_is_that_of_a_new_simulation(self):
        sim = am.Simulation(tube_and_wire())
        sim.step(30)
        sim.set("contact.0.friction", 0.4)
        other = am.Simulation(tube_and_wire(), set={"contact.0.friction": 0.4})
        other.restore(sim.save())
        self.assertEqual(sim.scene["contact.0.friction"], 0.4)
        self.assertEqual([bits(sim.step()) for _ in range(5)], [bits(other.step()) for _ in range(5)])
        before = sim.save()
        with self.assertRaises(am.InputError):
            sim.set("bodies.wire.segments.0.element", 5e-3)
        with self.refused("/contact/0/friction", "-1"):
            sim.set("contact.0.friction", -1)
        self.assertEqual(sim.save(), before)

    def test_different_simulations_run_side_by_side_with_the_bits_of_each_alone(self):
        def all(scene):
            steps = []
            am.Simulation(scene).run(on_step=lambda r: steps.append(bits(r)))
            return steps
        scenes = [tube_and_wire(), block(), tube_and_wire(contact=[]), block(3)] * 2
        alone = [all(s) for s in scenes]
        together = [None] * len(scenes)

        def work(k):
            together[k] = all(scenes[k])
        threads = [threading.Thread(target=work, args=(k,)) for k in range(len(scenes))]
        for t in threads:
            t.start()
        for t in threads:
            t.join()
        self.assertEqual(together, alone)

    def test_a_second_thread_and_a_callback_that_steps_are_refused(self):
        sim = am.Simulation(block(4))
        found = []

        def other():
            try:
                while not found:
                    sim.step()
            except RuntimeError as error:
                found.append(str(error))
        thread = threading.Thread(target=other)
        thread.start()
        while not found and thread.is_alive():
            try:
                sim.save()
            except RuntimeError as error:
                found.append(str(error))
        thread.join()
        self.assertIn("another thread", found[0])
        sim = am.Simulation(block())
        reported = []

        def step_again(record):
            self.assertEqual(sim.time, record.time)
            sim.save(), sim.fork(), sim.bodies["block"]
            for change in (sim.step, lambda: sim.advance(1), lambda: sim.restore(sim.save()), sim.close, sim.run):
                try:
                    change()
                except RuntimeError as error:
                    reported.append(str(error))
            return True
        self.assertEqual(sim.run(on_step=step_again).message, "stopped by on_step")
        self.assertEqual(len(reported), 5)
        sim.step()
        with sim:
            pass
        with self.assertRaisesRegex(RuntimeError, "closed"):
            sim.step()
        self.assertTrue(sim.closed)
        sim.close()

    def test_a_callback_that_raises_ends_the_run_with_its_error(self):
        sim = am.Simulation(block())

        def bad(record):
            if record.step == 3:
                raise KeyError("mine")
        with self.assertRaisesRegex(KeyError, "mine"):
            sim.run(on_step=bad)
        self.assertEqual(sim.record.step, 3)
        self.assertEqual(sim.run().status, "done")

    def test_ctrl_c_ends_within_a_tenth_of_a_second_and_leaves_a_state_that_continues(self):
        # Steps of half a second and more, quick ones, and those of a wire in walls that are compliant.
        for scene, end in ((block(10), 1), (am.Scene(CATHETER, set={"time.end": 1000}), 1000), (am.Scene(SOFT_VESSEL), 13)):
            sim = am.Simulation(scene)
            sim.step()
            late = []

            def press():
                time.sleep(0.3)
                late.append(time.perf_counter())
                os.kill(os.getpid(), signal.SIGINT)
            thread = threading.Thread(target=press)
            thread.start()
            with self.assertRaises(KeyboardInterrupt):
                sim.advance(end)
            waited = time.perf_counter() - late[0]
            thread.join()
            self.assertLess(waited, 1)  # a tenth on an idle machine
            state, at = sim.save(), sim.record.step
            other = am.Simulation(scene)
            other.restore(state)
            self.assertEqual(bits(other.step()), bits(sim.step()))
            self.assertEqual(sim.record.step, at + 1)


if __name__ == "__main__":
    main()
