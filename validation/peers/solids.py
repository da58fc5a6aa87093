"""The cases of run.py that are solids: their meshes, what holds and loads them, and their errors.

A problem is a dict that every program is given in the same words:
    bodies   NAME: {mesh, youngs_modulus, poisson_ratio, hold: [(set, axis)], load: (set, traction)}
    contact  None, or {slave: (body, set), master: (body, set) or None for the rigid plane z = 0, friction}
    size     edge of the cells that touch [m], for penalties and augmentations
A program answers with {"u": {NAME: [(X, u), ...]}, "p": [(X, pressure), ...], "seconds": processor time}.
SI units. Meshes come from `amontons mesh generate box`, as .inp and .msh.
"""
import math
import os
import subprocess

TET_FACES = ((0, 1, 2, 4, 5, 6), (0, 3, 1, 7, 8, 4), (1, 3, 2, 8, 9, 5), (2, 3, 0, 9, 7, 6))


class Mesh:
    """Quadratic tetrahedra: nodes (lists of 3), elements (10 node numbers from 0), faces by set."""

    def __init__(self, inp):
        self.inp = inp
        self.msh = os.path.splitext(inp)[0] + ".msh"
        self.nodes, self.elements, self.sets = [], [], {}
        reading = name = None
        for line in open(inp):
            line = line.strip()
            if line.startswith("*"):
                words = [w.strip() for w in line.split(",")]
                reading = words[0].upper()
                name = dict(w.split("=") for w in words[1:] if "=" in w).get("NAME")
                if reading == "*SURFACE":
                    self.sets[name] = []
                continue
            words = [w.strip() for w in line.split(",") if w.strip()]
            if reading == "*NODE":
                self.nodes.append([float(w) for w in words[1:]])
            elif reading == "*ELEMENT":
                self.elements.append([int(w) - 1 for w in words[1:]])
            elif reading == "*SURFACE":
                self.sets[name].append((int(words[0]) - 1, int(words[1][1:]) - 1))

    def face(self, at):
        element, side = at
        return [self.elements[element][k] for k in TET_FACES[side]]

    def nodes_of(self, name):
        return sorted({n for at in self.sets[name] for n in self.face(at)})

    def area(self, face):
        a, b, c = (self.nodes[n] for n in face[:3])
        u, v = ([q - p for p, q in zip(a, e)] for e in (b, c))
        return 0.5 * math.hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2],
                                u[0] * v[1] - u[1] * v[0])

    def shares(self, name, corners, middles):
        """Of each node of a set: its share of the faces' areas."""
        shares = {}
        for at in self.sets[name]:
            face = self.face(at)
            area = self.area(face)
            for n, share in zip(face, 3 * [corners] + 3 * [middles]):
                shares[n] = shares.get(n, 0) + share * area
        return shares


def box(program, path, origin, size, cells, grading=(1, 1, 1), move=None):
    """A block of T10. @param move  of a node's place, None: as generated"""
    words = [program, "mesh", "generate", "box", "--element", "T10", "--output", path]
    for name, values in (("origin", origin), ("size", size), ("cells", cells), ("grading", grading)):
        words += ["--" + name, ",".join(f"{v:.17g}" for v in values)]
    subprocess.run(words, check=True, capture_output=True)
    mesh = Mesh(path)
    if move:
        head, tail = open(path).read().split("*NODE\n")
        mesh.nodes = [move(*x) for x in mesh.nodes]
        lines = [f"{i + 1}, " + ", ".join(f"{v:.17g}" for v in x) for i, x in enumerate(mesh.nodes)]
        open(path, "w").write(head + "*NODE\n" + "\n".join(lines) + "\n" + tail[tail.index("*"):])
    subprocess.run([program, "mesh", "convert", path, "--output", mesh.msh, "--msh-version", "2.2"],
                   check=True, capture_output=True)
    return mesh


def key(place, size):
    return tuple(round(x / (1e-6 * size)) for x in place)


