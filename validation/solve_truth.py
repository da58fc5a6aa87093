#!/usr/bin/env python3
"""What amontons solve reports against what its file shows: a table over contact problems.

    validation/solve_truth.py PROGRAM FCLIB_ERROR PROBLEM.hdf5... [--tolerance 1e-12] [--max-time 60]

FCLIB_ERROR: the program validation/bench/fclib_error.cpp, which recomputes the natural map of the written
/solution in long double. Exit 1 where the two differ by more than a factor of two and either is above
1e-14, or where a status does not fit: "converged" above the tolerance, "at_round_off" above the threshold.
"""
import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

LEAST = 1e-14


def main():
    options = argparse.ArgumentParser()
    options.add_argument("program")
    options.add_argument("fclib_error")
    options.add_argument("problem", nargs="+")
    options.add_argument("--tolerance", type=float, default=1e-12)
    options.add_argument("--max-time", type=float, default=60)
    a = options.parse_args()
    wrong = 0
    print(f"{'problem':46} {'status':>12} {'seconds':>8} {'threshold':>9} {'told':>9} {'found':>9} {'ratio':>6}")
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "out.hdf5"
        for problem in a.problem:
            run = subprocess.run([a.program, "solve", problem, "--tolerance", str(a.tolerance), "--max-time",
                                  str(a.max_time), "--output", str(out), "--json"], capture_output=True, text=True)
            reported = json.loads(run.stdout)
            again = subprocess.run([a.fclib_error, str(out)], capture_output=True, text=True)
            if again.returncode:
                print(f"{pathlib.Path(problem).stem:46} {reported['status']:>12}  {again.stderr.strip()}")
                wrong += 1
                continue
            found = float(again.stdout.split()[1])
            error = reported["error"]
            ratio = max(error, found) / max(min(error, found), 1e-300)
            bad = max(error, found) > LEAST and ratio > 2
            bad |= reported["status"] == "converged" and found > 1.01 * a.tolerance
            bad |= reported["status"] == "at_round_off" and found > 1.01 * reported["threshold"]
            bad |= (run.returncode == 0) != (reported["status"] in ("converged", "at_round_off"))
            wrong += bad
            print(f"{pathlib.Path(problem).stem:46} {reported['status']:>12} {reported['seconds']:8.2f} {reported['threshold']:9.1e} "
                  f"{error:9.2e} {found:9.2e} {ratio:6.2f}{'  <' if bad else ''}", flush=True)
    print(f"{len(a.problem)} problems, {wrong} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
