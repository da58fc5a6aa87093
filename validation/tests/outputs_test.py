#!/usr/bin/env python3
"""docs/outputs.md names everything that runs of all examples write, and check --quantities what they report.

outputs_test.py PROGRAM
"""
import csv
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import reported_skips

PROGRAM = str(pathlib.Path(sys.argv[1]).resolve())
ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/outputs.md"
SCENES = sorted(f for f in ROOT.glob("examples/*/*.json") if '"schema"' in f.read_text())
PLACEHOLDERS = r"NAME|A|B|SET|PROBE|FIELD|N|KEY"
# Keys of amontons are checked; those of other formats are not.
VTK_OWN = {"points", "connectivity", "offsets", "types"}


def tables():
    """The rows of the page by their heading: (regular expression, unit)."""
    out, rows, before = {}, None, ""
    for line in PAGE.read_text().splitlines():
        if line.startswith("## "):
            rows = out.setdefault(line[3:], [])
            before = "(?:.+_)?" if line[3:] == "Quantities of wires" else ""  # of several, the wire's name
        cells = [c.strip() for c in line.split("|")[1:-1]]
        if rows is None or len(cells) != 3 or not cells[0].startswith("`"):
            continue
        for name in re.findall(r"`([^`]+)`", cells[0]):
            parts = re.split(rf"(?<![A-Za-z])({PLACEHOLDERS})(?![A-Za-z])", name)
            pattern = "".join(".+" if i % 2 else re.escape(p) for i, p in enumerate(parts))
            rows.append((re.compile(before + pattern), cells[1]))
    return out


def run(*arguments, timeout=500):
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=timeout)


def short(scene):
    """Two steps of a scene."""
    text = re.sub(r"//[^\n]*", "", scene.read_text())
    step = float(re.search(r'"step":\s*([0-9.eE+-]+)', text).group(1))
    return ["--set", f"time.end={2 * step}", "--set", "output.every=1", "--set", "output.picture=false",
            "--set", "output.plots=false"]


def keys(value, path=""):
    """Dotted paths of a JSON document's members; of lists no further."""
    if not isinstance(value, dict) or path == "scene.resolved":
        return [path]
    return [k for name, v in value.items() for k in keys(v, f"{path}.{name}" if path else name)]


class Outputs(unittest.TestCase):
    def test_the_page_is_up_to_date(self):
        self.assertEqual(PAGE.read_text(), run("schema", "--outputs").stdout,
                         f"write it again: amontons schema --outputs > {PAGE}")

    def test_all_that_examples_write_is_on_the_page(self):
        page = tables()
        quantities = page["Quantities of wires"] + page["Quantities of solids, rigid bodies and rods"]
        fixed = page["Every row of history.csv"]
        fields = [r for t in ("contacts.pvd", "Wires and rods: frames/NAME.STEP.vtp", "Rigid bodies and obstacles",
                              "Solids: frames/NAME.STEP.vtu") for r in page[t]]
        manifest = page["manifest.json, and run --json"]

        def known(rows, name, unit=None):
            return any(p.fullmatch(name) and unit in (None, u) for p, u in rows)

        self.assertGreater(len(SCENES), 15)
        unknown, done = [], 0
        for scene in SCENES:
            with tempfile.TemporaryDirectory() as folder:
                out = pathlib.Path(folder) / "out"
                result = run("run", str(scene), "--json", "--output", str(out), *short(scene))
                if result.returncode == 2 and '"haptic"' in scene.read_text():
                    continue  # what the hand holds may be held by nothing else
                if result.returncode not in (0, 3):
                    unknown.append(f"{scene}: {result.stderr[-300:]}")
                    continue
                done += 1
                here = str(scene.relative_to(ROOT))
                for heading in next(csv.reader([(out / "history.csv").read_text().split("\n", 1)[0]])):
                    name, unit = re.fullmatch(r"(.*?)(?: \[(.*)\])?", heading).groups()
                    if not known(quantities, name, unit or "") and not known(fixed, name, unit or ""):
                        unknown.append(f"{here}: column {heading}")
                for key in keys(json.loads(result.stdout)) + keys(json.loads((out / "manifest.json").read_text())):
                    if not known(manifest, key):
                        unknown.append(f"{here}: key {key}")
                for file in (out / "frames").iterdir():
                    head = file.read_bytes().split(b"<AppendedData")[0].decode()
                    for name, rest in re.findall(r'Name="([^"]+)"([^/]*?)(?:/>|</)', head):
                        unit = re.search(r'UNITS_LABEL"[^>]*>([^<]*)', rest)
                        if name not in VTK_OWN and not known(fields, name, unit.group(1) if unit else None):
                            unknown.append(f"{here}: {file.name}: {name} {rest[-60:]}")
        self.assertEqual(sorted(set(unknown)), [])
        self.assertGreater(done, 15)

    def test_check_lists_unit_and_meaning_of_every_quantity(self):
        for name in ("first_block", "masonry_arch", "coaxial", "plies"):
            scene = next(s for s in SCENES if s.parent.name == name)
            result = run("check", str(scene), "--quantities", "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            rows = json.loads(result.stdout)
            self.assertGreater(len(rows), 3)
            for row in rows:
                self.assertTrue(row["meaning"], f"{name}: {row['name']}")


if __name__ == "__main__":
    reported_skips.main(argv=[sys.argv[0]] + sys.argv[2:])
