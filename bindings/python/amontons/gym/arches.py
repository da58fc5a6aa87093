"""Aortic arches of types I to VII, drawn from published means and deviations.

Types are those of Natsis et al. 2009 (Surg Radiol Anat 31:319, 633 angiographies): I, brachiocephalic trunk, left carotid, left
subclavian; II, the left carotid from the trunk ("bovine"); III, a left vertebral artery between carotid and subclavian; IV, the
carotids in common after the right subclavian; V, the right subclavian last; VI, carotids and subclavians in common; VII, four
vessels without a trunk. Numbers are those of the generator of stEVE (github.com/lkarstensen/stEVE, commit 8c6c6eb2, folder
eve/intervention/vesseltree; MIT), but for type III, which it does not have: that is its type I with the vertebral artery of
Woraputtaporn et al. 2019 (Anat Sci Int 94:275, 14 that leave the arch: outer diameter 4.36 +- 0.93 mm, length before the
spine 82.4 +- 10.9 mm). How far it is from its neighbours no source states: it leaves half-way between them.

The shapes are those of the generator "vessel" of a scene, not stEVE's Hermite splines: the arch lies in a
plane, half a circle between straight parts, and branches are straight and part from one another in that plane; ways to branches, which stEVE counts from
the end of the aorta, are counted from the end of the half circle. Carotids and subclavians that leave a trunk there
are not modelled: the trunk ends open where they would begin.
"""

import dataclasses
import itertools
import math

import numpy as np

from .._arguments import refuse

TYPES = ("I", "II", "III", "IV", "V", "VI", "VII")

#: Points of the aorta's centreline [mm], mean and deviation, from the inlet on: z is up, the arch ends at the last.
AORTA_POINTS = (((30, 0, 90), (2, 1, 3)), ((20, -40, 160), (1.5, 3, 2)), ((-5, -60, 100), (1, 2, 1)))
#: Diameters of the aorta [mm]: at its inlet, and by how much it widens to each of the next points.
AORTA_DIAMETERS = ((17, 1), (3, 0.7), (4, 0.7), (5, 0.7))
#: Of the branches [mm]: diameter at the root, what it loses to its end, height above the arch's middle that it reaches (None:
#: up to z = 230), deviation of its direction [-].
BRANCHES = {
    "brachiocephalic": ((17, 1), (7, 0.7), (45, 3), 0.1),
    "common_trunk": ((22, 1), (10, 0.7), (25, 3), 0.2),
    "right_carotid": ((10, 0.33), (1, 0.33), None, 0.2),
    "left_carotid": ((10, 0.33), (0.5, 0.2), None, 0.2),
    "right_subclavian": ((10, 0.33), (0, 0), (50, 1), 0.1),
    "left_subclavian": ((10, 0.33), (1, 0.33), (50, 2), 0.1),
    "left_vertebral": ((4.36, 0.93), (0, 0), None, 0.1),
}
#: Lengths of branches of which these are known, instead of heights [mm].
LENGTHS = {"left_vertebral": (82.4, 10.9)}
#: Way along the aorta from its end to the first branch, and from each to the next [mm].
ORDER = {
    "I": (("brachiocephalic", (36, 5)), ("left_carotid", (16, 4)), ("left_subclavian", (28, 3))),
    "II": (("brachiocephalic", (36, 3)), ("left_subclavian", (41, 2.5))),
    "III": (("brachiocephalic", (36, 5)), ("left_carotid", (16, 4)), ("left_vertebral", (14, 2.1)), ("left_subclavian", (14, 2.1))),
    "IV": (("right_subclavian", (42, 5)), ("common_trunk", (20, 4)), ("left_subclavian", (38, 3))),
    "Va": (("brachiocephalic", (36, 3)), ("left_subclavian", (41, 2.5)), ("right_subclavian", (20, 1))),
    "Vb": (("right_carotid", (50, 2.5)), ("left_carotid", (22, 3)), ("left_subclavian", (26, 2.5)), ("right_subclavian", (20, 1))),
    "VI": (("brachiocephalic", (36, 3)), ("common_trunk", (50, 1.5))),
    "VII": (("right_subclavian", (38, 3.5)), ("right_carotid", (20, 3)), ("left_carotid", (20, 3)), ("left_subclavian", (27, 3))),
}
TOP = 230  # mm, where carotids end
WIDEST_ROOT = 0.9  # of the arch: the common trunk is wider in some draws
LEAST_DIAMETERS = {"left_vertebral": 2.5}  # mm, at the end; of others 4
STEEPEST_TAPER = 0.45  # of radius over length: what the generator takes
ANGLES = (0.5, 2.6)  # rad, of a take-off from the arch: flatter ones make no edge
MOST_DRAWS = 1000  # of an arch, before a type is given up


