// Arrows of contact forces: whole, normal or friction, on either body, each by itself or joined.

import * as THREE from "three";
import type { Instant } from "./frames";
import type { Arrows } from "./appearance";
import { lengthText, shortNumber } from "./colours";

const kMostArrows = 4096;
type Vec = [number, number, number];

export interface Arrow {
  at: Vec; // [m]
  force: Vec; // [N]
  size: number; // of it [N]
}

function force(now: Instant, i: number, arrows: Arrows): Vec {
  const sign = arrows.other ? -1 : 1;
  return [0, 1, 2].map((k) => {
    const whole = now.contacts[6 * i + 3 + k];
    const normal = now.normals?.[3 * i + k] ?? 0;
    return sign * (arrows.part === "normal" ? normal : arrows.part === "friction" ? whole - normal : whole);
  }) as Vec;
}

export function arrowsOf(now: Instant, arrows: Arrows): Arrow[] {
  const out: Arrow[] = [];
  const cells = new Map<string, { weight: number; at: Vec; force: Vec }>();
  for (let i = 0; i < now.contacts.length / 6; ++i) {
    const at = [0, 1, 2].map((k) => now.contacts[6 * i + k]) as Vec;
    const f = force(now, i, arrows);
    const size = Math.hypot(...f);
    if (arrows.within === 0) {
      out.push({ at, force: f, size });
      continue;
    }
    // Contacts of a pair in one cell of a grid are one, at the mean of their places by force.
    const key = [now.pairs?.[2 * i], now.pairs?.[2 * i + 1], ...at.map((x) => Math.floor(x / arrows.within))].join();
    const c = cells.get(key) ?? { weight: 0, at: [0, 0, 0], force: [0, 0, 0] };
    c.weight += size;
    for (let k = 0; k < 3; ++k) {
      c.at[k] += size * at[k];
      c.force[k] += f[k];
    }
    cells.set(key, c);
  }
  for (const c of cells.values())
    if (c.weight > 0)
      out.push({ at: c.at.map((x) => x / c.weight) as Vec, force: c.force, size: Math.hypot(...c.force) });
  return out;
}

const kMostPairs = 3;

/** What the arrows mean. */
export function arrowWords(now: Instant, arrows: Arrows, longest: number): string[] {
  const part = arrows.part === "normal" ? "normal part of " : arrows.part === "friction" ? "friction, of " : "";
  const lines = [`longest arrow ${shortNumber(longest)} N`];
  const pairs = new Set<string>();
  for (let i = 0; now.pairs && now.names && i < now.pairs.length / 2 && pairs.size <= kMostPairs; ++i) {
    const [on, by] = [0, 1].map((k) => now.names![now.pairs![2 * i + (arrows.other ? 1 - k : k)]]);
    pairs.add(`force on ${on} by ${by}`);
  }
  [...pairs].slice(0, kMostPairs).forEach((p) => lines.push(part + p));
  if (pairs.size > kMostPairs) lines.push("and others");
  if (arrows.within > 0) lines.push(`joined within ${lengthText(arrows.within)}`);
  return lines;
}

/** Arrows as shapes: shaft and head, and both faintly where bodies hide them. */
export class ArrowMeshes {
  private readonly shafts: THREE.InstancedMesh;
  private readonly heads: THREE.InstancedMesh;
  private readonly ghosts: THREE.InstancedMesh[];
  private readonly all: THREE.InstancedMesh[];

  constructor(scene: THREE.Scene) {
    const dark = new THREE.MeshLambertMaterial({ color: 0xc1440e });
    const faint = new THREE.MeshBasicMaterial({
      color: 0xc1440e,
      transparent: true,
      opacity: 0.22,
      depthTest: false,
      depthWrite: false,
    });
    // Few triangles: hundreds of arrows cost more than the bodies where there is no GPU. The heads close the shafts.
    const shaft = new THREE.CylinderGeometry(1, 1, 1, 6, 1, true).translate(0, 0.5, 0);
    const head = new THREE.ConeGeometry(1, 1, 10).translate(0, -0.5, 0);
    this.shafts = new THREE.InstancedMesh(shaft, dark, kMostArrows);
    this.heads = new THREE.InstancedMesh(head, dark, kMostArrows);
    this.ghosts = [this.shafts, this.heads].map((m) => {
      const ghost = new THREE.InstancedMesh(m.geometry, faint, kMostArrows);
      ghost.instanceMatrix = m.instanceMatrix;
      ghost.renderOrder = 3;
      return ghost;
    });
    this.all = [this.shafts, this.heads, ...this.ghosts];
    for (const m of this.all) {
      m.frustumCulled = false;
      m.count = 0;
      scene.add(m);
    }
  }

  /** Whether arrows are seen through bodies, too. */
  set through(on: boolean) {
    for (const m of this.ghosts) m.visible = on;
  }

  /** @param full  length of an arrow of the largest force [m] */
  show(arrows: Arrow[], full: number, largest: number) {
    const turn = new THREE.Quaternion();
    const up = new THREE.Vector3(0, 1, 0);
    const m = new THREE.Matrix4();
    let n = 0;
    for (const a of arrows.slice(0, kMostArrows)) {
      const length = (full * a.size) / largest;
      if (!(length >= 0.02 * full)) continue;
      const way = new THREE.Vector3(...a.force).normalize();
      const at = new THREE.Vector3(...a.at);
      turn.setFromUnitVectors(up, way);
      const head = Math.min(0.25 * full, 0.45 * length);
      const thick = 0.014 * full;
      m.compose(at, turn, new THREE.Vector3(thick, length - head, thick));
      this.shafts.setMatrixAt(n, m);
      m.compose(at.addScaledVector(way, length), turn, new THREE.Vector3(0.3 * head, head, 0.3 * head));
      this.heads.setMatrixAt(n++, m);
    }
    for (const mesh of this.all) {
      mesh.count = n;
      mesh.instanceMatrix.needsUpdate = true;
    }
  }
}
