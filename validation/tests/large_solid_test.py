"""Large solids from outside: which way is taken and why, memory, mpirun and its faults.

    large_solid_test.py PROGRAM
"""
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

PROGRAM = ""
MPIRUN = shutil.which("mpirun")
# As root, in containers with fewer cores than ranks.
ENVIRONMENT = {**os.environ, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
               "OMPI_MCA_rmaps_base_oversubscribe": "1", "OMPI_MCA_mpi_yield_when_idle": "1"}


def block(cells=(6, 6, 5), element="T4", end=2, step=1):
    size = 0.1
    height = size * cells[2] / cells[0]
    return {
        "schema": 1,
        "bodies": {
            "plate": {"kind": "obstacle", "surface": {"generate": "plane"}},
            "block": {
                "kind": "solid", "youngs_modulus": 1e6, "poisson_ratio": 0.3,
                "mesh": {"generate": "box", "size": [size, size * cells[1] / cells[0], height],
                         "cells": list(cells), "element": element, "centre": [0, 0, height / 2]},
                "hold": [{"set": "z_max", "x": [[1, 0], [end, 2e-4]], "y": [[0, 0]],
                          "z": [[0, 0], [1, -1e-3]]}]}},
        "contact": [{"between": ["block", "plate"], "friction": 0.3}],
        "time": {"step": step, "end": end},
        "accuracy": {"contact": 1e-8},
        "output": {"picture": False, "plots": False},
    }


