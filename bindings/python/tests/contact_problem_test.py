"""Contact problems of their own, against closed forms."""

import os
import threading
import unittest

import numpy as np

import amontons as am
from scenes import Case, folder, main

try:
    import scipy.sparse as sparse
except ImportError:
    sparse = None

HAS_FCLIB = am.build_info()["modules"]["fclib"].startswith("/")


def random_problem(contacts, seed):
    rng = np.random.default_rng(seed)
    G = rng.normal(size=(3 * contacts, 3 * contacts))
    return am.ContactProblem(G @ G.T / contacts + 0.1 * np.eye(3 * contacts), rng.normal(size=3 * contacts),
                             rng.uniform(0, 1, contacts))


class ContactProblemTest(Case):
    def test_a_block_on_a_slope_slides_or_stays(self):
        # Weight 10 N, 45 degrees, W = 1 m/N: r_n = 10 cos(45), r_t = min(mu, tan(45)) r_n.
        q = 10 / np.sqrt(2) * np.array([-1, 1, 0])
        for mu, share in ((0.5, 0.5), (0.99, 0.99), (1.5, 1)):
            for level in ("position", "velocity"):
                s = am.solve(np.eye(3), q, mu, tolerance=1e-12, level=level)
                self.assertTrue(s)
                np.testing.assert_allclose(s.reaction, 10 / np.sqrt(2) * np.array([1, -share, 0]), atol=1e-10)
                np.testing.assert_allclose(s.u, s.reaction + q, atol=1e-14)
                self.assertLess(s.certificate.worst_cone_violation, 1e-9)

    def test_all_kinds_of_contacts_and_forms_of_numbers(self):
        # Frictionless: r = max(0, -q / W). Bilateral: r = -q / W.
        s = am.solve(np.diag([2, 4]), [-1, 2], 0, kinds=["frictionless", "bilateral"], tolerance=1e-12)
        np.testing.assert_allclose(s.reaction, [0.5, -0.5])
        W = np.array([[2, 1, 0], [0.9921875, 2, 0], [0, 0, 1.0]])
        for form in (W, np.asfortranarray(W), W.astype(np.float32), W.tolist(), W[::-1][::-1]):
            np.testing.assert_array_equal(am.ContactProblem(form, [0, 0, 0], 1).W, W)
        wide = np.zeros((6, 6))
        wide[::2, ::2] = W
        np.testing.assert_array_equal(am.ContactProblem(wide[::2, ::2], [0, 0, 0], 1).W, W)
        self.assertEqual(len(am.solve(np.empty((0, 0)), [], []).reaction), 0)

    @unittest.skipUnless(sparse, "lacks scipy")
    def test_sparse_and_matrix_free_are_the_dense_one(self):
        p = random_problem(12, 1)
        dense = am.solve(p, tolerance=1e-10)
        W = np.array(p.W)
        s = am.ContactProblem(sparse.coo_matrix(W), p.q, p.mu)
        np.testing.assert_array_equal(s.W.toarray(), W)
        np.testing.assert_allclose(am.solve(s, tolerance=1e-10).reaction, dense.reaction, atol=1e-7)
        blocks = sparse.block_diag([W[i:i + 3, i:i + 3] for i in range(0, 36, 3)])
        calls = []
        f = am.ContactProblem((lambda r: calls.append(1) or W @ r, blocks), p.q, p.mu)
        free = am.solve(f, tolerance=1e-8)
        self.assertTrue(free and calls)
        np.testing.assert_allclose(free.reaction, dense.reaction, atol=1e-5)
        wrong = am.ContactProblem((lambda r: W @ r, blocks), p.q, p.mu)
        self.assertTrue(callable(wrong.W))
        with self.assertRaises(ZeroDivisionError):
            am.solve(am.ContactProblem((lambda r: 1 / 0, blocks), p.q, p.mu))
        with self.refused("W", "3 numbers"):
            am.solve(am.ContactProblem((lambda r: r[:3], blocks), p.q, p.mu))

    def test_everything_that_is_wrong_is_reported(self):
        q, mu = [-1, 0, 0], 0.5
        for W, wrong_q, wrong_mu, place in (
                (np.eye(4), q, mu, "W"), (np.eye(3), [1, 2], mu, "q"), (np.eye(3), q, -1, "mu[0]"),
                (np.eye(3), q, [0.1, 0.2], "q"), (np.eye(3) * 1j, q, mu, "W"), ([["a"]], q, mu, "W"),
                (np.eye(3), [[1, 2, 3]], mu, "q"), (np.zeros(3), q, mu, "W"), (np.eye(3), q, None, "mu"),
                (np.array([[1, 5, 0], [0, 1, 0], [0, 0, 1.0]]), q, mu, "W"), (np.full((3, 3), np.nan), q, mu, "W"),
                (object(), q, mu, "W"), (np.eye(3), "abc", mu, "q"), ((lambda r: r, 3), q, mu, "W")):
            with self.refused(place):
                am.solve(W, wrong_q, wrong_mu)
        for options, place in (({"solver": "nsg"}, ""), ({"tolerance": 2}, ""), ({"threads": 0}, ""),
                               ({"max_iterations": -1}, ""), ({"warm_start": [1]}, ""), ({"kinds": ["glue"]}, "kinds"),
                               ({"level": "force"}, "level")):
            with self.refused(place):
                am.solve(np.eye(3), q, mu, **options)
        with self.refused("r"):
            am.certify(np.eye(3), q, mu, [1])
        with self.refused("tolerance"):
            am.certify(np.eye(3), q, mu, [1, 0, 0], tolerance=1)

    def test_no_convergence_is_a_status(self):
        p = random_problem(30, 2)
        s = am.solve(p, solver="nsgs", max_iterations=1, tolerance=1e-12)
        self.assertFalse(s)
        self.assertEqual(s.status, "stagnated")
        self.assertGreater(s.error, 1e-12)
        out = am.solve(p, max_seconds=0)
        self.assertEqual(out.status, "out_of_time")
        nothing = am.solve(np.zeros((3, 3)), [-1, 0, 0], 0.5)  # no reaction can push it out
        self.assertEqual(nothing.status, "infeasible")
        self.assertEqual(nothing.certificate.proof_contacts, (0,))

    def test_certificates_are_those_of_the_reaction_alone(self):
        p = random_problem(5, 3)
        s = am.solve(p, tolerance=1e-10, analyse=True)
        c = am.certify(p.W, p.q, p.mu, s.reaction, tolerance=1e-10)
        self.assertAlmostEqual(c.error, s.error, delta=1e-15)
        self.assertIsNone(c.rank_deficient)
        self.assertFalse(s.certificate.rank_deficient)
        self.assertGreater(am.certify(p, r=0 * s.reaction).error, 0.01)
        warm = am.solve(p, solver="nsgs", warm_start=s.reaction, tolerance=1e-8)
        self.assertLess(warm.iterations, am.solve(p, solver="nsgs", tolerance=1e-8).iterations)

    def test_solves_in_threads_are_those_in_series(self):
        problems = [random_problem(20, k) for k in range(12)]
        series = [am.solve(p).reaction.tobytes() for p in problems]
        found = [None] * len(problems)

        def work(first):
            for k in range(first, len(problems), 3):
                found[k] = am.solve(problems[k]).reaction.tobytes()
        threads = [threading.Thread(target=work, args=(k,)) for k in range(3)]
        for t in threads:
            t.start()
        for t in threads:
            t.join()
        self.assertEqual(found, series)

    @unittest.skipUnless(HAS_FCLIB, "lacks the module fclib")
    def test_a_problem_is_read_back_from_its_file(self):
        p = random_problem(4, 5)
        s = am.solve(p)
        with folder():
            am.write_fclib("p.hdf5", p, s, title="four contacts")
            again = am.read_fclib("p.hdf5")
            W = again.W if isinstance(again.W, np.ndarray) else again.W.toarray()
            np.testing.assert_array_equal(W, p.W)
            np.testing.assert_array_equal(again.q, p.q)
            np.testing.assert_array_equal(again.mu, p.mu)
            np.testing.assert_array_equal(again.reaction, s.reaction)
            self.assertEqual((again.title, again.level), ("four contacts", "position"))
            am.write_fclib("bare.hdf5", p)
            self.assertIsNone(am.read_fclib("bare.hdf5").reaction)
            with self.refused("", ""):
                am.read_fclib("nowhere.hdf5")
            with self.refused("solution"):
                am.write_fclib("x.hdf5", p, [1, 2])
            with self.assertRaises(am.WriteError) as error:
                am.write_fclib("nowhere/p.hdf5", p)
            self.assertIn("nowhere/p.hdf5", error.exception.filename)
            self.assertRegex(str(error.exception), "nowhere/p.hdf5.*(written|No such)")
            with self.refused("problem", "int"):
                am.write_fclib("p.hdf5", 3)
            self.assertIsInstance(error.exception, OSError)

    def test_a_missing_module_is_reported_with_what_to_install(self):
        from unittest import mock
        with mock.patch("amontons._native.find_module", return_value=""):
            with self.assertRaisesRegex(am.ModuleMissing, "apt-get install libfclib-dev"):
                am.read_fclib("p.hdf5")


