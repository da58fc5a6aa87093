#!/usr/bin/env python3
"""Contact of solids on the meshes that other programs were run on.

    fe_meshes.py PROGRAM FOLDER [--cases patch,hertz,...] [--repeat N] [--results docs/results]

FOLDER has meshes/CASE_L<level>_o<order>_BODY.msh, references.json and peers.csv (CalculiX 2.20,
GetFEM 5.4.2; CPU seconds of one thread), as its README describes; without it nothing is done.
Units there are mm, N, MPa, used here as plain numbers. Each case is run with one thread by the
program alone; its time is the processor time of the whole process, reading and writing included.

Errors, as the peers' were measured: values at the contacts that carry force, weighted with their
areas. With --results: fe_meshes.csv, and a plot of error against time (needs gnuplot).
"""
import argparse
import bisect
import csv
import glob
import json
import math
import os
import re
import resource
import struct
import subprocess
import sys
import tempfile

from common import draw

# What a throw-away prototype of the same discretisation reached: CPU seconds, errors.
PROTOTYPE = {
    ("patch", "L0o2"): (0.024, {"u_l2": 5e-13, "p_l2": 3e-12}),
    ("patch", "L1o2"): (0.130, {"u_l2": 3e-13, "p_l2": 7e-12}),
    ("patch", "L2o2"): (0.66, {"u_l2": 2e-13, "p_l2": 9e-12}),
    ("hertz", "L0o2"): (0.040, {"P": 0.015, "p_l2": 0.077, "a": -0.001}),
    ("hertz", "L1o2"): (0.077, {"P": 0.0011, "p_l2": 0.038, "a": -0.006}),
    ("hertz", "L2o2"): (0.235, {"P": 0.00087, "p_l2": 0.022, "a": -0.0007}),
    ("hertz", "L3o2"): (0.795, {"P": 0.00079, "p_l2": 0.018, "a": 0.0003}),
    ("hertz", "L3o1"): (0.130, {"P": 0.0395, "p_l2": 0.064, "a": 0.007}),
    ("cyl", "L1o1"): (0.011, {"p_l2_self": 0.094}),
    ("cyl", "L1o2"): (0.094, {"p_l2_self": 0.027, "a_self": 0.001}),
    ("cyl", "L2o2"): (0.146, {"p_l2_self": 0.010}),
    ("mindlin", "L1o1"): (0.052, {"p_l2_self": 0.113, "q_l2_self": 0.337}),
    ("mindlin", "L2o1"): (0.179, {"p_l2_self": 0.066, "q_l2_self": 0.23}),
    ("mindlin", "L0o2"): (0.198, {"p_l2_self": 0.068, "q_l2_self": 0.205}),
    ("mindlin", "L1o2"): (0.47, {"p_l2_self": 0.034, "q_l2_self": 0.110, "c/a_self": -0.009}),
    ("mindlin", "L2o2"): (1.14, {"p_l2_self": 0.027, "q_l2_self": 0.084}),
    ("raous", "L0o2"): (0.012, {"ux_l2": 0.0040, "p_l2": 0.041, "t_l2": 0.074}),
    ("raous", "L1o2"): (0.042, {"ux_l2": 0.00106, "p_l2": 0.021, "t_l2": 0.033}),
    ("raous", "L2o2"): (0.194, {"ux_l2": 0.00038, "p_l2": 0.010, "t_l2": 0.027}),
    ("raous", "L1o1"): (0.013, {"ux_l2": 0.0046, "p_l2": 0.094}),
    ("raous", "L2o1"): (0.049, {"ux_l2": 0.0016, "p_l2": 0.070}),
}
LEVELS = {"patch": ["L0o2", "L1o1", "L1o2", "L2o2", "L3o1"],
          "hertz": ["L0o2", "L1o2", "L2o2", "L3o2", "L3o1"],
          "cyl": ["L1o1", "L1o2", "L2o2"],
          "mindlin": ["L1o1", "L2o1", "L0o2", "L1o2", "L2o2"],
          "raous": ["L0o2", "L1o2", "L2o2", "L1o1", "L2o1"],
          "elastica": ["L0o2", "L1o2", "L2o2", "L2o1"]}
STEEL, NU = 210e3, 0.3


