// Runs: the running one, those before it, and folders of results.

import * as api from "./api";
import { readPart, type Body, type Instant } from "./frames";

const kMostInstants = 400; // of a live run that are kept; then every second one is dropped
const kMostCached = 60; // of a finished run

export interface Moment {
  time: number;
  instant?: Instant;
  parts?: { name: string; file: string }[];
  folder?: string; // of the parts
}

export class Run {
  columns = new Map<string, number[]>(); // "time" among them
  units = new Map<string, string>();
  moments: Moment[] = [];
  scene: any = null;
  status = ""; // of a folder's manifest
  resumable = false; // the folder has a checkpoint, and its run has not ended
  private readonly before = new Map<string, Body>(); // the body of a name that was read last
  constructor(
    public name: string,
    public readonly folder: string = "", // "": live
  ) {}

  get times(): number[] {
    return this.columns.get("time") ?? [];
  }

  addRow(row: Record<string, number>, units: Record<string, string> = {}) {
    const count = this.times.length;
    for (const [name, unit] of Object.entries(units)) this.units.set(name, unit);
    for (const [name, value] of Object.entries(row)) {
      let c = this.columns.get(name);
      if (!c) this.columns.set(name, (c = new Array(count).fill(NaN)));
      c.push(value);
    }
    for (const c of this.columns.values()) if (c.length <= count) c.push(NaN);
  }

  addInstant(instant: Instant) {
    const last = this.moments[this.moments.length - 1];
    // After a change of the scene the same step is shown with new numbers, out of balance until the next one.
    if (last?.instant && last.instant.step === instant.step && instant.step > 0) return;
    if (last && last.time === instant.time) this.moments.pop();
    this.moments.push({ time: instant.time, instant });
    if (this.moments.length > kMostInstants)
      this.moments = this.moments.filter((_, i) => i % 2 === 0 || i === this.moments.length - 1);
  }

  /** Index of the moment nearest to a time; -1 if there is none. */
  nearest(time: number): number {
    let best = -1;
    this.moments.forEach((m, i) => {
      if (best < 0 || Math.abs(m.time - time) < Math.abs(this.moments[best].time - time)) best = i;
    });
    return best;
  }

  async load(index: number): Promise<Instant | null> {
    const m = this.moments[index];
    if (!m) return null;
    if (!m.instant) {
      const instant: Instant = { step: index, time: m.time, caption: "", bodies: [], contacts: new Float32Array() };
      await Promise.all(
        m.parts!.map(async ({ name, file }) => {
          const part = readPart(name, file, await api.file((m.folder ?? this.folder) + "/" + file));
          if ("contacts" in part) Object.assign(instant, part);
          else {
            if (this.scene?.bodies?.[name]?.kind === "obstacle") part.kind = "wall";
            this.shareWithBefore(part);
            instant.bodies.push(part);
          }
        }),
      );
      this.orientContacts(instant);
      instant.bodies.sort((a, b) => (a.name < b.name ? -1 : 1));
      m.instant = instant;
      const cached = this.moments.filter((x) => x.instant && x.parts);
      for (const old of cached.slice(0, Math.max(0, cached.length - kMostCached)))
        if (old !== m) old.instant = undefined;
    }
    return m.instant;
  }

  /** What is the same in every file is one array: what stands still is neither kept nor drawn anew. */
  private shareWithBefore(part: Body) {
    const before = this.before.get(part.name);
    const same = (a: Float32Array | Uint32Array, b: Float32Array | Uint32Array) =>
      a.length === b.length && a.every((x: number, i: number) => x === b[i]);
    if (before && same(before.triangles, part.triangles)) part.triangles = before.triangles;
    if (before && same(before.points, part.points)) part.points = before.points;
    this.before.set(part.name, part);
  }