class Large(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.write(block())

    def write(self, scene):
        (self.folder / "scene.json").write_text(json.dumps(scene))

    def call(self, *arguments, before=(), program=None, env=None):
        return subprocess.run([*before, program or PROGRAM, *arguments], cwd=self.folder, text=True,
                              capture_output=True, timeout=240, env=env or ENVIRONMENT)

    def run_linear(self, linear, *more, before=()):
        result = self.call("run", "scene.json", "--output", linear, "--set", f"solver.linear={linear}",
                           "--json", *more, before=before)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout)

    def same(self, a, b, share=1e-6):
        for name in ("block_reaction_x", "block_reaction_z"):
            keys = [k for k in a["quantities"] if k.startswith("block") and k[-2:] == name[-2:]]
            self.assertTrue(keys, a["quantities"].keys())
            for k in keys:  # against the vector: a component may be near 0
                size = sum(a["quantities"][k[:-1] + axis] ** 2 for axis in "xyz") ** 0.5
                self.assertAlmostEqual(a["quantities"][k], b["quantities"][k],
                                       delta=share * max(1e-9, size), msg=k)

    def test_check_lists_every_method(self):
        plan = json.loads(self.call("check", "scene.json", "--json").stdout)
        linear = plan["predicted"]["linear"]
        self.assertEqual(linear["taken"], "direct")
        self.assertTrue(linear["why"])
        self.assertEqual([p["name"] for p in linear["paths"]], ["direct", "iterative", "distributed"])
        for p in linear["paths"]:
            self.assertGreater(p["memory"], 1e6)
            self.assertGreater(p["seconds"], 0)
        text = self.call("check", "scene.json").stdout
        self.assertIn("iterative", text)
        result = self.call("check", "scene.json", "--set", "solver.linear=iteratve")
        self.assertEqual(result.returncode, 2)
        self.assertIn("iterative", result.stderr)

    def test_methods_agree_and_report_which_was_used(self):
        direct, other = self.run_linear("direct"), self.run_linear("iterative")
        self.same(direct, other)
        self.assertLessEqual(other["certificate"]["worst_error"], 1e-8)
        manifest = json.loads((self.folder / "iterative/manifest.json").read_text())
        after = manifest["peak_memory_after"]
        self.assertGreaterEqual(after["offline"], after["read"])
        self.assertGreaterEqual(after["steps"], after["offline"])

    def test_more_memory_than_there_is_is_refused_before(self):
        if b"__asan_init" in pathlib.Path(PROGRAM).read_bytes():
            self.skipTest("sanitizers take all addresses")
        self.write(block((48, 48, 40)))
        result = self.call("run", "scene.json", "--output", "out", "--set", "solver.linear=direct",
                           before=("bash", "-c", 'ulimit -v 900000; exec "$0" "$@"'))
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("GB", result.stderr)
        self.assertIn("solver/linear", result.stderr)
        self.assertFalse((self.folder / "out").exists())
        self.write(block((4000, 4000, 4000)))
        result = self.call("run", "scene.json", "--output", "out")
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("GB", result.stderr)

    def test_factors_need_no_petsc(self):
        self.write(block((12, 12, 10), end=400))
        for linear, there in (("direct", False), ("iterative", True)):
            process = subprocess.Popen(
                [PROGRAM, "run", "scene.json", "--output", linear, "--set", f"solver.linear={linear}"],
                cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=ENVIRONMENT)
            history = self.folder / linear / "history.csv"
            while process.poll() is None and not history.exists():
                time.sleep(0.01)
            maps = pathlib.Path(f"/proc/{process.pid}/maps").read_text()
            process.send_signal(signal.SIGKILL)
            process.wait()
            for library in ("libmpi", "libpetsc"):
                self.assertEqual(library in maps, there, library)

    def test_without_the_module(self):
        alone = self.folder / "alone"
        shutil.copy(PROGRAM, alone)
        result = self.call("run", "scene.json", "--set", "solver.linear=iterative", program=str(alone))
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("libamontons-petsc.so", result.stderr)
        plan = json.loads(self.call("check", "scene.json", "--json", program=str(alone)).stdout)
        self.assertFalse(plan["predicted"]["linear"]["paths"][1]["possible"])
        self.assertEqual(self.call("run", "scene.json", program=str(alone)).returncode, 0)

    def test_without_mpi_or_petsc(self):
        """The module is there, what it needs is not: stated as bad input, and factors continue."""
        module = pathlib.Path(PROGRAM).parent.parent / "lib/amontons/libamontons-petsc.so"
        needed = [line.split()[0] for line in subprocess.run(
            ["ldd", str(module)], capture_output=True, text=True).stdout.splitlines()]
        missing = [name for name in needed if name.startswith(("libmpi.", "libpetsc"))]
        self.assertEqual(len(missing), 2, needed)
        for library in missing:
            broken = self.folder / library.split(".")[0]
            broken.mkdir()
            (broken / library).write_text("not a library")
            environment = {**ENVIRONMENT, "LD_LIBRARY_PATH": str(broken)}
            result = self.call("run", "scene.json", "--set", "solver.linear=iterative", env=environment)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn("libamontons-petsc.so", result.stderr)
            self.assertIn(library, result.stderr)
            self.assertIn("/solver/linear", result.stderr)
            self.assertEqual(self.call("run", "scene.json", "--output", library, env=environment).returncode, 0)
            if MPIRUN:
                inner = ["env", f"LD_LIBRARY_PATH={broken}"]
                result = self.call("run", "scene.json", before=(MPIRUN, "-n", "2", *inner))
                self.assertEqual(result.returncode, 2, result.stderr)
                self.assertIn(library, result.stderr)

    def test_distributed_without_mpirun(self):
        result = self.call("run", "scene.json", "--set", "solver.linear=distributed")
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertIn("mpirun", result.stderr)

    @unittest.skipUnless(MPIRUN, "lacks mpirun (openmpi-bin)")
    def test_ranks_have_the_same_results(self):
        direct = self.run_linear("direct")
        for ranks in (2, 3):
            other = self.run_linear("distributed", before=(MPIRUN, "-n", str(ranks)))
            self.same(direct, other)
        self.write(block((1, 1, 1)))  # 8 nodes: ranks without nodes or elements
        self.same(self.run_linear("direct"), self.run_linear("distributed", before=(MPIRUN, "-n", "5")))

    @unittest.skipUnless(MPIRUN, "lacks mpirun (openmpi-bin)")
    def test_a_mistake_in_the_scene_ends_all_ranks(self):
        result = self.call("run", "missing.json", before=(MPIRUN, "-n", "2"))
        self.assertEqual(result.returncode, 2, result.stderr)
        self.assertEqual(result.stderr.count("missing.json"), self.call("run", "missing.json").stderr.count(
            "missing.json"))

    @unittest.skipUnless(MPIRUN, "lacks mpirun (openmpi-bin)")
    def test_a_wrong_option_is_reported_once(self):
        result = self.call("run", "scene.json", "--fresh", before=(MPIRUN, "-n", "2"))
        self.assertEqual(result.returncode, 2)
        self.assertEqual(result.stderr.count("error: "), 1, result.stderr)

    @unittest.skipUnless(MPIRUN, "lacks mpirun (openmpi-bin)")
    def test_a_part_without_contacts_takes_part(self):
        self.write(block((1, 1, 12)))  # METIS cuts it across: one part is far from the plate
        self.same(self.run_linear("direct"), self.run_linear("distributed", before=(MPIRUN, "-n", "2")))

    def start_two_ranks(self):
        """A run with finished steps; and the processes of its ranks."""
        self.write(block((10, 10, 8), end=4000))
        process = subprocess.Popen(
            [MPIRUN, "-n", "2", PROGRAM, "run", "scene.json", "--output", "out",
             "--set", "solver.linear=distributed"],
            cwd=self.folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
        self.addCleanup(process.kill)
        history = self.folder / "out/history.csv"
        while process.poll() is None and (not history.exists() or history.read_text().count("\n") < 3):
            time.sleep(0.05)
        self.assertIsNone(process.poll(), "ended by itself")
        ranks = {}
        for child in pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split():
            environment = pathlib.Path(f"/proc/{child}/environ").read_bytes().split(b"\0")
            for k in (0, 1):
                if b"OMPI_COMM_WORLD_RANK=%d" % k in environment:
                    ranks[k] = int(child)
        self.assertEqual(len(ranks), 2)
        return process, ranks

    def finished_steps_are_valid(self):
        lines = (self.folder / "out/history.csv").read_text().splitlines()
        self.assertGreater(len(lines), 2)
        self.assertTrue(all(line.count(",") == lines[0].count(",") for line in lines), "torn line")
        return json.loads((self.folder / "out/manifest.json").read_text())

    @unittest.skipUnless(MPIRUN, "lacks mpirun (openmpi-bin)")
    def test_a_killed_rank_ends_the_run_with_valid_output(self):
        process, ranks = self.start_two_ranks()
        os.kill(ranks[1], signal.SIGKILL)
        out, err = process.communicate(timeout=60)
        self.assertNotEqual(process.returncode, 0)
        self.assertIn("rank 1", err)
        self.assertIn("Killed", err)
        self.finished_steps_are_valid()

    @unittest.skipUnless(MPIRUN, "lacks mpirun (openmpi-bin)")
    def test_a_run_continues_with_another_number_of_ranks(self):
        """Stopped on two ranks, continued with on three: the answer of a run that nothing stopped."""
        self.write(block((4, 4, 3), end=8, step=0.25))
        linear = ("--output", "out", "--set", "solver.linear=distributed")
        process = subprocess.Popen([MPIRUN, "-n", "2", PROGRAM, "run", "scene.json", *linear], cwd=self.folder,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=ENVIRONMENT)
        self.addCleanup(process.kill)
        history = self.folder / "out/history.csv"
        while process.poll() is None and (not history.exists() or history.read_text().count("\n") < 6):
            time.sleep(0.02)
        self.assertIsNone(process.poll(), "ended by itself")
        self.interrupt(process)
        resumed = self.call("run", "scene.json", *linear, "--resume", "--json", before=(MPIRUN, "-n", "3"))
        self.assertEqual(resumed.returncode, 0, resumed.stderr)
        self.same(self.run_linear("iterative"), json.loads(resumed.stdout))
        whole = (self.folder / "iterative/history.csv").read_text().splitlines()
        parts = (self.folder / "out/history.csv").read_text().splitlines()
        self.assertEqual([line.split(",")[:2] for line in whole], [line.split(",")[:2] for line in parts])

    def interrupt(self, process):
        """Ctrl-C for rank 0; the checkpoint of the last step is there then."""
        for child in pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split():
            if b"OMPI_COMM_WORLD_RANK=0" in pathlib.Path(f"/proc/{child}/environ").read_bytes().split(b"\0"):
                os.kill(int(child), signal.SIGINT)
        process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130)

    @unittest.skipUnless(MPIRUN, "lacks mpirun (openmpi-bin)")
    def test_a_full_disk_ends_all_ranks_with_valid_output(self):
        process, ranks = self.start_two_ranks()
        # Rank 0 alone writes. From here on its files may not grow.
        size = (self.folder / "out/history.csv").stat().st_size
        resource.prlimit(ranks[0], resource.RLIMIT_FSIZE, (size, size))
        out, err = process.communicate(timeout=120)
        self.assertEqual(process.returncode, 3, err)
        self.assertIn("out/", err)
        self.finished_steps_are_valid()

    @unittest.skipUnless(MPIRUN, "lacks mpirun (openmpi-bin)")
    def test_an_interrupt_ends_all_ranks(self):
        process, ranks = self.start_two_ranks()
        os.kill(ranks[0], signal.SIGINT)
        process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130)
        self.assertEqual(self.finished_steps_are_valid()["status"], "interrupted")


if __name__ == "__main__":
    PROGRAM = str(pathlib.Path(sys.argv.pop(1)).resolve())
    reported_skips.main()
