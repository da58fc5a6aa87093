// One instant, from a live frame ("AMF1") or from the files of a finished run.

export interface Field {
  readonly name: string;
  readonly unit: string;
  readonly values: Float32Array; // one a point
}

export interface Body {
  name: string;
  kind: "wall" | "wire" | "solid" | "rigid";
  points: Float32Array; // 3 a point [m]
  triangles: Uint32Array; // empty for a wire: its points are its middle line
  radius?: Float32Array; // of a wire [m]
  faces?: Uint32Array; // of a solid's triangle: the face of the outside that it is of
  fields: Field[];
}

export interface Instant {
  step: number;
  time: number;
  caption: string;
  bodies: Body[];
  contacts: Float32Array; // 6 each: point [m], force [N]
  normals?: Float32Array; // 3 each: the part of the force along the contact's normal [N]
  names?: string[]; // of bodies, by the numbers of `pairs`
  pairs?: Uint32Array; // 2 each: numbers of the body that the force acts on, and of the other one
}

export interface LiveHead {
  seq: number;
  before: number;
  step: number;
  time: number;
  done: boolean;
  caption: string;
  names?: string[];
  bodies: { name: string; kind: Body["kind"] }[];
  arrays: {
    name: string;
    type: "f32" | "i32" | "i16";
    shape: [number, number];
    offset: number;
    scale?: number;
    shift?: [number, number, number];
  }[];
}

/** @throws Error  the bytes are no frame */
export function readLive(bytes: ArrayBuffer): { head: LiveHead; arrays: Map<string, any> } {
  const view = new DataView(bytes);
  if (bytes.byteLength < 8 || view.getUint32(0, true) !== 0x31464d41) throw new Error("no frame");
  const length = view.getUint32(4, true);
  const head: LiveHead = JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, 8, length)));
  const arrays = new Map<string, any>();
  for (const a of head.arrays) {
    const at = 8 + length + a.offset;
    const count = a.shape[0] * a.shape[1];
    if (a.type === "i16") {
      const coarse = new Int16Array(bytes, at, count);
      const points = new Float32Array(count);
      const scale = a.scale!;
      const [x, y, z] = a.shift!;
      for (let i = 0; i < count; i += 3) {
        points[i] = coarse[i] * scale + x;
        points[i + 1] = coarse[i + 1] * scale + y;
        points[i + 2] = coarse[i + 2] * scale + z;
      }
      arrays.set(a.name, points);
    } else if (a.type === "i32") {
      arrays.set(a.name, new Uint32Array(bytes, at, count));
    } else {
      arrays.set(a.name, new Float32Array(bytes, at, count));
    }
  }
  return { head, arrays };
}

/** Frames leave out what did not change: this keeps it. */
export class LiveReader {
  seq = 0;
  private bodies = new Map<string, Body>();
  private start = new Map<string, Float32Array>();

  /** Points of a body where the scene begins, if that was seen. */
  startOf(name: string): Float32Array | undefined {
    return this.start.get(name);
  }

  /** @return null: a frame in between was missed, request a whole one (after = 0). */
  take(bytes: ArrayBuffer): (Instant & { done: boolean }) | null {
    const { head, arrays } = readLive(bytes);
    if (head.before !== 0 && head.before !== this.seq) {
      this.seq = 0;
      return null;
    }
    if (head.before === 0) this.bodies.clear();
    this.seq = head.seq;
    for (const { name, kind } of head.bodies) {
      const points: Float32Array = arrays.get(name + "/points");
      const values: Float32Array | undefined = arrays.get(name + "/values");
      const triangles: Uint32Array =
        arrays.get(name + "/triangles") ?? this.bodies.get(name)?.triangles ?? new Uint32Array();
      const fields: Field[] = [];
      if (kind === "solid") {
        fields.push({
          name: "von Mises stress",
          unit: "Pa",
          values: values ?? new Float32Array(points.length / 3),
        });
      }
      if (kind === "solid" || kind === "rigid") {
        // From where the scene begins, if that was seen: else there is nothing to measure from.
        if (head.step <= 0) this.start.set(name, points);
        const from = this.start.get(name);
        if (from?.length === points.length)
          fields.push(lazy("distance moved", "m", () => distances(points, from)));
      }
      this.bodies.set(name, {
        name,
        kind,
        points,
        triangles,
        fields,
        radius: kind === "wire" ? values : undefined,
        faces: arrays.get(name + "/faces") ?? this.bodies.get(name)?.faces,
      });
    }
    return {
      step: head.step,
      time: head.time,
      caption: head.caption,
      done: head.done,
      bodies: [...this.bodies.values()],
      contacts: arrays.get("/contacts") ?? new Float32Array(),
      normals: arrays.get("/normal_forces"),
      pairs: arrays.get("/pairs"),
      names: head.names,
    };
  }
}