def relative_l2(values, exact, weights):
    return math.sqrt(sum(w * (v - e)**2 for v, e, w in zip(values, exact, weights)) /
                     sum(w * e * e for e, w in zip(exact, weights)))


def pressure_error(problem, answer, exact, within=lambda x: True):
    """Relative L2 error of the pressures where the program has them, each with its area: the answer's
    own third number, or the node's share of the faces. @param within  which places count"""
    if answer["p"] and len(answer["p"][0]) == 3:
        points = [p for p in answer["p"] if within(p[0])]
        return relative_l2([p[1] for p in points], [exact(p[0]) for p in points],
                           [p[2] for p in points])
    body, name = problem["contact"]["slave"]
    mesh = problem["bodies"][body]["mesh"]
    size = max(max(map(abs, x)) for x in mesh.nodes)
    given = {key(x, size) for x, p in answer["p"]}
    at = {n: key(mesh.nodes[n], size) for n in mesh.nodes_of(name)}
    middles = {n for n, w in mesh.shares(name, 0, 1).items() if w > 0}
    corners_only = not any(at[n] in given for n in middles)
    shares = mesh.shares(name, *((1 / 3, 0) if corners_only else (1 / 6, 1 / 6)))
    weight = {at[n]: w for n, w in shares.items()}
    points = [(x, p, weight[key(x, size)]) for x, p in answer["p"]
              if key(x, size) in weight and within(x)]
    return relative_l2([p for _, p, _ in points], [exact(x) for x, _, _ in points],
                       [w for _, _, w in points])


# ---- the cases: problem(program, folder, level) and errors(problem, answer)