  /** Forces of files are on the first body of a pair; shown are those on the wall that a wire touches, as live. */
  private orientContacts(instant: Instant) {
    const bodies = Object.entries<any>(this.scene?.bodies ?? {});
    const isWall = ([, b]: [string, any]) => b.kind === "obstacle";
    const order = [...bodies.filter(isWall), ...bodies.filter((b) => !isWall(b))];
    const { contacts, normals, pairs } = instant;
    if (!pairs || !normals || order.length === 0) return;
    instant.names = order.map(([name]) => name);
    for (let i = 0; i < pairs.length / 2; ++i) {
      const [a, b] = [pairs[2 * i], pairs[2 * i + 1]];
      if (order[a]?.[1].kind !== "beam" || order[b]?.[1].kind === "beam") continue;
      [pairs[2 * i], pairs[2 * i + 1]] = [b, a];
      for (let k = 0; k < 3; ++k) {
        contacts[6 * i + 3 + k] *= -1;
        normals[3 * i + k] *= -1;
      }
    }
  }

  /** A column where the run was at a time, linear between rows; NaN outside. */
  valueAt(column: string, time: number): number {
    const t = this.times;
    const v = this.columns.get(column);
    if (!v || t.length === 0 || time < t[0] - 1e-12 || time > t[t.length - 1] * (1 + 1e-12) + 1e-15) return NaN;
    let i = t.findIndex((x) => x >= time - 1e-9 * Math.abs(time));
    if (i < 0) i = t.length - 1;
    if (i === 0 || t[i] <= time * (1 + 1e-9)) return v[i]; // the same time but for round-off
    const f = (time - t[i - 1]) / (t[i] - t[i - 1]);
    return v[i - 1] * (1 - f) + v[i] * f;
  }

  csv(): string {
    const names = [...this.columns.keys()];
    const head = names.map((n) => (this.units.get(n) ? `${n} [${this.units.get(n)}]` : n));
    const lines = this.times.map((_, i) =>
      names.map((n) => (Number.isFinite(this.columns.get(n)![i]) ? this.columns.get(n)![i] : "")).join(","),
    );
    return [head.join(","), ...lines].join("\n") + "\n";
  }
}

/** A folder that `amontons run` has written. */
export async function openResults(folder: string): Promise<Run> {
  const manifest = JSON.parse(await api.fileText(folder + "/manifest.json"));
  const run = new Run(folder || "results", folder || ".");
  run.scene = manifest.scene?.resolved ?? null;
  run.status = manifest.status ?? "";
  run.resumable = manifest.checkpoint === true && run.status !== "done";
  const rows = (await api.fileText(run.folder + "/history.csv")).trim().split("\n");
  const heads = rows[0].split(",").map((h) => /^(.*?)(?: \[(.*)\])?$/.exec(h)!);
  heads.forEach((h, i) => {
    if (h[1] === "remark") return;
    run.columns.set(
      h[1],
      rows.slice(1).map((r) => {
        const text = r.split(",")[i];
        return text === undefined || text === "" ? NaN : Number(text);
      }),
    );
    if (h[2]) run.units.set(h[1], h[2]);
  });
  const name = (manifest.files as string[]).find((f) => f.endsWith(".pvd") && f !== "contacts.pvd");
  // What is written for the first time together with the checkpoint.
  const collection = name && manifest.checkpoint ? await api.fileText(run.folder + "/" + name).catch(() => "") : "";
  if (collection) {
    const xml = new DOMParser().parseFromString(collection, "text/xml");
    const byTime = new Map<string, Moment>();
    for (const d of xml.querySelectorAll("DataSet")) {
      const t = d.getAttribute("timestep")!;
      if (!byTime.has(t)) byTime.set(t, { time: Number(t), parts: [], folder: run.folder });
      byTime.get(t)!.parts!.push({ name: d.getAttribute("name") ?? "", file: d.getAttribute("file")! });
    }
    run.moments = [...byTime.values()].sort((a, b) => a.time - b.time);
  }
  return run;
}
