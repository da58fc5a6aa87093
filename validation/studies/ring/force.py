#!/usr/bin/env python3
"""force.py PROGRAM EXAMPLE WORK TABLE: examples/ring with three sizes of elements (2, 4 and 8 cells along an eighth
of the girth; the finest takes ten minutes). Writes TABLE (cells, time, force, contacts) and prints of each the largest
force, the most contacts, the worst certificate and penetration. Runs whose folder is in WORK are not run again."""
import csv
import os
import shutil
import subprocess
import sys

CELLS = [2, 4, 8]


def run(program, example, work, cells):
    folder = os.path.join(work, f"ring_{cells}")
    if not os.path.exists(folder + "/out/history.csv"):
        shutil.copytree(example, folder, dirs_exist_ok=True)
        subprocess.run([sys.executable, "body.py", str(cells)], cwd=folder, check=True)
        subprocess.run([program, "run", folder + "/scene.json", "--set", "output.picture=false", "--set",
                        "output.every=10", "--output", folder + "/out", "--quiet"], check=True)
    return list(csv.DictReader(open(folder + "/out/history.csv")))


def main(program, example, work, table):
    with open(table, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["cells", "time [s]", "force [N]", "contacts"])
        for cells in CELLS:
            rows = run(os.path.abspath(program), example, work, cells)
            force = [float(r["body_tail_force_z [N]"]) for r in rows]
            out.writerows([cells, f"{float(r['time [s]']):.6g}", f"{f:.6g}", r["contacts"]] for r, f in zip(rows, force))
            worst = [max(float(r[name]) for r in rows) for name in ("certificate_error", "worst_penetration [m]")]
            print(f"{cells} cells: to {float(rows[-1]['time [s]']):.2f} s, force {max(force):.3f} N at most, "
                  f"{max(int(r['contacts']) for r in rows)} contacts, certificate {worst[0]:.1e}, "
                  f"penetration {worst[1]:.1e} m")


if __name__ == "__main__":
    main(*sys.argv[1:])