def draw_arch(kind, rng, *, width=1.0, height=1.0, diameter=1.0, blend=0.002):
    """The field `surface` of an obstacle: an arch of type `kind`, one of TYPES, drawn by a numpy Generator.

    width, height, diameter: factors of all, as stEVE's AorticArchRandom scales. blend [m]: radius of the edges where
    vessels join. Numbers that make no vessel (a root as wide as the arch, branches in one another) are drawn again,
    so that tails of the deviations are missing.
    """
    if kind not in TYPES:
        refuse("kind", repr(kind), "one of " + ", ".join(TYPES))
    for name, value in (("width", width), ("height", height), ("diameter", diameter)):
        if not (np.isfinite(value) and value > 0):
            refuse(name, f"{value}", "> 0")
    if kind == "V":
        kind = "Va" if rng.random() < 0.5 else "Vb"
    for _ in range(MOST_DRAWS):
        surface = _draw(ORDER[kind], rng.standard_normal, width, height, diameter, blend)
        if surface is not None:
            return surface
    refuse("width, height, diameter", f"{width:g}, {height:g}, {diameter:g}", "factors that leave room for the branches")


def mean_arch(kind="I", **scales):
    """The arch of a type (Va, Vb are apart) with all numbers at their means: as draw_arch."""
    if kind not in ORDER:
        refuse("kind", repr(kind), "one of " + ", ".join(ORDER))
    surface = _draw(ORDER[kind], np.zeros, *(scales.get(k, 1.0) for k in ("width", "height", "diameter")), scales.get("blend", 0.002))
    if surface is None:
        refuse("width, height, diameter", f"{scales}", "factors that leave room for the branches")
    return surface


def _draw(order, chances, width, height, diameter, blend):
    """An arch in millimetres' words of the tables, or None where the numbers make none.

    chances(n): n standard normal numbers. Most draws of some tasks fail, so nothing here is an array.
    """
    def number(mean_and_deviation):
        return mean_and_deviation[0] + mean_and_deviation[1] * next(chance)

    chance = iter(chances(9).tolist())
    low, top, end = ([m + d * next(chance) for m, d in zip(*point)] for point in AORTA_POINTS)
    low, top, end = ((x * width, y * width, z * height) for x, y, z in (low, top, end))
    # The circle through the three in their plane; of it the upper half, what is below straightened.
    half, rise = math.hypot(end[0] - low[0], end[1] - low[1]) / 2, top[2] - (low[2] + end[2]) / 2
    radius = (half**2 + rise**2) / (2 * rise) if rise > 0 else 0.0
    if not rise > radius > 0:
        return None
    chance = iter(chances(4 + sum(_numbers_of(name) for name, _ in order)).tolist())
    widths = [w * diameter for w in itertools.accumulate(number(d) for d in AORTA_DIAMETERS)]
    descending, ascending = top[2] - radius, top[2] - radius - end[2]
    branches, at = [], 0.0
    for name, gap in order:
        at += number(gap) * width
        root, loss, up, tilt = BRANCHES[name]
        d0 = min(number(root) * diameter, WIDEST_ROOT * widths[1])
        d1 = d0 - number(loss) * diameter
        # Upwards, as its direction's mean is, would be at / radius; in one plane they must also part.
        angle = min(max(0.5 * (at / radius + math.pi / 2) + number((0, tilt)), ANGLES[0]), ANGLES[1])
        reached = descending + radius * math.sin(min(at / radius, math.pi))
        if name in LENGTHS:
            length = number(LENGTHS[name]) * height
        else:
            length = (TOP * height - reached if up is None else number(up) * height) - 0.5 * widths[2]
        branches.append({"name": name, "at": at, "diameter": [d0, d1], "length": length, "angle": angle})
    surface = {"generate": "vessel", "descending_length": descending, "descending_diameter": widths[:2],
               "arch_radius": radius, "arch_diameter": [widths[1], 0.5 * (widths[2] + widths[3])],
               "ascending_length": ascending, "ascending_diameter": widths[3], "blend": 1e3 * blend, "branches": branches}
    if not _possible(surface):
        return None
    surface = _in_metres(surface)
    return surface if _clear(surface) else None


