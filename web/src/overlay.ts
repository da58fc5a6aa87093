// What is written and drawn over a view: scale, axes, colours, distances, the hand.

import * as THREE from "three";
import type { Health } from "./state";
import { lengthText, roundBelow, shortNumber, viridis } from "./colours";

type G = CanvasRenderingContext2D;
type Spot = [number, number]; // [pixels]

function path(g: G, points: Spot[], close = false) {
  g.beginPath();
  points.forEach(([x, y], i) => (i === 0 ? g.moveTo(x, y) : g.lineTo(x, y)));
  if (close) g.closePath();
  g.stroke();
}

/** Text that can be read on whatever lies below it. */
export function label(g: G, text: string, x: number, y: number) {
  const width = g.measureText(text).width;
  const left = g.textAlign === "center" ? x - width / 2 : x;
  const ink = g.fillStyle;
  g.fillStyle = "#ffffffd9";
  g.fillRect(left - 3, y - 12, width + 6, 16);
  g.fillStyle = ink;
  g.fillText(text, x, y);
}

export function drawScale(g: G, width: number, height: number, metre: number) {
  const length = roundBelow((0.2 * width) / metre);
  const pixels = length * metre;
  const x = width - 20 - pixels;
  const y = height - 18;
  path(g, [
    [x, y - 5],
    [x, y],
    [x + pixels, y],
    [x + pixels, y - 5],
  ]);
  g.textAlign = "center";
  g.fillText(lengthText(length), x + pixels / 2, y - 7);
}

export function drawAxes(g: G, height: number, toCamera: THREE.Matrix4) {
  const at: Spot = [40, height - 40];
  (["x", "y", "z"] as const).forEach((name, i) => {
    const v = new THREE.Vector3().setComponent(i, 1).transformDirection(toCamera);
    path(g, [at, [at[0] + 26 * v.x, at[1] - 26 * v.y]]);
    if (Math.hypot(v.x, v.y) > 0.2) {
      g.textAlign = "center";
      g.fillText(name, at[0] + 35 * v.x, at[1] - 35 * v.y + 4);
    }
  });
  g.textAlign = "left";
}

/** @return  where the next line stands */
export function drawBar(
  g: G,
  y: number,
  width: number,
  { name, unit, range }: { name: string; unit: string; range: [number, number] },
): number {
  const [low, high] = range;
  const ink = g.fillStyle;
  g.fillText(name + (unit ? ` [${unit}]` : ""), 12, y);
  y += 8;
  if (!(high > low)) {
    g.fillText(shortNumber(low) + " everywhere", 12, y + 12);
    return y + 32;
  }
  const long = Math.min(220, width - 40);
  for (let i = 0; i < long; ++i) {
    const [r, gr, b] = viridis(i / (long - 1));
    g.fillStyle = `rgb(${255 * r},${255 * gr},${255 * b})`;
    g.fillRect(12 + i, y, 1.5, 12);
  }
  g.fillStyle = ink;
  g.fillText(shortNumber(low), 12, y + 26);
  g.textAlign = "center";
  g.fillText(shortNumber((low + high) / 2), 12 + long / 2, y + 26);
  g.textAlign = "right";
  g.fillText(shortNumber(high), 12 + long, y + 26);
  g.textAlign = "left";
  return y + 46;
}

/** The device, the simulation's handle, and the force on the hand. */
export function drawHand(g: G, h: Health, onScreen: (p: number[]) => Spot, metre: number) {
  const handle = onScreen(h.handle);
  const device = onScreen(h.device);
  g.lineWidth = 2;
  g.strokeStyle = g.fillStyle = "#0b6e99";
  path(g, [handle, device]);
  g.beginPath();
  g.arc(...device, 6, 0, 2 * Math.PI);
  g.stroke();
  g.beginPath();
  g.arc(...handle, 4, 0, 2 * Math.PI);
  g.fill();
  const size = Math.hypot(...h.force);
  if (size > 0) {
    // As long as a tenth of a metre of the screen's height is wide for the largest force of most devices, 3 N.
    const end = onScreen(h.device.map((x, k) => x + ((h.force[k] / 3) * 120) / metre));
    g.strokeStyle = "#6f2da8";
    path(g, [device, end]);
  }
  g.textAlign = "left";
  g.fillStyle = "#0b6e99";
  label(g, `device (ring), handle (dot): ${shortNumber(size)} N in the hand`, 12, g.canvas.height / scaleOf(g) - 78);
  g.fillStyle = g.strokeStyle = "#1b1f24";
}

const scaleOf = (g: G) => g.getTransform().a || 1;

export function drawMeasure(g: G, places: number[][], spots: Spot[]) {
  g.lineWidth = 1.5;
  g.strokeStyle = g.fillStyle = "#8a1c7c";
  for (const s of spots) {
    path(g, [
      [s[0] - 5, s[1]],
      [s[0] + 5, s[1]],
    ]);
    path(g, [
      [s[0], s[1] - 5],
      [s[0], s[1] + 5],
    ]);
  }
  if (spots.length === 2) {
    path(g, spots);
    g.textAlign = "center";
    const d = Math.hypot(...places[1].map((x, k) => x - places[0][k]));
    label(g, lengthText(d), (spots[0][0] + spots[1][0]) / 2, (spots[0][1] + spots[1][1]) / 2 - 8);
    g.textAlign = "left";
  }
  g.fillStyle = g.strokeStyle = "#1b1f24";
}

export function drawOutline(g: G, outline: Spot[]) {
  g.strokeStyle = "#b0124f";
  g.setLineDash([4, 3]);
  path(g, outline, true);
  g.setLineDash([]);
  g.strokeStyle = "#1b1f24";
}

export function drawCross(g: G, [x, y]: Spot) {
  g.strokeStyle = "#b0124f";
  path(g, [
    [x - 10, y],
    [x + 10, y],
  ]);
  path(g, [
    [x, y - 10],
    [x, y + 10],
  ]);
  g.strokeStyle = "#1b1f24";
}
