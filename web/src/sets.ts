// Sets of faces of a solid by picking, written as the sets by geometry that scenes have.

import type { Body } from "./frames";

export type Vec = [number, number, number];

const sub = (a: Vec, b: Vec): Vec => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a: Vec, b: Vec) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a: Vec, b: Vec): Vec => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];
const unit = (a: Vec): Vec => {
  const n = Math.hypot(...a) || 1;
  return [a[0] / n, a[1] / n, a[2] / n];
};

function corners(body: Body, t: number): Vec[] {
  return [0, 1, 2].map((k) => {
    const p = 3 * body.triangles[3 * t + k];
    return [body.points[p], body.points[p + 1], body.points[p + 2]] as Vec;
  });
}

export function centreOf(body: Body, t: number): Vec {
  const [a, b, c] = corners(body, t);
  return [0, 1, 2].map((k) => (a[k] + b[k] + c[k]) / 3) as Vec;
}

/** Triangles from one on, as long as neighbours turn by less than an angle [degree]. */
export function grow(body: Body, from: number, angle: number): number[] {
  const count = body.triangles.length / 3;
  const normals = Array.from({ length: count }, (_, t) => {
    const [a, b, c] = corners(body, t);
    return unit(cross(sub(b, a), sub(c, a)));
  });
  const edges = new Map<number, number[]>();
  const points = body.points.length / 3;
  const edge = (t: number, k: number) => {
    const a = body.triangles[3 * t + k];
    const b = body.triangles[3 * t + ((k + 1) % 3)];
    return Math.min(a, b) * points + Math.max(a, b);
  };
  for (let t = 0; t < count; ++t)
    for (let k = 0; k < 3; ++k) {
      const key = edge(t, k);
      const list = edges.get(key);
      if (list) list.push(t);
      else edges.set(key, [t]);
    }
  const least = Math.cos((angle * Math.PI) / 180);
  const found = new Set([from]);
  const waiting = [from];
  while (waiting.length > 0) {
    const t = waiting.pop()!;
    for (let k = 0; k < 3; ++k)
      for (const other of edges.get(edge(t, k))!)
        if (!found.has(other) && dot(normals[t], normals[other]) >= least) {
          found.add(other);
          waiting.push(other);
        }
  }
  return [...found];
}

/** Triangles all of whose corners lie in a box [m]. */
export function inBox(body: Body, from: Vec, to: Vec): number[] {
  const out: number[] = [];
  for (let t = 0; t < body.triangles.length / 3; ++t)
    if (corners(body, t).every((p) => p.every((x, k) => x >= from[k] && x <= to[k]))) out.push(t);
  return out;
}

/** The box around those points of a body that lie in a rectangle of the screen; null: none does. */
export function boxOf(body: Body, screen: Float32Array, rectangle: [number, number, number, number]): [Vec, Vec] | null {
  const from: Vec = [Infinity, Infinity, Infinity];
  const to: Vec = [-Infinity, -Infinity, -Infinity];
  const [x0, y0, x1, y1] = rectangle;
  for (let i = 0; i < screen.length / 2; ++i) {
    const x = screen[2 * i];
    const y = screen[2 * i + 1];
    if (x < x0 || x > x1 || y < y0 || y > y1) continue;
    for (let k = 0; k < 3; ++k) {
      from[k] = Math.min(from[k], body.points[3 * i + k]);
      to[k] = Math.max(to[k], body.points[3 * i + k]);
    }
  }
  if (!(from[0] <= to[0])) return null;
  const margin = 1e-6 * Math.hypot(...sub(to, from)) + 1e-9;
  return [from.map((x) => x - margin) as Vec, to.map((x) => x + margin) as Vec];
}

export function normalOf(body: Body, t: number): Vec {
  const [a, b, c] = corners(body, t);
  return unit(cross(sub(b, a), sub(c, a)));
}

/** Triangles in the plane of one of them, and how far from it counts [m]: 1e-4 of the body's size. */
export function inPlane(body: Body, t: number): { triangles: number[]; within: number } {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  body.points.forEach((x, i) => {
    low[i % 3] = Math.min(low[i % 3], x);
    high[i % 3] = Math.max(high[i % 3], x);
  });
  const within = 1e-4 * Math.hypot(...high.map((h, k) => h - low[k]));
  const at = centreOf(body, t);
  const n = normalOf(body, t);
  const near = (p: Vec) => Math.abs(dot(sub(p, at), n)) <= within;
  const triangles = [];
  for (let k = 0; k < body.triangles.length / 3; ++k) if (corners(body, k).every(near)) triangles.push(k);
  return { triangles, within };
}

export type Polygon = [number, number][]; // of the screen [pixels]

function inside(x: number, y: number, polygon: Polygon): boolean {
  let odd = false;
  for (let i = 0, j = polygon.length - 1; i < polygon.length; j = i++) {
    const [xi, yi] = polygon[i];
    const [xj, yj] = polygon[j];
    if (yi > y !== yj > y && x < ((xj - xi) * (y - yi)) / (yj - yi) + xi) odd = !odd;
  }
  return odd;
}

/** Triangles all of whose corners lie in a polygon. @param screen  places of the body's points [pixels] */
export function inPolygon(body: Body, screen: Float32Array, polygon: Polygon): Set<number> {
  const points = Array.from({ length: screen.length / 2 }, (_, i) => inside(screen[2 * i], screen[2 * i + 1], polygon));
  const out = new Set<number>();
  for (let t = 0; t < body.triangles.length / 3; ++t)
    if ([0, 1, 2].every((k) => points[body.triangles[3 * t + k]])) out.add(t);
  return out;
}

/** Faces all of whose triangles are in one set, and some in another; ascending. */
export function facesOf(body: Body, all: Set<number>, some: Set<number>): number[] {
  const count = new Map<number, [number, number, number]>();
  body.faces!.forEach((f, t) => {
    const c = count.get(f) ?? [0, 0, 0];
    count.set(f, [c[0] + 1, c[1] + Number(all.has(t)), c[2] + Number(some.has(t))]);
  });
  return [...count].filter(([, [n, within, seen]]) => within === n && seen > 0).map(([f]) => f).sort((a, b) => a - b);
}
