"""What a step reports: read-only views that stay as they are."""

import gc
import random
import resource
import unittest
import weakref

import numpy as np

import amontons as am
from scenes import SANITIZED, Case, block, main, tube_and_wire


class RecordsTest(Case):
    def test_forces_obey_their_laws_and_carry_the_load(self):
        sim = am.Simulation(block())
        r = sim.advance(1)
        c = r.contacts
        n = len(c)
        self.assertGreater(n, 0)
        self.assertEqual(c.force.shape, (n, 3))
        self.assertEqual([a.dtype for a in (c.gap, c.status, c.body_a)], [np.float64, np.int32, np.int32])
        np.testing.assert_allclose(np.linalg.norm(c.normal, axis=1), 1)
        np.testing.assert_allclose(np.sum(c.normal * c.force, axis=1), c.normal_force, rtol=1e-12)
        tangential = np.linalg.norm(c.force - c.normal_force[:, None] * c.normal, axis=1)
        self.assertTrue((tangential <= 0.3 * c.normal_force * (1 + 1e-6) + 1e-12).all())
        slips = c.status == 2
        np.testing.assert_allclose(tangential[slips], 0.3 * c.normal_force[slips], rtol=1e-6)
        block_number = c.names.index("block")
        sign = np.where(c.body_a == block_number, 1.0, -1.0)
        total = (sign[:, None] * c.force).sum(axis=0)
        q = r.quantities
        held = np.array([q[f"block_z_max_force_{k}"] for k in "xyz"])
        np.testing.assert_allclose(np.abs(total), np.abs(held), rtol=1e-6, atol=1e-6)

    def test_pairs_are_chosen_by_name(self):
        r = am.Simulation(tube_and_wire()).advance(6)
        c = r.contacts
        self.assertGreater(len(c), 0)
        self.assertTrue(c.of("wire").all() and c.of("wire", "tube").all() and c.of("tube", "wire").all())
        self.assertFalse(c.of("wire", "wire").any())
        with self.refused("body", "wier", "wire"):
            c.of("wier")
        copies = c.to_dict()
        self.assertEqual(len(copies), 12)
        for name, values in copies.items():
            np.testing.assert_array_equal(values, getattr(c, name))
            values += 1  # its own

    def test_a_wire_is_a_line_of_its_length(self):
        sim = am.Simulation(tube_and_wire())
        beam = sim.advance(8).beams["wire"]
        self.assertEqual(beam.points.shape, (len(beam), 3))
        self.assertEqual(set(beam.fields), set(beam.units))
        arc = beam.fields["arc_length"]
        lengths = np.linalg.norm(np.diff(beam.points, axis=0), axis=1)
        self.assertLess(abs(lengths.sum() - (arc[-1] - arc[0])), 1e-5)
        self.assertEqual(beam.fields["moment"].shape, (len(beam),))
        self.assertEqual(sim.bodies["wire"].name, "wire")
        self.assertEqual(list(sim.bodies), ["tube", "wire"])
        tube = sim.bodies["tube"]
        self.assertEqual(tube.kind, "obstacle")
        self.assertLess(tube.triangles.max(), len(tube.points))
        with self.assertRaises(KeyError):
            sim.bodies["nothing"]

    def test_a_solid_has_points_cells_and_fields(self):
        sim = am.Simulation(block())
        before = sim.bodies["block"].points
        sim.advance(1)
        body = sim.bodies["block"]
        self.assertEqual(body.points.shape, (27, 3))
        self.assertEqual(body.cells["H8"].shape, (8, 8))
        self.assertEqual(set(body.fields) | set(body.cell_fields), set(body.units))
        moved = body.points - before
        top = before[:, 2] > 0.1 - 1e-9
        np.testing.assert_allclose(moved[top], [[0.01, 0, -0.003]] * top.sum(), atol=1e-9)
        sim.close()
        gc.collect()
        self.assertEqual(body.cells["H8"].max(), 26)  # kept by the body

    def test_records_cannot_be_changed_and_do_not_become_stale(self):
        sim = am.Simulation(tube_and_wire(time={"step": 0.05, "end": 8}))
        rng = random.Random(1)
        kept = []
        while not sim.done:
            r = sim.step()
            views = [r.contacts.force, r.contacts.status, r.beams["wire"].points, r.beams["wire"].fields["moment"]]
            for v in views:
                self.assertFalse(v.flags.writeable)
                with self.assertRaises(ValueError):
                    v[...] = 0
                with self.assertRaises(ValueError):
                    v.flags.writeable = True
            if rng.random() < 0.5:
                v = rng.choice(views)
                kept.append((v, v.copy()))
            if rng.random() < 0.3 and kept:
                kept.pop(rng.randrange(len(kept)))
        del sim, r, views, v
        gc.collect()
        self.assertGreater(len(kept), 20)
        for view, copy in kept:
            np.testing.assert_array_equal(view, copy)
        record = am.Simulation(block()).step()
        for name in ("time", "contacts", "quantities", "certificate"):
            with self.assertRaises(AttributeError):
                setattr(record, name, None)
        for mapping in (record.quantities, record.units, record.beams):
            with self.assertRaises(TypeError):
                mapping["x"] = 1
        with self.assertRaises(AttributeError):
            record.certificate.error = 0

    def test_energy_and_certificate_are_those_of_the_history(self):
        r = am.Simulation(tube_and_wire()).advance(8)
        e = r.energy
        self.assertAlmostEqual(e.work, e.elastic - e.elastic_start + e.kinetic + e.friction + e.released + e.error,
                               delta=1e-15)
        self.assertLess(abs(e.error), 0.02 * e.scale)
        self.assertTrue(r.certificate.certified)
        self.assertLessEqual(r.certificate.error, r.certificate.tolerance)
        self.assertEqual(set(r.certificate.worst_overlap), {"depth", "a", "b", "point"})
        self.assertEqual(r.units["push_force"], "N")

    def test_contact_problems_of_a_step_are_solved_by_its_reaction(self):
        for scene, time in ((block(), 0.7), (tube_and_wire(), 6)):
            sim = am.Simulation(scene)
            sim.advance(time)
            problems = sim.contact_problems()
            self.assertGreater(len(problems), 0)
            for p in problems:
                self.assertEqual(len(p.reaction), len(p.q))
                self.assertEqual(len(p.identity), len(p.mu))
                self.assertLess(am.certify(p, r=p.reaction).error, 1e-6)
                self.assertTrue(am.solve(p))

    @unittest.skipIf(SANITIZED, "a sanitizer keeps memory that is given back")
    def test_memory_stays_when_simulations_are_made_and_deleted(self):
        def some(count):
            for _ in range(count):
                sim = am.Simulation(block())
                sim.step(2)
                sim.fork().step()
                sim.save()
        some(10)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        some(60)
        after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        self.assertLess(after - before, 4000)  # KiB

    def test_a_simulation_is_freed_with_its_last_name(self):
        """Without Python's search for cycles, which sees none of the memory of C++."""
        gc.disable()
        self.addCleanup(gc.enable)
        sim = am.Simulation(tube_and_wire())
        sim.inputs["wire.insertion"] = 0.01
        sim.step()
        views = sim.record.contacts.force, sim.bodies["tube"].points, sim.inputs.values
        other = sim.fork()
        other.inputs.values = other.inputs.values
        freed = weakref.ref(sim), weakref.ref(other)
        del sim, other
        self.assertEqual([g() for g in freed], [None, None])
        self.assertTrue(np.isfinite(views[1]).all())


if __name__ == "__main__":
    main()
