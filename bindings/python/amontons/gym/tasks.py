"""What an environment simulates: instruments, vessel, friction, and the target of the tip."""

import dataclasses

import numpy as np

from .._arguments import refuse
from .arches import TYPES

CONTROL_STEP = 1 / 7.5  # s; images of stEVE's fluoroscopy


@dataclasses.dataclass(frozen=True)
class Instrument:
    """A wire or catheter. segments: as of a beam in a scene. speeds: (push [m/s], turn [rad/s]) at action 1."""

    name: str
    segments: tuple
    speeds: tuple = (0.050, 3.14)
    friction: float = 0.1


@dataclasses.dataclass(frozen=True)
class Task:
    """instruments: the first enters the others, and its tip is the one that has a target. types: of arches that are
    drawn, or None: the arch of examples/catheter. scales: (width and height, diameter) factors, each (least, largest).
    targets: names of branches, of which those count that the vessel has. view: (width of the image [m], angle about
    the upright axis, angle towards it [rad])."""

    name: str
    instruments: tuple
    types: tuple = None
    scales: tuple = ((1, 1), (1, 1))
    targets: tuple = ()
    between: float = 0.05
    view: tuple = (0.40, 0.0, 0.0)


def solid_segments(length, radius, modulus, tip_radius, tip_modulus, bend, angle, element, tip_element):
    """Of a wire with a bent tip: EI of a full round section of these moduli [Pa]."""
    EI = lambda E, r: E * np.pi / 4 * r**4
    tip = bend * angle
    return ({"length": length - tip, "radius": radius, "EI": EI(modulus, radius), "element": element},
            {"length": tip, "radius": tip_radius, "EI": EI(tip_modulus, tip_radius), "curvature": 1 / bend, "element": tip_element})


def tube_segments(length, outer, inner, modulus, tip_outer, bend, angle, element, tip_element):
    """Of a catheter with a bent tip."""
    EI = lambda r: modulus * np.pi / 4 * (r**4 - inner**4)
    tip = bend * angle
    return ({"length": length - tip, "radius": outer, "inner_radius": inner, "EI": EI(outer), "element": element},
            {"length": tip, "radius": tip_outer, "inner_radius": inner, "EI": EI(tip_outer), "curvature": 1 / bend,
             "element": tip_element})


# The guidewire of examples/catheter on elements of twice the length: its push force there is the same to 0.2 %.
DEMO_WIRE = Instrument("wire", (
    {"length": 0.4200, "radius": 4.445e-4, "EI": 5.2e-4, "element": 5e-3},
    {"length": 0.0148, "radius": 4.445e-4, "EI": [5.2e-4, 2.733333333333333e-4], "element": 2.5e-3},
    {"length": 0.0152, "radius": 4.445e-4, "EI": [2.733333333333333e-4, 2e-5], "curvature": 82.6446281, "element": 2.5e-3}))

DEMO_ARCH = {
    "generate": "vessel", "descending_length": 0.120, "descending_diameter": [0.020, 0.024], "arch_radius": 0.038,
    "arch_diameter": [0.024, 0.028], "ascending_length": 0.060, "ascending_diameter": 0.028, "blend": 0.002,
    "branches": [
        {"name": "brachiocephalic", "at": 0.036, "diameter": [0.012, 0.010], "length": 0.045, "angle": np.pi / 3},
        {"name": "left_carotid", "at": 0.052, "diameter": 0.008, "length": 0.100, "angle": np.pi / 2.25},
        {"name": "left_subclavian", "at": 0.068, "diameter": 0.009, "length": 0.070, "angle": np.pi / 2}]}

# stEVE_bench (github.com/lkarstensen/stEVE_bench, commits 22437c80 and 5b8a5267, folder eve_bench; MIT). The wire of
# basicwirenav.py and archvariety.py: 450 mm, 0.89 and 0.7 mm, 80 and 17 GPa, J of 12.1 mm and 0.4 pi, 35 mm/s and
# 3.14 rad/s, friction 0.1.
BENCH_WIRE = Instrument("wire", solid_segments(0.450, 0.445e-3, 80e9, 0.35e-3, 17e9, 12.1e-3, 0.4 * np.pi, 5e-3, 2.5e-3), (0.035, 3.14), 0.1)
# dualdevicenav.py: 900 mm, 0.36 mm in 0.7 / 0.57 mm (tip 0.6), 1 GPa, friction 0.001. Its tips are those of JShaped by
# default, 12.1 mm and 0.4 pi.
MICRO_WIRE = Instrument("wire", solid_segments(0.900, 0.18e-3, 1e9, 0.18e-3, 1e9, 12.1e-3, 0.4 * np.pi, 5e-3, 2.5e-3), (0.035, 3.14), 0.001)
MICRO_CATHETER = Instrument("catheter", tube_segments(0.900, 0.35e-3, 0.285e-3, 1e9, 0.30e-3, 12.1e-3, 0.4 * np.pi, 5e-3, 2.5e-3), (0.035, 3.14), 0.001)

TASKS = {t.name: t for t in (
    Task("catheter_navigation", (DEMO_WIRE,), targets=("brachiocephalic", "left_carotid", "left_subclavian"), view=(0.32, 0, 0)),
    # Theirs is one patient's aorta, not here: instead one arch of type I at its means, with the branches it has.
    Task("basic_wire_nav", (BENCH_WIRE,), types=("mean",), targets=("brachiocephalic", "left_carotid", "left_subclavian")),
    Task("arch_variety", (BENCH_WIRE,), types=("I",), scales=((0.7, 1.3), (0.85, 0.85)),
         targets=("left_carotid", "right_carotid", "left_subclavian", "right_subclavian", "brachiocephalic", "common_trunk",
                  "left_vertebral"),
         view=(0.44, np.radians(25), 0)),
    # Theirs is one patient's arteries up to the head, not here: the same instruments in the arch of examples/catheter.
    Task("dual_device_nav", (MICRO_WIRE, MICRO_CATHETER), targets=("left_carotid", "brachiocephalic"), between=0.001,
         view=(0.32, np.radians(20), np.radians(5))),
)}


def task_of(task, target, arch_types):
    """A Task by its name, with another target or other arches. @raises InputError"""
    if isinstance(task, str):
        if task not in TASKS:
            refuse("task", repr(task), "a Task, or one of " + ", ".join(TASKS))
        task = TASKS[task]
    if not isinstance(task, Task):
        refuse("task", f"a {type(task).__name__}", "a Task, or the name of one")
    if arch_types is not None:
        types = (arch_types,) if isinstance(arch_types, str) else tuple(arch_types)
        for kind in types:
            if kind not in (*TYPES, "mean"):
                refuse("arch_types", repr(kind), "mean, " + ", ".join(TYPES))
        if not types:
            refuse("arch_types", "none", "one at least")
        task = dataclasses.replace(task, types=types)
    if target != "random":
        if not isinstance(target, str):
            refuse("target", f"a {type(target).__name__}", 'the name of a branch, or "random"')
        task = dataclasses.replace(task, targets=(target,))
    return task
