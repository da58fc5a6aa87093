"""Scene of a coil of wire in a ball, pushed on at one end: python3 coil.py [TURNS PUSH FRICTION] > coil.json

It writes the middle line beside it, coil.csv, into the current folder."""
import json
import math
import sys

ball, wire = 0.015, 0.0008
given = [float(a) for a in sys.argv[1:]]
turns, push, friction = given + [6, 0.006, 0.2][len(given):]
reach, pitch = ball - wire - 1e-6, 2 * wire * 1.001  # turn beside turn, 1 um from the wall


def at(angle):
    rise = pitch / reach * (angle / (2 * math.pi) - turns / 2)
    return [reach * math.cos(rise) * math.cos(angle), reach * math.cos(rise) * math.sin(angle), reach * math.sin(rise)]


points = [at(2 * math.pi * k / 180) for k in range(int(180 * turns) + 1)]
length = sum(math.dist(a, b) for a, b in zip(points, points[1:]))
with open("coil.csv", "w", encoding="utf-8") as file:
    file.write("x,y,z\n" + "".join("%.9g,%.9g,%.9g\n" % tuple(p) for p in points))

end, parts = 0.02, 20
hold = {"set": "start", "turns": "free"}
for k, axis in enumerate("xyz"):
    hold[axis] = [[end * i / parts, at(push / reach * i / parts)[k] - at(0)[k]] for i in range(parts + 1)]
json.dump({
    "schema": 1, "title": "A coil in a ball, pushed on at one end",
    "bodies": {
        "ball": {"kind": "obstacle", "side": "inside", "surface": {"generate": "ball", "radius": ball}},
        "wire": {"kind": "rod", "segments": [{"length": 0.99999 * length, "radius": wire, "EI": 1e-4, "EA": 400,
                                              "element": 0.001}],
                 "shape": {"curve": {"file": "coil.csv", "scale": 1}, "stress_free": False},
                 "hold": [hold], "drag": 5}},
    "contact": [{"between": ["wire", "ball"], "friction": friction},
                {"between": ["wire", "wire"], "friction": friction}],
    "time": {"step": 0.0005, "end": end, "smallest_step": 1e-6},
    "output": {"picture": False, "plots": False}}, sys.stdout, indent=1)
