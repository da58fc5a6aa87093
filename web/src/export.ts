// A run as one HTML file that needs no server and no network.

import type { Body, Instant } from "./frames";
import { Run } from "./runs";

const kMostInstants = 60;

function packed(a: ArrayLike<number> & { buffer: ArrayBufferLike; byteOffset: number; byteLength: number }): string {
  const bytes = new Uint8Array(a.buffer, a.byteOffset, a.byteLength);
  let text = "";
  for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768));
  return btoa(text);
}

function unpacked(text: string): ArrayBuffer {
  return Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
}

/** Columns and up to 60 instants, evenly chosen. Triangles are written once. */
export async function dataOf(run: Run): Promise<string> {
  const count = run.moments.length;
  const chosen = [...new Set(Array.from({ length: Math.min(count, kMostInstants) }, (_, i) =>
    Math.round((i * (count - 1)) / Math.max(1, Math.min(count, kMostInstants) - 1)),
  ))];
  const before = new Map<string, Body>();
  const instants = [];
  for (const i of chosen) {
    const instant = await run.load(i);
    if (!instant) continue;
    instants.push({
      step: instant.step,
      time: instant.time,
      caption: instant.caption,
      contacts: packed(instant.contacts),
      bodies: instant.bodies.map((b) => {
        const old = before.get(b.name);
        before.set(b.name, b);
        const same = old && old.triangles.length === b.triangles.length && old.triangles.every((t, k) => t === b.triangles[k]);
        return {
          name: b.name,
          kind: b.kind,
          points: old && old.points === b.points ? undefined : packed(b.points),
          triangles: same ? undefined : packed(b.triangles),
          radius: b.radius && packed(b.radius),
          fields: b.fields.map((f) => ({ name: f.name, unit: f.unit, values: packed(f.values) })),
        };
      }),
    });
  }
  return JSON.stringify({
    name: run.name,
    columns: [...run.columns].map(([name, v]) => ({ name, unit: run.units.get(name) ?? "", values: v })),
    instants,
  });
}

/** The page itself, its style and a run, in one file. */
export async function exportPage(data: string): Promise<Blob> {
  const [script, style] = await Promise.all(["/studio.js", "/studio.css"].map(async (p) => (await fetch(p)).text()));
  const safe = (text: string) => text.replaceAll("</", "<\\/");
  return new Blob(
    [
      '<!doctype html><html lang="en"><head><meta charset="utf-8"><title>amontons: a run</title><link rel="icon" href="data:,"><style>',
      style,
      '</style><script type="application/json" id="amontons-run">',
      safe(data),
      '</script></head><body><script type="module">',
      safe(script),
      "</script></body></html>\n",
    ],
    { type: "text/html" },
  );
}

/** The run that this page was exported with, or null where there is a server. */
export function exported(): Run | null {
  const text = document.getElementById("amontons-run")?.textContent;
  if (!text) return null;
  const data = JSON.parse(text);
  const run = new Run(data.name);
  for (const c of data.columns) {
    run.columns.set(c.name, c.values.map((v: number | null) => v ?? NaN));
    if (c.unit) run.units.set(c.name, c.unit);
  }
  const triangles = new Map<string, Uint32Array>();
  const points = new Map<string, Float32Array>();
  for (const i of data.instants) {
    const instant: Instant = {
      step: i.step,
      time: i.time,
      caption: i.caption,
      contacts: new Float32Array(unpacked(i.contacts)),
      bodies: i.bodies.map((b: any) => {
        if (b.points !== undefined) points.set(b.name, new Float32Array(unpacked(b.points)));
        if (b.triangles !== undefined) triangles.set(b.name, new Uint32Array(unpacked(b.triangles)));
        return {
          name: b.name,
          kind: b.kind,
          points: points.get(b.name)!,
          triangles: triangles.get(b.name)!,
          radius: b.radius && new Float32Array(unpacked(b.radius)),
          fields: b.fields.map((f: any) => ({ name: f.name, unit: f.unit, values: new Float32Array(unpacked(f.values)) })),
        };
      }),
    };
    run.moments.push({ time: instant.time, instant });
  }
  return run;
}