def patch(program, folder, n):
    low = box(program, f"{folder}/low.inp", (0, 0, -0.5), (1, 1, 0.5), (n, n, n))
    high = box(program, f"{folder}/high.inp", (0, 0, 0), (1, 1, 0.5), (n + n // 2, n + n // 2, n))
    sides = [("x_min", 0), ("y_min", 1)]
    return {"bodies": {"low": dict(mesh=low, youngs_modulus=2.1e11, poisson_ratio=0.3,
                                   hold=sides + [("z_min", 2)]),
                       "high": dict(mesh=high, youngs_modulus=2.1e11, poisson_ratio=0.3, hold=sides,
                                    load=("z_max", (0, 0, -1e8)))},
            "contact": dict(slave=("high", "z_min"), master=("low", "z_max"), friction=0),
            "size": 1 / (n + n // 2)}


def patch_errors(problem, answer):
    strain = 1e8 / 2.1e11
    near = far = 0
    for points in answer["u"].values():
        for x, u in points:
            exact = (0.3 * strain * x[0], 0.3 * strain * x[1], -strain * (x[2] + 0.5))
            near += sum((a - b)**2 for a, b in zip(u, exact))
            far += sum(b * b for b in exact)
    return {"displacement": math.sqrt(near / far),
            "pressure": pressure_error(problem, answer, lambda x: 1e8)}


HERTZ = dict(R=0.01, a=4e-4, E=1e9, nu=0.3)
HERTZ["P"] = 4 / 3 * HERTZ["E"] / (1 - HERTZ["nu"]**2) * HERTZ["a"]**3 / HERTZ["R"]
HERTZ["p0"] = 1.5 * HERTZ["P"] / math.pi / HERTZ["a"]**2


def hertz(program, folder, n):
    """A quarter of a block with a ball's side below, pressed by its top: of half width 12.5 a."""
    R, W = HERTZ["R"], 12.5 * HERTZ["a"]

    def move(x, y, z):
        sphere = R - math.sqrt(R * R - x * x - y * y)
        return [x, y, z + (1 - z / R) * sphere]

    grading = 4 * n
    block = box(program, f"{folder}/ball.inp", (0, 0, 0), (W, W, R), (n, n, n),
                (grading, grading, 2 * grading), move)
    top = HERTZ["P"] / (2 * W)**2
    ratio = grading**(1 / (n - 1))
    return {"bodies": {"ball": dict(mesh=block, youngs_modulus=HERTZ["E"], poisson_ratio=HERTZ["nu"],
                                    hold=[("x_min", 0), ("y_min", 1)],
                                    load=("z_max", (0, 0, -top)))},
            "contact": dict(slave=("ball", "z_min"), master=None, friction=0),
            "size": W * (ratio - 1) / (ratio**n - 1)}


def hertz_errors(problem, answer):
    a, p0 = HERTZ["a"], HERTZ["p0"]

    def near(x):
        return math.hypot(x[0], x[1]) < 2 * a

    return {"pressure": pressure_error(
                problem, answer, lambda x: p0 * math.sqrt(max(0, 1 - (x[0]**2 + x[1]**2) / a**2)), near),
            "largest pressure": abs(max(p[1] for p in answer["p"] if near(p[0])) / p0 - 1)}


def cantilever(program, folder, n):
    mesh = box(program, f"{folder}/beam.inp", (0, -0.005, -0.005), (0.2, 0.01, 0.01), (10 * n, n, n))
    return {"bodies": {"beam": dict(mesh=mesh, youngs_modulus=1e9, poisson_ratio=0,
                                    hold=[("x_min", k) for k in range(3)],
                                    load=("x_max", (0, 0, -100)))},
            "contact": None, "size": 0.01 / n}


def cantilever_errors(problem, answer):
    """Deflection that the load does work on, against Timoshenko's beam (no Poisson's ratio)."""
    mesh, L, force = problem["bodies"]["beam"]["mesh"], 0.2, 0.01
    EI, GA = 1e9 * 0.01**4 / 12, 5e8 * 1e-4
    exact = force * (L**3 / (3 * EI) + 6 * L / (5 * GA))
    share = {key(mesh.nodes[n], L): w for n, w in mesh.shares("x_max", 0, 1 / 3).items()}
    work = sum(share.get(key(x, L), 0) * -100 * u[2] for x, u in answer["u"]["beam"])
    return {"deflection": abs(work / force / exact - 1)}


# u_x [m] on the plane at x [m], mu = 1: two finite-element runs of others on the way to convergence,
# as in validation/families/solids.
DRAGGED = {0: 2.8602e-05, 0.005: 2.2867e-05, 0.0075: 1.9807e-05}


def dragged(program, folder, n):
    mesh = box(program, f"{folder}/block.inp", (0, 0, 0), (0.04, 0.04 / n, 0.04), (n, 1, n))
    return {"bodies": {"block": dict(mesh=mesh, youngs_modulus=1.3e11, poisson_ratio=0.2,
                                     hold=[("x_max", 0), ("y_min", 1), ("y_max", 1)],
                                     load=("z_max", (0, 0, -5e7)), load2=("x_min", (1.5e8, 0, 0)))},
            "contact": dict(slave=("block", "z_min"), master=None, friction=1), "size": 0.04 / n}


def dragged_errors(problem, answer):
    found = {}
    for x, u in answer["u"]["block"]:
        for at in DRAGGED:
            if math.hypot(x[0] - at, x[1], x[2]) < 1e-8:
                found[at] = u[0]
    return {"displacement": relative_l2([found[x] for x in DRAGGED], list(DRAGGED.values()),
                                        [1] * len(DRAGGED))}


#: name: problem, errors, levels, what is plotted, words
CASES = {
    "patch": (patch, patch_errors, (2, 4, 8), "displacement", "contact patch, two meshes"),
    "hertz": (hertz, hertz_errors, (4, 5, 6, 8, 10), "pressure", "Hertz, ball on a plane"),
    "cantilever": (cantilever, cantilever_errors, (1, 2, 4, 6), "deflection", "cantilever, T10"),
    "raous": (dragged, dragged_errors, (8, 16, 32), "displacement", "pressed block, friction 1"),
}


def loads_of(body):
    return [body[name] for name in ("load", "load2") if name in body]