def scene(case, level, meshes):
    def solid(body, youngs_modulus, poisson_ratio, hold, **more):
        name = f"{case}_{level[:2]}_{level[2:]}_{body}.msh"
        return dict(kind="solid", mesh=os.path.join(meshes, name), youngs_modulus=youngs_modulus,
                    poisson_ratio=poisson_ratio, hold=hold, **more)

    plane = {"kind": "obstacle", "surface": {"generate": "plane"}}
    pair = {"sliding": "small"}
    time = {"step": 1, "end": 1}
    if case == "patch":
        sides = [{"set": "xlo", "x": 0}, {"set": "ylo", "y": 0}]
        bodies = {"lo": solid("lo", STEEL, NU, sides + [{"set": "zlo", "z": 0}]),
                  "up": solid("up", STEEL, NU, sides, loads=[{"set": "zhi", "pressure": 100}])}
        pair.update(between=["up", "lo"], surfaces=["zlo", "zhi"])
    elif case == "hertz":
        down = [[0, 0], [1, -0.025]]
        bodies = {"b": solid("b", STEEL, NU, [{"set": "xlo", "x": 0}, {"set": "ylo", "y": 0},
                                              {"set": "equ", "z": down}]), "plane": plane}
        pair.update(between=["b", "plane"], surfaces=["cont", ""])
    elif case == "cyl":
        flat = [{"set": "all", "y": 0}, {"set": "xlo", "x": 0}]
        # Johnson 1985, sec. 5.6: approach of a roller and a block by depths 2 R and 4 R.
        R, a, soft = 50, 6.21, [(1 - NU**2) / STEEL, (1 - NU**2) / 70e3]
        force = math.pi * a * a / (sum(soft) * 4 * R)
        down = force / math.pi * (soft[0] * (2 * math.log(2 * R / a) - 0.5) +
                                  soft[1] * (2 * math.log(4 * R / a) - 0.5))
        bodies = {"c": solid("c", STEEL, NU, flat + [{"set": "equ", "z": [[0, 0], [1, -down]]}]),
                  "blk": solid("blk", 70e3, NU, flat + [{"set": "zlo", "z": 0}])}
        pair.update(between=["c", "blk"], surfaces=["cont", "zhi"])
    elif case == "mindlin":
        a, R, mu = 0.5, 10, 0.3
        shear = STEEL / 2 / (1 + NU) / (2 * (2 - NU))
        P = 4 / 3 * STEEL / 2 / (1 - NU * NU) * a**3 / (R / 2)
        aside = 3 * mu * P / (16 * a * shear) * (1 - 0.4**(2 / 3)) * 1.03
        down = [[0, 0], [1, -2 * a * a / R]]
        bodies = {"lo": solid("lo", STEEL, NU, [{"set": "ylo", "y": 0}, {"set": "equ"}]),
                  "up": solid("up", STEEL, NU, [{"set": "ylo", "y": 0},
                                                {"set": "equ", "x": [[1, 0], [2, aside]], "y": 0,
                                                 "z": down}])}
        pair.update(between=["lo", "up"], surfaces=["cont", "cont"], friction=mu)
        time["end"] = 2
    elif case == "raous":
        bodies = {"b": solid("b", 130e3, 0.2, [{"set": "xhi", "x": 0}, {"set": "all", "y": 0}],
                             loads=[{"set": "zhi", "pressure": [[0, 0], [1, 50]]},
                                    {"set": "xlo", "pressure": [[0, 0], [1, 150]]}]),
                  "plane": plane}
        pair.update(between=["b", "plane"], surfaces=["zlo", ""], friction=1)
    elif case == "elastica":
        b = 0.5 # its side; E 1e5, nu 0, as CalculiX took it: linear in Green's strain
        load = 1e5 * b**4 / 12 / 100
        prism = solid("b", 0, 0, [{"set": "xlo"}],
                      loads=[{"set": "xhi", "traction": [0, 0, load / b**2]}],
                      material={"law": "st_venant_kirchhoff", "youngs_modulus": 1e5,
                                "poisson_ratio": 0})
        del prism["youngs_modulus"], prism["poisson_ratio"]
        bodies, pair = {"b": prism}, None
    return {"schema": 1, "title": case, "bodies": bodies,
            "contact": [pair] if pair else [], "time": time,
            "output": {"picture": False, "plots": False, "every": 1000}}


