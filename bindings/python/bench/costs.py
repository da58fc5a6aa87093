"""What Python costs beside the program, on examples/catheter. Prints a table; run it on a quiet machine.

    PYTHONPATH=build/release/lib/python3/site-packages python3 bindings/python/bench/costs.py
"""

import csv
import os
import resource
import subprocess
import sys
import tempfile
import time

CATHETER = os.path.join(os.path.dirname(__file__), "../../../examples/catheter/scene.json")


def cpu(who=resource.RUSAGE_SELF):
    usage = resource.getrusage(who)
    return usage.ru_utime + usage.ru_stime


def importing():
    """Least of 20 processes with, less those without, beside numpy [ms of processor time]."""
    def least(code):
        best = 9e9
        for _ in range(20):
            before = cpu(resource.RUSAGE_CHILDREN)
            subprocess.run([sys.executable, "-c", code], check=True)
            best = min(best, cpu(resource.RUSAGE_CHILDREN) - before)
        return best
    return 1e3 * (least("import numpy, amontons") - least("import numpy"))


def main():
    print(f"import amontons beyond numpy: {importing():.0f} ms")
    import amontons as am
    program = am.build_info()["program"]
    quiet = ["--quiet", "--set", "output.picture=false", "--set", "output.plots=false"]
    of_program, of_python, stepping = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(5):  # in turns
            before = cpu(resource.RUSAGE_CHILDREN)
            subprocess.run([program, "run", CATHETER, "--output", folder + "/a", *quiet], check=True)
            of_program.append(cpu(resource.RUSAGE_CHILDREN) - before)
            before = cpu()
            sim = am.Simulation(CATHETER, set={"output.picture": False, "output.plots": False})
            sim.run(folder + "/b")
            of_python.append(cpu() - before)
            sim, forces = am.Simulation(CATHETER), []
            before = cpu()
            while not sim.done:
                forces.append(sim.step().quantities["push_force"])
            stepping.append(cpu() - before)
        rows = [list(csv.reader(open(f"{folder}/{k}/history.csv"))) for k in "ab"]
    keep = [k for k, name in enumerate(rows[0][0]) if "seconds" not in name]
    same = all([a[k] for k in keep] == [b[k] for k in keep] for a, b in zip(*rows)) and len(rows[0]) == len(rows[1])
    push = rows[0][0].index("push_force [N]")
    same = same and [float(r[push]) for r in rows[0][1:]] == forces
    print(f"amontons run: {min(of_program):.2f} s; Simulation.run with the same files: {min(of_python):.2f} s; "
          f"stepped without files: {min(stepping):.2f} s; the same bits: {same}")

    sim = am.Simulation(CATHETER)
    sim.step(300)
    end = am.Simulation(CATHETER, set={"time.end": 0.02})
    end.step(100)

    def each(count, work):
        start = time.process_time()
        for _ in range(count):
            work()
        return (time.process_time() - start) / count
    print(f"a call of step() that has nothing to do: {1e6 * each(20000, end.step):.1f} us")
    print(f"save: {1e3 * each(2000, sim.save):.3f} ms, {len(sim.save())} bytes; "
          f"restore: {1e3 * each(2000, lambda s=sim.save(): sim.restore(s)):.3f} ms")
    inputs = sim.inputs
    print(f"set an input: {1e6 * each(20000, lambda: inputs.__setitem__('wire.twist', 0.1)):.2f} us")
    record = sim.step()
    print(f"a view of all contact forces: {1e6 * each(20000, lambda: record.contacts.force):.2f} us")
    scene = am.Scene(CATHETER)
    am.Simulation(scene).step(300)
    print(f"a second simulation in one vessel: {1e3 * each(200, lambda: am.Simulation(scene)):.1f} ms; "
          f"fork: {1e3 * each(500, sim.fork):.1f} ms")

    def memory(count):
        code = ("import amontons as am, resource\n"
                f"b = am.Batch({os.path.abspath(CATHETER)!r}, {count}); b.advance(4)\n"
                "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)")
        return float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout)
    print(f"memory of 8 and 64 in one vessel: {memory(8):.0f} and {memory(64):.0f} MB")
    rates = []
    for threads in (1, len(os.sched_getaffinity(0))):
        batch = am.Batch(CATHETER, 64, threads=threads)
        batch.advance(0.2)
        start = time.perf_counter()
        batch.advance(1)
        rates.append(1 / (time.perf_counter() - start))
    print(f"Batch(64) on {len(os.sched_getaffinity(0))} processors: {rates[1] / rates[0]:.2f} times one")

    small = {"schema": 1, "bodies": {"tube": {"kind": "obstacle", "surface": {"generate": "tube", "radius": 0.004,
             "centreline": {"pieces": [{"length": 0.1}]}}}, "wire": {"kind": "beam", "drive": {"insertion": [[0, 0], [8, 0.08]]},
             "segments": [{"length": 0.15, "radius": 4.445e-4, "EI": 5.2e-4, "element": 2.5e-3}]}},
             "contact": [{"between": ["wire", "tube"]}], "time": {"step": 0.1, "end": 8}}
    peaks = []
    for k in range(1001):
        one = am.Simulation(small)
        one.step(3)
        one.save()
        if k in (100, 1000):
            peaks.append(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    print(f"peak memory after 100 and 1000 simulations made and given up: {peaks[0]:.1f} and {peaks[1]:.1f} MB")


if __name__ == "__main__":
    main()