def sliding_box(solver="", joined=False):
    """A box that slides on a slope of 45 degrees, mu 0.5, by half a step of motion."""
    scene = {"schema": 1, "gravity": [6, 0, -9.81], "bodies": {
                 "floor": {"kind": "obstacle", "surface": {"generate": "plane"}},
                 "box": {"kind": "rigid", "mass": 2, "shape": {"generate": "box", "size": [1, 1, 1]},
                         "start": {"place": [0, 0, 0.5]}}},
             "contact": [{"between": ["box", "floor"], "friction": 0.5}],
             "time": {"kind": "dynamic", "step": 0.01, "end": 0.1}}
    if joined:
        scene["couplings"] = [{"kind": "ball", "between": ["box", "world"], "at": [0, 0, 1]}]
    if solver:
        scene["contact_solver"] = {"function": solver}
    return scene


class RegisteredSolver(Case):
    def tearDown(self):
        am.register_solver("own", None)

    def test_a_step_takes_its_reactions_and_certifies_them(self):
        for joined in (False, True):
            calls = []

            def own(W, q, mu, kinds=None):
                calls.append((W.shape, q.shape, mu.shape, kinds))
                return am.solve(W, q, mu, kinds=kinds, tolerance=1e-13).reaction
            am.register_solver("own", own)
            with am.Simulation(sliding_box(joined=joined)) as ours, am.Simulation(sliding_box("own", joined)) as other:
                while not ours.done:
                    ours.step()
                    record = other.step()
                    self.assertLessEqual(record.certificate.error, record.certificate.tolerance)
                for name, value in ours.record.quantities.items():
                    self.assertAlmostEqual(other.record.quantities[name], value, delta=1e-7 * (1 + abs(value)), msg=name)
            self.assertGreaterEqual(len(calls), 10)
            for W, q, mu, kinds in calls:
                self.assertEqual(W, (q[0], q[0]))
                self.assertEqual("bilateral" in (kinds or ()), joined)

    def test_wrong_answers_and_exceptions_refuse_the_step(self):
        def fails(W, q, mu):
            raise ValueError("no idea")
        for function, words in ((fails, "raised ValueError: no idea"), (lambda W, q, mu: q[:-1], "numbers for"),
                                (lambda W, q, mu: "text", "could not convert"),
                                (lambda W, q, mu: np.nan * q, "not finite"),
                                (lambda W, q, mu: 0 * q, "an error of")):
            am.register_solver("own", function)
            with am.Simulation(sliding_box("own")) as sim:
                sim.step()  # where it begins
                with self.assertRaisesRegex(am.SolveFailed, words):
                    sim.step()
                self.assertEqual(sim.time, 0)

    def test_names_and_functions_that_are_none(self):
        with self.assertRaises(am.InputError) as error:
            am.Simulation(sliding_box("nobody"))
        self.assertEqual(error.exception.issues[0]["place"], "/contact_solver/function")
        with self.assertRaises(am.InputError):
            am.register_solver("own", 3)
        with self.assertRaises(am.InputError):
            am.register_solver("", print)


if __name__ == "__main__":
    main()