/** A field whose values are made when they are first shown. */
function lazy(name: string, unit: string, make: () => Float32Array): Field {
  let made: Float32Array | null = null;
  return {
    name,
    unit,
    get values() {
      return (made ??= make());
    },
  };
}

function distances(a: Float32Array, b: Float32Array): Float32Array {
  const out = new Float32Array(a.length / 3);
  for (let i = 0; i < out.length; ++i) {
    const x = a[3 * i] - b[3 * i];
    const y = a[3 * i + 1] - b[3 * i + 1];
    const z = a[3 * i + 2] - b[3 * i + 2];
    out[i] = Math.sqrt(x * x + y * y + z * z);
  }
  return out;
}

// ---- the files of a run: VTK's XML with appended raw data, as amontons writes it

interface VtkArray {
  name: string;
  unit: string;
  columns: number;
  data: Float64Array | Float32Array | Int32Array | Uint8Array | BigInt64Array | Int8Array;
}

interface VtkPiece {
  points: number;
  groups: Map<string, VtkArray[]>; // Points, PointData, CellData, Cells, Lines, Polys
}

const kTypes: Record<string, any> = {
  Float64: Float64Array,
  Float32: Float32Array,
  Int32: Int32Array,
  Int64: BigInt64Array,
  UInt8: Uint8Array,
  Int8: Int8Array,
};

function readVtk(bytes: ArrayBuffer): VtkPiece {
  const raw = new Uint8Array(bytes);
  const marker = "<AppendedData";
  const head = new TextDecoder("latin1").decode(raw.subarray(0, Math.min(raw.length, 1 << 20)));
  const at = head.indexOf(marker);
  const data = head.indexOf("_", head.indexOf(">", at)) + 1;
  const xml = new DOMParser().parseFromString(
    (at < 0 ? head : head.slice(0, at)) + (at < 0 ? "" : "</VTKFile>"),
    "text/xml",
  );
  const piece = xml.querySelector("Piece");
  if (!piece) throw new Error("no piece in a file of the run");
  const groups = new Map<string, VtkArray[]>();
  for (const group of piece.children) {
    const arrays: VtkArray[] = [];
    for (const a of group.children) {
      if (a.tagName !== "DataArray" || a.getAttribute("format") !== "appended") continue;
      const type = kTypes[a.getAttribute("type") ?? ""];
      if (!type) continue;
      const begin = data + Number(a.getAttribute("offset"));
      const size = Number(new DataView(bytes).getBigUint64(begin, true));
      const part = bytes.slice(begin + 8, begin + 8 + size); // aligned
      arrays.push({
        name: a.getAttribute("Name") ?? "",
        unit: a.querySelector('InformationKey[name="UNITS_LABEL"]')?.textContent ?? "",
        columns: Number(a.getAttribute("NumberOfComponents") ?? 1),
        data: new type(part),
      });
    }
    groups.set(group.tagName, arrays);
  }
  return { points: Number(piece.getAttribute("NumberOfPoints")), groups };
}

function numbers(a: VtkArray | undefined): Float64Array {
  return a ? Float64Array.from(a.data as any, Number) : new Float64Array();
}

const kFaces: Record<number, number[][]> = {
  10: [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], // T4
  24: [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], // T10: corners
  12: [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]], // H8
};