def _numbers_of(name):
    """How many numbers of a branch are drawn."""
    return 4 + (name in LENGTHS or BRANCHES[name][2] is not None)


def _possible(s):
    """Whether it is a vessel, before any is made: what the generator would refuse, and roots that overlap."""
    arch = np.pi * s["arch_radius"]
    if not (s["descending_length"] > 0 and s["ascending_length"] > 0 and 2 * s["arch_radius"] > 1.05 * max(s["arch_diameter"])):
        return False
    if s["ascending_diameter"] - s["arch_diameter"][1] > 2 * STEEPEST_TAPER * s["ascending_length"]:
        return False
    before = None
    for b in s["branches"]:
        if not (0.1 * arch < b["at"] < 0.95 * arch):
            return False
        if not (b["length"] > 10 and LEAST_DIAMETERS.get(b["name"], 4) < b["diameter"][1] and b["diameter"][0] < 0.95 * min(s["arch_diameter"])):
            return False
        if b["diameter"][0] - b["diameter"][1] > 2 * STEEPEST_TAPER * b["length"]:
            return False
        # On the outer wall, where branches are farther apart than on the centreline.
        if before is not None:
            out = 1 + 0.5 * min(s["arch_diameter"]) / s["arch_radius"]
            if (b["at"] - before["at"]) * out < 0.5 * (b["diameter"][0] + before["diameter"][0]) + 3 * s["blend"]:
                return False
            if b["angle"] < before["angle"] - 0.1:  # they would cross
                return False
        before = b
    return True


def _clear(surface):
    """Whether each branch keeps clear of the others outside the aorta, and opens outside all other vessels."""
    lines = centrelines(surface)
    for i in range(1, len(lines.names)):
        mine = lines.line == i
        ours, others = np.flatnonzero(mine)[::3], np.flatnonzero(lines.line > i)[::3]
        if len(others):
            off = np.linalg.norm(lines.points[ours, None] - lines.points[others], axis=2) - lines.radius[ours, None] - lines.radius[others]
            aorta = np.flatnonzero(lines.line == 0)[::3]
            inside = np.linalg.norm(lines.points[ours, None] - lines.points[aorta], axis=2).min(axis=1) < 0.5 * min(surface["arch_diameter"]) - 1e-3
            if off[~inside].min() < 1.2 * surface["blend"]:
                return False
        end, r = lines.points[mine][-1], lines.radius[mine][-1]
        out = end - lines.points[mine][-2]
        others = lines.line != i
        for ahead in (0, 0.6, 1.2):
            x = end + ahead * r * out / np.linalg.norm(out)
            if (np.linalg.norm(lines.points[others] - x, axis=1) - lines.radius[others]).min() < 1.2 * r + 2 * surface["blend"]:
                return False
    return True


def _in_metres(value):
    out = {}
    for key, v in value.items():
        if key == "branches":
            out[key] = [_in_metres(b) for b in v]
        elif isinstance(v, str) or key == "angle":
            out[key] = v if isinstance(v, str) else float(v)
        else:
            out[key] = (1e-3 * np.asarray(v)).tolist()
    return out