def read_vtk(path):
    """Arrays of a file with appended raw data, by name: lists of numbers or of tuples."""
    data = open(path, "rb").read()
    head, body = data.split(b'<AppendedData encoding="raw">', 1)
    body = body[body.index(b"_") + 1:]
    kinds = {"Float64": ("d", 8), "Float32": ("f", 4), "Int32": ("i", 4), "Int64": ("q", 8),
             "UInt8": ("B", 1)}
    arrays = {}
    for tag in re.findall(rb"<DataArray[^>]*>", head):
        field = dict(re.findall(r'(\w+)="([^"]*)"', tag.decode()))
        if field.get("format") != "appended" or field["Name"] in arrays:
            continue
        letter, size = kinds[field["type"]]
        at = int(field["offset"])
        count = struct.unpack_from("<Q", body, at)[0] // size
        values = struct.unpack_from(f"<{count}{letter}", body, at + 8)
        parts = int(field.get("NumberOfComponents", "1"))
        arrays[field["Name"]] = list(values) if parts == 1 else \
            [values[i:i + parts] for i in range(0, count, parts)]
    return arrays


def last_file(pvd):
    names = re.findall(r'timestep="([^"]*)"[^>]*file="([^"]*)"', open(pvd).read())
    end = max(float(t) for t, _ in names)
    return [os.path.join(os.path.dirname(pvd), f) for t, f in names if float(t) == end]


def bodies_of(folder):
    return [f for f in glob.glob(folder + "/*.pvd") if not f.endswith("contacts.pvd")][0]


def interpolate(x, xs, ys):
    i = min(max(bisect.bisect_left(xs, x), 1), len(xs) - 1)
    t = (x - xs[i - 1]) / (xs[i] - xs[i - 1])
    return ys[i - 1] + min(max(t, 0), 1) * (ys[i] - ys[i - 1])


def l2(values, exact, area):
    return math.sqrt(sum(a * (v - e)**2 for v, e, a in zip(values, exact, area)) /
                     sum(a * e * e for e, a in zip(exact, area)))


def root(x):
    return math.sqrt(max(0.0, x))


def at_centre(places, values):
    """What a linear function closest to the values (least squares) has in the middle of the section:
    nodes of a free mesh are not spread evenly, so their mean turns with the section."""
    centred = [(y - 0.25, z - 0.25) for _, y, z in places]
    rows = [(1, y, z) for y, z in centred]
    normal = [[sum(r[i] * r[j] for r in rows) for j in range(3)] +
              [sum(r[i] * v for r, v in zip(rows, values))] for i in range(3)]
    for i in range(3):
        for j in range(3):
            if j != i:
                share = normal[j][i] / normal[i][i]
                normal[j] = [a - share * b for a, b in zip(normal[j], normal[i])]
    return normal[0][3] / normal[0][0]


