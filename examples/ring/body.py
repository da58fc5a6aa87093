#!/usr/bin/env python3
"""body.py [CELLS]: writes here
body.nodes, body.elements  a quarter of a round body of bricks along z, radius 0.04 m, with a domed
                           head: CELLS along an eighth of its girth (3). Sets: tail (faces), x_min
                           and y_min (nodes of its cuts).
ring.csv                   the middle of the ring and its radius, 0.046 m that narrows to 0.032 m."""
import math
import sys

cells = int(sys.argv[1]) if len(sys.argv) > 1 else 3
straight, radius, core, dome = 0.14, 0.04, 0.55, 0.26
edge = math.pi / 4 * radius / cells
rings = max(1, round((1 - core) * radius / edge))
layers, head = round(straight / edge), max(2, round(0.8 * radius / edge))

# A section of radius 1: a square grid that is rounded towards its border, and rings around it.
plan, grid, border = [], {}, []
for j in range(-cells, cells + 1):
    for i in range(-cells, cells + 1):
        x, y = i / cells, j / cells
        size, length = max(abs(x), abs(y)), math.hypot(x, y)
        bend = 0.5 * size / length if length > 0 else 0
        grid[i, j] = len(plan)
        plan.append((core * (0.5 + bend) * x, core * (0.5 + bend) * y))
n = cells
around = ([(n, j) for j in range(-n, n)] + [(i, n) for i in range(n, -n, -1)]
          + [(-n, j) for j in range(n, -n, -1)] + [(i, -n) for i in range(-n, n)])
ring = [grid[a] for a in around]
quads = [(grid[i, j], grid[i + 1, j], grid[i + 1, j + 1], grid[i, j + 1])
         for j in range(-n, n) for i in range(-n, n)]
for r in range(rings):
    share = (r + 1) / rings
    outer = []
    for k, (i, j) in enumerate(around):
        angle = math.pi / 4 * (k / n - 1)
        x, y = plan[grid[i, j]]
        outer.append(len(plan))
        plan.append(((1 - share) * x + share * math.cos(angle),
                     (1 - share) * y + share * math.sin(angle)))
    for k in range(len(ring)):
        m = (k + 1) % len(ring)
        quads.append((ring[k], outer[k], outer[m], ring[m]))
    ring = outer

# The quarter x, y >= 0.
quads = [q for q in quads if sum(plan[i][0] for i in q) > 0 and sum(plan[i][1] for i in q) > 0]
used = sorted({i for q in quads for i in q})
number = {old: new for new, old in enumerate(used)}
plan = [tuple(0 if abs(c) < 1e-12 else c for c in plan[i]) for i in used]
quads = [tuple(number[i] for i in q) for q in quads]

with open("body.nodes", "w") as nodes:
    for layer in range(layers + head + 1):
        t = max(0, layer - layers) / head
        for x, y in plan:
            wide = radius * (1 - dome * t * t)
            z = straight * min(layer, layers) / layers - straight
            z += radius * t * (1 - dome * (x * x + y * y))
            print("%.9g %.9g %.9g" % (wide * x, wide * y, z), file=nodes)
with open("body.elements", "w") as elements:
    for layer in range(layers + head):
        low, high = layer * len(plan), (layer + 1) * len(plan)
        for q in quads:
            print(*[low + i for i in q], *[high + i for i in q], file=elements)
    print("face_set tail", file=elements)
    for e in range(len(quads)):
        print(e, 4, file=elements)
    for name, axis in (("x_min", 0), ("y_min", 1)):
        print("node_set", name, file=elements)
        for layer in range(layers + head + 1):
            for i, place in enumerate(plan):
                if place[axis] == 0:
                    print(layer * len(plan) + i, file=elements)
with open("ring.csv", "w") as ring_file:
    print("x,y,z,radius", file=ring_file)
    for mm in range(0, 205, 5):
        into, out = min(1, max(0, (mm - 30) / 50)), min(1, max(0, (170 - mm) / 40))
        narrow = min(into * into * (3 - 2 * into), out * out * (3 - 2 * out))
        print("0,0,%.9g,%.9g" % (1e-3 * mm, 0.046 - 0.014 * narrow), file=ring_file)
