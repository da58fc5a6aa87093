"""A case of solids.py by CalculiX (ccx): its input, its run, and what it found.

Contact is surface to surface with a linear penalty of K = FACTOR E / (edge of a cell); small
displacements. Results have the six or seven digits of its files.
"""
import os
import re
import resource
import subprocess

from solids import loads_of

FACTORS = (10, 100, 1000)
LONGEST = 60 # processor seconds


def version():
    try:
        done = subprocess.run(["ccx", "-v"], capture_output=True, text=True)
    except FileNotFoundError:
        return ""
    found = re.search(r"[Vv]ersion ([\d.]+)", done.stdout)
    return "CalculiX " + found.group(1) if found else ""


def lines_of(numbers, count=8):
    numbers = list(map(str, numbers))
    return [", ".join(numbers[i:i + count]) for i in range(0, len(numbers), count)]


def deck(problem, factor):
    """@return  the text (its fields hold 20 characters), and of each node: (body, first place)"""
    text, loads, hold, place = ["*HEADING", "side by side"], [], [], {}
    first_node = first_element = 0
    surfaces = []
    for name, b in problem["bodies"].items():
        mesh = b["mesh"]
        text += ["*NODE, NSET=ALL"]
        for i, x in enumerate(mesh.nodes):
            text.append(f"{first_node + i + 1}, " + ", ".join(f"{v:.13g}" for v in x))
            place[first_node + i + 1] = name, x
        text += [f"*ELEMENT, TYPE=C3D10, ELSET=E_{name}"]
        for i, nodes in enumerate(mesh.elements):
            text.append(f"{first_element + i + 1}, " + ", ".join(str(first_node + n + 1) for n in nodes))
        text += [f"*MATERIAL, NAME=M_{name}", "*ELASTIC", f"{b['youngs_modulus']}, {b['poisson_ratio']}",
                 f"*SOLID SECTION, ELSET=E_{name}, MATERIAL=M_{name}"]
        for set_name, axis in b["hold"]:
            hold += [f"{first_node + n + 1}, {axis + 1}" for n in mesh.nodes_of(set_name)]
        forces = {}
        for set_name, traction in loads_of(b):
            for n, share in mesh.shares(set_name, 0, 1 / 3).items():
                for k in range(3):
                    forces[n, k] = forces.get((n, k), 0) + share * traction[k]
        loads += [f"{first_node + n + 1}, {k + 1}, {f:.13g}" for (n, k), f in forces.items() if f]
        for side in ("slave", "master"):
            at = problem["contact"] and problem["contact"][side]
            if at and at[0] == name:
                surfaces += [f"*SURFACE, NAME={side.upper()}, TYPE=ELEMENT"]
                surfaces += [f"{first_element + e + 1}, S{s + 1}" for e, s in mesh.sets[at[1]]]
        first_node += len(mesh.nodes)
        first_element += len(mesh.elements)
    if problem["contact"]:
        body = problem["bodies"][problem["contact"]["slave"][0]]
        stiffness = body["youngs_modulus"]
        if problem["contact"]["master"] is None: # a plane: a brick whose nodes do not move
            low, high = (f(x[k] for x in body["mesh"].nodes for k in range(2)) for f in (min, max))
            wide = high - low
            low, high = low - wide, high + wide
            corners = [(low, low), (high, low), (high, high), (low, high)]
            text += ["*NODE, NSET=FIXED"]
            for i, (x, y) in enumerate(corners + corners):
                text.append(f"{first_node + i + 1}, {x}, {y}, {-wide if i < 4 else 0}")
            text += ["*ELEMENT, TYPE=C3D8, ELSET=E_PLANE", f"{first_element + 1}, " +
                     ", ".join(str(first_node + i + 1) for i in range(8)),
                     "*MATERIAL, NAME=M_PLANE", "*ELASTIC", f"{stiffness}, 0",
                     "*SOLID SECTION, ELSET=E_PLANE, MATERIAL=M_PLANE"]
            surfaces += ["*SURFACE, NAME=MASTER, TYPE=ELEMENT", f"{first_element + 1}, S2"]
            hold += [f"{first_node + i + 1}, {k + 1}" for i in range(8) for k in range(3)]
        K = factor * stiffness / problem["size"]
        text += surfaces + ["*SURFACE INTERACTION, NAME=TOUCH",
                            "*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{K:.13g}"]
        if problem["contact"]["friction"]:
            text += ["*FRICTION", f"{problem['contact']['friction']}, {K / 10:.13g}"]
        text += ["*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", "SLAVE, MASTER"]
    text += ["*BOUNDARY"] + hold + ["*STEP, INC=200", "*STATIC", "1, 1", "*CLOAD"] + loads
    text += ["*NODE PRINT, NSET=ALL", "U"]
    if problem["contact"]:
        text += ["*CONTACT FILE", "CSTR"]
    return "\n".join(text + ["*END STEP"]) + "\n", place


def displacements(path, place):
    u = {}
    for line in open(path):
        words = line.split()
        if len(words) == 4 and words[0].isdigit():
            u[int(words[0])] = [float(w) for w in words[1:]]
    answer = {}
    for n, (name, x) in place.items():
        answer.setdefault(name, []).append((x, u[n]))
    return answer


def pressures(path, place, slave):
    """Of the last block CONTACT: pressure at the nodes of a body."""
    found, reading, names = {}, False, []
    for line in open(path):
        if line.startswith(" -4"):
            reading, names = line[5:13].strip() == "CONTACT", []
            if reading:
                found = {}
        elif line.startswith(" -5") and reading:
            names.append(line[5:13].strip())
        elif line.startswith(" -1") and reading:
            values = [float(line[13 + 12 * i:25 + 12 * i]) for i in range(len(names))]
            found[int(line[3:13])] = values[names.index("CPRESS")]
        elif line.startswith(" -3"):
            reading = False
    return [(place[n][1], p) for n, p in found.items() if n in place and place[n][0] == slave]


def solve(problem, folder, factor):
    text, place = deck(problem, factor)
    open(os.path.join(folder, "case.inp"), "w").write(text)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run(["ccx", "case"], cwd=folder, capture_output=True, text=True, timeout=20 * LONGEST,
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST)))
    except subprocess.TimeoutExpired:
        raise RuntimeError("no answer in time")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    data = os.path.join(folder, "case.dat")
    if done.returncode < 0:
        raise RuntimeError(f"stopped after {LONGEST} s")
    if done.returncode != 0 or not os.path.exists(data) or os.path.getsize(data) == 0:
        output = [w for w in (done.stdout + done.stderr).splitlines() if "ERROR" in w or "error" in w]
        raise RuntimeError((output or ["no result"])[0].strip()[:200])
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    contact = []
    if problem["contact"]:
        contact = pressures(os.path.join(folder, "case.frd"), place, problem["contact"]["slave"][0])
    return {"u": displacements(data, place), "p": contact, "seconds": seconds}