def measure(case, folder, references):
    if case == "elastica":
        body = read_vtk([f for f in last_file(bodies_of(folder)) if f.endswith(".vtu")][0])
        places = [[a - b for a, b in zip(x, u)]
                  for x, u in zip(body["points"], body["displacement"])]
        end = [(X, u) for X, u in zip(places, body["displacement"]) if X[0] > 10 - 1e-9]
        tip = [at_centre([X for X, _ in end], [u[i] for _, u in end]) for i in range(3)]
        exact = references["elastica_dev"]
        return {"w_tip": math.hypot(tip[1], tip[2]) / exact["w"] - 1,
                "u_tip": tip[0] / exact["u"] - 1}
    contacts = read_vtk(last_file(folder + "/contacts.pvd")[0])
    x, p, area = contacts["points"], contacts["pressure"], contacts["area"]
    force = contacts["force"]
    traction = [math.hypot(f[0], f[1]) / a for f, a in zip(force, area)]
    sum_x, sum_z = abs(sum(f[0] for f in force)), abs(sum(f[2] for f in force))
    if case == "patch":
        near = far = 0
        for path in last_file(bodies_of(folder)):
            if not path.endswith(".vtu"):
                continue
            body = read_vtk(path)
            if "displacement" not in body:
                continue
            for place, u in zip(body["points"], body["displacement"]):
                X = [a - b for a, b in zip(place, u)]
                exact = (NU * 100 / STEEL * X[0], NU * 100 / STEEL * X[1], -100 / STEEL * X[2])
                near += sum((a - b)**2 for a, b in zip(u, exact))
                far += sum(b * b for b in exact)
        return {"u_l2": math.sqrt(near / far), "p_l2": l2(p, [100] * len(p), area),
                "p_max": max(abs(v / 100 - 1) for v in p)}
    if case == "hertz":
        P, a = references["hertz_dev"]["P"], references["hertz_dev"]["a"]
        p0 = 1.5 * P / math.pi / a**2
        r = [math.hypot(c[0], c[1]) for c in x]
        inside = [i for i in range(len(x)) if r[i] < 2 * a]
        moment = sum(area[i] * p[i] * r[i]**2 for i in inside)
        total = sum(area[i] * p[i] for i in inside)
        return {"P": 4 * sum_z / P - 1,
                "p_l2": l2([p[i] for i in inside], [p0 * root(1 - (r[i] / a)**2) for i in inside],
                           [area[i] for i in inside]),
                "p0": max(p) / p0 - 1, "a": math.sqrt(2.5 * moment / total) / a - 1}
    if case == "cyl":
        # The slice is as thick as the contact's area is long: from the mesh's own extent.
        ys = [c[1] for path in last_file(bodies_of(folder)) if path.endswith(".vtu")
              for c in read_vtk(path)["points"]]
        P = 2 * sum_z / (max(ys) - min(ys))
        stiff = 1 / ((1 - NU**2) * (1 / STEEL + 1 / 70e3))
        a = math.sqrt(4 * P * 50 / math.pi / stiff)
        p0 = 2 * P / math.pi / a
        exact = [p0 * root(1 - (c[0] / a)**2) for c in x]
        moment = sum(s * v * c[0]**2 for s, v, c in zip(area, p, x))
        return {"p_l2_self": l2(p, exact, area), "p0_self": max(p) / p0 - 1,
                "a_self": math.sqrt(4 * moment / sum(s * v for s, v in zip(area, p))) / a - 1}
    if case == "mindlin":
        mu, P, Q = 0.3, 2 * sum_z, 2 * sum_x
        a = (3 * P * 5 / 4 / (STEEL / 2 / (1 - NU**2)))**(1 / 3)
        p0, share = 1.5 * P / math.pi / a**2, Q / mu / P
        c = a * max(0, 1 - share)**(1 / 3)
        r = [math.hypot(k[0], k[1]) for k in x]
        exact = [p0 * root(1 - (v / a)**2) for v in r]
        shear = [mu * p0 * (root(1 - (v / a)**2) - c / a * root(1 - (v / c)**2)) for v in r]
        along = [abs(f[0]) / s for f, s in zip(force, area)]
        stick = sum(s for s, q, v in zip(area, along, p) if q < 0.97 * mu * v and v > 0.05 * p0)
        return {"p_l2_self": l2(p, exact, area), "q_l2_self": l2(along, shear, area),
                "c/a_self": math.sqrt(2 * stick / math.pi) / a - c / a}
    curves = references["raous_dev"]
    body = read_vtk([f for f in last_file(bodies_of(folder)) if f.endswith(".vtu")][0])
    near = far = 0
    for place, u in zip(body["points"], body["displacement"]):
        X = [a - b for a, b in zip(place, u)]
        if abs(X[2]) > 1e-9:
            continue
        exact = interpolate(X[0], curves["x"], curves["ux"])
        near += (u[0] - exact)**2
        far += exact**2
    return {"ux_l2": math.sqrt(near / far),
            "p_l2": l2(p, [interpolate(c[0], curves["x"], curves["p"]) for c in x], area),
            "t_l2": l2(traction, [abs(interpolate(c[0], curves["x"], curves["t"])) for c in x],
                       area)}


