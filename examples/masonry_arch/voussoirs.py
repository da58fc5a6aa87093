#!/usr/bin/env python3
"""voussoirs.py [BLOCKS [THICKNESS [FRICTION]]]: writes scene.json and voussoirs/*.obj of a
semicircular arch of mean radius 1 m here; the thickness is in metres."""
import json
import math
import os
import sys

blocks = int(sys.argv[1]) if len(sys.argv) > 1 else 24
thickness = float(sys.argv[2]) if len(sys.argv) > 2 else 0.12
friction = float(sys.argv[3]) if len(sys.argv) > 3 else 0.7
depth = 0.2
quads = [(1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)]

os.makedirs("voussoirs", exist_ok=True)
bodies = []
for k in range(blocks):
    angles = [math.pi * (k + i) / blocks for i in (0, 1)]
    radii = [1 - thickness / 2, 1 + thickness / 2]
    with open(f"voussoirs/{k:02d}.obj", "w") as obj:
        for y in (-depth / 2, depth / 2):
            for angle in angles:
                for radius in radii:
                    print("v %.15g %.15g %.15g" % (radius * math.cos(angle), y,
                                                   radius * math.sin(angle)), file=obj)
        for a, b, c, d in quads:
            print(f"f {a} {b} {c}\nf {a} {c} {d}", file=obj)
    bodies.append(f'    "v{k:02d}": {{"kind": "rigid", "shape": {{"file": "voussoirs/{k:02d}.obj"}}, '
                  '"density": 2000}')
with open("scene.json", "w") as scene:
    scene.write(f"""{{
  "schema": 1,
  "title": "A semicircular arch of {blocks} voussoirs",
  "bodies": {{
    "ground": {{"kind": "obstacle", "surface": {{"generate": "plane"}}}},
{(',' + chr(10)).join(bodies)}
  }},
  "gravity": [0, 0, -9.81],
  "contact": [{{"between": ["*", "*"], "friction": {json.dumps(friction)}, "reach": 1e-3}}],
  "time": {{"step": 1, "end": 1}},
  "output": {{"plots": false}}
}}
""")
