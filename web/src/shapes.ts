// Shapes as they are drawn: edges, the outside, wires as tubes.

import * as THREE from "three";

const kSharp = Math.cos((30 * Math.PI) / 180); // neighbours that turn by more have an edge between them

/** Pairs of points along edges with a corner, and along open borders. */
export function sharpEdges(points: Float32Array, triangles: Uint32Array): number[] {
  const count = triangles.length / 3;
  const normals = new Float32Array(3 * count);
  const [a, b, c] = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
  for (let t = 0; t < count; ++t) {
    [a, b, c].forEach((v, k) => v.fromArray(points, 3 * triangles[3 * t + k]));
    b.sub(a).cross(c.sub(a)).normalize().toArray(normals, 3 * t);
  }
  const n = points.length / 3;
  const seen = new Map<number, number>();
  const out: number[] = [];
  for (let t = 0; t < count; ++t)
    for (let k = 0; k < 3; ++k) {
      const i = triangles[3 * t + k];
      const j = triangles[3 * t + ((k + 1) % 3)];
      const key = Math.min(i, j) * n + Math.max(i, j);
      const other = seen.get(key);
      if (other === undefined) {
        seen.set(key, t);
        continue;
      }
      seen.delete(key);
      const dot =
        normals[3 * t] * normals[3 * other] +
        normals[3 * t + 1] * normals[3 * other + 1] +
        normals[3 * t + 2] * normals[3 * other + 2];
      if (dot < kSharp) out.push(i, j);
    }
  for (const key of seen.keys()) out.push(Math.floor(key / n), key % n);
  return out;
}

export const kSides = 12; // of a wire's tube
// The polygon has the area of the circle: X-rays have the same path through it.
const kRounder = Math.sqrt((2 * Math.PI) / (kSides * Math.sin((2 * Math.PI) / kSides)));

/** Triangles with the outside where their corners run against the clock; an open surface stays as it is nearly. */
export function outwards(points: Float32Array, triangles: Uint32Array): Uint32Array {
  const at = (i: number, k: number) => points[3 * triangles[i] + k] - points[k];
  let volume = 0;
  for (let i = 0; i < triangles.length; i += 3)
    volume +=
      at(i, 0) * (at(i + 1, 1) * at(i + 2, 2) - at(i + 1, 2) * at(i + 2, 1)) +
      at(i, 1) * (at(i + 1, 2) * at(i + 2, 0) - at(i + 1, 0) * at(i + 2, 2)) +
      at(i, 2) * (at(i + 1, 0) * at(i + 2, 1) - at(i + 1, 1) * at(i + 2, 0));
  if (volume >= 0) return triangles;
  const out = triangles.slice();
  for (let i = 0; i < out.length; i += 3) [out[i + 1], out[i + 2]] = [out[i + 2], out[i + 1]];
  return out;
}

/** A wire as a closed tube around its middle line. */
export function tube(line: Float32Array, radius: Float32Array | undefined, thinnest: number) {
  const n = line.length / 3;
  const points = new Float32Array(3 * (n * kSides + 2));
  const at = (i: number) => new THREE.Vector3(line[3 * i], line[3 * i + 1], line[3 * i + 2]);
  let normal = new THREE.Vector3(0, 0, 1);
  for (let i = 0; i < n; ++i) {
    const along = at(Math.min(n - 1, i + 1)).sub(at(Math.max(0, i - 1))).normalize();
    if (i === 0 && Math.abs(along.z) > 0.9) normal.set(1, 0, 0);
    normal = normal.sub(along.clone().multiplyScalar(normal.dot(along))).normalize(); // no twist of its own
    const side = along.clone().cross(normal);
    const r = kRounder * Math.max(thinnest, radius?.[i] ?? 0);
    for (let k = 0; k < kSides; ++k) {
      const a = (2 * Math.PI * k) / kSides;
      for (let c = 0; c < 3; ++c)
        points[3 * (i * kSides + k) + c] =
          line[3 * i + c] + r * (Math.cos(a) * normal.getComponent(c) + Math.sin(a) * side.getComponent(c));
    }
  }
  const caps = n * kSides;
  for (let c = 0; c < 3; ++c) {
    points[3 * caps + c] = line[c];
    points[3 * caps + 3 + c] = line[3 * (n - 1) + c];
  }
  const out: number[] = [];
  for (let k = 0; k < kSides; ++k) {
    const next = (k + 1) % kSides;
    for (let i = 0; i + 1 < n; ++i) {
      const a = i * kSides;
      out.push(a + k, a + next, a + kSides + k, a + next, a + kSides + next, a + kSides + k);
    }
    out.push(caps, next, k, caps + 1, (n - 1) * kSides + k, (n - 1) * kSides + next);
  }
  return { points, triangles: Uint32Array.from(out) };
}

/**
 * A surface of fewer triangles between some of the same points: of those in a cell of a grid the first one stands for
 * all. Cells are as wide as `most` triangles of equal size would make them.
 */
export function fewerTriangles(points: Float32Array, triangles: Uint32Array, most: number): Uint32Array {
  const [a, b, c] = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
  let area = 0;
  for (let t = 0; t < triangles.length; t += 3) {
    [a, b, c].forEach((v, k) => v.fromArray(points, 3 * triangles[t + k]));
    area += 0.5 * b.sub(a).cross(c.sub(a)).length();
  }
  const cell = Math.sqrt((2 * area) / most);
  const first = new Map<string, number>();
  const standsFor = Uint32Array.from({ length: points.length / 3 }, (_, i) => {
    const key = [0, 1, 2].map((k) => Math.floor(points[3 * i + k] / cell)).join();
    if (!first.has(key)) first.set(key, i);
    return first.get(key)!;
  });
  const out: number[] = [];
  for (let t = 0; t < triangles.length; t += 3) {
    const [i, j, k] = [0, 1, 2].map((n) => standsFor[triangles[t + n]]);
    if (i !== j && j !== k && k !== i) out.push(i, j, k);
  }
  return Uint32Array.from(out);
}
