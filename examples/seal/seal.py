#!/usr/bin/env python3
"""seal.py [THROUGH]: writes seal.nodes and seal.elements here, a hollow seal of rubber in the x-z
plane, 12 mm outside, 8 mm inside, 4 mm deep, of bricks, THROUGH of them through its wall (3). Face
sets: glued (60 degrees of the outside, at the bottom), inner, outer (the rest), sides."""
import math
import sys

through = int(sys.argv[1]) if len(sys.argv) > 1 else 3
around = 24 * through  # a multiple of 12: the glued faces end at whole elements
inner, thick, depth = 4e-3, 2e-3, 4e-3


def number(i, j, k):
    return (k * around + j % around) * (through + 1) + i


sets = {"glued": [], "inner": [], "outer": [], "sides": []}
with open("seal.nodes", "w") as nodes:
    for y in (depth / 2, -depth / 2):
        for j in range(around):
            for i in range(through + 1):
                r, a = inner + thick * i / through, 2 * math.pi * j / around
                print("%.9g %.9g %.9g" % (r * math.cos(a), y, r * math.sin(a)), file=nodes)
with open("seal.elements", "w") as elements:
    e = 0
    for j in range(around):
        for i in range(through):
            print(*[number(i + a, j + b, k) for k in (0, 1)
                    for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))], file=elements)
            if i == 0:
                sets["inner"].append((e, 0))
            if i == through - 1:  # the bottom is at three quarters of the way around
                glued = abs(j + 0.5 - 0.75 * around) < around / 12
                sets["glued" if glued else "outer"].append((e, 1))
            sets["sides"] += [(e, 4), (e, 5)]
            e += 1
    for name, faces in sets.items():
        print("face_set", name, file=elements)
        for e, face in faces:
            print(e, face, file=elements)