@dataclasses.dataclass(frozen=True)
class Lines:
    """Centrelines of a vessel, from its inlet on, and how far it is along them.

    points: (n, 3) [m] of all, one after the other. radius: (n,) of the lumen [m]. line: (n,) number of the line of
    each. along: (n,) way from the line's start [m]. names: of the lines; the aorta is the first. leaves: (lines,) way
    along the aorta to where each leaves it [m].
    """

    points: np.ndarray
    radius: np.ndarray
    line: np.ndarray
    along: np.ndarray
    names: tuple
    leaves: np.ndarray

    def place(self, x):
        """(line, way along it) of the lumen that the point x (3,) is in, or nearest to."""
        off = self.points - x
        k = int(np.argmin(np.einsum("ij,ij->i", off, off) / self.radius**2))
        j = k + 1 if k + 1 < len(self.line) and self.line[k + 1] == self.line[k] else k - 1
        step, way = self.points[j] - self.points[k], self.along[j] - self.along[k]
        t = np.clip(-off[k] @ step / (way * way), -0.5, 0.5)
        return int(self.line[k]), float(max(0.0, self.along[k] + t * way))

    def way(self, a, b):
        """Length of the way along the centrelines between two places [m]."""
        if a[0] == b[0]:
            return abs(a[1] - b[1])
        to_aorta = sum(place[1] for place in (a, b) if place[0] > 0)
        on_aorta = [place[1] if place[0] == 0 else self.leaves[place[0]] for place in (a, b)]
        return to_aorta + abs(on_aorta[0] - on_aorta[1])

    def at(self, line, along):
        """(3,) point of a line at a way along it."""
        mask = self.line == line
        return np.array([np.interp(along, self.along[mask], self.points[mask, k]) for k in range(3)])

    def length(self, line):
        """Of a line [m]."""
        return float(self.along[self.line == line].max())


SPACING = 1e-3  # m, between points of Lines


def centrelines(surface):
    """Lines of a surface {"generate": "vessel", ...} that stands at the origin, axis up, arch towards x."""
    radius, angle = surface["arch_radius"], surface.get("arch_angle", np.pi)
    pair = lambda d: list(d) if isinstance(d, (list, tuple)) else [d, d]
    down, arch = surface["descending_length"], radius * angle
    ends = np.cumsum([0, down, arch, surface["ascending_length"]])
    widths = [pair(surface["descending_diameter"])[0], *pair(surface["arch_diameter"]), surface["ascending_diameter"]]

    def aorta(s):
        s = np.atleast_1d(s)
        phi = np.clip((s - down) / radius, 0, angle)
        beyond = np.maximum(s - ends[2], 0)
        return np.stack([radius * (1 - np.cos(phi)) + beyond * np.sin(angle), 0 * s,
                         np.minimum(s, down) + radius * np.sin(phi) + beyond * np.cos(angle)], axis=1)

    s = np.linspace(0, ends[3], 2 + int(ends[3] / SPACING))
    parts = [(aorta(s), 0.5 * np.interp(s, ends, widths), s)]
    names, leaves = ["aorta"], [0.0]
    for b in surface.get("branches", ()):
        leave = ends[2] - b["at"]
        phi = (leave - down) / radius
        tangent, outward = np.array([np.sin(phi), 0, np.cos(phi)]), np.array([-np.cos(phi), 0, np.sin(phi)])
        take_off = b.get("angle", np.pi / 2)
        direction = -np.cos(take_off) * tangent + np.sin(take_off) * outward
        start = aorta(leave)[0]
        # The way inside the aorta: the first place that no section of it holds.
        ahead = np.arange(0.25 * min(widths), 2 * max(widths), 0.25 * SPACING)
        x = (start + ahead[:, None] * direction)[:, ::2]  # in the plane of the arch
        beside = np.abs(parts[0][2] - leave) < 1.5 * max(widths)
        line, r = parts[0][0][beside][::4, ::2], parts[0][1][beside][::4]
        off = np.einsum("ij,ij->i", x, x)[:, None] - 2 * x @ line.T + np.einsum("ij,ij->i", line, line) - r * r
        hidden = ahead[int(np.argmax(off.min(axis=1) >= 0))]
        s = np.linspace(0, hidden + b["length"], 2 + int((hidden + b["length"]) / SPACING))
        r0, r1 = 0.5 * np.array(pair(b["diameter"]))
        parts.append((start + s[:, None] * direction, np.interp(s, [hidden, s[-1]], [r0, r1]), s))
        names.append(b["name"])
        leaves.append(leave)
    line = np.concatenate([np.full(len(p[2]), k) for k, p in enumerate(parts)])
    points, radii, along = (np.concatenate([p[k] for p in parts]) for k in range(3))
    return Lines(points, radii, line, along, tuple(names), np.array(leaves))
