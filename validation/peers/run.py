#!/usr/bin/env python3
"""The same cases in amontons and in the peers that are installed: error against processor time.

    run.py PROGRAM [--results docs/results] [--cases patch,hertz,...] [--levels N] [--repeat 3]

Peers, each taken if it is there (Debian's calculix-ccx, python3-getfem, python3-siconos): CalculiX,
GetFEM, Siconos. None is needed to build or test amontons. The meshes come from `amontons mesh generate`
and are the same for all, and so are loads, holds and references (solids.py). One thread. Of amontons and
CalculiX the time is that of the whole process, reading and writing included; of GetFEM and Siconos, which
are libraries, that of their process after its imports. A peer with a setting to choose (penalty of
CalculiX) runs with several; the table has them all, the plot the most accurate one of each point.

contact-problems runs contact_profile with siconos_driver on a generated set, if both are built beside
PROGRAM. With --results: side_by_side.csv and side_by_side.svg (needs gnuplot); rows of cases that are not run
stay as they are.
"""
import argparse
import csv
import json
import math
import os
import resource
import shutil
import subprocess
import sys
import tempfile

import amontons_peer
import calculix_peer
import getfem_peer
import siconos_peer
import solids
from common import draw

STEPS = (0.02, 0.01, 0.005, 0.0025, 0.00125)
STOPS_AT = 3.0**2 / (2 * 0.4 * 9.81) # closed form, validation/cases/braking-block [m]
CASES = [*solids.CASES, "braking-block", "contact-problems"]
COLUMNS = ("case", "level", "unknowns", "who", "setting", "error", "value", "seconds", "status")