/** Triangles of the outside of a solid: faces that one element alone has. */
function outside(cells: VtkArray[]): Uint32Array {
  const find = (n: string) => numbers(cells.find((c) => c.name === n));
  const corner = find("connectivity");
  const ends = find("offsets");
  const types = find("types");
  const faces = new Map<string, number[] | null>();
  for (let c = 0, begin = 0; c < ends.length; begin = ends[c], ++c) {
    for (const local of kFaces[types[c]] ?? []) {
      const face = local.map((i) => corner[begin + i]);
      const key = [...face].sort((a, b) => a - b).join();
      faces.set(key, faces.has(key) ? null : face);
    }
  }
  const out: number[] = [];
  for (const face of faces.values()) {
    if (!face) continue;
    for (let i = 2; i < face.length; ++i) out.push(face[0], face[i - 1], face[i]);
  }
  return Uint32Array.from(out);
}

/** Only the points that triangles name. */
function compact(triangles: Uint32Array, points: number): { used: Int32Array; triangles: Uint32Array } {
  const place = new Int32Array(points).fill(-1);
  const used: number[] = [];
  const out = new Uint32Array(triangles.length);
  for (let i = 0; i < triangles.length; ++i) {
    const p = triangles[i];
    if (place[p] < 0) {
      place[p] = used.length;
      used.push(p);
    }
    out[i] = place[p];
  }
  return { used: Int32Array.from(used), triangles: out };
}

function polygons(arrays: VtkArray[]): Uint32Array {
  const corner = numbers(arrays.find((a) => a.name === "connectivity"));
  const ends = numbers(arrays.find((a) => a.name === "offsets"));
  const out: number[] = [];
  for (let c = 0, begin = 0; c < ends.length; begin = ends[c], ++c)
    for (let i = begin + 2; i < ends[c]; ++i) out.push(corner[begin], corner[i - 1], corner[i]);
  return Uint32Array.from(out);
}

const kNames: Record<string, string> = {
  von_mises_averaged: "von Mises stress",
  contact_pressure: "contact pressure",
  displacement: "displacement",
};

export type Contacts = Pick<Instant, "contacts" | "normals" | "pairs">;

/** A body of a run, or its contacts. */
export function readPart(name: string, path: string, bytes: ArrayBuffer): Body | Contacts {
  const { points: count, groups } = readVtk(bytes);
  const places = numbers(groups.get("Points")?.[0]);
  const pointData = groups.get("PointData") ?? [];
  if (name === "contacts") {
    const of = (n: string) => numbers(pointData.find((a) => a.name === n));
    const force = of("force");
    const normal = of("normal");
    const along = of("normal_force");
    const [first, other] = [of("body_a"), of("body_b")];
    const contacts = new Float32Array(6 * count);
    const normals = new Float32Array(3 * count);
    const pairs = new Uint32Array(2 * count);
    for (let i = 0; i < count; ++i) {
      for (let k = 0; k < 3; ++k) {
        contacts[6 * i + k] = places[3 * i + k];
        contacts[6 * i + 3 + k] = force[3 * i + k] ?? 0;
        normals[3 * i + k] = (normal[3 * i + k] ?? 0) * (along[i] ?? 0);
      }
      pairs[2 * i] = first[i] ?? 0;
      pairs[2 * i + 1] = other[i] ?? 0;
    }
    return { contacts, normals, pairs };
  }
  const solid = path.endsWith(".vtu");
  const all = solid ? outside(groups.get("Cells") ?? []) : polygons(groups.get("Polys") ?? []);
  const wire = all.length === 0;
  const { used, triangles } = wire
    ? { used: Int32Array.from({ length: count }, (_, i) => i), triangles: all }
    : compact(all, count);
  const points = new Float32Array(3 * used.length);
  used.forEach((p, i) => {
    for (let k = 0; k < 3; ++k) points[3 * i + k] = places[3 * p + k];
  });
  const fields: Field[] = [];
  let radius: Float32Array | undefined;
  for (const a of pointData) {
    if (a.columns !== 1 && a.columns !== 3) continue;
    if (a.data.length !== a.columns * count) continue;
    const v = new Float32Array(used.length);
    const d = a.data as any;
    used.forEach((p, i) => {
      v[i] =
        a.columns === 1 ? Number(d[p]) : Math.hypot(Number(d[3 * p]), Number(d[3 * p + 1]), Number(d[3 * p + 2]));
    });
    if (wire && a.name === "radius") radius = v;
    fields.push({ name: kNames[a.name] ?? a.name.replaceAll("_", " "), unit: a.unit, values: v });
  }
  return { name, kind: wire ? "wire" : solid ? "solid" : "rigid", points, triangles, fields, radius };
}