def run(program, case, level, folder, references, repeat):
    best, errors, status = math.inf, {}, ""
    for _ in range(repeat):
        with tempfile.TemporaryDirectory() as out:
            path = os.path.join(out, "scene.json")
            json.dump(scene(case, level, os.path.join(folder, "meshes")), open(path, "w"))
            before = resource.getrusage(resource.RUSAGE_CHILDREN)
            done = subprocess.run([program, "run", path, "--quiet", "--json", "--threads", "1",
                                   "--output", out + "/result"], capture_output=True, text=True)
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            if done.returncode != 0:
                return math.nan, {}, done.stderr.strip().splitlines()[-1][:200]
            best = min(best, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
            certificate = json.loads(done.stdout)["certificate"]
            status = "ok" if certificate["uncertified_steps"] == 0 else "not certified"
            errors = measure(case, out + "/result", references)
    return best, errors, status


def peers_of(folder):
    """Of each case, level, error and peer: (error, seconds) of its most accurate setting."""
    best = {}
    for row in csv.DictReader(open(os.path.join(folder, "peers.csv"))):
        if row["status"] != "ok" or not row["error"] or row["error_name"].startswith("_"):
            continue
        peer = "CalculiX" if row["peer"].startswith("ccx") else "GetFEM"
        key = row["case"], row["level"], row["error_name"], peer
        error = abs(float(row["error"]))
        if key not in best or error < best[key][0]:
            best[key] = error, float(row["cpu_s"]) if row["cpu_s"] else math.nan
    return best


def plot(folder, rows):
    """One panel a case: its main error against CPU seconds."""
    main = {"hertz": "p_l2", "cyl": "p_l2_self", "mindlin": "q_l2_self", "raous": "p_l2"}
    text = ["set terminal svg size 900,700", f"set output '{folder}/fe_meshes.svg'",
            "set multiplot layout 2,2", "set logscale xy", "set grid",
            "set xlabel 'processor time [s]'", "set key bottom left"]
    for case, name in main.items():
        curves = {}
        for r in rows:
            if r["case"] == case and r["error"] == name and r["level"].endswith("o2"):
                for who in ("amontons", "CalculiX", "GetFEM"):
                    if r[who + "_s"] == r[who + "_s"] and r[who] == r[who] and r[who] < 1:
                        curves.setdefault(who, []).append((r[who + "_s"], abs(r[who])))
        for who, points in curves.items():
            text.append(f"${case}_{who} << END")
            text += [f"{t:.6g} {e:.6g}" for t, e in sorted(points)] + ["END"]
        text.append(f"set title '{case}'; set ylabel '{name.replace('_', ' ')}'")
        text.append("plot " + ", ".join(f"${case}_{who} with linespoints title '{who}'"
                                        for who in curves))
    draw(text + ["unset multiplot"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("folder")
    parser.add_argument("--cases", default=",".join(LEVELS))
    parser.add_argument("--repeat", type=int, default=3)
    parser.add_argument("--results", default="")
    arguments = parser.parse_args()
    if not os.path.isdir(os.path.join(arguments.folder, "meshes")):
        print(f"no meshes in {arguments.folder}: nothing done")
        return 0
    references = json.load(open(os.path.join(arguments.folder, "references.json")))
    peers = peers_of(arguments.folder)
    rows = []
    nan = math.nan
    print(f"{'case':<8}{'level':<6}{'error':<10}{'amontons':>18}{'prototype':>18}"
          f"{'CalculiX':>18}{'GetFEM':>18}   (error, CPU s)")
    for case in arguments.cases.split(","):
        for level in LEVELS[case]:
            seconds, errors, status = run(arguments.program, case, level, arguments.folder,
                                          references, arguments.repeat)
            if not errors:
                print(f"{case:<8}{level:<6}{status}")
            for name, error in errors.items():
                before = PROTOTYPE.get((case, level), (nan, {}))
                row = {"case": case, "level": level, "error": name, "amontons": error,
                       "amontons_s": seconds, "status": status,
                       "prototype": before[1].get(name, nan), "prototype_s": before[0]}
                for peer in ("CalculiX", "GetFEM"):
                    row[peer], row[peer + "_s"] = peers.get((case, level, name, peer), (nan, nan))
                rows.append(row)
                print(f"{case:<8}{level:<6}{name:<10}" +
                      "".join(f"{row[w]:>11.2e}{row[w + '_s']:>7.3f}" for w in
                              ("amontons", "prototype", "CalculiX", "GetFEM")) +
                      ("" if status == "ok" else "  " + status), flush=True)
    if arguments.results and rows:
        with open(os.path.join(arguments.results, "fe_meshes.csv"), "w") as out:
            names = ["case", "level", "error", "status"] + [w + s for w in (
                "amontons", "prototype", "CalculiX", "GetFEM") for s in ("", "_s")]
            out.write(",".join(names) + "\n")
            for row in rows:
                out.write(",".join(f"{row[n]:.4g}" if isinstance(row[n], float) else row[n]
                                   for n in names) + "\n")
        plot(arguments.results, rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
