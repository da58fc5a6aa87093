#!/usr/bin/env python3
"""The suites notice mistakes: mutants_test.py PROGRAM MUTANT...

PROGRAM passes some quick cases of both suites; each mutant (the same program with a mistake in it,
mutate.py) fails in both. The tangent that is slightly off leaves the results as they are: the suite
of stability counts the iterations.
"""
import json
import pathlib
import subprocess
import sys

CASES = {"benchmarks": ["elastica", "torus-friction", "contact-patch", "incline", "thrown-block", "bowling-ball"],
         "stability": ["retrace", "order-and-frame", "heavy-on-light", "gaps-and-overlaps", "newton-steps"]}
FOLDERS = {"benchmarks": ["braking-block"], "stability": ["friction-range", "time-steps", "nearly-parallel"]}
ROOT = pathlib.Path(__file__).resolve().parents[1] / "cases"


def failed_rows(program, suite):
    cases = CASES[suite] + [str(ROOT / f) for f in FOLDERS[suite]]
    answer = subprocess.run([program, "validate", *cases, "--json", "--jobs", "1"], capture_output=True,
                            text=True)
    rows = json.loads(answer.stdout)
    failed = [r for r in rows if not r["passed"] and not r["left_out"]]
    assert answer.returncode == (1 if failed else 0), answer.returncode
    return len(rows), failed


def main(program, *mutants):
    missed = []
    for p in (program, *mutants):
        name = pathlib.Path(p).name
        for suite in CASES:
            rows, failed = failed_rows(p, suite)
            print(f"{name}: {suite}: {len(failed)} of {rows} rows fail, in "
                  f"{', '.join(sorted({r['case'] for r in failed})) or 'no case'}", flush=True)
            quiet = name == "amontons_stiff" and suite == "benchmarks"
            if bool(failed) != (p != program) and not quiet:
                missed.append(f"{name}, {suite}")
                for r in failed[:5]:
                    print("  ", r["case"], r["quantity"], r["value"], r["note"])
    assert not missed, missed


if __name__ == "__main__":
    main(*sys.argv[1:])