def braking_block(program, step, theta, folder):
    scene = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../cases/braking-block/scene.json")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([program, "run", scene, "--set", f"time.step={step}", "--set", f"time.theta={theta}",
                           "--set", "output.every=100000", "--set", "output.picture=false", "--set",
                           "output.plots=false", "--quiet", "--json", "--threads", "1", "--output", folder + "/result"],
                          capture_output=True, text=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        raise RuntimeError((done.stderr.strip().splitlines() or ["no word"])[-1][:200])
    return (json.loads(done.stdout)["quantities"]["block_x"],
            after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


class Table:
    def __init__(self):
        self.rows = []
        self.too_slow = set() # programs and settings that were stopped: finer meshes are left out

    def add(self, case, level, unknowns, who, setting, solve, repeat):
        """Adds a row for each error of the fastest of `repeat` calls of solve() -> errors, seconds."""
        best, errors, status = math.inf, {"": math.nan}, "ok"
        try:
            if (case, who, setting) in self.too_slow:
                raise RuntimeError("left out: too slow on the mesh before")
            for _ in range(repeat):
                found, seconds = solve()
                if seconds < best:
                    best, errors = seconds, found
                if seconds > 5: # long enough to be measured once
                    break
        except (RuntimeError, KeyError, ValueError, ZeroDivisionError, OSError) as error:
            status = f"{type(error).__name__}: {error}" if not isinstance(error, RuntimeError) else str(error)
            best = math.nan
            if status.startswith("stopped"):
                self.too_slow.add((case, who, setting))
        for name, value in errors.items():
            self.rows.append(dict(zip(COLUMNS, (case, level, unknowns, who, setting, name, value, best,
                                                status))))
        shown = ", ".join(f"{n} {v:.2e}" for n, v in errors.items() if n) or status
        print(f"{case:<14}{level!s:<8}{unknowns!s:<8}{who + ' ' + setting:<26}{best:>9.3f} s  {shown}",
              flush=True)


def run_solid(table, name, program, peers, levels, repeat):
    make, errors = solids.CASES[name][:2]
    for level in levels:
        with tempfile.TemporaryDirectory() as folder:
            problem = make(program, folder, level)
            unknowns = 3 * sum(len(b["mesh"].nodes) for b in problem["bodies"].values())

            def add(who, setting, solve):
                def measured():
                    with tempfile.TemporaryDirectory() as inside:
                        answer = solve(inside)
                    return errors(problem, answer), answer["seconds"]
                table.add(name, level, unknowns, who, setting, measured, repeat)

            add("amontons", "", lambda inside: amontons_peer.solve(program, problem, inside))
            if "CalculiX" in peers:
                for factor in calculix_peer.FACTORS if problem["contact"] else (0,):
                    add("CalculiX", f"K {factor} E/h" if factor else "",
                        lambda inside, f=factor: calculix_peer.solve(problem, inside, f))
            if "GetFEM" in peers:
                add("GetFEM", "", lambda inside: getfem_peer.solve(problem, inside, 1))


def run_block(table, program, peers, steps, repeat):
    for step in steps:
        with tempfile.TemporaryDirectory() as folder:
            def ours(theta):
                place, seconds = braking_block(program, step, theta, folder)
                return {"stop": abs(place / STOPS_AT - 1)}, seconds

            def theirs():
                place, seconds = siconos_peer.solve(step)
                return {"stop": abs(place / STOPS_AT - 1)}, seconds
            for name, theta in (("implicit Euler", 1), ("midpoint", 0.5)):
                table.add("braking-block", step, "", "amontons", name, lambda t=theta: ours(t), repeat)
            if "Siconos" in peers:
                table.add("braking-block", step, "", "Siconos", "midpoint", theirs, repeat)


def run_problems(program, results):
    """contact_profile writes its own tables and plots."""
    tools = [os.path.join(os.path.dirname(os.path.abspath(program)), t) for t in ("contact_profile",
                                                                                  "siconos_driver")]
    missing = [os.path.basename(t) for t in tools if not os.path.exists(t)]
    if missing:
        print(f"contact-problems left out: {' and '.join(missing)} not built (ninja contact_profile; the "
              "driver needs libsiconos-numerics-dev)")
        return
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([tools[0], "--siconos", tools[1], "--tolerances", "1e-8", "--cap", "1", "--give-up", "20",
                        "--size", "0.5", "--solvers", "auto,NSGS-PLI,NSGS-NSN,NSN_AC,PROX-NSN_AC,ADMM",
                        "--output", folder], check=False)
        if results:
            shutil.copy(folder + "/against_siconos.csv", results + "/side_by_side_contact.csv")
            shutil.copy(folder + "/profile_1e-08.svg", results + "/side_by_side_contact.svg")


def write(rows, case, folder):
    """Table and plot, with the rows of other cases that the table has."""
    path = os.path.join(folder, "side_by_side.csv")
    rows = sorted(others(path, case) + rows, key=lambda r: CASES.index(r["case"]))
    with open(path, "w", newline="") as out:
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow([c + " [s]" if c == "seconds" else c for c in COLUMNS])
        for r in rows:
            writer.writerow([f"{r[c]:.4g}" if isinstance(r[c], float) else r[c] for c in COLUMNS])
    plot(rows, os.path.join(folder, "side_by_side.svg"))


def others(path, case):
    rows = []
    if os.path.exists(path):
        for row in csv.reader(open(path, newline="")):
            row = dict(zip(COLUMNS, row))
            if row["case"] in CASES and row["case"] != case:
                row["value"], row["seconds"] = float(row["value"]), float(row["seconds"])
                rows.append(row)
    return rows


def plot(rows, path):
    titles = {**{n: c[4] for n, c in solids.CASES.items()}, "braking-block": "thrown block stops"}
    main = {**{n: c[3] for n, c in solids.CASES.items()}, "braking-block": "stop"}
    shown = [c for c in main if any(r["case"] == c for r in rows)]
    text = ["set terminal svg size 1050,680 font 'Helvetica,12' background rgb 'white'",
            f"set output '{path}'", f"set multiplot layout 2,{(len(shown) + 1) // 2}",
            "set logscale xy", "set format y '10^{%T}'", "set grid", "set format x '%g'", "set xlabel 'processor time [s]'",
            "set key bottom left"]
    colours = {"amontons": "#c03000", "CalculiX": "#3060a0", "GetFEM": "#207040", "Siconos": "#805090"}
    for case in shown:
        best = {}
        for r in rows:
            at = r["who"], r["level"]
            if r["case"] == case and r["error"] == main[case] and r["value"] == r["value"] and (
                    at not in best or r["value"] < best[at][1]):
                best[at] = r["seconds"], r["value"]
        lines = []
        for who in colours:
            points = sorted((t, e) for (w, _), (t, e) in best.items() if w == who)
            if points:
                block = f"${case.replace('-', '_')}_{who}"
                text += [f"{block} << END"] + [f"{t:.6g} {max(e, 1e-16):.6g}" for t, e in points] + ["END"]
                lines.append(f"{block} with linespoints lw 2 pt 7 ps 0.6 lc rgb '{colours[who]}' title '{who}'")
        if lines:
            text += [f"set title '{titles[case]}'", f"set ylabel 'error of the {main[case]}'",
                     "plot " + ", ".join(lines)]
    draw(text + ["unset multiplot"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--results", default="")
    parser.add_argument("--cases", default=",".join(CASES))
    parser.add_argument("--levels", type=int, default=9, help="of each case, from the coarsest")
    parser.add_argument("--only", default="", help="amontons and these peers, separated by commas")
    parser.add_argument("--longest", type=int, default=60, help="processor time of a peer's run [s]")
    parser.add_argument("--repeat", type=int, default=3)
    arguments = parser.parse_args()
    chosen = arguments.cases.split(",")
    for case in chosen:
        if case not in CASES:
            parser.error(f"found case \"{case}\", allowed: {', '.join(CASES)}")
    if not os.access(arguments.program, os.X_OK):
        parser.error(f"no program {arguments.program}")
    if arguments.results and not os.path.isdir(arguments.results):
        parser.error(f"no folder {arguments.results}")
    os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", CCX_NPROC_STIFFNESS="1",
                      CCX_NPROC_EQUATION_SOLVER="1")
    calculix_peer.LONGEST = getfem_peer.LONGEST = arguments.longest
    peers = {}
    for name, found, package in (("CalculiX", calculix_peer.version(), "calculix-ccx"),
                                 ("GetFEM", getfem_peer.version(), "python3-getfem"),
                                 ("Siconos", siconos_peer.version(), "python3-siconos")):
        if arguments.only and name not in arguments.only.split(","):
            print(f"{name} was not requested")
        elif found:
            peers[name] = found
            print(f"{found} takes part")
        else:
            print(f"{name} is not installed (Debian: {package}): left out")
    for case in chosen:
        table = Table()
        if case in solids.CASES:
            run_solid(table, case, arguments.program, peers, solids.CASES[case][2][:arguments.levels],
                      arguments.repeat)
        elif case == "braking-block":
            run_block(table, arguments.program, peers, STEPS[:arguments.levels], arguments.repeat)
        else:
            run_problems(arguments.program, arguments.results)
        if arguments.results and table.rows:
            write(table.rows, case, arguments.results)
    return 0


if __name__ == "__main__":
    sys.exit(main())
