#!/usr/bin/env python3
"""Every case has its folder, whose README.md states what it is: case_readme_test.py PROGRAM CASES

CASES is the folder of cases that PROGRAM has to find: each of its folders is a case of `validate --list`, and
each case is one of them, with a first paragraph. A case in C++ shows it with its result, as one of scenes does.
"""
import json
import pathlib
import subprocess
import sys

QUICK = ["table-legs", "jammed-block"]  # in C++, of a scene


def main(program, cases):
    def answer(*arguments):
        return json.loads(subprocess.run([program, "validate", *arguments, "--json"], capture_output=True, check=True,
                                         text=True).stdout)

    listed = answer("--list")
    folders = {str(p.resolve()) for p in pathlib.Path(cases).iterdir()}
    mistakes = [f"{c['case']} has no folder of its name in {cases}" for c in listed
                if c["folder"] not in folders or pathlib.Path(c["folder"]).name != c["case"]]
    mistakes += [f"{c['case']} has no {what}" for c in listed for what in ("about", "verified") if not c[what].strip()]
    mistakes += [f"{f} is no case" for f in sorted(folders - {c["folder"] for c in listed})]
    output = {c["case"]: (c["about"], c["verified"]) for c in listed}
    mistakes += [f"{r['case']}: its result does not state what the list states" for r in answer(*QUICK)
                 if (r.get("about"), r.get("verified")) != output[r["case"]]]
    print("\n".join(mistakes) or f"{len(listed)} cases")
    return 1 if mistakes else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
