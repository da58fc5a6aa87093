#!/usr/bin/env python3
"""amontons validate --suite random from outside: random_scenes_test.py PROGRAM [KIND ...] [--seed S] [--count N]

Runs some of the random scenes, prints what is wrong, and holds the answer and the options to their contract.
"""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile

KEYS = {"case", "suite", "passed", "scene", "drawn", "outcome", "findings", "seconds", "cpu_seconds", "folder"}


def run(program, *arguments):
    return subprocess.run([program, "validate", *arguments], capture_output=True, text=True)


def check_options(program):
    """Bad values are refused with what is allowed, and nothing runs."""
    for options in (["--seed", "x"], ["--seed", "-1"], ["--count", "0"], ["--count", "many"], ["--scene", "-1"],
                    ["--program", "/no/such/program"], ["no_such_kind"]):
        answer = run(program, "--suite", "random", *options)
        assert answer.returncode == 2 and options[-1] in answer.stderr, (options, answer)
    alone = run(program, "--seed", "3", "elastica")
    assert alone.returncode == 2 and "--suite random" in alone.stderr, alone
    kinds = json.loads(run(program, "--suite", "random", "--list", "--json").stdout)
    assert len(kinds) >= 24 and all(k["about"] and k["suite"] == "random" for k in kinds), kinds


def check_other_program(program):
    """A program that crashes or gives no information is a finding, its scene is kept, and can be repeated alone."""
    with tempfile.TemporaryDirectory() as folder:
        broken = pathlib.Path(folder, "broken")
        broken.write_text("#!/bin/sh\nkill -SEGV $$\n")
        broken.chmod(0o755)
        answer = run(program, "--suite", "random", "--count", "3", "--report", folder + "/r",
                     "--program", str(broken), "--json")
        scenes = json.loads(answer.stdout)
        assert answer.returncode == 1 and len(scenes) == 3, answer
        for s in scenes:
            assert s["outcome"] == "wrong" and s["findings"][0]["law"] == "crash", s
            assert os.path.exists(s["folder"] + "/scene.json"), s
        page = pathlib.Path(folder, "r", "random.md").read_text()
        assert "--scene 2" in page and "| `all` | 3 | 0 | 0 | 0 | 3 |" in page, page
        assert pathlib.Path(folder, "r", "random.csv").read_text().startswith("kind,drawn,done,refused,known,wrong")


def print_scene(scene, seed):
    print(f"{scene['outcome'].upper()} scene {scene['scene']} of seed {seed} ({scene['case']}: {scene['drawn']})")
    for f in scene["findings"]:
        print(f"    {f['law']}: {f['text']}")


def check_mixed(program, seed, numbers):
    """Scenes that mix bodies, each of which has to be done."""
    kinds, wrong = set(), 0
    for number in numbers:
        scene = json.loads(run(program, "--suite", "mixed", "--seed", seed, "--scene", number, "--json").stdout)
        kinds.add(scene["case"])
        if scene["outcome"] != "done":
            wrong += 1
            print_scene(scene, seed)
    print(f"{len(numbers)} scenes of {len(kinds)} kinds: {wrong} not done")
    return 1 if wrong else 0


def check_alone(program, scenes):
    """Scenes SEED:NUMBER, each of which has to be done."""
    wrong = 0
    for seed, number in (s.split(":") for s in scenes):
        scene = json.loads(run(program, "--suite", "random", "--seed", seed, "--scene", number, "--json").stdout)
        if scene["outcome"] != "done":
            wrong += 1
            print_scene(scene, seed)
    return wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n", maxsplit=1)[0])
    parser.add_argument("program")
    parser.add_argument("kinds", nargs="*", help="of the scenes (default: all)")
    parser.add_argument("--seed", default="1")
    parser.add_argument("--count", default="40")
    parser.add_argument("--mixed", nargs="+", metavar="K", help="only these scenes of the suite that mixes all bodies")
    parser.add_argument("--alone", nargs="+", default=[], metavar="SEED:K", help="scenes of other seeds that are done")
    options = parser.parse_args()
    if options.mixed:
        return check_mixed(options.program, options.seed, options.mixed)
    check_options(options.program)
    check_other_program(options.program)
    answer = run(options.program, "--suite", "random", "--seed", options.seed, "--count", options.count, "--json",
                 "--jobs", "2", *options.kinds)
    scenes = json.loads(answer.stdout)
    assert len(scenes) >= (40 if options.kinds else int(options.count)), len(scenes)
    assert all(KEYS <= s.keys() for s in scenes), scenes
    assert answer.returncode == (1 if any(s["outcome"] == "wrong" for s in scenes) else 0), answer.returncode
    alone = run(options.program, "--suite", "random", "--seed", options.seed, "--scene",
                str(scenes[0]["scene"]), "--json")
    again = json.loads(alone.stdout)
    assert all(again[k] == scenes[0][k] for k in ("case", "drawn", "outcome")), again
    for s in scenes:
        if s["outcome"] not in ("done", "known"):
            print_scene(s, options.seed)
    count = {o: sum(s["outcome"] == o for s in scenes) for o in ("done", "refused", "known", "wrong")}
    print(f"{len(scenes)} scenes: {count}, {sum(s['cpu_seconds'] for s in scenes):.1f} s of processor time")
    return 1 if check_alone(options.program, options.alone) + count["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())
