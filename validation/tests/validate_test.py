#!/usr/bin/env python3
"""amontons validate from outside: validate_test.py PROGRAM [CASE ...]

Runs the cases, prints what fails, and holds the answer to its contract.
"""
import json
import subprocess
import sys
import tempfile

SKIPPED = 77  # nothing could be tried here: CTest's SKIP_RETURN_CODE
KEYS = {"case", "suite", "source", "quantity", "reference", "value", "error", "tolerance",
        "passed", "left_out", "seconds", "verified", "about"}


def run(program, *arguments):
    return subprocess.run([program, "validate", *arguments], capture_output=True, text=True)


def main(program, cases):
    known = [c["case"] for c in json.loads(run(program, "--list", "--json").stdout)]
    assert len(set(known)) == len(known) and set(cases) <= set(known), known
    both = [len(json.loads(run(program, "--list", "--json", "--suite", s).stdout))
            for s in ("benchmarks", "stability")]
    assert sum(both) == len(known) and min(both) > 0

    unknown = run(program, "no-such-case", "--json")
    assert unknown.returncode == 2 and "no-such-case" in unknown.stderr
    assert run(program, "--suite", "no-such-suite").returncode == 2

    with tempfile.TemporaryDirectory() as folder:
        answer = run(program, *cases, "--json", "--report", folder)
        rows = json.loads(answer.stdout)
        assert json.load(open(folder + "/validation.json")) == rows
        assert "| " + cases[0] + " |" in open(folder + "/validation.md").read()
        assert f'id="{cases[0]}"' in open(folder + "/index.html").read()
    assert [c for c in known if c in cases] == list(dict.fromkeys(r["case"] for r in rows)), rows
    failed = left_out = 0
    for r in rows:
        assert KEYS <= r.keys(), r
        within = r["error"] is not None and r["error"] <= r["tolerance"]
        if r["left_out"]:  # does not count; what misses its source's tolerance reports it
            assert r["error"] is None or r["passed"] == within, r
            left_out += 1
            print("left out {case}: {quantity}: {left_out}".format(**r))
            continue
        assert r["passed"] == within, r
        if not r["passed"]:
            failed += 1
            print("FAILED {case}: {quantity}: reference {reference}, value {value}, error {error}, "
                  "tolerance {tolerance}; {note}".format(**r))
    assert answer.returncode == (1 if failed else 0), answer.returncode
    print(f"{len(rows)} rows of {len(cases)} cases, {failed} failed, {left_out} left out, "
          f"{sum({r['case']: r['seconds'] for r in rows}.values()):.1f} s")
    if failed:
        return 1
    return SKIPPED if left_out == len(rows) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1], sys.argv[2:]))
