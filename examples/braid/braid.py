"""Scene of a braid of 2 x 12 wires: python3 braid.py [TURNS ELEMENTS DRAG FRICTION] > braid.json"""
import json
import math
import sys

wires, radius, wire, modulus, angle = 12, 5e-3, 1e-4, 60e9, math.radians(40)
given = [float(a) for a in sys.argv[1:]]
turns, elements, drag, friction = given + [0.5, 16, 100, 0.1][len(given):]
EI, EA = modulus * math.pi * wire**4 / 4, modulus * math.pi * wire**2
height = 2 * math.pi * radius * turns * math.tan(angle)


def ring(a, r, z):
    return [r * math.cos(a), r * math.sin(a), z]


bodies = {"tube": {"kind": "obstacle", "side": "inside", "surface": {
    "generate": "cylinder", "radius": radius + 2.5 * wire, "centre": [0, 0, height / 2], "axis": [0, 0, 1]}}}
for name, hand in (("a", 1), ("b", -1)):  # right-handed helices within left-handed ones
    r = radius - hand * wire
    round_, slope = 2 * math.pi * r * turns, math.atan2(height, 2 * math.pi * r * turns)
    length = math.hypot(height, round_)
    for i in range(wires):
        a = 2 * math.pi * i / wires
        direction = [-hand * math.cos(slope) * math.sin(a), hand * math.cos(slope) * math.cos(a), math.sin(slope)]
        bodies[f"{name}{i}"] = {
            "kind": "rod", "drag": drag, "contact_spacing": length / elements / 2,
            "segments": [{"length": length, "radius": wire, "EI": EI, "GJ": EI / 1.3, "EA": EA,
                          "element": length / elements, "curvature": math.cos(slope)**2 / r,
                          "twist": hand * math.sin(slope) * math.cos(slope) / r}],
            "shape": {"start": ring(a, r, 0), "direction": direction, "normal": ring(a, -1, 0)},
            "hold": [{"set": "start", "turns": "free", "z": 0}],
            "loads": [{"set": "end", "force": [0, 0, -0.02], "over": [[0, 0], [2, 0], [2.5, 1]]}]}

couplings, contact = [], []
for i in range(wires):
    a, end = 2 * math.pi * i / wires, 2 * math.pi * (i / wires + turns)
    other = round(i + 2 * turns * wires) % wires  # of the other hand, at the end
    couplings.append({"kind": "ball", "between": [f"a{i}", f"b{i}"], "at": ring(a, radius, 0)})
    couplings.append({"kind": "ball", "between": [f"a{i}", f"b{other}"], "at": ring(end, radius, height)})
    contact += [{"between": [f"a{i}", f"b{k}"], "friction": friction} for k in range(wires) if k not in (i, other)]

# Walls: from outside the braid to half its radius, and back behind the tube.
thick, half = 1e-3, radius / 2 + wire
for k in range(wires):
    a = 2 * math.pi * k / wires
    first, most, last = radius + 2.1 * wire + thick / 2, half + thick / 2, radius + 2e-3 + thick / 2

    def way(share):
        return [[0, 0], [1, (most - first) * share], [2, (last - first) * share]]

    bodies[f"p{k}"] = {"kind": "rigid", "shape": {
        "generate": "box", "size": [thick, 2 * half * math.tan(math.pi / wires), 4 * height]},
        "start": {"place": ring(a, first, height / 2), "turn": [0, 0, a]},
        "drive": {"x": way(math.cos(a)), "y": way(math.sin(a)), "z": 0}}
for name in [f"{layer}{i}" for layer in "ab" for i in range(wires)]:
    contact += [{"between": [name, wall], "friction": friction}
                for wall in ["tube"] + [f"p{k}" for k in range(wires)]]

json.dump({"schema": 1, "title": "A braid of 2 x 12 wires, crimped and released", "bodies": bodies,
           "couplings": couplings, "contact": contact, "time": {"step": 0.025, "end": 2.5},
           "output": {"picture": False, "plots": False}}, sys.stdout, indent=1)
