"""The wire at some instants beside each other, each from two sides: python3 draw.py [RADIUS] FOLDER nest.png STEP ...

RADIUS is the wire's [m], FOLDER that of `amontons run`, STEP a number in frames/wire.STEP.vtp. From the wire's end (yellow)
to its sheath (blue).
"""

import re
import struct
import sys
import zlib

BALL = 0.015  # [m]
SCALE, SIDE = 12000, 380  # pixels a metre, of a panel
VIEWS = (((0.8, 0.6, 0.0), (0.0, 0.0, 1.0)), ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)))  # right, up
COLOURS = ((40, 70, 130), (70, 150, 200), (250, 205, 90))


def middle_line(file):
    data = open(file, "rb").read()
    at = data.index(b"_", data.index(b"<AppendedData")) + 1
    offset = int(re.search(rb'Name="points"[^>]*offset="(\d+)"', data).group(1))
    size = struct.unpack_from("<Q", data, at + offset)[0]
    x = struct.unpack_from(f"<{size // 8}d", data, at + offset + 8)
    return [x[i : i + 3] for i in range(0, len(x), 3)]


def dot(a, b):
    return sum(p * q for p, q in zip(a, b))


def colour(share):
    k, t = (0, 2 * share) if share < 0.5 else (1, 2 * share - 1)
    return [a + t * (b - a) for a, b in zip(COLOURS[k], COLOURS[k + 1])]


def panel(points, radius, right, up):
    """Rows of pixels: balls along the middle line, nearest first, lit from the camera."""
    eye = [right[k - 2] * up[k - 1] - right[k - 1] * up[k - 2] for k in range(3)]
    pixels = [[(255, 255, 255)] * SIDE for _ in range(SIDE)]
    depth = [[-1.0] * SIDE for _ in range(SIDE)]
    middle, wide = SIDE / 2, SCALE * radius
    for j in range(SIDE):
        for i in range(SIDE):
            if (i - middle) ** 2 + (j - middle) ** 2 < (SCALE * BALL) ** 2:
                pixels[j][i] = (243, 239, 236)
    inside = [p for p in points if dot(p, p) < BALL**2]
    parts = 12
    for k in range((len(inside) - 1) * parts):
        a, b, t = inside[k // parts], inside[k // parts + 1], k % parts / parts
        p = [u + t * (v - u) for u, v in zip(a, b)]
        x, y, z = middle + SCALE * dot(p, right), middle - SCALE * dot(p, up), SCALE * dot(p, eye)
        own = colour(k / (len(inside) * parts))
        for j in range(max(0, int(y - wide)), min(SIDE, int(y + wide) + 2)):
            for i in range(max(0, int(x - wide)), min(SIDE, int(x + wide) + 2)):
                rest = wide**2 - (i - x) ** 2 - (j - y) ** 2
                if rest <= 0:
                    continue
                out = rest**0.5
                if z + out + SCALE <= depth[j][i]:
                    continue
                depth[j][i] = z + out + SCALE
                light = 0.25 + 0.75 * out / wide
                pixels[j][i] = tuple(int(light * c) for c in own)
    return pixels


def write_png(file, rows):
    raw = b"".join(b"\0" + bytes(c for pixel in row for c in pixel) for row in rows)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 2, 0, 0, 0)
    with open(file, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


def main():
    given = sys.argv[1:]
    radius = float(given.pop(0)) if given[0].startswith("0.") else 0.0008
    folder, file, steps = given[0], given[1], given[2:]
    rows = []
    for right, up in VIEWS:
        panels = [panel(middle_line(f"{folder}/frames/wire.{int(s):06d}.vtp"), radius, right, up) for s in steps]
        rows += [sum((p[j] for p in panels), []) for j in range(SIDE)]
    write_png(file, rows)


main()
